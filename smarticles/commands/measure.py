"""Command `measure`: print or write tables of the measures of runs."""

from __future__ import annotations

import argparse
from collections.abc import Collection, Sequence
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING

from dem.display import progress_of
from dem.errors import InputError
from dem.terminal import text_width, warn
from smarticles.command_line import Cell, Commands, add_options, as_json, column_blocks, names, reject_existing
from smarticles.measuring import DONE, STATE, group_columns, grouped, measured, of_phase, sources, states, usual_jobs

if TYPE_CHECKING:
    import pandas as pd

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
CSV and JSON have a column for each variable of the sweep and one for the state of the run. --by averages
over all finished runs that have equal values in some columns, for example over seeds. --also adds measures
that take long or that few need: crossing-number, closed-linking, orientation, caging. Tables are kept in
the run directories, so that runs which have not changed are not measured again.""",
        examples="""\
  smarticles measure runs/a
  smarticles measure runs/a runs/b --table phases.csv
  smarticles measure runs/a --frames --table frames.csv     one row per frame
  smarticles measure runs/a --json
  smarticles measure friction --table runs.csv              a sweep: one column per variable
  smarticles measure friction --by friction                 means ± SE over the runs of each value
  smarticles measure friction --by friction --phase last    of the last phase of each run alone
  smarticles measure runs/a --profile profile.csv           φ(r, z) at the end of each phase
  smarticles measure runs/a --also crossing-number,caging   further measures
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
    measure.add_argument("--unfinished", action="store_true", help="with --by: average over unfinished runs too")
    measure.add_argument("--phase", metavar="NAME|last", help="only phases of this type, or the last phase of each run")
    measure.add_argument(
        "--also",
        type=names,
        default=(),
        metavar="NAME,…",
        help="further measures, named in the description above; with --frames for every frame",
    )
    profile_help = "write φ(r, z) of smarticles at the end of each phase, in rings and layers of the container, as CSV"
    measure.add_argument("--profile", type=Path, metavar="FILE.csv", help=profile_help)
    add_options(measure, "--jobs", help="number of processes; default: one per core, fewer where memory is short")
    add_options(measure, "--overwrite", "--json")


def measure_runs(arguments: argparse.Namespace) -> int:
    """Print the measures of runs or write them to files; return the exit status."""
    import pandas as pd  # noqa: PLC0415

    from dem.record.run import Run, open_run  # noqa: PLC0415
    from postprocess.measures.pile import POUR  # noqa: PLC0415
    from postprocess.measures.profile import profile_table, reject_without_profile  # noqa: PLC0415
    from postprocess.report.tables import write_table  # noqa: PLC0415

    output: Path | None = arguments.table
    profile: Path | None = arguments.profile
    reject_existing("--table", output, overwrite=arguments.overwrite)
    reject_existing("--profile", profile, overwrite=arguments.overwrite)
    if output is not None and output == profile:
        raise InputError(f"--profile {profile}: is the file of --table too; choose another name")
    by = _groups(arguments)
    directories = list(sources(arguments.directories))
    if profile is not None:
        for directory in directories:
            reject_without_profile(Run(directory))
    for warning in filter(None, (open_run(directory).lost_series for directory in directories)):
        warn(warning)
    jobs = arguments.jobs or usual_jobs(arguments.directories)
    with progress_of("measuring") as progress:
        table = measured(
            arguments.directories, frames=arguments.frames, also=arguments.also, jobs=jobs, progress=progress
        )
    runs, without = states(arguments.directories) if by else None, [] if arguments.json else _without_frames(table)
    table = _selected(table, arguments, by, runs)
    if output is not None:
        write_table(table, output, overwrite=arguments.overwrite)
    if profile is not None:
        rings = pd.concat([profile_table(Run(directory)) for directory in directories], ignore_index=True)
        write_table(rings, profile, overwrite=arguments.overwrite)
    if arguments.json:
        print(as_json(table.to_dict("records")))
        return 0
    shown = _shown(table, per_frame=arguments.frames, also=arguments.also, errors=bool(by))
    print(_text(table, by, shown))
    poured = bool((table["phase type"] == POUR).any())
    print(_legend({column for _, column, _, _ in shown}, per_frame=arguments.frames, by=by, poured=poured))
    notes = _notes(table) if runs is None else _left_out(runs, unfinished=arguments.unfinished)
    for note in [*_without_values(table, arguments.also), *notes, *without]:
        print(f"note: {note}")
    if output is not None:
        print(f"{output}: {len(table)} rows, {len(table.columns)} columns")
    if profile is not None:
        print(f"{profile}: φ(r, z), {len(rings)} rows")
    return 0


