"""Workflows of a sweep for Snakemake and row: run by the tool where it is installed, else by their own shell lines."""

import os
import re
import shlex
import shutil
import string
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from smarticles.main import main
from templates import workflow

SCENE = "schema_version: 1\nengine: links\nseed: 1\ncount: {{ count }}\nphases: [{type: deposit}]\n"
SWEEP = """\
schema_version: 1
name: two counts
template: scene.yaml.j2
run_name: "n_{{ count }}"
points: {grid: {count: [5, 6]}}
"""
# Stands for `smarticles`: writes its words, and ends like a run, or fails for n_6 at the first time.
STUB = """\
import pathlib, sys
out = pathlib.Path(sys.argv[4])
print(sys.argv[1:], "threads", __import__("os").environ["OMP_NUM_THREADS"])
first = not (out / "run.json").exists()
assert first or "--resume" in sys.argv
out.mkdir(exist_ok=True)
(out / "run.json").write_text("{}")
if first and out.name == "n_6":
    sys.exit(1)
(out / "done.json").write_text("{}")
"""


def tool(name: str) -> str | None:
    return shutil.which(name, path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")


@pytest.fixture
def sweep(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Path]:
    """Writes the workflow of a sweep of two runs for a tool, and returns the directory of the sweep."""
    stub = tmp_path / "it's smarticles.py"
    stub.write_text(STUB, encoding="utf-8")
    monkeypatch.setattr(workflow, "smarticles_words", lambda: (sys.executable, str(stub)))
    (tmp_path / "scene.yaml.j2").write_text(SCENE, encoding="utf-8")
    (tmp_path / "sweep.yaml").write_text(SWEEP, encoding="utf-8")

    def write(to: str) -> Path:
        assert main(["sweep", str(tmp_path / "sweep.yaml"), "--out", str(tmp_path / "a b"), "--to", to]) == 0
        return tmp_path / "a b"

    return write


def states(folder: Path) -> dict[str, bool]:
    return {path.name: (path / "done.json").exists() for path in sorted((folder / "runs").iterdir())}


def bash(line: str, folder: Path) -> int:
    return subprocess.run(["bash", "-euo", "pipefail", "-c", line], cwd=folder, check=False).returncode


def test_row_reads_the_keys_of_its_format(sweep: Callable[[str], Path]) -> None:
    content = tomllib.loads((sweep("row") / "workflow.toml").read_text(encoding="utf-8"))
    (action,) = content.pop("action")
    assert content == {"workspace": {"path": "runs"}}
    assert action.pop("command").count("{directory}") == 4
    assert action == {
        "name": "run",
        "products": ["done.json"],
        "group": {"maximum_size": 1},
        "resources": {
            "processes": {"per_directory": 1},
            "threads_per_process": 1,
            "memory_per_cpu_mb": 1024,
            "walltime": {"per_directory": "00:10:00"},
        },
    }


def test_the_command_of_row_starts_and_resumes_runs(sweep: Callable[[str], Path]) -> None:
    folder = sweep("row")
    assert states(folder) == {"n_5": False, "n_6": False}  # row finds them by their directories
    command = tomllib.loads((folder / "workflow.toml").read_text(encoding="utf-8"))["action"][0]["command"]

    def run(name: str) -> int:
        return bash(command.replace("{directory}", name) + " || exit 2", folder)  # as row writes it into a script

    assert [run("n_5"), run("n_6")] == [0, 2]
    assert states(folder) == {"n_5": True, "n_6": False}
    assert run("n_6") == 0
    first, second = (folder / "logs" / "n_6.txt").read_text(encoding="utf-8").splitlines()
    assert first == "['run', 'scenes/n_6.yaml', '--out', 'runs/n_6'] threads 1"
    assert second == "['run', 'scenes/n_6.yaml', '--out', 'runs/n_6', '--resume'] threads 1"


class ShellFormatter(string.Formatter):
    """Formats a shell line as Snakemake does: `q` quotes for the shell."""

    def format_field(self, value: object, format_spec: str) -> str:
        return shlex.quote(str(value)) if format_spec == "q" else str(value)


def test_the_shell_line_of_snakemake_starts_and_resumes_runs(
    sweep: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = sweep("snakemake")
    text = (folder / "Snakefile").read_text(encoding="utf-8")
    monkeypatch.chdir(folder)
    known: dict[str, object] = {}
    exec(text.partition("rule all:")[0], known)  # the part that is plain Python
    assert list(known["RUNS"]) == ["n_5", "n_6"]
    (runtime,) = re.findall(r"runtime=(lambda .*?),  #", text)
    line = "".join(re.findall(r'"(.*)"', text.partition("    shell:\n")[2]))

    def run(name: str) -> int:
        wildcards = SimpleNamespace(name=name)
        assert eval(runtime, known)(wildcards) == 11
        words = {"input": f"scenes/{name}.yaml", "log": f"logs/{name}.txt", "wildcards": wildcards}
        return bash(ShellFormatter().format(line, **words, SMARTICLES=known["SMARTICLES"]), folder)

    assert [run("n_5"), run("n_6"), run("n_6")] == [0, 1, 0]
    assert states(folder) == {"n_5": True, "n_6": True}
    assert "--resume" in (folder / "logs" / "n_6.txt").read_text(encoding="utf-8").splitlines()[1]


@pytest.mark.parametrize(
    ("to", "words"),
    [
        ("snakemake", ("snakemake", "--cores", "1", "--keep-going", "--rerun-incomplete")),
        ("row", ("row", "submit", "--cluster", "none", "--yes")),
    ],
)
def test_the_tool_computes_all_runs(sweep: Callable[[str], Path], to: str, words: tuple[str, ...]) -> None:
    program = tool(to)
    if program is None:
        pytest.skip(f"{to} is not installed; its shell lines are tested above")
    folder = sweep(to)
    for done in ({"n_5": True, "n_6": False}, {"n_5": True, "n_6": True}):
        subprocess.run([program, *words[1:]], cwd=folder, check=False, timeout=120)
        assert states(folder) == done


def test_a_workflow_is_printed_kept_and_not_mixed_with_jobs(
    sweep: Callable[[str], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["sweep", str(tmp_path / "sweep.yaml"), "--out", str(tmp_path / "new")]
    assert main([*words, "--to", "row", "--dry-run"]) == 0
    assert "--- workflow.toml\n# Runs of the sweep two counts under row" in capsys.readouterr().out
    assert not (tmp_path / "new").exists()
    assert main([*words, "--to", "row", "--submit", "local"]) == 2
    assert "--to row: leaves the start of the runs to this tool; leave --submit" in capsys.readouterr().err
    folder = sweep("snakemake")
    assert f"Snakefile: 2 runs; start them: cd '{folder}' && snakemake --cores all" in capsys.readouterr().out
    assert sweep("snakemake") == folder  # repeated
    (folder / "Snakefile").write_text("mine", encoding="utf-8")
    with pytest.raises(AssertionError):
        sweep("snakemake")
    assert "Snakefile: exists and differs from what --to snakemake writes; use it" in capsys.readouterr().err
    assert (folder / "Snakefile").read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize(("seconds", "text"), [(600, "00:10:00"), (90000, "1 days, 01:00:00")])
def test_times_for_row(seconds: int, text: str) -> None:
    assert workflow._walltime(seconds) == text
