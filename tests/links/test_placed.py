"""Bodies at poses from a file, on links: they begin where the file says; what hangs, holds and bears is known."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import SMALL, changed
from stopping import assert_goes_on

from dem.errors import RunError
from dem.record.run import Run
from dem.run.build import build_engine
from dem.run.run import run_scene
from dem.scene.reading import load_scene, parse_scene
from dem.scene.scene import Scene
from postprocess.measures.axial_force import axial_forces
from postprocess.measures.registry import frame_measures

G = 9.81
WORM: dict[str, Any] = {
    "shape": "filament",
    "length_m": 0.03,
    "diameter_m": 8e-4,
    "segments": 12,
    "young_modulus_Pa": 2e5,
    "stretching_time_s": 1e-3,
    "bending_time_s": 2e-3,
}
NECKLACE: dict[str, Any] = {
    "shape": "chain",
    "links": 8,
    "link_m": 0.004,
    "diameter_m": 0.001,
    "joints": {"law": "free", "axes": 3},
}
ARM: dict[str, Any] = {
    **NECKLACE,
    "joints": {
        "law": "motor",
        "torque_limit_N_m": 1e-3,
        "stiffness_N_m_per_rad": 1e-3,
        "damping_N_m_s_per_rad": 1e-6,
        "speed_limit_rad_per_s": 1,
    },
}
HOLD = {"type": "lift", "bodies": [0], "nodes": [0], "distance_m": 0, "speed_m_per_s": 0.01, "duration_s": 0.2}


def write(folder: Path, bodies: Any) -> None:
    rows = [f"{k},{x!r},{y!r},{z!r}" for k, body in enumerate(bodies) for x, y, z in np.asarray(body).tolist()]
    (folder / "poses.csv").write_text("\n".join(["body,x [m],y [m],z [m]", *rows]) + "\n")


def scene(folder: Path, bodies: Any, *phases: Any, **changes: Any) -> Scene:
    write(folder, bodies)
    everything: dict[str, Any] = {
        "engine": "links",
        "count": len(bodies),
        "container": {"radius_m": 0.02, "height_m": 0.06},
        "contact": {"restitution": 0.3},
        "phases": [{"type": "place", "file": "poses.csv"}, *phases],
        "recording": {"series_interval_s": 5e-3, "frame_interval_s": 0.025, "checkpoint_interval_s": 0.05},
    }
    return parse_scene(changed({**SMALL, **everything}, changes), source="scene.yaml", folder=folder)


def straight(count: int, step: float, *, x: float = 0.0, top: float = 0.05) -> NDArray[np.float64]:
    """Points of a body that hangs down from a place."""
    return np.array([[x, 0.0, top - step * k] for k in range(count + 1)])


def zigzag(count: int, step: float, *, angle: float) -> NDArray[np.float64]:
    """Points of a body in a horizontal plane, bent by ± an angle [rad] at every joint."""
    headings = angle / 2 * (-1.0) ** np.arange(count)
    edges = step * np.stack([np.cos(headings), np.sin(headings), 0 * headings], axis=1)
    return np.array([-0.013, 0.0, 0.03]) + np.concatenate([np.zeros((1, 3)), np.cumsum(edges, axis=0)])


@pytest.mark.parametrize(
    ("particle", "points"),
    [
        (None, [[-5e-3, 8e-3, 0.02], [-5e-3, 0.0, 0.02], [5e-3, 0.0, 0.02], [5e-3, 8e-3, 0.02]]),
        ({"shape": "rod", "length_m": 0.012, "diameter_m": 1e-3}, straight(1, 0.012)),
        (WORM, zigzag(12, 0.0025, angle=0.5)),
        (NECKLACE, zigzag(8, 0.004, angle=1.0)),
        (ARM, zigzag(8, 0.004, angle=0.4)),
    ],
)
def test_a_body_of_any_shape_begins_where_the_file_says(particle: Any, points: Any, tmp_path: Path) -> None:
    points = np.array(points)
    particle = (
        {"smarticle": {"middle_length_m": 0.01, "aspect_ratio": 0.8}} if particle is None else {"particle": particle}
    )
    made = scene(
        tmp_path, [points + np.array([0, 4e-3, 4e-3]), points], {"type": "relax", "duration_s": 0.1}, **particle
    )
    engine = build_engine(made, 1e-6)
    stage = made.phases[0].begin(made, 0)
    assert stage.proceed(engine) == engine.time_step
    state = engine.state()
    found = state.smarticles.vertices[1] if state.bodies is None else state.bodies.segments.reshape(2, -1, 2, 3)[1]
    wanted = points if state.bodies is None else np.stack([points[:-1], points[1:]], axis=1)
    np.testing.assert_allclose(found, wanted, atol=1e-9)
    assert state.kinetic_energy == 0
    # Bodies that are bent have energy from the beginning.
    height = float(state.positions[:, 2].mean())
    known = made.count * made.model.mass * G * height + engine.ledger.elastic()[1]
    assert engine.ledger.added == pytest.approx(known, rel=1e-9)
    engine.advance(1)
    assert stage.proceed(engine) == 0


def test_the_energy_of_overlapping_poses_is_in_the_ledger_from_the_first_step_on(tmp_path: Path) -> None:
    # Two crossed rods, 4 % of a diameter in each other, without gravity: energy comes from this contact alone.
    diameter, depth, stiffness = 1e-3, 4e-5, 500.0
    rods = np.array([[[-5e-3, 0, 0.03], [5e-3, 0, 0.03]], [[0, -5e-3, 0.03], [0, 5e-3, 0.03]]])
    rods[1, :, 2] += diameter - depth
    made = scene(
        tmp_path,
        rods,
        {"type": "relax", "duration_s": 0.02},
        particle={"shape": "rod", "length_m": 0.01, "diameter_m": diameter},
        gravity_m_per_s2=0,
        fidelity={"stiffness_N_per_m": stiffness, "time_step_fraction": 0.05},
        recording={"series_interval_s": 1e-3, "frame_interval_s": 1e-2, "dissipation_interval_s": 1e-3},
    )
    run_scene(made, tmp_path / "run", command="")
    series = Run(tmp_path / "run").series
    stored = stiffness / 2 * depth**2
    assert series["added_energy_J"][1:] == pytest.approx(stored, rel=1e-6)
    assert series["kinetic_energy_J"][-1] > 0.05 * stored
    assert series["dissipated_energy_J"][-1] > 0.5 * stored
    assert np.abs(series["energy_residual_J"][1:]).max() < 0.01 * stored


def test_motors_hold_where_they_were_put_and_turn_back_at_their_speed(tmp_path: Path) -> None:
    still = {"gravity_m_per_s2": 0, "particle": ARM}
    made = scene(tmp_path, [zigzag(8, 0.004, angle=0.4)], {"type": "relax", "duration_s": 0.1}, **still)
    run_scene(made, tmp_path / "run", command="")
    run = Run(tmp_path / "run")
    edges = run.frames[len(run.frames) - 1].segments
    along = (edges[:, 1] - edges[:, 0]) / 0.004
    turned = np.arccos(np.clip((along[1:] * along[:-1]).sum(axis=1), -1, 1))
    # By 1 rad/s towards 0, the angles as poured, from 0.4 rad.
    np.testing.assert_allclose(turned, 0.4 - run.frames[len(run.frames) - 1].time, atol=0.02)


def over_a_bar(left: int, right: int) -> NDArray[np.float64]:
    """Points of a worm over a round bar along x at a height of 30 mm: so many segments on either side of its top."""
    radius, step = 0.0019, 0.0025  # of the axis: segments cut corners

    def side(number: int, sign: int) -> list[tuple[float, float]]:
        found, at = [], 0.0
        for _ in range(number):
            low, high = at, at + 2 * step
            for _ in range(60):
                middle = (low + high) / 2
                low, high = (middle, high) if math.dist(place(at), place(middle)) < step else (low, middle)
            at = low
            found.append((sign * place(at)[0], place(at)[1]))
        return found

    def place(arc: float) -> tuple[float, float]:
        quarter = math.pi / 2 * radius
        if arc < quarter:
            return radius * math.sin(arc / radius), 0.03 + radius * math.cos(arc / radius)
        return radius, 0.03 - (arc - quarter)

    path = [*side(left, -1)[::-1], (0.0, 0.03 + radius), *side(right, 1)]
    return np.array([(0.005, y, z) for y, z in path])


HOOKS = {"side_m": 0.002, "length_m": 0.02, "lower_height_m": 0.0015, "upper_height_m": 0.03}


def hung(folder: Path, left: int, right: int, friction: float) -> Run:
    contact = {"friction_wall": friction, "friction_smarticle": friction, "restitution": 0.3}
    soft = {**WORM, "young_modulus_Pa": 2e4}
    made = scene(
        folder,
        [over_a_bar(left, right)],
        {"type": "relax", "duration_s": 0.2},
        particle=soft,
        hooks=HOOKS,
        contact=contact,
        fidelity={"base": "draft", "stiffness_N_per_m": 10},
    )
    run_scene(made, folder / "run", command="")
    return Run(folder / "run")


def test_a_worm_hangs_over_a_bar_or_slides_to_its_heavier_side(tmp_path: Path) -> None:
    for name in ("even", "odd"):
        (tmp_path / name).mkdir()
    run = hung(tmp_path / "even", 6, 6, 0.3)
    ends = run.frames[len(run.frames) - 1].segments[[0, -1], [0, 1]]
    np.testing.assert_allclose(ends[0] * [1, -1, 1], ends[1], atol=1e-9)  # symmetric, and in its plane
    assert ends[:, 2].max() < 0.025
    run = hung(tmp_path / "odd", 8, 4, 0.05)
    last = run.frames[len(run.frames) - 1].segments
    assert last[..., 2].max() < 0.03  # off the bar
    middle = next(frame for frame in run.frames if frame.time > 0.039).segments[[0, -1], [0, 1], 2]
    moved = middle - over_a_bar(8, 4)[[0, -1], 2]
    assert moved[0] < -1e-3  # the long side went down, the short one up
    assert moved[1] > 1e-3


@pytest.mark.parametrize(("particle", "count", "step"), [(WORM, 12, 0.0025), (NECKLACE, 8, 0.004)])
def test_what_hangs_bears_the_weight_below_and_the_others_fall(
    particle: dict[str, Any], count: int, step: float, tmp_path: Path
) -> None:
    bodies = [straight(count, step), straight(count, step, x=0.005)]
    made = scene(tmp_path, bodies, HOLD, particle=particle)
    run_scene(made, tmp_path / "run", command="")
    run = Run(tmp_path / "run")
    frame = run.frames[len(run.frames) - 1]
    weight = made.model.mass * G
    forces = axial_forces(frame, run)[frame.body == 0] / weight
    below = count - 1 - np.arange(count) + (0.5 if particle is WORM else 0.0)  # at the middle of a segment, at a joint
    if particle is NECKLACE:
        assert np.isnan(forces[-1])
        forces, below = forces[:-1], below[:-1]
    np.testing.assert_allclose(forces, below / count, atol=2e-3)
    held = run.series["grip_force_N" if particle is WORM else "held_force_N"][-1]
    np.testing.assert_allclose(held, [0, 0, weight], atol=1e-3 * weight)
    tops = [frame.segments[frame.body == k][..., 2].max() for k in range(2)]
    assert tops[0] == pytest.approx(0.05, abs=1e-6)
    assert tops[1] < 0.045
    (measure,) = (each for each in frame_measures((), ()) if each.name == "axial force")
    assert measure.columns(frame, run)["greatest axial force [N]"] == pytest.approx(weight * below[0] / count, rel=0.01)
    (run.path / "scene.yaml").unlink()
    assert np.isnan(measure.columns(frame, Run(run.path))["greatest axial force [N]"])


def test_a_run_goes_on_and_begins_anew_after_its_file_is_gone(tmp_path: Path) -> None:
    made = scene(tmp_path, [straight(12, 0.0025)], HOLD, particle=WORM)
    run_scene(made, tmp_path / "whole", command="")
    (tmp_path / "poses.csv").unlink()
    whole = Run(tmp_path / "whole")
    assert_goes_on(load_scene(whole.path / "scene.yaml"), whole, tmp_path / "stopped", 0.1)


def test_a_frame_of_filaments_is_a_start(tmp_path: Path) -> None:
    made = scene(tmp_path, [straight(12, 0.0025), straight(12, 0.0025, x=0.006)], HOLD, particle=WORM)
    run_scene(made, tmp_path / "run", command="")
    frame = Run(tmp_path / "run").frames[6]
    again = scene(tmp_path, [], count=2, particle=WORM, **{"phases.0.file": str(frame.path.relative_to(tmp_path))})
    engine = build_engine(again, 1e-6)
    again.phases[0].begin(again, 0).proceed(engine)
    bodies = engine.state().bodies
    assert bodies is not None
    np.testing.assert_allclose(bodies.segments, frame.segments, atol=1e-12)


def test_rigid_bodies_are_gripped_by_number(tmp_path: Path) -> None:
    rods = [straight(1, 0.01, x=x) for x in (-0.005, 0.0, 0.005)]
    lift = {"type": "lift", "bodies": [2, 0], "distance_m": 0.001, "speed_m_per_s": 0.02, "duration_s": 0.1}
    particle = {"shape": "rod", "length_m": 0.01, "diameter_m": 1e-3}
    run_scene(scene(tmp_path, rods, lift, particle=particle), tmp_path / "run", command="")
    run = Run(tmp_path / "run")
    frame = run.frames[len(run.frames) - 1]
    np.testing.assert_allclose(frame.segments[[0, 2], 0, 2], 0.051, atol=1e-6)
    assert frame.segments[1, 0, 2] < 0.04
    assert run.series["grip_moved_count"][-1] == 2


def test_two_bodies_hooked_into_each_other_are_pulled_apart_by_number(tmp_path: Path) -> None:
    crown, leg = 0.011, 0.007
    staple = {"shape": "staple", "crown_m": crown, "leg_m": leg, "diameter_m": 1e-3}
    low, high = 0.02, 0.025
    # One opens upwards, the other downwards and across; their crowns are apart by the length of a leg at most.
    up = [(-crown / 2, 0, low + leg), (-crown / 2, 0, low), (crown / 2, 0, low), (crown / 2, 0, low + leg)]
    down = [(0, -crown / 2, high - leg), (0, -crown / 2, high), (0, crown / 2, high), (0, crown / 2, high - leg)]
    third = [(x + 0.012, y, z - 0.015) for x, y, z in up]
    pull = {"type": "tension", "bodies": [[1], [0]], "distance_m": 0.003, "speed_m_per_s": 0.05}
    made = scene(tmp_path, [up, down, third], pull, particle=staple)
    run_scene(made, tmp_path / "run", command="")
    series = Run(tmp_path / "run").series
    held = np.flatnonzero(np.isfinite(series["elongation_m"]))
    assert (series["grip_fixed_count"][held] == 1).all()
    assert (series["grip_moved_count"][held] == 1).all()
    assert series["elongation_m"][held][-1] == pytest.approx(0.003, rel=0.1)


def test_a_filament_that_is_lighter_than_its_liquid_rises_and_leaves_over_the_wall(tmp_path: Path) -> None:
    light = {**WORM, "density_kg_per_m3": 900, "young_modulus_Pa": 2e4}
    points = zigzag(12, 0.0025, angle=0.1)
    made = scene(tmp_path, [points], {"type": "relax", "duration_s": 1.0}, particle=light, liquid={})
    with pytest.raises(
        RunError, match=r"lighter than the liquid, .* risen over the wall of 0\.06 m; raise particle\.d"
    ):
        run_scene(made, tmp_path / "run", command="")
