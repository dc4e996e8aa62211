"""`import smarticles`: what it offers, and that nothing is loaded before it is used."""

import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from command_cases import WriteRun

import smarticles
from dem.errors import InputError
from dem.record.frame import Frame
from dem.setting.fidelity import fidelities
from postprocess.measures import registry
from smarticles.public import write_sweep
from smarticles.sweeps import make_folder
from templates.sweep.expand import expand
from templates.sweep.sweep_file import load_sweep

HEAVY = set("dem h5py numpy pandas postprocess pydantic pyvista rich templates vtkmodules yade".split())


def loaded_by(code: str) -> set[str]:
    """Top-level packages that a fresh process has loaded after some code."""
    script = f"{code}; import sys; print(*{{name.partition('.')[0] for name in sys.modules}})"
    answer = subprocess.run([sys.executable, "-c", script], capture_output=True, check=True, text=True)
    return set(answer.stdout.split())


def test_importing_it_loads_nothing() -> None:
    loaded = loaded_by("import smarticles")
    assert "smarticles" in loaded
    assert not loaded & HEAVY


def test_every_name_is_there() -> None:
    assert set(smarticles.__all__) == set(dir(smarticles))
    assert all(getattr(smarticles, name) is not None for name in smarticles.__all__)
    assert smarticles.measures.packing_fraction.__module__ == "postprocess.measures.packing"


@pytest.mark.parametrize(
    "code",
    ["import smarticles.measures as m", "from smarticles import measures as m", "import smarticles.measures; "
     "m = smarticles.measures"],
)  # fmt: skip
def test_measures_is_a_module(code: str) -> None:
    check = "import postprocess; assert all(getattr(m, n) is getattr(postprocess, n) for n in postprocess.__all__)"
    assert "postprocess" in loaded_by(f"{code}; {check}")


def test_a_table_of_a_run_has_a_row_per_phase_or_frame(write_run: WriteRun, tmp_path: Path) -> None:
    found = smarticles.read(write_run(tmp_path / "run"))
    assert smarticles.measure(found)["phase type"].tolist() == ["deposit", "relax", "shake", "relax"]
    assert len(smarticles.measure(found, frames=True)) == len(found.frames) == 16


# -- sweeps ------------------------------------------------------------------------------------------------------------


def scene_of(**changes: object) -> smarticles.Scene:
    return smarticles.Scene(seed=1, count=5, phases=[{"type": "deposit"}], **changes)


@pytest.fixture
def swept(tmp_path: Path, write_run: WriteRun) -> smarticles.SweepDirectory:
    """Two aspect ratios, two seeds each; φ in the shaken phase 0.12 and 0.14, 0.2 and 0.3."""
    file = write_sweep(scene_of(), {"smarticle.aspect_ratio": [0.4, 0.7], "seed": [1, 2]}, tmp_path)
    folder = make_folder(file, tmp_path / "out", "test")
    packing = dict(zip((entry.name for entry in folder.entries), (0.12, 0.14, 0.2, 0.3), strict=True))
    for entry in folder.entries:
        known = {"aspect_ratio": entry.values["aspect_ratio"], "seed": entry.values["seed"], "frames_per_phase": 1}
        write_run(folder.run(entry), packing=(0.1, 0.1, packing[entry.name], 0.1), **known)
    return smarticles.read_sweep(tmp_path / "out")


def test_a_sweep_is_its_runs_in_order(swept: smarticles.SweepDirectory) -> None:
    assert swept.values.to_dict("list") == {"aspect_ratio": [0.4, 0.4, 0.7, 0.7], "seed": [1, 2, 1, 2]}
    assert [run.manifest.seed for run in swept] == [1, 2, 1, 2]
    assert [run.path.name for run in swept[2:]] == ["aspect_ratio0.7_seed1", "aspect_ratio0.7_seed2"]


