"""True bodies: sizes and places of what is known exactly."""

import numpy as np
import pytest
import yaml
from synthetic import RADIUS, T1, T2, SyntheticRun, W, u_shape, write_frame, write_manifest, write_run, write_series
from synthetic.hooked import AFTER_REST, LOWER, SPEED, UPPER, write_hooked_run

from dem.record.frames import read_frames
from dem.record.run import open_run
from postprocess.bodies.fields import fields_of
from postprocess.bodies.meshes import Bodies, checked_kinds, link_boxes, plate_height, solid
from postprocess.measures.entanglement import link_crossings, link_passages

ALL = checked_kinds(["crossings"], [])
FLOOR = -0.003
TIERS = ((RADIUS, 0.006), (0.018, 0.008), (0.0125, 0.06))  # radius and height


def bodies_at(directory, index=-1):
    run, frames = open_run(directory), read_frames(directory)
    bodies = Bodies(run, ALL, fields_of(run))
    bodies.hold(frames)
    return bodies.at(frames[index])


def changed(directory, **keys):
    path = directory / "scene.yaml"
    path.write_text(yaml.safe_dump(yaml.safe_load(path.read_text()) | keys))
    return directory


@pytest.fixture
def pile(tmp_path):
    return write_run(tmp_path / "pile", SyntheticRun(frames_per_phase=1, floor_z=FLOOR))


@pytest.fixture
def hooked(tmp_path):
    run = SyntheticRun(phases=AFTER_REST, packing=(0.1,) * 3, frames_per_phase=2, floor_z=FLOOR)
    return write_hooked_run(tmp_path / "hooked", run, np.zeros_like)


def test_boxes_of_one_smarticle_have_its_volume_and_place(tmp_path):
    directory = write_run(tmp_path, SyntheticRun(count=1, frames_per_phase=1, phases=("relax",), packing=(0.001,)))
    vertices = u_shape(0.7 * W) + np.array([0.001, 0.002, 0.003])
    write_frame(directory / "frames/frame_000000.vtu", vertices[None], time=0.5, phase=0)
    mesh = bodies_at(directory)["smarticles"]
    # Boxes end at the hinges' axes, where they overlap: together t1 t2 (w + 2l), which is what a smarticle weighs.
    assert mesh.triangulate().volume * 1e9 == pytest.approx(1e9 * T1 * T2 * W * 2.4, rel=1e-6)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    assert mesh.bounds[::2] == pytest.approx(low - [T2 / 2, T2 / 2, T1 / 2], abs=1e-8)
    assert mesh.bounds[1::2] == pytest.approx(high + np.array([T2 / 2, 0.0, T1 / 2]), abs=1e-8)


def test_boxes_carry_their_smarticle_and_link():
    scene = SyntheticRun(count=5)
    vertices = scene.vertices(0.1)
    mesh = link_boxes(vertices, thickness_normal=T1, thickness_in_plane=T2)
    centres = mesh.cell_centers().points.reshape(15, 6, 3).mean(axis=1)
    smarticle, link = mesh.cell_data["smarticle"][::6], mesh.cell_data["link"][::6]
    middles = (vertices[smarticle, link] + vertices[smarticle, link + 1]) / 2
    assert centres == pytest.approx(middles, abs=1e-6 * W)
    assert sorted(zip(smarticle, link, strict=True)) == [(i, k) for i in range(5) for k in range(3)]


def test_rods_have_one_box():
    scene = SyntheticRun(aspect_ratio=0.0, count=4)
    mesh = link_boxes(scene.vertices(0.1) * 1e3, thickness_normal=1e3 * T1, thickness_in_plane=1e3 * T2)
    assert mesh.n_cells == 4 * 6
    assert mesh.triangulate().volume * 1e-9 == pytest.approx(4 * T1 * T2 * W, rel=1e-6)


