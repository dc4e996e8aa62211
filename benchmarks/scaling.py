"""Cost of a step per smarticle on links as piles grow at equal height, and threads: `python -m benchmarks.scaling`.

Piles of 50 to 20 000 are poured once, into `OUT/pours`, in cylinders as wide as the height of the paper's pile of 270
asks for; a pour that is there is not made again. Each is then shaken at Γ = 2 for a period of the shaking, in processes
of their own, threads in turn, and again and again: the trajectory is the same bit for bit, so that of each stretch of
four steps the least time counts. That is as near to an idle machine as a shared one allows; with several threads it
still needs all cores to be free at once for some milliseconds.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from benchmarks.child import run_child
from benchmarks.engines import PAPER_COUNT, PAPER_PER_LAYER, PAPER_RADIUS
from benchmarks.stretches import LENGTH
from postprocess.report.figures import BLUE, GREY, ORANGE, add_footer, blank_figure, save, style

COUNTS = (50, 100, 270, 1000, 2000, 5000, 10_000, 20_000)
STRETCHES = 80  # 320 steps, a period of 30 Hz
WALL, PROCESSOR = "wall time per step and smarticle [us]", "processor time per step and smarticle [us]"
MEMORY, TOUCHES, HEIGHT = "peak memory [MiB]", "contact points per smarticle [-]", "height of the centre of mass [mm]"


def scene_of(count: int, seed: int = 1) -> dict[str, Any]:
    """Pour and wait, with a checkpoint while it rests."""
    widening = (count / PAPER_COUNT) ** 0.5
    return {
        "schema_version": 1,
        "name": f"poured, N = {count}",
        "engine": "links",
        "seed": seed,
        "count": count,
        "container": {"radius_m": PAPER_RADIUS * widening},
        "recording": {"frame_interval_s": 1.0, "checkpoint_interval_s": 0.4},
        "phases": [
            {"type": "deposit", "per_layer": max(4, round(PAPER_PER_LAYER * widening**2))},
            {"type": "relax", "duration_s": 0.5},
        ],
    }


def stretches(run: Path, threads: int) -> dict[str, Any]:
    """Time one trajectory on some threads."""
    environment = {**os.environ, "OMP_NUM_THREADS": str(threads)}
    command = [sys.executable, "-m", "benchmarks.stretches", str(run), str(STRETCHES)]
    said = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True).stdout
    found: dict[str, Any] = json.loads(said)
    return found


def row_of(count: int, threads: int, found: Sequence[dict[str, Any]]) -> dict[str, float]:
    """A row of the table: of every stretch the least of all repetitions."""
    each = 1e6 / (LENGTH * STRETCHES * count)
    least = {name: each * float(np.min([one[name] for one in found], axis=0).sum()) for name in ("wall", "processor")}
    return {
        "N [-]": count,
        "threads [-]": threads,
        WALL: least["wall"],
        PROCESSOR: least["processor"],
        TOUCHES: found[0]["touches"],
        HEIGHT: 1e3 * found[0]["height"],
        MEMORY: max(one["memory"] for one in found),
        "repetitions [-]": len(found),
    }


def with_ratios(table: Any) -> Any:
    """Growth against N = 100 on one thread, and how much faster more threads are."""
    wide = table.pivot_table(index="N [-]", columns="threads [-]", values=WALL)
    table = table.copy()
    alone = table["N [-]"].map(wide[1]) if 1 in wide else np.nan
    table["faster than one thread [1]"] = alone / table[WALL]
    base = table[(table["N [-]"] == 100) & (table["threads [-]"] == 1)][PROCESSOR]
    growth = table[PROCESSOR] / (base.iloc[0] if len(base) else np.nan)
    table["growth against N = 100 [1]"] = growth.where(table["threads [-]"] == 1)
    return table


def draw(table: Any, folder: Path, said: str) -> None:
    """Cost per smarticle and memory over N."""
    with style():
        figure = blank_figure(7.0, 2.6)
        left, right = figure.subplots(1, 2)
        for threads, colour in zip(sorted(table["threads [-]"].unique()), (BLUE, ORANGE, GREY), strict=False):
            rows = table[table["threads [-]"] == threads]
            label = f"{threads} thread{'s' if threads > 1 else ''}"
            left.plot(rows["N [-]"], rows[WALL], "o-", color=colour, label=label)
            right.plot(rows["N [-]"], rows[MEMORY], "o-", color=colour, label=label)
        left.set_ylabel("wall time per step\nand smarticle [µs]")
        left.set_ylim(bottom=0)
        right.set_ylabel("peak memory [MiB]")
        right.set_ylim(bottom=0)
        for axes in (left, right):
            axes.set_xscale("log")
            axes.set_xlabel("smarticles N [-]")
        left.legend()
        figure.tight_layout()
        add_footer(figure, [said])
        save(figure, folder / "scaling", formats=("png",))


def main() -> None:
    """Pour what is not there, time, and write table and figure."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.scaling", description=__doc__)
    parser.add_argument("--counts", type=int, nargs="+", default=COUNTS, help="numbers of smarticles")
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2], help="numbers of threads")
    parser.add_argument("--repeats", type=int, default=10, help="of each trajectory (default: %(default)s)")
    parser.add_argument("--out", type=Path, default=Path("out/scaling"), help="folder for pours, table and figure")
    arguments = parser.parse_args()
    folder, pours = arguments.out, arguments.out / "pours"
    pours.mkdir(parents=True, exist_ok=True)
    rows = []
    for count in arguments.counts:
        if not (pours / str(count) / "done.json").exists():
            run_child(pours, str(count), scene_of(count))
        found: dict[int, list[dict[str, Any]]] = {threads: [] for threads in arguments.threads}
        for _ in range(arguments.repeats):
            for threads, told in found.items():
                told.append(stretches(pours / str(count), threads))
        rows += [row_of(count, threads, told) for threads, told in found.items()]
        table = with_ratios(pd.DataFrame(rows))
        table.to_csv(folder / "scaling.csv", index=False, float_format="%.4g")
        print(table[table["N [-]"] == count].to_string(index=False, float_format=lambda x: f"{x:.3g}"), flush=True)
    load = f"load of the machine at the end {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    draw(table, folder, f"python {' '.join(['-m benchmarks.scaling', *sys.argv[1:]])}; {platform.machine()}, {load}")
    print(f"table and figure: {folder}")


if __name__ == "__main__":
    main()
