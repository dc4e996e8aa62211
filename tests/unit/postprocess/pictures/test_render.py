"""Pictures are judged by their pixels; a scene is small and so is its picture."""

import ctypes

import numpy as np
import pytest
from PIL import Image
from synthetic import RADIUS, T1, T2, SyntheticRun, W, u_shape, write_frame, write_run

from dem.errors import InputError, RunError
from dem.record.frames import read_frames
from dem.record.run import open_run
from postprocess.pictures.camera import VIEWS, Look, extent, fitted_camera
from postprocess.pictures.canvas import link_boxes
from postprocess.pictures.colouring import COLOURINGS, ColourScale
from postprocess.pictures.render import render_run
from postprocess.pictures.surroundings import read_surroundings
from postprocess.report import figures

SIZE = (240, 240)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Twelve smarticles; two frames per phase, the floor 3 mm below z = 0."""
    return write_run(tmp_path_factory.mktemp("runs") / "a", SyntheticRun(frames_per_phase=2, floor_z=-0.003))


def single_run(directory, vertices, *, contacts=None):
    """A run of one frame with the smarticles given."""
    write_run(directory, SyntheticRun(count=len(vertices), frames_per_phase=1, phases=("relax",), packing=(0.001,)))
    write_frame(directory / "frames/frame_000000.vtu", vertices, time=0.5, phase=0, contacts=contacts)
    return directory


def pixels(path):
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def panel(image):
    """The three-dimensional part: below the caption, left of the colour bar, above the scale bar."""
    height, width, _ = image.shape
    unit = max(min(height, width) / 100, 4.4)
    return image[round(12 * unit) : round(height - 5 * unit), : round(width - 14 * unit)]


def coloured(image):
    """Which pixels are clearly neither white nor grey: container, floor and shadows are."""
    return np.ptp(image, axis=2) > 40


# The mesh


@pytest.mark.parametrize("aspect_ratio", [0.4, 1.1])
def test_boxes_have_the_volume_of_the_links(aspect_ratio):
    scene = SyntheticRun(aspect_ratio=aspect_ratio, count=7)
    mesh = link_boxes(scene.vertices(0.1) * 1e3, thickness_normal=1e3 * T1, thickness_in_plane=1e3 * T2)
    assert mesh.n_cells == 7 * 3 * 6
    # 0 for faces that point inwards and outwards alike, negative for all inwards.
    assert mesh.triangulate().volume * 1e-9 == pytest.approx(7 * T1 * T2 * W * (1 + 2 * aspect_ratio), rel=1e-6)


def test_thicknesses_lie_along_the_normal_and_in_the_plane():
    mesh = link_boxes([u_shape(0.7 * W)], thickness_normal=T1, thickness_in_plane=T2)
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    # The U lies in the x-y plane: t1 shows along z, t2 widens it half at each barb.
    assert high - low == pytest.approx([W + T2, 0.7 * W + T2 / 2, T1])


def test_mesh_knows_which_box_is_whose():
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


def test_mesh_refuses_flat_boxes():
    with pytest.raises(InputError, match=r"thicknesses must be above 0 m: got 0\.0 m"):
        link_boxes([u_shape(W)], thickness_normal=0.0, thickness_in_plane=T2)


# The camera


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("packing", [0.001, 0.1, 2.0])  # a column of 1 m, a pile, a flat heap
def test_camera_sees_everything_and_stands_no_further_than_needed(tmp_path, view, packing):
    scene = SyntheticRun(frames_per_phase=1, phases=("relax",), packing=(packing,))
    directory = write_run(tmp_path, scene)
    look = Look.checked(color_by="id", size=SIZE, view=view)
    run = open_run(directory)
    points = extent(read_frames(directory)[0], run, look, read_surroundings(run))
    right, up, forward = look.axes
    position, focus = fitted_camera(points, look.axes, 1.3)
    assert np.cross(focus - position, forward) == pytest.approx(0, abs=1e-6 * np.linalg.norm(focus - position))
    depth = (points - position) @ forward
    edge = np.tan(np.radians(11))
    x, y = (points - position) @ right / depth / edge / 1.3, (points - position) @ up / depth / edge
    assert depth.min() > 0
    filled = max(np.abs(x).max(), np.abs(y).max())
    assert 0.95 < filled <= 1.0
    assert x.max() + x.min() == pytest.approx(0, abs=1e-3)
    assert y.max() + y.min() == pytest.approx(0, abs=1e-3)


# The picture


def test_picture_shows_the_smarticles(run, tmp_path):
    path = render_run(run, output=tmp_path / "a.png", size=SIZE, color_by="height")
    image = pixels(path)
    assert image.shape == (240, 240, 3)
    assert (panel(image) != 255).any(axis=2).mean() > 0.2  # container, floor, smarticles
    assert coloured(panel(image)).mean() > 0.02
    assert list(tmp_path.iterdir()) == [path]  # no temporary file is left


def test_a_single_smarticle_fills_some_pixels(tmp_path):
    run = single_run(tmp_path / "one", u_shape(0.7 * W)[None] + [0, 0, 0.002])
    image = pixels(render_run(run, output=tmp_path / "a.png", size=SIZE, view="top", color_by="id"))
    share = coloured(panel(image)).mean()
    assert 0.002 < share < 0.2


def test_colours_reach_the_right_smarticle(tmp_path):
    """Two smarticles at rest side by side: each has the colour of its own number of contacts."""
    flat = u_shape(0.7 * W)
    run = single_run(
        tmp_path / "two", flat + np.array([[[-0.01, 0, 0.001]], [[0.01, 0, 0.001]]]), contacts=np.array([1, 3])
    )
    look = {"size": (400, 400), "view": "top", "color_by": "contacts"}
    image = panel(pixels(render_run(run, output=tmp_path / "a.png", **look)))
    scale = ColourScale.of(COLOURINGS["contacts"], 1, 3)
    expected = scale.colours(np.array([1, 3])).astype(int)
    for half, colour, other in ((slice(0, 172), *expected), (slice(172, 344), *expected[::-1])):
        part = image[:, half][coloured(image[:, half])]
        assert len(part) > 200
        # Light changes a colour's brightness, not its direction.
        mean = part.mean(axis=0)

        def closeness(wanted, mean=mean):
            return mean @ wanted / np.linalg.norm(mean) / np.linalg.norm(wanted)

        assert closeness(colour) > 0.985
        assert closeness(colour) > closeness(other) + 0.05


def test_pictures_of_other_times_differ(run, tmp_path):
    first = pixels(render_run(run, output=tmp_path / "a.png", size=SIZE, time=0.5))
    last = pixels(render_run(run, output=tmp_path / "b.png", size=SIZE))
    assert (panel(first) != panel(last)).any(axis=2).mean() > 0.02


def test_wall_is_drawn_as_long_as_it_is_there(tmp_path):
    run = write_run(tmp_path / "run", SyntheticRun(frames_per_phase=1))
    before = panel(pixels(render_run(run, output=tmp_path / "before.png", size=SIZE)))
    for file in ("run.json", "done.json"):
        (run / file).write_text((run / file).read_text().replace('"shake"', '"remove-container"'))
    after = panel(pixels(render_run(run, output=tmp_path / "after.png", size=SIZE)))
    # Glass is darker than the white behind it, over a good part of the picture.
    assert (after.sum(axis=2) > before.sum(axis=2) + 20).mean() > 0.1
    assert (after == 255).all(axis=2).mean() > 0.1


def test_drawing_twice_gives_the_same_picture(run, tmp_path):
    first = render_run(run, output=tmp_path / "a.png", size=SIZE)
    second = render_run(run, output=tmp_path / "b.png", size=SIZE)
    assert first.read_bytes() == second.read_bytes()


def test_default_output_lies_in_the_run_directory_and_is_not_overwritten(tmp_path):
    run = write_run(tmp_path / "a", SyntheticRun(frames_per_phase=1))
    path = render_run(run, size=SIZE)
    assert path == run / "render.png"
    before = path.read_bytes()
    with pytest.raises(InputError, match=r"render\.png: exists already"):
        render_run(run, size=SIZE, color_by="id")
    assert path.read_bytes() == before
    render_run(run, size=SIZE, color_by="id", overwrite=True)
    assert path.read_bytes() != before


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"color_by": "mood"}, r"colour by 'mood': is not known; known: crossings, "),
        ({"view": "below"}, r"view 'below': is not known; known: front, oblique, top"),
        ({"size": (100, 400)}, r"size must be 200 to 8000 pixels each way: got 100 x 400"),
        ({"time": 99.0}, r"time must be between 0\.5 s and 22 s, the run's frames: got 99 s"),
        ({"output": "a.jpg"}, r"a\.jpg: the output must end in \.png: got '\.jpg'"),
        ({"color_by": "crosings"}, r"colour by 'crosings': is not known; did you mean 'crossings'\?"),
        ({"output": "nowhere/a.png"}, r"the folder nowhere does not exist"),
    ],
)
def test_bad_input_is_named(run, wrong, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # A picture that is there hides nothing of what else is wrong.
    (tmp_path / "there.png").write_text("mine")
    wrong = {"output": "there.png", **wrong}
    with pytest.raises(InputError, match=message):
        render_run(run, **{"output": "a.png", "size": SIZE, **wrong})
    assert [path.read_text() for path in tmp_path.iterdir()] == ["mine"]


def test_run_without_frames_is_refused(tmp_path):
    run = write_run(tmp_path / "a", SyntheticRun(frames_per_phase=1))
    (run / "frames.pvd").unlink()
    with pytest.raises(InputError, match=r"cannot read list of frames .*frames\.pvd"):
        render_run(run, size=SIZE)


def test_missing_graphics_are_an_error_and_no_crash(run, tmp_path, monkeypatch):
    def refuse(name):
        raise OSError(name)

    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr(ctypes, "CDLL", refuse)
    with pytest.raises(RunError, match=r"no display and no libEGL\.so\.1; apt-get install libegl1"):
        render_run(run, output=tmp_path / "a.png", size=SIZE)


# Scales


@pytest.mark.parametrize(
    ("largest", "labels"), [(0, ["0", "1"]), (3, list("0123")), (40, [*map(str, range(12)), "≥ 12"])]
)
def test_counts_have_one_colour_each(largest, labels):
    scale = figures.count_colours(largest)
    assert list(scale.labels) == labels
    colours = [tuple(scale.colours(scale.norm(number))) for number in range(len(labels))]
    assert len(set(colours)) == len(labels)
    assert tuple(scale.colours(scale.norm(largest))) == colours[min(largest, 12)]


def test_lightness_grows_with_the_count():
    """So that the order of counts is seen in grey print and by the colour-blind."""
    colours = [np.array([int(c[i : i + 2], 16) for i in (1, 3, 5)]) for c in figures.sequence(12)]
    lightness = [colour @ [0.2126, 0.7152, 0.0722] for colour in colours]
    assert np.all(np.diff(lightness) > 5)


def test_run_radius_is_drawn_to_scale(tmp_path):
    """Seen from above, the rim spans the panel and the U its share of it."""
    run = single_run(tmp_path / "one", u_shape(0.7 * W)[None] + [0, 0, 0.002])
    image = panel(pixels(render_run(run, output=tmp_path / "a.png", size=(500, 500), view="top", color_by="id")))
    columns = np.flatnonzero((image < 200).any(axis=(0, 2)))
    inside = np.flatnonzero((image[..., 0] - image[..., 2] > 60).any(axis=0))  # smarticle 0 is red
    ratio = np.ptp(inside) / np.ptp(columns)
    # The rim is nearer to the camera than the U, so the U looks a little smaller.
    assert 0.8 * (W + T2) / (2 * RADIUS) < ratio < (W + T2) / (2 * RADIUS)


def test_a_disk_that_is_full_is_told_with_the_picture(make_run, mount_disk):
    # What draws tells of no file, and what moves it of a temporary one.
    disk = mount_disk("16k")
    with pytest.raises(RunError, match=rf"^{disk / 'a.png'}: cannot be written \(No space left on device\); free"):
        render_run(make_run(), output=disk / "a.png")
    assert list(disk.iterdir()) == []