def test_a_table_of_a_sweep_has_what_it_varies(swept: smarticles.SweepDirectory) -> None:
    table = swept.table()
    assert list(table.columns[:3]) == ["run", "aspect_ratio", "seed"]
    assert list(table.columns).count("seed") == 1
    assert table["aspect_ratio"].tolist() == [0.4] * 8 + [0.7] * 8


def test_a_sweep_is_measured_like_its_directory(swept: smarticles.SweepDirectory) -> None:
    assert smarticles.measure(swept).equals(smarticles.measure(swept.path))
    assert smarticles.read(swept[0]).path == swept[0].path


@pytest.mark.parametrize("given", [None, 3, [], {"seed": 1}])
def test_what_is_no_directory_is_rejected(given: Any) -> None:
    scene = scene_of(engine="links")
    takers: list[Callable[[], object]] = [
        lambda: smarticles.read(given),
        lambda: smarticles.read_sweep(given),
        lambda: smarticles.measure(given),
        lambda: smarticles.plot(given),
        lambda: smarticles.plot(given, "com_height_m"),
        lambda: smarticles.run(scene, given),
        lambda: smarticles.sweep(scene, given, vary={"seed": [1]}),
    ]
    for take in takers:
        with pytest.raises(smarticles.InputError, match=r"^(directory|run|out): .* is no directory; give its path"):
            take()


def test_a_sweep_is_shown_in_one_line(swept: smarticles.SweepDirectory) -> None:
    shown = f"{swept.path!s}', 4 runs, aspect_ratio: 0.4, 0.7; seed: 1, 2>"
    assert str(swept) == repr(swept) == f"<SweepDirectory '{shown}"


def test_a_table_has_measures_on_request(swept: smarticles.SweepDirectory) -> None:
    column = "average crossing number mean [-]"
    assert column not in swept.table()
    assert swept.table(also=["crossing-number"])[column].notna().any()
    assert swept.table(by="seed", also=["crossing-number"])[column].notna().any()


NO_MEASURES: list[tuple[dict[str, object], str]] = [
    ({"measures": ["phi"]}, "measures: 'phi' is text; give functions of a frame and its run"),
    ({"measures": "phi"}, "measures: 'phi' is text; "),
    ({"measures": min}, "measures: <built-in function min> is no list; write it in brackets"),
    ({"measures": [3]}, "measures: 3 is no function with a name; write one"),
    ({"also": "caging"}, r"also: 'caging' is one name; give a list, \['caging'\]"),
    ({"also": ["cagin"]}, "also: there is no measure 'cagin' to add; did you mean 'caging'"),
]


@pytest.mark.parametrize(("keys", "message"), NO_MEASURES)
def test_what_is_no_measure_is_rejected(
    swept: smarticles.SweepDirectory, keys: dict[str, object], message: str
) -> None:
    for table in (swept.table, lambda **more: smarticles.measure(swept[0], **more)):
        with pytest.raises(smarticles.InputError, match=f"^{message}"):
            table(**keys)


def test_groups_have_means_and_standard_errors_over_runs(swept: smarticles.SweepDirectory) -> None:
    means = swept.table(by="aspect_ratio")
    shaken = means[means["phase type"] == "shake"].set_index("aspect_ratio")
    phi, error = "phi second-highest-com [-]", "phi second-highest-com SE [-]"
    # Frames of a made-up run have 1.002 times their φ; the error of two values is half their difference.
    assert shaken[phi].tolist() == pytest.approx([0.13 * 1.002, 0.25 * 1.002], rel=1e-9)
    assert shaken[error].tolist() == pytest.approx([0.01 * 1.002, 0.05 * 1.002], rel=1e-9)
    assert shaken["runs [-]"].tolist() == [2, 2]
    assert shaken["state"].tolist() == ["2 of 2 finished"] * 2


