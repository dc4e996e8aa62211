"""Runs on LAMMPS: checkpoints to the bit, a rank that is killed, the command line."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import small

from dem.body.placement import place_layer
from dem.engine.interface import Engine
from dem.engine.lammps.engine import LammpsEngine
from dem.errors import InputError, RunError
from dem.record.series import read_series
from dem.run.build import Builders, build_engine
from dem.run.run import run_scene
from dem.scene.scene import Scene

Build = Callable[..., LammpsEngine]
QUICK: dict[str, Any] = {
    "engine": "lammps",
    "count": 3,
    "phases": [
        {"type": "deposit", "per_layer": 3, "layer_height_w": 0.1, "settle": {"hold_s": 0.0, "speed_m_per_s": 1}},
        {"type": "shake", "duration_s": 0.04, "frequency_hz": 50, "peak_acceleration_g": 3},
    ],
    "recording": {"frame_interval_s": 0.008, "checkpoint_interval_s": 0.02},
}
"""Not settled, but a pour and a shake in 0.1 s."""
QUICK["phases"][0]["settle"]["unbalanced_force"] = 10


def poured(engine: LammpsEngine, seed: int, bottom: float) -> None:
    rng = np.random.default_rng(seed)
    poses = place_layer(
        engine.particle, count=4, radius=0.0105, bottom=bottom, height=0.005, obstacles=np.empty((0, 3)), rng=rng
    )
    engine.add(poses, speed=0.3)


def test_a_saved_simulation_continues_bit_by_bit(build: Build, tmp_path: Path) -> None:
    scene = small({"engine": "lammps", "container": {"radius_m": 0.0105}})
    engine = build(scene)
    poured(engine, 1, 1e-4)
    engine.advance(300)
    poured(engine, 2, 0.03)
    engine.boundaries.shake(amplitude=5e-4, frequency=30.0)
    engine.advance(150)
    while not engine.touches().sum():
        assert engine.steps < 800
        engine.advance(10)
    before, at = engine.state(), engine.time
    spent = engine.cpu_elsewhere
    assert spent > 0
    saved = engine.save(tmp_path)
    assert engine.cpu_elsewhere >= spent  # of the one that was restarted as well
    assert np.array_equal(engine.state().vertices, before.vertices)
    engine.advance(100)
    went_on = engine.state()
    engine.child.close()
    other = build(scene)
    other.load(saved, tmp_path)
    assert (other.time, other.count) == (at, 8)
    other.advance(100)
    assert np.array_equal(other.state().vertices, went_on.vertices)
    assert np.array_equal(other.state().link_spins, went_on.link_spins)
    assert other.boundaries.floor == engine.boundaries.floor != 0
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(InputError, match=r"^checkpoint: format 'links-3', here is 'lammps-2'"):
        other.load(replace(saved, memory={"format": "links-3"}), tmp_path)


ORPHAN = """
from dem.engine.lammps.kind import LammpsKind
from dem.plan.steps import time_step
from scenes import small
from test_lammps_life import poured
scene = small({"engine": "lammps"})
engine = LammpsKind().build(scene, time_step(scene))
poured(engine, 1, 1e-4)
engine.advance(1)
print(engine.child._process.pid, *engine.child.local_ranks(), flush=True)
engine.advance(10_000_000)
"""


def test_lammps_ends_with_a_run_that_is_killed_whatever_it_is_at(tmp_path: Path) -> None:
    here = Path(__file__).parent
    paths = os.pathsep.join([str(here), str(here.parent), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = {**os.environ, "PYTHONPATH": paths, "SMARTICLES_RANKS": "2", "TMPDIR": str(tmp_path)}
    command = [sys.executable, "-c", ORPHAN]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as run:
        assert run.stdout is not None
        started = [int(pid) for pid in run.stdout.readline().split()]
        assert len(started) == 3
        (log,) = tmp_path.glob("smarticles-lammps-*/log.lammps")
        _await(lambda: "run 10000000 pre" in log.read_text(), "LAMMPS runs")
        run.kill()
    try:
        _await(lambda: not any(Path(f"/proc/{pid}/cmdline").exists() for pid in started), "LAMMPS ended with its run")
    finally:
        for pid in started:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)


def _await(done: Callable[[], bool], what: str) -> None:
    began = time.monotonic()
    while not done():
        assert time.monotonic() - began < 30, f"30 s, and not yet: {what}"
        time.sleep(0.1)


def test_a_run_whose_rank_is_killed_reports_it_loses_nothing_and_continues(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SMARTICLES_RANKS", "2")
    scene, out, built = small(QUICK), tmp_path / "run", []

    class Fatal:
        """Kills its second rank at a time."""

        def __call__(self, scene: Scene, dt: float) -> Engine:
            engine = build_engine(scene, dt)
            assert isinstance(engine, LammpsEngine)
            built.append(engine)
            advance = engine.advance

            def until(steps: int) -> None:
                if engine.time > 0.05:
                    os.kill(engine.child.local_ranks()[1], signal.SIGKILL)
                advance(steps)

            monkeypatch.setattr(engine, "advance", until)
            return engine

    cause = r"^at t = 0\.05\d\d s .*LAMMPS ended: rank \d was ended by signal 9 \(Killed\); if memory ran out"
    with pytest.raises(RunError, match=cause) as caught:
        run_scene(scene, out, command="test", builders=Builders(engine=Fatal()))
    assert "last good checkpoint: t = 0.04" in str(caught.value)
    failed = json.loads((out / "failed.json").read_text())
    assert failed["status"] == "failed"
    assert len(list((out / "frames").iterdir())) >= 6
    assert read_series(out)["time_s"][-1] > 0.045
    log = Path(str(caught.value).partition("its log: ")[2].split(" ")[0])
    assert "run " in log.read_text()
    log.unlink()
    log.parent.rmdir()
    outcome = run_scene(scene, out, command="test", resume=True)
    assert outcome is not None
    times = read_series(out)["time_s"]
    assert np.abs(np.diff(times) - 0.004).max() < 2e-4
    assert json.loads((out / "run.json").read_text())["threads"] == 2


def test_the_command_runs_on_two_ranks_and_what_it_leaves_is_measured(tmp_path: Path) -> None:
    file, out = tmp_path / "scene.yaml", tmp_path / "run"
    data = {"schema_version": 1, "seed": 1, "fidelity": "draft", **QUICK}
    data["recording"] = {"frame_interval_s": 0.008, "checkpoint_interval_s": None}
    file.write_text(json.dumps(data))

    def call(*words: str | Path) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "smarticles", *map(str, words)]
        return subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)

    said = call("run", file, "--out", out, "--ranks", "2")
    assert said.returncode == 0, said.stderr
    assert "warning" not in said.stderr  # a slow machine tells how far it is
    manifest = json.loads((out / "run.json").read_text())
    assert (manifest["engine"], manifest["threads"]) == ("lammps", 2)
    assert set(manifest["versions"]) >= {"lammps"}
    measured = call("measure", out, "--json")
    assert measured.returncode == 0
    assert "shake" in measured.stdout
    assert not list(Path(os.environ.get("TMPDIR", "/tmp")).glob(f"smarticles-lammps-*/{out.name}"))
