"""sweep, status and resume with a queue: rejections before anything is written, dry runs, states."""

import json
from pathlib import Path

import pytest
from command_cases import SWEEP, Smarticles

from templates.slurm import submission as slurm

LARGE = ("--cluster", "example-large")


@pytest.fixture
def queue(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Slurm that takes every job as number 7; what squeue answers, line by line, `NAME` standing for the job's name."""
    lines: list[str] = []

    def call(command: tuple[str, ...], folder: Path | None) -> str:
        if command[0] == "sbatch":
            assert folder is not None
            assert (folder / command[-1]).is_file()
            return "7\n"
        name = next(word for word in command if word.startswith("--name=")).removeprefix("--name=")
        return "\n".join(line.replace("NAME", name.split(",")[-1]) for line in lines)

    monkeypatch.setattr(slurm, "_call", call)
    monkeypatch.setattr(slurm, "require_sbatch", lambda: None)
    return lines


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--cluster", "exmple-large"], "--cluster exmple-large: is not known; did you mean 'example-large'?"),
        ([], "--cluster: is missing; known: example-apptainer, example-large, local-slurm"),
        ([*LARGE, "--runs-per-task", "65"], "--runs-per-task 65: partition shared of example-large has 64 cores"),
    ],
)
def test_what_a_cluster_cannot_give_is_rejected_before_anything_is_written(
    words: list[str], message: str, sweep_file: Path, smarticles: Smarticles, queue: list[str]
) -> None:
    out = sweep_file.parent / "out"
    said = smarticles("sweep", sweep_file, "--out", out, "--submit", "slurm", *words)
    assert said.status == 2
    assert message in said.err
    assert not out.exists()


def test_without_slurm_nothing_is_written(
    sweep_file: Path, smarticles: Smarticles, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slurm.shutil, "which", lambda name: None)
    out = sweep_file.parent / "out"
    said = smarticles("sweep", sweep_file, "--out", out, "--submit", "slurm", *LARGE)
    assert said.status == 2
    assert "there is no `sbatch` on this machine" in said.err
    assert not out.exists()


@pytest.mark.parametrize("words", [["--time", "1"], ["--submit", "local", *LARGE], ["--runs-per-task", "2"]])
def test_options_of_clusters_need_one(words: list[str], sweep_file: Path, smarticles: Smarticles) -> None:
    said = smarticles("sweep", sweep_file, "--out", sweep_file.parent / "out", *words)
    assert said.status == 2
    assert f"{words[-2]}: is for a cluster; " in said.err


def test_submit_none_writes_scripts_that_are_submitted_by_hand(
    sweep_file: Path, tmp_path: Path, smarticles: Smarticles
) -> None:
    out = tmp_path / "it's out"
    said = smarticles("sweep", sweep_file, "--out", out, *LARGE)
    assert said.status == 0
    assert "&& sbatch jobs/001/array.sh" in said.out
    assert (out / "jobs/001/runs.txt").read_text().split() == ["n6", "n5"]
    assert json.loads((out / "jobs/001/job.json").read_text()).get("job_id") is None


def test_a_sweep_is_submitted_followed_and_resumed(
    sweep_file: Path, tmp_path: Path, smarticles: Smarticles, queue: list[str]
) -> None:
    out = tmp_path / "out"
    said = smarticles("sweep", sweep_file, "--out", out, "--submit", "slurm", *LARGE, "--runs-per-task", "1")
    assert said.status == 0, said.err
    assert said.out.startswith(f"{out}: job 7: 2 of 2 runs, 2 tasks of 1 run: 1 cores, 1024 MiB, ")
    queue += ["NAME|7|0|RUNNING|None", "NAME|7|1|CANCELLED|None"]
    lines = smarticles("status", out).out.splitlines()
    assert lines[1].split() == ["n5", "missing", "7_1", "Slurm:", "CANCELLED"]
    assert lines[2].split() == ["n6", "running", "7_0"]
    answer = json.loads(smarticles("status", out, "--json").out)
    assert answer["queue"] == {"jobs": [7], "error": None, "tasks": {"CANCELLED": 1, "RUNNING": 1}}
    said = smarticles("resume", out)
    assert said.status == 2
    assert "its runs are in Slurm's queue (jobs 7)" in said.err
    said = smarticles("resume", out, "--submit", "slurm")  # on the same cluster
    assert ": job 7: 1 of 2 runs, " in said.out
    assert (out / "jobs/002/runs.txt").read_text() == "n5\n"


def test_a_resumed_sweep_keeps_the_options_of_its_job(
    sweep_file: Path, tmp_path: Path, smarticles: Smarticles, queue: list[str]
) -> None:
    out, resumed = tmp_path / "out", ("resume", tmp_path / "out", "--submit", "slurm")
    wishes = ("--time", "00:20:00", "--partition", "debug", "--memory", "2000", "--runs-per-task", "1")
    assert smarticles("sweep", sweep_file, "--out", out, "--submit", "slurm", *LARGE, *wishes).status == 0
    kept = "2 tasks of 1 run: 1 cores, 2000 MiB, 00:20:00 each"
    for words, request in (
        ((), kept),
        (LARGE, kept),  # the same cluster, named again
        (("--time", "00:30:00"), "2 tasks of 1 run: 1 cores, 2000 MiB, 00:30:00 each"),
        ((), "2 tasks of 1 run: 1 cores, 2000 MiB, 00:30:00 each"),
    ):
        said = smarticles(*resumed, *words)
        assert (said.status, request in said.out) == (0, True), said
    assert "--partition=debug" in (out / "jobs/005/array.sh").read_text()
    # A time is for a partition, and all options are for a cluster.
    said = smarticles(*resumed, "--partition", "shared")
    assert "2 tasks of 1 run: 1 cores, 2000 MiB, " in said.out
    assert "00:30:00" not in said.out
    said = smarticles(*resumed, "--cluster", "local-slurm")
    assert "2000 MiB" not in said.out
    assert "--partition=debug" not in (out / "jobs/007/array.sh").read_text()


def test_too_many_points_are_rejected_unless_wanted(sweep_file: Path, tmp_path: Path, smarticles: Smarticles) -> None:
    sweep_file.write_text(SWEEP.replace("[5, 6]", str(list(range(1, 200))).replace(" ", "")))
    sweep_file.write_text(sweep_file.read_text().replace("}}", "}}", 1) + f"repeats: {{seeds: {list(range(100))}}}\n")
    said = smarticles("sweep", sweep_file, "--out", tmp_path / "out")
    assert said.status == 2
    assert "points: 19900 runs, more than 10000; shorten its lists, or give --max-points 19900" in said.err
    sweep_file.write_text(SWEEP)
    assert smarticles("sweep", sweep_file, "--dry-run", "--max-points", "1").status == 2
    assert smarticles("sweep", sweep_file, "--dry-run", "--max-points", "2").status == 0
