"""Runs on the links engine: the same bits twice, compiled or cached, and after kills; and how soon they begin."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest
from processes import complete, differing, finish, results, start
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


def test_kills_at_random_moments_change_no_bit(tmp_path: Path) -> None:
    rows = kills("links", 1, 2, tmp_path, seed=1)
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
