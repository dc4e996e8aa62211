"""Submit runs of a sweep to Slurm, and read their state from the queue.

DIR/jobs/001/array.sh    the job script, which can be submitted by hand, too
DIR/jobs/001/runs.txt    its runs, one name per line; task i computes the i-th group of lines
DIR/jobs/001/job.json    cluster, job name, job number once it is submitted
DIR/jobs/001/0.txt       output of task 0
"""

from __future__ import annotations

import re
import shutil
import subprocess
import uuid
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import ClassVar, Literal

from pydantic import Field

from dem.errors import InputError, RunError
from dem.record.document import Document
from dem.record.files import write_text
from templates.slurm.cluster import load_cluster
from templates.slurm.job import (
    RUN_LIST,
    SCRIPT,
    Request,
    Wishes,
    job_name,
    plan_request,
    render_script,
    smarticles_words,
)
from templates.sweep.folder import Entry, Folder, RunStatus

JOBS, JOB = "jobs", "job.json"


class Submission(Document):
    """Runs that were submitted to a queue, or whose script was only written: `job.json`."""

    remedy: ClassVar[str] = (
        "the runs in the queue are unknown; list them with `squeue --me`, cancel them, and remove the file's folder"
    )
    format: Literal[1] = 1
    job_name: str  #: Unique name of the job, by which the job is found if its number was lost
    job_id: int | None = None  #: Number of the job; None if the script was only written
    cluster: str  #: Value of --cluster
    runs_per_task: int
    stored: str = ""  #: Date and time of writing
    runs: tuple[str, ...]  #: Names of the runs, in the order of the tasks
    wishes: Wishes = Wishes()  #: Options of the user; none of them if the file lacks them
    number: str = Field("", exclude=True)  #: Name of the submission's folder in `jobs/`

    @property
    def script(self) -> str:
        """Path of the job script, relative to the directory of the sweep."""
        return f"{JOBS}/{self.number}/{SCRIPT}"

    def of_task(self, index: int) -> tuple[str, ...]:
        """Return the names of the runs that a task computes, by its index in the array."""
        return self.runs[index * self.runs_per_task : (index + 1) * self.runs_per_task]


@dataclass(frozen=True, kw_only=True)
class Draft:
    """A submission with its rendered script, before it is written."""

    submission: Submission
    request: Request
    script: str
    entries: tuple[Entry, ...]

    @property
    def run_list(self) -> str:
        """Content of the list of runs, `runs.txt`."""
        return "".join(f"{entry.name}\n" for entry in self.entries)


def submissions(folder: Path) -> list[Submission]:
    """Return the submissions in a directory of a sweep, oldest first; raise InputError for a damaged one."""
    files = sorted(folder.glob(f"{JOBS}/*/{JOB}"))
    return [Submission.read(file).model_copy(update={"number": file.parent.name}) for file in files]


def draft(
    path: Path, name: str, entries: Sequence[Entry], reference: str, wishes: Wishes, *, token: str | None = None
) -> Draft:
    """Plan and render a submission without writing it.

    `path` is the directory of the sweep, which may be absent; `reference` the name of a cluster in this package, or a
    file that ends in .toml. The token makes the name of the job unique; it is random if not given.
    """
    cluster = load_cluster(reference)
    request = plan_request([entry.expected_s for entry in entries], cluster, wishes)
    # Runs of a task should take equally long, so that no core is idle.
    ordered = tuple(sorted(entries, key=lambda entry: -entry.expected_s))
    taken = [int(folder.name) for folder in path.glob(f"{JOBS}/*") if folder.name.isdecimal()]
    submission = Submission(
        number=f"{max(taken, default=0) + 1:03d}",
        job_name=job_name(name, token or uuid.uuid4().hex[:8]),
        cluster=resolved(reference),
        runs_per_task=request.runs_per_task,
        runs=tuple(entry.name for entry in ordered),
        wishes=wishes,
    )
    script = render_script(
        cluster,
        request,
        sweep=path,
        number=submission.number,
        name=submission.job_name,
        count=len(ordered),
        command=("smarticles",) if cluster.container else smarticles_words(),
    )
    return Draft(submission=submission, request=request, script=script, entries=ordered)


def resolved(reference: str) -> str:
    """Return the name of a cluster, or the absolute path of its file."""
    return str(Path(reference).resolve()) if reference.endswith(".toml") else reference


