"""Scenes with the key `particle` on links: flight, piles, kill and resume, and a staple against a smarticle."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import builds
import numpy as np
import pytest
from scenes import small
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from stopping import assert_equal_frames, run_until

from dem.body.placement import Poses, place_layer
from dem.engine.links.arrays import PLANE
from dem.engine.links.engine import LinksEngine
from dem.engine.links.motion.planar import lay_out
from dem.engine.links.shapes import smarticle_shape
from dem.engine.links.world import World
from dem.record.run import Run
from dem.run.build import build_engine
from dem.run.run import run_scene
from dem.scene.scene import Scene

G = 9.81
SHAPES: dict[str, dict[str, Any]] = {
    "rod": {"length_m": 0.014},
    "staple": {"crown_m": 0.01, "leg_m": [0.007, 0.005], "angle_deg": [70, 110], "twist_deg": [0, 40]},
    "z": {"middle_m": 0.01, "arm_m": 0.006, "angle_deg": 60, "diameter_m": 0.8e-3},
    "s": {"radius_m": 0.003, "diameter_m": 0.8e-3},
    "hook": {"shank_m": 0.009, "radius_m": 0.003},
    "c": {"radius_m": 0.005},
    "ring": {"radius_m": 0.005},
    "cross": {"arm_m": 0.006},
    "star": {"arm_m": 0.006},
    "segments": {
        "points_m": [[0, 0, 0], [0.01, 0, 0], [0, 0.008, 0], [0.01, 0.006, 0], [0.01, 0, 0.007]],
        "pairs": [[0, 1], [0, 2], [1, 3], [1, 4]],
        "diameter_m": 0.8e-3,
    },
}


def scene_of(*names: str, count: int, **changes: Any) -> Scene:
    phases = [{"type": "deposit", "per_layer": 6}, {"type": "relax", "duration_s": 0.1}]
    recording = {"series_interval_s": 0.005, "frame_interval_s": 0.05, "checkpoint_interval_s": 0.05}
    particle = [{"shape": name, **SHAPES[name]} for name in names]
    everything = {"engine": "links", "count": count, "particle": particle, "phases": phases, "recording": recording}
    return small(everything | changes)


@pytest.mark.parametrize("name", SHAPES)
def test_first_flight_is_that_of_a_free_body(name: str) -> None:
    scene, dt = scene_of(name, count=1, **{"container.radius_m": 0.2}), 2e-5
    engine = build_engine(scene, dt)
    assert isinstance(engine, LinksEngine)
    kind, turn = scene.bodies[0], Rotation.from_rotvec([0.4, -0.9, 0.3])
    engine.add(Poses(np.array([[0.0, 0.0, 0.15]]), (turn,), np.array([0])))
    bodies, spin = engine._world.bodies, np.array([30.0, 45.0, -20.0])  # in the body's frame, about no principal axis
    bodies.momentum[0] = turn.as_matrix() @ (kind.inertia * spin)
    bodies.velocity[0] = [0.1, -0.2, 1.0]
    steps = 2500  # a turn and a half
    engine.advance(steps)
    state, time = engine.state().bodies, steps * dt
    assert state is not None
    # Velocities belong to the middles of steps, so that the fall is a parabola but for half a step.
    fallen = np.array([0.1, -0.2, 1.0]) * time - [0, 0, G * time * (time + dt) / 2] + [0, 0, 0.15]
    np.testing.assert_allclose(state.positions[0], fallen, rtol=0, atol=G * dt * time)
    assert state.positions[0, 2] < 0.15 + time - 0.9 * G * time**2 / 2  # it does fall

    def euler(_: float, y: np.ndarray) -> np.ndarray:
        q, w = y[:4] / np.linalg.norm(y[:4]), y[4:]
        turned = np.array(
            [
                -q[1] * w[0] - q[2] * w[1] - q[3] * w[2],
                q[0] * w[0] + q[2] * w[2] - q[3] * w[1],
                q[0] * w[1] + q[3] * w[0] - q[1] * w[2],
                q[0] * w[2] + q[1] * w[1] - q[2] * w[0],
            ]
        )
        return np.concatenate([turned / 2, np.cross(kind.inertia * w, w) / kind.inertia])

    first = np.concatenate([turn.as_quat()[[3, 0, 1, 2]], spin])
    exact = solve_ivp(euler, (0.0, time), first, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    rotation = Rotation.from_quat(exact[[1, 2, 3, 0]] / np.linalg.norm(exact[:4])).as_matrix()
    # Second order in the step: (ω dt)² ω t / 12, a few millionths; a body that does not turn is off by 1.
    np.testing.assert_allclose(state.rotations[0], rotation, atol=1e-5)
    ends = kind.bars.ends @ rotation.T + state.positions[0]  # type: ignore[attr-defined]
    np.testing.assert_allclose(state.segments, ends, atol=1e-7)
    energy = 0.5 * kind.mass * (state.velocities[0] ** 2).sum() + 0.5 * (kind.inertia * spin**2).sum()
    assert state.kinetic_energy == pytest.approx(energy, rel=1e-9)


@pytest.mark.parametrize("name", SHAPES)
def test_a_pile_of_each_shape_settles(name: str, tmp_path: Path) -> None:
    scene = scene_of(name, count=12)
    done = run_scene(scene, tmp_path / "run", command="")
    assert done is not None
    run = Run(tmp_path / "run")
    frame, series, kinds = run.frames[-1], run.series, run.manifest.kinds
    assert kinds is not None
    assert frame.count == 12
    assert "WARNING" not in (run.path / "log.txt").read_text(encoding="utf-8")
    # At rest, apart, inside.
    assert series["max_speed_m_per_s"][-1] < 0.05
    assert series["unbalanced_force"][-1] < 0.2  # 1 in free fall; some rock for a while
    assert len(frame.segments) == 12 * kinds[0].bars
    assert frame.segments[..., 2].min() > 0
    assert np.hypot(frame.segments[..., 0], frame.segments[..., 1]).max() < scene.container.radius_m
    # The packing fraction is that of the exact volume under the second-highest centre of mass.
    lengths = np.linalg.norm(frame.segments[:, 1] - frame.segments[:, 0], axis=1)
    heights = np.bincount(frame.body, lengths * frame.segments[..., 2].mean(axis=1)) / np.bincount(frame.body, lengths)
    volume = 12 * scene.bodies[0].volume
    phi = volume / (np.pi * scene.container.radius_m**2 * np.sort(heights)[-2])
    assert series["packing_fraction"][series.nearest(frame.time)] == pytest.approx(phi, rel=1e-9)
    assert kinds[0].volume_m3 == pytest.approx(scene.bodies[0].volume, rel=1e-12)


def test_a_mixture_of_all_shapes_goes_on_with_the_same_bits(tmp_path: Path) -> None:
    scene = scene_of(*SHAPES, count=20)
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    run_scene(scene, whole, command="")
    run_until(scene, parts, 0.17)
    assert Run(parts).status.time_s < 0.9 * Run(whole).status.time_s  # type: ignore[operator]
    run_scene(scene, parts, command="", resume=True)
    one, other = Run(whole), Run(parts)
    assert len(one.frames) > 5
    assert_equal_frames(one, other)
    for name, column in one.series.data.items():
        np.testing.assert_array_equal(column, other.series[name])
    kinds = one.manifest.kinds
    assert kinds is not None
    assert {kind.shape for kind in kinds} == set(SHAPES)
    assert [kind.bodies for kind in kinds] == np.bincount(one.frames[-1].kind).tolist() == [2] * 10


def rigid_engine() -> LinksEngine:
    """An engine whose bodies have the numbers of a welded smarticle, but are rigid bodies of bars."""
    particle = builds.particle(rows=2)
    shape, row = smarticle_shape(particle), np.zeros(PLANE)
    assert shape.planar is not None
    lay_out(shape.planar, *particle.boxes.angles, row)
    lines = shape.lines.copy()
    for line, link in zip(lines, shape.link, strict=True):
        planar = shape.planar  # as `motion.poses._planar_line` has them
        start = {0: -planar.half, 1: -planar.end, 2: planar.half}[int(link)]
        along = {0: row[10:12], 1: np.array([1.0, 0.0]), 2: row[12:14]}[int(link)]
        length = 2 * planar.end if link == 1 else planar.tip
        line[0:2], line[3:5] = (start - row[0], -row[1]), length * along
    rigid = replace(shape, inertia=row[14:18].copy(), lines=lines, planar=None)
    made = builds.engine(radius=0.0234, gravity=G, dt=1e-4, made_of=particle)
    old = made._world
    made._world = World(particle, old.contact, old.ground, G, False, False, more=(rigid,))
    made._world.set_time_step(1e-4)
    return made


def test_a_rigid_body_with_a_smarticles_numbers_has_its_bits() -> None:
    one, other = builds.engine(radius=0.0234, gravity=G, dt=1e-4, made_of=builds.particle(rows=2)), rigid_engine()
    rng = np.random.default_rng(3)
    for layer in range(4):
        poses = place_layer(
            builds.particle(rows=2), count=8, radius=0.0234, bottom=0.02 * layer + 0.001, height=0.012,
            obstacles=np.zeros((0, 3)), rng=rng,
        )  # fmt: skip
        one.add(poses)
        middle = builds.boxes().link_rotations[1]
        turns = np.array([rotation.as_matrix() @ middle for rotation in poses.rotations])
        other._world.add_bodies(1, poses.positions, turns)
    other._world.bodies.turn[:] = one._world.bodies.turn
    for _ in range(6):
        one.advance(1000)
        other._world.advance(1000)
        np.testing.assert_array_equal(one._world.bodies.position, other._world.bodies.position)
        np.testing.assert_array_equal(one._world.bodies.turn, other._world.bodies.turn)
    assert one.neighbours().sum() > 30  # they have piled up


def test_a_staple_of_right_angles_falls_and_collides_as_a_smarticle(tmp_path: Path) -> None:
    common = {"engine": "links", "count": 10, "phases.2": {"type": "relax", "duration_s": 0.1}}
    recording = {"recording": {"series_interval_s": 0.004, "frame_interval_s": 0.02, "checkpoint_interval_s": None}}
    staple = {"particle": {"shape": "staple", "crown_m": 0.0117, "leg_m": 0.7 * 0.0117}}
    runs = []
    for name, changes in (("smarticle", {}), ("staple", staple)):
        run_scene(small(common | recording | changes), tmp_path / name, command="")
        runs.append(Run(tmp_path / name))
    one, other = runs
    assert one.manifest.time_step_s == other.manifest.time_step_s
    together = [(a, b) for a, b in zip(one.frames, other.frames, strict=False) if a.time < 0.17]
    assert len(together) > 4
    for there, here in together:
        # Rounding of 1e-17 m grows about tenfold in 20 ms of contacts; another body would be off by millimetres.
        np.testing.assert_allclose(here.segments.mean(axis=1), there.segments.mean(axis=1), rtol=0, atol=1e-6)
    moved = together[-1][0].segments - together[0][0].segments
    assert np.abs(moved).max() > 1e-3
    assert max(there.contacts.sum() for there, _ in together) > 0


@pytest.mark.parametrize("turn_deg", [90.0, 0.0], ids=["crossed", "along"])  # one point of contact, and two
@pytest.mark.parametrize("radii", [(0.3e-3, 1.5e-3), (1.5e-3, 0.3e-3)], ids=["thin on thick", "thick on thin"])
def test_friction_acts_on_the_surfaces_of_bars_of_unequal_thickness(
    radii: tuple[float, float], turn_deg: float
) -> None:
    particle = [{"shape": "rod", "length_m": 0.02, "diameter_m": 2 * radius, "share": 1} for radius in radii]
    scene = small({"engine": "links", "count": 2, "particle": particle, "container.radius_m": 0.2})
    engine, depth = build_engine(scene, 1e-7), 0.02 * min(radii)
    assert isinstance(engine, LinksEngine)
    positions = np.array([[0.0, 0.0, 0.1 + sum(radii) - depth], [0.0, 0.0, 0.1]])
    turns = Rotation.identity(), Rotation.from_euler("z", turn_deg, degrees=True)
    engine.add(Poses(positions, turns, np.array([0, 1])))
    bodies = engine._world.bodies
    bodies.momentum[0, 0] = 200.0 * scene.bodies[0].inertia.min()  # it spins about its own axis, along x
    before = bodies.momentum[:, 0].copy()
    engine.advance(40)
    # A force F along y at the surface has the torque F r about x. Half way between the axes both arms would be equal.
    turned, pushed = bodies.momentum[:, 0] - before, bodies.velocity[:, 1] * [body.mass for body in scene.bodies]
    assert pushed[0] < 0 < pushed[1]
    arms = np.array([1, -1]) * (np.array(radii) - depth / 2)
    np.testing.assert_allclose(turned / pushed, arms, rtol=5e-3)  # the depth changes by less
    heights = engine.contact_forces().points[:, 2] - engine.state().positions[1, 2]
    np.testing.assert_allclose(heights, radii[1] - depth / 2, rtol=1e-3)


@pytest.mark.parametrize("name", ["ring", "star"])
def test_energy_and_forces_of_bodies_in_each_other_do_not_depend_on_their_numbers(name: str) -> None:
    count, dt = 8, 1e-13  # so short a step that no body moves
    scene = scene_of(name, count=count, **{"container.radius_m": 0.05})
    found = []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        places = rng.uniform(-8e-3, 8e-3, (count, 3)) + np.array([0, 0, 0.05])
        turns = Rotation.random(count, random_state=seed)
        energies, pushed = [], []
        for order in (np.arange(count), np.arange(count)[::-1], rng.permutation(count)):
            engine = build_engine(scene, dt)
            engine.add(Poses(places[order], tuple(turns[k] for k in order), np.zeros(count, np.int64)))
            engine.advance(1)
            energies.append(engine.ledger.elastic()[0])
            pushed.append(engine.state().velocities[np.argsort(order)])
        assert energies == pytest.approx([energies[0]] * 3, rel=1e-12, abs=0)
        for velocities in pushed[1:]:
            np.testing.assert_allclose(velocities, pushed[0], rtol=0, atol=1e-9 * np.abs(pushed[0]).max())
        found.append(energies[0])
    assert min(found) > 1e-6  # they overlap, by tenths of a diameter
