"""Whole runs on an engine in memory: what dem does is the same whichever engine computes."""

import json
import os
import shutil
import signal
import subprocess
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from double import EngineDouble, KindDouble
from scenes import CHAIN, SMALL, changed

from dem.engine.effect import EffectName
from dem.errors import InputError, RunError
from dem.plan.effects import decide
from dem.plan.outlook import plan
from dem.plan.steps import time_steps
from dem.record.document import Done
from dem.record.run import Run
from dem.record.vtkhdf import truncate
from dem.run.run import run_scene
from dem.run.simulation import Simulation
from dem.run.stop import StopRequest, StopRequestedError
from dem.scene.reading import load_scene, parse_scene, scene_hash
from dem.scene.scene import Scene
from smarticles.commands.compare import compare, compare_bits

SWING = {"type": "internal-oscillation", "theta_deg": 4, "duration_s": 0.05}
DEPOSIT, RELAX = {"type": "deposit", "per_layer": 5}, {"type": "relax", "duration_s": 0.1}
SHAKE, PULL = {"type": "shake", "duration_s": 0.05}, {"type": "pull-hook", "distance_m": 2e-3, "speed_m_per_s": 0.02}
REMOVE = {"type": "remove-container", "duration_s": 0.3, "speed_m_per_s": 0.1}
RECORDING = {"series_interval_s": 0.004, "frame_interval_s": 0.02, "checkpoint_interval_s": 0.04, "energy": True}
SCENES = {
    "rested": (SMALL, {"phases": [DEPOSIT, RELAX]}),
    "shaken": (SMALL, {"phases": [DEPOSIT, SHAKE, RELAX]}),
    "actuated": (SMALL, {"phases": [DEPOSIT, SWING, RELAX, SWING]}),
    "pulled and lifted": (SMALL, {"phases": [DEPOSIT, PULL, REMOVE, SHAKE], "hooks": {}}),
    "strained": (CHAIN, {"phases.1.speed_m_per_s": 0.1}),
}


def scene_of(name: str, **changes: Any) -> Scene:
    data, more = SCENES[name]
    recording = RECORDING | ({"series_interval_s": 1e-3} if data is CHAIN else {})
    return parse_scene(changed(data, {**more, "recording": recording, **changes}), source=name)


@pytest.fixture
def kind(monkeypatch: pytest.MonkeyPatch) -> KindDouble:
    """The engine of every scene is the double."""
    kind = KindDouble()
    monkeypatch.setattr("dem.engine.yade.kind.YadeKind", lambda: kind)
    return kind


def run(scene: Scene, out: Path, **how: Any) -> Done | None:
    return run_scene(scene, out, command="test", **how)


def series(out: Path) -> dict[str, bytes]:
    with h5py.File(out / "series.h5") as file:
        return {name: dataset[()].tobytes() for name, dataset in file.items()}


def frames(out: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in (out / "frames").iterdir()}


@pytest.fixture
def interrupted(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], None]:
    """Makes the next run stop as if the machine had failed, right after so many checkpoints."""

    def at(number: int) -> None:
        left = [number]
        taken = Simulation._checkpoint

        def checkpoint(simulation: Simulation) -> None:
            taken(simulation)
            left[0] -= 1
            if not left[0]:
                raise KeyboardInterrupt

        monkeypatch.setattr(Simulation, "_checkpoint", checkpoint)

    return at


