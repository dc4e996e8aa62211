"""Job scripts: whole files compared with `tests/golden/`, read by bash and shellcheck, and run without Slurm.

Renew the golden files after a wanted change, and read the difference:  RENEW_GOLDEN=1 make unit; git diff tests/golden
"""

import os
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest

from dem.errors import InputError
from templates.slurm.cluster import Cluster, load_cluster
from templates.slurm.job import Wishes, job_name, plan_request, render_script

GOLDEN = Path(__file__).resolve().parents[2] / "golden"
PLAIN = "/home/user/sweeps/friction"
HOSTILE = '/home/us er/it\'s "$HOME" `id` & \\n #; *'
HOUR = 3600.0

CASES = {
    ("local-slurm", "hostile_path"): (HOSTILE, [HOUR] * 3, Wishes(runs_per_task=1, time="1-0")),
    ("example-large", "wishes"): (
        PLAIN,
        [60.0] * 5,
        Wishes(partition="debug", account="abc123", time="00:20:00", runs_per_task=2, memory_mib=2000),
    ),
    ("example-large", "ranks"): (PLAIN, [10 * HOUR] * 3, Wishes(ranks=96, memory_mib=20_000)),
    ("example-apptainer", "packed"): (PLAIN, [HOUR] * 72, Wishes()),
}
IDS = ["-".join(case) for case in CASES]


def rendered(cluster: str, case: str) -> str:
    path, expected, wishes = CASES[cluster, case]
    facts = load_cluster(cluster)
    return render_script(
        facts,
        plan_request(expected, facts, wishes),
        sweep=Path(path),
        number="001",
        name=job_name("friction", "0a1b2c3d"),
        count=len(expected),
        command=("smarticles",) if facts.container else ("/opt/it's here/.venv/bin/smarticles",),
    )


@pytest.mark.parametrize(("cluster", "case"), CASES, ids=IDS)
def test_scripts_are_as_reviewed(cluster: str, case: str) -> None:
    file = GOLDEN / cluster / f"{case}.sh"
    if os.environ.get("RENEW_GOLDEN"):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(rendered(cluster, case), encoding="utf-8")
    assert rendered(cluster, case) == file.read_text(encoding="utf-8")


@pytest.mark.parametrize(("cluster", "case"), CASES, ids=IDS)
def test_scripts_are_read_by_bash_and_shellcheck(cluster: str, case: str) -> None:
    file = str(GOLDEN / cluster / f"{case}.sh")
    read = subprocess.run(["bash", "-n", file], capture_output=True, text=True, check=False)
    assert (read.returncode, read.stderr) == (0, "")
    if shutil.which("shellcheck") is None:
        pytest.skip("shellcheck is not installed: apt-get install shellcheck")
    # SC2016: a path with `$` in it is meant as it stands.
    checked = subprocess.run(
        ["shellcheck", "--norc", "--exclude=SC2016", file], capture_output=True, text=True, check=False
    )
    assert (checked.returncode, checked.stdout) == (0, "")


def test_an_undefined_template_variable_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "mine.sh.j2").write_text(
        '{% extends "slurm.sh.j2" %}{% block command %}{{ super() }}echo {{ runs_per_taks }}\n{% endblock %}'
    )
    facts = load_cluster("local-slurm").model_copy(update={"template": str(tmp_path / "mine.sh.j2")})
    with pytest.raises(InputError, match=r"mine.sh.j2: 'runs_per_taks' is undefined; did you mean 'runs_per_task'\?"):
        script_of(facts, tmp_path)


def script_of(facts: Cluster, sweep: Path, count: int = 1, command: tuple[str, ...] = ("smarticles",)) -> str:
    request = plan_request([1.0] * count, facts, Wishes(runs_per_task=count, memory_mib=1))
    return render_script(facts, request, sweep=sweep, number="001", name="n.1", count=count, command=command)


def test_a_template_of_ones_own_changes_one_block(tmp_path: Path) -> None:
    (tmp_path / "mine.sh.j2").write_text(
        '{% extends "slurm.sh.j2" %}{% block environment %}{{ super() }}export MINE={{ "a b" | quote }}\n{% endblock %}'
    )
    facts = load_cluster("local-slurm").model_copy(update={"template": str(tmp_path / "mine.sh.j2")})
    assert "export MINE='a b'\nsmarticles=(smarticles)\n" in script_of(facts, tmp_path)


@pytest.mark.parametrize("name", ["a\nb", "a\rb", "a\x1bb", "a\udcffb"])
def test_a_path_that_could_end_a_comment_is_rejected(name: str) -> None:
    with pytest.raises(InputError, match="characters that cannot be printed"):
        script_of(load_cluster("local-slurm"), Path("/tmp") / name)


@pytest.mark.parametrize("name", ["a:b", "a,b"])
def test_a_path_that_apptainer_would_split_is_rejected(name: str) -> None:
    with pytest.raises(InputError, match="Apptainer's --bind"):
        script_of(load_cluster("example-apptainer"), Path("/data") / name)


@pytest.mark.parametrize(
    ("sweep", "name"),
    [("friction", "friction.0a"), ("μ = 0.2, it's", "0.2-it-s.0a"), ("$(id)\n", "id.0a"), ("✘", "sweep.0a")],
)
def test_job_names_are_plain(sweep: str, name: str) -> None:
    assert job_name(sweep, "0a") == name