def test_groups_leave_out_unfinished_runs(swept: smarticles.SweepDirectory) -> None:
    (swept[1].path / "done.json").unlink()
    phi = "phi second-highest-com [-]"
    for unfinished, mean, runs in ((False, 0.12, 1), (True, 0.13, 2)):
        means = swept.table(by="aspect_ratio", unfinished=unfinished)
        first = means[means["phase type"] == "shake"].iloc[0]
        assert (first[phi], first["runs [-]"]) == (pytest.approx(mean * 1.002), runs)
        assert first["state"] == "1 of 2 finished"
    assert swept.table()["state"].tolist() == ["done"] * 4 + ["stopped"] * 4 + ["done"] * 8
    with pytest.raises(smarticles.InputError, match="unfinished: is for means over runs; give by"):
        swept.table(unfinished=True)


def test_what_follows_from_a_scene_follows_anew_where_it_varies(tmp_path: Path) -> None:
    file = write_sweep(scene_of(fidelity="draft"), {"engine": ["yade", "links"]}, tmp_path)
    scenes = [point.scene for point in expand(load_sweep(file))]
    assert [scene.engine for scene in scenes] == ["yade", "links"]
    for scene in scenes:
        named = fidelities(scene.engine)["draft"]
        assert named.items() <= scene.fidelity.model_dump().items()
    assert fidelities("yade")["draft"] != fidelities("links")["draft"]


def test_rows_and_stiffness_follow_what_varies(tmp_path: Path) -> None:
    thrown = {"type": "deposit", "thrown_at_m_per_s": 3.0}
    scene = smarticles.Scene(seed=1, count=5, engine="links", fidelity="standard", phases=[thrown])
    assert scene.fidelity.stiffness_N_per_m > scene.named_knobs["stiffness_N_per_m"] == 1000.0
    file = write_sweep(scene, {"phases.0.thrown_at_m_per_s": [0.0, 3.0]}, tmp_path)
    gentle, hard = (point.scene.fidelity for point in expand(load_sweep(file)))
    assert (gentle.stiffness_N_per_m, hard) == (1000.0, scene.fidelity)
    narrow = scene_of(engine="links", fidelity="standard", smarticle={"thickness_normal_m": 5e-4})
    file = write_sweep(narrow, {"smarticle.thickness_normal_m": [5e-4, 1.27e-3]}, tmp_path)
    assert [point.scene.fidelity.rows for point in expand(load_sweep(file))] == [1, 2]


def test_knobs_of_a_scene_are_kept_in_its_sweep(tmp_path: Path) -> None:
    scene = scene_of(
        engine="links", fidelity={"base": "standard", "rows": 2, "diameter_m": 4e-4, "stiffness_N_per_m": 3000.0}
    )
    for point in expand(load_sweep(write_sweep(scene, {"count": [4, 5]}, tmp_path))):
        assert point.scene.fidelity == scene.fidelity


def test_a_scene_that_a_template_would_run_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"contains '\{\{', which is template syntax"):
        write_sweep(scene_of(name="{{ 7 * 7 }}"), {"count": [1, 2]}, tmp_path)


def test_a_preset_is_found_beside_the_scene_file(tmp_path: Path) -> None:
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "contact.yaml").write_text("friction_wall: 0.25\n")
    scene = tmp_path / "own" / "scene.yaml"
    scene.write_text(
        "schema_version: 1\nseed: 1\ncount: 5\ncontact: {preset: contact.yaml}\nphases: [{type: deposit}]\n"
    )
    points = expand(load_sweep(write_sweep(scene, {"count": [4, 5]}, tmp_path)))
    assert [point.scene.contact.friction_wall for point in points] == [0.25, 0.25]


