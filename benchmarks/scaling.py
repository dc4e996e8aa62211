"""Measure the cost per step and smarticle on links: `python -m benchmarks.scaling`.

Piles have growing numbers of smarticles and equal heights. They are poured once, into `OUT/pours`. Each pile is then
shaken at Γ = 2 for one period, several times in separate processes. All repetitions compute equal bits, so the smallest
time of each interval of four steps is used. It approximates the time on an idle machine.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from benchmarks.runs import pile, run_child
from dem.engine.interface import Saved
from dem.engine.kinds import engine_kind
from dem.plan.steps import time_steps
from dem.record.checkpoint import read_checkpoint
from dem.record.run import open_run
from dem.scene.reading import dump_scene, load_scene, parse_scene, scene_hash

COUNTS = (50, 100, 270, 1000, 2000, 5000, 10_000, 20_000)
STEPS = 4  # per timed interval
AMPLITUDE, FREQUENCY = 0.552e-3, 30.0  # shaking of the paper [m, Hz], Γ = 2
WALL, PROCESSOR = "wall time per step and smarticle [us]", "processor time per step and smarticle [us]"


def time_intervals(run: Path) -> dict[str, Any]:
    """Load the last checkpoint of a run and time the shaking of its pile.

    Returns lists of wall and processor time of each interval of one period [s], contacts per smarticle, and peak memory
    [MiB].
    """
    scene, made_by = load_scene(run / "scene.yaml"), open_run(run).manifest.versions["links"]
    # The scene needs a phase that shakes, or the engine is built without a moving container.
    content = yaml.safe_load(dump_scene(scene))
    content["phases"].append({"type": "shake", "duration_s": 1.0, "frequency_hz": FREQUENCY})
    shaken = parse_scene(content, source=str(run))
    time_step = min(time_steps(shaken))
    engine = engine_kind("links").build(shaken, time_step)
    checkpoint, _ = read_checkpoint(run, scene_sha256=scene_hash(scene), made_by=("links", made_by))
    state: dict[str, Any] = dict(checkpoint.state)
    engine.load(Saved(content=checkpoint.engine, memory=state["engine"]), run)
    engine.boundaries.shake(amplitude=AMPLITUDE, frequency=FREQUENCY)
    engine.advance(30)
    wall, processor = [], []
    for _ in range(round(1 / (FREQUENCY * STEPS * time_step))):
        begun, spent = time.perf_counter(), time.process_time()
        engine.advance(STEPS)
        wall.append(time.perf_counter() - begun)
        processor.append(time.process_time() - spent)
    return {
        "wall": wall,
        "processor": processor,
        "contact points per smarticle [-]": float(engine.touches().mean()),
        "peak memory [MiB]": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }


def row_of(run: Path, count: int, repeats: int) -> dict[str, Any]:
    """Time the shaking of a poured pile in `repeats` separate processes; return a row of the table.

    The times per step and smarticle use the least time of each interval among all repetitions. Contacts and peak memory
    are those of the last repetition.
    """
    command = [sys.executable, "-m", "benchmarks.scaling", "--time-pile", str(run)]
    found = [
        json.loads(subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout)
        for _ in range(repeats)
    ]
    each = 1e6 / (STEPS * len(found[0]["wall"]) * count)
    wall, processor = (
        each * np.min([timing.pop(kind) for timing in found], axis=0).sum() for kind in ("wall", "processor")
    )
    return {"N [-]": count, WALL: wall, PROCESSOR: processor, **found[-1]}


def main() -> None:
    """Pour the missing piles, time all piles, and write the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.scaling", description=__doc__)
    parser.add_argument("--counts", type=int, nargs="+", default=COUNTS, help="numbers of smarticles")
    parser.add_argument("--repeats", type=int, default=10, help="number of timings per pile (default: %(default)s)")
    parser.add_argument("--out", type=Path, default=Path("out/scaling"), help="folder for pours and table")
    parser.add_argument("--time-pile", type=Path, metavar="RUN", help="time this pile once and print JSON")
    given = parser.parse_args()
    if given.time_pile:
        print(json.dumps(time_intervals(given.time_pile)))
        return
    pours, rows = given.out / "pours", []
    pours.mkdir(parents=True, exist_ok=True)
    recording = {"frame_interval_s": 1.0, "checkpoint_interval_s": 0.4}
    for count in given.counts:
        if not (pours / str(count) / "done.json").exists():
            rest = {"type": "relax", "duration_s": 0.5}
            run_child(pours, str(count), pile(count, rest, engine="links", recording=recording))
        rows.append(row_of(pours / str(count), count, given.repeats))
        table = pd.DataFrame(rows)
        table["growth against the least N [1]"] = table[PROCESSOR] / table[PROCESSOR].iloc[0]
        table.to_csv(given.out / "scaling.csv", index=False, float_format="%.4g")
        print(table[table["N [-]"] == count].to_string(index=False, float_format=lambda x: f"{x:.3g}"), flush=True)
    print(f"table: {given.out / 'scaling.csv'}; load of the machine at the end {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
