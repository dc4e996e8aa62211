"""Chains of links with joints on the engine links, against exact values."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import small
from scipy.spatial.transform import Rotation

from dem.body.placement import Poses
from dem.body.state import LinkageState
from dem.engine.links.arrays import Bodies, Linkages
from dem.engine.links.engine import LinksEngine
from dem.engine.links.joints import pins_of
from dem.engine.links.linkages import LinksLinkages
from dem.engine.links.motion.joining import PIN, PIN_DAMPING
from dem.physics.contact import damping_ratio, typical_effective_mass
from dem.plan.steps import stable_step
from dem.run.build import build_engine
from dem.scene.scene import Scene

Array = NDArray[np.float64]
L, D, G = 0.01, 0.002, 9.81
SPRING = {"law": "elastic", "stiffness_N_m_per_rad": 2e-4}
MOTOR = {
    "law": "motor",
    "torque_limit_N_m": 1e-3,
    "stiffness_N_m_per_rad": 2e-3,
    "damping_N_m_s_per_rad": 2e-5,
    "speed_limit_rad_per_s": 50,
}
TURN = {"type": "undulate", "duration_s": 1.0, "frequency_hz": 0, "ramp_s": 0.0}  # of single motors, once
MIXED = [SPRING, {**SPRING, "axes": 2}, {**SPRING, "axes": 3}, {**SPRING, "axes": [[0.6, 0, 0.8]]}]


def chains(joints: Any, *, links: int = 5, more: Any = None, **changes: Any) -> Scene:
    return small(
        {
            "engine": "links",
            "count": 1,
            "particle": {"shape": "chain", "links": links, "link_m": L, "diameter_m": D, "joints": joints}
            | (more or {}),
            "container.radius_m": 1.0,
            "contact": {"friction_smarticle": 0.3, "friction_wall": 0.3, "restitution": 1.0},
            "fidelity": {"base": "standard", "stiffness_N_per_m": 2000},
            "phases": [{"type": "deposit"}, {"type": "relax", "duration_s": 0.1}],
        }
        | changes
    )


def one(
    scene: Scene, dt: float | None = None, turn: Rotation | None = None, gravity: float = 0.0
) -> tuple[LinksEngine, LinksLinkages]:
    """A chain in the air, with x along its first link."""
    engine = build_engine(scene, dt or 0.5 * stable_step(scene))
    assert isinstance(engine, LinksEngine)
    engine.gravity = engine._world.gravity = gravity
    mixture = scene.mixture
    assert mixture is not None
    back = Rotation.from_matrix(mixture.kinds[0].bars.rotation)
    poses = Poses(np.array([[0.0, 0.0, 0.3]]), [(turn or Rotation.identity()) * back], kinds=np.zeros(1, np.int64))
    engine.add(poses)
    assert isinstance(engine.filaments, LinksLinkages)
    return engine, engine.filaments


def arrays(engine: LinksEngine) -> Linkages:
    linkages = engine._world.linkages
    assert linkages is not None
    return linkages


def links(engine: LinksEngine) -> Bodies:
    return arrays(engine).links


def set_moving(engine: LinksEngine, seed: int = 3, speed: float = 0.05) -> None:
    """Give all links random velocities."""
    rng, own = np.random.default_rng(seed), links(engine)
    own.velocity[:] = speed * rng.normal(size=own.velocity.shape)


def state(engine: LinksEngine) -> LinkageState:
    found = engine.state()
    assert isinstance(found, LinkageState)
    return found


def energies(engine: LinksEngine, linkages: LinksLinkages, steps: int) -> Array:
    """Stored energy at the ends of steps [J]: kinetic energy is the mean of those half a step before and after."""
    rows = []
    for _ in range(steps + 1):
        rows.append(linkages.energies[:5])
        engine.advance(1)
    found = np.array(rows)
    kinetic = 0.5 * (found[:-1, 0] + found[1:, 0])
    return np.asarray(kinetic + found[:-1, 1:5].sum(axis=1))


def test_momentum_of_a_chain_with_motors_is_kept_to_rounding() -> None:
    joints = [MOTOR, {**MOTOR, "axes": 2}, {**SPRING, "axes": 3, "damping_N_m_s_per_rad": 1e-6}, {**MOTOR, "axes": 3}]
    wave = {"type": "undulate", "duration_s": 1.0, "amplitude_deg": 40, "frequency_hz": 5, "wavelength_lengths": 0.8}
    wave |= {"turns_between_reversals": 0.3, "ramp_s": 0.01}
    scene = chains(joints, phases=[{"type": "deposit"}, wave])
    engine, linkages = one(scene)
    set_moving(engine)
    before = state(engine)
    scene.phases[1].begin(scene, 1).proceed(engine)
    engine.advance(3000)
    after = state(engine)
    assert np.abs(linkages.angles).max() > 0.3
    assert linkages.energies.active > 1e-7
    masses = after.links.mixture.masses[after.links.kind]
    scale = float((masses[:, None] * np.abs(after.links.velocities)).sum())
    assert np.abs(after.momentum - before.momentum).max() < 1e-12 * scale
    arms = np.abs(after.links.positions).max()
    assert np.abs(after.angular_momentum - before.angular_momentum).max() < 1e-12 * scale * arms


def test_energy_of_a_passive_elastic_chain_is_kept_and_errors_fall_with_the_square_of_the_step() -> None:
    scene = chains(MIXED)
    dt, errors = 0.4 * stable_step(scene), []
    for part in (1, 2, 4):
        engine, linkages = one(scene, dt / part)
        set_moving(engine)
        found = energies(engine, linkages, 4000 * part)
        errors.append(np.abs(found - found[0]).max() / found[0])
        half = len(found) // 2
        drift = abs(found[half:].mean() - found[:half].mean()) / found[0]
        assert drift < 0.1 * errors[-1] + 1e-9, (part, drift, errors)
    assert errors[0] < 0.02
    for coarse, fine in pairwise(errors):
        assert 3.0 < coarse / fine < 5.5


def crossings(times: Array, values: Array) -> Array:
    """Times at which values rise through 0, by linear interpolation."""
    rise = np.flatnonzero((values[:-1] < 0) & (values[1:] >= 0))
    share = -values[rise] / (values[rise + 1] - values[rise])
    return np.asarray(times[rise] + share * (times[rise + 1] - times[rise]))


def test_a_hanging_link_swings_with_the_period_of_a_physical_pendulum() -> None:
    scene = chains({"law": "free", "axes": [[0, 1, 0]], "poured_deg": 96}, links=2)
    engine, linkages = one(scene, gravity=G)
    linkages.grip({0: [0]})
    rows = []
    for _ in range(math.ceil(0.6 / (4 * engine.time_step))):
        engine.advance(4)
        rows.append((engine.time, linkages.angles[0, 0] - math.pi / 2))
    times, angles = np.array(rows).T
    link = state(engine).mixture.pieces.kinds[1]
    inertia = float(link.inertia[1]) + link.mass * L**2 / 4
    exact = 2 * math.pi * math.sqrt(inertia / (link.mass * G * L / 2)) * (1 + math.radians(6) ** 2 / 16)
    found = crossings(times, angles)
    assert len(found) >= 3
    assert np.diff(found).mean() == pytest.approx(exact, rel=5e-4)
    assert angles.min() == pytest.approx(-math.radians(6), rel=2e-3)
    assert np.abs(linkages.angles[0, 1:]).max() == 0


def test_two_free_links_with_a_spring_vibrate_with_the_frequency_of_their_reduced_inertia() -> None:
    scene = chains({**SPRING, "axes": 1, "poured_deg": 2}, links=2, more={"link_m": [L, 1.5 * L]})
    engine, linkages = one(scene)
    rows = []
    for _ in range(2000):
        engine.advance(1)
        rows.append((engine.time, linkages.angles[0, 0]))
    one_, two = state(engine).mixture.pieces.kinds
    masses, inertias, arms = (
        np.array([one_.mass, two.mass]),
        np.array([one_.inertia[2], two.inertia[2]]),
        (L / 2, 0.75 * L),
    )
    reduced = masses.prod() / masses.sum()
    own = np.diag(inertias) + reduced * np.outer(arms, arms)  # the joint is where both ends are: v = -(a ω1 + b ω2)
    mode = np.linalg.inv(own)
    rate = math.sqrt(2e-4 * (mode[0, 0] + mode[1, 1] - 2 * mode[0, 1]))
    found = crossings(*np.array(rows).T)
    assert len(found) > 3
    assert np.diff(found).mean() == pytest.approx(2 * math.pi / rate, rel=2e-3)


def test_a_cantilever_of_elastic_hinges_bends_as_its_moments_say() -> None:
    n, k = 6, 2e-3
    joint = {"law": "elastic", "stiffness_N_m_per_rad": k, "damping_N_m_s_per_rad": 1e-4, "axes": [[0, 1, 0]]}
    scene = chains(joint, links=n, contact={"restitution": 0.5})
    engine, linkages = one(scene, gravity=G)
    linkages.grip({0: [0]})
    engine.advance(round(1.0 / engine.time_step))
    mass = state(engine).mixture.pieces.kinds[0].mass
    angles = np.zeros(n - 1)
    for _ in range(100):  # exact for any deflection: each spring bears the moment of all links after it
        headings = np.concatenate([[0.0], np.cumsum(angles)])
        ends = L * np.cumsum(np.cos(headings))
        middles = ends - L / 2 * np.cos(headings)
        angles = np.array([mass * G * (middles[j + 1 :] - ends[j]).sum() for j in range(n - 1)]) / k
    np.testing.assert_allclose(linkages.angles[:-1, 0], angles, rtol=2e-3)
    assert angles[0] > 0.1
    tip = state(engine).segments[-1, 1] - state(engine).segments[0, 0]
    np.testing.assert_allclose(tip[2], -L * np.sin(headings).sum(), rtol=2e-3)
    assert np.linalg.norm(state(engine).links.velocities, axis=1).max() < 1e-5
    # A held link bears the weight of all links.
    np.testing.assert_allclose(linkages.force(), [0, 0, n * mass * G], atol=1e-3 * n * mass * G)


def test_a_grip_that_lets_go_leaves_the_others_holding() -> None:
    engine, linkages = one(chains({"law": "free"}, links=4), gravity=G)
    first, last = linkages.grip({0: [0]}), linkages.grip({0: [-1]})
    linkages.move(last, (0.0, 0.0, 0.01))
    linkages.release(first)
    assert linkages.held == 1
    engine.advance(100)
    np.testing.assert_allclose(links(engine).velocity[-1], [0, 0, 0.01], atol=1e-12)
    assert links(engine).velocity[0, 2] < 0
    assert not linkages.force(first).any()
    assert linkages.force(last)[2] == linkages.force()[2] > 0
    linkages.release(last)
    assert linkages.held == 0


def test_a_hinge_bends_off_its_axis_by_no_more_than_its_pin_gives_way() -> None:
    scene = chains({"law": "free", "axes": 1}, links=2, contact={"restitution": 0.3})
    engine, linkages = one(scene, gravity=G)
    linkages.grip({0: [0]})
    engine.advance(round(0.5 / engine.time_step))
    mixture = state(engine).mixture
    linkage, mass = mixture.kinds[0].linkage, mixture.pieces.kinds[1].mass
    assert linkage is not None
    pin, _, off, _ = pins_of(linkage, engine._world.contact)
    axes = state(engine).links.rotations[:, :, 2]
    assert math.asin(np.linalg.norm(np.cross(*axes))) == pytest.approx(mass * G * L / 2 / off, rel=0.02)
    assert state(engine).gaps.max() == pytest.approx(mass * G / pin, rel=0.02)
    assert off == pytest.approx(pin * D**2 / 2, rel=1e-9)  # two pins at half the width


@pytest.mark.parametrize("order", [1, -1])
def test_pins_of_each_kind_have_the_damping_ratio_of_contacts(order: int) -> None:
    particle = [
        {"shape": "chain", "links": 2, "link_m": L, "diameter_m": d, "joints": {"law": "free"}, "count": 1}
        for d in (D, D / 4)
    ]
    scene = chains(None, particle=particle[::order], count=2, contact={"restitution": 0.5})
    engine, ratios = build_engine(scene, 1e-6), []
    assert isinstance(engine, LinksEngine)
    engine.add(Poses(np.array([[0, 0, 0.1], [0, 0, 0.2]]), [Rotation.identity()] * 2, kinds=np.array([0, 1])))
    for kind, row in zip(scene.bodies, arrays(engine).row[::2], strict=True):  # each with one joint
        # Of two equal bodies, the law of contacts has c = 2 ζ √(k m/2) with the typical effective mass m.
        ratios.append(row[PIN_DAMPING] / math.sqrt(2 * row[PIN] * typical_effective_mass(kind)))
    assert ratios == pytest.approx([damping_ratio(0.5)] * 2, rel=1e-9)


@pytest.mark.parametrize(("axes", "driven"), [(1, 0), (2, 0), (2, 1), (3, 0), (3, 2)])
def test_a_blocked_motor_keeps_its_torque_limit_and_a_free_one_its_command(axes: int, driven: int) -> None:
    phase = {**TURN, "joints": [{"joint": 0, "axis": driven, "centre_deg": 50}]}
    scene = chains({**MOTOR, "axes": axes}, links=2, phases=[{"type": "deposit"}, phase])
    for blocked in (True, False):
        engine, linkages = one(scene)
        if blocked:
            linkages.grip({0: [0, 1]})
        scene.phases[1].begin(scene, 1).proceed(engine)
        most = 0.0
        for _ in range(100):
            engine.advance(math.ceil(1e-3 / engine.time_step))
            most = max(most, float(np.linalg.norm(linkages.torques[0])))
        assert most <= 1e-3 * (1 + 1e-12)
        if blocked:
            assert linkages.torques[0, driven] == pytest.approx(1e-3, rel=1e-9)
            assert linkages.joints.motor_torque == pytest.approx(1e-3, rel=1e-9)
            assert np.abs(linkages.angles).max() < 1e-9
        else:
            assert linkages.angles[0, driven] == pytest.approx(math.radians(50), abs=1e-3)


def test_a_command_is_no_faster_than_its_speed_limit() -> None:
    phase = {**TURN, "joints": [{"joint": 0, "centre_deg": 90}]}
    scene = chains({**MOTOR, "speed_limit_rad_per_s": 3.0}, links=2, phases=[{"type": "deposit"}, phase])
    engine, _ = one(scene)
    scene.phases[1].begin(scene, 1).proceed(engine)
    engine.advance(1000)
    assert arrays(engine).command[0, 0] == pytest.approx(3.0 * engine.time, rel=1e-9)


def test_a_wave_travels_along_the_chain_and_a_table_sets_single_motors() -> None:
    phase = {"type": "undulate", "duration_s": 1.0, "amplitude_deg": 20, "frequency_hz": 2, "ramp_s": 0.0}
    phase |= {"wavelength_lengths": 0.5, "starts": "together", "joints": [{"joint": 2, "centre_deg": 10}]}
    scene = chains(MOTOR, links=6, phases=[{"type": "deposit"}, phase])
    engine, _ = one(scene)
    scene.phases[1].begin(scene, 1).proceed(engine)
    engine.advance(round(0.8 / engine.time_step))
    schedule = np.radians(20) * np.sin(2 * np.pi * (2 * (engine.time - engine.time_step) - np.arange(1, 6) / 6 / 0.5))
    schedule[2] = math.radians(10)
    np.testing.assert_allclose(arrays(engine).command[:5, 0], schedule, atol=1e-9)


@pytest.mark.parametrize("axes", [1, 2, 3])
def test_a_joint_that_yields_keeps_its_torque_and_its_energy_is_accounted_for(axes: int) -> None:
    scene = chains({**SPRING, "axes": axes, "yield_N_m": 1e-5, "poured_deg": 30}, links=2)
    engine, linkages = one(scene)
    before, most = linkages.energies.residual, 0.0
    for _ in range(2000):
        engine.advance(1)
        most = max(most, np.linalg.norm(linkages.torques[0]))
    after = linkages.energies
    assert most == pytest.approx(1e-5, rel=1e-9)
    assert after.damped > 0.5 * before
    assert after.residual == pytest.approx(before, rel=1e-3)


@pytest.mark.parametrize("axes", [1, 2, 3])
def test_a_joint_that_yields_by_more_than_it_bends_in_each_step_takes_its_torque_times_the_angle(axes: int) -> None:
    scene = chains({**SPRING, "axes": axes, "yield_N_m": 2e-7}, links=3)
    engine, linkages = one(scene)
    links(engine).velocity[:, 1] = -0.3, 0.6, -0.3
    steps = []
    for _ in range(100):
        before = linkages.angles[:2, 0].copy()
        engine.advance(1)
        steps.append(np.abs(linkages.angles[:2, 0] - before))
    assert np.max(steps) > 2 * 2e-7 / 2e-4
    assert linkages.energies.damped == pytest.approx(2e-7 * np.sum(steps), rel=0.03)


@pytest.mark.parametrize("axes", [1, 2, 3])
def test_a_damped_motor_does_not_lag_behind_a_command_that_moves_steadily(axes: int) -> None:
    phase = {**TURN, "joints": [{"joint": 0, "centre_deg": 120}]}
    motor = {**MOTOR, "axes": axes, "speed_limit_rad_per_s": 5.0, "damping_N_m_s_per_rad": 4e-5}
    scene = chains(motor, links=2, phases=[{"type": "deposit"}, phase])
    engine, linkages = one(scene)
    scene.phases[1].begin(scene, 1).proceed(engine)
    engine.advance(round(0.3 / engine.time_step))
    command = arrays(engine).command[0, 0]
    assert command > 1.0
    assert linkages.angles[0, 0] == pytest.approx(command, abs=1e-3)  # against it, 5 · 4e-5/2e-3 = 0.1


@pytest.mark.parametrize("axes", [1, 2, 3])
def test_a_joint_that_breaks_leaves_its_links_pinned_and_free(axes: int) -> None:
    joint = {**SPRING, "axes": axes, "break_N_m": 1e-5}
    engine, linkages = one(chains(joint, links=3), gravity=G)
    linkages.grip({0: [0]})
    before = linkages.energies.residual
    engine.advance(3000)
    assert linkages.joints.broken == 1  # the one that bears both links; in free fall the other one bears nothing
    assert np.abs(linkages.torques[0]).max() == 0
    assert state(engine).gaps.max() < 1e-4
    assert linkages.energies.residual == pytest.approx(before, abs=2e-8)


@pytest.mark.parametrize("joints", [MIXED, [{**each, "damping_N_m_s_per_rad": 2e-8} for each in MIXED]])
def test_the_stable_step_of_a_chain_is_stable(joints: Sequence[Any]) -> None:
    scene = chains(list(joints), contact={"restitution": 0.5 if "damping_N_m_s_per_rad" in joints[0] else 1.0})
    engine, linkages = one(scene, stable_step(scene))
    set_moving(engine)
    before = linkages.energies.stored
    engine.advance(30000)
    assert linkages.energies.stored < 1.5 * before