def _selected(
    table: pd.DataFrame, arguments: argparse.Namespace, by: Sequence[str], runs: pd.DataFrame | None
) -> pd.DataFrame:
    """Return the rows of the phases of --phase, averaged over runs with --by."""
    option = f"--phase {arguments.phase}"
    try:
        if arguments.phase is not None:
            table = of_phase(table, arguments.phase)
        option = f"--by {','.join(by)}"
        return grouped(table, by, runs=runs, unfinished=arguments.unfinished) if by else table
    except InputError as error:
        raise InputError(f"{option}: {error}") from None


def _groups(arguments: argparse.Namespace) -> Sequence[str]:
    """Return the columns named by --by; empty without --by."""
    if arguments.by is None:
        if arguments.unfinished:
            raise InputError("--unfinished: is for means over runs, which --by makes; without it all runs are listed")
        return ()
    by: Sequence[str] = arguments.by
    if not by:
        raise InputError("--by: names no column; e.g. --by seed, or a variable of the sweep")
    if arguments.frames:
        raise InputError(f"--by {','.join(by)}: averages over phases of runs; leave --frames out")
    return by


def _shown(table: pd.DataFrame, *, per_frame: bool, also: Collection[str], errors: bool) -> list[_Column]:
    """Return the main columns of the table that have a value in at least one row.

    The columns of the measures `also` are among them. With `errors` each has its standard error beside it, unless
    this is 0 in all rows.
    """
    from postprocess.measures.registry import shown_quantities  # noqa: PLC0415
    from postprocess.statistics.points import counted, marked  # noqa: PLC0415

    wanted = list(_ALWAYS)
    for quantity, shown in shown_quantities(also):
        wanted.append((shown.heading, quantity.header, shown.form, shown.factor))
        error = marked(quantity.header, "SE")
        if shown.with_error or (errors and error in table.columns and (table[error] > 0).any()):
            wanted.append(("± SE", error, shown.form, shown.factor))
        wanted.append(("n", counted(quantity.header), ".0f", 1.0))
    wanted += _PER_FRAME if per_frame else ()
    return [entry for entry in wanted if entry[1] in table.columns and table[entry[1]].notna().any()]


def _text(table: pd.DataFrame, by: Sequence[str], shown: Sequence[_Column]) -> str:
    """Return the printed table: one row per group with `by`, otherwise a block of rows per run."""
    from postprocess.statistics.points import RUNS  # noqa: PLC0415

    named = group_columns(table, by) if by else []
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
    header = ["runs" if name == RUNS else name for name in named]
    keys = len(named) + sum(column in _ALWAYS for column in shown)
    blocks = column_blocks([*header, *(heading for heading, *_ in shown)], rows, keys=keys)
    return "\n\n".join("\n".join(block if by else _with_names(block, table)) for block in blocks)


def _with_names(lines: Sequence[str], table: pd.DataFrame) -> list[str]:
    """Insert the name of each run, and its state if it is unfinished, before its rows into the lines of `table`."""
    named, previous = [lines[0]], None
    for run, state, line in zip(table["run"], table[STATE], lines[1:], strict=True):
        title = f"{run}:" if state == DONE else f"{run} ({state}):"
        named += [line] if run == previous else [title, line]
        previous = run
    return named


def _notes(table: pd.DataFrame) -> list[str]:
    """Return notes on rows of phases.

    There is a line for each pour without a frame of the settled pile, and for each hook that touched nothing, or that
    was stopped at its force limit.
    """
    from postprocess.measures.pile import POUR  # noqa: PLC0415

    notes = []
    for row in table.to_dict("records"):
        where = f"{row['run']}: phase {row['phase']} ({row['phase type']})"
        if row.get("frames averaged") == 0 and row["phase type"] == POUR:
            remedy = "run it anew" if row[STATE] == DONE else "wait for the run, or resume it"
            notes.append(f"{where}: no frame has the settled pile, so that there are no means of the pour; {remedy}")
        if "hook work [J]" not in table.columns:
            continue
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


def _without_frames(table: pd.DataFrame) -> list[str]:
    """Return a note for each phase of finished runs that took time and has no frame; older versions wrote none."""
    from dem.record.run import Run  # noqa: PLC0415

    found: dict[tuple[int, str], list[Path]] = {}
    for name in table["run"][table[STATE] == DONE].unique():
        run = Run(Path(str(name)))
        frames = run.frames
        for phase in run.phases:
            lasted = (phase.end_s or 0.0) - (phase.start_s or 0.0)
            # A phase of one time step, such as place, hardly changes the pile.
            if lasted > 2 * run.manifest.time_step_s and not frames.in_phase(phase.index):
                found.setdefault((phase.index, phase.type), []).append(run.path)
    return [
        f"{runs[0]}{f' and {len(runs) - 1} more' if runs[1:] else ''}: phase {index} ({kind}) has no frame, and so "
        "no means; run it anew, since each phase ends with a frame"
        for (index, kind), runs in sorted(found.items())
    ]


