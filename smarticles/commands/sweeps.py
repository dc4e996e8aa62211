"""sweep, status, resume: many runs."""

from __future__ import annotations

import argparse
import json
import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from dem.errors import InputError, RunError
from smarticles.commands import queueing
from smarticles.commands import scenes as commands_run
from smarticles.layout import columns
from smarticles.parsing import Commands, Parser, add_json, positive_int

if TYPE_CHECKING:
    from dem.scene.scene import Scene
    from templates.local.local import Outcome
    from templates.slurm.submission import Draft
    from templates.sweep.expand import Point
    from templates.sweep.folder import Folder, RunStatus
    from templates.sweep.sweep import Sweep

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

The same command again takes up where it stopped, see `smarticles resume --help`."""


def add(commands: Commands) -> None:
    """Add the commands."""
    sweep = commands.add(
        "sweep",
        run_sweep,
        summary="make run directories from a template, and start the runs if asked to",
        text=_FILE_HELP + "\n" + queueing.HELP,
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
        "--max-points", type=positive_int, metavar="N", help="refuse a sweep of more runs; default: 10000"
    )
    add_slots(sweep)
    queueing.add_options(sweep)

    status = commands.add(
        "status",
        show_status,
        summary="what is done, running, failed, missing",
        text="""
From the run directories, and from Slurm's queue if the sweep was submitted. A run is `interrupted` when it was told to
stop, `stopped` when it was killed, `queued` when a task of the queue is going to compute it. `simulated s` is how far a
run came, `checkpoint s` from where it would go on.""",
        examples="""\
  smarticles status friction
  smarticles status friction/runs/mu0.2_seed1
  smarticles status friction --json | jq .counts
""",
    )
    status.add_argument("directory", type=Path, metavar="DIR", help="of a sweep, a study or a run")
    add_json(status)

    resume = commands.add(
        "resume",
        resume_sweep,
        summary="go on with a run, or with what a sweep is missing",
        text="""
Finished runs are kept. An unfinished one goes on from its last checkpoint; without a checkpoint, or
when it failed, what it left is renamed to NAME.stopped-1, not deleted, and the run starts anew. With --submit slurm
what is missing and not in the queue becomes a new job, on the cluster of the last one unless --cluster says otherwise.
For a study, give the study's command again: it also makes the tables and figures.""",
        examples="""\
  smarticles resume friction
  smarticles resume friction --jobs 1
  smarticles resume friction --submit slurm
  smarticles resume friction/runs/mu0.2_seed1
""",
    )
    resume.add_argument("directory", type=Path, metavar="DIR", help="of a sweep or a run")
    resume.add_argument(
        "--submit",
        choices=("none", "local", "slurm"),
        default="local",
        help="local: run on this machine (default); slurm: submit a job; none: with --cluster, write its script",
    )
    add_slots(resume)
    queueing.add_options(resume)


def add_slots(parser: Parser) -> None:
    """Add --jobs."""
    parser.add_argument("--jobs", type=positive_int, metavar="N", help="runs at once; default: one per core")


def run_sweep(arguments: argparse.Namespace) -> int:
    """`smarticles sweep`."""
    from templates.slurm.slurm import require_sbatch  # noqa: PLC0415
    from templates.sweep.expand import MAX_POINTS, expand  # noqa: PLC0415
    from templates.sweep.sweep import load_sweep  # noqa: PLC0415

    sweep = load_sweep(arguments.sweep)
    points = expand(sweep, max_points=arguments.max_points or MAX_POINTS)
    queue = queueing.wants_queue(arguments)
    if arguments.dry_run:
        print(_listing(points))
        if queue:
            print(queueing.show(_draft(sweep.content.name, points, arguments)))
        return 0
    if queue:
        if arguments.submit == "slurm":
            require_sbatch()
        # Renders all and throws it away: what is refused is refused before anything is written.
        _draft(sweep.content.name, points, arguments)
    folder = make_folder(arguments.sweep, _place(arguments), arguments.command_line, max_points=arguments.max_points)
    if queue:
        return queueing.enqueue(folder, arguments)
    if arguments.submit == "none":
        print(f"{folder.path}: {len(points)} runs written; start them: smarticles resume {folder.path}")
        return 0
    return _run(folder, arguments)


