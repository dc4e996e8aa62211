"""Films: which moments, how long each is shown, which colours, and that they move."""

import itertools
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image
from synthetic import SyntheticRun, write_run

from dem.errors import InputError
from postprocess.pictures import film
from postprocess.pictures.film import FilmTimes, durations
from postprocess.pictures.render import render_film

SIZE = (240, 240)
EVEN = ("deposit", "deposit", "deposit")  # phases of one length: frames at equal distances


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Nine frames, 1/3 s apart, from 1/3 s to 3 s."""
    packing = (0.1, 0.12, 0.14, 0.14)
    return write_run(
        tmp_path_factory.mktemp("runs") / "a", SyntheticRun(frames_per_phase=3, phases=EVEN, packing=packing)
    )


def panel(image):
    """The three-dimensional part without its rim."""
    return image[60:190, 5:235]


def shown(path):
    """Pictures (n, height, width, 3) and how long each is shown [ms]."""
    pictures, times = [], []
    with Image.open(path) as images:
        for index in range(images.n_frames):
            images.seek(index)
            images.load()
            pictures.append(np.asarray(images.convert("RGB")).astype(int))
            times.append(images.info["duration"])
    return np.array(pictures), times


def test_every_frame_is_shown_at_the_stated_speed():
    recorded = 0.04 * np.arange(1, 101)
    moments = FilmTimes.choose(recorded, rate=25.0)
    assert moments.indices(recorded) == list(range(100))
    assert moments.pace == "1 × real time"
    assert FilmTimes.choose(recorded, rate=12.5).pace == "0.5 × real time"


def test_frames_at_odd_times_are_shown_nearest_to_theirs():
    """One that is missing is made up for by its neighbour: the speed stays."""
    recorded = np.array([0.0, 1.0, 2.0, 2.2, 3.0, 6.0, 7.0])
    moments = FilmTimes.choose(recorded, rate=10.0)
    assert moments.every == 1.0
    assert recorded[moments.indices(recorded)].tolist() == [0, 1, 2, 3, 3, 6, 6, 7]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"start": 3.0, "end": 2.0}, r"must begin before it ends, within 0 s to 10 s.*: got 3 s to 2 s"),
        ({"start": float("nan")}, r"got nan s to 10 s"),
        ({"every": 0.01}, r"every must be 0\.1 s or more, the time between the run's frames: got 0\.01 s"),
        ({"rate": 0.0}, r"fps must be above 0 and up to 100 pictures per second: got 0"),
    ],
)
def test_times_that_make_no_film_are_named(wrong, message):
    with pytest.raises(InputError, match=message):
        FilmTimes.choose(0.1 * np.arange(101), **wrong)


@pytest.mark.parametrize("rate", [15.0, 24.0, 29.97, 7.0])
@pytest.mark.parametrize("unit", [0.01, 0.001])
def test_a_film_of_rounded_durations_is_as_long_as_it_should_be(rate, unit):
    shown_for = durations(1000, rate, unit)
    assert sum(shown_for) * unit == pytest.approx(1000 / rate, abs=unit / 2)
    assert max(shown_for) - min(shown_for) <= 1


@pytest.mark.parametrize(("suffix", "unit"), [(".gif", 10), (".webp", 1)])
def test_film_moves_and_lasts_as_long_as_its_speed_says(run, tmp_path, suffix, unit):
    path = render_film(run, tmp_path / f"film{suffix}", size=SIZE, color_by="id", frames_per_second=15.0)
    pictures, times = shown(path)
    assert len(pictures) == 9
    for before, after in itertools.pairwise(map(panel, pictures[::3])):
        moved = (np.abs(before - after).max(axis=2) > 30).mean()
        assert 0.01 < moved < 0.6
    # Nine pictures, 1/3 s each, in 0.6 s: 5 × real time, as the caption says.
    assert sum(times) == pytest.approx(600, abs=unit / 2)
    assert all(time % unit == 0 for time in times)
    assert list(tmp_path.iterdir()) == [path]


def test_all_pictures_of_a_gif_have_one_colour_bar_with_the_colours_of_the_scale(run, tmp_path):
    drawn, exact = (
        shown(render_film(run, tmp_path / f"film{suffix}", size=SIZE, color_by="height"))[0]
        for suffix in (".gif", ".webp")
    )
    bars, of_scale = drawn[:, -24:], exact[:, -24:]
    assert (of_scale == of_scale[0]).all()
    assert len(np.unique(of_scale[0].reshape(-1, 3), axis=0)) > 100  # the bar is there
    assert (bars == bars[0]).all()
    # 256 colours stand for thousands; Pillow's own choice for one picture is off by 40 in places.
    assert np.percentile(np.abs(bars - of_scale), 99.5) < 20
    assert np.abs(drawn - exact).mean() < 0.5


def test_mp4_without_an_encoder_is_rejected_before_drawing(run, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(InputError, match=r"\.mp4 needs an encoder .*imageio-ffmpeg, or choose \.gif or \.webp"):
        render_film(run, tmp_path / "a.mp4", size=SIZE)
    with pytest.raises(InputError, match=r"size must be even for \.mp4: got 241 x 240 pixels"):
        film.check_film(tmp_path / "a.mp4", (241, 240))


def test_mp4_is_what_browsers_play(run, tmp_path):
    """H.264 with 4:2:0 colours and the index in front, as long as its speed says, with the colours of the picture."""
    encoder = pytest.importorskip("imageio_ffmpeg", reason="the encoder of .mp4, imageio-ffmpeg, is not installed")
    path = render_film(run, tmp_path / "a.mp4", size=SIZE, color_by="height", frames_per_second=10.0)
    program = shutil.which(encoder.get_ffmpeg_exe())
    described = subprocess.run(
        [program, "-hide_banner", "-i", str(path)], capture_output=True, text=True, check=False
    ).stderr
    assert re.search(r"Video: h264 .*yuv420p.*, 240x240", described)
    assert re.search(r"Duration: 00:00:00\.90", described)
    content = path.read_bytes()
    assert content.index(b"moov") < content.index(b"mdat")
    raw = subprocess.run(
        [program, "-loglevel", "error", "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
        capture_output=True,
        check=True,
    )
    played = np.frombuffer(raw.stdout, dtype=np.uint8).reshape(-1, 240, 240, 3).astype(int)
    exact, _ = shown(render_film(run, tmp_path / "a.webp", size=SIZE, color_by="height"))
    assert len(played) == len(exact) == 9
    apart = [np.abs(panel(played[4]) - panel(exact[number])).mean() for number in range(0, 9, 2)]
    assert apart[2] < 6
    assert apart[2] < 0.7 * min(apart[0], apart[-1])
