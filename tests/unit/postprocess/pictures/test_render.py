"""Pictures are judged by their pixels; a scene is small and so is its picture."""

import ctypes
from unittest.mock import Mock

import numpy as np
import pytest
from PIL import Image
from synthetic import RADIUS, SyntheticRun, W, u_shape, write_frame, write_run
from synthetic.forces import pressed

from dem.errors import InputError, RunError
from dem.record.forces import force_mesh
from dem.record.frames import FrameWriter, read_frames
from dem.record.names import FORCE
from postprocess.bodies.colours import ColourScale
from postprocess.bodies.fields import BY_NAME
from postprocess.geometry.links import centres_of_mass
from postprocess.pictures.canvas import Canvas
from postprocess.pictures.render import render_run

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
    """The three-dimensional part: below the caption, above the bars."""
    height, width, _ = image.shape
    unit = max(min(height, width) / 100, 4.4)
    return image[round(11.5 * unit) : round(height - 10 * unit)]


def coloured(image):
    """Which pixels are clearly neither white nor grey: container, floor and shadows are."""
    return np.ptp(image, axis=2) > 40


def test_a_field_without_values_is_said_to_have_none(tmp_path, monkeypatch):
    scales = Mock(side_effect=Canvas)
    monkeypatch.setattr("postprocess.pictures.render.Canvas", scales)
    one = single_run(tmp_path / "one", u_shape(0.7 * W)[None])  # alone its Voronoi cell is not closed
    for field, words in (("local_packing_fraction", ["no values here: grey"]), ("contacts", ["0", "1"])):
        render_run(one, output=tmp_path / f"{field}.png", size=SIZE, color_by=field)
        assert list(scales.call_args.kwargs["scale"].labels.values()) == words


def test_colours_reach_the_right_smarticle(tmp_path):
    """Two smarticles at rest side by side: each has the colour of its own number of contacts."""
    flat = u_shape(0.7 * W)
    run = single_run(
        tmp_path / "two", flat + np.array([[[-0.01, 0, 0.001]], [[0.01, 0, 0.001]]]), contacts=np.array([1, 3])
    )
    look = {"size": (400, 400), "view": "top", "color_by": "contacts"}
    image = panel(pixels(render_run(run, output=tmp_path / "a.png", **look)))
    expected = ColourScale.of(BY_NAME["contacts"], (1, 3)).painted(np.array([1, 3])).astype(int)
    for half, colour, other in ((slice(0, 200), *expected), (slice(200, 400), *expected[::-1])):
        part = image[:, half][coloured(image[:, half])]
        assert len(part) > 200
        # Light changes a colour's brightness, not its direction.
        mean = part.mean(axis=0)

        def closeness(wanted, mean=mean):
            return mean @ wanted / np.linalg.norm(mean) / np.linalg.norm(wanted)

        assert closeness(colour) > 0.985
        assert closeness(colour) > closeness(other) + 0.05


def test_wall_is_drawn_as_long_as_it_is_there(tmp_path):
    run = write_run(tmp_path / "run", SyntheticRun(frames_per_phase=1, phases=("relax", "remove-container")))
    before = panel(pixels(render_run(run, output=tmp_path / "before.png", size=SIZE, time=0.5)))
    after = panel(pixels(render_run(run, output=tmp_path / "after.png", size=SIZE)))
    # Glass is darker than the white behind it, over a good part of the picture.
    assert (after.sum(axis=2) > before.sum(axis=2) + 20).mean() > 0.1
    assert (after == 255).all(axis=2).mean() > 0.1


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
        ({"view": "below"}, r"view: 'below' is not known; known: front, oblique, top"),
        ({"size": (100, 400)}, r"size must be 200 to 8000 pixels each way: got 100 x 400"),
        ({"time": 99.0}, r"time must be between 0\.5 s and 22 s, the run's frames: got 99 s"),
        ({"output": "a.jpg"}, r"a\.jpg: the output must end in \.png: got '\.jpg'"),
        ({"color_by": "crosings"}, r"'crosings' is no field; did you mean 'crossings'\?"),
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


def test_missing_graphics_are_an_error_and_no_crash(run, tmp_path, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr(ctypes, "CDLL", Mock(side_effect=OSError))
    with pytest.raises(RunError, match=r"no display and no libEGL\.so\.1; apt-get install libegl1"):
        render_run(run, output=tmp_path / "a.png", size=SIZE)


def test_the_scale_bar_has_its_length_and_the_view_has_everything_in_it(run, tmp_path):
    """The rim is as many pixels wide as the scale bar says, in the middle of the picture, which it fills."""
    image = pixels(render_run(run, output=tmp_path / "a.png", size=(500, 400), view="top", color_by="id"))
    columns = np.flatnonzero((panel(image) < 200).any(axis=(0, 2)))
    rows = np.flatnonzero((panel(image) < 200).any(axis=(1, 2)))
    bar = image[round(400 - 5.5 * 4.4)]  # 10 mm
    black = np.ptp(np.flatnonzero((bar < 40).all(axis=1)))
    assert np.ptp(columns) / black == pytest.approx(2e3 * RADIUS / 10, rel=0.04)
    assert columns.mean() == pytest.approx(250, abs=3)
    assert np.ptp(rows) == pytest.approx(0.97 * len(panel(image)), rel=0.03)


def test_runs_side_by_side_share_scale_and_colours(run, tmp_path):
    image = pixels(render_run(run, compare=[run], output=tmp_path / "a.png", size=SIZE))
    assert image.shape == (240, 480, 3)
    left, right = panel(image)[:, :240], panel(image)[:, 240:]
    assert coloured(left).mean() > 0.02
    assert np.abs(left - right).max() <= 1  # rounding of shades at a panel's edge


def test_one_smarticle_is_orange_and_what_passes_through_it_blue(tmp_path):
    through = np.array([[0.0, 0.01, -0.004], [0.001, 0.0, -0.004], [0.001, 0.0, 0.006], [0.0, 0.01, 0.006]])
    run = single_run(tmp_path / "two", np.array([u_shape(0.7 * W), through]))
    image = panel(pixels(render_run(run, output=tmp_path / "a.png", size=(400, 400), smarticle=0)))
    red, _, blue = np.moveaxis(image, 2, 0)
    assert (red - blue > 80).mean() > 0.01
    assert (blue - red > 60).mean() > 0.001
    for wrong, message in (({"smarticle": 7}, "there are 0 to 1"), ({"smarticle": 0, "view": "top"}, "drawn alone")):
        with pytest.raises(InputError, match=message):
            render_run(run, output=tmp_path / "b.png", **wrong)


def test_forces_are_drawn_where_they_are_recorded(tmp_path):
    run = single_run(tmp_path / "two", u_shape(0.7 * W) + np.array([[[-0.008, 0, 0.001]], [[0.008, 0, 0.001]]]))
    with pytest.raises(InputError, match=r"records no forces; .*recording\.contact_forces: true"):
        render_run(run, output=tmp_path / "a.png", forces=True)
    frame = read_frames(run)[0]
    mesh = force_mesh(pressed([(0, 1)], [2e-3]), centres_of_mass(frame.vertices), time=0.5, phase=0)
    FrameWriter(run, FORCE).write(mesh, 0.5)
    look = {"size": SIZE, "view": "top", "color_by": "contacts"}
    image = panel(pixels(render_run(run, output=tmp_path / "a.png", forces=True, **look)))
    assert ((image[..., 0] > 100) & (image[..., 1] < 60)).sum() > 20
