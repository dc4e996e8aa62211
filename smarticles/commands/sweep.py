"""sweep: many scenes from one template."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from dem.errors import InputError
from dem.record.names import OF_SWEEP
from smarticles import sweeps
from smarticles.command_line import Commands, add_engine, add_shared, columns, positive_int

if TYPE_CHECKING:
    from templates.slurm.submission import Draft
    from templates.sweep.expand import Point

_FILE_HELP = """
A sweep file makes many scenes from one template:

  schema_version: 1
  name: friction
  template: scene.yaml.j2             # a scene with {{ variables }}, beside this file
  run_name: "mu{{ friction }}_seed{{ seed }}"
  constants: {count: 100}             # the same in every run
  points:                             # any of these; several are crossed with each other
    grid: {friction: [0.2, 0.4]}      # every combination
    zip: {a: [1, 2], b: [3, 4]}       # first with first, second with second
    list: [{c: 1}, {c: 2}]            # written out
    table: {file: counts.csv, only: {l_over_w: [0.4, 0.7]}}   # rows of a CSV file
  derived: {half: "(count / 2) | round | int"}
  repeats: {seeds: [1, 2, 3]}         # each point once per seed; the variable is `seed`
                                      # more: {seeds: [4], only: {friction: [0.2]}} gives some points more
  again: {constants: {engine: yade}, only: {friction: [0.2], seed: [1]}}
                                      # some of these runs once more, last, with other constants

The same command again takes up where it stopped, see `smarticles resume --help`."""


def add(commands: Commands) -> None:
    """Add the command."""
    sweep = commands.add(
        "sweep",
        run_sweep,
        summary="make run directories from a template, and start the runs if asked to",
        text=_FILE_HELP + "\n" + sweeps.CLUSTER_HELP,
        examples="""\
  smarticles sweep friction.yaml --dry-run
  smarticles sweep friction.yaml --out friction               write the scenes, start nothing
  smarticles sweep friction.yaml --out friction --submit local
  smarticles sweep friction.yaml --out friction --submit slurm --cluster example-large --time 12:00:00
  smarticles sweep friction.yaml --out friction --submit slurm --cluster my-cluster.toml --dry-run
""",
    )
    sweep.add_argument("sweep", type=Path, metavar="SWEEP.yaml", help="sweep file")
    sweep.add_argument("--out", type=Path, metavar="DIR", help="directory of the sweep")
    sweep.add_argument(
        "--submit",
        choices=("none", "local", "slurm"),
        default="none",
        help="none: only write (default); local: run on this machine, one run per core; slurm: as a job on a cluster",
    )
    sweep.add_argument("--dry-run", action="store_true", help="list the runs and show the job script, write nothing")
    sweep.add_argument(
        "--max-points", type=positive_int, metavar="N", help="reject a sweep of more runs; default: 10000"
    )
    add_engine(sweep, "all runs on this engine: its constant `engine` is set to it")
    add_shared(sweep, "--jobs")
    sweeps.add_cluster_options(sweep)


def run_sweep(arguments: argparse.Namespace) -> int:
    """Expand a sweep; list, write, run or submit its runs."""
    from templates.sweep.expand import MAX_POINTS, expand  # noqa: PLC0415

    sweep = sweeps.changed_sweep(arguments.sweep, engine=arguments.engine)
    points = expand(sweep, max_points=arguments.max_points or MAX_POINTS)
    queue = sweeps.wants_queue(arguments)
    # Rendered before anything is written, so that a request which is rejected leaves nothing behind.
    draft = _draft(sweep.content.name, points, arguments) if queue else None
    if arguments.dry_run:
        print(_listing(points))
        if draft is not None:
            place = f"jobs/{draft.submission.number}"
            print(f"{draft.request.to_text()}\n\n--- {place}/runs.txt\n{draft.run_list}")
            print(f"--- {place}/array.sh\n{draft.script}")
        return 0
    folder = sweeps.folder_of(sweep, points, _place(arguments), arguments.command_line)
    if queue:
        return sweeps.enqueue(folder, arguments)
    if arguments.submit == "none":
        print(f"{folder.path}: {len(points)} runs written; start them: smarticles resume {folder.path}")
        return 0
    return sweeps.complete_here(folder, arguments)


def _place(arguments: argparse.Namespace) -> Path:
    out: Path | None = arguments.out
    if out is None:
        raise InputError("sweep: --out DIR is missing; give a directory, or --dry-run to only list the runs")
    return out


def _draft(name: str, points: Sequence[Point], arguments: argparse.Namespace) -> Draft:
    """Render the submission of all runs of a new sweep, or of what is missing of one that is there."""
    from templates.slurm.submission import submissions, tasks_of_runs, to_submit  # noqa: PLC0415
    from templates.sweep.folder import entry_of, open_folder  # noqa: PLC0415

    out = _place(arguments)
    if arguments.ranks and (others := {point.scene.engine for point in points} - {"lammps"}):
        raise InputError(
            f"--ranks {arguments.ranks}: engine: {', '.join(sorted(others))} is one process; leave it out, or give "
            "--engine lammps"
        )
    entries = [entry_of(point, sweeps.expected_wall_s(point.scene)) for point in points]
    if (out / OF_SWEEP).exists():
        # Where nothing is missing, the limits are checked for all runs.
        entries = to_submit(open_folder(out), tasks_of_runs(submissions(out))) or entries
    return sweeps.draft_of(out, name, entries, arguments)


def _listing(points: Sequence[Point]) -> str:
    from templates.local import duration  # noqa: PLC0415

    expected = [sweeps.expected_wall_s(point.scene) for point in points]
    names = list(points[0].values)
    rows = [
        [point.name, *(point.values[name] for name in names), round(wall)]
        for point, wall in zip(points, expected, strict=True)
    ]
    total = f"{len(points)} runs, about {duration(sum(expected))} of one core"
    return f"{columns(['run', *names, 'expected wall s'], rows)}\n{total}"
