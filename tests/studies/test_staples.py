"""The study of staples: known forces, chains of known pulls, and verdicts for data that deserve them."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from synthetic import SyntheticRun, write_frame, write_run, write_series
from synthetic.forces import pressed, write_forces
from synthetic.hooked import GRAVITY, HELD, UPPER, weight, write_hooked_run
from synthetic.shapes import W

from dem.errors import InputError
from dem.record.forces import read_forces
from dem.record.run import open_run
from postprocess.measures.pull import WINDOW
from postprocess.statistics.points import SEED
from studies import staples
from studies.staples import (
    ABOVE,
    ANGLE,
    BEFORE,
    CHAINS,
    GAMMA,
    HELD_FAST,
    LINKS,
    LOG_PEAK,
    NARROW,
    PEAK,
    POURED,
    RAISED,
    SQUARE,
    STRENGTH,
    STUDY,
    WORK,
    chains_between,
    chains_through,
)

APEX, BASE, DEPTH, TOP = 0.5, 0.4, 0.01, 0.5
PHASES = ("deposit", "relax", "shake", "relax", "remove-container", "pull-hook")


def write(directory: Path, *, phases: tuple[str, ...] = PHASES) -> Path:
    """A run of smarticles, staples of 90°, whose force is a triangle of a height over the pile's weight."""
    keys: dict[str, Any] = {"phases": phases, "packing": (DEPTH,) * len(phases), "frames_per_phase": 4}
    run = SyntheticRun(**keys, shake_time=2.0)
    total = TOP * run.count * weight(run)
    write_hooked_run(directory, run, lambda time: total * np.clip(1 - np.abs(time - APEX) / BASE, 0, None))
    path = directory / "scene.yaml"
    scene = yaml.safe_load(path.read_text())
    scene["phases"][2]["peak_acceleration_g"] = 6.0
    path.write_text(yaml.safe_dump(scene))
    return directory


def test_measures_are_those_put_in(tmp_path: Path) -> None:
    run = open_run(write(tmp_path / "one"))
    row: dict[str, Any] = STUDY.measure(run)  # type: ignore[assignment]
    highest = TOP * run.manifest.count * (1 - WINDOW / BASE / 4)
    assert (row[ANGLE], row[HELD_FAST]) == (SQUARE, 0)
    assert row[PEAK] == pytest.approx(highest, rel=1e-3)
    assert row[STRENGTH] == pytest.approx(HELD * highest, rel=1e-3)
    assert row[RAISED] == pytest.approx(APEX * W, abs=0.005 * W)
    assert row[WORK] == pytest.approx(TOP * run.manifest.count * BASE, rel=1e-3)
    assert row[BEFORE] == pytest.approx(1.0, rel=1e-5)
    centres = SyntheticRun().shares() * SyntheticRun().height(DEPTH)
    assert row[ABOVE] == pytest.approx((centres > UPPER).sum(), abs=1)
    assert np.isnan(row[CHAINS])  # no recorded forces


def test_a_test_between_grips_has_the_columns_of_a_hook(tmp_path: Path) -> None:
    run = SyntheticRun(phases=("deposit", "relax", "shake", "relax", "tension"), packing=(DEPTH,) * 5, shake_time=2.0)
    directory = write_run(tmp_path / "one", run)
    path = directory / "scene.yaml"
    scene = yaml.safe_load(path.read_text())
    grip, speed, rest, step = run.height(DEPTH) / 4, 0.01, 4.0, 0.004
    scene["gravity_m_per_s2"], scene["phases"][2]["peak_acceleration_g"] = GRAVITY, 6.0
    scene["phases"][-1] |= {"axis": "z", "grip_m": grip, "distance_m": 2 * speed, "force_limit_N": 1.0}
    path.write_text(yaml.safe_dump(scene))
    since = step * np.arange(1, 501)
    forces = np.zeros((500, 3))
    forces[:, 2] = 7 * weight(run) * np.clip(1 - np.abs(since - APEX) / BASE, 0, None)
    columns = {"elongation_m": speed * since, "grip_distance_m": 0.01 + speed * since}
    columns |= {"grip_moved_force_N": -forces, "grip_fixed_force_N": HELD * forces}
    columns |= {"time_s": rest + since, "phase": np.full(500, 4), "container_z_m": np.zeros(500)}
    write_series(directory, columns, seed=1)
    opened = open_run(directory)
    row: dict[str, Any] = STUDY.measure(opened)  # type: ignore[assignment]
    highest = 7 * (1 - WINDOW / BASE / 4)
    assert row[PEAK] == pytest.approx(highest, rel=1e-2)
    assert (row[GAMMA], row[HELD_FAST]) == (6.0, 0)
    assert row[RAISED] == pytest.approx(speed * APEX, rel=0.01)
    assert row[WORK] == pytest.approx(7 * BASE * speed / W, rel=0.01)
    centres = run.shares() * run.height(DEPTH)
    assert row[ABOVE] == (centres >= centres.max() - grip - 1e-9).sum()
    assert np.isnan([row[BEFORE], row[STRENGTH]]).all()
    free = opened.frames.in_phase(3)[-1]
    assert staples.free_between(opened, free) == pytest.approx((centres.min() + grip, centres.max() - grip), rel=5e-3)
    assert staples.force_history(opened).values.max() == pytest.approx(highest, rel=1e-2)


