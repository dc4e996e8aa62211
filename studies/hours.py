"""Hours that studies were planned to take and took: `python -m studies.hours FOLDER [STUDY ...] [--out RESULTS]`.

Planned is what `smarticles sweep` expected of each run on one core when it wrote the folder; taken is the processor
time that finished runs say of themselves. Runs whose directories are gone are not counted as done.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from dem.errors import InputError
from dem.record.manifest import read_run
from dem.record.names import MANIFEST, OF_SWEEP
from postprocess.report.markdown import table_lines
from templates.sweep.folder import Folder, open_folder

STUDY, ENGINE, RUNS, PLANNED = "study", "engine", "runs planned [-]", "planned [h]"
DONE, EXPECTED, TAKEN = "runs done [-]", "planned of these [h]", "processor time of these [h]"
OVER = "over what was planned [-]"
ALL = "all"


def hours(folder: Path, studies: Sequence[str] = ()) -> pd.DataFrame:
    """One row per study and engine, and one of all together.

    Args:
        folder: Whose folders are those of studies or sweeps; others are passed over.
        studies: Names of the folders wanted; all if there are none.

    Returns:
        Runs [-] and hours of one core [h], planned and taken; NaN where nothing is done.

    Raises:
        InputError: No folder of a sweep is there, one that is named is none, or a manifest is damaged.
    """
    if not folder.is_dir():
        msg = f"{folder}: there is no such directory; give the one that `make paper` wrote into"
        raise InputError(msg)
    sweeps = [folder / name for name in studies] or sorted(one.parent for one in folder.glob(f"*/{OF_SWEEP}"))
    if not sweeps:
        msg = f"{folder}: none of its folders is that of a sweep; give the one that `make paper` wrote into"
        raise InputError(msg)
    table = pd.DataFrame([row for path in sweeps for row in _rows(open_folder(path))])
    total = {STUDY: ALL, ENGINE: "", **table[[RUNS, PLANNED, DONE, EXPECTED, TAKEN]].sum().to_dict()}
    table = pd.concat([table, pd.DataFrame([total])], ignore_index=True).astype({RUNS: int, DONE: int})
    return table.assign(**{OVER: table[TAKEN] / table[EXPECTED].where(table[EXPECTED] > 0)})


def _rows(sweep: Folder) -> list[dict[str, object]]:
    entries = pd.DataFrame(
        {
            ENGINE: [str(entry.values.get("engine", "")) for entry in sweep.entries],
            PLANNED: [entry.expected_s / 3600 for entry in sweep.entries],
            TAKEN: [_taken(sweep.run(entry)) for entry in sweep.entries],
        }
    )
    rows = []
    for engine, group in entries.groupby(ENGINE):
        done = group[group[TAKEN].notna()]
        rows.append(
            {
                STUDY: sweep.path.name,
                ENGINE: engine,
                RUNS: len(group),
                PLANNED: group[PLANNED].sum(),
                DONE: len(done),
                EXPECTED: done[PLANNED].sum(),
                TAKEN: done[TAKEN].sum(),
            }
        )
    return rows


def _taken(directory: Path) -> float:
    """Hours that a run took; NaN unless it is done."""
    seconds = read_run(directory).processor_time if (directory / MANIFEST).is_file() else None
    return math.nan if seconds is None else seconds / 3600


def text(table: pd.DataFrame) -> str:
    """The table for a person to read."""
    rows = [
        [
            row[STUDY],
            row[ENGINE],
            str(row[RUNS]),
            f"{row[PLANNED]:.1f}",
            str(row[DONE]),
            f"{row[EXPECTED]:.2f}",
            f"{row[TAKEN]:.2f}",
            f"{row[OVER]:.2f}" if row[DONE] else "–",
        ]
        for _, row in table.iterrows()
    ]
    return "\n".join(table_lines(list(table.columns), rows)) + "\n"


def main(arguments: Sequence[str] | None = None) -> None:
    """Prints the table, and writes `hours.csv`."""
    parser = argparse.ArgumentParser(prog="python -m studies.hours", description="Hours of studies, planned and taken.")
    parser.add_argument("folder", type=Path, help="whose folders are those of studies")
    parser.add_argument("studies", nargs="*", help="names of the folders wanted (default: all)")
    parser.add_argument("--out", type=Path, help="folder for hours.csv (default: the same)")
    told = parser.parse_args(arguments)
    try:
        table = hours(told.folder, told.studies)
    except InputError as error:
        parser.error(str(error))
    out: Path = told.out or told.folder
    out.mkdir(parents=True, exist_ok=True)
    table.round(4).to_csv(out / "hours.csv", index=False)
    print(text(table), end="")


if __name__ == "__main__":
    main()
