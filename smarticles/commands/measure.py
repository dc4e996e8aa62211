"""measure: tables of measures of runs."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Container, Sequence
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING

from dem.errors import InputError
from smarticles.command_line import Cell, Commands, add_shared, as_json, columns, reject_existing
from smarticles.measuring import grouped, measured, sources

if TYPE_CHECKING:
    import pandas as pd

_RUNS = "runs [-]"
_COMPARED = "second-highest-com"
_WIDTH = 100  # characters of a terminal
_Column = tuple[str, str, str, float]  #: Heading, column of the table, format, factor to the unit of the heading
_ALWAYS = (("phase", "phase type", "", 1.0), ("t [s]", "time [s]", ".2f", 1.0))
# Of single frames only: their means over the last ones have no meaning.
_PER_FRAME = (
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
directory, all runs that have frames are measured, and what the sweep varies stands in columns of
its own in CSV and JSON. --by averages over the runs that are alike in a variable, such as seeds.""",
        examples="""\
  smarticles measure runs/a
  smarticles measure runs/a runs/b --table phases.csv
  smarticles measure runs/a --frames --table frames.csv     one row per frame
  smarticles measure runs/a --json
  smarticles measure friction --table runs.csv              of a sweep: its variables are columns
  smarticles measure friction --by friction                 means ± SE over the runs of each value
  smarticles measure runs/a --profile profile.csv           φ(r, z) at the end of each phase
""",
    )
    measure.add_argument("directories", nargs="+", type=Path, metavar="DIR", help="runs or sweeps")
    measure.add_argument("--table", type=Path, metavar="FILE.csv", help="write all columns as CSV")
    measure.add_argument("--frames", action="store_true", help="one row per frame, not per phase")
    measure.add_argument(
        "--by", metavar="NAME,…", help="means over the runs that have the same values of these columns, with their SE"
    )
    measure.add_argument(
        "--profile",
        type=Path,
        metavar="FILE.csv",
        help="write φ(r, z), rings and layers at the end of each phase, as CSV",
    )
    add_shared(measure, "--overwrite", "--json")


def measure_runs(arguments: argparse.Namespace) -> int:
    """Print or write measures."""
    import pandas as pd  # noqa: PLC0415

    from dem.record.run import Run, open_run  # noqa: PLC0415
    from postprocess.measures.profile import profile_table  # noqa: PLC0415
    from postprocess.report.tables import write_table  # noqa: PLC0415

    output: Path | None = arguments.table
    profile: Path | None = arguments.profile
    reject_existing("--table", output, overwrite=arguments.overwrite)
    reject_existing("--profile", profile, overwrite=arguments.overwrite)
    if output is not None and output == profile:
        raise InputError(f"--profile {profile}: is the file of --table too; choose another name")
    by = _groups(arguments)
    directories = list(sources(arguments.directories))
    for warning in filter(None, (open_run(directory).lost_series for directory in directories)):
        print(f"smarticles: warning: {warning}", file=sys.stderr)
    table = measured(arguments.directories, frames=arguments.frames)
    if by:
        try:
            table = grouped(table, by)
        except InputError as error:
            raise InputError(f"--by {arguments.by}: {error}") from None
    if output is not None:
        write_table(table, output, overwrite=arguments.overwrite)
    if profile is not None:
        rings = pd.concat([profile_table(Run(directory)) for directory in directories], ignore_index=True)
        write_table(rings, profile, overwrite=arguments.overwrite)
    if arguments.json:
        print(as_json(table.to_dict("records")))
        return 0
    shown = _shown(table, per_frame=arguments.frames)
    print(_text(table, by, shown))
    print(_legend({column for _, column, _, _ in shown}, per_frame=arguments.frames, by=by))
    for note in () if by else _notes(table):
        print(f"note: {note}")
    if output is not None:
        print(f"{output}: {len(table)} rows, {len(table.columns)} columns")
    if profile is not None:
        print(f"{profile}: φ(r, z), {len(rings)} rows")
    return 0


def _groups(arguments: argparse.Namespace) -> list[str]:
    """Return the columns that --by names."""
    if arguments.by is None:
        return []
    names = [name.strip() for name in arguments.by.split(",") if name.strip()]
    if not names:
        raise InputError(f"--by {arguments.by!r}: names no column; e.g. --by seed, or a variable of the sweep")
    if arguments.frames:
        raise InputError(f"--by {arguments.by}: averages over phases of runs; leave --frames out")
    return names


def _shown(table: pd.DataFrame, *, per_frame: bool) -> list[_Column]:
    """Return the columns of short tables that have a value in any row."""
    from postprocess.measures.registry import shown_quantities  # noqa: PLC0415
    from postprocess.statistics.points import marked  # noqa: PLC0415

    wanted = list(_ALWAYS)
    for quantity, shown in shown_quantities():
        wanted.append((shown.heading, quantity.header, shown.form, shown.factor))
        if shown.with_error:
            wanted.append(("± SE", marked(quantity.header, "SE"), shown.form, shown.factor))
    wanted += _PER_FRAME if per_frame else ()
    return [entry for entry in wanted if entry[1] in table.columns and table[entry[1]].notna().any()]


def _text(table: pd.DataFrame, by: Sequence[str], shown: Sequence[_Column]) -> str:
    """Return the columns to be shown: of each group, or one block per run under its name."""
    named = [*by, _RUNS] if by else []
    rows = [
        [
            *(row[name] for name in named),
            *(
                Cell.of(row[column], form, factor) if isinstance(row[column], float | int) else str(row[column])
                for _, column, form, factor in shown
            ),
        ]
        for row in table.to_dict("records")
    ]
    header = [*by, "runs"] if by else []
    lines = columns([*header, *(heading for heading, *_ in shown)], rows).splitlines()
    if by:
        return "\n".join(lines)
    blocks, previous = [lines[0]], None
    for run, line in zip(table["run"], lines[1:], strict=True):
        blocks += [line] if run == previous else [f"{run}:", line]
        previous = run
    return "\n".join(blocks)


def _notes(table: pd.DataFrame) -> list[str]:
    """Return warnings about values that could be taken for a result."""
    notes = []
    for row in table.to_dict("records") if "hook work [J]" in table.columns else ():
        where = f"{row['run']}: phase {row['phase']} ({row['phase type']})"
        if row["hook work [J]"] == 0 and row["hook peak force over n W_s [-]"] == 0:
            notes.append(
                f"{where}: nothing touched the hook while it was raised, its force is 0 N throughout; lower "
                "hooks.upper_height_m or raise count"
            )
        if row["hook held fast [-]"] == 1:
            way = 1e3 * row["hook raised at the end [m]"]
            notes.append(f"{where}: force_limit_N stopped the hook after {way:.3g} mm, so the peak is a lower bound")
    return notes


def _legend(shown: Container[str], *, per_frame: bool, by: Sequence[str]) -> str:
    """Return the meaning of the columns that are shown, and the frames or runs that they are means over."""
    from postprocess.measures.packing import COSTLY_DEFINITIONS, DEFINITIONS  # noqa: PLC0415
    from postprocess.measures.pull import WINDOW  # noqa: PLC0415
    from postprocess.measures.strain import FRACTURE, PEAK, QUANTITIES, WIDENING, YIELD  # noqa: PLC0415
    from postprocess.measures.table import LAST_FRAMES  # noqa: PLC0415

    averaged = f"means over the last {LAST_FRAMES} frames of each phase, SE: their standard error"
    if by:
        averaged = f"means over runs of their means over the last {LAST_FRAMES} frames, SE: standard error over runs"
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
