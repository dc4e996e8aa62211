"""What is due at a sample: rows, frames, spheres, and checks of the watchdog; from an engine in memory."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from double import EngineDouble
from scenes import small
from scipy.spatial.transform import Rotation

from dem.body.placement import Poses
from dem.errors import RunError
from dem.physics.overlaps import Extremes
from dem.record.forces import read_forces
from dem.record.frames import read_frames
from dem.record.progress import ProgressWriter
from dem.run.build import build_recorder
from dem.run.recorder import WATCH_STEPS, Recorder
from dem.scene.scene import Scene

RECORDING = {"series_interval_s": 0.004, "frame_interval_s": 0.012, "sphere_interval_s": 0.02}
DT = 3e-4


def start(out: Path, heights: Sequence[float] = (0.02, 0.03), **changes: Any) -> tuple[Scene, EngineDouble, Recorder]:
    scene = small({"recording": RECORDING | {"checkpoint_interval_s": None}, **changes})
    engine = EngineDouble.of(scene, DT)
    positions = np.array([[0.0, 0.0, height] for height in heights]).reshape(-1, 3)
    engine.add(Poses(positions, (Rotation.identity(),) * len(heights)))
    return scene, engine, build_recorder(scene, out, ProgressWriter(out, scene.count))


def take(engine: EngineDouble, recorder: Recorder, samples: int) -> None:
    for _ in range(samples):
        engine.advance(recorder.next_step - engine.steps)
        recorder.record(engine, 0)


def files(out: Path) -> dict[str, list[str]]:
    return {name: sorted(path.name for path in (out / name).iterdir()) for name in ("frames", "spheres")}


def test_samples_are_taken_at_the_steps_nearest_to_their_times(tmp_path: Path) -> None:
    _, engine, recorder = start(tmp_path)
    recorder.record(engine, 0)
    steps = []
    for sample in range(1, 30):
        steps.append(recorder.next_step)
        take(engine, recorder, 1)
        assert abs(engine.time - sample * 0.004) <= DT / 2 + 1e-12
    assert steps[:3] == [13, 27, 40]
    # Another step from now on: the grid of samples stays.
    engine.set_time_step(7e-5)
    recorder.schedule(engine)
    take(engine, recorder, 1)
    assert abs(engine.time - 30 * 0.004) <= 7e-5 / 2 + 1e-12


def test_frames_and_spheres_are_taken_every_so_many_samples_where_there_is_something(tmp_path: Path) -> None:
    _, engine, recorder = start(tmp_path, heights=())
    take(engine, recorder, 3)
    assert not (tmp_path / "frames").exists()
    engine.add(Poses(np.array([[0.0, 0.0, 0.03]]), (Rotation.identity(),)))
    take(engine, recorder, 10)
    # Samples 0 to 12: frames at 3, 6, 9, 12, spheres at 5 and 10.
    assert {name: len(found) for name, found in files(tmp_path).items()} == {"frames": 4, "spheres": 2}
    recorder.series.write()
    with h5py.File(tmp_path / "series.h5") as file:
        assert len(file["time_s"]) == 13
        assert file["count"][:].tolist() == [0] * 3 + [1] * 10


def test_restoring_its_memory_removes_later_files(tmp_path: Path) -> None:
    scene, engine, recorder = start(tmp_path)
    take(engine, recorder, 8)
    recorder.deepest = (2e-4, 0.012)
    memory, columns, saved = json.loads(json.dumps(recorder.memory)), recorder.series.columns, engine.save(tmp_path)
    take(engine, recorder, 8)
    ends = files(tmp_path), recorder.series.columns
    again = build_recorder(scene, tmp_path, ProgressWriter(tmp_path, scene.count))
    engine = EngineDouble.of(scene, DT)
    engine.load(saved, tmp_path)
    again.restore(memory, columns)
    assert again.deepest == (2e-4, 0.012)
    assert {name: len(found) for name, found in files(tmp_path).items()} == {"frames": 3, "spheres": 2}
    take(engine, again, 8)
    assert files(tmp_path) == ends[0]
    for name, column in ends[1].items():
        assert np.array_equal(again.series.columns[name], column, equal_nan=True), name


def test_forces_are_asked_for_and_written_with_each_frame_where_the_scene_wants_them_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[float] = []
    original = EngineDouble.contact_forces
    monkeypatch.setattr(EngineDouble, "contact_forces", lambda self: (asked.append(self.time), original(self))[1])
    without, wanting = tmp_path / "without", tmp_path / "wanting"
    for out, more in ((without, {}), (wanting, {"recording.contact_forces": True})):
        out.mkdir()
        _, engine, recorder = start(out, **more)
        take(engine, recorder, 40)
        assert bool(asked) == (out == wanting)
    assert not list(without.glob("force*"))
    assert len(asked) == len(files(wanting)["frames"]) > 10
    assert sorted(path.name for path in (wanting / "forces").iterdir()) == [
        f"force_{k:06d}.vtu" for k in range(len(asked))
    ]
    # At the end both stand on the floor, with their weight.
    last = read_forces(read_frames(wanting)[-1]).contacts
    weight = engine.particle.boxes.mass * 9.81
    assert last.smarticles.tolist() == [[0, -1], [1, -1]]
    assert last.normal == pytest.approx([weight, weight])
    memory = json.loads(json.dumps(recorder.memory))
    memory["forces"] = memory["forces"][:2]
    recorder.truncate(memory)
    assert len(list((wanting / "forces").iterdir())) == 2


def test_the_watchdog_checks_at_intervals_and_after_the_frame_is_written(tmp_path: Path) -> None:
    _, engine, recorder = start(tmp_path, heights=[0.02] * 3)
    every = round(WATCH_STEPS * DT / 0.004)
    assert every > 10
    take(engine, recorder, 2 * every)  # samples 0 to 2 every - 1: checks at 0 and at every
    assert engine.touches().all()
    engine.deepest = recorder.watchdog.depth * 1.1
    frames = len(files(tmp_path)["frames"])
    recorder.frame_every = 1
    with pytest.raises(RunError, match=r"smarticle\(s\) \(0, 1, 2\): contacts more than .* deep"):
        recorder.record(engine, 0)
    assert len(files(tmp_path)["frames"]) == frames + 1


def test_where_extremes_are_enough_only_the_energy_is_checked_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, engine, recorder = start(tmp_path)
    extremes = {"fastest": 0.1, "lowest": 1.0, "highest": 1.0, "widest": 0.0, "gap": 0.0, "deepest": 0.0}
    seen = Extremes(**extremes, elastic_energy=0.0)
    monkeypatch.setattr(engine, "extremes", lambda state: seen)
    engine.deepest = recorder.watchdog.depth * 1.1
    monkeypatch.setattr(engine.boundaries, "floor", 0.99)
    recorder.watch(engine)  # by the extremes all is well
    assert recorder.deepest == (0.0, engine.time)
    monkeypatch.setattr(engine.boundaries, "floor", 1.01)
    with pytest.raises(RunError, match="left through the wall or the floor"):
        recorder.watch(engine)
    monkeypatch.setattr(engine.boundaries, "floor", 0.99)
    engine.velocities[:, 2] = 3.0
    with pytest.raises(RunError, match="an energy that has risen by"):
        recorder.watch(engine)
