"""Every command, as a person sees it on small and large terminals."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from terminals import Terminal

from smarticles.main import build_parser

Type = Callable[..., Terminal]

COMMANDS = [
    "init --output new.yaml",
    "keys",
    "keys deposit",
    "schema",
    "plan scene.yaml",
    "doctor",
    "measure runs/a",
    "measure runs/a --frames",
    "compare runs/a runs/a",
    "render runs/a --output a.png",
    "export runs/a --to stl --output a.stl",
    "report runs/a --output a.html",
    "sweep sweep.yaml --dry-run",
    "status runs/a",
    "resume runs/a",
    "accuracy scene.yaml --dry-run",
]
#: Lines that a person copies are never broken, however long they are
_COPIED = ("next: ", "resume: ", '{"', " " * 2 + '"')


def fits(terminal: Terminal, columns: int) -> list[str]:
    """Return the lines that are wider than a terminal, without those that are copied."""
    plain = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", terminal.raw)
    lines = [line.rpartition("\r")[2] for line in plain.split("\r\n")]
    return [line for line in lines if len(line) > columns and not line.startswith(_COPIED)]


@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_fits_a_small_terminal(command: str, here: Path, type_command: Type) -> None:
    for file in ("new.yaml", "a.png", "a.stl", "a.html"):
        (here / file).unlink(missing_ok=True)
    with type_command(*command.split(), columns=80, rows=24) as terminal:
        status = terminal.end()
        said = "\n".join(terminal.history)
    assert status == 0, said
    assert "Traceback" not in said
    assert "internal error" not in said
    assert command.startswith("schema") or fits(terminal, 80) == []
    assert terminal.lines  # something is left to read


@pytest.mark.parametrize("columns", [80, 200])
def test_help_of_all_commands_fits(columns: int, type_command: Type) -> None:
    _, commands = build_parser()
    for name in [None, *commands.parsers]:
        with type_command(*([name] if name else []), "--help", columns=columns, rows=50) as terminal:
            assert terminal.end() == 0
        assert fits(terminal, columns) == [], name


def test_tables_are_divided_on_a_narrow_terminal_and_whole_on_a_wide_one(type_command: Type) -> None:
    shown = {}
    for columns in (60, 200):
        with type_command("measure", "runs/a", columns=columns, rows=50) as terminal:
            assert terminal.end() == 0
            shown[columns] = terminal.history
    headers = {
        columns: [line.split() for line in lines if line.startswith("phase ")] for columns, lines in shown.items()
    }
    assert len(headers[200]) == 1
    assert len(headers[60]) > 1
    # All columns are there, and each block says which phase and time a row is of.
    assert all(header[:3] == ["phase", "t", "[s]"] for header in headers[60])
    assert [word for header in headers[60] for word in header[3:]] == headers[200][0][3:]
    numbers = {columns: re.findall(r"\d+\.\d+", "\n".join(lines)) for columns, lines in shown.items()}
    assert set(numbers[200]) == set(numbers[60])


@pytest.mark.parametrize("encoding", ["latin-1", "ascii"])
def test_a_terminal_without_utf8_gets_spellings(encoding: str, here: Path, type_command: Type) -> None:
    (here / "phases.csv").unlink(missing_ok=True)
    for command in ("plan scene.yaml", "measure runs/a --table phases.csv", "keys motor", "schema", "--help"):
        with type_command(*command.split(), environment={"PYTHONIOENCODING": encoding}) as terminal:
            assert terminal.end() == 0, terminal.history
        assert terminal.raw.isascii() or encoding == "latin-1"
        assert "\\u" not in terminal.raw or command == "schema"  # escapes are for JSON
    assert "φ" not in terminal.raw
    assert (here / "phases.csv").stat().st_size > 100


def test_a_plain_terminal_gets_no_escape_codes(here: Path, type_command: Type) -> None:
    with type_command("measure", "runs/a", environment={"TERM": "dumb"}) as terminal:
        assert terminal.end() == 0
    assert "\x1b" not in terminal.raw


def test_an_error_is_broken_between_words_and_names_the_way_out(type_command: Type) -> None:
    with type_command("run", "scene.yaml", "--out", "runs/a", columns=60) as terminal:
        assert terminal.end() == 2
        lines = terminal.lines
    assert all(len(line) < 60 for line in lines)
    text = " ".join(line.strip() for line in lines)
    assert text.startswith("smarticles: error: --out runs/a: holds a run")
    assert "--resume" in text
