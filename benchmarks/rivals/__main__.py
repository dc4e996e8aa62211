"""Our engines beside the rivals: `python -m benchmarks.rivals`.

A pile per seed is poured once, on links; every engine gets its poses, lets them rest, and shakes them at Γ = 2 and
30 Hz, or swings the barbs by 10° where it has motors. Every simulation is a process of its own on one thread, one after
the other, seed by seed. Timed is the activity alone, by processor time. Rows go to `rivals.csv` as they come, where a
later call with the same `--out` goes on; table and figure are made of them. What is not installed is left out, in one
line each.
"""

from __future__ import annotations

import argparse
import json
import platform
import subprocess
import sys
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path

import pandas as pd

from benchmarks.rivals import figure, running
from benchmarks.rivals.ours import RESIDUAL
from benchmarks.rivals.settings import ACTIVITIES, ENGINES, SETTINGS, Setting
from benchmarks.rivals.table import markdown, medians, verdicts
from dem.errors import InputError
from dem.run.run import versions

QUICK_COUNT, QUICK_SECONDS = 20, 0.05
LOOK = 0.01  # s between two looks at the poses; at 30 Hz ten phases of the shaking
# Engines that keep an account of energies, and at what setting.
ACCOUNTED, ACCOUNTED_AT = ("links", "yade"), "standard"


def planned(engines: Sequence[str], seeds: Sequence[int]) -> Iterator[tuple[Setting, str, int, bool]]:
    """Setting, activity, seed, and whether the account of energies is kept: what is run, in this order.

    An account costs time, so that it is kept in a run of its own, of the first seed.
    """
    for seed in seeds:
        for setting in SETTINGS:
            if setting.engine not in engines or (setting.costly and seed != seeds[0]):
                continue
            for activity in setting.activities:
                yield setting, activity, seed, False
                if setting.engine in ACCOUNTED and seed == seeds[0] and setting.name == ACCOUNTED_AT:
                    yield setting, activity, seed, True


def missing_from(rows: pd.DataFrame, setting: Setting, activity: str, seed: int, *, account: bool) -> bool:
    """Whether the rows lack a run."""
    if rows.empty:
        return True
    same = (rows["engine"] == ENGINES[setting.engine].title) & (rows["setting"] == setting.name)
    same &= (rows["activity"] == activity) & (rows["seed"] == seed)
    return bool(rows[same & (rows["account"] == account)].empty)


def joined(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows that were timed; of those with an account, what it misses alone."""
    timed = rows[~rows["account"]]
    if RESIDUAL not in rows:
        return timed
    keys = ["engine", "setting", "activity", "seed"]
    return timed.drop(columns=RESIDUAL).merge(rows.loc[rows["account"], [*keys, RESIDUAL]], on=keys, how="left")


def run_all(folder: Path, arguments: argparse.Namespace, engines: Sequence[str]) -> pd.DataFrame:
    """Run what the folder's table lacks.

    Raises:
        InputError: the table is of another pile or time, or the pile's scene is refused.
    """
    path = folder / "rivals.csv"
    rows = pd.read_csv(path) if path.exists() else pd.DataFrame()
    for column, value in ((running.COUNT, arguments.count), (running.SECONDS, arguments.seconds)):
        if len(rows) and (rows[column] != value).any():
            msg = f"--out {folder}: has rows of {column} {rows[column].iloc[0]:g}, not {value:g}; choose another folder"
            raise InputError(msg)
    for setting, activity, seed, account in planned(engines, arguments.seeds):
        if activity not in arguments.activities or not missing_from(rows, setting, activity, seed, account=account):
            continue
        pile = running.pour(folder, count=arguments.count, seed=seed)
        try:
            row = running.run(
                folder, setting, activity, pile,
                count=arguments.count, seed=seed, seconds=arguments.seconds, look=LOOK, account=account,
            )  # fmt: skip
        except subprocess.CalledProcessError as error:
            print(f"{setting.engine}, {setting.name}, {activity}, seed {seed}: failed, status {error.returncode}")
            continue
        rows = pd.concat([rows, pd.DataFrame([{**row, "account": account}])], ignore_index=True)
        rows.to_csv(path, index=False)
        told = f"{row[running.COST]:8.2f} s/s, {1e3 * row[running.DEPTH]:.4f} mm deep"
        print(f"{row['engine']:7s} {setting.name:28s} {activity} seed {seed}: {told}", flush=True)
    return rows


def machine() -> str:
    """Processor and cores."""
    model = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        names = [
            line.split(":", 1)[1].strip() for line in info.read_text().splitlines() if line.startswith("model name")
        ]
        model = f"{len(names)} x {names[0]}" if names else model
    return f"{model}, {platform.system()} {platform.release()}"


def main() -> int:
    """Run all; write the table, the figure and the origin."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.rivals", description=__doc__)
    parser.add_argument("--engines", nargs="+", choices=ENGINES, default=list(ENGINES), help="(default: all)")
    parser.add_argument("--activities", nargs="+", choices=ACTIVITIES, default=list(ACTIVITIES))
    parser.add_argument("--count", type=int, default=270, help="smarticles (default: %(default)s)")
    parser.add_argument("--seconds", type=float, default=0.4, help="of the activity [s] (default: %(default)s)")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3], help="piles; what is costly has the first")
    parser.add_argument("--quick", action="store_true", help="a small pile, and little time")
    parser.add_argument("--analyse", action="store_true", help="run nothing: table and figure of the rows in --out")
    parser.add_argument("--out", type=Path, default=None, help="folder (default: a new one); goes on if it exists")
    arguments = parser.parse_args()
    if arguments.quick:
        arguments.count, arguments.seconds, arguments.seeds = QUICK_COUNT, QUICK_SECONDS, [1]
    if arguments.count < 1 or arguments.seconds < LOOK:
        parser.error(f"--count {arguments.count}, --seconds {arguments.seconds:g}: at least 1 and {LOOK:g} s")
    folder = arguments.out or Path("out") / f"rivals-{datetime.now(UTC).strftime('%Y%m%d-%H%M%S')}"
    folder.mkdir(parents=True, exist_ok=True)
    engines = [] if arguments.analyse else arguments.engines
    for engine in engines:
        if ENGINES[engine].missing:
            print(ENGINES[engine].missing)
    present = [engine for engine in engines if ENGINES[engine].missing is None]
    try:
        rows = run_all(folder, arguments, present)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    if rows.empty:
        print("nothing was run", file=sys.stderr)
        return 1
    table = medians(joined(rows))
    said = verdicts(table)
    table.to_csv(folder / "rivals_medians.csv", index=False, float_format="%.4g")
    origin = {
        "machine": machine(),
        "command": f"python -m benchmarks.rivals {' '.join(sys.argv[1:])}",
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "count": arguments.count,
        "seconds": arguments.seconds,
        "versions": {**versions(("links", "")), **dict(rows.groupby("engine")["version"].first())},
    }
    (folder / "rivals.json").write_text(json.dumps(origin, indent=2) + "\n", encoding="utf-8")
    (folder / "rivals.md").write_text(markdown(table, said), encoding="utf-8")
    about = f"N = {arguments.count}, l/w = 0.7; {origin['machine']}; git {origin['versions']['git']}"
    figure.draw(
        folder / "rivals", table, [about, "Medians over seeds; overlap of the shapes that each engine keeps apart."]
    )
    print((folder / "rivals.md").read_text(encoding="utf-8"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
