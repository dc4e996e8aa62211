"""A clock that is set back while a run goes on: durations are of a clock that nobody sets, and results know none."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import smarticles
from dem.run.warm import compile_for
from dem.scene.reading import load_scene

SCENE = """\
schema_version: 1
seed: 1
count: 4
engine: links
fidelity: draft
phases: [{type: deposit, settle: {timeout_s: 5}}, {type: relax, duration_s: 0.02}]
recording: {frame_interval_s: 0.02, checkpoint_interval_s: 0.04}
"""
# Read by Python when it starts: every look at the clock of the wall is an hour earlier than the one before.
BACKWARDS = """\
import itertools, time
now, looks = time.time(), itertools.count(1)
time.time = lambda: now - 3600 * next(looks)
time.time_ns = lambda: int(1e9 * time.time())
"""


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The same scene by a clock that is right, and by one that goes backwards."""
    folder = tmp_path_factory.mktemp("clock")
    (folder / "scene.yaml").write_text(SCENE, encoding="utf-8")
    compile_for(load_scene(folder / "scene.yaml"))  # a run that compiles says so
    (folder / "sitecustomize.py").write_text(BACKWARDS, encoding="utf-8")
    repository = str(Path(smarticles.__file__).parents[1])
    made = {}
    for name, paths in {"right": [repository], "backwards": [str(folder), repository]}.items():
        made[name] = folder / name
        words = [sys.executable, "-m", "smarticles", "run", "scene.yaml", "--out", name]
        env = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
        done = subprocess.run(words, cwd=folder, env=env, capture_output=True, text=True, check=False, timeout=600)
        assert done.returncode == 0, done.stderr
        assert "warning" not in done.stderr  # a slow machine tells how far it is
    return made


def test_the_clock_was_set_back(runs: dict[str, Path]) -> None:
    """The log, whose lines say when they were written, shows that the other tests here test something."""
    stamps = [line.split()[:2] for line in (runs["backwards"] / "log.txt").read_text(encoding="utf-8").splitlines()]
    stamps = [stamp for stamp in stamps if stamp and stamp[0][:2] == "20"]
    assert len(stamps) > 2
    assert stamps == sorted(stamps, reverse=True)
    assert stamps[0] != stamps[-1]


def test_times_spent_are_still_those_spent(runs: dict[str, Path]) -> None:
    spent = {name: json.loads((run / "done.json").read_text(encoding="utf-8")) for name, run in runs.items()}
    for done in spent.values():
        for part in (done, *done["phases"]):
            # Seconds of a run of four smarticles, and no hours in either direction.
            assert 0 <= part["wall_s"] < 300
            assert 0 <= part["cpu_s"] < 300
    assert spent["backwards"]["time_s"] == spent["right"]["time_s"]
