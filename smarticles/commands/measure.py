"""measure: tables of what came out of runs."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Container, Sequence
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING

from dem.errors import InputError
from smarticles.layout import Cell, columns
from smarticles.parsing import Commands, add_json, add_overwrite

if TYPE_CHECKING:
    import pandas as pd

_COMPARED = "second-highest-com"
_WIDTH = 100  # characters of a terminal
# What a person wants to see first: heading, column of the table, format, factor to the heading's unit.
_SHOWN = (
    ("phase", "phase type", "", 1.0),
    ("t [s]", "time [s]", ".2f", 1.0),
    ("smarticles", "smarticles [-]", ".4g", 1.0),
    ("φ", f"phi {_COMPARED} [-]", ".4f", 1.0),
    ("± SE", f"phi {_COMPARED} SE [-]", ".4f", 1.0),
    ("top-percentile", "phi top-percentile [-]", ".4f", 1.0),
    ("voxel", "phi voxel [-]", ".4f", 1.0),
    ("voronoi", "phi voronoi [-]", ".4f", 1.0),
    ("⟨N⟩", "crossings mean [-]", ".2f", 1.0),
    ("z [mm]", "com height [m]", ".2f", 1e3),
    ("peak F/nW", "hook peak force over n W_s [-]", ".3f", 1.0),
    ("hook work [mJ]", "hook work [J]", ".3g", 1e3),
    ("peak F [N]", "peak force [N]", ".3f", 1.0),
    ("strain at it", "strain at the peak [-]", ".3f", 1.0),
    ("at yield", "strain at the yield drop [-]", ".3f", 1.0),
    ("at fracture", "strain at fracture [-]", ".3f", 1.0),
    ("widening", "widening [-]", ".3f", 1.0),
)
# Of single frames only: averaged over the last ones they would say nothing.
_SHOWN_PER_FRAME = (
    ("F [N]", "pulled string force x [N]", ".3f", 1.0),
    ("length [mm]", "chain length [m]", ".1f", 1e3),
    ("width [mm]", "chain width [m]", ".1f", 1e3),
)


def add(commands: Commands) -> None:
    """Add the command."""
    measure = commands.add(
        "measure",
        measure_runs,
        summary="packing fraction, crossings, heights, contacts of runs",
        text="""
Reads VTK frames and HDF5 series of runs that are done, failed or still going on. One row per phase,
averaged over its last frames, with standard errors (SE). φ is given by several definitions, each
named in its column. A phase that pulls a hook or strains a chain has its forces. Of a sweep's
directory, all runs that have frames are measured.""",
        examples="""\
  smarticles measure runs/a
  smarticles measure runs/a runs/b --table phases.csv
  smarticles measure runs/a --frames --table frames.csv     one row per frame
  smarticles measure runs/a --json