def _place(arguments: argparse.Namespace) -> Path:
    out: Path | None = arguments.out
    if out is None:
        msg = "sweep: --out DIR is missing; give a directory, or --dry-run to only list the runs"
        raise InputError(msg)
    return out


def _draft(name: str, points: Sequence[Point], arguments: argparse.Namespace) -> Draft:
    """What would be submitted: all runs of a new sweep, what is missing of one that is there."""
    from templates.slurm.submission import submissions, tasks_of_runs, to_submit  # noqa: PLC0415
    from templates.sweep.folder import MANIFEST, Entry, open_folder  # noqa: PLC0415

    out = _place(arguments)
    entries = [
        Entry(
            name=point.name,
            scene_sha256=point.scene_sha256,
            expected_s=expected_wall_s(point.scene),
            values=point.values,
        )
        for point in points
    ]
    if (out / MANIFEST).exists():
        missing = to_submit(open_folder(out), tasks_of_runs(submissions(out)))
        # Nothing to submit: the limits are looked at for all runs.
        entries = missing or entries
    return queueing.draft_of(out, name, entries, arguments)


def make_folder(
    file: Path,
    out: Path,
    command: str,
    constants: Mapping[str, str] | None = None,
    *,
    max_points: int | None = None,
) -> Folder:
    """Expand a sweep file into its directory, or take up the directory that holds it already.

    Args:
        file: sweep file.
        out: directory of the sweep.
        command: the command line, for the manifest.
        constants: values that replace those of the file.
        max_points: how many runs it may have; None: the usual limit.

    Raises:
        InputError: the sweep is not valid, or the directory holds something else.
    """
    from templates.sweep.expand import MAX_POINTS, expand  # noqa: PLC0415
    from templates.sweep.sweep import load_sweep, with_constants  # noqa: PLC0415

    sweep = with_constants(load_sweep(file), constants or {})
    return folder_of(sweep, expand(sweep, max_points=max_points or MAX_POINTS), out, command)


def folder_of(sweep: Sweep, points: Sequence[Point], out: Path, command: str, *, extend: bool = False) -> Folder:
    """The directory of an expanded sweep; see `templates.sweep.folder.create_folder`."""
    from templates.sweep.folder import create_folder  # noqa: PLC0415

    return create_folder(
        out, sweep, points, command=command, versions=versions(), expected_s=expected_wall_s, extend=extend
    )


def versions() -> dict[str, str]:
    """Versions of what expands a sweep; each run records those of what computes it."""
    packages = ("smarticles", "jinja2", "pydantic", "pyyaml")
    return {"python": platform.python_version(), **{name: version(name) for name in packages}}


def expected_wall_s(scene: Scene) -> float:
    """Expected wall time of a scene [s], on a machine like the one the costs were measured on."""
    from dem.plan.outlook import plan  # noqa: PLC0415

    return plan(scene).wall_s


def _listing(points: Sequence[Point]) -> str:
    from templates.local.display import duration  # noqa: PLC0415

    expected = [expected_wall_s(point.scene) for point in points]
    names = list(points[0].values)
    header = ["run", *names, "expected wall s"]
    rows = [
        [point.name, *(point.values[name] for name in names), round(wall)]
        for point, wall in zip(points, expected, strict=True)
    ]
    total = f"{len(points)} runs, about {duration(sum(expected))} of one core"
    return f"{columns(header, rows)}\n{total}"


def show_status(arguments: argparse.Namespace) -> int:
    """`smarticles status`."""
    from dem.record.rundir import in_use  # noqa: PLC0415
    from templates.sweep.folder import MANIFEST, count_states, open_folder, run_status  # noqa: PLC0415

    directory: Path = arguments.directory
    queue: dict[str, object] | None = None
    if (directory / "run.json").is_file() and not (directory / MANIFEST).exists():
        runs = [run_status(directory, active=in_use(directory))]
        name = directory.name
    else:
        folder = open_folder(directory)
        runs, name = folder.status(), folder.name
        runs, queue = _with_queue(runs, directory)
    counts = count_states(runs)
    if arguments.json:
        content: Mapping[str, object] = {
            "directory": str(directory),
            "name": name,
            "counts": counts,
            "queue": queue,
            "runs": [run.to_dict() for run in runs],
        }
        print(json.dumps(content, indent=2, ensure_ascii=False))
        return 0
    print(_status_table(runs))
    if queue is not None and queue["error"]:
        print(f"{queue['error']}; the states are those of the run directories alone")
    print(f"{name}: {len(runs)} runs, " + ", ".join(f"{n} {state}" for state, n in counts.items()))
    return 0


