"""What can only be measured on an idle machine, in eight minutes or less: `python -m benchmarks.idle`.

Time to the first step, warm; links at N = 270, shaken and in internal oscillation, three seeds each, beside
what `plan` expects; YADE beside links; growth of a step from N = 100 to 10 000, and two threads at 300 to 5000, of
piles that are poured where they are not there yet. A part is left out, and said so, where less time is left than it is
thought to take. Tables go to OUT.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd

from benchmarks import scaling
from benchmarks.child import run_child
from benchmarks.engines import ACTIVITIES, COST, measured, scene_of
from dem.plan.outlook import plan
from dem.scene.reading import parse_scene

COUNT, SECONDS, YADE_SECONDS = 270, 2.0, 0.3
GROWTH, THREADED = (100, 5000, 10_000), (300, 500, 1000, 5000)
BEGINS = 5  # times that a run is begun


def activities(folder: Path) -> Any:
    """Links at N = 270, three seeds of each activity, and what was planned."""
    rows = []
    for activity in ACTIVITIES:
        for seed in (1, 2, 3):
            row = measured(folder, "links", activity, COUNT, fidelity="standard", seconds=SECONDS, seed=seed)
            scene = scene_of("links", activity, COUNT, fidelity="standard", seconds=SECONDS, seed=seed)
            phase = plan(parse_scene(scene, source="benchmarks")).phases[-1]
            expected = phase.wall_s / phase.estimate_s
            rows.append({**row, "planned [s/s]": expected, "planned over measured [1]": expected / row[COST]})
    return pd.DataFrame(rows)


def growth(folder: Path) -> Any:
    """Cost of a step per smarticle as piles grow at equal height, on one thread and, of some, on two."""
    pours, rows = folder / "pours", []
    pours.mkdir(exist_ok=True)
    for count in sorted({*GROWTH, *THREADED}):
        if not (pours / str(count) / "done.json").exists():
            run_child(pours, str(count), scaling.scene_of(count))
        threads = (1, 2) if count in THREADED else (1,)
        told: dict[int, list[dict[str, Any]]] = {each: [] for each in threads}
        for _ in range(5 if count >= 5000 else 8):
            for each, found in told.items():
                found.append(scaling.stretches(pours / str(count), each))
        rows += [scaling.row_of(count, each, found) for each, found in told.items()]
    return scaling.with_ratios(pd.DataFrame(rows))


def beginning(folder: Path) -> Any:
    """Wall time from the command to the first phase, with a warm cache."""
    scene = scene_of("links", "shake", 60, fidelity="draft", seconds=0.02, seed=1)
    run_child(folder, "warm", scene)
    rows = []
    for k in range(BEGINS):
        out, log = folder / f"begin-{k}", folder / f"begin-{k}/log.txt"
        command = [sys.executable, "-m", "smarticles", "run", str(folder / "warm.yaml"), "--out", str(out)]
        begun = time.monotonic()
        child = subprocess.Popen(command, stdout=subprocess.DEVNULL)
        while not (log.exists() and "phase 0 deposit begins" in log.read_text(encoding="utf-8")):
            if child.poll() is not None:
                sys.exit(f"benchmark run {out} ended with status {child.returncode} before its first phase")
            time.sleep(0.005)
        rows.append({"run": k, "from the command to the first phase [s]": time.monotonic() - begun})
        child.wait()
    return pd.DataFrame(rows)


def side_by_side(folder: Path) -> Any:
    """Both engines, shaken, the same seed."""
    each = [
        measured(folder, engine, "shake", COUNT, fidelity="standard", seconds=YADE_SECONDS, seed=11)
        for engine in ("links", "yade")
    ]
    return pd.DataFrame(each).assign(**{"over links [1]": [row[COST] / each[0][COST] for row in each]})


PARTS: dict[str, tuple[Callable[[Path], Any], float]] = {
    "beginning": (beginning, 15.0),
    "activities": (activities, 60.0),
    "engines": (side_by_side, 100.0),
    "growth": (growth, 290.0),
}


def main() -> None:
    """Measure all parts."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.idle", description=__doc__)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS), help="(default: all)")
    parser.add_argument("--minutes", type=float, default=8.0, help="time allowed (default: %(default)s)")
    parser.add_argument("--out", type=Path, default=Path("out/idle"), help="folder for runs and tables")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    begun = time.monotonic()
    print(f"load of the machine at the start {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores", flush=True)
    for name in arguments.parts:
        part, usual = PARTS[name]
        before = time.monotonic()
        if before - begun + usual > 60 * arguments.minutes:
            print(f"{name}: left out for want of time, it takes about {usual:.0f} s; go on with --parts {name}")
            continue
        table = part(arguments.out)
        table.to_csv(arguments.out / f"{name}.csv", index=False, float_format="%.4g")
        print(table.to_string(index=False, float_format=lambda x: f"{x:.3g}"))
        print(f"{name}: {time.monotonic() - before:.0f} s; load {os.getloadavg()[0]:.1f}", flush=True)


if __name__ == "__main__":
    main()
