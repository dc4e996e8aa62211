"""Hours that studies were planned to take and took: `python -m studies.hours FOLDER [STUDY ...] [--out RESULTS]`.

Planned is what `smarticles sweep` expected of each run on one core when it wrote the folder; taken is the processor
time in the manifests of finished runs. Runs whose directories are gone are not counted as done.
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
    """Sum hours of one core, planned and taken [h], by study and engine, and of all together.

    Folders that are not those of studies or sweeps are passed over; of those that are named all count.

    Raises:
        InputError: No folder of a sweep is there, one that is named is none, or a manifest is damaged.
    """
    cause = "there is no such directory" if not folder.is_dir() else "none of its folders is that of a sweep"
    sweeps = [folder / name for name in studies] or sorted(one.parent for one in folder.glob(f"*/{OF_SWEEP}"))
    if not folder.is_dir() or not sweeps:
        raise InputError(f"{folder}: {cause}; give the one that `make paper` wrote into")
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
    """Hours that a run took; NaN unless it is done."""
    seconds = open_run(directory).status.cpu_s if (directory / MANIFEST).is_file() else None
    return math.nan if seconds is None else seconds / 3600


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table, and write `hours.csv`."""
    parser = argparse.ArgumentParser(prog="python -m studies.hours", description="Hours of studies, planned and taken.")
    parser.add_argument("folder", type=Path, help="whose folders are those of studies")
    parser.add_argument("studies", nargs="*", help="names of the folders wanted (default: all)")
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
