"""Runs that are killed at a random moment and resumed: the bits of the one that never was.

Each kill is a run of its own: it begins, SIGKILL meets it after a random share of the processor time that the whole run
took, loading and closing among it, and it is resumed. Processor time, since it is the same however busy the machine is.
On one thread a run begins with its pour. On several it takes over a pile that one thread poured and is ten times
shorter: where threads have to share a core with others, each of a step's barriers may wait for milliseconds.
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
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from dem.errors import RunError
from dem.record.files import write_text
from dem.run.run import _git_revision
from validation.engines import engine_access
from validation.hard.scenes import scene, swing

EVERY_S = 0.04  # of simulated time between checkpoints of a run from its pour on; of frames, half as much
LONGER = 1.1  # moments are drawn from the whole run's processor time and a little more, to meet the end as well
LEAST_FILES = 20  # to compare nothing with nothing proves nothing
SAME, STATE = "same bits", "killed in"


def scene_to_kill(engine: str, seed: int, pile: Path | None = None) -> dict[str, Any]:
    """Pour, or take over a pile of a run; rest, shake, swing, with a checkpoint every few hundred steps."""
    share = 1.0 if pile is None else 0.25
    every, frames = (EVERY_S, EVERY_S / 2) if pile is None else (0.3 * EVERY_S, 0.1 * EVERY_S)
    recording = {"checkpoint_interval_s": every, "frame_interval_s": frames}
    phases = (
        {"type": "relax", "duration_s": 0.05 * share},
        {"type": "shake", "duration_s": 0.2 * share},
        swing(0.2 * share),
    )
    data = scene(engine_access(engine), *phases, count=12, per_layer=4, seed=seed, recording=recording)
    if pile is not None:
        data["phases"][0] = {"type": "take-over", "run": str(pile), "frame": "last"}
    return data


def start(path: Path, out: Path, threads: int) -> subprocess.Popen[bytes]:
    """Run a scene in a process of its own, or go on with it."""
    command = [sys.executable, "-m", "smarticles", "run", str(path), "--out", str(out), "--threads", str(threads)]
    if (out / "run.json").exists():
        command.append("--resume")
    with out.with_suffix(".txt").open("ab") as said:
        return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=said)


def finish(process: subprocess.Popen[bytes], what: str) -> float:
    """Wait for its end; the processor time that it took [s].

    Raises:
        RunError: it failed.
    """
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in {0, -signal.SIGKILL}:
        msg = f"{what}: ended with status {process.returncode}"
        raise RunError(msg)
    return usage.ru_utime + usage.ru_stime


def kill_after(process: subprocess.Popen[bytes], seconds: float, what: str) -> bool:
    """Kill a process once it has taken so much processor time; whether it was still at work."""
    ticks = os.sysconf("SC_CLK_TCK")
    while True:
        try:
            spent = Path(f"/proc/{process.pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
        except FileNotFoundError:
            break
        # Of an ended process that nobody has waited for, the state is Z.
        if spent[0] == "Z":
            break
        if (int(spent[11]) + int(spent[12])) / ticks >= seconds:
            process.kill()
            break
        time.sleep(0.005)
    finish(process, what)
    return process.returncode == -signal.SIGKILL


def results(out: Path) -> dict[str, bytes]:
    """What a run leaves for others: series, frames and their lists, by name."""
    files = [out / "series.h5", *out.glob("*.pvd"), *(out / "frames").iterdir()]
    return {str(path.relative_to(out)): path.read_bytes() for path in files}


def row_of(whole: Path, out: Path, *, seconds: float, killed: str) -> dict[str, Any]:
    """What became of a run that was killed and has ended since."""
    log = (out / "log.txt").read_text(encoding="utf-8")
    from_where = re.search(r"resumed from (?:the checkpoint of t = ([\d.]+) s|the start)", log)
    one, other = results(whole), results(out)
    differing = [name for name in {*one, *other} if one.get(name) != other.get(name)]
    if len(one) < LEAST_FILES:
        msg = f"{whole}: only {len(one)} files to compare, {LEAST_FILES} at least"
        raise RunError(msg)
    return {
        "killed after [s of processor time]": seconds,
        STATE: killed,
        "resumed from [s of simulated time]": float(from_where[1] or 0.0) if from_where else 0.0,
        "files [1]": len(one),
        "files that differ [1]": len(differing),
        SAME: "yes" if not differing else "NO",
    }


def _phase_of(out: Path) -> str:
    """In which phase the run is, by its log; before the first: start."""
    log = out / "log.txt"
    begun = re.findall(r"phase \d+ (\S+) (begins|ended)", log.read_text(encoding="utf-8")) if log.exists() else []
    if not begun:
        return "start"
    kind, what = begun[-1]
    return str(kind) if what == "begins" else f"after {kind}"


def kills(engine: str, threads: int, number: int, folder: Path, *, seed: int) -> list[dict[str, Any]]:
    """Kill runs of one scene on some threads at random moments, and compare each with the whole one.

    Args:
        engine: its name.
        threads: of each run.
        number: kills.
        folder: for the runs; those that gave the same bits are removed.
        seed: of the scene and of the moments.

    Raises:
        RunError: a run failed, or left nothing to compare.
    """
    rng, path, whole = random.Random(1000 * seed + threads), folder / f"{seed}.yaml", folder / f"whole-{seed}-{threads}"
    if threads == 1:
        data = scene_to_kill(engine, seed)
    else:
        pile = folder / f"pile-{seed}"
        if not (pile / "done.json").exists():
            poured = scene_to_kill(engine, seed)
            write_text(path, json.dumps({**poured, "phases": poured["phases"][:2]}))
            finish(start(path, pile, 1), str(pile))
        data = scene_to_kill(engine, seed, pile)
    write_text(path, json.dumps(data))
    # Twice: the first compiles what is not in the cache yet.
    finish(start(path, whole, threads), str(whole))
    again = folder / f"again-{seed}-{threads}"
    took = finish(start(path, again, threads), str(again))
    if results(whole) != results(again):
        msg = f"{folder}: one scene run twice on {threads} thread(s) does not give the same bits; no kill was needed"
        raise RunError(msg)
    rows: list[dict[str, Any]] = []
    while len(rows) < number:
        seconds, out = rng.uniform(0.0, LONGER * took), folder / f"killed-{seed}-{threads}-{len(rows)}"
        what = f"{out}, killed after {seconds:.2f} s of processor time"
        met = kill_after(start(path, out, threads), seconds, what)
        killed = _phase_of(out)
        if met:
            finish(start(path, out, threads), what)
            row = row_of(whole, out, seconds=seconds, killed=killed)
            rows.append({"engine": engine, "threads": threads, "seed": seed, "kill": len(rows) + 1, **row})
            if row[SAME] != "yes":
                continue
        shutil.rmtree(out)
        out.with_suffix(".txt").unlink()
    return rows


def run_kills(out: Path, scratch: Path, engine: str, *, threads: Sequence[int], number: int) -> bool:
    """Kill and resume, `number` times on each number of threads, and write `kills.csv`.

    Args:
        out: folder of the table; rows of the same engine and threads are replaced.
        scratch: folder for the runs.
        engine: its name.
        threads: numbers of threads.
        number: kills on each; a third of them of each of three seeds.

    Returns:
        Whether every run gave the bits of the one that was never killed.
    """
    path, commit = out / "kills.csv", _git_revision()
    table = pd.read_csv(path) if path.exists() else pd.DataFrame(columns=["engine", "threads"])
    shares = [len(range(k, number, 3)) for k in range(3)]
    good = True
    for each in threads:
        kept, rows = table[(table["engine"] != engine) | (table["threads"] != each)], []
        for k, share in enumerate(shares):
            rows += kills(engine, each, share, scratch, seed=k + 1)
            found = pd.DataFrame(rows).assign(commit=commit)
            table = pd.concat([kept, found], ignore_index=True) if len(kept) else found
            write_text(path, table.to_csv(index=False, float_format="%.4g"))
        same = int((found[SAME] == "yes").sum())
        where = ", ".join(f"{count} {what}" for what, count in found[STATE].value_counts().items())
        print(f"{engine}, {each} thread{'s' if each > 1 else ''}: {same} of {len(found)} the same bits ({where})")
        good &= same == len(found)
    return good
