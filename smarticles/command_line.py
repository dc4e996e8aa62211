"""Parse command lines with one-line errors; define common options; format tables and JSON."""

import argparse
import difflib
import json
import math
import re
import shutil
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from textwrap import fill, wrap
from typing import Any, NoReturn, Self, TypeVar

from dem.engine import ENGINES
from dem.errors import InputError, nearest
from dem.terminal import folded, screen_width, writes_unicode

_WIDEST = 110  # characters of a line of help

Handler = Callable[[argparse.Namespace], int]  #: Function that runs a subcommand and returns the exit status


class _HelpFormatter(argparse.RawDescriptionHelpFormatter):
    """Formatter that fits paragraphs of descriptions to the terminal; those with indented lines keep their lines."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, width=min(shutil.get_terminal_size().columns, _WIDEST) - 1)

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        paragraphs = text.split("\n\n")
        return "\n\n".join(
            folded(paragraph, width=shutil.get_terminal_size().columns)
            if re.search(r"^ ", paragraph, re.MULTILINE)
            else fill(paragraph, width, break_on_hyphens=False)
            for paragraph in paragraphs
        )


class Parser(argparse.ArgumentParser):
    """Argument parser that raises InputError, which names the nearest known word, instead of exiting."""

    def __init__(self, **options: Any) -> None:
        options.setdefault("formatter_class", _HelpFormatter)
        super().__init__(allow_abbrev=False, **options)

    def error(self, message: str) -> NoReturn:
        """Reword an error message of argparse, and raise it as InputError."""
        invalid = re.search(r"invalid choice: '(.*?)' \(choose from (.*)\)", message)
        if invalid:
            known = re.findall(r"[\w-]+", invalid[2])
            what = message.partition(":")[0].removeprefix("argument ")
            message = f"{what}: {invalid[1]!r} is not known; {nearest(invalid[1], known)}"
        message = re.sub(r"invalid (?:float|int) value: ('.*')", r"\1 is not a number", message, flags=re.DOTALL)
        raise InputError(f"{message}; see `{self.prog} --help`")

    def reject_unknown(self, words: Sequence[str]) -> NoReturn:
        """Raise InputError for the first of several unknown arguments."""
        word = words[0].partition("=")[0]
        if not word.startswith("-"):
            self.error(f"one argument too many: {words[0]!r}")
        # Compared without dashes, which all options have in common.
        options = {name.lstrip("-"): name for action in self._actions for name in action.option_strings}
        near = difflib.get_close_matches(word.lstrip("-"), options, n=1)
        advice = f"did you mean {options[near[0]]!r}?" if near else f"known: {', '.join(options.values())}"
        self.error(f"unknown option {word}; {advice}")


class Commands:
    """Subcommands of `smarticles`, with their parsers by name."""

    def __init__(self, parser: Parser) -> None:
        self._subparsers = parser.add_subparsers(dest="command", metavar="COMMAND")
        self.parsers: dict[str, Parser] = {}

    def add(self, name: str, handler: Handler, *, summary: str, text: str, examples: str) -> Parser:
        """Add a subcommand and return its parser.

        `handler` runs the command. `summary` is for the list of commands, `text` and `examples` for `--help`.
        """
        parser: Parser = self._subparsers.add_parser(
            name,
            help=summary,
            description=f"{summary[0].upper()}{summary[1:]}.\n\n{text.strip()}",
            epilog=f"examples:\n{examples.rstrip()}",
        )
        parser.set_defaults(handler=handler)
        add_options(parser, "--debug", default=argparse.SUPPRESS)
        self.parsers[name] = parser
        return parser


# -- arguments ---------------------------------------------------------------------------------------------------------

Read = TypeVar("Read")


def reader(convert: Callable[[str], Read], what: str, valid: Callable[[Read], bool]) -> Callable[[str], Read]:
    """Return a `type` for argparse that reads an argument by `convert` and checks its value by `valid`.

    `what` describes valid values in the message of the error.
    """

    def read(text: str) -> Read:
        with suppress(ValueError):
            if valid(value := convert(text)):
                return value
        raise argparse.ArgumentTypeError(f"must be {what}: got {text!r}")

    return read


positive_number = reader(float, "a number above 0", lambda number: 0 < number < math.inf)
positive_int = reader(int, "a whole number from 1", lambda number: number >= 1)


def names(text: str) -> tuple[str, ...]:
    """Split a comma-separated argument into its names."""
    return tuple(name.strip() for name in text.split(",") if name.strip())


# -- options that several commands have --------------------------------------------------------------------------------

_ENGINES_HELP = "yade (sphere chains on YADE), links (swept links) or lammps (sphere chains on several processes)"

_OPTIONS: Mapping[str, Mapping[str, Any]] = {
    "directory": {"type": Path, "metavar": "DIR", "help": "run directory"},
    "scene": {"type": Path, "metavar": "SCENE.yaml", "help": "scene file"},
    "--analyse": {"action": "store_true", "help": "start no run; analyse the finished runs"},
    "--color-by": {"metavar": "FIELD"},
    "--debug": {"action": "store_true", "help": "show the traceback of an error"},
    "--dry-run": {"action": "store_true"},
    "--engine": {"choices": ENGINES, "help": f"replace the engine that the scene names: {_ENGINES_HELP}"},
    "--jobs": {"type": positive_int, "metavar": "N", "help": "number of simultaneous runs; default: one per core"},
    "--json": {"action": "store_true", "help": "print JSON, for programs"},
    "--out": {"type": Path, "metavar": "DIR"},
    "--output": {"type": Path, "metavar": "FILE"},
    "--overwrite": {"action": "store_true", "help": "replace an existing file"},
    "--ranks": {
        "type": positive_int,
        "metavar": "N",
        "help": "MPI processes of engine lammps, one core each; default: 1, with resume the number at the start",
    },
    "--set": {
        "action": "append",
        "default": [],
        "metavar": "KEY=VALUE",
        "help": "change one key of the scene, e.g. phases.1.duration_s=2; may be repeated",
    },
    "--submit": {
        "choices": ("none", "local", "slurm"),
        "help": "none: write the files only; local: compute on this machine, one run per core; slurm: submit a job",
    },
    "--table": {"type": Path, "metavar": "FILE.csv"},
    "--threads": {"type": positive_int, "metavar": "N"},
    "--time": {"type": float, "metavar": "S", "help": "simulated time [s]; the nearest frame is used; default: last"},
}
"""Names of arguments and options that several commands have, with their settings for argparse."""


def add_options(parser: argparse._ActionsContainer, *options: str, **settings: Any) -> None:
    """Add arguments and options to a parser, by their names in `_OPTIONS`.

    `settings` are settings for argparse. They apply to all these options and take precedence over those in `_OPTIONS`.
    """
    for option in options:
        parser.add_argument(option, **{**_OPTIONS[option], **settings})


def scene_settings(arguments: argparse.Namespace) -> list[str]:
    """Return --set and --engine as a list of `KEY=VALUE`; InputError if they name different engines."""
    settings: list[str] = list(arguments.set)
    if arguments.engine is None:
        return settings
    for setting in settings:
        key, _, value = setting.partition("=")
        if key.strip() == "engine" and value.strip() != arguments.engine:
            raise InputError(f"--engine {arguments.engine}: --set {setting} names another engine; omit one of them")
    return [*settings, f"engine={arguments.engine}"]


def reject_existing(option: str, path: Path | None, *, overwrite: bool) -> None:
    """Raise InputError, before a computation, if the file of an output option exists and must be kept."""
    if path is not None and path.exists() and not overwrite:
        raise InputError(f"{option} {path}: exists; choose another name or give --overwrite")


# -- output ------------------------------------------------------------------------------------------------------------


_LEAST_TEXT = 24  # characters that a column of text must have on the screen to be broken into lines
_OF_THE_COLUMN_BEFORE = ("± SE", "n")  #: Headings of columns that are about the column to their left


class Cell(str):
    """Formatted number in a table: a text that `columns` aligns to the right."""

    __slots__ = ()

    @classmethod
    def of(cls, value: float, form: str, factor: float = 1.0) -> Self:
        """Format `factor * value` by the format `form`, such as ".3g"; return a dash if it is not finite."""
        return cls(f"{factor * value:{form}}" if math.isfinite(value) else "-")


def columns(header: Sequence[str], rows: Sequence[Sequence[object]], *, keys: int = 1) -> str:
    """Return a table with aligned columns, which fits a terminal; elsewhere it has any width.

    Columns of numbers are aligned to the right; NaN and None become dashes. Where the terminal is too narrow, the last
    column is broken into lines if it has text, otherwise the table is divided into blocks, which repeat the first
    `keys` columns.
    """
    return "\n\n".join("\n".join(block) for block in column_blocks(header, rows, keys=keys))


def column_blocks(header: Sequence[str], rows: Sequence[Sequence[object]], *, keys: int = 1) -> list[list[str]]:
    """Return the lines of a table of `columns`, block by block: the header, then a text for each row."""
    cells = [[format_cell(value) for value in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(header, *cells, strict=True)]
    numbers = [
        bool(rows) and all(isinstance(row[k], int | float | Cell | None) for row in rows) for k in range(len(header))
    ]
    screen = screen_width()
    before_last = sum(width + 2 for width in widths[:-1])
    folds = screen is not None and not numbers[-1] and screen - before_last >= _LEAST_TEXT

    def line(texts: Sequence[str], shown: Sequence[int]) -> str:
        aligned = (texts[k].rjust(widths[k]) if numbers[k] else texts[k].ljust(widths[k]) for k in shown)
        text = "  ".join(aligned).rstrip()
        if not folds or screen is None or len(text) <= screen:
            return text
        lines = wrap(texts[-1], screen - before_last, break_on_hyphens=False)
        return text[:before_last] + f"\n{' ' * before_last}".join(lines)

    every = list(range(len(header)))
    blocks = [every] if screen is None or folds else _blocks(header, widths, keys, screen)
    return [[line(texts, shown) for texts in [list(header), *cells]] for shown in blocks]


def _blocks(header: Sequence[str], widths: Sequence[int], keys: int, screen: int) -> list[list[int]]:
    """Divide columns of these widths into blocks that fit a screen; each begins with the first `keys` columns.

    Columns of `_OF_THE_COLUMN_BEFORE` stay in the block of the column to their left.
    """
    groups: list[list[int]] = []
    for k in range(keys, len(widths)):
        if groups and header[k] in _OF_THE_COLUMN_BEFORE:
            groups[-1].append(k)
        else:
            groups.append([k])
    blocks = [list(range(keys))]
    for group in groups:
        if len(blocks[-1]) > keys and sum(widths[k] + 2 for k in [*blocks[-1], *group]) - 2 > screen:
            blocks.append(list(range(keys)))
        blocks[-1] += group
    return blocks


def format_cell(value: object) -> str:
    """Format a value of a table: numbers with four digits, None and NaN as a dash."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def as_json(value: Any) -> str:
    """Return indented JSON; NaN and infinite numbers become null, since JSON cannot represent them.

    Characters that standard output cannot write become escapes of JSON.
    """
    return json.dumps(_finite(value), indent=2, ensure_ascii=not writes_unicode(sys.stdout), default=str)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
