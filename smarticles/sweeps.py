"""Create or continue directories of sweeps; compute their runs here or submit them to Slurm."""

from __future__ import annotations

import argparse
import platform
import shlex
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from dem.display import Display, NoDisplay
from dem.errors import InputError, RunError
from smarticles.command_line import Parser, add_options, positive_int

if TYPE_CHECKING:
    from dem.scene.scene import Scene
    from templates.local import Outcome
    from templates.slurm.submission import Draft
    from templates.sweep.expand import Point
    from templates.sweep.folder import Entry, Folder
    from templates.sweep.sweep_file import Sweep

MOST_CAUSES = 5  # of failed runs in an error; more would hide what to do


def make_folder(file: Path, out: Path, command: str) -> Folder:
    """Write the scenes of a sweep file to a directory that may hold this sweep already; return it.

    `command` is for the manifest. InputError if the sweep is not valid, or the directory contains something else.
    """
    from templates.sweep.expand import expand  # noqa: PLC0415

    sweep = changed_sweep(file)
    return folder_of(sweep, expand(sweep), out, command)


def changed_sweep(file: Path, constants: Mapping[str, str] = MappingProxyType({}), engine: str | None = None) -> Sweep:
    """Read a sweep file, and replace some constants and, if given, the engine of all runs."""
    from templates.sweep.sweep_file import load_sweep, on_engine, with_constants  # noqa: PLC0415

    sweep = with_constants(load_sweep(file), constants)
    return sweep if engine is None else on_engine(sweep, engine)


def folder_of(
    sweep: Sweep,
    points: Sequence[Point],
    out: Path,
    command: str,
    *,
    expected_s: Sequence[float] | None = None,
    extend: bool = False,
) -> Folder:
    """Create the directory of an expanded sweep, or open a directory that already holds this sweep.

    `command` makes the directory, for the record. Expected wall times of the points [s] are estimated if they are None.
    With `extend` the missing runs are added to a directory that holds some of these runs and no others.
    """
    from templates.sweep.folder import create_folder  # noqa: PLC0415

    # Versions of the packages that expand a sweep; each run records the versions of its engine.
    packages = ("smarticles", "jinja2", "pydantic", "pyyaml")
    versions = {"python": platform.python_version(), **{name: version(name) for name in packages}}
    if expected_s is None:
        expected_s = [expected_wall_s(point.scene) for point in points]
    return create_folder(out, sweep, points, command=command, versions=versions, expected_s=expected_s, extend=extend)


def expected_wall_s(scene: Scene) -> float:
    """Return the expected wall time of a run [s], with its start, on one core of the machine of the measurements."""
    from dem.plan.outlook import START_S, planned_phases  # noqa: PLC0415

    return START_S + sum(phase.wall_s for phase in planned_phases(scene))


# -- on this machine ---------------------------------------------------------------------------------------------------


def compute(folder: Folder, *, jobs: int | None, command: str, progress: bool = True) -> list[Outcome]:
    """Compute the missing runs of a sweep on this machine.

    After Ctrl-C, the KeyboardInterrupt names `command`, which continues the sweep. `progress`: show what runs and ends.
    """
    from templates.local import SweepDisplay, run_folder  # noqa: PLC0415
    from templates.slurm.submission import reject_queued  # noqa: PLC0415

    reject_queued(folder)
    try:
        return run_folder(folder, SweepDisplay(Display() if progress else NoDisplay()), slots=jobs)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"finished runs are kept; continue with: {command}") from None


def raise_failures(folder: Folder, outcomes: Sequence[Outcome]) -> None:
    """Raise RunError if any outcome is not a finished run; the message lists the first of these and the causes."""
    failed = [outcome for outcome in outcomes if outcome.missing]
    if failed:
        causes = "; ".join(f"{outcome.name}: {outcome.cause}" for outcome in failed[:MOST_CAUSES])
        if len(failed) > MOST_CAUSES:
            causes += f"; {len(failed) - MOST_CAUSES} more, see smarticles status {folder.path}"
        raise RunError(
            f"{folder.path}: {len(failed)} of {len(outcomes)} runs are missing: {causes}; "
            f"logs are in {folder.path / 'logs'}, start them again: smarticles resume {folder.path}"
        )


def complete_here(folder: Folder, arguments: argparse.Namespace) -> int:
    """Compute the missing runs of a sweep here, print the next command, and return the exit status."""
    raise_failures(folder, compute(folder, jobs=arguments.jobs, command=arguments.command_line))
    print(f"{folder.path}: all {len(folder.entries)} runs are done; next: smarticles measure {folder.path}")
    return 0


# -- on a cluster ------------------------------------------------------------------------------------------------------