def _with_queue(runs: list[RunStatus], directory: Path) -> tuple[list[RunStatus], dict[str, object] | None]:
    """States with what the queue says, and how that went; None where nothing was submitted."""
    from templates.slurm.slurm import QueueError  # noqa: PLC0415
    from templates.slurm.submission import merged, plain, submissions, tasks_of_runs  # noqa: PLC0415

    found = submissions(directory)
    if not found:
        return runs, None
    jobs = [one.job_id for one in found if one.job_id is not None]
    try:
        tasks = tasks_of_runs(found)
    except QueueError as error:
        return runs, {"jobs": jobs, "error": str(error), "tasks": {}}
    return [merged(run, tasks.get(run.name)) for run in runs], {"jobs": jobs, "error": None, "tasks": plain(tasks)}


_ENDED_EARLY = ("failed", "interrupted", "stopped")


def _status_table(runs: Sequence[RunStatus]) -> str:
    header = ["run", "state", "phase", "simulated s", "wall s", "cause"]
    rows = [[run.name, run.state, run.phase or "", run.time_s, run.wall_s, run.cause or ""] for run in runs]
    if any(run.state in _ENDED_EARLY for run in runs):
        # What was computed after it is computed again.
        header.insert(4, "checkpoint s")
        for row, run in zip(rows, runs, strict=True):
            row.insert(4, run.checkpoint_s if run.state in _ENDED_EARLY else None)
    if any(run.job for run in runs):
        header.insert(2, "job")
        for row, run in zip(rows, runs, strict=True):
            row.insert(2, run.job or "")
    return columns(header, rows)


def resume_sweep(arguments: argparse.Namespace) -> int:
    """`smarticles resume`."""
    from templates.slurm.slurm import require_sbatch  # noqa: PLC0415
    from templates.sweep.folder import open_folder  # noqa: PLC0415

    directory: Path = arguments.directory
    queue = queueing.wants_queue(arguments)
    if (directory / "run.json").is_file():
        if queue:
            msg = f"{directory}: is one run; give the directory of its sweep to submit it, or leave --submit out"
            raise InputError(msg)
        return commands_run.compute(directory / "scene.yaml", directory, arguments, resume=True)
    folder = open_folder(directory)
    if queue:
        if arguments.submit == "slurm":
            require_sbatch()
        return queueing.enqueue(folder, arguments)
    if arguments.submit == "none":
        msg = "--submit none: needs --cluster NAME, for which the script is written; see `smarticles resume --help`"
        raise InputError(msg)
    return _run(folder, arguments)


def _run(folder: Folder, arguments: argparse.Namespace) -> int:
    outcomes = compute(folder, arguments)
    refuse_failures(folder, outcomes)
    print(f"{folder.path}: all {len(outcomes)} runs are done; next: smarticles measure {folder.path}")
    return 0


def compute(folder: Folder, arguments: argparse.Namespace) -> list[Outcome]:
    """Run what a sweep is missing, and show how it goes.

    Raises:
        InputError: runs of the sweep are in a queue.
        KeyboardInterrupt: Ctrl-C; the message says how to go on.
    """
    from rich.console import Console  # noqa: PLC0415

    from templates.local.display import display_for  # noqa: PLC0415
    from templates.local.local import run_folder  # noqa: PLC0415
    from templates.slurm.submission import refuse_queued  # noqa: PLC0415

    refuse_queued(folder)
    try:
        return run_folder(folder, display_for(Console(stderr=True)), slots=arguments.jobs)
    except KeyboardInterrupt:
        msg = f"finished runs are kept; go on with: {arguments.command_line}"
        raise KeyboardInterrupt(msg) from None


def refuse_failures(folder: Folder, outcomes: Sequence[Outcome]) -> None:
    """Say what is missing, if anything is.

    Raises:
        RunError: a run failed.
    """
    failed = [outcome for outcome in outcomes if outcome.missing]
    if failed:
        causes = "; ".join(f"{outcome.name}: {outcome.cause}" for outcome in failed)
        msg = (
            f"{folder.path}: {len(failed)} of {len(outcomes)} runs are missing: {causes}; "
            f"logs are in {folder.path / 'logs'}, start them again: smarticles resume {folder.path}"
        )
        raise RunError(msg)
