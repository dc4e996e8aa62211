"""Command `measure`: print or write tables of the measures of runs."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Container, Sequence
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING

from dem.errors import InputError
from dem.terminal import redraw, warn
from smarticles.command_line import Cell, Commands, add_options, as_json, columns, names, reject_existing
from smarticles.measuring import grouped, measured, of_phase, sources, usual_jobs

if TYPE_CHECKING:
    import pandas as pd

_COMPARED = "second-highest-com"
_WIDTH = 100  # characters of a terminal
_Column = tuple[str, str, str, float]  #: Heading, column of the full table, number format, unit conversion factor
_ALWAYS = (("phase", "phase type", "", 1.0), ("t [s]", "time [s]", ".2f", 1.0))
# Shown with --frames only, since their means over several frames have no meaning.
_PER_FRAME = (
    ("F [N]", "pulled string force x [N]", ".3f", 1.0),
    ("length [mm]", "chain length [m]", ".1f", 1e3),
    ("width [mm]", "chain width [m]", ".1f", 1e3),
)


def add(commands: Commands) -> None:
    """Add `measure` to the command line."""
    measure = commands.add(
        "measure",
        measure_runs,
        summary="measure packing fraction, crossings, heights and contacts of runs",
        text="""
Reads the frames (VTK) and series (HDF5) of finished, failed and running simulations. The table has one
row per phase: means over the last frames of the phase, with standard errors (SE). The packing
fraction φ is given by several definitions; the column names the definition. Phases with a plate, grips,
a hook or strings have columns for forces. If DIR is a sweep, all its runs with frames are measured, and
CSV and JSON have a column for each variable of the sweep. --by averages over all runs that have
equal values in some columns, for example over seeds. --also adds measures that take long or that few
need: crossing-number, closed-linking, orientation, caging. Tables are kept in the run directories, so
that runs which have not changed are not measured again.""",
        examples="""\
  smarticles measure runs/a
  smarticles measure runs/a runs/b --table phases.csv
  smarticles measure runs/a --frames --table frames.csv     one row per frame
  smarticles measure runs/a --json
  smarticles measure friction --table runs.csv              a sweep: one column per variable
  smarticles measure friction --by friction                 means ± SE over the runs of each value
  smarticles measure friction --by friction --phase last    of the last phase of each run alone
  smarticles measure runs/a --profile profile.csv           φ(r, z) at the end of each phase
  smarticles measure runs/a --also crossing-number,caging   measures on request
