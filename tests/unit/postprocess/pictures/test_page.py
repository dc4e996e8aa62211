"""What stands around the drawn part: captions, scale bar, colour bar, several runs beside each other."""

import json

import numpy as np
import pytest
import yaml
from PIL import Image
from synthetic import T1, T2, SyntheticRun, W, u_shape, write_frame, write_manifest, write_run
from synthetic.shapes import bent

from dem.errors import InputError
from dem.record.frames import read_frames
from dem.record.run import Run, open_run
from postprocess import measure_run
from postprocess.pictures.camera import Look
from postprocess.pictures.captions import Caption, caption_of, packing_text, titles_of
from postprocess.pictures.colouring import COLOURINGS, ColourScale
from postprocess.pictures.page import Page, fitted, page_size, round_length
from postprocess.pictures.render import render_run
from postprocess.pictures.strings import read_strings

LONG = "a name that is much longer than any picture of a pile of smarticles is wide, and that goes on and on and on"


def pixels(path):
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def one(directory, vertices, **told):
    """A run of one frame."""
    write_run(directory, SyntheticRun(count=len(vertices), frames_per_phase=1, phases=("relax",), packing=(0.001,)))
    write_frame(directory / "frames/frame_000000.vtu", vertices, time=0.5, phase=0, **told)
    return directory


# Captions


def test_phi_of_a_picture_is_that_of_measure(tmp_path):
    run = write_run(tmp_path / "a", SyntheticRun(frames_per_phase=2, floor_z=-0.003))
    frames, manifest = read_frames(run), open_run(run)
    table = measure_run(Run(run), costly="never")
    for number, frame in enumerate(frames):
        expected = table["phi second-highest-com [-]"][number]
        assert packing_text(frame, manifest) == f"φ = {expected:.4f} (second-highest-com)"


def test_runs_of_one_name_beside_each_other_are_told_apart_by_their_folders(tmp_path):
    def runs(*names, name="pile"):
        made = SyntheticRun(count=2, frames_per_phase=1, name=name)
        return [open_run(write_run(tmp_path / folder, made)) for folder in names]

    a, b = runs("runs/a", "runs/b")
    assert titles_of([a, b]) == ["pile (a)", "pile (b)"]
    assert titles_of([a]) == ["pile"]
    assert titles_of([a, *runs("c", name="other")]) == ["pile", "other"]
    assert titles_of(runs("one/x", "two/x")) == ["pile (one/x)", "pile (two/x)"]
    assert titles_of([a, a]) == ["pile (a)", "pile (a)"]
    assert caption_of(read_frames(a.path)[-1], a, title="pile (a)").title == "pile (a)"


def test_a_picture_without_phi_says_why(tmp_path):
    run = write_run(tmp_path / "a", SyntheticRun(frames_per_phase=1))
    frame = read_frames(run)[-1]

    def said(old, new):
        for name in ("run.json", "done.json"):
            content = json.loads((run / name).read_text())
            (run / name).write_text(json.dumps(content).replace(old, new))
        return packing_text(frame, open_run(run))

    assert said('"shake"', '"remove-container"') == "no φ: the wall is gone"
    assert said('"container_tiers": 1', '"container_tiers": 3') == "no φ: a mould of 3 tiers"
    alone = one(tmp_path / "b", u_shape(0.7 * W)[None] + np.array([0, 0, 0.002]))
    assert packing_text(read_frames(alone)[0], open_run(alone)) == "no φ: fewer than 2 smarticles"
    assert measure_run(Run(alone), costly="never")["phi second-highest-com [-]"].isna().all()


def test_a_film_tells_its_pace(tmp_path):
    run = write_run(tmp_path / "a", SyntheticRun(frames_per_phase=1))
    frame, manifest = read_frames(run)[0], open_run(run)
    assert caption_of(frame, manifest, pace="0.5 × real time").lines[0].endswith("(deposit)   0.5 × real time")
    assert caption_of(frame, manifest).lines[0] == "l/w = 0.7   N = 12   t = 1.000 s (deposit)"


@pytest.mark.parametrize("text", ["short", LONG, LONG * 5, "⟨N⟩ φ ≥ " * 9, "two\nlines\x00"])
@pytest.mark.parametrize("room", [60.0, 400.0])
def test_text_keeps_to_its_room(text, room):
    said, font = fitted(text, 12.0, room)
    assert font.getlength(said) <= room
    assert font.size >= 0.6 * 12.0
    assert said.isprintable()
    assert said[:3] == "".join(c if c.isprintable() else "?" for c in text)[:3]