# Stands for `smarticles run SCENE --out DIR [--resume]`: behaves as the run's name says.
FAKE = """\
#!/bin/bash
out=$4 name=${4#runs/}
mkdir -p "$out"
echo "$*" >>"$out/calls"
echo '{}' >"$out/run.json"
echo "$OMP_NUM_THREADS" >"$out/threads"
case $name in
done*) echo '{"status": "done"}' >"$out/done.json"; echo >"$out/ready" ;;
fail*) echo '{ "status": "failed"}' >"$out/failed.json"; exit 1 ;;
bad*) exit 2 ;;
stop*)
    trap 'echo x >"$out/checkpoint.zip"; exit 75' USR1
    echo >"$out/ready"
    while :; do sleep 0.05; done ;;
deaf*)
    trap '' USR1
    trap 'exit 130' TERM
    echo >"$out/ready"
    while :; do sleep 0.05; done ;;
esac
"""


class ByHand:
    """A rendered script, run without Slurm: `smarticles` and `scontrol` are stand-ins."""

    def __init__(self, tmp_path: Path) -> None:
        self.sweep = tmp_path / "it's $HOME"
        self.bin = tmp_path / "b in"
        for folder in (self.sweep / "jobs" / "001", self.sweep / "scenes", self.bin):
            folder.mkdir(parents=True)
        for name, text in (("smarticles", FAKE), ("scontrol", '#!/bin/bash\necho "scontrol $*"\n')):
            (self.bin / name).write_text(text)
            (self.bin / name).chmod(0o755)
        self.process: subprocess.Popen[str] | None = None

    def start(self, *runs: str, task: int = 0, restarts: int = 0, per_task: int | None = None) -> subprocess.Popen[str]:
        facts = load_cluster("local-slurm").model_copy(update={"signal_lead_s": 4})
        request = plan_request([1.0] * len(runs), facts, Wishes(runs_per_task=1, memory_mib=1))
        request = request.__class__(**{**request.__dict__, "runs_per_task": per_task or len(runs)})
        text = render_script(
            facts,
            request,
            sweep=self.sweep,
            number="001",
            name="n.1",
            count=len(runs),
            command=(str(self.bin / "smarticles"),),
        )
        place = self.sweep / "jobs" / "001"
        (place / "array.sh").write_text(text)
        (place / "runs.txt").write_text("".join(f"{run}\n" for run in runs))
        environment = {
            "PATH": f"{self.bin}:{os.environ['PATH']}",
            "SLURM_ARRAY_TASK_ID": str(task),
            "SLURM_ARRAY_JOB_ID": "77",
            "SLURM_JOB_ID": "77",  # as in the last task
            "SLURM_RESTART_COUNT": str(restarts),
        }
        return subprocess.Popen(
            ["bash", str(place / "array.sh")],
            cwd="/",
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def signal_when_ready(self, process: subprocess.Popen[str], *runs: str) -> str:
        deadline = time.monotonic() + 300
        while not all((self.sweep / "runs" / run / "ready").exists() for run in runs):
            assert time.monotonic() < deadline
            time.sleep(0.02)
        process.send_signal(signal.SIGUSR1)
        return process.communicate(timeout=300)[0]

    def calls(self, run: str) -> list[str]:
        file = self.sweep / "runs" / run / "calls"
        return file.read_text().splitlines() if file.exists() else []


@pytest.fixture
def by_hand(tmp_path: Path) -> ByHand:
    return ByHand(tmp_path)


def test_a_task_runs_its_lines_of_the_list_side_by_side(by_hand: ByHand) -> None:
    process = by_hand.start("done1", "done2", "done3", "done4", "done5", task=1, per_task=2)
    assert process.communicate(timeout=300)[0] == "task 1: 2 finished, 0 failed, 0 not finished\n"
    assert process.returncode == 0
    ran = [run for run in ("done1", "done2", "done3", "done4", "done5") if by_hand.calls(run)]
    assert ran == ["done3", "done4"]
    assert by_hand.calls("done3") == ["run scenes/done3.yaml --out runs/done3"]
    assert (by_hand.sweep / "runs/done3/threads").read_text() == "1\n"


def test_what_ended_is_passed_over_and_what_began_is_resumed(by_hand: ByHand) -> None:
    by_hand.start("done1", "fail2", "bad3").communicate(timeout=300)
    (by_hand.sweep / "runs/done1/calls").unlink()
    said = by_hand.start("done1", "fail2", "bad3").communicate(timeout=300)[0]
    assert said == "task 0: 1 finished, 1 failed, 1 not finished\n"
    assert by_hand.calls("done1") == []
    assert len(by_hand.calls("fail2")) == 1
    assert by_hand.calls("bad3")[1] == "run scenes/bad3.yaml --out runs/bad3 --resume"


def test_a_signal_reaches_every_run_and_the_task_is_queued_again(by_hand: ByHand) -> None:
    process = by_hand.start("stop1", "stop2", "done3")
    said = by_hand.signal_when_ready(process, "stop1", "stop2", "done3")
    assert said.splitlines() == [
        "task 0: 1 finished, 0 failed, 2 not finished, ended by USR1",
        "task 0: queued again",
        "scontrol requeue 77_0",
    ]
    assert process.returncode == 0


def test_a_run_that_reaches_no_checkpoint_is_ended_and_not_queued_again(by_hand: ByHand) -> None:
    process = by_hand.start("deaf1")
    said = by_hand.signal_when_ready(process, "deaf1")
    assert said.splitlines() == [
        "task 0: 0 finished, 0 failed, 1 not finished, ended by USR1",
        "task 0: not queued again: no run reached a checkpoint; ask for more --time",
    ]
    assert process.returncode == 1


def test_requeues_are_bounded(by_hand: ByHand) -> None:
    process = by_hand.start("stop1", restarts=3)
    said = by_hand.signal_when_ready(process, "stop1")
    assert "scontrol" not in said
    assert "not queued again: it was queued again 3 times; continue with smarticles resume" in said
    assert process.returncode == 1
