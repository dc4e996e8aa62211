"""`python -m validation.extremes --count 300 --jobs 2 --out DIR`: run extreme scenes, count their ends.

Each scene is planned, run and checked; DIR gets `extremes.csv`, and a scene file and a run directory each. A scene
whose row is there already is not run again.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from validation.extremes.checks import check_run
from validation.extremes.scenes import draw_scene

RIGHT, REJECTED, STOPPED, WRONG, LATE = "right", "rejected by plan", "stopped with a cause", "WRONG", "out of time"


def run_one(number: int, out: Path, tree: Path, limit: float) -> dict[str, Any]:
    """Plan, run and check one scene.

    Args:
        number: of the scene.
        out: folder of scene and run.
        tree: source tree whose `smarticles` runs it.
        limit: wall time allowed [s].

    Returns:
        A row of the table.
    """
    scene, path, run = draw_scene(number), out / f"{number:04d}.yaml", out / f"{number:04d}"
    path.write_text(yaml.safe_dump(scene, sort_keys=False), encoding="utf-8")
    shutil.rmtree(run, ignore_errors=True)
    begun = time.monotonic()
    row = {"scene": number, "count": scene["count"], "last phase": scene["phases"][-1]["type"]}
    environment = {**os.environ, "PYTHONPATH": str(tree), "OMP_NUM_THREADS": "1"}
    end, cause = "", ""
    for what, arguments in (("plan", ["plan", str(path)]), ("run", ["run", str(path), "--out", str(run)])):
        command = [sys.executable, "-m", "smarticles", *arguments]
        try:
            child = subprocess.run(
                command, cwd=tree, env=environment, capture_output=True, text=True, timeout=limit, check=False
            )
        except subprocess.TimeoutExpired:
            end = LATE
            break
        if child.returncode:
            cause = (child.stderr.strip().splitlines() or [f"status {child.returncode}"])[-1]
            known = "Traceback" not in child.stderr and child.returncode in {1, 2}
            end = WRONG if not known else REJECTED if what == "plan" or child.returncode == 2 else STOPPED
            break
    row |= {"end": end, "cause": cause, "wall time [s]": round(time.monotonic() - begun, 1)}
    if not end:
        found = check_run(run, scene)
        cause = found.pop("wrong")
        row |= {"end": WRONG if cause else RIGHT, "cause": cause, **found}
    if row["end"] != WRONG:
        shutil.rmtree(run, ignore_errors=True)
    return row


def main() -> int:
    """Run all scenes; the exit status is 1 if one is wrong."""
    parser = argparse.ArgumentParser(prog="python -m validation.extremes", description=__doc__)
    parser.add_argument("--count", type=int, default=300, help="scenes (default: %(default)s)")
    parser.add_argument("--first", type=int, default=0, help="number of the first scene (default: %(default)s)")
    parser.add_argument("--jobs", type=int, default=1, help="runs at a time (default: %(default)s)")
    parser.add_argument("--limit", type=float, default=300, help="wall time of a run [s] (default: %(default)s)")
    parser.add_argument("--tree", type=Path, default=Path.cwd(), help="source tree to run (default: this one)")
    parser.add_argument("--out", type=Path, required=True, help="folder of table, scenes and runs that are wrong")
    arguments = parser.parse_args()
    out = arguments.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    path = out / "extremes.csv"
    rows = pd.read_csv(path, keep_default_na=False).to_dict("records") if path.exists() else []
    numbers = range(arguments.first, arguments.first + arguments.count)
    missing = [number for number in numbers if number not in {row["scene"] for row in rows}]
    with ProcessPoolExecutor(arguments.jobs) as pool:
        runs = [pool.submit(run_one, number, out, arguments.tree.resolve(), arguments.limit) for number in missing]
        for run in runs:
            rows.append(run.result())
            pd.DataFrame(rows).to_csv(path, index=False, float_format="%.4g")
            row = rows[-1]
            print(f"{row['scene']:4d} {row['end']:20s} {row['last phase']}: {row['cause']}", flush=True)
    table = pd.DataFrame(rows)
    print(table["end"].value_counts().to_string())
    return int((table["end"] == WRONG).any())


if __name__ == "__main__":
    sys.exit(main())
