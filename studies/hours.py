"""Planned and spent hours of studies: `python -m studies.hours FOLDER [STUDY ...] [--out RESULTS]`.

Planned hours are the wall times on one core that were estimated when the sweep's folder was made. Spent hours are the
processor times of finished runs; runs without a directory do not count as finished.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from dem.errors import InputError
from dem.record.names import MANIFEST, OF_SWEEP
from dem.record.run import open_run
from templates.sweep.folder import open_folder

STUDY, ENGINE, RUNS, PLANNED = "study", "engine", "runs planned [-]", "planned [h]"
DONE, EXPECTED, TAKEN = "runs done [-]", "planned of these [h]", "processor time of these [h]"
OVER = "over what was planned [-]"
ALL = "all"


def hours(folder: Path, studies: Sequence[str] = ()) -> pd.DataFrame:
    """Sum planned and spent hours of one core [h] by study and engine.

    Args:
        folder: folder that contains the folders of the studies.
        studies: names of folders in it; empty: all folders of a sweep.

    Returns:
        One row per study and engine, and the total as the last row.

    Raises:
        InputError: There is no folder of a sweep, a named folder is not one, or a manifest is damaged.
    """
    cause = "no such directory" if not folder.is_dir() else "none of its folders is the folder of a sweep"
    sweeps = [folder / name for name in studies] or sorted(one.parent for one in folder.glob(f"*/{OF_SWEEP}"))
    if not folder.is_dir() or not sweeps:
        raise InputError(f"{folder}: {cause}; give the folder that contains the folders of the studies")
    runs = pd.DataFrame(
        {
            STUDY: path.name,
            ENGINE: str(entry.values.get("engine", "")),
            PLANNED: entry.expected_s / 3600,
            TAKEN: _taken(sweep.run(entry)),
        }
        for path in sweeps
        for sweep in [open_folder(path)]
        for entry in sweep.entries
    )
    runs[EXPECTED] = runs[PLANNED].where(runs[TAKEN].notna())
    groups = runs.groupby([STUDY, ENGINE], sort=False)
    table = groups[[PLANNED, EXPECTED, TAKEN]].sum()
    table[RUNS], table[DONE] = groups.size(), groups[TAKEN].count()
    table.loc[(ALL, ""), :] = table.sum()
    table = table.astype({RUNS: int, DONE: int})
    table[OVER] = table[TAKEN] / table[EXPECTED].where(table[EXPECTED] > 0)
    return table.reset_index()[[STUDY, ENGINE, RUNS, PLANNED, DONE, EXPECTED, TAKEN, OVER]]


def _taken(directory: Path) -> float:
    """Return the processor time of a run [h]; NaN unless it is finished."""
    seconds = open_run(directory).status.cpu_s if (directory / MANIFEST).is_file() else None
    return math.nan if seconds is None else seconds / 3600


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table of hours and write it to `hours.csv`."""
    parser = argparse.ArgumentParser(prog="python -m studies.hours", description="Planned and spent hours of studies.")
    parser.add_argument("folder", type=Path, help="folder that contains the folders of the studies")
    parser.add_argument("studies", nargs="*", help="names of these folders (default: all)")
    parser.add_argument("--out", type=Path, help="folder for hours.csv (default: FOLDER)")
    given = parser.parse_args(arguments)
    try:
        table = hours(given.folder, given.studies)
    except InputError as error:
        parser.error(str(error))
    out: Path = given.out or given.folder
    out.mkdir(parents=True, exist_ok=True)
    table.round(4).to_csv(out / "hours.csv", index=False)
    print(table.to_string(index=False, float_format="%.2f"))


if __name__ == "__main__":
    main()
