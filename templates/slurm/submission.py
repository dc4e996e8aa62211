"""Submissions of a sweep to a queue: what was submitted, what of it is still to come, what is to be submitted.

DIR/jobs/001/array.sh    the job script; works by hand
DIR/jobs/001/runs.txt    its runs, one name per line; task i computes the i-th group of lines
DIR/jobs/001/job.json    cluster, job name, job number once it is submitted
DIR/jobs/001/0.txt       what task 0 said
"""

from __future__ import annotations

import uuid
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import Field

from dem.errors import InputError
from dem.record.document import Document
from dem.record.files import write_text
from templates.slurm import queue
from templates.slurm.cluster import Cluster
from templates.slurm.request import Request
from templates.slurm.script import RUN_LIST, SCRIPT, job_name, render_script
from templates.sweep.folder import Entry, Folder, RunStatus

JOBS, JOB = "jobs", "job.json"


class Submission(Document):
    """Runs that were given to a queue, or written for it: `job.json`.

    Attributes:
        job_name: Name of the job; unique, so that the job is found even if its number was lost.
        job_id: Number of the job; None where the script was only written.
        cluster: What --cluster said.
        runs: Names of the runs, in the order of the tasks.
        number: Name of its folder in `jobs/`.
    """

    remedy: ClassVar[str] = (
        "it is not known which runs are in the queue; look with `squeue --me`, cancel them, and remove its folder"
    )
    format: Literal[1] = 1
    job_name: str
    job_id: int | None = None
    cluster: str
    runs_per_task: int
    stored: str = ""
    runs: tuple[str, ...]
    number: str = Field("", exclude=True)

    @property
    def script(self) -> str:
        """Path of its script in the sweep's directory."""
        return f"{JOBS}/{self.number}/{SCRIPT}"

    def of_task(self, index: int) -> tuple[str, ...]:
        """Names of the runs of one task."""
        return self.runs[index * self.runs_per_task : (index + 1) * self.runs_per_task]


@dataclass(frozen=True, kw_only=True)
class Draft:
    """A submission that is rendered but not written.

    Args:
        submission: what it is.
        request: what it asks for.
        script: the job script.
        entries: its runs.
    """

    submission: Submission
    request: Request
    script: str
    entries: tuple[Entry, ...]

    @property
    def run_list(self) -> str:
        """Text of the list of runs."""
        return "".join(f"{entry.name}\n" for entry in self.entries)


def submissions(folder: Path) -> list[Submission]:
    """What was submitted or written for submission, oldest first.

    Raises:
        InputError: a record is damaged.
    """
    files = sorted(folder.glob(f"{JOBS}/*/{JOB}"))
    return [Submission.read(file).model_copy(update={"number": file.parent.name}) for file in files]


def draft(
    path: Path,
    name: str,
    entries: Sequence[Entry],
    *,
    cluster: Cluster,
    reference: str,
    request: Request,
    command: Sequence[str],
    token: str | None = None,
) -> Draft:
    """Render a submission; nothing is written.

    Args:
        path: the sweep's directory; it may be absent.
        name: the sweep's name.
        entries: runs to compute.
        cluster: where.
        reference: what --cluster said.
        request: what is asked for.
        command: the words of the command `smarticles`.
        token: tells the job's name from all others; by default a random one.

    Raises:
        InputError: the script cannot be rendered.
    """
    # Runs that take about as long share a task: then no core waits for a longer neighbour.
    ordered = tuple(sorted(entries, key=lambda entry: -entry.expected_s))
    taken = [int(folder.name) for folder in path.glob(f"{JOBS}/*") if folder.name.isdecimal()]
    number = f"{max(taken, default=0) + 1:03d}"
    submission = Submission(
        number=number,
        job_name=job_name(name, token or uuid.uuid4().hex[:8]),
        cluster=reference,
        runs_per_task=request.runs_per_task,
        runs=tuple(entry.name for entry in ordered),
    )
    script = render_script(
        cluster,
        request,
        sweep=path,
        number=number,
        name=submission.job_name,
        count=len(ordered),
        command=command,
    )
    return Draft(submission=submission, request=request, script=script, entries=ordered)


