"""Whole runs: what a run directory contains after a good end, a full disk, or Ctrl-C; and that bits repeat."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import cases
import meshio
import numpy as np
import pytest
import yaml
from processes import frame_files, series

from dem.scene.reading import load_scene

SceneData = Callable[..., dict[str, Any]]
ROOT = Path(__file__).resolve().parents[2]
RUN = (
    "import sys; from pathlib import Path\n"
    "from dem.run.run import run_scene; from dem.scene.reading import load_scene\n"
    "run_scene(load_scene(Path(sys.argv[1])), Path(sys.argv[2]), command='test')"
)
TIMEOUT = 300  # s of wall time, for machines that are busy with long simulations


def start(data: dict[str, Any], folder: Path, out: Path) -> subprocess.Popen[str]:
    """A run in a process of its own."""
    scene = folder / f"{out.name}.yaml"
    scene.write_text(yaml.safe_dump(data))
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-c", RUN, str(scene), str(out)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen(command, cwd=ROOT, env=environment, **pipes)


def finish(process: subprocess.Popen[str]) -> str:
    """Last line on standard error."""
    try:
        error = process.communicate(timeout=TIMEOUT)[1]
    finally:
        process.kill()
    return error.strip().splitlines()[-1] if error.strip() else ""


def read_json(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def finished(worker: Any, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """One small run, read by several tests."""
    out = tmp_path_factory.mktemp("finished") / "run"
    data = {
        "schema_version": 1,
        "name": "small",
        "seed": 1,
        "count": 10,
        "fidelity": "draft",
        # Layers of five that come to rest before the next, so that the force of the first is known.
        "phases": [
            {"type": "deposit", "per_layer": 5, "landed_speed_m_per_s": 1e-4},
            {"type": "relax", "duration_s": 0.2},
            {"type": "shake", "duration_s": 0.2, "frequency_hz": 30, "peak_acceleration_g": 2},
            {"type": "relax", "duration_s": 0.1},
        ],
        "recording": {"series_interval_s": 0.008, "frame_interval_s": 0.04},
    }
    answer = worker.submit(cases.run, data, str(out)).result(TIMEOUT)
    assert answer["error"] is None, answer
    return out, data


def test_pour_ends_settled_and_weighs_what_it_weighs(finished: tuple[Path, dict[str, Any]]) -> None:
    out, data = finished
    rows, scene = series(out), cases.scene_of(data)
    settle, weight = scene.phases[0].settle, 10 * scene.smarticle.boxes.mass * 9.81
    settled_at = read_json(out / "done.json")["phases"][0]["end_s"]
    # The criterion holds at one check; the pile may move once more. Later it lies still.
    resting = (rows["time_s"] >= settled_at + 0.1) & (rows["phase"] == 1)
    assert resting.sum() > 5
    assert rows["max_speed_m_per_s"][resting].max() < settle.speed_m_per_s
    assert rows["unbalanced_force"][resting].max() < settle.unbalanced_force
    assert rows["max_speed_m_per_s"][rows["phase"] == 0].max() > 10 * settle.speed_m_per_s  # it was poured
    force = rows["container_force_N"][resting].mean(axis=0)
    assert force == pytest.approx([0, 0, -weight], abs=5e-3 * weight)
    shaken = rows["phase"] == 2
    # Over whole periods the mean force on the container is the weight too, and it moves by A.
    amplitude = 2 * 9.81 / (2 * np.pi * 30) ** 2
    assert np.abs(rows["container_z_m"][shaken]).max() == pytest.approx(amplitude, rel=0.05)
    assert rows["max_speed_m_per_s"][shaken].max() > 0.05


def test_same_seed_gives_the_same_bits_in_another_process_and_another_seed_others(
    simulate: Callable[..., Any], scene_data: SceneData, tmp_path: Path
) -> None:
    phases = [{"type": "deposit", "per_layer": 3}, {"type": "shake", "duration_s": 0.1}]
    data = scene_data({"count": 6, "phases": phases})
    outs = [tmp_path / name for name in ("first", "again", "other")]
    simulate(cases.run, data, str(outs[0]))
    assert finish(start(data, tmp_path, outs[1])) == ""
    simulate(cases.run, {**data, "seed": 2}, str(outs[2]))
    files = [{path.name: path.read_bytes() for path in frame_files(out)} for out in outs]
    assert files[0] == files[1]
    assert len(files[0]) > 4
    assert any(files[0][name] != files[2][name] for name in files[0].keys() & files[2].keys())
    rows = [series(out) for out in outs]
    for name, column in rows[0].items():
        assert column.tobytes() == rows[1][name].tobytes(), name
    assert rows[0]["com_height_m"].tobytes() != rows[2]["com_height_m"].tobytes()
    assert (outs[0] / "frames.pvd").read_bytes() == (outs[1] / "frames.pvd").read_bytes()


def test_ctrl_c_leaves_a_usable_run_directory(scene_data: SceneData, tmp_path: Path) -> None:
    out = tmp_path / "run"
    process = start(scene_data({"phases.1.duration_s": 1000}), tmp_path, out)
    deadline = time.monotonic() + TIMEOUT
    while len(frame_files(out)) < 4 and time.monotonic() < deadline:
        assert process.poll() is None, process.communicate()
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    assert finish(process).startswith("KeyboardInterrupt")
    assert process.returncode not in (0, -signal.SIGSEGV, -signal.SIGABRT)
    failed = read_json(out / "failed.json")
    assert (failed["status"], failed["cause"]) == ("interrupted", "interrupted by the user")
    assert not (out / "done.json").exists()
    assert not (out / "progress.json").exists()
    assert load_scene(out / "scene.yaml").count == 10
    assert read_json(out / "run.json")["count"] == 10
    for path in frame_files(out):
        assert meshio.read(path).cell_data["time_s"][0][0] > 0
    listed = ElementTree.parse(out / "frames.pvd").getroot().findall("Collection/DataSet")
    assert len(listed) in (len(frame_files(out)), len(frame_files(out)) - 1)
    assert series(out)["time_s"][-1] == pytest.approx(failed["time_s"], abs=0.005)
    assert not [path for path in out.rglob("*") if "partial" in path.name]


def test_disk_that_fills_up_ends_the_run_with_one_line(
    scene_data: SceneData, tmp_path: Path, mount_disk: Callable[[str], Path]
) -> None:
    out = mount_disk("192k") / "run"  # room for the start of a run
    process = start(scene_data({"recording.frame_interval_s": 0.004}), tmp_path, out)
    message = finish(process)
    assert process.returncode == 1
    assert message.startswith(f"dem.errors.RunError: {out}/")
    assert "cannot be written (No space left on device); free space" in message
    # Nothing lost: everything there is whole.
    assert not (out / "done.json").exists()
    assert read_json(out / "run.json")["count"] == 10
    assert frame_files(out)
    for path in frame_files(out):
        assert len(meshio.read(path).points) > 0
    assert len(series(out)["time_s"]) > 1
    assert not [path for path in out.rglob("*") if "partial" in path.name]