@pytest.mark.parametrize("size", [(200, 200), (320, 200), (200, 600), (1000, 260), (720, 720)])
def test_nothing_is_written_over_an_edge(size):
    """Long captions, labels of two digits: margins stay white in every shape of picture."""
    look = Look.checked(color_by="crossings", size=size, view="front")
    scale = ColourScale.of(COLOURINGS["crossings"], 0, 40)
    width, height = look.panel
    panel = np.full((height, width, 3), 255, dtype=np.uint8)
    page = Page(look, scale, 0.05, columns=2)
    assert page.size == page_size(look, 2) == (width + size[0], size[1])
    captions = [Caption(LONG, (LONG, "φ = 0.1234 (second-highest-com)   ⟨N⟩ = 12.34")), Caption("b", ("l/w", LONG))]
    image = np.asarray(page.picture([panel, panel], captions)).astype(int)
    dark = image.min(axis=2) < 200
    assert not dark[:, :3].any()
    assert not dark[:, -3:].any()
    assert not dark[:3].any()
    assert not dark[-3:].any()
    # Captions end above the panels, and the first before the second begins.
    assert not dark[size[1] - look.foot - height : size[1] - look.foot, :width].any()
    gap = dark[: size[1] - look.foot - height, width - 4 : width + 4]
    assert not gap.any()
    assert dark[: size[1] - look.foot - height, :width].any()


@pytest.mark.parametrize(
    ("low", "high"), [(0.0, 0.00025), (0.0, 1e-9), (-1234.5, 99999.0), (0.0314, 0.0339), (2.0, 3.0)]
)
def test_a_bar_of_long_numbers_keeps_to_the_picture(low, high):
    look = Look.checked(color_by="speed", size=(220, 300), view="front")
    width, height = look.panel
    page = Page(look, ColourScale.of(COLOURINGS["speed"], low, high), None)
    panel = np.full((height, width, 3), 255, dtype=np.uint8)
    dark = np.asarray(page.picture([panel], [Caption("", ())])).min(axis=2) < 200
    assert not dark[:, -8:].any()
    assert dark[:, width:].any()


@pytest.mark.parametrize("columns", [1, 2, 3])
@pytest.mark.parametrize("side", [240, 360, 420, 606])
def test_an_even_size_stays_even_with_several_runs(columns, side):
    """As H.264 wants it."""
    look = Look.checked(color_by="crossings", size=(side, 240), view="front")
    assert page_size(look, columns)[0] % 2 == 0


# Scale


@pytest.mark.parametrize(("most", "length"), [(37.0, 20.0), (50.0, 50.0), (49.9, 20.0), (0.13, 0.1), (1000.0, 1000.0)])
def test_scale_bars_have_round_lengths(most, length):
    assert round_length(most) == pytest.approx(length)


def test_the_scale_bar_is_as_long_as_it_says(tmp_path):
    """Against the middle link of a smarticle that lies at mid-depth, seen from above."""
    # The wall is drawn up to w, above whole quarters of it.
    run = one(tmp_path / "a", u_shape(0.7 * W)[None] + np.array([0, 0, W / 2]))
    image = pixels(render_run(run, output=tmp_path / "a.png", size=(800, 800), view="top", color_by="id"))
    strip = image[-36:, :400].max(axis=2) < 100
    row = strip.sum(axis=1).argmax()
    bar = np.flatnonzero(strip[row])
    length = next(k for k, gap in enumerate(np.diff(bar, append=1e9), 1) if gap > 1)  # until the text begins
    red = image[..., 0] - image[..., 2] > 60  # smarticle 0
    smarticle = np.ptp(np.flatnonzero(red.any(axis=0))) + 1
    assert smarticle / length == pytest.approx((W + T2) / 0.010, rel=0.02)


# Beside each other