def test_runs_that_are_no_pull_are_left_out(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not a pour, a rest, a vibration with a rest or none, and a pull"):
        STUDY.measure(open_run(write(tmp_path / "one", phases=("deposit", "shake", "relax", "pull-hook"))))


def chain(tmp_path: Path, pairs: list[tuple[int, int]], loads: list[float]) -> tuple[Any, Any]:
    """A frame of four smarticles, 0 and 1 below 2 and 3, and forces on the first one of each pair."""
    directory = write(tmp_path / "run")
    run = SyntheticRun(count=4)
    vertices = run.vertices(DEPTH)
    vertices += ([0, 0, 1] * np.array([0.0, 0.0, 5.0, 5.0])[:, None] * W - vertices.mean(axis=1))[:, None]
    for file in (directory / "frames").glob("*.vtu"):
        write_frame(file, vertices, time=0.0, phase=0)
    write_forces(directory, pressed(pairs, loads))
    frame = open_run(directory).frames[0]
    return frame, read_forces(frame)


def test_chains_count_pulls_through_a_level(tmp_path: Path) -> None:
    # The force on the lower body points upwards: it is pulled by the upper one.
    frame, forces = chain(tmp_path, [(0, 2), (1, 3)], [1.0, 1.0])
    assert chains_through(frame, forces, 2.5 * W) == pytest.approx(2)
    assert chains_between(frame, 0.0, 4 * W, forces) == pytest.approx(2)
    assert np.isnan(chains_through(frame, forces, 9 * W))


def test_pushes_are_no_chains_and_unequal_pulls_count_less(tmp_path: Path) -> None:
    frame, forces = chain(tmp_path, [(0, 2), (1, 3), (0, 1), (2, -1)], [3.0, 1.0, 5.0, 5.0])
    assert chains_through(frame, forces, 2.5 * W) == pytest.approx(16 / 10)
    # Upside down: every force on a body below is a push.
    pushed = type(forces.contacts)(**{**vars(forces.contacts), "forces": -forces.contacts.forces})
    down = type(forces)(path=forces.path, contacts=pushed, ends=forces.ends)
    assert np.isnan(chains_through(frame, down, 2.5 * W))


def runs_of(
    tensions: dict[tuple[float, float], float],
    *,
    links: dict[tuple[float, float], float] | None = None,
    held: float = 0,
) -> pd.DataFrame:
    """Eight seeds of both angles, poured and vibrated at Γ = 6, by tension and links of each."""
    generator, rows = np.random.default_rng(5), []
    for (angle, gamma), tension in tensions.items():
        for seed in range(1, 9):
            noise = 1 + 0.1 * generator.standard_normal(4)
            poured, after = (links or {}).get((angle, 0.0), 1.0), (links or {}).get((angle, gamma), 1.0)
            rows.append(
                {ANGLE: angle, GAMMA: gamma, SEED: seed, STRENGTH: tension * noise[0], PEAK: 1 + tension * noise[0]}
                | {LOG_PEAK: np.log10(1 + tension * noise[0])}
                | {POURED: poured * noise[1], LINKS: after * noise[2], HELD_FAST: held * (angle == SQUARE)}
                | {CHAINS: 2 * noise[3]}
            )
    return pd.DataFrame(rows)


def verdicts(runs: pd.DataFrame) -> dict[str, str]:
    return {finding.id: str(finding.judge(runs).verdict) for finding in STUDY.findings}


STILL = {(NARROW, 0.0): 1.0, (SQUARE, 0.0): 1.0}


def test_the_papers_headline_is_found_in_runs_that_have_it() -> None:
    links = {(NARROW, 0.0): 1.0, (SQUARE, 0.0): 3.0, (NARROW, 6.0): 5.0, (SQUARE, 6.0): 4.0}
    found = verdicts(runs_of({**STILL, (NARROW, 6.0): 90.0, (SQUARE, 6.0): 10.0}, links=links))
    assert set(found.values()) == {"found"}


def test_three_times_as_strong_is_stronger_but_not_ten_times() -> None:
    found = verdicts(runs_of({**STILL, (NARROW, 6.0): 30.0, (SQUARE, 6.0): 10.0}))
    assert (found["narrow-stronger"], found["almost-ten-times"]) == ("found", "not found")
    assert found["vibration-strengthens-20"] == "found"


def test_the_opposite_is_not_found_and_bounds_do_not_resolve() -> None:
    found = verdicts(runs_of({**STILL, (NARROW, 6.0): 0.0, (SQUARE, 6.0): 10.0}))
    assert (found["narrow-stronger"], found["vibration-strengthens-20"]) == ("not found", "not found")
    # Those of 90° are at least as strong as their force limit, which decides nothing for those of 20°.
    bounded = verdicts(runs_of({**STILL, (NARROW, 6.0): 90.0, (SQUARE, 6.0): 10.0}, held=1))
    assert bounded["narrow-stronger"] == "not resolved"


def test_angles_come_from_the_scene(tmp_path: Path) -> None:
    run = open_run(write(tmp_path / "one"))
    run.scene["particle"] = [{"shape": "staple", "angle_deg": [20.0, 20.0]}]
    assert staples.angle_of(run) == NARROW
    for shapes in ([{"shape": "staple", "angle_deg": [20.0, 90.0]}], [{"shape": "rod"}]):
        run.scene["particle"] = shapes
        with pytest.raises(InputError, match="not staples of one kind"):
            staples.angle_of(run)
