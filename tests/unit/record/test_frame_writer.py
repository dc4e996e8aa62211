"""A frame on disk is what docs/reference/files.md promises, read back with meshio and with plain XML."""

import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dem.body.particle import Boxes, Particle, SphereChain
from dem.body.state import State
from dem.record.columns import FIELDS
from dem.record.frame import centreline_mesh, motor_fields, sphere_mesh
from dem.record.frames import FrameWriter

W, RATIO = 0.0117, 0.7
BOXES = Boxes(middle_length=W, barb_length=RATIO * W, thickness_normal=1.27e-3, thickness_in_plane=0.5e-3, density=7850)
COUNT = 5


def make_state(seed: int = 0, boxes: Boxes = BOXES) -> State:
    rng = np.random.default_rng(seed)
    return State.rigid(
        boxes,
        rng.normal(size=(COUNT, 3)),
        Rotation.random(COUNT, random_state=rng).as_matrix(),
        rng.normal(size=(COUNT, 3)),
        rng.normal(size=(COUNT, 3)) * 40,
    )


def frame_mesh(state: State, time: float = 0.0, floor: float = 0.0, phase: int = 0, **more: Any) -> meshio.Mesh:
    values = {
        "contacts": np.zeros(COUNT, dtype=np.int64),
        "velocities": state.link_velocities,
        "spins": state.link_spins,
    }
    return centreline_mesh(state.vertices, time=time, floor=floor, phase=phase, **{**values, **more})


def written(folder: Path, state: State) -> meshio.Mesh:
    mesh = frame_mesh(state, contacts=np.arange(COUNT) * 2, time=0.125, floor=-0.001, phase=2)
    FrameWriter(folder).write(mesh, 0.125)
    return meshio.read(folder / "frames" / "frame_000000.vtu")


def test_points_are_tip_hinge_hinge_tip_of_each_smarticle(tmp_path: Path) -> None:
    state = make_state()
    mesh = written(tmp_path, state)
    assert mesh.points.shape == (4 * COUNT, 3)
    assert mesh.points.dtype == np.float64
    points = mesh.points.reshape(COUNT, 4, 3)
    lengths = np.linalg.norm(np.diff(points, axis=1), axis=2)
    assert lengths == pytest.approx(np.tile([RATIO * W, W, RATIO * W], (COUNT, 1)), rel=1e-12)
    # The mean of the links, weighted with their lengths, is the centre of mass: which end is which, and the pose.
    centres = (points[:, 1:] + points[:, :-1]) / 2
    assert np.average(centres, axis=1, weights=[RATIO, 1, RATIO]) == pytest.approx(state.positions, abs=1e-15)
    # Body x runs from the first hinge to the second; body y from the middle link to the mouth.
    assert (points[:, 2] - points[:, 1]) / W == pytest.approx(state.link_rotations[:, 1, :, 0], abs=1e-12)
    assert (points[:, 0] - points[:, 1]) / (RATIO * W) == pytest.approx(state.link_rotations[:, 1, :, 1], abs=1e-12)


def test_cells_and_data_follow_the_contract(tmp_path: Path) -> None:
    mesh = written(tmp_path, make_state())
    assert [block.type for block in mesh.cells] == ["line"]
    lines = mesh.cells[0].data
    expected = [[4 * k + j, 4 * k + j + 1] for k in range(COUNT) for j in range(3)]
    assert np.array_equal(lines, expected)
    data = {name: values[0] for name, values in mesh.cell_data.items()}
    assert set(data) == set(FIELDS)
    for name in ("smarticle_id", "link", "contacts", "phase"):
        assert data[name].dtype == np.int64
    assert np.array_equal(data["smarticle_id"], np.repeat(np.arange(COUNT), 3))
    assert np.array_equal(data["link"], np.tile([0, 1, 2], COUNT))
    assert np.array_equal(data["contacts"], np.repeat(2 * np.arange(COUNT), 3))
    assert set(data["phase"]) == {2}
    assert np.array_equal(data["time_s"], np.full(3 * COUNT, 0.125))
    assert np.array_equal(data["floor_z_m"], np.full(3 * COUNT, -0.001))


def test_scenes_with_motors_carry_angle_torque_work_and_halts_of_each_barb(tmp_path: Path) -> None:
    angles = np.linspace(0.2, 1.1, 2 * COUNT).reshape(COUNT, 2)
    halted = np.zeros((COUNT, 2), dtype=bool)
    halted[1, 0] = True
    state = make_state()
    for at_work in ((angles + 1, angles + 2, halted), ()):
        FrameWriter(tmp_path).write(frame_mesh(state, extra=motor_fields(state.angles, *at_work)), 0)
        mesh = meshio.read(tmp_path / "frames" / "frame_000000.vtu")
        data = {name: values[0].reshape(COUNT, 3) for name, values in mesh.cell_data.items() if values[0].ndim == 1}
        assert data["angle_rad"][:, [0, 2]] == pytest.approx(np.full((COUNT, 2), math.pi / 2))
        assert np.isnan(data["angle_rad"][:, 1]).all()
        expected = (angles + 1, angles + 2) if at_work else 2 * (np.full((COUNT, 2), math.nan),)
        for name, values in zip(("motor_torque_N_m", "motor_work_J"), expected, strict=True):
            assert np.array_equal(data[name][:, [0, 2]], values, equal_nan=True)
            assert np.isnan(data[name][:, 1]).all()
        assert np.flatnonzero(data["halted"]).tolist() == ([3] if at_work else [])