@pytest.mark.parametrize("name", SCENES)
def test_a_run_writes_what_every_run_writes(kind: KindDouble, tmp_path: Path, name: str) -> None:
    scene, out = scene_of(name), tmp_path / "run"
    outcome = run(scene, out)
    assert outcome is not None
    (engine,) = kind.built
    assert (outcome.time_s, outcome.steps) == (engine.time, engine.steps)
    assert load_scene(out / "scene.yaml") == scene
    manifest, done = (json.loads((out / file).read_text()) for file in ("run.json", "done.json"))
    assert manifest["scene_sha256"] == scene_hash(scene)
    assert manifest["versions"]["double"] == "1"
    assert "yade" not in manifest["versions"]
    assert [phase["type"] for phase in done["phases"]] == [phase.kind for phase in scene.phases]
    for phase, entry, following in zip(scene.phases, done["phases"], [*done["phases"][1:], None], strict=True):
        if phase.known_duration is not None and phase.kind != "strain":  # which ends when the chain parts
            assert entry["end_s"] - entry["start_s"] == pytest.approx(phase.known_duration, abs=engine.time_step)
        assert entry["end_s"] == (done["time_s"] if following is None else following["start_s"])
    with h5py.File(out / "series.h5") as file:
        assert file["count"][-1] == scene.count
        assert abs(file["time_s"][-1] - outcome.time_s) <= scene.recording.series_interval_s
        assert {index for index, phase in enumerate(done["phases"]) if phase["end_s"] > phase["start_s"]} == set(
            file["phase"][1:].tolist()
        )
    assert len(frames(out)) > 3
    assert plan(scene).phases[0].time_step_s == time_steps(scene)[0] == manifest["phases"][0]["time_step_s"]


@pytest.mark.parametrize("name", SCENES)
def test_a_resumed_run_gives_the_same_bits(
    kind: KindDouble, interrupted: Callable[[int], None], tmp_path: Path, name: str
) -> None:
    scene = scene_of(name)
    run(scene, tmp_path / "straight")
    for _ in range(2):
        interrupted(1)
        with pytest.raises(KeyboardInterrupt):
            run(scene, tmp_path / "resumed", resume=(tmp_path / "resumed").exists())
    assert json.loads((tmp_path / "resumed" / "failed.json").read_text())["status"] == "interrupted"
    interrupted(10_000)
    run(scene, tmp_path / "resumed", resume=True)
    assert len(kind.built) == 4
    assert kind.built[-1].steps == kind.built[0].steps
    assert series(tmp_path / "straight") == series(tmp_path / "resumed")
    assert frames(tmp_path / "straight") == frames(tmp_path / "resumed")
    assert not (tmp_path / "resumed" / "failed.json").exists()


# Frames each 20 ms, samples each 4 ms: the first relax ends with a sample, between two frames.
ENDS = {
    "phases": [
        {"type": "deposit", "per_layer": 10},
        {"type": "shake", "duration_s": 0.009},
        {"type": "shake", "duration_s": 0.005},
        {"type": "relax", "duration_s": 0.0827},
        {"type": "relax", "duration_s": 0.01},
    ]
}


@pytest.mark.parametrize(("name", "files"), [*((name, "vtu") for name in SCENES), ("ends", "vtu"), ("ends", "vtkhdf")])
def test_each_phase_that_takes_time_ends_with_a_frame(
    kind: KindDouble, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, files: str
) -> None:
    monkeypatch.setitem(SCENES, "ends", (SMALL, ENDS))
    run(scene_of(name, **{"recording.frames": files}), tmp_path)
    made = Run(tmp_path)
    assert (np.diff(made.frames.times) > 0).all()
    for phase in made.phases:
        assert phase.start_s is not None
        part = made.frames.in_phase(phase.index)
        if phase.end_s == phase.start_s and phase.start_s > 0:
            assert not part
            continue
        assert part[-1].time == phase.end_s
        # All but the last are at the interval.
        steady, interval = made.at_intervals(part), 0.02
        assert len(part) - len(steady) in (0, 1)
        apart = np.abs(steady.times / interval - np.round(steady.times / interval)) * interval
        assert (apart <= phase.time_step_s / 2 + 1e-8).all() or len(part) == 1
        if len(steady) < len(part):
            assert abs(part.times[-1] / interval - round(part.times[-1] / interval)) * interval > phase.time_step_s / 2


