"""Sweeps through a real Slurm, started here: a run fails, one meets the time limit and goes on with its bits."""

import json
import os
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from processes import complete, differing, gate, results
from slurm_here import SlurmHere, slurm_here, wait_until

SCENE = """\
schema_version: 1
seed: 1
smarticle: {aspect_ratio: 0.7}
fidelity: draft
count: 6
recording: {checkpoint_interval_s: 0.02, frame_interval_s: 0.02}
phases:
  - {type: deposit, per_layer: 6, settle: {timeout_s: {{ timeout_s }}}}
  - {type: relax, duration_s: {{ relax_s }}}
"""
SWEEP = """\
schema_version: 1
name: six
template: scene.yaml.j2
run_name: "{{ label }}"
points:
  list:
    - {label: a, timeout_s: 5, relax_s: 0.12}
    - {label: b, timeout_s: 5, relax_s: 0.14}
    - {label: c, timeout_s: 5, relax_s: 0.16}
    - {label: d, timeout_s: 5, relax_s: 0.18}
    - {label: fails, timeout_s: 0.01, relax_s: 0.12}
    - {label: long, timeout_s: 5, relax_s: 0.1}
"""  # `long`, the shortest, is the last task: its number is that of the whole array too
CLUSTER = """\
schema_version = 1
name = "here"
scheduler = "slurm"
max_array_size = 1001
signal_lead_s = 70
default_partition = "only"
[partitions.only]
cores_per_node = 6
memory_per_node_mib = 6000
max_time = "00:10:00"
"""


@pytest.fixture(scope="module")
def slurm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SlurmHere]:
    with slurm_here(tmp_path_factory.mktemp("slurm")) as here:
        yield here


@pytest.fixture
def smarticles(slurm: SlurmHere) -> Callable[..., str]:
    def call(*words: str | Path) -> str:
        return slurm.call(sys.executable, "-m", "smarticles", *map(str, words))

    return call


def waits(process: int, number: signal.Signals) -> bool:
    """Whether a process is stopped, and a signal waits for it."""
    status = Path(f"/proc/{process}/status").read_text()
    pending = int(status.partition("ShdPnd:")[2].split()[0], 16)
    return status.partition("State:")[2].split()[0] == "T" and bool(pending & (1 << (number - 1)))


def states(smarticles: Callable[..., str], out: Path) -> dict[str, Any]:
    answer = json.loads(smarticles("status", out, "--json"))
    assert answer["queue"]["error"] is None
    return {run["name"]: run["state"] for run in answer["runs"]}


def go_on_when_signalled(run: Path, held: Path) -> None:
    """Wait until Slurm signals a stopped run that its time limit is near, and continue it."""
    wait_until(held.exists, lambda: f"{run}: did not come to its second checkpoint")
    process = int((run / ".lock").read_text())
    try:
        wait_until(lambda: waits(process, signal.SIGUSR1), lambda: f"{run}: no signal before the time limit")
    finally:
        os.kill(process, signal.SIGCONT)