def test_keys_that_end_alike_keep_all_their_words(tmp_path: Path) -> None:
    waits = [{"type": "deposit"}, {"type": "relax"}, {"type": "relax"}]
    scene = smarticles.Scene(seed=1, count=5, phases=waits)
    vary = {"phases.1.duration_s": [0.1, 0.2], "phases.2.duration_s": [0.3], "contact.restitution": [0.5]}
    points = expand(load_sweep(write_sweep(scene, vary, tmp_path)))
    assert [*points[0].values] == ["phases_1_duration_s", "phases_2_duration_s", "restitution"]
    assert [[phase.duration_s for phase in point.scene.phases[1:]] for point in points] == [[0.1, 0.3], [0.2, 0.3]]
    assert points[0].scene.contact.restitution == 0.5


# -- words of Python ---------------------------------------------------------------------------------------------------


def test_a_wrong_scene_is_an_input_error_in_one_line() -> None:
    with pytest.raises(smarticles.InputError) as raised:
        smarticles.Scene(seed=-1, count=5, phases=[{"type": "deposit"}], contact={"friction": 0.4})
    assert "\n" not in str(raised.value)
    assert "seed: -1 is out of range; use at least 0" in str(raised.value)
    assert "contact: unknown key 'friction'" in str(raised.value)


@pytest.mark.parametrize(("vary", "message"), [
    ({"contact.frctn": [1]}, "vary: run frctn1: contact: unknown key 'frctn'"),
    ({"phases.7.duration_s": [1]}, "scene: phases.7.duration_s: there is no '7' in the scene"),
    ({"seed": [1, 1]}, "vary: repeats.seeds: a seed is given twice"),
    ({1: [2]}, "vary: 1 is no text; give a key of the scene, e.g. 'seed'"),
])  # fmt: skip
def test_errors_of_a_sweep_name_arguments_and_no_temporary_file(
    tmp_path: Path, vary: dict[Any, list[int]], message: str
) -> None:
    with pytest.raises(smarticles.InputError) as raised:
        smarticles.sweep(scene_of(), tmp_path / "out", vary=vary)
    assert str(raised.value).startswith(message)


def test_a_run_takes_the_keys_of_a_scene(tmp_path: Path) -> None:
    keys = {"seed": 1, "count": 1, "fidelity": "draft", "phases": [{"type": "deposit"}]}
    done = smarticles.run(keys, tmp_path / "a")
    assert smarticles.load_scene(done.path / "scene.yaml") == smarticles.Scene(**keys)
    with pytest.raises(smarticles.InputError, match=r"count: 0 is out of range; use at least 1"):
        smarticles.run({**keys, "count": 0}, tmp_path / "b")
    with pytest.raises(smarticles.InputError, match=r"scene: 5 is none; give a Scene, its keys as a mapping"):
        smarticles.run(5, tmp_path / "b")
    with pytest.raises(smarticles.InputError, match=r"vary: is missing; give the keys of the scene that change"):
        smarticles.sweep(keys, tmp_path / "b")
    with pytest.raises(smarticles.InputError, match=r"vary: run count0: count: 0 is out of range"):
        smarticles.sweep(keys, tmp_path / "b", zip={"count": [0]})
    assert not (tmp_path / "b").exists()


@pytest.mark.parametrize("progress", [True, False])
def test_a_sweep_shows_its_progress_unless_it_is_turned_off(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], progress: bool
) -> None:
    keys = {"seed": 1, "count": 1, "fidelity": "draft", "phases": [{"type": "deposit"}]}
    assert len(smarticles.sweep(keys, tmp_path / "a", vary={"count": [1]}, progress=progress)) == 1
    assert ("count1" in "".join(capfd.readouterr())) == progress


def test_warnings_of_a_run_are_warnings_of_python(tmp_path: Path) -> None:
    scene = scene_of(fidelity="draft", smarticle={"angles_deg": [90, 1.57]})
    with pytest.warns(UserWarning, match=r"^smarticle\.angles_deg: 1\.57 means 1\.57°, .* write 90$"):
        smarticles.run(scene, tmp_path / "a")