def test_runs_beside_each_other_have_one_scale_one_time_and_one_bar(tmp_path):
    """Two and one flat smarticles: the same smarticle is as large in both, its colour that of the common scale."""
    flat = u_shape(0.7 * W)[None]
    low, high = np.array([-0.012, 0, 0.001]), np.array([0.006, 0, 0.001])
    first = one(tmp_path / "a", np.concatenate([flat + low, flat + high]), contacts=[2, 5])
    second = one(tmp_path / "b", flat + low, contacts=[2])
    look = {"size": (400, 400), "view": "top", "color_by": "contacts"}
    image = pixels(render_run(first, compare=[second], output=tmp_path / "c.png", **look))
    across = 2 * int((400 - 13 * 4.4) / 2)
    assert image.shape == (400, across + 400, 3)
    part = 2 * across // 5  # without the other one
    left, right = image[60:370, :part], image[60:370, across : across + part]
    assert (np.ptp(left, axis=2) > 40).sum() > 100
    assert (np.abs(left - right).max(axis=2) > 40).sum() < 0.02 * (np.ptp(left, axis=2) > 40).sum()
    # Alone the second would have its own scale of colours.
    alone = pixels(render_run(second, output=tmp_path / "d.png", **look))
    assert (np.abs(alone[60:370, :part] - right).max(axis=2) > 30).sum() > 100


def test_a_wide_container_beside_a_tall_pile_is_whole(tmp_path):
    """Walls are drawn as high as the tallest pile asks for: the rim of a wider one is in the picture too."""
    flat = u_shape(0.7 * W)[None]
    wide = one(tmp_path / "a", flat + np.array([0.0, 0.0, 0.001]))
    tall = one(tmp_path / "b", np.concatenate([flat + np.array([0.0, 0.0, z]) for z in (0.001, 0.06)]))
    manifest = json.loads((tall / "run.json").read_text())
    (tall / "run.json").write_text(json.dumps(manifest | {"container_radius_m": 0.012}))
    look = {"size": (400, 400), "color_by": "id"}
    image = pixels(render_run(wide, compare=[tall], output=tmp_path / "c.png", **look))
    across = image.shape[1] // 2
    for number in (0, 1):
        panel = image[60:360, number * across : (number + 1) * across]
        drawn = np.flatnonzero((panel.min(axis=2) < 250).any(axis=0))
        assert drawn[0] > 0.005 * across, f"panel {number} is cut off on the left"
        assert drawn[-1] < 0.995 * across - 1, f"panel {number} is cut off on the right"
        assert np.ptp(drawn) > 0.2 * across


def test_runs_are_compared_at_the_last_time_that_all_have(tmp_path):
    """The picture of two runs is that of either at this time."""
    short = write_run(tmp_path / "a", SyntheticRun(frames_per_phase=2, phases=("deposit", "relax")))
    long = write_run(tmp_path / "b", SyntheticRun(frames_per_phase=2, seed=2))
    look = {"size": (240, 240), "color_by": "id", "overwrite": True}
    both = pixels(render_run(long, compare=[short], output=tmp_path / "c.png", **look))
    at = pixels(render_run(long, compare=[short], output=tmp_path / "c.png", time=1.5, **look))
    assert np.array_equal(both, at)
    later = pixels(render_run(long, output=tmp_path / "c.png", **look))
    assert (np.abs(later[60:210, :230] - both[60:210, :230]).max(axis=2) > 30).mean() > 0.01
    with pytest.raises(InputError, match=r"time must be between 0\.5 s and 1\.5 s, the run's frames: got 3 s"):
        render_run(long, compare=[short], output=tmp_path / "c.png", time=3.0, **look)


def test_limits_are_given_or_of_the_whole_run(tmp_path):
    run = write_run(tmp_path / "a", SyntheticRun(frames_per_phase=2))
    look = {"size": (240, 240), "color_by": "height", "overwrite": True}

    def bar(**options):
        return pixels(render_run(run, output=tmp_path / "a.png", **look, **options))[50:200, -56:]

    given = bar(limits=(0.0, 40.0))
    assert np.array_equal(given, bar(limits=(0.0, 40.0), time=1.0))
    assert np.array_equal(bar(limits="run"), bar(limits="run", time=1.0))
    assert not np.array_equal(bar(limits="run"), given)
    with pytest.raises(InputError, match="two finite numbers in order: got 3 and 1"):
        bar(limits=(3.0, 1.0))


# One smarticle


