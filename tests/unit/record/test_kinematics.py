"""Poses, velocities, masses and inertias of recorded bodies, against the states from which frames were written."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scenes import RHO, T1, T2, W, make_boxes, small
from scipy.spatial.transform import Rotation
from synthetic import SyntheticRun, put_into_one_file, write_manifest

from dem.arrays import Array
from dem.body.kinds import Mixture
from dem.body.linear import matrix_product
from dem.body.state import FilamentState, LinkageState, PileState, RigidState, State
from dem.errors import InputError
from dem.record.frame import Frame, centreline_mesh, motor_fields, read_frame, segment_mesh
from dem.record.frames import FrameWriter
from dem.record.run import Run
from dem.run.run import manifest

SHAPES: dict[str, Any] = {
    "flat z": {"shape": "z", "middle_m": 0.01, "arm_m": 0.007, "angle_deg": 70},
    "round star": {"shape": "star", "arms": 6, "arm_m": 0.006, "diameter_m": 0.001},
    "round v": {"shape": "segments", "points_m": [[0, 0.01, 0], [0, 0, 0], [0.01, 0, 0]], "diameter_m": 0.001,
                "pairs": [[0, 1], [1, 2]]},
    "flat rod": {"shape": "rod", "length_m": 0.02, "thickness_normal_m": 0.002, "thickness_in_plane_m": 0.001},
}  # fmt: skip


def momenta(frame: Frame) -> tuple[Array, Array]:
    """Momentum [kg m/s] and angular momentum about the origin [kg m²/s] of all links of a frame."""
    links = frame.links
    linear = links.mass_kg[:, None] * links.velocity_m_per_s
    own = np.einsum("pij,pj->pi", links.rotation, links.spin_kg_m2_per_s)
    return linear.sum(axis=0), (own + np.cross(links.position_m, linear)).sum(axis=0)


def assert_motion_is_that_of(frame: Frame, state: PileState, energy: float | None = None) -> None:
    linear, angular = momenta(frame)
    assert linear == pytest.approx(state.momentum, rel=1e-9)
    assert angular == pytest.approx(state.angular_momentum, rel=1e-9)
    assert frame.links.kinetic_energy_J.sum() == pytest.approx(energy or state.kinetic_energy, rel=1e-9)
    bodies = frame.bodies
    np.testing.assert_allclose(bodies.position_m, state.positions, rtol=0, atol=1e-12)
    np.testing.assert_allclose(bodies.velocity_m_per_s, state.velocities, rtol=0, atol=1e-12)


def mixture_of(tmp_path: Path, *particles: dict[str, Any], count: int = 5) -> Mixture:
    """The kinds of a scene, whose manifest is written."""
    scene = small({"engine": "links", "count": count, "particle": list(particles)})
    steps = [1e-5] * len(scene.phases)
    manifest(scene, tmp_path, steps=steps, command="", made_by=("links", "1"), threads=1).write(tmp_path / "run.json")
    assert scene.mixture is not None
    return scene.mixture


def turned(mixture: Mixture, turns: Rotation, *, seed: int = 3) -> RigidState:
    """Rigid bodies with random places and velocities."""
    random, count = np.random.default_rng(seed), len(turns)
    places, velocities, spins = random.normal(size=(3, count, 3))
    return RigidState(mixture, mixture.of[:count], places, turns.as_matrix(), velocities, 1000 * spins)


def recorded(tmp_path: Path, state: PileState) -> Frame:
    bodies, writer = state.bodies, FrameWriter(tmp_path)
    assert bodies is not None
    writer.write(segment_mesh(bodies, contacts=np.zeros(state.count, int), time=0.0, floor=0.0, phase=0), 0.0)
    return Run(tmp_path).frames[0]


@pytest.mark.parametrize("shape", SHAPES)
def test_rigid_bodies_of_any_shape_have_the_masses_and_motions_of_their_state(shape: str, tmp_path: Path) -> None:
    mixture = mixture_of(tmp_path, SHAPES[shape])
    state = turned(mixture, Rotation.random(5, rng=np.random.default_rng(1)))
    frame = recorded(tmp_path, state)
    assert_motion_is_that_of(frame, state)
    bodies = frame.bodies
    assert bodies.mass_kg == pytest.approx([mixture.kinds[0].mass] * 5)
    np.testing.assert_allclose(np.sort(bodies.moment_of_inertia_kg_m2), [np.sort(mixture.kinds[0].inertia)] * 5)
    np.testing.assert_allclose(bodies.angular_velocity_rad_per_s, state.spins, rtol=1e-6)
    assert bodies.kinetic_energy_J.sum() == pytest.approx(state.kinetic_energy, rel=1e-9)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_known_rotation_is_recovered_from_the_orientations_before_and_after(shape: str, tmp_path: Path) -> None:
    mixture, random = mixture_of(tmp_path, SHAPES[shape]), np.random.default_rng(5)
    first, known = Rotation.random(5, rng=random), Rotation.random(5, rng=random)
    (tmp_path / "after").mkdir()
    (tmp_path / "after" / "run.json").write_bytes((tmp_path / "run.json").read_bytes())
    frames = [recorded(tmp_path, turned(mixture, first)), recorded(tmp_path / "after", turned(mixture, known * first))]
    before, after = (Rotation.from_quat(frame.bodies.orientation, scalar_first=True) for frame in frames)
    assert np.linalg.norm(frames[0].bodies.orientation, axis=1) == pytest.approx(1.0)
    assert np.abs((after * before.inv() * known.inv()).as_rotvec()).max() < 1e-6


def test_every_body_of_a_kind_is_the_same_in_its_own_frame(tmp_path: Path) -> None:
    mixture = mixture_of(tmp_path, SHAPES["round star"], count=60)
    frame = recorded(tmp_path, turned(mixture, Rotation.random(60, rng=np.random.default_rng(2))))
    links, bodies = frame.links, frame.bodies
    arms = links.position_m - bodies.position_m[links.body]
    own = np.einsum("pji,pj->pi", bodies.rotation[links.body], arms).reshape(60, -1, 3)
    assert np.ptp(own, axis=0).max() < 1e-6 * np.abs(own).max()


def test_links_have_numbers_of_body_kind_and_link(tmp_path: Path) -> None:
    mixture = mixture_of(tmp_path, SHAPES["flat z"], SHAPES["flat rod"], count=4)
    frame = recorded(tmp_path, turned(mixture, Rotation.identity(4)))
    sizes = [3 if kind == 0 else 1 for kind in mixture.of]
    assert frame.links.body.tolist() == np.repeat(range(4), sizes).tolist()
    assert frame.links.kind.tolist() == np.repeat(mixture.of, sizes).tolist()
    assert frame.links.link.tolist() == [k for size in sizes for k in range(size)]
    assert frame.bodies.kind.tolist() == mixture.of.tolist()
    assert len(frame.bodies) == 4


def test_a_flat_rod_has_the_inertia_of_its_box(tmp_path: Path) -> None:
    frame = recorded(tmp_path, turned(mixture_of(tmp_path, SHAPES["flat rod"]), Rotation.identity(5)))
    box = trimesh.creation.box((0.02, 0.001, 0.002))
    box.density = frame.bodies.mass_kg[0] / box.volume
    np.testing.assert_allclose(frame.bodies.moment_of_inertia_kg_m2[0], np.diag(box.moment_inertia), rtol=1e-9)


def smarticles(
    tmp_path: Path, state: State, extra: dict[str, Any] | None = None, *, aspect_ratio: float = 0.7
) -> Frame:
    write_manifest(tmp_path, SyntheticRun(count=state.count, phases=("deposit",), aspect_ratio=aspect_ratio))
    mesh = centreline_mesh(
        state.vertices, velocities=state.link_velocities, spins=state.link_spins,
        contacts=np.zeros(state.count, int), time=0.0, floor=0.0, phase=0, extra=extra,
    )  # fmt: skip
    FrameWriter(tmp_path).write(mesh, 0.0)
    return Run(tmp_path).frames[0]


@pytest.mark.parametrize("angles", [(90.0, 90.0), (70.0, 30.0), (40.0, -80.0)])
def test_smarticles_have_the_mass_the_motion_and_the_axes_of_their_boxes(
    tmp_path: Path, angles: tuple[float, float]
) -> None:
    boxes, random = make_boxes(0.7, angles), np.random.default_rng(4)
    turns = Rotation.random(6, rng=random)
    places, velocities, spins = random.normal(size=(3, 6, 3))
    state = State.rigid(boxes, places, turns.as_matrix(), velocities, spins)
    frame = smarticles(tmp_path, state)
    assert_motion_is_that_of(frame, state)
    bodies = frame.bodies
    assert bodies.mass_kg == pytest.approx([RHO * T1 * T2 * W * 2.4] * 6)
    np.testing.assert_allclose(bodies.moment_of_inertia_kg_m2, [boxes.inertia] * 6, rtol=1e-7)
    np.testing.assert_allclose(bodies.rotation, turns.as_matrix(), atol=1e-6)
    np.testing.assert_allclose(bodies.angular_velocity_rad_per_s, spins, rtol=1e-9)


def test_the_boxes_of_a_smarticle_have_its_mass_and_inertia(tmp_path: Path) -> None:
    still = np.zeros((1, 3))
    frame = smarticles(tmp_path, State.rigid(make_boxes(0.7, (70.0, 30.0)), still, np.eye(3)[None], still, still))
    parts = []
    for k, length in enumerate([0.7 * W, W, 0.7 * W]):
        box = trimesh.creation.box((length, T2, T1))
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = frame.links.rotation[k], frame.links.position_m[k]
        parts.append(box.apply_transform(matrix))
    whole = trimesh.util.concatenate(parts)
    whole.density = RHO
    bodies = frame.bodies
    assert whole.mass == pytest.approx(bodies.mass_kg[0])
    np.testing.assert_allclose(whole.center_mass, bodies.position_m[0], atol=1e-12)
    tensor = bodies.rotation[0] @ np.diag(bodies.moment_of_inertia_kg_m2[0]) @ bodies.rotation[0].T
    np.testing.assert_allclose(whole.moment_inertia, tensor, rtol=0, atol=1e-6 * np.trace(tensor))


def test_the_normal_of_a_smarticle_keeps_its_side_where_barbs_turn_through_the_straight_shape(tmp_path: Path) -> None:
    found = []
    for number, angle in enumerate((40.0, 1.0, -1.0, -40.0)):
        boxes, still = make_boxes(0.7, (angle, angle)), np.zeros((1, 3))
        state = State.rigid(boxes, still, Rotation.from_euler("y", [[30]], degrees=True).as_matrix(), still, still)
        folder = tmp_path / str(number)
        folder.mkdir()
        frame = smarticles(folder, state, extra=motor_fields(np.radians([[angle, angle]])))
        found.append(frame.bodies.rotation[0, :, 2])
    np.testing.assert_allclose(found, [[math.sin(math.radians(30)), 0, math.cos(math.radians(30))]] * 4, atol=1e-6)


def test_a_filament_has_its_mass_and_motion_and_no_orientation(tmp_path: Path) -> None:
    worm = {"shape": "filament", "length_m": 0.03, "diameter_m": 0.0008, "segments": 12, "young_modulus_Pa": 5e4}
    mixture, random = mixture_of(tmp_path, worm, count=3), np.random.default_rng(6)
    kind = mixture.kinds[0]
    assert kind.filament is not None
    step = random.normal(size=(3, 13, 3)) * 0.3 + [0, 0, 1]
    # Segments carry equal masses, also where they are stretched.
    step *= (
        kind.filament.segment_length * np.linspace(1, 1.2, 13)[:, None] / np.linalg.norm(step, axis=2, keepdims=True)
    )
    nodes = np.cumsum(step, axis=1).reshape(-1, 3)
    # Rigid motion of each filament: no segment gets longer, and frames record all of the motion.
    turning, drift = np.repeat(random.normal(size=(2, 3, 3)), 13, axis=1).reshape(2, -1, 3)
    rolls = np.zeros(len(nodes))
    state = FilamentState(mixture, mixture.of, nodes, drift + np.cross(turning, nodes), rolls)
    frame = recorded(tmp_path, state)
    assert_motion_is_that_of(frame, state)
    bodies = frame.bodies
    assert bodies.mass_kg == pytest.approx([kind.filament.mass] * 3)
    assert np.isnan(bodies.orientation).all()
    assert (np.diff(bodies.moment_of_inertia_kg_m2, axis=1) >= 0).all()
    # Rolling is not recorded: segments have the smallest rotation from x, about an axis across x.
    rolls = Rotation.from_quat(frame.links.orientation, scalar_first=True).as_rotvec()[:, 0]
    np.testing.assert_allclose(rolls, 0, atol=1e-12)


def test_a_smarticle_without_barbs_is_a_rod(tmp_path: Path) -> None:
    turns, still = Rotation.from_euler("zy", [[40, 30]], degrees=True), np.zeros((1, 3))
    state = State.rigid(make_boxes(0.0), still, turns.as_matrix(), still, still)
    frame = smarticles(tmp_path, state, aspect_ratio=0.0)
    assert frame.links.mass_kg[[0, 2]].tolist() == [0, 0]
    assert np.isfinite(frame.links.orientation).all()
    np.testing.assert_allclose(frame.bodies.rotation[0, :, 0], turns.as_matrix()[0, :, 0], atol=1e-12)
    assert frame.bodies.mass_kg[0] == pytest.approx(RHO * T1 * T2 * W)


def test_links_of_a_chain_have_its_motion(tmp_path: Path) -> None:
    shape = {"shape": "chain", "link_m": [0.008, 0.006], "thickness_normal_m": 0.002, "thickness_in_plane_m": 0.001}
    mixture, random = mixture_of(tmp_path, {**shape, "joints": {"law": "free"}}, count=2), np.random.default_rng(7)
    turns, (places, velocities, spins) = Rotation.random(4, rng=random), random.normal(size=(3, 4, 3))
    links = RigidState(mixture.pieces, np.array([0, 1, 0, 1]), places, turns.as_matrix(), velocities, spins)
    state = LinkageState(mixture, mixture.of, links)
    frame = recorded(tmp_path, state)
    assert_motion_is_that_of(frame, state)
    np.testing.assert_allclose(frame.links.rotation, turns.as_matrix(), atol=1e-9)
    assert np.isnan(frame.bodies.orientation).all()
    # That of the rigid body with the angular momentum of the links.
    arms = places - state.positions[state.body]
    momentum = np.zeros((2, 3))
    inertia = mixture.pieces.inertias[links.kind]
    own = matrix_product(turns.as_matrix(), (inertia * frame_spins(turns, spins))[..., None])[..., 0]
    masses = mixture.pieces.masses[links.kind][:, None]
    np.add.at(momentum, state.body, own + np.cross(arms, masses * (velocities - state.velocities[state.body])))
    tensor = np.zeros((2, 3, 3))
    for k, body in enumerate(state.body):
        turn, arm = turns.as_matrix()[k], arms[k]
        tensor[body] += turn @ np.diag(inertia[k]) @ turn.T + masses[k] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    wanted = np.linalg.solve(tensor, momentum[..., None])[..., 0]
    np.testing.assert_allclose(frame.bodies.angular_velocity_rad_per_s, wanted, rtol=1e-8)


def frame_spins(turns: Rotation, spins: Array) -> Array:
    return np.asarray(turns.inv().apply(spins))


def test_poses_are_those_of_frames_in_one_file(tmp_path: Path) -> None:
    random = np.random.default_rng(8)
    state = State.rigid(make_boxes(), random.normal(size=(3, 3)), Rotation.random(3, rng=random).as_matrix(),
                        *random.normal(size=(2, 3, 3)))  # fmt: skip
    many = smarticles(tmp_path, state).bodies
    put_into_one_file(tmp_path)
    np.testing.assert_array_equal(Run(tmp_path).frames[0].bodies.orientation, many.orientation)


def test_a_frame_without_its_run_says_which_file_it_needs(tmp_path: Path) -> None:
    still = np.zeros((1, 3))
    frame = smarticles(tmp_path, State.rigid(make_boxes(), still, np.eye(3)[None], still, still))
    (tmp_path / "run.json").unlink()
    with pytest.raises(InputError, match=r"run\.json") as error:
        _ = read_frame(frame.path).bodies
    assert "\n" not in str(error.value)
