"""Runs on the links engine: the same bits twice, compiled or cached, and after kills; and how soon they begin."""

from __future__ import annotations

import json
import os
import signal
import time
from pathlib import Path

import pytest
from processes import complete, differing, finish, gate, results, start
from test_restart import INTERVAL_S, kill_often, log_of

from smarticles.verification.hard.kills import SAME, kills

SCENE = """\
schema_version: 1
engine: links
seed: 1
fidelity: draft
count: 12
recording: {checkpoint_interval_s: 0.04, frame_interval_s: 0.02}
phases:
  - {type: deposit, per_layer: 4}
  - {type: internal-oscillation, duration_s: 0.1, theta_deg: 10}
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE)
    return path


def test_the_same_bits_twice_compiled_and_cached(scene: Path, tmp_path: Path) -> None:
    complete(scene, tmp_path / "one")
    complete(scene, tmp_path / "two")
    variables = {"SMARTICLES_CACHE_DIR": str(tmp_path / "cold")}
    for name in ("compiled", "cached"):
        status, said = finish(start(scene, tmp_path / name, variables))
        assert status == 0, said
        assert ("compiling the links engine" in said) is (name == "compiled")
    one = results(tmp_path / "one")
    assert len(one) > 5
    for name in ("two", "compiled", "cached"):
        assert differing(one, results(tmp_path / name)) == []


def test_a_run_killed_four_times_gives_the_same_bits(tmp_path: Path) -> None:
    tally = kill_often(tmp_path, 4, iter([1] * 8), "links")
    assert tally.differing == []
    assert max(tally.lost_s, default=0.0) <= INTERVAL_S + 1e-6


COMPILING_S = 1800.0  # of wall time, for what takes 75 s of a processor's on two threads for the first time


@pytest.mark.validation  # in seconds on free cores, in minutes where threads have to wait for one
def test_a_run_on_two_threads_killed_and_resumed_gives_the_same_bits(scene: Path, tmp_path: Path) -> None:
    threads = ("--threads", "2")
    for name in ("whole", "killed", "other"):
        kill = {} if name == "whole" else gate("checkpoint.zip", 4, "SIGKILL")
        status, said = finish(start(scene, tmp_path / name, kill, *threads), COMPILING_S)
        assert status == (0 if name == "whole" else -signal.SIGKILL), said
        assert "12 smarticles gain little by more than one thread" in said
    assert json.loads((tmp_path / "whole/run.json").read_text())["threads"] == 2
    # Resumed with as many threads as it began with, unless told.
    status, said = finish(start(scene, tmp_path / "killed"))
    assert (status, "the run began with" in said) == (0, False), said
    assert differing(results(tmp_path / "whole"), results(tmp_path / "killed")) == []
    status, said = finish(start(scene, tmp_path / "other", {}, "--threads", "1"))
    assert status == 0
    assert "--threads 1: the run began with 2" in said


@pytest.mark.parametrize("threads", [1, pytest.param(2, marks=pytest.mark.validation)])
def test_kills_at_random_moments_change_no_bit(tmp_path: Path, threads: int) -> None:
    rows = kills("links", threads, 2, tmp_path, seed=1)
    assert [row[SAME] for row in rows] == ["yes", "yes"]
    assert all(row["files [1]"] > 20 for row in rows)


@pytest.mark.validation
def test_sixty_kills_change_no_bit(tmp_path: Path) -> None:
    tally = kill_often(tmp_path, 60, iter([1, 2, 3] * 60), "links")
    print(tally)
    assert tally.differing == []
    assert {"deposit", "relax", "shake"} <= set(tally.phases)


@pytest.mark.validation
def test_a_run_begins_within_two_seconds(scene: Path, tmp_path: Path) -> None:
    complete(scene, tmp_path / "warm")
    process = start(scene, tmp_path / "run")
    while "phase 0 deposit begins" not in log_of(tmp_path / "run"):
        assert process.poll() is None
        time.sleep(0.005)
    # Processor time: other processes may be at work. Loading the kernel, 0.4 s, comes on top.
    spent = Path(f"/proc/{process.pid}/stat").read_text().split()
    took = (int(spent[13]) + int(spent[14])) / os.sysconf("SC_CLK_TCK")
    process.kill()
    finish(process)
    print(f"{took:.2f} s")
    assert took < 1.6