def test_boxes_are_as_thick_as_their_links():
    barb, body, length, t1 = 0.0095, 0.0213, 0.042, 0.021
    vertices = u_shape(length, 0.0467)
    mesh = link_boxes(vertices[None] * 1e3, thickness_normal=1e3 * t1, thickness_in_plane=[9.5, 21.3, 9.5])
    low, high = mesh.points.min(axis=0) / 1e3, mesh.points.max(axis=0) / 1e3
    # The body shows below the hinges, barbs beside them.
    assert high - low == pytest.approx([0.0467 + barb, length + body / 2, t1])
    assert mesh.triangulate().volume * 1e-9 == pytest.approx(t1 * (0.0467 * body + 2 * length * barb), rel=1e-6)


def test_wall_and_floor_are_the_container(pile):
    found = bodies_at(pile)
    wall, floor = found["wall"], found["floor"]
    assert wall.bounds[:4] == pytest.approx((-RADIUS, RADIUS, -RADIUS, RADIUS), rel=1e-3)
    assert wall.bounds[4] == pytest.approx(FLOOR)
    tops = [frame.vertices[..., 2].max() for frame in read_frames(pile)]
    assert wall.bounds[5] == pytest.approx(max(tops) + W)
    assert np.unique(np.asarray(floor.points)[:, 2]) == pytest.approx([FLOOR], abs=1e-8)
    assert np.hypot(*np.asarray(floor.points)[:, :2].T).max() == pytest.approx(RADIUS)


def test_a_wall_stays_while_the_floor_moves_alone(pile):
    changed(pile, phases=[{"type": "relax"}, {"type": "relax"}, {"type": "shake", "moves": "floor"}, {"type": "relax"}])
    assert bodies_at(pile, 2)["wall"].bounds[4] == pytest.approx(0.0)
    assert bodies_at(pile, 2)["floor"].bounds[4] == pytest.approx(FLOOR)
    assert bodies_at(pile, 3)["wall"].bounds[4] == pytest.approx(FLOOR)


def test_tiers_are_steps_with_ceilings(pile):
    tiers = [{"radius_m": radius, "height_m": height} for radius, height in TIERS]
    wall = bodies_at(changed(pile, container={"tiers": tiers}))["wall"]
    points = np.asarray(wall.points)
    corners = {
        (round(radius, 6), round(z - FLOOR, 6))
        for radius, z in zip(np.hypot(*points[:, :2].T).tolist(), points[:, 2].tolist(), strict=True)
    }
    steps = [(RADIUS, (0.0, 0.006)), (0.018, (0.006, 0.014)), (0.0125, (0.014, 0.074))]
    assert corners == {(radius, height) for radius, heights in steps for height in heights}
    # Cylinders and the two rings that close the steps, not cones between them.
    rings = np.pi * (RADIUS**2 - 0.018**2 + 0.018**2 - 0.0125**2)
    sides = 2 * np.pi * sum(radius * height for radius, height in TIERS)
    assert wall.area == pytest.approx(rings + sides, rel=2e-3)


def test_a_wall_that_is_taken_away_is_gone_and_the_floor_holds_the_pile(tmp_path):
    kinds = ("deposit", "relax", "shake", "remove-container")
    pile = write_run(tmp_path / "pile", SyntheticRun(frames_per_phase=1, phases=kinds))
    far = read_frames(pile)[-1].vertices + np.array([0.05, 0.0, 0.0])
    write_frame(pile / "frames/frame_000003.vtu", far, time=22.0, phase=3)
    assert "wall" in bodies_at(pile, 2)
    found = bodies_at(pile, 3)
    assert "wall" not in found
    assert found["floor"].bounds[1] >= far[..., 0].max()


def test_hooks_are_crosses_at_their_heights(hooked):
    frame = read_frames(hooked)[-1]
    mesh = bodies_at(hooked)["hooks"]
    lower, upper = (mesh.extract_cells(np.flatnonzero(mesh.cell_data["hook"] == k)) for k in (0, 1))
    raised = SPEED * 2.0  # w per second, for the 2 s of the phase
    assert frame.time == pytest.approx(3.5)
    for cross, height in ((lower, LOWER), (upper, UPPER + raised)):
        assert cross.bounds[:4] == pytest.approx((-W / 2, W / 2, -W / 2, W / 2))
        assert cross.bounds[4:] == pytest.approx((FLOOR + height - 2.5e-4, FLOOR + height + 2.5e-4), abs=2e-5)