def write(folder: Folder, draft: Draft) -> Path:
    """Write a submission's files; runs that cannot go on are set aside.

    Returns:
        Its folder.
    """
    for entry in draft.entries:
        if not folder.can_resume(entry):
            folder.set_aside(entry)
    place = folder.path / JOBS / draft.submission.number
    for directory in (place, folder.path / "logs", folder.path / "runs"):
        directory.mkdir(parents=True, exist_ok=True)
    write_text(place / RUN_LIST, draft.run_list)
    write_text(place / SCRIPT, draft.script)
    _store(folder, draft.submission)
    return place


def submit(folder: Folder, draft: Draft) -> Submission:
    """Submit what was written, and keep the job's number.

    Raises:
        RunError: Slurm refused it.
    """
    # The name was stored before: a job whose number is lost here is still found in the queue by its name.
    number = queue.submit(draft.submission.script, folder.path)
    submitted = draft.submission.model_copy(update={"job_id": number})
    _store(folder, submitted)
    return submitted


def _store(folder: Folder, submission: Submission) -> None:
    stored = submission.model_copy(update={"stored": datetime.now(UTC).isoformat(timespec="seconds")})
    stored.write(folder.path / JOBS / submission.number / JOB)


def tasks_of_runs(found: Sequence[Submission]) -> dict[str, queue.Task]:
    """What the queue says about each run: of its newest task that waits or computes, else of its newest.

    Raises:
        QueueError: the queue cannot be asked.
        RunError: the queue says what is not understood.
    """
    by_name = {submission.job_name: submission for submission in found}
    order = {submission.job_name: place for place, submission in enumerate(found)}
    tasks = queue.ask_queue(list(by_name))
    tasks.sort(key=lambda task: (task.state != "ended", order[task.job_name], task.job_id))
    return {run: task for task in tasks for run in by_name[task.job_name].of_task(task.index)}


def merged(status: RunStatus, task: queue.Task | None) -> RunStatus:
    """State of a run from its directory and from the queue together.

    What the directory says about an end counts: `done` and `failed` stay.
    """
    if task is None:
        return status
    if status.state in ("done", "failed"):
        return replace(status, job=task.label)
    if task.state == "ended":
        cause = f"Slurm: {task.slurm_state}" + (f", {status.cause}" if status.cause else "")
        return replace(status, job=task.label, cause=status.cause if task.slurm_state == "COMPLETED" else cause)
    if task.state == "running":
        return replace(status, job=task.label, state="running", cause=None)
    cause = f"Slurm: {task.slurm_state}" + (f", {task.reason}" if task.reason else "")
    return replace(status, job=task.label, state="queued", cause=cause)


def to_submit(folder: Folder, tasks: Mapping[str, queue.Task]) -> list[Entry]:
    """Runs without a result that no task of the queue is going to compute."""
    busy = {run for run, task in tasks.items() if task.state != "ended"}
    return [entry for entry in folder.entries if entry.name not in busy and not folder.is_done(entry)]


def refuse_queued(folder: Folder) -> None:
    """Refuse to compute here what a queue may be computing elsewhere.

    Raises:
        InputError: runs are in the queue, or it cannot be asked.
    """
    found = submissions(folder.path)
    try:
        tasks = tasks_of_runs(found)
    except queue.QueueError as error:
        jobs = ", ".join(str(one.job_id or one.job_name) for one in found)
        msg = (
            f"{folder.path}: was submitted to Slurm (jobs {jobs}), and {error}; resume where the queue can be asked, "
            f"or, if none of these jobs is left, remove {folder.path / JOBS}"
        )
        raise InputError(msg) from error
    busy = sorted({str(task.job_id) for task in tasks.values() if task.state != "ended"})
    if busy:
        msg = (
            f"{folder.path}: its runs are in Slurm's queue (jobs {', '.join(busy)}); wait for them, or cancel them "
            f"first: scancel {' '.join(busy)}"
        )
        raise InputError(msg)


def plain(tasks: Mapping[str, queue.Task]) -> dict[str, Any]:
    """How many tasks are in each of Slurm's states, for JSON."""
    unique = {task.label: task.slurm_state for task in tasks.values()}
    return {state: list(unique.values()).count(state) for state in sorted(set(unique.values()))}
