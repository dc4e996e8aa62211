"""Directories of sweeps as commands take them: made or taken up, computed here, or given to a batch system."""

from __future__ import annotations

import argparse
import platform
import shlex
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from dem.errors import InputError, RunError
from smarticles.command_line import Parser, add_ranks, positive_int

if TYPE_CHECKING:
    from dem.scene.scene import Scene
    from templates.local import Outcome
    from templates.slurm.submission import Draft
    from templates.sweep.expand import Point
    from templates.sweep.folder import Entry, Folder
    from templates.sweep.sweep_file import Sweep


def make_folder(file: Path, out: Path, command: str) -> Folder:
    """Expand a sweep file into its directory, or take up the directory that holds it already."""
    from templates.sweep.expand import expand  # noqa: PLC0415

    sweep = changed_sweep(file)
    return folder_of(sweep, expand(sweep), out, command)


def changed_sweep(file: Path, constants: Mapping[str, str] = MappingProxyType({}), engine: str | None = None) -> Sweep:
    """Read a sweep file; replace some of its constants, and the engine of all its runs."""
    from templates.sweep.sweep_file import load_sweep, on_engine, with_constants  # noqa: PLC0415

    sweep = with_constants(load_sweep(file), constants)
    return sweep if engine is None else on_engine(sweep, engine)


def folder_of(sweep: Sweep, points: Sequence[Point], out: Path, command: str, *, extend: bool = False) -> Folder:
    """Make or take up the directory of an expanded sweep, see `templates.sweep.folder.create_folder`."""
    from templates.sweep.folder import create_folder  # noqa: PLC0415

    # Versions of what expands a sweep; each run records those of what computes it.
    packages = ("smarticles", "jinja2", "pydantic", "pyyaml")
    versions = {"python": platform.python_version(), **{name: version(name) for name in packages}}
    return create_folder(
        out, sweep, points, command=command, versions=versions, expected_s=expected_wall_s, extend=extend
    )


def expected_wall_s(scene: Scene) -> float:
    """Return the expected wall time of a scene [s], on a machine like the one the costs were measured on."""
    from dem.plan.outlook import plan  # noqa: PLC0415

    return plan(scene).wall_s


# -- on this machine ---------------------------------------------------------------------------------------------------


def compute(folder: Folder, *, jobs: int | None, command: str) -> list[Outcome]:
    """Run what a sweep is missing, `jobs` runs at once; `command` goes on after Ctrl-C.

    Raises:
        InputError: runs of the sweep are in a queue.
        KeyboardInterrupt: Ctrl-C; the message says how to go on.
    """
    from rich.console import Console  # noqa: PLC0415

    from templates.local import Display, run_folder  # noqa: PLC0415
    from templates.slurm.submission import reject_queued  # noqa: PLC0415

    reject_queued(folder)
    try:
        return run_folder(folder, Display(Console(stderr=True)), slots=jobs)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"finished runs are kept; go on with: {command}") from None


def raise_failures(folder: Folder, outcomes: Sequence[Outcome]) -> None:
    """Raise if runs are missing."""
    failed = [outcome for outcome in outcomes if outcome.missing]
    if failed:
        causes = "; ".join(f"{outcome.name}: {outcome.cause}" for outcome in failed)
        raise RunError(
            f"{folder.path}: {len(failed)} of {len(outcomes)} runs are missing: {causes}; "
            f"logs are in {folder.path / 'logs'}, start them again: smarticles resume {folder.path}"
        )


def complete_here(folder: Folder, arguments: argparse.Namespace) -> int:
    """Run what a sweep is missing, for a command with --jobs, and print what comes next."""
    raise_failures(folder, compute(folder, jobs=arguments.jobs, command=arguments.command_line))
    print(f"{folder.path}: all {len(folder.entries)} runs are done; next: smarticles measure {folder.path}")
    return 0


# -- on a cluster ------------------------------------------------------------------------------------------------------

CLUSTER_HELP = """
With --submit slurm the runs become one array job: each task computes several runs at once, one core
each, and gets a signal before its time limit; its runs then end at a checkpoint and the task
queues itself again. --submit none with --cluster writes the same scripts, for sbatch by hand. A
cluster is known by name or described in a TOML file of yours; what it cannot give is rejected before
anything is written."""