def test_the_plate_is_where_the_series_has_it_and_only_while_it_is_there(tmp_path):
    """It comes down by 1 mm a second from 1.5 s to 3 s, in a container that is raised by 2 mm."""
    kinds = ("deposit", "relax", "relax", "relax")
    directory = write_run(tmp_path, SyntheticRun(phases=kinds, frames_per_phase=1, floor_z=FLOOR))
    assert "plate" not in bodies_at(directory)
    times = np.linspace(0.05, 2.5, 50)
    plate = np.where((times > 1.55) & (times < 2.05), 0.010 - 1e-3 * times, np.nan)
    container = np.full(len(times), 0.002)
    columns = {"time_s": times, "phase": np.zeros(50, int), "plate_z_m": plate, "container_z_m": container}
    write_series(directory, columns, seed=1)
    assert [frame.time for frame in read_frames(directory)] == pytest.approx([1.0, 1.5, 2.0, 2.5])
    assert ["plate" in bodies_at(directory, index) for index in range(4)] == [False, False, True, False]
    found = bodies_at(directory, 2)
    # The frame's floor is where the container is, whatever the series says of it.
    assert found["plate"].bounds[4:] == pytest.approx((FLOOR + 0.006, FLOOR + 0.006))
    assert found["plate"].bounds[:4] == found["floor"].bounds[:4]
    run = open_run(directory)
    assert plate_height(run, 2.0) == pytest.approx(0.006)
    assert plate_height(run, 1.6) == pytest.approx(0.0064)
    assert plate_height(run, 2.06) is None


def test_a_plane_has_two_walls_and_no_floor(tmp_path):
    run = SyntheticRun(frames_per_phase=1, count=2)
    write_manifest(write_run(tmp_path, run), run, planar=True, channel_width_m=0.08)
    found = bodies_at(tmp_path)
    assert set(found) == {"smarticles", "wall"}
    assert sorted({round(y, 6) for y in np.asarray(found["wall"].points)[:, 1].tolist()}) == [-0.04, 0.04]
    assert found["wall"].bounds[5] - found["wall"].bounds[4] == pytest.approx(T1)
    names = found["smarticles"].cell_data.keys()
    assert not {"crossings", "entanglement_cluster", "local_packing_fraction"} & set(names)


def test_crossings_are_where_links_pass(tmp_path):
    directory = write_run(tmp_path, SyntheticRun(count=2, frames_per_phase=1, phases=("relax",), packing=(0.001,)))
    first = u_shape(0.7 * W)
    # Its middle link passes upwards through the first one's mouth.
    second = np.array([[0.0, 0.01, -0.004], [0.001, 0.0, -0.004], [0.001, 0.0, 0.006], [0.0, 0.01, 0.006]])
    write_frame(directory / "frames/frame_000000.vtu", np.array([first, second]), time=0.5, phase=0)
    mesh = bodies_at(directory)["crossings"]
    assert np.asarray(mesh.points) == pytest.approx(np.array([[0.001, 0.0, 0.0]]), abs=1e-8)
    assert mesh.point_data["direction"] == pytest.approx(np.array([[0.0, 0.0, 1.0]]))
    ids = [int(mesh.point_data[name][0]) for name in ("smarticle_id", "passing_id", "passing_link")]
    assert ids == [0, 1, 1]
    arrow = solid("crossings", mesh, open_run(directory))
    assert arrow.bounds[4:] == pytest.approx((-W / 6, W / 6), rel=1e-3)


def test_there_are_as_many_passages_as_crossings(scene):
    vertices = scene(40, 5, box=2.0)
    found = link_passages(vertices)
    assert len(found.i) > 50
    assert np.bincount(found.i, minlength=40).tolist() == link_crossings(vertices).tolist()