def _without_values(table: pd.DataFrame, also: Collection[str]) -> list[str]:
    """Return a note for each measure of `also` that does not apply to any run of the table."""
    from postprocess.measures.registry import registered  # noqa: PLC0415

    columns_of = {m.name: [quantity.header for quantity in m.quantities] for m in registered() if m.name in also}
    return [
        f"--also {name}: this measure does not apply to these runs"
        for name, headers in columns_of.items()
        if not any(header in table.columns and table[header].notna().any() for header in headers)
    ]


def _left_out(runs: pd.DataFrame, *, unfinished: bool) -> list[str]:
    """Return a note on unfinished runs of a table of `states`; none if all runs are finished."""
    done = int((runs[STATE] == DONE).sum())
    if done == len(runs):
        return []
    others = ", ".join(f"{number} {state}" for state, number in runs[STATE].value_counts().items() if state != DONE)
    means = "means include those that have frames" if unfinished else "means leave them out; --unfinished includes them"
    return [f"{done} of {len(runs)} runs are finished, {others}; {means}"]


def _legend(shown: Collection[str], *, per_frame: bool, by: Sequence[str], poured: bool) -> str:
    """Return the legend below the printed table: what a row is, and what the columns mean.

    `shown` are the printed columns; a row is a frame, or a phase; `by` are columns whose values make groups of runs;
    `poured`: whether there are rows of pours.
    """
    from postprocess.measures.packing import COSTLY_DEFINITIONS, DEFINITIONS, HEADINGS  # noqa: PLC0415
    from postprocess.measures.pull import WINDOW  # noqa: PLC0415
    from postprocess.measures.strain import FRACTURE, PEAK, QUANTITIES, WIDENING, YIELD  # noqa: PLC0415
    from postprocess.measures.table import LAST_FRAMES  # noqa: PLC0415
    from postprocess.statistics.points import counted  # noqa: PLC0415

    averaged, error = f"means over the last {LAST_FRAMES} frames of each phase", "of the mean"
    if by:
        averaged, error = f"means over runs and over the last {LAST_FRAMES} frames of each", "over runs"
    if any(column.rpartition(" [")[0].endswith(" SE") for column in shown):
        averaged += f"; SE: standard error {error}"
    if poured and not per_frame:
        averaged += "; of a pour, frames of the settled pile alone"
    lines = ["one row per frame" if per_frame else averaged]
    definitions = {name: meaning for name, meaning in DEFINITIONS.items() if f"phi {name} [-]" in shown}
    if costly := " and ".join(HEADINGS[name] for name in definitions if name in COSTLY_DEFINITIONS):
        lines[0] += f"; {costly} at the last frame of each phase only"
    if any(counted(column) in shown for column in shown):
        lines.append("n: number of values in the mean to its left, where it is not defined in all runs")
    lines += [f"{HEADINGS[name]} ({name}): {meaning}" for name, meaning in definitions.items()]
    if "crossings mean [-]" in shown:
        lines.append("⟨N⟩: mean number of links of others through a smarticle's plane")
    if "com height [m]" in shown:
        lines.append("z: height of the centre of mass above the floor")
    if "average crossing number mean [-]" in shown:
        lines.append(
            "⟨ACN⟩: average crossing number of a smarticle with all others, half the crossings that are seen from a "
            "random direction"
        )
    if "hook work [J]" in shown:
        lines.append(
            f"peak F/nW: largest running mean ({WINDOW:g} s) of the force on the raised hook, divided by the weight of "
            "all smarticles; lower F/nW: upward force of the pile on the lower hook at that time; hook work: "
            "∫ F dz over the whole pull"
        )
    if "peak pull over n W_s [-]" in shown:
        lines.append(
            f"peak F/nW: largest running mean ({WINDOW:g} s) of the force that holds back the moving grip, divided by "
            "the weight of all bodies; resting F/nW: the pull on the other grip at that time"
        )
    if "picked up [smarticles]" in shown:
        lines.append("picked up: what the grip bears, gripped bodies included")
    if PEAK in shown:
        lines.append(
            f"peak F: {QUANTITIES[PEAK]}; strain: of the distance along x between the points where the strings are tied"
        )
        lines += [f"at yield: {QUANTITIES[YIELD]}"] if YIELD in shown else []
        lines += [f"at fracture: {QUANTITIES[FRACTURE]}"] if FRACTURE in shown else []
        lines.append(f"widening: {QUANTITIES[WIDENING]}")
    return "\n".join(["", *(part for line in lines for part in wrap(line, text_width(), subsequent_indent="  "))])