def test_one_smarticle_is_drawn_with_what_passes_through_it(tmp_path):
    """A U upright, another whose middle link passes through it, one beside: orange, blue, and nothing."""
    u = u_shape(0.7 * W) @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]) + np.array([0, 0, 0.01])
    across = (u - [0, 0, 0.01]) @ np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]) + np.array([0, 0, 0.012])
    beside = u + np.array([0, 0.014, 0])
    run = one(tmp_path / "a", np.array([beside, u, across]))
    image = pixels(render_run(run, output=tmp_path / "a.png", smarticle=1, size=(300, 300)))[40:280]
    red, blue = image[..., 0], image[..., 2]
    orange, azure = (red - blue > 60) & (red > 150), (blue - red > 60) & (blue > 80)
    assert orange.mean() > 0.01
    assert azure.mean() > 0.005
    # Drawn alone it has its plane and no blue.
    alone = pixels(render_run(run, output=tmp_path / "b.png", smarticle=0, size=(300, 300)))[40:280]
    assert not ((alone[..., 2] - alone[..., 0]) > 60).any()
    plane = (alone[..., 0] > 225) & (np.abs(alone[..., 0] - alone[..., 2] - 45) < 35)
    assert plane.mean() > 0.15
    with pytest.raises(InputError, match=r"smarticle 3: there are 0 to 2 at 0\.5 s; choose one of these"):
        render_run(run, output=tmp_path / "c.png", smarticle=3)
    with pytest.raises(InputError, match="smarticle 1: is drawn alone, in colours and from a side of its own"):
        render_run(run, output=tmp_path / "c.png", smarticle=1, view="top")


# Strings

GAP, CORD = 0.0005, 0.02  # between the two smarticles of the chain, length of a string [m]


def chain(directory):
    """Two hooked smarticles in a plane, a string of 20 mm at either end along the axis, pulled at 20 mm/s."""
    offset, step = 0.7 * W + GAP + T1 / 2, W - T1 - GAP
    first = bent(W, 0.7) + np.array([-step / 2, -offset / 2, 0])
    made = SyntheticRun(phases=("arrange", "strain"), count=2, frames_per_phase=2, series=False)
    write_run(directory, made)
    write_manifest(directory, made, planar=True, channel_width_m=0.03)
    strings = {"speed_m_per_s": 0.02, "string_length_m": CORD, "tied_at": "axis", "distance_m": 0.1}
    scene = {"phases": [{"type": "arrange", "gap_m": GAP}, {"type": "strain", **strings}]}
    (directory / "scene.yaml").write_text(yaml.safe_dump(scene))
    half_turn = np.array([-1.0, -1.0, 1.0])
    for number in range(4):
        path = directory / f"frames/frame_{number:06d}.vtu"
        write_frame(path, np.array([first, first * half_turn]), time=float(number), phase=number // 2)
    return directory


def test_strings_are_where_the_scene_ties_them(tmp_path):
    run = chain(tmp_path / "a")
    strings, frames = read_strings(open_run(run)), read_frames(run)
    assert len(strings.lines(frames[1])) == 0  # not tied before they pull
    reach = (2 * W - T1 - GAP) / 2
    now = strings.lines(frames[3])
    np.testing.assert_allclose(now[:, 0], [[-reach, 0, 0], [reach, 0, 0]], atol=1e-9)
    moved = strings.speed * (frames[3].time - strings.start)
    np.testing.assert_allclose(now[:, 1, 0], [-reach - CORD, reach + CORD + moved], atol=1e-9)


def test_strings_and_walls_of_a_channel_are_drawn(tmp_path):
    """Seen from above: red from the chain's ends to both sides, a grey wall above and below it."""
    run = chain(tmp_path / "a")
    size = {"size": (400, 400)}
    image = pixels(render_run(run, output=tmp_path / "a.png", **size))[55:375]
    red = (image[..., 0] - image[..., 1] > 125) & (image[..., 1] < 70)
    rows, columns = np.nonzero(red)
    assert np.ptp(rows) < 20  # along the axis
    assert columns.min() < 20
    assert columns.max() > 380
    middle = np.flatnonzero(red.any(axis=0))
    assert np.diff(middle).max() > 50  # the chain itself is not red there
    grey = (np.abs(image - [0x7D, 0x8F, 0x9F]).max(axis=2) < 40).sum(axis=1)
    walls = np.flatnonzero(grey > 300)
    # 30 mm apart, where chain, strings and the way pulled are some 102 mm.
    assert np.ptp(walls) == pytest.approx(0.030 / (2 * W - T1 - GAP + 2 * CORD + 0.04) * np.ptp(columns), rel=0.05)
    before = pixels(render_run(run, output=tmp_path / "b.png", time=1.0, **size))[55:375]
    assert not ((before[..., 0] - before[..., 1] > 125) & (before[..., 1] < 70)).any()