""",
    )
    measure.add_argument("directories", nargs="+", type=Path, metavar="DIR", help="runs or sweeps")
    add_options(measure, "--table", help="write all columns as CSV")
    measure.add_argument("--frames", action="store_true", help="one row per frame instead of one per phase")
    measure.add_argument(
        "--by",
        type=names,
        action="extend",
        metavar="NAME,…",
        help="means and SE over runs with equal values in these columns; can be repeated",
    )
    measure.add_argument("--phase", metavar="NAME|last", help="only phases of this type, or the last phase of each run")
    measure.add_argument(
        "--also", type=names, default=(), metavar="NAME,…", help="measures on request, named in the description above"
    )
    profile_help = "write φ(r, z) at the end of each phase, in rings and layers of the container, as CSV"
    measure.add_argument("--profile", type=Path, metavar="FILE.csv", help=profile_help)
    add_options(measure, "--jobs", help="number of processes; default: one per core, fewer where memory is short")
    add_options(measure, "--overwrite", "--json")


def measure_runs(arguments: argparse.Namespace) -> int:
    """Print the measures of runs or write them to files; return the exit status."""
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
        warn(warning)
    jobs = arguments.jobs or usual_jobs(arguments.directories)
    table = measured(
        arguments.directories, frames=arguments.frames, also=arguments.also, jobs=jobs, progress=_Progress()
    )
    if arguments.phase is not None:
        try:
            table = of_phase(table, arguments.phase)
        except InputError as error:
            raise InputError(f"--phase {arguments.phase}: {error}") from None
    if by:
        try:
            table = grouped(table, by)
        except InputError as error:
            raise InputError(f"--by {','.join(by)}: {error}") from None
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


class _Progress:
    """Prints the number of measured runs: continuously on a terminal, else every ten seconds."""

    def __init__(self) -> None:
        self._last = time.monotonic()

    def __call__(self, done: int, runs: int) -> None:
        terminal, now = sys.stderr.isatty(), time.monotonic()
        if runs > 1 and (terminal or now - self._last > 10):
            self._last = now
            text = f"measured {done} of {runs} runs"
            if terminal:
                redraw(text, last=done == runs)
            else:
                print(text, file=sys.stderr, flush=True)


def _groups(arguments: argparse.Namespace) -> Sequence[str]:
    """Return the columns named by --by; empty without --by."""
    if arguments.by is None:
        return ()
    by: Sequence[str] = arguments.by
    if not by:
        raise InputError("--by: names no column; e.g. --by seed, or a variable of the sweep")
    if arguments.frames:
        raise InputError(f"--by {','.join(by)}: averages over phases of runs; leave --frames out")
    return by


def _shown(table: pd.DataFrame, *, per_frame: bool) -> list[_Column]:
    """Return the main columns of the table that have a value in at least one row."""
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
    """Return the printed table: one row per group with `by`, otherwise a block of rows per run."""
    from postprocess.statistics.points import RUNS  # noqa: PLC0415

    named = [*by, RUNS] if by else []
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
    """Return a line of text for each hook that touched nothing, or that was stopped at its force limit."""
    notes = []
    for row in table.to_dict("records") if "hook work [J]" in table.columns else ():
        where = f"{row['run']}: phase {row['phase']} ({row['phase type']})"
        if row["hook work [J]"] == 0 and row["hook peak force over n W_s [-]"] == 0:
            notes.append(
                f"{where}: nothing touched the hook while it was raised, so its force is 0 N; lower "
                "hooks.upper_height_m or raise count"
            )
        if row["hook held fast [-]"] == 1:
            height_mm = 1e3 * row["hook raised at the end [m]"]
            notes.append(
                f"{where}: force_limit_N stopped the hook after {height_mm:.3g} mm; the peak force is a lower bound"
            )
    return notes


def _legend(shown: Container[str], *, per_frame: bool, by: Sequence[str]) -> str:
    """Return the legend below the printed table: what a row is, and what the columns mean.

    `shown` are the printed columns; a row is a frame, or a phase; `by` are columns whose values make groups of runs.
    """
    from postprocess.measures.packing import COSTLY_DEFINITIONS, DEFINITIONS  # noqa: PLC0415
    from postprocess.measures.pull import WINDOW  # noqa: PLC0415
    from postprocess.measures.strain import FRACTURE, PEAK, QUANTITIES, WIDENING, YIELD  # noqa: PLC0415
    from postprocess.measures.table import LAST_FRAMES  # noqa: PLC0415

    averaged = f"means over the last {LAST_FRAMES} frames of each phase; SE: standard error of the mean"
    if by:
        averaged = f"means over runs and over the last {LAST_FRAMES} frames of each; SE: standard error over runs"
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
            "⟨N⟩: mean number of links of others through a smarticle's plane; z: height of the centre of mass "
            "above the floor"
        )
    if "average crossing number mean [-]" in shown:
        lines.append(
            "⟨ACN⟩: average crossing number of a smarticle with all others, half the crossings that are seen from a "
            "random direction"
        )
    if "hook work [J]" in shown:
        lines.append(
            f"peak F/nW: largest running mean ({WINDOW:g} s) of the force on the raised hook, divided by the weight of "
            "all smarticles; hook work: ∫ F dz over the whole pull"
        )
    if PEAK in shown:
        lines.append(
            f"peak F: {QUANTITIES[PEAK]}; strain: of the distance along x between the points where the strings are tied"
        )
        lines += [f"at yield: {QUANTITIES[YIELD]}"] if YIELD in shown else []
        lines += [f"at fracture: {QUANTITIES[FRACTURE]}"] if FRACTURE in shown else []
        lines.append(f"widening: {QUANTITIES[WIDENING]}")
    return "\n".join(["", *(part for line in lines for part in wrap(line, _WIDTH, subsequent_indent="  "))])
