"""Runs that are killed at random moments and resumed: the same bits as the run that was never stopped."""

from __future__ import annotations

import io
import json
import random
import re
import signal
import subprocess
import time
import zipfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from processes import TIMEOUT_S, complete, differing, finish, frame_times, gate, results, start

INTERVAL_S = 0.04  # between checkpoints
FRAME_S = 0.02
SCENE = f"""\
schema_version: 1
engine: {{engine}}
name: restart
seed: {{seed}}
smarticle: {{{{aspect_ratio: 0.7}}}}
fidelity: draft
count: 12
recording: {{{{checkpoint_interval_s: {INTERVAL_S}, frame_interval_s: {FRAME_S}}}}}
phases:
  - {{{{type: deposit, per_layer: 4}}}}
  - {{{{type: relax, duration_s: 0.1}}}}
  - {{{{type: shake, duration_s: 0.2}}}}
"""
pytestmark = [pytest.mark.engine, pytest.mark.usefixtures("worker")]  # skipped where there is no YADE


def write_scene(path: Path, seed: int, engine: str = "yade") -> Path:
    path.write_text(SCENE.format(seed=seed, engine=engine))
    return path


def log_of(out: Path) -> str:
    return (out / "log.txt").read_text() if (out / "log.txt").exists() else ""


@dataclass
class Tally:
    """What the kills did."""

    kills: int = 0
    phases: Counter[str] = field(default_factory=Counter)
    lost_s: list[float] = field(default_factory=list)
    differing: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        return (
            f"{self.kills} kills ({dict(self.phases)}), {len(self.differing)} differing files, "
            f"at most {max(self.lost_s):.3f} s lost of {INTERVAL_S} s"
        )


def kill_once(scene: Path, out: Path, rng: random.Random, tally: Tally) -> bool:
    """Start, kill somewhere; whether it was still running when it was killed.

    Half of the moments are counted in frames, so that they lie where the run computes, however busy the machine;
    the others in seconds, so that they also lie in loading, restoring and closing.
    """
    before = frame_times(out)[-1:] or [0.0]
    said_before = len(log_of(out))
    process = start(scene, out)
    begun = time.monotonic()
    frames = rng.randint(1, 12) if rng.random() < 0.7 else None
    seconds = rng.uniform(0.0, 4.0)
    while process.poll() is None and time.monotonic() - begun < TIMEOUT_S:
        if frames is None:
            if time.monotonic() - begun > seconds:
                break
        elif frame_times(out)[-1:] > [before[0] + frames * FRAME_S]:
            time.sleep(rng.uniform(0.0, 0.15))
            break
        time.sleep(0.01)
    process.kill()
    status, said = finish(process)
    assert status in (0, -signal.SIGKILL), said
    check_loss(log_of(out)[said_before:], before[0], tally)
    if status == 0:
        return False
    tally.kills += 1
    tally.phases[(re.findall(r"phase \d (\w+) begins", log_of(out)) or ["start"])[-1]] += 1
    return True


def check_loss(said: str, reached_s: float, tally: Tally) -> None:
    """What a resumed run repeats, from its log and the frames that were there."""
    found = re.search(r"resumed from (?:the checkpoint of t = ([\d.]+) s|the start)", said)
    if found:
        tally.lost_s.append(reached_s - float(found[1] or 0.0))


def kill_often(tmp_path: Path, kills: int, seeds: Iterator[int], engine: str = "yade") -> Tally:
    rng = random.Random(20260101)
    tally = Tally()
    while tally.kills < kills:
        seed = next(seeds)
        scene = write_scene(tmp_path / f"{seed}.yaml", seed, engine)
        whole = tmp_path / f"whole-{seed}"
        if not whole.exists():
            complete(scene, whole)
        out = tmp_path / f"killed-{seed}-{tally.kills}"
        while tally.kills < kills and kill_once(scene, out, rng, tally):
            pass
        complete(scene, out)
        # At least the poured pile was recorded: comparing nothing with nothing proves nothing.
        assert len(results(whole)) > 20
        tally.differing += differing(results(whole), results(out))
    return tally


