"""Print planned and spent hours of studies: `python -m studies.hours FOLDER [STUDY ...]`.

The table is also written to FOLDER/hours.csv. Planned hours are the wall times on one core that were estimated when the
sweep's folder was made. Spent hours are the processor times of finished runs; runs without a directory do not count as
finished.
"""

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from dem.errors import InputError
from dem.record.names import MANIFEST, OF_SWEEP
from dem.record.run import open_run
from templates.sweep.folder import open_folder

PLANNED, EXPECTED, TAKEN = "planned [h]", "planned of these [h]", "processor time of these [h]"


def hours(folder: Path, studies: Sequence[str] = ()) -> pd.DataFrame:
    """Sum planned and spent hours of one core [h] by study and engine; the last row is the total.

    `studies` are names of folders of sweeps in `folder`; all if empty. InputError if there is none.
    """
    rows = []
    for name in studies or sorted(one.parent.name for one in folder.glob(f"*/{OF_SWEEP}")):
        sweep = open_folder(folder / name)
        for entry in sweep.entries:
            run, engine = sweep.run(entry), str(entry.values.get("engine", ""))
            seconds = open_run(run).status.cpu_s if (run / MANIFEST).is_file() else None
            taken = math.nan if seconds is None else seconds / 3600
            rows.append({"study": name, "engine": engine, PLANNED: entry.expected_s / 3600, TAKEN: taken})
    if not rows:
        raise InputError(f"{folder}: has no folder of a sweep; give the folder that contains those of the studies")
    runs = pd.DataFrame(rows)
    runs[EXPECTED] = runs[PLANNED].where(runs[TAKEN].notna())
    groups = runs.groupby(["study", "engine"], sort=False)
    table = groups[[PLANNED, EXPECTED, TAKEN]].sum()
    table.insert(0, "runs planned [-]", groups.size())
    table.insert(2, "runs done [-]", groups[TAKEN].count())
    table.loc[("all", ""), :] = table.sum()
    table["over what was planned [-]"] = table[TAKEN] / table[EXPECTED].where(table[EXPECTED] > 0)
    return table.astype({"runs planned [-]": int, "runs done [-]": int}).reset_index()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m studies.hours", description="Planned and spent hours of studies.")
    parser.add_argument("folder", type=Path, help="folder that contains the folders of the studies")
    parser.add_argument("studies", nargs="*", help="names of these folders (default: all)")
    given = parser.parse_args()
    try:
        table = hours(given.folder, given.studies)
    except InputError as error:
        parser.error(str(error))
    table.round(4).to_csv(given.folder / "hours.csv", index=False)
    print(table.to_string(index=False, float_format="%.2f"))
