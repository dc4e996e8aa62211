"""What is in the queue, what is to be submitted, and what Slurm answers."""

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest
from sweep_cases import MakeFolder
from synthetic import write_ended

from dem.errors import InputError, RunError
from templates.slurm import submission
from templates.slurm.job import Wishes
from templates.slurm.submission import (
    QueueError,
    Task,
    draft,
    merged,
    parse_job_id,
    parse_queue,
    reject_queued,
    submissions,
    tasks_of_runs,
    to_submit,
    write,
)
from templates.sweep.folder import Folder, RunStatus


@pytest.mark.parametrize(("answer", "number"), [("12\n", 12), ("12;here\n", 12), ("sbatch: warning\n7\n", 7)])
def test_job_numbers(answer: str, number: int) -> None:
    assert parse_job_id(answer, Path("array.sh")) == number


@pytest.mark.parametrize("answer", ["", "\n", "Submitted batch job 12\n", "0\n", "-3", "12 13"])
def test_other_answers_of_sbatch_are_errors(answer: str) -> None:
    with pytest.raises(RunError, match=r"array.sh: sbatch answered .* which is no job number"):
        parse_job_id(answer, Path("array.sh"))


def test_the_queue_is_read() -> None:
    tasks = parse_queue("six.1|12|0|RUNNING|None\nsix.1|12|3|PENDING|Resources\n")
    assert [(task.label, task.state, task.reason) for task in tasks] == [
        ("12_0", "running", ""),
        ("12_3", "queued", "Resources"),
    ]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("six.1|12|0|DREAMING|None", "unknown state DREAMING of task 12_0"),
        ("slurm_load_jobs: something\n", "an unknown form"),
    ],
)
def test_an_unknown_state_or_line_is_an_error(line: str, message: str) -> None:
    with pytest.raises(RunError, match=message):
        parse_queue(line)


@pytest.fixture
def folder(make_folder: MakeFolder) -> Folder:
    """Four runs; n20 is expected to take longer."""
    return make_folder()


def submitted(folder: Folder, number: int | None = 12, runs_per_task: int = 2) -> submission.Draft:
    wishes = Wishes(runs_per_task=runs_per_task)
    made = draft(folder.path, folder.name, folder.entries, "example-large", wishes, token="tt")
    write(folder, made)
    if number is not None:
        file = folder.path / "jobs" / made.submission.number / "job.json"
        file.write_text(json.dumps({**json.loads(file.read_text()), "job_id": number}))
    return made


@pytest.fixture
def queue(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What squeue answers, line by line; empty at first."""
    lines: list[str] = []

    def call(command: tuple[str, ...], _: Path | None) -> str:
        assert command[0] == "squeue"
        return "\n".join(lines)

    monkeypatch.setattr(submission, "_call", call)
    return lines


def finish(folder: Folder, number: int) -> None:
    entry = folder.entries[number]
    write_ended(folder.run(entry), entry.scene_sha256)


def test_longer_runs_come_first_and_share_a_task(folder: Folder) -> None:
    made = submitted(folder)
    assert (folder.path / "jobs/001/runs.txt").read_text().split() == [
        "n20_seed1",
        "n20_seed2",
        "n10_seed1",
        "n10_seed2",
    ]
    assert made.submission.of_task(1) == ("n10_seed1", "n10_seed2")
    (found,) = submissions(folder.path)
    assert (found.job_id, found.job_name, found.cluster) == (12, "test.tt", "example-large")
    assert submitted(folder).submission.number == "002"


def test_only_what_is_missing_and_not_in_the_queue_is_submitted(folder: Folder, queue: list[str]) -> None:
    submitted(folder)
    finish(folder, 3)  # n20_seed2
    queue += ["test.tt|12|0|COMPLETED|None", "test.tt|12|1|PENDING|BeginTime"]
    tasks = tasks_of_runs(submissions(folder.path))
    assert [entry.name for entry in to_submit(folder, tasks)] == ["n20_seed1"]
    assert [entry.name for entry in to_submit(folder, {})] == ["n10_seed1", "n10_seed2", "n20_seed1"]


def test_a_job_whose_number_was_lost_is_found_by_its_name(folder: Folder, queue: list[str]) -> None:
    submitted(folder, number=None)
    queue += ["test.tt|99|0|RUNNING|None", "test.tt|99|1|RUNNING|None"]
    tasks = tasks_of_runs(submissions(folder.path))
    assert tasks["n10_seed1"].label == "99_1"
    assert to_submit(folder, tasks) == []


def status(state: Any, **more: Any) -> RunStatus:
    return RunStatus(name="a", directory=Path("a"), state=state, **more)


@pytest.mark.parametrize(
    ("directory", "slurm_state", "state", "cause"),
    [
        ("missing", "PENDING", "queued", "Slurm: PENDING, Priority"),
        ("interrupted", "REQUEUED", "queued", "Slurm: REQUEUED, Priority"),
        ("stopped", "RUNNING", "running", None),
        ("interrupted", "COMPLETING", "running", None),
        ("stopped", "TIMEOUT", "stopped", "Slurm: TIMEOUT"),
        ("missing", "CANCELLED", "missing", "Slurm: CANCELLED"),
        ("missing", "COMPLETED", "missing", None),
        ("done", "RUNNING", "done", None),
        ("failed", "RUNNING", "failed", None),
    ],
)
def test_queue_and_directory_together(directory: str, slurm_state: str, state: str, cause: str | None) -> None:
    task = Task(job_name="n", job_id=1, index=2, slurm_state=slurm_state, reason="Priority")
    found = merged(status(directory), task)
    assert (found.state, found.cause, found.job) == (state, cause, "1_2")


def test_nothing_is_computed_here_while_it_is_in_the_queue(folder: Folder, queue: list[str]) -> None:
    reject_queued(folder)
    submitted(folder)
    reject_queued(folder)
    queue.append("test.tt|12|0|RUNNING|None")
    with pytest.raises(InputError, match=r"in Slurm's queue \(jobs 12\).*scancel 12"):
        reject_queued(folder)


def test_a_queue_that_does_not_answer_is_no_empty_queue(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    submitted(folder)

    def call(command: tuple[str, ...], _: Path | None) -> str:
        raise subprocess.CalledProcessError(1, command, stderr="Unable to contact\nslurm controller")

    monkeypatch.setattr(submission, "_call", call)
    with pytest.raises(QueueError, match="the queue cannot be queried: Unable to contact slurm controller"):
        tasks_of_runs(submissions(folder.path))
    with pytest.raises(InputError, match="was submitted to Slurm"):
        reject_queued(folder)


@pytest.mark.parametrize("text", ["", "{}", '{"job_id": "x"}'])
def test_a_damaged_record_is_an_error(folder: Folder, text: str) -> None:
    submitted(folder)
    (folder.path / "jobs/001/job.json").write_text(text)
    with pytest.raises(InputError, match=r"job.json: .*; the runs in the queue are unknown"):
        submissions(folder.path)


def test_runs_that_cannot_go_on_are_set_aside(folder: Folder) -> None:
    entry = folder.entries[0]
    run = folder.run(entry)
    write_ended(run, entry.scene_sha256, status="failed")
    submitted(folder)
    assert not run.exists()
    assert (run.parent / f"{entry.name}.stopped-1" / "failed.json").exists()