def test_a_run_killed_eight_times_gives_the_same_bits(tmp_path: Path) -> None:
    tally = kill_often(tmp_path, 8, iter([1] * 8))
    assert tally.differing == []
    # A frame is written before the checkpoint of the same moment.
    assert 0 < max(tally.lost_s) <= INTERVAL_S + 1e-6


@pytest.mark.validation
def test_sixty_kills_in_every_phase_change_no_bit(tmp_path: Path) -> None:
    tally = kill_often(tmp_path, 60, iter([1, 2, 3] * 60))
    print(tally)
    assert tally.differing == []
    assert 0 < max(tally.lost_s) <= INTERVAL_S + 1e-6
    assert {"deposit", "relax", "shake"} <= set(tally.phases)


@pytest.fixture(scope="module")
def halfway(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, Path]:
    """A scene, its whole run, and a run killed when it had two checkpoints."""
    folder = tmp_path_factory.mktemp("halfway")
    scene = write_scene(folder / "scene.yaml", 4)
    complete(scene, folder / "whole")
    # At its sixth checkpoint, when the fifth has made room already.
    status, said = finish(start(scene, folder / "killed", gate("checkpoint.previous.zip", 5, "SIGKILL")))
    assert status == -signal.SIGKILL, said
    return scene, folder / "whole", folder / "killed"


def copy_of(run: Path, out: Path) -> Path:
    out.mkdir()
    subprocess.run(["cp", "-r", f"{run}/.", str(out)], check=True)
    return out


def damage(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def test_a_killed_run_tells_from_where_it_would_go_on(halfway: tuple[Path, Path, Path]) -> None:
    killed = halfway[2]
    told = json.loads((killed / "progress.json").read_text())
    saved = []
    for name in ("checkpoint.zip", "checkpoint.previous.zip"):
        # Killed between two renames, it has one of them only.
        if (killed / name).exists():
            with zipfile.ZipFile(killed / name) as archive, np.load(io.BytesIO(archive.read("series.npz"))) as columns:
                saved.append(float(columns["time_s"][-1]))
    # Killed before it could tell of the newest one.
    assert told["checkpoint_s"] in [pytest.approx(time) for time in saved]
    assert told["checkpoint_s"] <= told["time_s"]


def test_a_damaged_checkpoint_falls_back_to_the_one_before(halfway: tuple[Path, Path, Path], tmp_path: Path) -> None:
    scene, whole, killed = halfway
    out = copy_of(killed, tmp_path / "out")
    damage(out / "checkpoint.zip")
    said = complete(scene, out)
    assert "going on from checkpoint.previous.zip" in said
    assert differing(results(whole), results(out)) == []


def test_without_a_whole_checkpoint_a_run_says_so_and_touches_nothing(
    halfway: tuple[Path, Path, Path], tmp_path: Path
) -> None:
    scene, _, killed = halfway
    out = copy_of(killed, tmp_path / "out")
    for name in ("checkpoint.zip", "checkpoint.previous.zip"):
        damage(out / name)
    before = results(out)
    status, said = finish(start(scene, out))
    assert status == 2
    assert "cannot be resumed, damaged: checkpoint.zip (" in said
    assert "start the run anew in another --out" in said
    assert results(out) == before


def test_of_two_resumes_at_once_one_refuses(halfway: tuple[Path, Path, Path], tmp_path: Path) -> None:
    scene, whole, killed = halfway
    out = copy_of(killed, tmp_path / "out")
    ends = [finish(process) for process in [start(scene, out), start(scene, out)]]
    assert sorted(status for status, _ in ends) == [0, 2]
    assert any("is running it; wait for it or stop it" in said for status, said in ends if status == 2)
    assert differing(results(whole), results(out)) == []


def test_a_run_asked_to_stop_ends_with_status_75_at_its_next_checkpoint(
    halfway: tuple[Path, Path, Path], tmp_path: Path
) -> None:
    scene, whole, killed = halfway
    out = copy_of(killed, tmp_path / "out")
    status, said = finish(start(scene, out, gate("frames.pvd", 3, "SIGUSR1")))
    assert status == 75
    assert "stopped as requested at the checkpoint of t = " in said
    assert not (out / "done.json").exists()
    complete(scene, out)
    assert differing(results(whole), results(out)) == []
