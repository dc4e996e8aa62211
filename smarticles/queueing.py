"""Runs of a sweep for a batch system: options, checks before anything is written, submission."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from dem.errors import InputError
from smarticles.parsing import Parser, add_ranks, positive_int

if TYPE_CHECKING:
    from templates.slurm.submission import Draft
    from templates.sweep.folder import Entry, Folder

HELP = """
With --submit slurm the runs become one array job: each task computes several runs at once, one core
each, and is told to stop before its time limit; its runs then end at a checkpoint and the task
queues itself again. --submit none with --cluster writes the same scripts, for sbatch by hand. A
cluster is known by name or described in a TOML file of yours; what it cannot give is refused before
anything is written."""

_OPTIONS = ("cluster", "partition", "account", "time", "runs_per_task", "memory", "ranks")


def add_options(parser: Parser) -> None:
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
    """Whether the runs are for a cluster.

    Args:
        arguments: of the command.
        one_run: whether they name one run, which may have ranks here too.

    Raises:
        InputError: an option for a cluster is given although they are not.
    """
    if arguments.submit == "slurm" or (arguments.submit == "none" and arguments.cluster is not None):
        return True
    for name in _OPTIONS:
        if getattr(arguments, name) is not None and not (one_run and name == "ranks"):
            option = f"--{name.replace('_', '-')}"
            msg = f"{option}: is for a cluster; give --submit slurm, or --submit none with --cluster NAME"
            raise InputError(msg)
    return False


def draft_of(path: Path, name: str, entries: Sequence[Entry], arguments: argparse.Namespace) -> Draft:
    """Render what would be submitted; writes nothing.

    Args:
        path: the sweep's directory.
        name: the sweep's name.
        entries: the runs.
        arguments: of the command.

    Raises:
        InputError: unknown cluster, or a request beyond its limits.
    """
    from templates.slurm.cluster import load_cluster, shipped_clusters  # noqa: PLC0415
    from templates.slurm.request import Wishes, plan_request  # noqa: PLC0415
    from templates.slurm.script import smarticles_words  # noqa: PLC0415
    from templates.slurm.submission import draft, submissions  # noqa: PLC0415

    reference = arguments.cluster
    if reference is None:
        before = submissions(path)
        if not before:
            msg = f"--cluster: is missing; known: {', '.join(shipped_clusters())}; or a file of your own, FILE.toml"
            raise InputError(msg)
        reference = before[-1].cluster
    cluster = load_cluster(reference)
    wishes = Wishes(
        partition=arguments.partition,
        account=arguments.account,
        time=arguments.time,
        runs_per_task=arguments.runs_per_task,
        memory_mib=arguments.memory,
        ranks=arguments.ranks,
    )
    request = plan_request([entry.expected_s for entry in entries], cluster, wishes)
    return draft(
        path,
        name,
        entries,
        cluster=cluster,
        reference=str(Path(reference).resolve()) if reference.endswith(".toml") else reference,
        request=request,
        command=("smarticles",) if cluster.container else smarticles_words(),
    )


def show(draft: Draft) -> str:
    """What would be written, as text."""
    place = f"jobs/{draft.submission.number}"
    return f"{draft.request.to_text()}\n\n--- {place}/runs.txt\n{draft.run_list}\n--- {place}/array.sh\n{draft.script}"


def enqueue(folder: Folder, arguments: argparse.Namespace) -> int:
    """Write, and submit if asked to, what a sweep is missing and no queue holds.

    Raises:
        InputError: unknown cluster, a request beyond its limits, or another process works on the sweep.
        RunError: the queue cannot be asked or refuses the job.
    """
    from templates.slurm.submission import submissions, submit, tasks_of_runs, to_submit, write  # noqa: PLC0415

    place = shlex.quote(str(folder.path))
    with folder.lock():
        tasks = tasks_of_runs(submissions(folder.path))
        entries = to_submit(folder, tasks)
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
