"""Another run's smarticles taken over: how a scene names them, what is rejected, what the stage does to an engine."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
import yaml
from double import EngineDouble, KindDouble
from numpy.typing import NDArray
from scenes import SMALL, changed

from dem.engine.interface import Engine
from dem.errors import InputError, RunError
from dem.phases.take_over import STRIDE, TakeOver, _in_cross
from dem.record.frame import Frame
from dem.record.frames import read_frames
from dem.run.run import run_scene
from dem.run.simulation import Simulation
from dem.scene.reading import dump_scene, load_scene, parse_scene, scene_hash
from dem.scene.scene import Scene
from dem.setting.hooks import Cross

DT = 2e-4
RECORDING = {"series_interval_s": 0.004, "frame_interval_s": 0.02, "checkpoint_interval_s": 0.04}
RELAX = {"type": "relax", "duration_s": 0.1}
SHAKE = {"type": "shake", "duration_s": 0.1, "frequency_hz": 30, "peak_acceleration_g": 2}


@pytest.fixture(autouse=True)
def kind(monkeypatch: pytest.MonkeyPatch) -> KindDouble:
    """The engine of every scene is the double."""
    kind = KindDouble()
    monkeypatch.setattr("dem.engine.yade.kind.YadeKind", lambda: kind)
    return kind


@pytest.fixture(scope="module")
def poured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("take-over") / "pour"
    data = changed(SMALL, {"phases.1": RELAX, "phases.2": SHAKE, "recording": RECORDING})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("dem.engine.yade.kind.YadeKind", KindDouble)
        run_scene(parse_scene(data, source="pour"), out, command="test")
    return out


@pytest.fixture
def pour(poured: Path, tmp_path: Path) -> Path:
    """A run that is done: poured, rested, shaken."""
    return shutil.copytree(poured, tmp_path / "pour")


def data_of(run: Path | str, more: dict[str, Any] | None = None, **changes: Any) -> dict[str, Any]:
    """A scene that begins from a run; `more` keys of the first phase."""
    first = {"type": "take-over", "run": str(run), **(more or {})}
    return changed(SMALL, {"phases": [first, RELAX, SHAKE], "recording": RECORDING, **changes})


def scene_of(run: Path | str, more: dict[str, Any] | None = None, **changes: Any) -> Scene:
    return parse_scene(data_of(run, more, **changes), source="bad.yaml")


def rejected(run: Path | str, more: dict[str, Any] | None = None, **changes: Any) -> str:
    with pytest.raises(InputError) as caught:
        scene_of(run, more, **changes)
    line = str(caught.value)
    assert len(line.splitlines()) == 1
    assert line.startswith("bad.yaml: ")
    return line.removeprefix("bad.yaml: ")


def first(scene: Scene) -> TakeOver:
    phase = scene.phases[0]
    assert isinstance(phase, TakeOver)
    return phase


def above_floor(frame: Frame) -> NDArray[np.float64]:
    return frame.vertices - [0.0, 0.0, frame.floor_z]


def rewrite(run: Path, number: int, change: Callable[[meshio.Mesh], None]) -> None:
    path = read_frames(run).paths[number]
    mesh = meshio.vtu.read(str(path))
    change(mesh)
    mesh.write(path, file_format="vtu")


# -- what is taken -----------------------------------------------------------------------------------------------------


def shaken(pour: Path) -> int:
    """A frame in the middle of shaking, the container on its way."""
    frames = read_frames(pour)
    return max(range(len(frames)), key=lambda k: abs(frames[k].floor_z))


@pytest.mark.parametrize("which", ["last", "shaken"])
def test_a_run_begins_with_the_poses_of_the_frame_above_its_floor(
    kind: KindDouble, pour: Path, tmp_path: Path, which: str
) -> None:
    number = shaken(pour) if which == "shaken" else len(read_frames(pour)) - 1
    run_scene(
        scene_of(pour, {"frame": "last" if which == "last" else number}),
        tmp_path / "on",
        command="test",
    )
    source, taken = read_frames(pour)[number], read_frames(tmp_path / "on")[0]
    assert which == "last" or abs(source.floor_z) > 1e-4
    assert taken.floor_z == 0
    # In the double what stands stays where it is.
    np.testing.assert_allclose(taken.vertices, above_floor(source), atol=1e-12)
    assert kind.built[-1].calls.count(("add", 10)) == 1
    assert ("still",) not in kind.built[-1].calls


# -- how a scene is resolved -------------------------------------------------------------------------------------------


def test_the_hash_is_of_what_is_taken_and_not_of_where_it_lies(pour: Path, tmp_path: Path) -> None:
    shutil.copytree(pour, tmp_path / "copy")
    here, there = scene_of(pour), scene_of(tmp_path / "copy")
    assert first(here).frame == len(read_frames(pour)) - 1
    assert scene_hash(here) == scene_hash(there)
    assert scene_hash(here) != scene_hash(scene_of(pour, {"frame": shaken(pour)}))
    assert scene_hash(here) != scene_hash(parse_scene(changed(SMALL, {"recording": RECORDING}), source="x"))

    def move(mesh: meshio.Mesh) -> None:
        mesh.points[0, 0] += 1e-15

    rewrite(tmp_path / "copy", -1, move)
    assert scene_hash(here) != scene_hash(scene_of(tmp_path / "copy"))


def test_a_directory_is_seen_from_the_scene_s_file(pour: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "scenes").mkdir()
    file = tmp_path / "scenes" / "on.yaml"
    file.write_text(yaml.safe_dump(data_of("../pour")), encoding="utf-8")
    scene = load_scene(file)
    assert first(scene).run == str(pour)
    # Resolved, it is seen from wherever it is written to; both may be moved together.
    moved = tmp_path / "moved"
    (tmp_path / "runs" / "a").mkdir(parents=True)
    (tmp_path / "runs" / "a" / "scene.yaml").write_text(dump_scene(scene, tmp_path / "runs" / "a"), encoding="utf-8")
    moved.mkdir()
    for name in ("runs", "pour"):
        (tmp_path / name).rename(moved / name)
    again = load_scene(moved / "runs" / "a" / "scene.yaml")
    assert str(tmp_path) not in dump_scene(again, moved / "runs" / "a")
    assert first(again).run == str(moved / "pour")
    assert scene_hash(again) == scene_hash(scene)
    first(again).ready(again)
    # In Python it is seen from the working directory.
    monkeypatch.chdir(moved)
    assert first(Scene(**{key: value for key, value in data_of("pour").items() if key != "schema_version"})).run == str(
        moved / "pour"
    )


def test_a_run_is_resumed_from_its_checkpoint_without_its_source(
    pour: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = scene_of(pour)
    run_scene(scene, tmp_path / "straight", command="test")
    taken = Simulation._checkpoint

    def checkpoint(simulation: Simulation) -> None:
        taken(simulation)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(Simulation, "_checkpoint", checkpoint)
        with pytest.raises(KeyboardInterrupt):
            run_scene(scene, tmp_path / "stopped", command="test")
    pour.rename(tmp_path / "elsewhere")
    run_scene(scene, tmp_path / "stopped", command="test", resume=True)
    ends = [read_frames(tmp_path / name)[-1].vertices for name in ("straight", "stopped")]
    assert np.array_equal(*ends)


# -- what is rejected --------------------------------------------------------------------------------------------------


def test_runs_and_frames_that_are_not_there(pour: Path, tmp_path: Path) -> None:
    frames = read_frames(pour)
    assert rejected(tmp_path / "none").startswith("phases.0.run: cannot read run directory")
    (tmp_path / "sweep").mkdir()
    (tmp_path / "sweep" / "sweep.json").write_text("{}")
    assert "it is a sweep; give one of its runs" in rejected(tmp_path / "sweep")
    assert rejected(pour, {"frame": 99}) == (
        f"phases.0.frame: 99, but the frames of {pour} are 0 … {len(frames) - 1}; use one of them, or last"
    )
    for bad, stated in (("first", "'first'"), (-1, "-1"), (1.5, "1.5"), (True, "true"), (None, "null")):
        assert stated in (line := rejected(pour, {"frame": bad})), bad
        assert line.startswith("phases.0")
    assert rejected(pour, {"sha256": "abc"}).startswith("phases.0.sha256: 'abc' is no SHA-256 of 64 digits; leave it")
    assert rejected(pour, {"run": ""}).startswith("phases.0.run: ")


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"smarticle.aspect_ratio": 0.71}, "smarticle.aspect_ratio: 0.71 here, but 0.7 in"),
        ({"smarticle.thickness_in_plane_m": 6e-4}, "smarticle.thickness_in_plane_m: 0.0006 m here, but 0.0005 m in"),
        ({"count": 9}, "count: 9 here, but frame "),
        ({"smarticle.angles_deg": [90, 80]}, "smarticle.angles_deg: (90, 80) here, but the barbs of frame"),
        ({"container.radius_m": 0.012}, "container.radius_m: 0.012 m; "),
        ({"gravity_m_per_s2": 0}, "gravity_m_per_s2: 0 m/s²"),
        ({"phases.1": {"type": "take-over", "run": "."}}, "phases"),
    ],
)
def test_scenes_that_do_not_fit(pour: Path, changes: dict[str, Any], line: str) -> None:
    stated = rejected(pour, **changes)
    assert stated.startswith(line)
    assert "; " in stated


# -- the stage ---------------------------------------------------------------------------------------------------------


class Pushing(EngineDouble):
    """Smarticles that overlap so much that all fly apart, until they were stopped so many times."""

    stops = 0
    speed = 0.3  # m/s

    def advance(self, steps: int) -> None:
        super().advance(steps)
        if self.calls.count(("still",)) < self.stops:
            self.velocities[:, 0] = self.speed


def perform(scene: Scene, engine: Engine) -> dict[str, Any]:
    stage = scene.phases[0].begin(scene, 0)
    while wait := stage.proceed(engine):
        engine.advance(max(1, round(wait / engine.time_step)))
        memory, stage = json.loads(json.dumps(stage.memory)), scene.phases[0].begin(scene, 0)
        stage.memory = memory
    return stage.memory


@pytest.mark.parametrize("stops", [0, 1, 5])
def test_what_overlaps_is_stopped_until_it_flies_no_more(pour: Path, stops: int) -> None:
    scene = scene_of(pour)
    engine = Pushing.of(scene, DT)
    assert isinstance(engine, Pushing)
    engine.stops = stops
    memory = perform(scene, engine)
    assert engine.calls == [("add", 10), *[("still",)] * stops]
    # A difference of energies, exact to rounding of what was added.
    lost = stops * 0.5 * 10 * engine.particle.boxes.mass * 0.3**2
    assert engine.ledger.dissipated >= lost - 1e-12 * engine.ledger.added
    assert ("warning" in memory) == (stops > 0)
    if stops:
        assert f"smarticles were stopped {stops} times in {(1 + STRIDE * (stops + 1)) * DT:.3g} s" in memory["warning"]
    # Then it must be still for `hold_s`.
    assert engine.time > 0.05


def test_what_never_comes_apart_fails(pour: Path) -> None:
    scene = scene_of(pour, {"settle": {"timeout_s": 0.1}})
    engine = Pushing.of(scene, DT)
    assert isinstance(engine, Pushing)
    engine.stops = 10**6
    with pytest.raises(
        RunError, match=r"still push each other apart 0\.1 s after .* up to 0\.3 m/s .*; raise phases\.0"
    ):
        perform(scene, engine)
    assert engine.time < 0.11


def test_what_is_thrown_by_its_overlaps_fails_with_that_cause(pour: Path) -> None:
    scene = scene_of(pour)
    engine = Pushing.of(scene, DT)
    assert isinstance(engine, Pushing)
    engine.stops, engine.speed = 10**6, 1190.0
    with pytest.raises(RunError) as caught:
        perform(scene, engine)
    text = str(caught.value)
    assert "overlap so much where they were put in that contacts throw them apart, at up to 1.19e+03 m/s" in text
    assert text.endswith("; take over on the engine and at the fidelity of phases.0.run first, or pour on this engine")
    assert "height" not in text
    assert "stiffness" not in text
    assert engine.steps == 1 + STRIDE


def test_links_in_any_bar_of_a_hook_are_found() -> None:
    cross = Cross(height=0.01, side=1e-3, length=0.02, count=2)
    upright = np.zeros((1, 4, 3))
    upright[..., 2] = [0.005, 0.006, 0.014, 0.015]
    assert not _in_cross(cross, upright).any()  # between the bars
    for bar in cross.bars:
        assert _in_cross(cross, upright + np.array([*bar.middle, 0.0])).all()
