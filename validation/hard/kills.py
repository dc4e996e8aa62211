"""Kill runs at random moments and resume them: they give the bits of the run that was never killed.

SIGKILL meets a run after a random share of the processor time that the whole run took, loading and closing included.
Processor time does not depend on how busy the machine is.
"""

from __future__ import annotations

import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from dem.errors import RunError
from dem.record.files import write_text
from validation.access import engine_access
from validation.bench import scene_data, swing

EVERY_S = 0.04  # of simulated time between checkpoints of a run from its pour on; of frames, half as much
LONGER = 1.1  # moments are drawn from the whole run's processor time and a little more, to meet the end as well
LEAST_FILES = 20  # to compare nothing with nothing proves nothing
SAME, STATE = "same bits", "killed in"


def scene_to_kill(engine: str, seed: int) -> dict[str, Any]:
    """Return a scene: pour, rest, shake, swing, with a checkpoint every few hundred steps."""
    recording = {"checkpoint_interval_s": EVERY_S, "frame_interval_s": EVERY_S / 2}
    phases = ({"type": "relax", "duration_s": 0.05}, {"type": "shake", "duration_s": 0.2}, swing(0.2))
    return scene_data(engine_access(engine), *phases, count=12, per_layer=4, seed=seed, recording=recording)


def start(path: Path, out: Path) -> subprocess.Popen[bytes]:
    """Start a run of a scene in a process of its own, or resume it."""
    command = [sys.executable, "-m", "smarticles", "run", str(path), "--out", str(out)]
    if (out / "run.json").exists():
        command.append("--resume")
    with out.with_suffix(".txt").open("ab") as said:
        return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=said)


def finish(process: subprocess.Popen[bytes], what: str) -> float:
    """Wait for the end of a process; return the processor time that it took [s]."""
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in {0, -signal.SIGKILL}:
        raise RunError(f"{what}: ended with status {process.returncode}")
    return usage.ru_utime + usage.ru_stime


def kill_after(process: subprocess.Popen[bytes], seconds: float, what: str) -> bool:
    """Kill a process once it has taken so much processor time; return whether it was still at work."""
    ticks = os.sysconf("SC_CLK_TCK")
    while True:
        try:
            spent = Path(f"/proc/{process.pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
        except FileNotFoundError:
            break
        if spent[0] == "Z":  # it has ended
            break
        if (int(spent[11]) + int(spent[12])) / ticks >= seconds:
            process.kill()
            break
        time.sleep(0.005)
    finish(process, what)
    return process.returncode == -signal.SIGKILL


def results(out: Path) -> dict[str, bytes]:
    """Read what a run leaves: series, frames and their lists, by name."""
    files = [out / "series.h5", *out.glob("*.pvd"), *(out / "frames").iterdir()]
    return {str(path.relative_to(out)): path.read_bytes() for path in files}


def row_of(whole: Path, out: Path, *, seconds: float, killed: str) -> dict[str, Any]:
    """Compare a run that was killed and has ended since with the whole one; return a row of the table."""
    log = (out / "log.txt").read_text(encoding="utf-8")
    from_where = re.search(r"resumed from (?:the checkpoint of t = ([\d.]+) s|the start)", log)
    one, other = results(whole), results(out)
    differing = [name for name in {*one, *other} if one.get(name) != other.get(name)]
    if len(one) < LEAST_FILES:
        raise RunError(f"{whole}: only {len(one)} files to compare, {LEAST_FILES} at least")
    return {
        "killed after [s of processor time]": seconds,
        STATE: killed,
        "resumed from [s of simulated time]": float(from_where[1] or 0.0) if from_where else 0.0,
        "files [1]": len(one),
        "files that differ [1]": len(differing),
        SAME: "yes" if not differing else "NO",
    }


def _phase_of(out: Path) -> str:
    """Return the phase of a run, by its log; before the first: start."""
    log = out / "log.txt"
    begun = re.findall(r"phase \d+ (\S+) (begins|ended)", log.read_text(encoding="utf-8")) if log.exists() else []
    if not begun:
        return "start"
    kind, what = begun[-1]
    return str(kind) if what == "begins" else f"after {kind}"


def kills(engine: str, number: int, folder: Path, *, seed: int) -> list[dict[str, Any]]:
    """Kill runs of one scene at random moments, and compare each with the whole one; return rows of the table."""
    rng, path, whole = random.Random(1000 * seed + 1), folder / f"{seed}.yaml", folder / f"whole-{seed}"
    write_text(path, json.dumps(scene_to_kill(engine, seed)))
    # Twice: the first compiles what is not in the cache yet.
    finish(start(path, whole), str(whole))
    again = folder / f"again-{seed}"
    took = finish(start(path, again), str(again))
    if results(whole) != results(again):
        raise RunError(f"{folder}: one scene run twice does not give the same bits; no kill was needed")
    rows: list[dict[str, Any]] = []
    while len(rows) < number:
        seconds, out = rng.uniform(0.0, LONGER * took), folder / f"killed-{seed}-{len(rows)}"
        what = f"{out}, killed after {seconds:.2f} s of processor time"
        met = kill_after(start(path, out), seconds, what)
        killed = _phase_of(out)
        if met:
            finish(start(path, out), what)
            row = row_of(whole, out, seconds=seconds, killed=killed)
            rows.append({"engine": engine, "threads": 1, "seed": seed, "kill": len(rows) + 1, **row})
            if row[SAME] != "yes":
                continue
        shutil.rmtree(out)
        out.with_suffix(".txt").unlink()
    return rows