def write(folder: Folder, draft: Draft) -> Path:
    """Write the files of a submission, and return their folder.

    Directories of runs that cannot continue are renamed, so that these runs start from their beginning.
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
    """Submit a written submission to Slurm, and store the number of the job.

    RunError if Slurm rejects the job, or its answer is no job number.
    """
    # The stored name finds the job in the queue even if this process is killed before it stores the number.
    script = folder.path / draft.submission.script
    try:
        answer = _call(("sbatch", "--parsable", draft.submission.script), folder.path)
    except (OSError, subprocess.SubprocessError) as error:
        raise RunError(
            f"{script}: sbatch rejects the job: {_reason(error)}; "
            f"correct that, then: smarticles resume {folder.path} --submit slurm"
        ) from error
    submitted = draft.submission.model_copy(update={"job_id": parse_job_id(answer, script)})
    _store(folder, submitted)
    return submitted


def _store(folder: Folder, submission: Submission) -> None:
    stored = submission.model_copy(update={"stored": datetime.now(UTC).isoformat(timespec="seconds")})
    stored.write(folder.path / JOBS / submission.number / JOB)


def tasks_of_runs(found: Sequence[Submission]) -> dict[str, Task]:
    """Return the task that computes each run, by the name of the run.

    `found` are the submissions of a sweep, oldest first. If a run is in several tasks, the newest one that has not
    ended is taken, or the newest one if all have ended. QueueError if Slurm's queue cannot be queried.
    """
    by_name = {submission.job_name: submission for submission in found}
    order = {submission.job_name: place for place, submission in enumerate(found)}
    tasks = _ask_queue(list(by_name))
    tasks.sort(key=lambda task: (task.state != "ended", order[task.job_name], task.job_id))
    return {run: task for task in tasks for run in by_name[task.job_name].of_task(task.index)}


def merged(status: RunStatus, task: Task | None) -> RunStatus:
    """Combine the status of a run in its directory with the state of its task in the queue.

    The states `done` and `failed` of the directory take precedence.
    """
    if task is None:
        return status
    state, cause = status.state, status.cause
    reason = f"Slurm: {task.slurm_state}"
    if status.state in ("done", "failed"):
        pass
    elif task.state == "ended":
        cause = cause if task.slurm_state == "COMPLETED" else ", ".join(filter(None, (reason, cause)))
    elif task.state == "running":
        state, cause = "running", None
    else:
        state, cause = "queued", ", ".join(filter(None, (reason, task.reason)))
    return replace(status, job=task.label, state=state, cause=cause)


def to_submit(folder: Folder, tasks: Mapping[str, Task]) -> list[Entry]:
    """Return the runs that are not done and are in no waiting or running task."""
    busy = {run for run, task in tasks.items() if task.state != "ended"}
    return [entry for entry in folder.entries if entry.name not in busy and not folder.is_done(entry)]


def reject_queued(folder: Folder) -> None:
    """Raise InputError if a run of a sweep is in Slurm's queue, or the queue cannot be queried."""
    found = submissions(folder.path)
    try:
        tasks = tasks_of_runs(found)
    except QueueError as error:
        jobs = ", ".join(str(one.job_id or one.job_name) for one in found)
        raise InputError(
            f"{folder.path}: was submitted to Slurm (jobs {jobs}), and {error}; resume on a machine with this queue, "
            f"or, if none of these jobs is left, remove {folder.path / JOBS}"
        ) from error
    busy = sorted({str(task.job_id) for task in tasks.values() if task.state != "ended"})
    if busy:
        raise InputError(
            f"{folder.path}: its runs are in Slurm's queue (jobs {', '.join(busy)}); wait for them, or cancel them "
            f"first: scancel {' '.join(busy)}"
        )


# -- Slurm's commands --------------------------------------------------------------------------------------------------

JobState = Literal["queued", "running", "ended"]

