"""Filaments on YADE: beam theory, conservation, drag, bits after a resume, and a pair and a pour beside links."""

import math
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import filament_cases
import numpy as np
import pytest
import yaml
from beams import elastica
from filament_cases import DENSITY, WORM, D, E, L
from stopping import assert_equal_frames
from test_bodies import run

from dem.record.run import Run

Simulate = Callable[..., dict[str, Any]]
B, MU = E * math.pi * D**4 / 64, DENSITY * math.pi * D**2 / 4
SLOWEST = 3.5160 * math.sqrt(B / MU / L**4)  # first bending frequency of a cantilever [rad/s]


def gravity(load: float) -> float:
    """Gravity at which the weight per length is `load` B/L³ [m/s²]."""
    return load * B / L**3 / MU


def test_a_cantilever_bends_far_as_beam_theory_says(simulate: Simulate) -> None:
    found = simulate(filament_cases.sagged, 12, gravity(10.0), SLOWEST) / L
    np.testing.assert_allclose(found, elastica(10.0), rtol=1e-2)


def test_the_error_of_the_sag_is_that_of_weights_at_nodes(simulate: Simulate) -> None:
    # 1/3n² of n segments: the trapezoid rule, since deflections by loads on nodes are exact.
    for segments in (5, 10):
        found = simulate(filament_cases.sagged, segments, gravity(0.05), SLOWEST)[1] / L
        assert found / (-0.05 / 8) - 1 == pytest.approx(1 / (3 * segments**2), rel=0.05)


def test_a_cantilever_vibrates_and_decays_as_beam_theory_says(simulate: Simulate) -> None:
    for time, frequency, least in ((0.0, SLOWEST, 0.0), (0.04 / SLOWEST, SLOWEST, 0.02 * SLOWEST)):
        found = simulate(filament_cases.vibrating, 10, gravity(0.05), SLOWEST, time)
        times, heights = found["times"], found["heights"]
        (k,) = np.nonzero(np.diff(np.sign(heights)))
        zeros = times[k] + heights[k] / (heights[k] - heights[k + 1]) * (times[1] - times[0])
        assert len(zeros) >= 7
        assert math.pi * (len(zeros) - 1) / (zeros[-1] - zeros[0]) == pytest.approx(frequency, rel=1e-2)
        size = np.abs(heights)
        peaks = 1 + np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:]))
        # Kelvin and Voigt: amplitudes fall at the rate τω²/2. Damped shear alone takes next to nothing.
        decay = -np.polyfit(times[peaks], np.log(size[peaks]), 1)[0]
        assert decay == pytest.approx(least, rel=0.01, abs=5e-4 * SLOWEST)


def test_a_strut_buckles_at_eulers_load(simulate: Simulate) -> None:
    # A weight that bends it by 1e-4 L. After buckling P/P_E = 1 + δ/2L for ends that come nearer by δ.
    euler, short = math.pi**2 * B / L**2, 0.02
    loads = simulate(filament_cases.buckled, 10, math.pi**2 * math.sqrt(B / MU / L**4), short * L, gravity(0.0077))
    squeezed = euler / (E * math.pi * D**2 / 4)
    assert loads[-1] == pytest.approx(loads[-2], rel=1e-3)
    assert loads[-1] == pytest.approx(euler * (1 + (short - squeezed) / 2), rel=0.01)


@pytest.mark.parametrize("damped", [False, True])
def test_a_free_filament_keeps_momentum_and_accounts_for_energy(simulate: Simulate, *, damped: bool) -> None:
    found = simulate(filament_cases.free, damped, 10_000)
    rows, scale = found["rows"], found["scale"]
    steady = rows[:, [0, 1, 5]] - rows[0, [0, 1, 5]]  # what the little gravity does not change
    assert np.abs(steady[:, :2]).max() < 1e-12 * scale
    assert np.abs(steady[:, 2]).max() < 1e-12 * scale * L
    energies = rows[:, 6:].sum(axis=1)
    # Undamped, YADE's rotations of first order show; the vigorous motion goes on for 100 periods of the first mode.
    assert np.ptp(energies) < (5e-4 if damped else 2e-2) * energies[0]
    assert rows[-1, 8] > (0.5 if damped else 0.0) * energies[0]


def test_a_filament_returns_to_the_curvature_that_it_prefers(simulate: Simulate) -> None:
    found = simulate(filament_cases.resting)
    # A polygon of ten sides that each turn by 0.3 rad.
    assert found["chord"] == pytest.approx(0.003 * math.sin(1.5) / math.sin(0.15), rel=5e-3)
    bent = WORM["young_modulus_Pa"] * math.pi * WORM["diameter_m"] ** 4 / 64 * 100**2 * 0.03 / 2
    assert found["added"] == pytest.approx(bent, rel=1e-3)
    assert found["damped"] == pytest.approx(bent, rel=5e-2)  # of first order in the time step
    assert found["left"] < 1e-3 * bent


def test_drag_and_buoyancy_follow_their_formulas(simulate: Simulate) -> None:
    found = simulate(filament_cases.sinking)
    across = 4 * math.pi * 0.1 / (math.log(L / D) + 0.5)
    weight = 0.2 * MU * 9.81
    for name, drag in (("across", across), ("along", across / 2)):
        # Drag lags by a step of a quarter of a percent of the time in which it slows a filament.
        reached = 1 - math.exp(-drag / MU * 0.35)
        assert found[name] == pytest.approx(reached * weight / drag, rel=5e-3)
        assert found[f"{name} energy"] == pytest.approx(1.0, abs=5e-3)
        assert found[f"{name} impulse"] == pytest.approx(1.0, rel=1e-9)


