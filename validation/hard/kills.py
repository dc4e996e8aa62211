"""Kill runs at random times, resume them, and compare them bit by bit with an uninterrupted run.

SIGKILL is sent after a random fraction of the processor time of the uninterrupted run, from start to exit of the
process. Processor time, unlike wall time, does not depend on the load of the machine.
"""

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

CHECKPOINT_S = 0.04  # simulated time between checkpoints [s]; frames are twice as frequent
LONGER = 1.1  # kills are drawn up to 1.1 times the processor time of the run, so that its last moments are included
LEAST_FILES = 20  # fewer files would make the comparison meaningless
SAME, STATE = "same bits", "killed in"


def scene_to_kill(engine: str, seed: int) -> dict[str, Any]:
    """Return a scene as a dictionary: pour, rest, shake, swing, and a checkpoint every few hundred steps."""
    recording = {"checkpoint_interval_s": CHECKPOINT_S, "frame_interval_s": CHECKPOINT_S / 2}
    phases = ({"type": "relax", "duration_s": 0.05}, {"type": "shake", "duration_s": 0.2}, swing(0.2))
    return scene_data(engine_access(engine), *phases, count=12, per_layer=4, seed=seed, recording=recording)


def start(path: Path, out: Path) -> subprocess.Popen[bytes]:
    """Start a process that runs a scene file, or resumes an existing run."""
    command = [sys.executable, "-m", "smarticles", "run", str(path), "--out", str(out)]
    if (out / "run.json").exists():
        command.append("--resume")
    with out.with_suffix(".txt").open("ab") as errors:
        return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=errors)


def finish(process: subprocess.Popen[bytes], what: str) -> float:
    """Wait until a process has ended, by itself or by SIGKILL; return its processor time [s].

    RunError, whose message begins with `what`, if the process failed.
    """
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in {0, -signal.SIGKILL}:
        raise RunError(f"{what}: ended with status {process.returncode}")
    return usage.ru_utime + usage.ru_stime


def kill_after(process: subprocess.Popen[bytes], seconds: float, what: str) -> bool:
    """Kill a process after `seconds` of processor time; return False if it ended before.

    RunError, whose message begins with `what`, if the process failed.
    """
    ticks = os.sysconf("SC_CLK_TCK")
    while True:
        try:
            spent = Path(f"/proc/{process.pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
        except FileNotFoundError:
            break
        if spent[0] == "Z":  # the process has ended
            break
        if (int(spent[11]) + int(spent[12])) / ticks >= seconds:
            process.kill()
            break
        time.sleep(0.005)
    finish(process, what)
    return process.returncode == -signal.SIGKILL


def results(out: Path) -> dict[str, bytes]:
    """Return the bytes of the series, the frames and the `.pvd` files of a run, by path relative to `out`."""
    files = [out / "series.h5", *out.glob("*.pvd"), *(out / "frames").iterdir()]
    return {str(path.relative_to(out)): path.read_bytes() for path in files}


def row_of(whole: Path, out: Path, *, seconds: float, killed: str) -> dict[str, Any]:
    """Compare a resumed run with the uninterrupted run; return a row of the table.

    `seconds` is the processor time before the kill [s], `killed` the phase of the kill. RunError if there are too few
    files.
    """
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
    """Return the last phase in the log of a run, or "start" before the first phase."""
    log = out / "log.txt"
    begun = re.findall(r"phase \d+ (\S+) (begins|ended)", log.read_text(encoding="utf-8")) if log.exists() else []
    if not begun:
        return "start"
    kind, what = begun[-1]
    return str(kind) if what == "begins" else f"after {kind}"


def kills(engine: str, number: int, folder: Path, *, seed: int) -> list[dict[str, Any]]:
    """Kill `number` runs of one scene at random times, resume them, and compare their results.

    Each is compared with an uninterrupted run; its row of the table is returned. `seed` is that of the scene and of the
    random times. Run directories without a difference are removed. RunError if a run failed, or two uninterrupted runs
    differ.
    """
    rng, path, whole = random.Random(1000 * seed + 1), folder / f"{seed}.yaml", folder / f"whole-{seed}"
    write_text(path, json.dumps(scene_to_kill(engine, seed)))
    # Two runs: the first may compile code, which would distort the processor time.
    finish(start(path, whole), str(whole))
    again = folder / f"again-{seed}"
    duration = finish(start(path, again), str(again))
    if results(whole) != results(again):
        raise RunError(f"{folder}: one scene run twice does not give the same bits; no kill was needed")
    rows: list[dict[str, Any]] = []
    while len(rows) < number:
        seconds, out = rng.uniform(0.0, LONGER * duration), folder / f"killed-{seed}-{len(rows)}"
        what = f"{out}, killed after {seconds:.2f} s of processor time"
        was_killed = kill_after(start(path, out), seconds, what)
        killed = _phase_of(out)
        if was_killed:
            finish(start(path, out), what)
            row = row_of(whole, out, seconds=seconds, killed=killed)
            rows.append({"engine": engine, "threads": 1, "seed": seed, "kill": len(rows) + 1, **row})
            if row[SAME] != "yes":
                continue
        shutil.rmtree(out)
        out.with_suffix(".txt").unlink()
    return rows