_BY_MEANING: dict[JobState, str] = {
    "queued": """PENDING CONFIGURING EXPEDITING POWER_UP_NODE RESV_DEL_HOLD REQUEUED REQUEUE_FED REQUEUE_HOLD
        SPECIAL_EXIT""",
    "running": "RUNNING COMPLETING SUSPENDED STOPPED RESIZING SIGNALING STAGE_OUT UPDATE_DB",
    "ended": """COMPLETED CANCELLED FAILED TIMEOUT NODE_FAIL BOOT_FAIL DEADLINE OUT_OF_MEMORY PREEMPTED REVOKED
        LAUNCH_FAILED RECONFIG_FAIL""",
}
STATES: dict[str, JobState] = {state: meaning for meaning, states in _BY_MEANING.items() for state in states.split()}
"""State of a task by Slurm's job state (man squeue, 22.05 to 25.05)."""

_TIMEOUT_S = 60.0


class QueueError(RunError):
    """Raised if Slurm's queue cannot be queried."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """One task of an array job in the queue."""

    job_name: str
    job_id: int
    index: int  #: Index of the task in its array
    slurm_state: str  #: Slurm's job state, a key of `STATES`
    reason: str  #: Slurm's reason for the state

    @property
    def state(self) -> JobState:
        """Whether the task is queued, running or ended."""
        return STATES[self.slurm_state]

    @property
    def label(self) -> str:
        """Job and index in Slurm's notation, `12_3`."""
        return f"{self.job_id}_{self.index}"


def require_sbatch() -> None:
    """Raise InputError if Slurm's command sbatch is not installed."""
    if shutil.which("sbatch") is None:
        raise InputError(
            "--submit slurm: there is no `sbatch` on this machine; submit on the cluster, "
            "or write the scripts with --submit none --cluster NAME"
        )


def parse_job_id(answer: str, script: Path) -> int:
    """Return the job number of an answer `12` or `12;cluster` of `sbatch --parsable`, or raise RunError."""
    lines = [line for line in answer.splitlines() if line.strip()]
    found = re.fullmatch(r"([1-9][0-9]*)(?:;\S+)?", lines[-1].strip()) if lines else None
    if found is None:
        raise RunError(
            f"{script}: sbatch answered {answer.strip()!r}, which is no job number; "
            "check with `squeue --me` whether the job is in the queue before submitting again"
        )
    return int(found[1])


def _ask_queue(names: Sequence[str]) -> list[Task]:
    """Query Slurm's queue for the tasks of jobs with the given names.

    Names are used because Slurm reports the number of an old job as an error.
    """
    if not names:
        return []
    asked = ("--noheader", "--array", "--states=all", f"--name={','.join(names)}", "--format=%j|%F|%K|%T|%r")
    try:
        answer = _call(("squeue", *asked), None)
    except (OSError, subprocess.SubprocessError) as error:
        raise QueueError(f"the queue cannot be queried: {_reason(error)}") from error
    return parse_queue(answer)


def parse_queue(answer: str) -> list[Task]:
    """Return the tasks of squeue's lines `name|job|index|state|reason`; raise RunError for other lines."""
    tasks = []
    for line in answer.splitlines():
        found = re.fullmatch(r"([^|]+)\|([0-9]+)\|([0-9]+)\|([A-Z_]+)\|(.*)", line.strip())
        if found is None:
            msg = f"squeue answered {line.strip()!r}, an unknown form; please report it with `squeue --version`"
            raise RunError(msg)
        name, job, index, state, reason = found.groups()
        if state not in STATES:
            raise RunError(
                f"squeue reports the unknown state {state} of task {job}_{index}, so the state of its runs is unknown; "
                "please report it with `squeue --version`"
            )
        reason = "" if reason == "None" else reason
        tasks.append(Task(job_name=name, job_id=int(job), index=int(index), slurm_state=state, reason=reason))
    return tasks


def _call(command: Sequence[str], folder: Path | None) -> str:
    return subprocess.run(
        command,
        cwd=folder,
        check=True,
        capture_output=True,
        encoding="utf-8",
        errors="replace",
        stdin=subprocess.DEVNULL,
        timeout=_TIMEOUT_S,
    ).stdout


def _reason(error: Exception) -> str:
    if isinstance(error, FileNotFoundError):
        return f"there is no `{error.filename}` on this machine"
    if isinstance(error, subprocess.TimeoutExpired):
        return f"no answer within {_TIMEOUT_S:.0f} s"
    text = getattr(error, "stderr", None) or str(error)
    return " ".join(text.split()) or f"exit status {getattr(error, 'returncode', '?')}"
