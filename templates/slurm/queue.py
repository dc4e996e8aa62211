"""Slurm's commands: submit a script, ask the queue."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from dem.errors import InputError, RunError

JobState = Literal["queued", "running", "ended"]

# Slurm's job states (man squeue, 22.05 to 25.05) by what they mean for the runs of a task.
STATES: dict[str, JobState] = {
    **dict.fromkeys(
        (
            *("PENDING", "CONFIGURING", "EXPEDITING", "POWER_UP_NODE", "RESV_DEL_HOLD"),
            *("REQUEUED", "REQUEUE_FED", "REQUEUE_HOLD", "SPECIAL_EXIT"),
        ),
        "queued",
    ),
    **dict.fromkeys(
        (
            *("RUNNING", "COMPLETING", "SUSPENDED", "STOPPED"),
            *("RESIZING", "SIGNALING", "STAGE_OUT", "UPDATE_DB"),
        ),
        "running",
    ),
    **dict.fromkeys(
        (
            *("COMPLETED", "CANCELLED", "FAILED", "TIMEOUT", "NODE_FAIL", "BOOT_FAIL", "DEADLINE"),
            *("OUT_OF_MEMORY", "PREEMPTED", "REVOKED", "LAUNCH_FAILED", "RECONFIG_FAIL"),
        ),
        "ended",
    ),
}
_TIMEOUT_S = 60.0


class QueueError(RunError):
    """The queue cannot be asked."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """One task of an array job, as the queue tells it.

    Args:
        job_name: name of the job.
        job_id: number of the array job.
        index: number of the task.
        slurm_state: the state in Slurm's words.
        reason: why it waits, in Slurm's words, or empty.
    """

    job_name: str
    job_id: int
    index: int
    slurm_state: str
    reason: str

    @property
    def state(self) -> JobState:
        """What the state means."""
        return STATES[self.slurm_state]

    @property
    def label(self) -> str:
        """`12_3`, as Slurm writes it."""
        return f"{self.job_id}_{self.index}"


def require_sbatch() -> None:
    """Refuse to submit where Slurm is not installed.

    Raises:
        InputError: there is no sbatch.
    """
    if shutil.which("sbatch") is None:
        msg = (
            "--submit slurm: there is no `sbatch` on this machine; submit on the cluster, "
            "or write the scripts with --submit none --cluster NAME"
        )
        raise InputError(msg)


def submit(script: str, folder: Path) -> int:
    """Submit a script.

    Args:
        script: path of the script, relative to the folder.
        folder: directory in which the job starts.

    Returns:
        The job's number.

    Raises:
        RunError: Slurm refuses it, or answers what is not a job's number.
    """
    try:
        answer = _call(("sbatch", "--parsable", script), folder)
    except (OSError, subprocess.SubprocessError) as error:
        msg = (
            f"{folder / script}: sbatch refused it: {_reason(error)}; "
            f"correct that, then: smarticles resume {folder} --submit slurm"
        )
        raise RunError(msg) from error
    return parse_job_id(answer, folder / script)


def parse_job_id(answer: str, script: Path) -> int:
    """The number in the answer of `sbatch --parsable`: `12` or `12;cluster`.

    Raises:
        RunError: it is something else.
    """
    lines = [line for line in answer.splitlines() if line.strip()]
    found = re.fullmatch(r"([1-9][0-9]*)(?:;\S+)?", lines[-1].strip()) if lines else None
    if found is None:
        msg = (
            f"{script}: sbatch answered {answer.strip()!r}, which is no job number; "
            "look with `squeue --me` whether the job is in the queue before submitting again"
        )
        raise RunError(msg)
    return int(found[1])


def ask_queue(names: Sequence[str]) -> list[Task]:
    """Tasks of some jobs that Slurm still knows, ended ones included for a while.

    Args:
        names: names of the jobs. By name, since Slurm takes a number that it has forgotten for a mistake.

    Raises:
        QueueError: there is no squeue, or its controller does not answer.
        RunError: a task is in a state that is not known here.
    """
    if not names:
        return []
    command = (
        "squeue",
        "--noheader",
        "--array",
        "--states=all",
        f"--name={','.join(names)}",
        "--format=%j|%F|%K|%T|%r",
    )
    try:
        answer = _call(command, None)
    except (OSError, subprocess.SubprocessError) as error:
        msg = f"the queue cannot be asked: {_reason(error)}"
        raise QueueError(msg) from error
    return parse_queue(answer)


def parse_queue(answer: str) -> list[Task]:
    """Tasks from squeue's lines `name|job|index|state|reason`.

    Raises:
        RunError: a line is not understood, or names an unknown state.
    """
    tasks = []
    for line in answer.splitlines():
        found = re.fullmatch(r"([^|]+)\|([0-9]+)\|([0-9]+)\|([A-Z_]+)\|(.*)", line.strip())
        if found is None:
            msg = f"squeue answered {line.strip()!r}, which is not understood; please report it with `squeue --version`"
            raise RunError(msg)
        name, job, index, state, reason = found.groups()
        if state not in STATES:
            msg = (
                f"Slurm says that task {job}_{index} is {state}, a state that is not known here, so nothing is assumed "
                "about its runs; please report it with `squeue --version`"
            )
            raise RunError(msg)
        reason = "" if reason == "None" else reason
        tasks.append(Task(job_name=name, job_id=int(job), index=int(index), slurm_state=state, reason=reason))
    return tasks


def _call(command: Sequence[str], folder: Path | None) -> str:
    done = subprocess.run(
        command,
        cwd=folder,
        check=True,
        capture_output=True,
        encoding="utf-8",
        errors="replace",
        stdin=subprocess.DEVNULL,
        timeout=_TIMEOUT_S,
    )
    return done.stdout


def _reason(error: Exception) -> str:
    if isinstance(error, FileNotFoundError):
        return f"there is no `{error.filename}` on this machine"
    if isinstance(error, subprocess.TimeoutExpired):
        return f"no answer within {_TIMEOUT_S:.0f} s"
    said = getattr(error, "stderr", None) or str(error)
    return " ".join(said.split()) or f"exit status {getattr(error, 'returncode', '?')}"