@pytest.mark.parametrize("after", [-1, 0, 1])
def test_a_run_that_stops_beside_the_end_of_a_phase_writes_the_same_frames(
    kind: KindDouble, interrupted: Callable[[int], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, after: int
) -> None:
    """A checkpoint at each sample; the run stops at the one at the end of the first relax, and beside it."""
    monkeypatch.setitem(SCENES, "ends", (SMALL, ENDS))
    straight, resumed = tmp_path / "straight", tmp_path / "resumed"
    scene = scene_of("ends", **{"recording.checkpoint_interval_s": 0.004, "recording.contact_forces": True})
    run(scene, straight)
    end = Run(straight).phases[3].end_s or 0.0
    number = round(end / 0.004)
    assert abs(number * 0.004 - end) <= kind.built[0].time_step / 2
    assert number % 5, "the frame at the end is not at the interval of 20 ms"
    interrupted(number + after)
    with pytest.raises(KeyboardInterrupt):
        run(scene, resumed)
    assert 0 < len(Run(resumed).frames) < len(Run(straight).frames)
    interrupted(10_000)
    run(scene, resumed, resume=True)
    for folder in ("frames", "forces"):
        one, other = (
            {path.name: path.read_bytes() for path in [*(out / folder).iterdir(), out / f"{folder}.pvd"]}
            for out in (straight, resumed)
        )
        assert one == other


def test_a_finished_run_is_left_alone(kind: KindDouble, tmp_path: Path) -> None:
    scene = scene_of("rested")
    run(scene, tmp_path)
    assert run(scene, tmp_path, resume=True) is None
    assert len(kind.built) == 1


def test_another_scene_or_another_version_is_not_resumed(
    kind: KindDouble, interrupted: Callable[[int], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupted(2)
    with pytest.raises(KeyboardInterrupt):
        run(scene_of("rested"), tmp_path)
    with pytest.raises(InputError, match=r"was made from another scene: .* run the changed scene in another directory"):
        run(scene_of("rested", seed=2), tmp_path, resume=True)
    monkeypatch.setattr(kind, "name", "another")
    with pytest.raises(InputError, match="double 1"):
        run(scene_of("rested"), tmp_path, resume=True)
    # It can still be resumed with the version that made it.
    assert json.loads((tmp_path / "failed.json").read_text())["status"] == "interrupted"


def test_each_start_is_recorded_with_its_version_and_machine(
    kind: KindDouble, interrupted: Callable[[int], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, out = scene_of("rested"), tmp_path / "run"
    for number, (version, machine, threads) in enumerate(
        # The third start continues where the second one did, which left no checkpoint.
        [("0.2.0", "one", 1), ("0.3.0", "two", 1), ("0.4.0", "three", 2), ("0.4.0", "four", 2)]
    ):
        monkeypatch.setattr("dem.run.run.version", lambda _name, version=version: version)
        monkeypatch.setattr("platform.node", lambda machine=machine: machine)
        monkeypatch.setattr(kind, "threads", lambda threads=threads: threads)
        if number == 1:
            with monkeypatch.context() as killed:
                killed.setattr(Simulation, "run", interrupt)
                with pytest.raises(KeyboardInterrupt):
                    run(scene, out, resume=True)
        elif number < 3:
            interrupted(1)
            with pytest.raises(KeyboardInterrupt):
                run(scene, out, resume=number > 0)
        else:
            interrupted(10_000)
            run(scene, out, resume=True)
    manifest = Run(out).manifest
    found = [(one.versions["smarticles"], one.machine, one.threads) for one in manifest.starts]
    assert found == [("0.2.0", "one", 1), ("0.3.0", "two", 1), ("0.4.0", "three", 2), ("0.4.0", "four", 2)]
    assert [one.machine for one in manifest.makers] == ["one", "three", "four"]
    first, *later = [one.time_s for one in manifest.starts]
    assert first == 0.0 < later[0] == later[1] < later[2]
    assert manifest.versions["smarticles"] == "0.2.0"  # the first one, as older versions wrote
    assert manifest.made_by["smarticles"] == "0.2.0 (resumed by 0.4.0)"
    assert manifest.made_by["double"] == "1"
    assert manifest.made_on == {"machine": "one (resumed by three, four)", "threads": "1 (resumed by 2)"}
    lines = (out / "log.txt").read_text().splitlines()
    by = [line.split(" INFO ")[1] for line in lines if " by smarticles " in line]
    assert [line.split(",")[0] for line in by] == [
        *("started by smarticles 0.2.0", "resumed by smarticles 0.3.0"),
        *("resumed by smarticles 0.4.0", "resumed by smarticles 0.4.0"),
    ]
    assert "; on three, " in by[2]
    warned = [line.split("WARNING resumed with ")[1] for line in lines if "WARNING resumed with " in line]
    assert [line.split(";")[0] for line in warned] == [
        "smarticles 0.3.0 instead of 0.2.0",
        "smarticles 0.4.0 instead of 0.2.0, --threads 2 instead of 1",
    ]
    # `compare` shows it beside a run of one version.
    interrupted(10_000)
    run(scene, tmp_path / "straight")
    versions = compare(out, tmp_path / "straight")["versions"]
    assert versions["smarticles"] == ("0.2.0 (resumed by 0.4.0)", "0.4.0")
    assert versions["machine"] == ("one (resumed by three, four)", "four")


def interrupt(_simulation: Simulation) -> None:
    raise KeyboardInterrupt


def test_a_run_that_another_version_began_anew_is_its_own(
    kind: KindDouble, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dem.run.run.version", lambda _name: "0.2.0")
    with monkeypatch.context() as killed:
        killed.setattr(Simulation, "run", interrupt)
        with pytest.raises(KeyboardInterrupt):
            run(scene_of("rested"), tmp_path)
    monkeypatch.setattr("dem.run.run.version", lambda _name: "0.3.0")
    run(scene_of("rested"), tmp_path, resume=True)
    assert Run(tmp_path).manifest.made_by["smarticles"] == "0.3.0"
    assert "resumed with" not in (tmp_path / "log.txt").read_text()


def test_a_run_asked_to_stop_does_so_at_its_next_checkpoint(
    kind: KindDouble, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, step = scene_of("rested"), EngineDouble._step

    def signalled(engine: EngineDouble) -> None:
        step(engine)
        if engine.steps == 150:
            os.kill(os.getpid(), signal.SIGUSR1)

    monkeypatch.setattr(EngineDouble, "_step", signalled)
    before = signal.getsignal(signal.SIGUSR1)
    with pytest.raises(StopRequestedError, match=r"stopped as requested at the checkpoint of t = 0\.0[48]"):
        run(scene, tmp_path)
    assert signal.getsignal(signal.SIGUSR1) is before
    failed = json.loads((tmp_path / "failed.json").read_text())
    assert failed["status"] == "interrupted"
    assert failed["checkpoint_s"] == failed["time_s"]


def test_a_run_asked_to_stop_before_its_first_step_can_be_continued(
    kind: KindDouble, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, build = scene_of("rested"), kind.build

    def signalled(scene: Scene, time_step: float) -> EngineDouble:
        os.kill(os.getpid(), signal.SIGUSR1)
        return build(scene, time_step)

    before, stop = signal.getsignal(signal.SIGUSR1), StopRequest()
    with monkeypatch.context() as patch, stop.listening():
        patch.setattr(kind, "build", signalled)
        with pytest.raises(StopRequestedError, match=r"stopped as requested before it went on from t = 0\.0000 s"):
            run(scene, tmp_path / "run", stop=stop)
    assert signal.getsignal(signal.SIGUSR1) is before
    assert json.loads((tmp_path / "run/failed.json").read_text())["status"] == "interrupted"
    run(scene, tmp_path / "run", resume=True)
    run(scene, tmp_path / "straight")
    assert series(tmp_path / "run") == series(tmp_path / "straight")


def test_an_engine_that_stops_fails_the_run_and_keeps_what_was_recorded(
    kind: KindDouble, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    build = kind.build

    def frail(scene: Scene, time_step: float) -> EngineDouble:
        engine = build(scene, time_step)
        engine.stops_at = 500
        return engine

    monkeypatch.setattr(kind, "build", frail)
    with pytest.raises(RunError, match=r"the double stopped at step 500 of \d+ \(last good checkpoint: t = 0\.\d+ s"):
        run(scene_of("shaken"), tmp_path)
    failed = json.loads((tmp_path / "failed.json").read_text())
    assert failed["status"] == "failed"
    assert failed["time_s"] == pytest.approx(kind.built[0].time)
    assert 0 < failed["time_s"] - failed["checkpoint_s"] <= RECORDING["checkpoint_interval_s"]
    assert not (tmp_path / "done.json").exists()
    with h5py.File(tmp_path / "series.h5") as file:
        assert failed["time_s"] - file["time_s"][-1] <= 0.004


# -- files that are lost while the run writes them ----------------------------------------------------------------


def replaced(out: Path) -> None:
    shutil.move(out, out.with_name("moved"))
    shutil.copytree(out.with_name("moved"), out)


LOSSES: dict[str, tuple[Callable[[Path], object], str]] = {
    "directory deleted": (shutil.rmtree, "was deleted, moved or replaced|its folder is gone"),
    **dict.fromkeys(
        ("directory moved", "directory moved with one file"),
        (lambda out: out.rename(out.with_name("moved")), "if it was moved, .*: smarticles resume DIR"),
    ),
    "directory replaced": (replaced, "was deleted, moved or replaced"),
    "lock": (lambda out: (out / ".lock").unlink(), "was deleted, moved or replaced"),
    "manifest": (lambda out: (out / "run.json").unlink(), r"run\.json: is gone, and without it the run cannot be read"),
    "frames": (lambda out: shutil.rmtree(out / "frames"), r"frame_000000\.vtu: is gone; put it back"),
    "one file": (lambda out: (out / "frames.vtkhdf").unlink(), r"frames\.vtkhdf: is gone; put it back"),
    "one frame": (lambda out: (out / "frames/frame_000001.vtu").unlink(), r"frame_000001\.vtu: is gone; put it back"),
}


@pytest.mark.parametrize("name", LOSSES)
@pytest.mark.parametrize("step", [100, -1])
def test_a_run_that_loses_its_files_fails_and_leaves_others_alone(
    kind: KindDouble, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, step: int
) -> None:
    more = ONE_FILE if name.endswith("one file") else {}
    scene, out, advance = scene_of("rested", **more), tmp_path / "run", EngineDouble._step
    last = (run(scene, tmp_path / "whole") or Done(time_s=0, steps=0, wall_s=0, phases=())).steps
    lose, stated = LOSSES[name]

    def losing(engine: EngineDouble) -> None:
        advance(engine)
        if engine.steps == (step if step > 0 else last):
            lose(out)

    monkeypatch.setattr(EngineDouble, "_step", losing)
    with pytest.raises(RunError, match=stated):
        run(scene, out)
    assert not (out / "done.json").exists()
    own = name in ("manifest", "frames", "one file", "one frame")
    assert (out / "failed.json").exists() == own


# -- frames in one file ------------------------------------------------------------------------------------------------

ONE_FILE = {"recording.frames": "vtkhdf"}


@pytest.mark.parametrize("name", ["rested", "shaken"])
def test_frames_in_one_file_are_those_in_many_also_after_a_stop(
    kind: KindDouble, interrupted: Callable[[int], None], tmp_path: Path, name: str
) -> None:
    many, one, resumed = (tmp_path / place for place in ("many", "one", "resumed"))
    run(scene_of(name), many)
    run(scene_of(name, **ONE_FILE), one)
    interrupted(2)
    with pytest.raises(KeyboardInterrupt):
        run(scene_of(name, **ONE_FILE), resumed)
    assert 0 < len(Run(resumed).frames) < len(Run(one).frames)
    run(scene_of(name, **ONE_FILE), resumed, resume=True)
    for other in (one, resumed):
        assert [path.name for path in other.glob("frames*")] == ["frames.vtkhdf"]
        bits = compare_bits(Run(many), Run(other))
        assert bits["identical"], bits
        assert bits["frames"] == bits["compared"] > 3
    with h5py.File(one / "frames.vtkhdf", "r+") as file:
        file["VTKHDF/Points"][-1, 2] += 1e-12
    assert compare_bits(Run(many), Run(one))["frames"] == bits["frames"] - 1
    files = [
        {entry.name: entry for entry in decide(scene_of(name, **more))}[EffectName.FRAMES].adds.files
        for more in ({}, ONE_FILE)
    ]
    assert files == [("frames.pvd", "frames"), ("frames.vtkhdf",)]
    assert scene_hash(scene_of(name)) == scene_hash(scene_of(name, **{"recording.frames": "vtu"}))


def test_a_run_whose_frames_are_damaged_is_not_continued_and_not_changed(
    kind: KindDouble, interrupted: Callable[[int], None], tmp_path: Path
) -> None:
    scene, file = scene_of("rested", **ONE_FILE), tmp_path / "frames.vtkhdf"
    interrupted(2)
    with pytest.raises(KeyboardInterrupt):
        run(scene, tmp_path)
    whole = file.read_bytes()
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir() if path != file}
    shorter = tmp_path.with_name("shorter.vtkhdf")
    shorter.write_bytes(whole)
    truncate(shorter, 1)
    for damaged in (whole[:-200], whole[:2000] + b"x" * 500 + whole[2500:], shorter.read_bytes(), None):
        file.unlink()
        if damaged is not None:
            file.write_bytes(damaged)
        with pytest.raises(InputError, match=r"cannot read frames .*frames\.vtkhdf: .*; put the file back, or run"):
            run(scene, tmp_path, resume=True)
        assert {path.name: path.read_bytes() for path in tmp_path.iterdir() if path != file} == before
        file.write_bytes(whole)
    run(scene, tmp_path, resume=True)
    assert (tmp_path / "done.json").exists()


@pytest.mark.parametrize("recording", [{}, ONE_FILE])
@pytest.mark.parametrize(
    "forge",
    [
        lambda state: state.pop("recorder"),
        lambda state: state["recorder"].update(frames=1),
        lambda state: state["performed"][-1].update(cpu_s="x"),
        lambda state: state["performed"].clear(),
        lambda state: state.update(wall_s=[]),
    ],
)
def test_a_forged_checkpoint_is_rejected_in_one_line(
    kind: KindDouble,
    interrupted: Callable[[int], None],
    tmp_path: Path,
    recording: dict[str, str],
    forge: Callable[[Any], None],
) -> None:
    scene, file = scene_of("rested", **recording), tmp_path / "checkpoint.zip"
    interrupted(1)
    with pytest.raises(KeyboardInterrupt):
        run(scene, tmp_path)
    with zipfile.ZipFile(file) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    state = json.loads(parts["state.json"])
    forge(state)
    with zipfile.ZipFile(file, "w") as archive:
        for name, part in {**parts, "state.json": json.dumps(state)}.items():
            archive.writestr(name, part)
    with pytest.raises(InputError, match=r"its checkpoint has other content than the run needs .*; start anew"):
        run(scene, tmp_path, resume=True)


# -- directories that are not a run's ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("held", "what"),
    [
        ({"run.json": "{}", "frames.pvd": "x"}, "a run and is left as it is; go on with it by --resume, or choose"),
        ({"notes.txt": "mine"}, "files (notes.txt, …) and is left as it is; choose"),
    ],
)
def test_a_directory_that_holds_something_is_left_as_it_is(
    kind: KindDouble, tmp_path: Path, held: dict[str, str], what: str
) -> None:
    for name, text in held.items():
        (tmp_path / name).write_text(text)
    before = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    with pytest.raises(InputError) as caught:
        run(scene_of("rested"), tmp_path)
    assert str(caught.value) == f"--out {tmp_path}: holds {what} another directory"
    if "run.json" not in held:
        # What is not a run's is left alone with --resume as well, and nothing is advised that would be refused.
        with pytest.raises(InputError) as caught:
            run(scene_of("rested"), tmp_path, resume=True)
        stated = "no run to resume but files (notes.txt, …) and is left as it is; choose another directory"
        assert str(caught.value) == f"--out {tmp_path}: holds {stated}"
    assert {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()} == before
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == held
    assert not kind.built


def test_a_read_only_disk_is_rejected_before_anything_runs(kind: KindDouble, mount_disk: Callable[[str], Path]) -> None:
    folder = mount_disk("64m")
    run(scene_of("rested"), folder / "run")
    (folder / "run" / "done.json").unlink()
    subprocess.run(["mount", "-o", "remount,ro", str(folder)], check=True)
    with pytest.raises(InputError, match=r"cannot be made \(Read-only file system\); choose another directory"):
        run(scene_of("rested"), folder / "new")
    with pytest.raises(InputError, match=r"cannot be written \(Read-only file system\); choose another directory"):
        run(scene_of("rested"), folder / "run", resume=True)
    assert len(kind.built) == 1