def test_a_run_that_is_killed_is_an_error_that_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    script = "import os; os.write(2, b'smarticles: warning: odd\\nat 30 \\xb0\\n'); os.kill(os.getpid(), 9)"
    monkeypatch.setattr("smarticles.public.smarticles_command", lambda *_: [sys.executable, "-c", script])
    with pytest.raises(smarticles.RunError, match=r"^killed by SIGKILL \(out of memory\?\): at 30 "):
        smarticles.run(tmp_path / "scene.yaml", tmp_path / "out", progress=False)


def test_errors_of_a_run_name_arguments(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").touch()
    with pytest.raises(smarticles.InputError) as raised:
        smarticles.run(scene_of(engine="links"), tmp_path, resume=True)
    assert (
        str(raised.value)
        == f"out {tmp_path}: holds files (notes.txt, …) and is left as it is; choose another directory"
    )


def test_the_recorded_command_names_a_scene_that_exists(tmp_path: Path) -> None:
    scene = smarticles.Scene(seed=1, count=1, engine="links", fidelity="draft", phases=[{"type": "deposit"}])
    done = smarticles.run(scene, tmp_path / "a")
    words = done.manifest.command.split()
    assert words[:2] + words[3:] == ["smarticles", "run", "--out", "NEW"]
    assert Path(words[2]) == tmp_path / "a" / "scene.yaml"
    assert smarticles.load_scene(words[2]) == scene


def test_measures_of_ones_own_are_columns(swept: smarticles.SweepDirectory) -> None:
    def top_m(frame: Frame, run: smarticles.Run) -> float:
        return float(frame.vertices[..., 2].max())

    last = swept[0].frames[-1]
    table = smarticles.measure(swept[0], measures=[top_m])
    assert table["top [m]"].iloc[-1] == pytest.approx(last.vertices[..., 2].max())
    means = swept.table(by="aspect_ratio", measures=[top_m])
    assert means["top [m]"].notna().all()
    assert "top [m]" not in swept.table()


def test_measures_of_installed_packages_are_columns(
    tmp_path: Path, write_run: WriteRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lowest_m(frame: Frame, run: smarticles.Run) -> float:
        return float(frame.vertices[..., 2].min())

    class Point:
        value = "elsewhere:MEASURES"

        def load(self) -> object:
            return (registry.measure_of(lowest_m),)

    monkeypatch.setattr(registry, "entry_points", lambda group: [Point()] if group == "smarticles.measures" else [])
    monkeypatch.setattr("smarticles.kept_tables._program", lambda: "another program")
    monkeypatch.setattr(registry, "registered", registry.registered.__wrapped__)
    found = smarticles.read(write_run(tmp_path / "run", frames_per_phase=1))
    assert smarticles.measure(found)["lowest [m]"].iloc[-1] == pytest.approx(found.frames[-1].vertices[..., 2].min())
    monkeypatch.setattr(Point, "load", lambda _: 1 / 0)
    with pytest.raises(smarticles.InputError, match="the measures of elsewhere:MEASURES cannot be loaded"):
        registry.registered()


def test_a_series_is_a_mapping(tmp_path: Path, write_run: WriteRun) -> None:
    series = smarticles.read(write_run(tmp_path / "run")).series
    assert isinstance(series, Mapping)
    assert list(series) == list(series.keys()) == list(series.data)
    assert [id(array) for array in series.values()] == [id(array) for array in series.data.values()]
    assert "time_s" in series
    assert "nothing" not in series
    assert series.get("nothing") is None
    with pytest.raises(smarticles.InputError, match="holds no series 'nothing'"):
        series["nothing"]


def test_a_plot_is_a_picture_that_a_notebook_shows(tmp_path: Path, write_run: WriteRun) -> None:
    image = smarticles.plot(write_run(tmp_path / "run"))
    assert image.size == (1200, 1200)
    assert image._repr_png_().startswith(b"\x89PNG")
    assert len(image.convert("L").getcolors()) > 10