CLUSTER_HELP = """
With --submit slurm the runs become one array job. Each task computes several runs at once, one core
each. Before the time limit Slurm sends a signal; the runs then stop at a checkpoint, and the task
queues itself again. --submit none with --cluster writes the job script without submitting it. A
cluster is a name that the program knows, or a TOML file. A request that exceeds the limits of the
cluster is rejected before anything is written."""

_OPTIONS = ("cluster", "partition", "account", "time", "runs_per_task", "memory", "ranks")


def add_cluster_options(parser: Parser) -> None:
    """Add --cluster and the options for the resources of its jobs."""
    group = parser.add_argument_group("options for clusters")
    group.add_argument(
        "--cluster", metavar="NAME|FILE.toml", help="name or description of the cluster; needed for --submit slurm"
    )
    group.add_argument("--partition", metavar="NAME", help="default: the cluster's default partition")
    group.add_argument("--account", metavar="NAME", help="default: the account in the cluster's file")
    add_options(
        group, "--time", type=str, metavar="D-HH:MM:SS", help="wall time of a task; default: 3 times the expected time"
    )
    runs_help = "simultaneous runs of one task, one core each; default: all cores of a node"
    group.add_argument("--runs-per-task", type=positive_int, metavar="K", help=runs_help)
    group.add_argument("--memory", type=positive_int, metavar="MIB", help="memory per run [MiB]; default: 1024")
    add_options(group, "--ranks")


def is_for_cluster(arguments: argparse.Namespace, *, allow_ranks: bool = False) -> bool:
    """Return whether the options request a job on a cluster.

    With `allow_ranks`, --ranks is accepted without a cluster, for a single run on this machine. InputError if an option
    for clusters is given without a cluster, or Slurm is not installed here.
    """
    from templates.slurm.submission import require_sbatch  # noqa: PLC0415

    if arguments.submit == "slurm" or (arguments.submit == "none" and arguments.cluster is not None):
        if arguments.submit == "slurm" and not getattr(arguments, "dry_run", False):
            require_sbatch()
        return True
    for name in _OPTIONS:
        if getattr(arguments, name) is not None and not (allow_ranks and name == "ranks"):
            option = f"--{name.replace('_', '-')}"
            raise InputError(f"{option}: is for a cluster; give --submit slurm, or --submit none with --cluster NAME")
    return False


def draft_of(path: Path, name: str, entries: Sequence[Entry], arguments: argparse.Namespace) -> Draft:
    """Plan and render a cluster job for runs of a sweep; write nothing.

    Cluster and options that are not given are those of the latest job in the directory `path`; options hold on the
    cluster that they were given for. InputError if there is no cluster, or the request exceeds limits of the cluster.
    """
    from templates.slurm.cluster import shipped_clusters  # noqa: PLC0415
    from templates.slurm.job import Wishes  # noqa: PLC0415
    from templates.slurm.submission import draft, resolved, submissions  # noqa: PLC0415

    earlier = submissions(path)
    reference = arguments.cluster
    if reference is None:
        if not earlier:
            msg = f"--cluster: is missing; known: {', '.join(shipped_clusters())}; or a file FILE.toml"
            raise InputError(msg)
        reference = earlier[-1].cluster
    wishes = Wishes(
        partition=arguments.partition,
        account=arguments.account,
        time=arguments.time,
        runs_per_task=arguments.runs_per_task,
        memory_mib=arguments.memory,
        ranks=arguments.ranks,
    )
    if earlier and earlier[-1].cluster == resolved(reference):
        wishes = wishes.completed(earlier[-1].wishes)
    return draft(path, name, entries, reference, wishes)


def enqueue(folder: Folder, arguments: argparse.Namespace) -> int:
    """Write a job for runs that are missing and not in the queue; submit the job with --submit slurm."""
    from templates.slurm.submission import submissions, submit, tasks_of_runs, to_submit, write  # noqa: PLC0415

    quoted = shlex.quote(str(folder.path))
    with folder.lock():
        entries = to_submit(folder, tasks_of_runs(submissions(folder.path)))
        if not entries:
            done = sum(folder.is_done(entry) for entry in folder.entries)
            queued = len(folder.entries) - done
            print(f"{folder.path}: nothing to submit: {done} runs are done, {queued} in the queue")
            return 0
        draft = draft_of(folder.path, folder.name, entries, arguments)
        written = write(folder, draft)
        what = f"{len(entries)} of {len(folder.entries)} runs, {draft.request.to_text()}"
        if arguments.submit == "none":
            print(f"{written}: {what}; submit them: cd {quoted} && sbatch {draft.submission.script}")
            return 0
        submission = submit(folder, draft)
    print(f"{folder.path}: job {submission.job_id}: {what}; check it with: smarticles status {quoted}")
    return 0
