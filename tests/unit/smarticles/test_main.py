"""The command line: help, rejections, and what becomes of errors."""

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from command_cases import Smarticles

from dem.errors import InputError, RunError
from smarticles.command_line import Cell, column_blocks, columns
from smarticles.main import build_parser, guarded, orderly_stop

COMMANDS = build_parser()[1].parsers


@pytest.mark.parametrize("command", sorted(COMMANDS))
def test_examples_of_the_help_are_accepted(
    command: str, smarticles: Smarticles, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    said = smarticles(command, "--help")
    assert (said.status, said.err) == (0, "")
    examples = said.out.partition("examples:\n")[2].splitlines()
    assert examples
    for line in examples:
        assert line.startswith(f"  smarticles {command}")
        words = line.split("  |")[0].split(" | ")[0].split(" > ")[0].strip().split("   ")[0].split()
        parsed, unknown = build_parser()[0].parse_known_args(words[1:])
        assert (parsed.command, unknown) == (command, [])


@pytest.mark.parametrize(("words", "message"), [
    (("view", "runs/a", "--color-by", "speed"), "unknown option --color-by; known: -h, --help, --debug, --port, "),
    (("view", "runs/a", "--time", "1"), "unknown option --time; known: "),
    (("view", "runs/a", "--prot", "1"), "unknown option --prot; did you mean '--port'?"),
    (("export", "runs/a", "--to", "xyz"), "--to xyz: no such format; use gsd, a trajectory"),
    (("export", "runs/a", "--to", ".PLY"), "--to .PLY: no such format; use glb or obj"),
    (("export", "runs/a", "--to", "ro-creat"), "--to ro-creat: no such format; did you mean 'ro-crate'?"),
])  # fmt: skip
def test_a_wrong_word_gets_the_nearest_right_one(smarticles: Smarticles, words: tuple[str, ...], message: str) -> None:
    said = smarticles(*words)
    assert said.status == 2
    assert message in said.err


def test_help_lists_the_commands_and_the_exit_status(smarticles: Smarticles) -> None:
    said = smarticles("--help")
    assert said.status == 0
    assert all(f"\n    {command} " in said.out for command in COMMANDS)
    assert "exit status: 0 done; 1 the run failed; 2 bad input or usage" in " ".join(said.out.split())


@pytest.mark.parametrize(
    ("words", "wrong", "way_out"),
    [
        ([], "command", "known: init, keys, schema, run, plan, "),
        (["stduy"], "COMMAND: 'stduy'", "'study'"),
        (["run"], "SCENE.yaml, --out", ""),
        (["run", "s.yaml", "--out", "d", "--sett", "a=1"], "--sett", "'--set'"),
        (["study", "gravitsh", "--out", "d"], "NAME: 'gravitsh'", "'gravish'"),
        (["sweep", "s.yaml", "--submit", "slrum"], "--submit: 'slrum'", "'slurm'"),
        (["resume", "d", "--jobs", "0"], "--jobs", "from 1: got '0'"),
        (["render", "d", "--time", "end"], "--time", "'end'"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_bad_usage_is_status_2_and_one_line(words: list[str], wrong: str, way_out: str, smarticles: Smarticles) -> None:
    said = smarticles(*words)
    assert (said.status, said.out) == (2, "")
    (line,) = said.err.splitlines()
    assert wrong in line
    assert way_out in line
    assert line.endswith("--help`")


@pytest.mark.parametrize(
    ("error", "status", "line"),
    [
        (InputError("count: -1"), 2, "error: count: -1"),
        (RunError("left through\n the wall"), 1, "error: left through the wall"),
        (KeyboardInterrupt(), 130, "stopped; all written files are complete; repeat the command to go on"),
        (KeyboardInterrupt("go on with: x"), 130, "stopped; go on with: x"),
        (
            OSError(28, "No space left on device", "/d/x.csv"),
            1,
            "error: /d/x.csv: No space left on device; free space, or check the path and its permissions",
        ),
        (
            ModuleNotFoundError("No module named 'pandas'", name="pandas"),
            2,
            "error: the Python package 'pandas' is missing; install it: pip install smarticles, "
            "or `make setup` in the repository",
        ),
        (
            ZeroDivisionError("division by zero"),
            1,
            "error: internal error, ZeroDivisionError: division by zero; "
            "please report it with the output of the same command with --debug",
        ),
    ],
)
def test_errors_have_a_status_and_a_message(
    error: BaseException, status: int, line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    def action() -> int:
        raise error

    assert guarded(action) == status
    assert capsys.readouterr() == ("", f"smarticles: {line}\n")


def test_control_characters_reach_the_terminal_as_escapes(tmp_path: Path, smarticles: Smarticles) -> None:
    scene = tmp_path / "scene.yaml"
    name = r"\e[2J\a\rme\u202e\u009b"
    scene.write_text(
        f'{{schema_version: 1, name: "{name}", seed: 1, count: 9, phases: [{{type: deposit}}], engine: links}}'
    )
    said = smarticles("plan", str(scene))
    assert said.out.startswith(r"\x1b[2J\x07\x0dme\u202e\x9b: 9 smarticles of ")
    for words in (["plan", "\x1b]0;title\x07"], ["\x1b[1m"], ["plan", str(scene), "--set", "\x1b[1m=2"]):
        said = smarticles(*words)
        assert said.status == 2
        assert r"\x1b" in said.err
        assert not set("\x1b\x07\r").intersection(said.out + said.err)


@pytest.mark.parametrize("words", [["--debug", "plan", "absent.yaml"], ["plan", "absent.yaml", "--debug"]])
def test_debug_may_stand_before_and_after_the_command(words: list[str], smarticles: Smarticles) -> None:
    said = smarticles(*words)
    assert said.status == 2
    assert "Traceback" in said.err
    assert said.err.startswith("smarticles: error: absent.yaml: ")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signals_stop_in_an_orderly_way(number: signal.Signals, request: pytest.FixtureRequest) -> None:
    # Under nohup hanging up is ignored, and stays so.
    if signal.getsignal(number) is signal.SIG_IGN:
        request.addfinalizer(lambda: signal.signal(number, signal.SIG_IGN))
        signal.signal(number, signal.SIG_DFL)
    before = signal.getsignal(number)

    def action() -> int:
        os.kill(os.getpid(), number)
        threading.Event().wait(300)
        return 0

    assert guarded(action) == 130
    assert signal.getsignal(number) is before


class Signalled:
    """An object that is destroyed while a signal comes."""

    def __del__(self) -> None:
        signal.raise_signal(signal.SIGINT)


def test_a_signal_within_a_destructor_is_not_lost() -> None:
    def action() -> int:
        Signalled()
        threading.Event().wait(300)
        return 0

    assert guarded(action) == 130


def test_ignored_signals_stay_ignored_here_but_not_in_children() -> None:
    ask = "import signal; print(signal.getsignal(signal.SIGHUP) is signal.SIG_IGN)"
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with orderly_stop():
            os.kill(os.getpid(), signal.SIGHUP)
            child = subprocess.run([sys.executable, "-I", "-S", "-c", ask], capture_output=True, check=True, text=True)
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)
    assert child.stdout == "False\n"


def command(*words: str) -> list[str]:
    return [sys.executable, "-m", "smarticles", *words]


SIGNALLED = """
import os, runpy, signal, sys

class Finder:
    def find_spec(self, name, path, target=None):
        if name == "smarticles.main":
            os.kill(os.getpid(), signal.SIGUSR1)

sys.meta_path.insert(0, Finder())
runpy.run_module("smarticles", run_name="__main__")
"""


@pytest.mark.parametrize(("name", "status"), [("run", 2), ("resume", 2), ("plan", -signal.SIGUSR1)])
def test_sigusr1_during_imports_ends_no_run(name: str, status: int, tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text("{}")  # makes it a run directory, without a scene
    words = [str(tmp_path), *(["--out", "out"] if name == "run" else [])]
    ended = subprocess.run([sys.executable, "-c", SIGNALLED, name, *words], capture_output=True, text=True, check=False)
    assert (ended.returncode, str(tmp_path) in ended.stderr) == (status, status == 2)


def test_a_closed_pipe_is_no_error() -> None:
    process = subprocess.Popen(command("schema"), stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.close()
    with process.stderr as stream:
        assert stream.read() == b""
    assert process.wait() == 141


def test_nothing_heavy_is_imported_to_show_help() -> None:
    script = (
        "import sys; from smarticles.main import main; main(['--help']); "
        "print([name for name in ('yade', 'pyvista', 'pandas', 'numpy', 'pydantic', 'rich') "
        "if name in sys.modules], file=sys.stderr)"
    )
    answer = subprocess.run([sys.executable, "-c", script], capture_output=True, check=True, text=True)
    assert answer.stderr == "[]\n"


def test_columns_of_numbers_are_aligned_to_the_right() -> None:
    text = columns(["name", "value", "note"], [["a", 1.23456, "x y"], ["long", None, ""], ["b", float("nan"), ""]])
    assert text.splitlines() == ["name  value  note", "a     1.235  x y", "long      -", "b         -"]
    assert columns(["φ"], [[Cell("0.10")], [Cell("-")]]).splitlines() == ["   φ", "0.10", "   -"]


def test_a_standard_error_stays_beside_its_value_on_a_narrow_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("smarticles.command_line.screen_width", lambda: 26)
    header = ["run", "phi", "± SE", "height", "± SE", "n"]
    blocks = column_blocks(header, [["a", 0.125, 0.001, 0.25, 0.002, 3]])
    assert [block[0].split() for block in blocks] == [["run", "phi", "±", "SE"], ["run", "height", "±", "SE", "n"]]