def test_velocities_are_those_of_the_link_centres(tmp_path: Path) -> None:
    # Against a small rigid motion in time, not against a cross product.
    state, dt = make_state(), 1e-6
    mesh = written(tmp_path, state)
    spins, bodies = state.link_spins[:, 1], state.link_rotations[:, 1] @ BOXES.link_rotations[1].T
    turned = Rotation.from_rotvec(spins * dt).as_matrix() @ bodies
    later = State.rigid(BOXES, state.positions + dt * state.velocities, turned, state.velocities, spins)

    def centres(at: State) -> np.ndarray:
        points = at.vertices
        return ((points[:, 1:] + points[:, :-1]) / 2).reshape(-1, 3)

    moved = (centres(later) - centres(state)) / dt
    # Second order in dt: 40 rad/s squared times 6 mm times half of dt is 5e-6 m/s.
    assert mesh.cell_data["velocity_m_per_s"][0] == pytest.approx(moved, abs=5e-5)
    assert np.abs(moved - np.repeat(state.velocities, 3, axis=0)).max() > 0.1
    assert np.array_equal(mesh.cell_data["angular_velocity_rad_per_s"][0], np.repeat(spins, 3, axis=0))


def test_bar_without_barbs_still_has_four_points(tmp_path: Path) -> None:
    boxes = Boxes(middle_length=W, barb_length=0.0, thickness_normal=1.27e-3, thickness_in_plane=0.5e-3, density=7850)
    mesh = frame_mesh(make_state(boxes=boxes))
    FrameWriter(tmp_path).write(mesh, 0)
    points = meshio.read(tmp_path / "frames" / "frame_000000.vtu").points.reshape(COUNT, 4, 3)
    assert np.array_equal(points[:, 0], points[:, 1])
    assert np.linalg.norm(points[:, 2] - points[:, 1], axis=1) == pytest.approx(np.full(COUNT, W))


def test_collection_lists_all_frames_in_time_order(tmp_path: Path) -> None:
    writer = FrameWriter(tmp_path)
    times = [0.0, 0.04, 0.08, 123.456]
    for k, time in enumerate(times):
        mesh = frame_mesh(make_state(k), time=time)
        writer.write(mesh, time)
        listed = ElementTree.parse(tmp_path / "frames.pvd").getroot().findall("Collection/DataSet")
        assert [float(row.attrib["timestep"]) for row in listed] == pytest.approx(times[: k + 1], rel=1e-8)
    for row, time in zip(listed, times, strict=True):
        frame = meshio.read(tmp_path / row.attrib["file"])
        assert frame.cell_data["time_s"][0][0] == time
        assert math.isfinite(frame.points.sum())
    assert len(list((tmp_path / "frames").iterdir())) == len(times)


@pytest.mark.parametrize("rows", [1, 2])
def test_spheres_are_points_on_their_links(tmp_path: Path, rows: int) -> None:
    state = make_state()
    diameter = 0.9e-3 if rows == 1 else 0.5e-3
    particle = Particle(state.boxes, SphereChain(rows=rows, diameter=diameter, pitch=diameter))
    FrameWriter(tmp_path, "sphere").write(sphere_mesh(state, particle), 0.5)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["spheres", "spheres.pvd"]
    listed = ElementTree.parse(tmp_path / "spheres.pvd").getroot().findall("Collection/DataSet")
    assert [(row.attrib["timestep"], row.attrib["file"]) for row in listed] == [("0.5", "spheres/sphere_000000.vtu")]
    mesh = meshio.read(tmp_path / "spheres" / "sphere_000000.vtu")
    each = len(particle.centres)
    assert [(block.type, block.data.shape) for block in mesh.cells] == [("vertex", (COUNT * each, 1))]
    data = mesh.point_data
    assert set(data) == {"radius_m", "smarticle_id", "link"}
    assert (data["radius_m"] == diameter / 2).all()
    assert np.array_equal(data["smarticle_id"], np.repeat(np.arange(COUNT), each))
    # Independent of how the state places spheres: each is as far from its link's line as its row is from the plane.
    ends = state.vertices[data["smarticle_id"]]
    start, end = (ends[np.arange(COUNT * each), data["link"] + k] for k in (0, 1))
    along = (end - start) / np.linalg.norm(end - start, axis=1)[:, None]
    off = mesh.points - start
    beside = np.linalg.norm(off - (off * along).sum(axis=1)[:, None] * along, axis=1)
    assert beside == pytest.approx(np.tile(np.abs(particle.centres[:, 2]), COUNT), abs=1e-12)
    assert ((off * along).sum(axis=1) > -1e-12).all()
    assert ((off * along).sum(axis=1) < np.linalg.norm(end - start, axis=1) + 1e-12).all()
    assert set(data["link"]) == {0, 1, 2}