def test_a_sweep_of_six_with_a_failure_and_a_time_limit(
    slurm: SlurmHere, smarticles: Callable[..., str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = tmp_path / "it's $HOME"
    place.mkdir()
    for name, text in (("scene.yaml.j2", SCENE), ("sweep.yaml", SWEEP), ("here.toml", CLUSTER)):
        (place / name).write_text(text)
    out, held = place / "out", tmp_path / "held"
    for name, value in gate("runs/long/checkpoint.zip", 2, "SIGSTOP", once=str(held)).items():
        monkeypatch.setitem(slurm.environment, name, value)
    # Runs are asked to stop after 110 s, which the short ones do not need even on a busy machine.
    request = ("--runs-per-task", "1", "--memory", "900", "--time", "3")
    said = smarticles(
        "sweep", place / "sweep.yaml", "--out", out, "--submit", "slurm", *request, "--cluster", place / "here.toml"
    )
    record = json.loads((out / "jobs/001/job.json").read_text())
    assert f"job {record['job_id']}: 6 of 6 runs, 6 tasks of 1 run" in said
    assert sorted(record["runs"]) == ["a", "b", "c", "d", "fails", "long"]
    assert set(states(smarticles, out).values()) <= {"queued", "running", "done", "failed"}

    go_on_when_signalled(out / "runs" / "long", held)
    task = record["runs"].index("long")
    assert task == len(record["runs"]) - 1
    log = out / "jobs" / "001" / f"{task}.txt"
    wait_until(lambda: "queued again" in log.read_text(), log.read_text)
    assert "ended by USR1" in log.read_text()
    # Slurm lets two minutes pass before it starts a task again: not long enough for what follows on a busy machine.
    label = f"{record['job_id']}_{task}"
    wait_until(lambda: "PENDING" in slurm.call("squeue", "--noheader", f"--jobs={label}", "--format=%T"), log.read_text)
    slurm.call("scontrol", "update", f"JobId={label}", "StartTime=now+1hour")
    stopped = json.loads((out / "runs/long/failed.json").read_text())
    assert (stopped["status"], "stopped as requested" in stopped["cause"]) == ("interrupted", True)
    others = {**dict.fromkeys(["a", "b", "c", "d"], "done"), "fails": "failed"}
    wait_until(lambda: {**states(smarticles, out), **others} == states(smarticles, out), lambda: "the others not done")
    assert states(smarticles, out)["long"] in ("queued", "running")
    # What failed has no result; what waits in the queue is left there.
    assert ": 1 of 6 runs, 1 tasks of 1 run" in smarticles("resume", out, "--submit", "slurm", *request)
    assert (out / "jobs/002/runs.txt").read_text() == "fails\n"
    slurm.call("scontrol", "update", f"JobId={label}", "StartTime=now")

    expected = {**others, "long": "done"}
    wait_until(lambda: states(smarticles, out) == expected, lambda: f"{states(smarticles, out)}: {log.read_text()}")
    # No other task was queued again with it: each has come to its end once.
    ends = [(out / "jobs" / "001" / f"{number}.txt").read_text().count("not finished") for number in range(6)]
    assert ends == [1, 1, 1, 1, 1, 2]
    assert "resumed from the checkpoint" in (out / "runs/long/log.txt").read_text()
    complete(out / "scenes" / "long.yaml", tmp_path / "whole")
    assert len(results(tmp_path / "whole")) > 10
    assert differing(results(out / "runs" / "long"), results(tmp_path / "whole")) == []

    # What is missing, and nothing else: the run that failed, and one whose results are lost.
    before = results(out / "runs" / "b")
    (out / "runs" / "b").rename(tmp_path / "lost")
    assert states(smarticles, out) == {**expected, "b": "missing"}
    said = smarticles("resume", out, "--submit", "slurm", *request)
    assert ": 2 of 6 runs, 2 tasks of 1 run" in said
    assert sorted((out / "jobs/003/runs.txt").read_text().split()) == ["b", "fails"]
    wait_until(lambda: states(smarticles, out) == expected, lambda: str(states(smarticles, out)))
    assert differing(results(out / "runs" / "b"), before) == []
    assert (out / "runs" / "fails.stopped-2" / "failed.json").exists()


def test_a_rejected_job_is_reported_and_nothing_is_lost(
    slurm: SlurmHere, smarticles: Callable[..., str], tmp_path: Path
) -> None:
    for name, text in (("scene.yaml.j2", SCENE), ("sweep.yaml", SWEEP)):
        (tmp_path / name).write_text(text)
    (tmp_path / "here.toml").write_text(
        CLUSTER.replace("[partitions.only]", "[partitions.only]\n").replace("only", "absent")
    )
    words = ["sweep", tmp_path / "sweep.yaml", "--out", tmp_path / "out", "--submit", "slurm", "--cluster"]
    command = [sys.executable, "-m", "smarticles", *words, tmp_path / "here.toml"]
    done = slurm.ask(*map(str, command))
    assert done.returncode == 1
    assert "sbatch rejects the job: " in done.stderr
    assert "invalid partition specified: absent" in done.stderr
    assert json.loads((tmp_path / "out/jobs/001/job.json").read_text()).get("job_id") is None
    (tmp_path / "here.toml").write_text(CLUSTER)
    said = smarticles(
        "resume", tmp_path / "out", "--submit", "slurm", "--cluster", tmp_path / "here.toml", "--memory", "900"
    )
    assert "6 of 6 runs, 1 tasks of 6 runs" in said
    assert set(states(smarticles, tmp_path / "out").values()) <= {"queued", "running", "done", "failed"}