_OPTIONS = ("cluster", "partition", "account", "time", "runs_per_task", "memory", "ranks")


def add_cluster_options(parser: Parser) -> None:
    """Add --cluster and what can be asked of one."""
    group = parser.add_argument_group("for a cluster")
    group.add_argument("--cluster", metavar="NAME|FILE.toml", help="the cluster; needed for --submit slurm")
    group.add_argument("--partition", metavar="NAME", help="default: the cluster's default partition")
    group.add_argument("--account", metavar="NAME", help="default: that of the cluster's file")
    group.add_argument(
        "--time", metavar="D-HH:MM:SS", help="wall time of a task; default: three times what is expected"
    )
    group.add_argument(
        "--runs-per-task",
        type=positive_int,
        metavar="K",
        help="runs side by side in one task, one core each; default: a full node",
    )
    group.add_argument("--memory", type=positive_int, metavar="MIB", help="memory per run [MiB]; default: 1024")
    add_ranks(group, "1, or what a run to be resumed began with")


def wants_queue(arguments: argparse.Namespace, *, one_run: bool = False) -> bool:
    """Return whether the runs are for a cluster; one run may have ranks here too.

    Raises:
        InputError: an option for a cluster is given although they are not, or there is no Slurm here to submit to.
    """
    from templates.slurm.submission import require_sbatch  # noqa: PLC0415

    if arguments.submit == "slurm" or (arguments.submit == "none" and arguments.cluster is not None):
        if arguments.submit == "slurm" and not getattr(arguments, "dry_run", False):
            require_sbatch()
        return True
    for name in _OPTIONS:
        if getattr(arguments, name) is not None and not (one_run and name == "ranks"):
            option = f"--{name.replace('_', '-')}"
            raise InputError(f"{option}: is for a cluster; give --submit slurm, or --submit none with --cluster NAME")
    return False


def draft_of(path: Path, name: str, entries: Sequence[Entry], arguments: argparse.Namespace) -> Draft:
    """Render a submission of some runs as a command asks for it, see `templates.slurm.submission.draft`."""
    from templates.slurm.cluster import shipped_clusters  # noqa: PLC0415
    from templates.slurm.job import Wishes  # noqa: PLC0415
    from templates.slurm.submission import draft, submissions  # noqa: PLC0415

    reference = arguments.cluster
    if reference is None:
        before = submissions(path)
        if not before:
            msg = f"--cluster: is missing; known: {', '.join(shipped_clusters())}; or a file of your own, FILE.toml"
            raise InputError(msg)
        reference = before[-1].cluster
    wishes = Wishes(
        partition=arguments.partition,
        account=arguments.account,
        time=arguments.time,
        runs_per_task=arguments.runs_per_task,
        memory_mib=arguments.memory,
        ranks=arguments.ranks,
    )
    return draft(path, name, entries, reference, wishes)


def enqueue(folder: Folder, arguments: argparse.Namespace) -> int:
    """Write, and submit if asked to, what a sweep is missing and no queue holds.

    Raises:
        InputError: unknown cluster, a request beyond its limits, or another process works on the sweep.
        RunError: the queue cannot be asked or rejects the job.
    """
    from templates.slurm.submission import submissions, submit, tasks_of_runs, to_submit, write  # noqa: PLC0415

    place = shlex.quote(str(folder.path))
    with folder.lock():
        entries = to_submit(folder, tasks_of_runs(submissions(folder.path)))
        if not entries:
            done = sum(folder.is_done(entry) for entry in folder.entries)
            rest = len(folder.entries) - done
            print(f"{folder.path}: nothing to submit: {done} runs are done, {rest} in the queue")
            return 0
        draft = draft_of(folder.path, folder.name, entries, arguments)
        written = write(folder, draft)
        what = f"{len(entries)} of {len(folder.entries)} runs, {draft.request.to_text()}"
        if arguments.submit == "none":
            print(f"{written}: {what}; submit them: cd {place} && sbatch {draft.submission.script}")
            return 0
        submission = submit(folder, draft)
    print(f"{folder.path}: job {submission.job_id}: {what}; follow it: smarticles status {place}")
    return 0