def test_rolling_decays_at_the_rate_of_its_drag(simulate: Simulate) -> None:
    drag = 1e-3
    found = simulate(filament_cases.rolling, drag, drag / (DENSITY * math.pi * D**4 / 32))
    assert found["left"] == pytest.approx(math.exp(-2), rel=4e-3)
    assert found["dragged"] == pytest.approx(1.0, abs=5e-3)


def test_a_pair_falls_and_collides_as_on_links(simulate: Simulate) -> None:
    links, yade = (simulate(filament_cases.pair, engine, 0.038)["rows"] for engine in ("links", "yade"))
    times = np.linspace(1e-3, 0.037, 73)
    both = [np.stack([np.interp(times, rows[:, 0], values) for values in rows.T[1:]]) for rows in (links, yade)]
    heights, speeds = np.abs(both[0][:2] - both[1][:2]), np.abs(both[0][2:4] - both[1][2:4])
    # Before any contact the two are one parabola; then contacts of nodes with the floor, one each on YADE and one for
    # each end of a segment on links, begin to differ in duration.
    falling = times < 0.02
    assert heights[:, falling].max() < 0.02 * filament_cases.WORM["diameter_m"]
    assert heights.max() < 0.1 * filament_cases.WORM["diameter_m"]
    assert speeds[:, -1].max() < 0.1 * np.abs(both[0][2:4]).max()
    assert both[0][2:4].max() > 0.05  # the lower one went up again


@pytest.mark.parametrize(("place", "angle", "stiffer"), [
    ((1.5e-3, 1.5e-3), math.pi / 2, 1.0),  # in the middles of a segment of each
    ((4.5e-3, 1e-3), 1.2, 1.0),
    ((1.5e-3, 14.8e-3), math.pi / 2, 1.0),  # a tip
    ((0.0, 0.0), math.pi / 2, 4.0),  # nodes, where YADE counts all four pairs of segments
])  # fmt: skip
def test_a_hit_gives_as_much_momentum_as_on_links(
    simulate: Simulate, place: tuple[float, float], angle: float, stiffer: float
) -> None:
    links, yade = (simulate(filament_cases.hit, engine, place, angle) for engine in ("links", "yade"))
    assert yade["momentum"] < 1e-6 * 0.2
    if stiffer == 1:
        assert yade["gained"] == pytest.approx(links["gained"], rel=0.05)
        assert yade["deepest"] == pytest.approx(links["deepest"], rel=0.02)
        assert yade["time"] == pytest.approx(links["time"], rel=0.06)
    else:
        assert yade["gained"] == pytest.approx(links["gained"], rel=0.2)
        assert 0.4 * links["deepest"] < yade["deepest"] < 0.6 * links["deepest"]


def pour(engine: str, count: int) -> dict[str, Any]:
    return {
        "schema_version": 1,
        "seed": 1,
        "count": count,
        "engine": engine,
        "particle": WORM | {"poured_bend_deg": 200, "curvature_per_m": 20},
        "container": {"radius_m": 0.012},
        "contact": {"friction_smarticle": 0.3, "friction_wall": 0.3, "restitution": 0.4},
        "fidelity": {"base": "draft", "stiffness_N_per_m": 10},
        "phases": [
            {"type": "deposit", "per_layer": 4},
            {"type": "shake", "duration_s": 0.1, "frequency_hz": 30, "peak_acceleration_g": 2},
            {"type": "remove-container", "duration_s": 0.1},
        ],
        "recording": {
            "series_interval_s": 5e-3, "frame_interval_s": 0.025, "checkpoint_interval_s": 0.05, "energy": True
        },
    }  # fmt: skip


def test_a_pile_is_poured_shaken_and_freed_and_goes_on_with_the_same_bits(tmp_path: Path) -> None:
    scene, whole, parts = tmp_path / "scene.yaml", tmp_path / "whole", tmp_path / "parts"
    scene.write_text(yaml.safe_dump(pour("yade", 8)))
    run(scene, whole)
    series = Run(whole).series
    when = float(series.time[series["phase"] == 1].mean())  # while it is shaken
    run(scene, parts, str(when))
    assert Run(parts).status.state == "interrupted"
    run(scene, parts, "resume")
    assert_equal_frames(Run(whole), Run(parts))
    for name, values in Run(parts).series.items():
        np.testing.assert_array_equal(values, series[name], err_msg=name)
    last = Run(whole).frames[-1]
    lengths = np.linalg.norm(last.segments[:, 1] - last.segments[:, 0], axis=1)
    np.testing.assert_allclose(lengths, 0.003, rtol=0.01)
    assert last.segments[..., 2].min() > 0.4 * WORM["diameter_m"]
    assert last.contacts.sum() > 0
    for name in ("stretching_energy_J", "bending_energy_J", "twisting_energy_J"):
        assert (series[name] >= 0).all()
        assert series[name].max() > 0
    assert np.abs(series["container_work_J"]).max() > 0


@pytest.mark.long
def test_small_piles_are_as_dense_and_as_high_as_on_links(worker: ProcessPoolExecutor, tmp_path: Path) -> None:
    seeds = range(1, 7)
    links, yade = (
        [worker.submit(filament_cases.poured, engine, k, str(tmp_path / f"{engine}{k}")).result(1800) for k in seeds]
        for engine in ("links", "yade")
    )
    for name in ("poured fraction", "poured height", "shaken fraction", "shaken height"):
        one, other = (np.array([found[name] for found in each]) for each in (links, yade))
        error = math.hypot(one.std(ddof=1), other.std(ddof=1)) / math.sqrt(len(seeds))
        # Standard errors are 3 to 5 % of the means.
        assert abs(one.mean() - other.mean()) < 3 * error, name
    assert max(found["poured unbalanced"] for found in yade) < 0.05
