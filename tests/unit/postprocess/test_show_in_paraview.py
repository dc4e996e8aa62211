"""The shipped script in a real ParaView: what it sets up, and the pictures that come of it."""

import itertools
import json
import os
import shutil
import subprocess

import numpy as np
import pytest
from PIL import Image
from synthetic import RADIUS, SyntheticRun, write_run

from dem.record.frames import read_frames
from postprocess.export import export_run

PVPYTHON = os.environ.get("PVPYTHON") or shutil.which("pvpython")
DRAWS = bool(os.environ.get("DISPLAY") or os.environ.get("PVPYTHON"))
pytestmark = pytest.mark.skipif(
    PVPYTHON is None or not (DRAWS or shutil.which("Xvfb")),
    reason="no pvpython that can draw: apt-get install paraview python3-paraview xvfb, or set PVPYTHON",
)

# Runs the script as ParaView does, then asks ParaView what there is.
ASK = """
import json, runpy, sys
from paraview import simple
script, folder, answer = sys.argv[1:4]
sys.argv = [script, folder, *sys.argv[4:]]
runpy.run_path(script, run_name="__main__")
boxes = simple.FindSource("smarticles")
shown = simple.GetDisplayProperties(boxes)
scene = {"coloured": list(shown.ColorArrayName), "times": list(boxes.TimestepValues)}
cut = simple.FindSource("wall, cut open")
if cut is not None:
    cut.UpdatePipeline()
    scene["cut"] = list(cut.GetDataInformation().GetBounds())
names = {proxy.SMProxy: name for (name, _), proxy in simple.GetSources().items()}
view = simple.GetActiveView()
inputs = [part.Input.SMProxy for part in view.Representations if part.Visibility and hasattr(part, "Input")]
scene["shown"] = sorted(names[proxy] for proxy in inputs)
json.dump(scene, open(answer, "w"))
"""


@pytest.fixture(scope="module")
def pvpython():
    """Runs pvpython on a display; one server for all tests.

    A server that `xvfb-run` begins for each test on the number that the last one is just giving up loses its
    socket to it.
    """
    if DRAWS:
        yield on_display(None)
        return
    reading, writing = os.pipe()
    command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", "1280x1024x24", "-nolisten", "tcp", "-noreset"]
    with subprocess.Popen(command, pass_fds=[writing], stderr=subprocess.DEVNULL) as server, os.fdopen(reading) as line:
        os.close(writing)
        # The server picks a free number, and prints it once it listens.
        yield on_display(":" + line.readline().strip())
        server.terminate()


def on_display(name):
    environment = os.environ if name is None else {**os.environ, "DISPLAY": name}

    def run(*words):
        command = [PVPYTHON, *map(str, words)]
        return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False, env=environment)

    return run


def shown(pvpython, folder, tmp_path, *words):
    """Return what ParaView shows of an exported folder once the script has run."""
    (tmp_path / "ask.py").write_text(ASK)
    answer = tmp_path / "answer.json"
    done = pvpython(tmp_path / "ask.py", folder / "show_in_paraview.py", folder, answer, *words)
    assert done.returncode == 0, done.stderr + done.stdout
    return json.loads(answer.read_text())


def pixels(path):
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def test_boxes_by_crossings_wall_cut_open_time_running(tmp_path, pvpython):
    run = write_run(tmp_path / "run", SyntheticRun(count=40, frames_per_phase=1, packing=(0.05, 0.06, 0.1, 0.1)))
    folder = export_run(run, to="vtp", every_frame=True, wanted=["crossings"], unwanted=["local_packing_fraction"])
    film = tmp_path / "film"
    scene = shown(pvpython, folder, tmp_path, "--film", film)
    assert scene["coloured"] == ["CELLS", "crossings"]
    assert scene["times"] == pytest.approx(read_frames(run).times.tolist())
    # The half towards the camera, at negative y, is cut away.
    assert scene["cut"][2:4] == pytest.approx((0.0, RADIUS), abs=1e-3 * RADIUS)
    assert scene["shown"] == ["arrows", "floor", "smarticles", "time", "wall, cut open"]
    pictures = [pixels(path) for path in sorted(film.glob("*.png"))]
    assert len(pictures) == 4
    coloured = [int((np.ptp(picture, axis=2) > 40).sum()) for picture in pictures]
    assert min(coloured) > 3000
    assert all((one != other).any() for one, other in itertools.pairwise(pictures))
