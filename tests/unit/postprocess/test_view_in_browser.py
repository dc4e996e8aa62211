"""The page in a real browser: what it shows, what it does, and that it calls no other host."""

import io
import json
import shutil
import time

import numpy as np
import pytest
from PIL import Image
from synthetic import SyntheticRun, W, mesh_of, u_shape, write_frame, write_run
from synthetic.viewing import serving

from dem.record.frames import FrameWriter, read_frames

playwright = pytest.importorskip("playwright.sync_api", reason="playwright, of requirements-dev.txt, is not installed")
CHROMIUM = shutil.which("chromium")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no chromium: apt-get install chromium")

HOSTILE = (
    "{{ document.title='owned' }}<img src=x onerror=\"document.title='owned'\"><script>document.title='owned'</script>"
)
# Mesa draws the page a hundred times as fast as the browser's own software, which stands in where there is no EGL.
GRAPHICS = (
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=gl-egl",
    "--ignore-gpu-blocklist",
    "--enable-unsafe-swiftshader",
)


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as started:
        made = started.chromium.launch(executable_path=CHROMIUM, args=list(GRAPHICS))
        yield made
        made.close()


class Window:
    """One page, and what went wrong in it."""

    def __init__(self, browser, address):
        self.faults, self.hosts = [], set()
        self.page = browser.new_context(viewport={"width": 900, "height": 600}).new_page()
        self.page.on(
            "console", lambda said: self.faults.append(said.text) if said.type in {"error", "warning"} else None
        )
        self.page.on("pageerror", lambda error: self.faults.append(str(error)))
        self.page.on("request", lambda request: self.hosts.add(request.url.split("/")[2]))
        self.page.goto(address)
        self.page.wait_for_selector("canvas")
        self.settled()

    def picture(self):
        shot = io.BytesIO(self.page.locator("main").screenshot())
        return np.asarray(Image.open(shot).convert("RGB")).astype(int)

    def settled(self):
        """Waits until the picture stays as it is and is not empty."""
        before, end = None, time.monotonic() + 30
        while time.monotonic() < end:
            now = self.picture()
            if before is not None and (now != 255).any() and now.shape == before.shape and (now == before).all():
                return now
            before = now
            time.sleep(0.4)
        raise AssertionError("the picture does not settle")

    def click(self, row):
        """Clicks on the middle column of the picture, at a row of it."""
        box = self.page.locator("main").bounding_box()
        self.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + row)

    def text(self, selector):
        return self.page.locator(selector).inner_text()


@pytest.fixture
def flat(tmp_path):
    """One flat smarticle, its middle link across the container's axis; a name that is code if it is not text."""
    directory = tmp_path / "flat"
    run = SyntheticRun(count=1, frames_per_phase=2, phases=("relax",), packing=(0.001,), name=HOSTILE)
    write_run(directory, run)
    for number, height in ((0, 0.001), (1, 0.004)):
        vertices = u_shape(0.7 * W)[None] + [0.0, 0.0, height]
        write_frame(directory / f"frames/frame_{number:06d}.vtu", vertices, time=0.25 * (number + 1), phase=0)
    return directory


def test_page(flat, browser):
    with serving(flat) as (process, address):
        window = Window(browser, address)
        page = window.page
        # A hostile name is text.
        assert HOSTILE in window.text("header")
        assert page.title() == "smarticles"
        assert window.text("#clock") == "t = 0.5 s, frame 1 of 1"
        before = window.settled()
        # Time.
        page.locator("#time").fill("0")
        page.wait_for_function("document.querySelector('#clock').innerText.startsWith('t = 0.25 s')")
        assert (window.settled() != before).any()
        page.locator("#time").fill("1")
        page.wait_for_function("document.querySelector('#clock').innerText.startsWith('t = 0.5 s')")
        # Picking, between the dark outlines of the middle link; then the floor beside it.
        shown = window.settled()
        (outlines,) = np.nonzero(shown[:, shown.shape[1] // 2].max(axis=-1) < 90)
        window.click(float(outlines.mean()))
        page.wait_for_selector("#pick")
        assert window.text("#pick").split()[:2] == ["smarticle_id", "0"]
        assert "link\n1" in window.text("#pick")
        assert "local_packing_fraction" in window.text("#pick")
        picture = window.settled()
        magenta = (picture[..., 0] > 120) & (picture[..., 1] < 60) & (picture[..., 2] > 60)
        assert magenta.sum() > 100
        window.click(float(outlines.max()) + 15)
        page.wait_for_selector("#pick", state="detached")
        # Another field.
        page.select_option("#field", "height_m")
        page.wait_for_function("document.querySelectorAll('.key').length == 5")
        assert page.locator("#play").inner_text() == "play"
        page.click("#play")
        page.wait_for_function("document.querySelector('#clock').innerText.startsWith('t = 0.25 s')")
        page.click("#play")
        # It calls no other host, and nothing went wrong.
        assert window.hosts == {address.split("/")[2]}
        assert window.faults == []
        page.context.close()
        # It ends with its window.
        assert process.wait(timeout=20) == 0


def test_a_run_that_goes_on_is_followed(tmp_path, browser):
    run = SyntheticRun(frames_per_phase=1, status="unfinished", packing=(0.1,) * 4)
    directory = write_run(tmp_path / "going", run)
    with serving(directory) as (_, address):
        window = Window(browser, address)
        assert window.text("#clock").endswith("frame 3 of 3")
        writer = FrameWriter(directory, times=read_frames(directory).times.tolist())
        writer.write(mesh_of(run.vertices(0.05), time=25.0, phase=3), 25.0)
        window.page.wait_for_function("document.querySelector('#clock').innerText == 't = 25 s, frame 4 of 4'")
        window.page.locator("#follow").uncheck()
        writer.write(mesh_of(run.vertices(0.06), time=26.0, phase=3), 26.0)
        window.page.wait_for_function("document.querySelector('#time').max == '5'")
        assert window.text("#clock") == "t = 25 s, frame 4 of 4" or window.text("#clock").startswith("t = 25 s")
        (directory / "failed.json").write_text(
            json.dumps({"status": "failed", "cause": "a smarticle escaped", "time_s": 26.0, "checkpoint_s": None})
        )
        window.page.wait_for_selector("#follow", state="detached")
        assert window.faults == []
        window.page.context.close()
