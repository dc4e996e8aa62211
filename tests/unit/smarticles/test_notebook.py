"""What a notebook shows: tables and pictures of objects, one block per sweep, and a cell that is run again."""

import base64
import re
import subprocess
import sys
from html.parser import HTMLParser
from io import BytesIO
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from command_cases import WriteRun
from PIL import Image

import smarticles
from dem.notebook import picture_of
from dem.record.names import DONE
from smarticles.public import write_sweep
from smarticles.sweeps import compute, make_folder

ROD = {"shape": "rod", "length_m": 0.012, "diameter_m": 0.001}
STAPLE = {"shape": "staple", "crown_m": 0.008, "leg_m": 0.006, "diameter_m": 0.001}


def scene_of(**changes: object) -> smarticles.Scene:
    keys = {"seed": 1, "count": 5, "engine": "links", "fidelity": "draft", "phases": [{"type": "deposit"}]}
    return smarticles.Scene(**{**keys, **changes})


class Cells(HTMLParser):
    """The texts of the cells of all tables, and the tags."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.texts: list[str] = []
        self.tags: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.tags.append(tag)

    def handle_data(self, data: str) -> None:
        if data.strip():
            self.texts.append(data.strip())


def html_of(shown: object) -> str:
    return shown._repr_html_()  # type: ignore[attr-defined,no-any-return]


def facts(shown: object) -> dict[str, str]:
    texts = Cells(html_of(shown)).texts
    return dict(zip(texts[::2], texts[1::2], strict=True))


def picture(shown: object) -> Image.Image:
    """The picture, which must be small enough for a notebook that is kept in version control."""
    text = html_of(shown)
    found = re.search(r'src="data:image/png;base64,([^"]+)"', text)
    assert found is not None
    assert len(text) < 62_000
    with Image.open(BytesIO(base64.b64decode(found[1]))) as image:
        return image.convert("RGB")


def colours(image: Image.Image) -> int:
    """How many pixels are coloured."""
    return int((np.ptp(np.asarray(image).astype(int), axis=2) > 60).sum())


# -- tables and pictures -----------------------------------------------------------------------------------------------


def test_a_run_is_its_state_and_its_pile(tmp_path: Path, write_run: WriteRun) -> None:
    run = smarticles.read(write_run(tmp_path / "run", name="a <b>pile</b> & more"))
    shown = facts(run)
    assert shown["run"] == "a <b>pile</b> & more"
    assert shown["state"].startswith("done, 22 s simulated")
    assert shown["bodies"] == "12 smarticles, l/w = 0.7"
    assert shown["phases"] == "deposit until 1 s, relax until 1.5 s, shake until 21.5 s, relax until 22 s"
    assert shown["frames"] == "16, 0.25 s to 22 s"
    assert "com_height_m" in shown["series"]
    assert "b" not in Cells(html_of(run)).tags
    assert colours(picture(run)) > 500


def test_a_frame_is_the_pile_at_its_time(tmp_path: Path, write_run: WriteRun) -> None:
    frames = smarticles.read(write_run(tmp_path / "run")).frames
    assert facts(frames[3])["frame"] == "3, at 1 s, in phase 0"
    assert facts(frames[3])["bodies"] == "12, with 36 links"
    first, last = picture(frames[0]), picture(frames[-1])
    assert np.asarray(first).shape == np.asarray(last).shape
    assert (np.asarray(first) != np.asarray(last)).any()
    assert (np.asarray(last) == np.asarray(picture(frames[-1]))).all()
    # A slice of the frames shows the frame itself, too, not the one with its place in the slice.
    assert (np.asarray(last) == np.asarray(picture(frames[8:][-1]))).all()


def test_a_scene_is_its_keys_and_its_bodies(tmp_path: Path) -> None:
    shown = facts(scene_of(name="mine", phases=[{"type": "deposit"}, {"type": "relax", "duration_s": 0.5}]))
    assert shown == {
        "scene": "mine",
        "bodies": "5 smarticles, l/w = 0.7",
        "container": "radius 23.4 mm",
        "engine": "links, draft, seed 1",
        "phases": "deposit, relax 0.5 s",
    }
    assert colours(picture(scene_of())) > 5000
    mixed = scene_of(particle=[{**ROD, "spread": 0.2, "share": 3}, STAPLE | {"share": 2}])
    assert facts(mixed)["bodies"] == "5: 3 rod, 2 staple"
    image = np.asarray(picture(mixed)).astype(int)
    # One body of each entry, beside each other, the rod to the left; not one of each of its 16 sizes.
    redder = image[60:-60, :, 0] - image[60:-60, :, 2]
    blue, orange = np.nonzero(redder < -90)[1], np.nonzero(redder > 90)[1]
    assert len(blue) > 1000
    assert len(orange) > 1000
    assert blue.max() < orange.min()
    assert colours(picture(scene_of(particle=[{**ROD, "spread": 0.2, "share": 0}, STAPLE]))) > 1000


@pytest.mark.parametrize("shape", [
    {"shape": "ring", "radius_m": 0.005},
    {"shape": "filament", "length_m": 0.03, "diameter_m": 0.001, "segments": 8, "young_modulus_Pa": 1e6},
])  # fmt: skip
def test_bodies_of_any_shape_have_a_picture(shape: dict[str, object]) -> None:
    assert colours(picture(scene_of(particle=[shape]))) > 1000


def test_a_sweep_is_a_row_and_a_state_per_run(tmp_path: Path, write_run: WriteRun) -> None:
    file = write_sweep(scene_of(), {"smarticle.aspect_ratio": [0.4, 0.7], "seed": list(range(1, 9))}, tmp_path)
    folder = make_folder(file, tmp_path / "out", "test")
    many = smarticles.read_sweep(tmp_path / "out")
    cells = Cells(html_of(many))
    assert f"{tmp_path / 'out'}: 0 of 16 runs are done" in cells.texts
    assert cells.texts.count("missing") == 10  # rows of a long table are left out
    assert "img" not in cells.tags
    for entry in folder.entries[:2]:
        write_run(folder.run(entry), aspect_ratio=entry.values["aspect_ratio"], seed=entry.values["seed"])
    many = smarticles.read_sweep(tmp_path / "out")
    assert f"{tmp_path / 'out'}: 2 of 16 runs are done" in Cells(html_of(many)).texts
    assert picture(many).width > 1.5 * picture(many).height  # two piles side by side


def test_what_cannot_be_read_or_drawn_is_a_table_still(
    tmp_path: Path, write_run: WriteRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    missing = facts(smarticles.Run(tmp_path / "nothing"))
    assert list(missing) == ["problem"]
    assert "no such directory" in missing["problem"]
    run = smarticles.read(write_run(tmp_path / "run"))
    frame = run.frames[-1]
    monkeypatch.setitem(sys.modules, "pyvista", None)  # as without the extra "viz"
    for name in [name for name in sys.modules if name.startswith("postprocess.pictures")]:
        monkeypatch.delitem(sys.modules, name)
    for shown in (run, frame, scene_of()):
        assert picture_of(shown) is None
        assert facts(shown)
    (tmp_path / "run" / DONE).write_text("{}")
    assert "done.json" in facts(smarticles.Run(tmp_path / "run"))["problem"]


def test_the_first_name_that_is_used_brings_the_pictures() -> None:
    code = "import smarticles; smarticles.Scene; from dem.notebook import picture_of; print(len(picture_of.registry))"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True)
    assert int(said.stdout) == 4  # of object, and of scenes, runs and frames


# -- a cell that is run again ------------------------------------------------------------------------------------------


def test_a_cell_is_run_again(tmp_path: Path) -> None:
    out = tmp_path / "a"
    first = smarticles.run(scene_of(count=1), out, resume=True)
    assert first.status.state == "done"
    written = (out / DONE).stat().st_mtime_ns
    again = smarticles.run(scene_of(count=1), out, resume=True)
    assert again.status.state == "done"
    assert (out / DONE).stat().st_mtime_ns == written
    with pytest.raises(smarticles.InputError) as refused:
        smarticles.run(scene_of(count=1), out)
    assert str(refused.value) == (
        f"out {out}: holds a run and is left as it is; resume=True continues it, or returns it if it is done, or "
        "choose another directory"
    )
    with pytest.raises(smarticles.InputError) as refused:
        smarticles.run(scene_of(count=1, seed=2), out, resume=True)
    assert str(refused.value) == (
        f"out {out}: was made from another scene: seed 1 there, 2 here; run the changed scene in another directory"
    )


def test_a_sweep_is_one_cell_and_one_stream_in_a_notebook(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = make_folder(write_sweep(scene_of(), {"seed": [1, 2]}, tmp_path), tmp_path / "out", "test")
    monkeypatch.setattr(type(folder), "is_done", lambda *_: True)
    shown = Mock()
    monkeypatch.setattr("rich.console._is_jupyter", lambda: True)
    for module in ("IPython.display", "rich.jupyter"):
        monkeypatch.setattr(f"{module}.display", shown)
    compute(folder, jobs=1, command="again")
    said = capsys.readouterr()
    assert [line.lstrip("= ") for line in said.out.splitlines()] == ["seed1 finished before", "seed2 finished before"]
    assert said.err == ""  # which looks like a failure
    assert shown.call_count == 1  # the bars, which are updated in place
