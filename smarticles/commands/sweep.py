"""Command `sweep`: write many scenes from one template, and run them."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from dem.display import duration
from dem.errors import InputError
from dem.record.names import OF_SWEEP
from smarticles import sweeps
from smarticles.command_line import Commands, add_options, columns, positive_int

if TYPE_CHECKING:
    from templates.slurm.submission import Draft
    from templates.sweep.expand import Point
    from templates.sweep.folder import Entry

_FILE_HELP = """
A sweep file describes many scenes by one template and lists of values:

  schema_version: 1
  name: friction
  template: scene.yaml.j2             # a scene with {{ variables }}, beside this file
  run_name: "mu{{ friction }}_seed{{ seed }}"
  constants: {count: 100}             # values shared by all runs
  points:                             # one or several of these; several are combined by their product
    grid: {friction: [0.2, 0.4]}      # every combination
    zip: {a: [1, 2], b: [3, 4]}       # two points: a=1 with b=3, a=2 with b=4
    list: [{c: 1}, {c: 2}]            # explicit points
    table: {file: counts.csv, only: {l_over_w: [0.4, 0.7]}}   # rows of a CSV file
  derived: {half: "(count / 2) | round | int"}
  repeats: {seeds: [1, 2, 3]}         # one run per point and seed; the variable is `seed`
                                      # more: {seeds: [4], only: {friction: [0.2]}} adds seeds to some points
  again: {constants: {engine: yade}, only: {friction: [0.2], seed: [1]}}
                                      # repeats some runs at the end, with other constants

Repeat the command to continue an unfinished sweep, see `smarticles resume --help`."""


def add(commands: Commands) -> None:
    """Add `sweep` to the command line."""
    sweep = commands.add(
        "sweep",
        run_sweep,
        summary="write the scenes of a sweep, and run them with --submit",
        text=_FILE_HELP + "\n" + sweeps.CLUSTER_HELP,
        examples="""\
  smarticles sweep friction.yaml --dry-run
  smarticles sweep friction.yaml --out friction               write the scenes only
  smarticles sweep friction.yaml --out friction --submit local
  smarticles sweep friction.yaml --out friction --to snakemake    write friction/Snakefile as well
  smarticles sweep friction.yaml --out friction --submit slurm --cluster example-large --time 12:00:00
  smarticles sweep friction.yaml --out friction --submit slurm --cluster my-cluster.toml --dry-run
""",
    )
    sweep.add_argument("sweep", type=Path, metavar="SWEEP.yaml", help="sweep file")
    add_options(sweep, "--out", help="directory of the sweep")
    add_options(sweep, "--submit", default="none")
    sweep.add_argument(
        "--to",
        choices=("snakemake", "row"),
        help="write a workflow into DIR, which starts the runs by another tool: Snakemake, or row of signac",
    )
    add_options(sweep, "--dry-run", help="print the runs and the job script or workflow; write nothing")
    sweep.add_argument("--max-points", type=positive_int, metavar="N", help="largest number of runs; default: 10000")
    add_options(sweep, "--engine", help="compute all runs on this engine (sets the constant `engine`)")
    add_options(sweep, "--jobs")
    sweeps.add_cluster_options(sweep)


def run_sweep(arguments: argparse.Namespace) -> int:
    """Expand a sweep file; print, write, compute or submit its runs; return the exit status."""
    from templates.sweep.expand import MAX_POINTS, expand  # noqa: PLC0415
    from templates.sweep.folder import entry_of  # noqa: PLC0415
    from templates.workflow import COMMANDS, TOOLS, workflow, write_workflow  # noqa: PLC0415

    sweep = sweeps.changed_sweep(arguments.sweep, engine=arguments.engine)
    points = expand(sweep, max_points=arguments.max_points or MAX_POINTS)
    for_cluster = sweeps.is_for_cluster(arguments)
    if arguments.to and (for_cluster or arguments.submit != "none"):
        raise InputError(
            f"--to {arguments.to}: leaves the start of the runs to this tool; leave --submit and --cluster out"
        )
    if arguments.out is None and (for_cluster or not arguments.dry_run):
        raise InputError("sweep: --out DIR is missing; give a directory, or --dry-run to only list the runs")
    if for_cluster:
        _check_ranks(points, arguments.ranks)
    expected = [sweeps.expected_wall_s(point.scene) for point in points]
    entries = [entry_of(point, wall) for point, wall in zip(points, expected, strict=True)]
    # Rendered before anything is written, so that a rejected request leaves no files.
    draft = _draft(sweep.content.name, entries, arguments) if for_cluster else None
    if arguments.dry_run:
        print(_listing(points, expected))
        if draft is not None:
            job = f"jobs/{draft.submission.number}"
            print(f"{draft.request.to_text()}\n\n--- {job}/runs.txt\n{draft.run_list}")
            print(f"--- {job}/array.sh\n{draft.script}")
        if arguments.to:
            print(f"\n--- {TOOLS[arguments.to]}\n{workflow(arguments.to, sweep.content.name, entries)}")
        return 0
    folder = sweeps.folder_of(sweep, points, arguments.out, arguments.command_line, expected_s=expected)
    if for_cluster:
        return sweeps.enqueue(folder, arguments)
    if arguments.to:
        written, start = write_workflow(folder, arguments.to), COMMANDS[arguments.to]
        print(f"{written}: {len(points)} runs; start them: cd {shlex.quote(str(folder.path))} && {start}")
        return 0
    if arguments.submit == "none":
        print(f"{folder.path}: {len(points)} runs written; start them: smarticles resume {folder.path}")
        return 0
    return sweeps.complete_here(folder, arguments)


def _check_ranks(points: Sequence[Point], ranks: int | None) -> None:
    if ranks and (serial := {point.scene.engine for point in points} - {"lammps"}):
        raise InputError(
            f"--ranks {ranks}: engine: {', '.join(sorted(serial))} is one process; leave it out, or give "
            "--engine lammps"
        )


def _draft(name: str, entries: Sequence[Entry], arguments: argparse.Namespace) -> Draft:
    """Render the cluster job for the runs of a sweep; write nothing.

    The job has all runs, `entries`. If the directory --out has this sweep already, the job has only the runs that are
    missing and not in the queue, or all runs if there are none of these.
    """
    from templates.slurm.submission import submissions, tasks_of_runs, to_submit  # noqa: PLC0415
    from templates.sweep.folder import open_folder  # noqa: PLC0415

    out: Path = arguments.out
    if (out / OF_SWEEP).exists():
        # If no run is missing, the request of all runs is checked against the limits of the cluster.
        entries = to_submit(open_folder(out), tasks_of_runs(submissions(out))) or entries
    return sweeps.draft_of(out, name, entries, arguments)


def _listing(points: Sequence[Point], expected: Sequence[float]) -> str:
    """Return a table of the runs with their variables and expected wall times [s]."""
    names = list(points[0].values)
    rows = [
        [point.name, *(point.values[name] for name in names), round(wall)]
        for point, wall in zip(points, expected, strict=True)
    ]
    total = f"{len(points)} runs, about {duration(sum(expected))} of one core"
    return f"{columns(['run', *names, 'expected wall s'], rows)}\n{total}"
