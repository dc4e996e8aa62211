"""What a simulated second of shaking takes on every engine, N = 50 to 100 000: `python -m benchmarks.growth`.

YADE and LAMMPS, on one rank and on two, shake piles that are poured as `benchmarks.scaling` does it, where they are not
there yet, each in a process of its own, again and again; the least counts. On one core that is processor time, which is
the wall time where nothing else runs; on two, wall time, of every stretch of steps the least, so that both cores must
be free now and then. Links come from tables of `benchmarks.scaling`, and ranks also from one of `benchmarks.lammps`.
What was not measured is extrapolated to `FAR`: a smarticle costs what it does in the largest pile that was timed, and
memory goes on along a straight line through what was measured from `LARGE` smarticles on; it is marked so. Rows that
the table in OUT has are not measured again.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from benchmarks import scaling
from benchmarks.child import run_child
from benchmarks.steps import LENGTH
from dem.engine.lammps.ranks import RANKS
from dem.plan.steps import time_step
from dem.scene.reading import parse_scene
from postprocess.report.figures import BLUE, GREEN, ORANGE, add_footer, blank_figure, save, style

COUNTS, FAR, LARGE = (50, 270, 1000, 5000), (20_000, 50_000, 100_000), 1000
ENGINE, WORKERS, COUNT, FIDELITY = "engine", "threads or ranks [-]", "N [-]", "fidelity"
STEP, EACH, WALL = "dt [us]", "time per step and smarticle [us]", "time per simulated time [s/s]"
MEMORY, MEASURED = scaling.MEMORY, "measured"
LINKS = (Path("results/scaling/scaling.csv"), Path("results/scaling/idle_growth.csv"))
RANKED = Path("results/lammps/ranks.csv")
LOOKS = {
    ("links", 1): ("o", BLUE),
    ("links", 2): ("s", BLUE),
    ("yade", 1): ("^", ORANGE),
    ("lammps", 1): ("D", GREEN),
    ("lammps", 2): ("v", GREEN),
}
NAMES = {"links": "links", "yade": "YADE", "lammps": "LAMMPS"}
NOUNS = {"links": "thread", "yade": "thread", "lammps": "rank"}


def row_of(engine: str, workers: int, fidelity: str, found: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """A row of the table."""
    first = found[0]
    steps = LENGTH * len(first["wall"])
    if workers == 1:
        # Of other processes in whole ticks, too few in a stretch to be compared.
        each = min(sum(one["processor"]) for one in found) / steps
    else:
        each = float(np.min([one["wall"] for one in found], axis=0).sum()) / steps
    return {
        ENGINE: engine,
        WORKERS: workers,
        COUNT: first["count"],
        FIDELITY: fidelity,
        STEP: 1e6 * first["step"],
        EACH: 1e6 * each / first["count"],
        WALL: each / first["step"],
        MEMORY: max(one["memory"] for one in found),
        MEASURED: True,
    }


def of_links(paths: Sequence[Path]) -> pd.DataFrame:
    """Rows of tables of `benchmarks.scaling`; what a later one tells counts."""
    table = pd.concat([pd.read_csv(path) for path in paths], ignore_index=True)
    table = table.drop_duplicates(["N [-]", "threads [-]"], keep="last")
    rows = []
    for row in table[table[scaling.WALL].notna()].to_dict("records"):
        told = (int(row["threads [-]"]), int(row["N [-]"]), row[scaling.WALL], row[MEMORY])
        rows.append(_told("links", *told))
    return pd.DataFrame(rows)


def of_ranks(path: Path) -> pd.DataFrame:
    """Rows of a table of `benchmarks.lammps ranks`, which does not tell memory."""
    columns = {1: "one rank [us per step and smarticle]", 2: "two ranks [us]"}
    return pd.DataFrame(
        [
            _told("lammps", workers, int(row["N"]), row[column], float("nan"))
            for row in pd.read_csv(path).to_dict("records")
            for workers, column in columns.items()
        ]
    )


def _told(engine: str, workers: int, count: int, each: float, memory: float) -> dict[str, Any]:
    """A row of time per step and smarticle [us] and memory [MiB], at standard."""
    scene = {**scaling.scene_of(count), "engine": engine}
    scene["phases"] = [*scene["phases"], {"type": "shake", "duration_s": 1.0}]
    step = time_step(parse_scene(scene, source="benchmarks"))
    known = {ENGINE: engine, WORKERS: workers, COUNT: count, FIDELITY: "standard", STEP: 1e6 * step, EACH: each}
    return {**known, WALL: 1e-6 * each * count / step, MEMORY: memory, MEASURED: True}


def extrapolated(table: pd.DataFrame) -> pd.DataFrame:
    """Rows for numbers in `FAR` beyond the largest that was measured, of each engine and number of workers."""
    rows = []
    for (engine, workers), own in table.groupby([ENGINE, WORKERS], sort=False):
        ordered = own.sort_values(COUNT)
        last, known = ordered.iloc[-1], ordered[ordered[MEMORY].notna()]
        held = known[known[COUNT] >= LARGE] if (known[COUNT] >= LARGE).sum() > 1 else known.tail(2)
        slope, begin = np.polyfit(held[COUNT], held[MEMORY], 1) if len(held) > 1 else (np.nan, np.nan)
        for count in (count for count in FAR if count > ordered[COUNT].max()):
            same = {ENGINE: engine, WORKERS: workers, COUNT: count, FIDELITY: last[FIDELITY], STEP: last[STEP]}
            costs = {EACH: last[EACH], WALL: last[WALL] * count / last[COUNT], MEMORY: begin + slope * count}
            rows.append({**same, **costs, MEASURED: False})
    return pd.DataFrame(rows, columns=list(table.columns))


def measured(known: pd.DataFrame, arguments: argparse.Namespace) -> Iterator[tuple[str, int, list[dict[str, Any]]]]:
    """Time what is asked for and not known yet."""
    for count in arguments.counts:
        pour = arguments.pours / str(count)
        if not (pour / "done.json").exists():
            run_child(arguments.pours, str(count), scaling.scene_of(count))
        number = max(2, min(8, 20_000 // count))
        asked = [one for one in LOOKS if one[0] in arguments.engines and one[1] in arguments.workers]
        if len(known):
            has = {tuple(row) for row in known.loc[known[COUNT] == count, [ENGINE, WORKERS]].to_numpy().tolist()}
            asked = [one for one in asked if one not in has]
        found: dict[tuple[str, int], list[dict[str, Any]]] = {one: [] for one in asked}
        for _ in range(arguments.repeats if count < arguments.once_from else 1):
            for (engine, workers), told in found.items():
                words = ["-m", "benchmarks.steps", engine, str(pour), arguments.fidelity, str(number)]
                environment = {**os.environ, RANKS: str(workers), "OMP_NUM_THREADS": "1"}
                said = subprocess.run(
                    [sys.executable, *words], env=environment, stdout=subprocess.PIPE, text=True, check=True
                ).stdout
                told.append(json.loads(said.splitlines()[-1]))
        for (engine, workers), told in found.items():
            yield engine, workers, told


def draw(table: pd.DataFrame, folder: Path, footer: Sequence[str]) -> list[Path]:
    """Wall time of a simulated second and memory over N; what is extrapolated is open."""
    with style():
        figure = blank_figure(7.0, 3.2)
        left, right = figure.subplots(1, 2)
        for (engine, workers), (shape, colour) in LOOKS.items():
            own = table[(table[ENGINE] == engine) & (table[WORKERS] == workers)].sort_values(COUNT)
            if own.empty:
                continue
            sure = own[MEASURED].astype(bool)
            known, far = own[sure], own[~sure]
            last = pd.concat([known.tail(1), far])
            noun = NOUNS[engine] + ("s" if workers > 1 else "")
            line = "--" if workers > 1 else "-"
            for axes, column in ((left, WALL), (right, MEMORY)):
                axes.plot(known[COUNT], known[column], line, marker=shape, color=colour,
                          label=f"{NAMES[engine]}, {workers} {noun}")  # fmt: skip
                axes.plot(last[COUNT], last[column], ":", color=colour)
                axes.plot(far[COUNT], far[column], linestyle="none", marker=shape, color=colour, fillstyle="none")
        left.set_ylabel("wall time per simulated time,\nnothing else running [s/s]")
        right.set_ylabel("peak memory [MiB]")
        for axes in (left, right):
            axes.set(xscale="log", yscale="log", xlabel="smarticles N [-]")
        left.legend(title="filled: measured; open: extrapolated", title_fontsize=6)
        figure.tight_layout()
        add_footer(figure, footer)
        return save(figure, folder / "engines", formats=("png",))


def main() -> None:
    """Time what is missing, and write table and figure."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.growth", description=__doc__)
    parser.add_argument("--counts", type=int, nargs="+", default=COUNTS, help="numbers of smarticles")
    parser.add_argument("--engines", nargs="*", choices=("yade", "lammps"), default=("yade", "lammps"))
    parser.add_argument("--workers", type=int, nargs="+", default=(1, 2), help="ranks (default: 1 2)")
    parser.add_argument("--fidelity", default="standard", help="of YADE and LAMMPS (default: %(default)s)")
    parser.add_argument("--repeats", type=int, default=4, help="of each trajectory (default: %(default)s)")
    parser.add_argument("--once-from", type=int, default=20_000, help="smarticles from which once must do")
    parser.add_argument("--pours", type=Path, default=Path("out/scaling/pours"), help="of benchmarks.scaling")
    parser.add_argument("--links", type=Path, nargs="+", default=LINKS, help="tables of benchmarks.scaling")
    parser.add_argument("--ranks", type=Path, default=RANKED, help="table of benchmarks.lammps ranks")
    parser.add_argument("--out", type=Path, default=Path("out/growth"), help="folder for table and figure")
    arguments = parser.parse_args()
    for folder in (arguments.out, arguments.pours):
        folder.mkdir(parents=True, exist_ok=True)
    path = arguments.out / "engines.csv"
    before = pd.read_csv(path) if path.exists() else pd.DataFrame()
    known = before[before[MEASURED] & (before[ENGINE] != "links")] if len(before) else before
    for engine, workers, told in measured(known, arguments):
        row = row_of(engine, workers, arguments.fidelity, told)
        print(f"{engine}, {workers}, N = {row[COUNT]}: {row[EACH]:.3g} us, {row[WALL]:.3g} s/s", flush=True)
        known = pd.concat([known, pd.DataFrame([row])], ignore_index=True)
        known.to_csv(path, index=False, float_format="%.4g")
    # What these tables have was timed on an idle machine: of the same pile they count; memory they may not tell.
    table = pd.concat([of_links(arguments.links), known, of_ranks(arguments.ranks)], ignore_index=True)
    table[MEMORY] = table.groupby([ENGINE, WORKERS, COUNT])[MEMORY].transform("max")
    table = table.drop_duplicates([ENGINE, WORKERS, COUNT, FIDELITY], keep="last")
    table = pd.concat([table, extrapolated(table)], ignore_index=True)
    table = table.sort_values([ENGINE, WORKERS, COUNT], key=lambda it: it.map(_rank) if it.name == ENGINE else it)
    table.to_csv(path, index=False, float_format="%.4g")
    print(table.to_string(index=False, float_format=lambda x: f"{x:.3g}"))
    draw(
        table,
        arguments.out,
        [
            f"Shaken at Γ = 2, l/w = 0.7, {arguments.fidelity}; steps alone, least times; piles of equal height.",
            f"Open: a smarticle as dear as in the largest pile timed; memory by a straight line from N = {LARGE} on.",
        ],
    )


def _rank(engine: str) -> int:
    return list(NAMES).index(engine)


if __name__ == "__main__":
    main()