""",
    )
    measure.add_argument("directories", nargs="+", type=Path, metavar="DIR", help="runs or sweeps")
    measure.add_argument("--table", type=Path, metavar="FILE.csv", help="write all columns as CSV")
    measure.add_argument("--frames", action="store_true", help="one row per frame, not per phase")
    add_overwrite(measure)
    add_json(measure)


def run_directories(directories: Sequence[Path]) -> list[Path]:
    """Run directories among, or inside, the given ones: a sweep stands for its runs with frames.

    Raises:
        InputError: a sweep has no run with frames yet.
    """
    from templates.sweep.folder import MANIFEST, open_folder  # noqa: PLC0415

    found: list[Path] = []
    for directory in directories:
        if not (directory / MANIFEST).is_file():
            found.append(directory)
            continue
        folder = open_folder(directory)
        runs = [folder.run(entry) for entry in folder.entries]
        begun = [run for run in runs if (run / "frames.pvd").is_file()]
        if not begun:
            msg = f"{directory}: no run of this sweep has frames yet; start them with: smarticles resume {directory}"
            raise InputError(msg)
        found += begun
    return found


def measure_runs(arguments: argparse.Namespace) -> int:
    """`smarticles measure`."""
    import pandas as pd  # noqa: PLC0415

    from dem.record.manifest import read_run  # noqa: PLC0415
    from dem.record.series import lost_series  # noqa: PLC0415
    from postprocess.measures.table import measure_run, summarise_run  # noqa: PLC0415
    from postprocess.report.tables import write_table  # noqa: PLC0415

    output: Path | None = arguments.table
    if output is not None and output.exists() and not arguments.overwrite:
        # Said before measuring, not after.
        msg = f"--table {output}: exists; choose another name or give --overwrite"
        raise InputError(msg)
    measure = measure_run if arguments.frames else summarise_run
    directories = run_directories(arguments.directories)
    for warning in filter(None, (lost_series(read_run(directory)) for directory in directories)):
        print(f"smarticles: warning: {warning}", file=sys.stderr)
    table = pd.concat([measure(directory) for directory in directories], ignore_index=True)
    if output is not None:
        write_table(table, output, overwrite=arguments.overwrite)
    if arguments.json:
        print(json.dumps(_records(table), indent=2, ensure_ascii=False))
        return 0
    shown = _shown(table, per_frame=arguments.frames)
    print(_table(table, shown))
    print(_legend({column for _, column, _, _ in shown}, per_frame=arguments.frames))
    for note in _notes(table):
        print(f"note: {note}")
    if output is not None:
        print(f"{output}: {len(table)} rows, {len(table.columns)} columns")
    return 0


_Shown = tuple[str, str, str, float]


def _shown(table: pd.DataFrame, *, per_frame: bool) -> list[_Shown]:
    """The columns worth showing: of those that a person wants to see, the ones with a value in any row."""
    wanted = _SHOWN + (_SHOWN_PER_FRAME if per_frame else ())
    return [entry for entry in wanted if entry[1] in table.columns and table[entry[1]].notna().any()]


def _notes(table: pd.DataFrame) -> list[str]:
    """What a table shows that a person could take for a result."""
    if "hook work [J]" not in table.columns:
        return []
    notes = []
    for row in table.to_dict("records"):
        where = f"{row['run']}: phase {row['phase']} ({row['phase type']})"
        if row["hook work [J]"] == 0 and row["hook peak force over n W_s [-]"] == 0:
            notes.append(
                f"{where}: nothing touched the hook while it was raised, its force is 0 N throughout; lower "
                "hooks.upper_height_m or raise count"
            )
        if row["hook held fast [-]"] == 1:
            way = 1e3 * row["hook raised at the end [m]"]
            notes.append(f"{where}: force_limit_N stopped the hook after {way:.3g} mm; its peak is a lower bound")
    return notes


def _table(table: pd.DataFrame, shown: Sequence[_Shown]) -> str:
    """The columns to be shown, one block per run under its name."""
    rows = [
        [_cell(value, form, factor) for value, (_, _, form, factor) in zip(row, shown, strict=True)]
        for row in table[[entry[1] for entry in shown]].values.tolist()
    ]
    header, *lines = columns([entry[0] for entry in shown], rows).splitlines()
    told = [header]
    previous = None
    for run, line in zip(table["run"], lines, strict=True):
        if run != previous:
            told.append(f"{run}:")
        told.append(line)
        previous = run
    return "\n".join(told)


def _cell(value: object, form: str, factor: float) -> Cell | str:
    if not isinstance(value, float | int):
        return str(value)
    return Cell(f"{factor * value:{form}}" if math.isfinite(value) else "-")


def _legend(shown: Container[str], *, per_frame: bool) -> str:
    """What the columns that are shown mean, and over what they are averaged."""
    from postprocess.measures.packing import COSTLY_DEFINITIONS, DEFINITIONS  # noqa: PLC0415
    from postprocess.measures.pull import WINDOW  # noqa: PLC0415
    from postprocess.measures.strain import FRACTURE, PEAK, QUANTITIES, WIDENING, YIELD  # noqa: PLC0415
    from postprocess.measures.table import LAST_FRAMES  # noqa: PLC0415

    averaged = f"means over the last {LAST_FRAMES} frames of each phase, SE: their standard error"
    lines = ["one row per frame" if per_frame else averaged]
    if f"phi {_COMPARED} [-]" in shown:
        costly = " and ".join(name for name in DEFINITIONS if name in COSTLY_DEFINITIONS)
        lines[0] += f"; {costly} at the last frame of each phase only"
        lines += [
            f"{'φ by ' if name == _COMPARED else ''}{name}: {'' if name == _COMPARED else 'φ = '}{meaning}"
            for name, meaning in DEFINITIONS.items()
        ]
    if "crossings mean [-]" in shown:
        lines.append(
            "⟨N⟩: links of others through a smarticle's plane; z: height of the centre of mass above the floor"
        )
    if "hook work [J]" in shown:
        lines.append(
            f"peak F/nW: largest mean over {WINDOW:g} s of the force on the hook that is raised, over the weight of "
            "all smarticles; hook work: ∫ F dz over the whole pull"
        )
    if PEAK in shown:
        lines.append(f"peak F: {QUANTITIES[PEAK]}; strain: of the distance along x between the strings' ties")
        lines += [f"at yield: {QUANTITIES[YIELD]}"] if YIELD in shown else []
        lines += [f"at fracture: {QUANTITIES[FRACTURE]}"] if FRACTURE in shown else []
        lines.append(f"widening: {QUANTITIES[WIDENING]}")
    return "\n".join(["", *(part for line in lines for part in wrap(line, _WIDTH, subsequent_indent="  "))])


def _records(table: pd.DataFrame) -> list[dict[str, object]]:
    """Rows as plain data; JSON has no NaN."""
    return [
        {
            str(name): None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in row.items()
        }
        for row in table.to_dict("records")
    ]
