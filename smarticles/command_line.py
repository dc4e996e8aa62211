"""What commands share: argparse with one-line errors, common options, and aligned columns."""

from __future__ import annotations

import argparse
import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn, TypeVar

from dem.engine import ENGINES
from dem.errors import InputError, nearest

Handler = Callable[[argparse.Namespace], int]  #: Does the work of a subcommand; returns the exit status


class Parser(argparse.ArgumentParser):
    """Raises InputError, with the nearest known word, instead of printing its usage first."""

    def __init__(self, **options: Any) -> None:
        options.setdefault("formatter_class", argparse.RawDescriptionHelpFormatter)
        super().__init__(allow_abbrev=False, **options)

    def error(self, message: str) -> NoReturn:
        """Reject the command line."""
        invalid = re.search(r"invalid choice: '(.*?)' \(choose from (.*)\)", message)
        if invalid:
            known = re.findall(r"[\w-]+", invalid[2])
            what = message.partition(":")[0].removeprefix("argument ")
            message = f"{what}: {invalid[1]!r} is not known; {nearest(invalid[1], known)}"
        message = re.sub(r"invalid (?:float|int) value: ('.*')", r"\1 is not a number", message, flags=re.DOTALL)
        raise InputError(f"{message}; see `{self.prog} --help`")

    def reject_unknown(self, words: Sequence[str]) -> NoReturn:
        """Reject arguments that the command does not have."""
        word = words[0].partition("=")[0]
        if not word.startswith("-"):
            self.error(f"one argument too many: {words[0]!r}")
        options = [name for action in self._actions for name in action.option_strings]
        self.error(f"unknown option {word}; {nearest(word, options, cutoff=0.5)}")


class Commands:
    """The subcommands of the console command."""

    def __init__(self, parser: Parser) -> None:
        self._subparsers = parser.add_subparsers(dest="command", metavar="COMMAND")
        self.parsers: dict[str, Parser] = {}

    def add(self, name: str, handler: Handler, *, summary: str, text: str, examples: str) -> Parser:
        """Add a subcommand: a line for the list of commands; text and examples for its own help."""
        parser: Parser = self._subparsers.add_parser(
            name,
            help=summary,
            description=f"{summary[0].upper()}{summary[1:]}.\n\n{text.strip()}",
            epilog=f"examples:\n{examples.rstrip()}",
        )
        parser.set_defaults(handler=handler)
        add_shared(parser, "--debug", default=argparse.SUPPRESS)
        self.parsers[name] = parser
        return parser


# -- arguments ---------------------------------------------------------------------------------------------------------

Read = TypeVar("Read")


def reader(convert: Callable[[str], Read], what: str, valid: Callable[[Read], bool]) -> Callable[[str], Read]:
    """Return the reader of an argument, which rejects what cannot be converted or is not valid."""

    def read(text: str) -> Read:
        with suppress(ValueError):
            if valid(value := convert(text)):
                return value
        raise argparse.ArgumentTypeError(f"must be {what}: got {text!r}")

    return read


positive_number = reader(float, "a number above 0", lambda number: 0 < number < math.inf)
positive_int = reader(int, "a whole number from 1", lambda number: number >= 1)


# -- options that several commands have --------------------------------------------------------------------------------


_SHARED: Mapping[str, Mapping[str, Any]] = {
    "--debug": {"action": "store_true", "help": "show the traceback of an error"},
    "--json": {"action": "store_true", "help": "print JSON, for programs"},
    "--overwrite": {"action": "store_true", "help": "replace a file that exists"},
    "--jobs": {"type": positive_int, "metavar": "N", "help": "runs at once; default: one per core"},
}


def add_shared(parser: Parser, *options: str, **settings: Any) -> None:
    """Add options that several commands have, by their names."""
    for option in options:
        parser.add_argument(option, **_SHARED[option], **settings)


def add_scene(parser: Parser, what: str) -> None:
    """Add the scene, --set and --engine; `what` is what --engine sets, for the help."""
    parser.add_argument("scene", type=Path, metavar="SCENE.yaml", help="scene file")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change one key of the scene, e.g. phases.1.duration_s=2; may be repeated",
    )
    add_engine(parser, what)


def add_engine(parser: Parser, what: str) -> None:
    """Add --engine; `what` is what it sets, for the help."""
    parser.add_argument(
        "--engine",
        choices=ENGINES,
        help=f"{what}: yade, sphere chains on YADE, links, swept links, or lammps, sphere chains on several processes",
    )


def add_ranks(parser: argparse._ActionsContainer, default: str) -> None:
    """Add --ranks; `default` for the help."""
    parser.add_argument(
        "--ranks",
        type=positive_int,
        metavar="N",
        help=f"processes of engine: lammps, under mpirun, one core each; default: {default}",
    )


def scene_settings(arguments: argparse.Namespace) -> list[str]:
    """Return --set and --engine as `KEY=VALUE`."""
    settings: list[str] = list(arguments.set)
    if arguments.engine is None:
        return settings
    for setting in settings:
        key, _, value = setting.partition("=")
        if key.strip() == "engine" and value.strip() != arguments.engine:
            raise InputError(f"--engine {arguments.engine}: --set {setting} says another one; leave one of them out")
    return [*settings, f"engine={arguments.engine}"]


def reject_existing(option: str, path: Path | None, *, overwrite: bool) -> None:
    """Reject an output that exists, before the work and not after it."""
    if path is not None and path.exists() and not overwrite:
        raise InputError(f"{option} {path}: exists; choose another name or give --overwrite")


# -- output ------------------------------------------------------------------------------------------------------------


class Cell(str):
    """A number that is formatted already; aligned as numbers are."""

    __slots__ = ()

    @classmethod
    def of(cls, value: float, form: str, factor: float = 1.0) -> Cell:
        """Format a number times a factor; a dash where it is not finite."""
        return cls(f"{factor * value:{form}}" if math.isfinite(value) else "-")


def columns(header: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Return a table of aligned columns; numbers to the right, NaN and None as a dash; nothing is cut to a width."""
    cells = [[_text(value) for value in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(header, *cells, strict=True)]
    numbers = [
        bool(rows) and all(isinstance(row[k], int | float | Cell | None) for row in rows) for k in range(len(header))
    ]
    return "\n".join(
        "  ".join(
            cell.rjust(width) if number else cell.ljust(width)
            for cell, width, number in zip(line, widths, numbers, strict=True)
        ).rstrip()
        for line in [list(header), *cells]
    )


def _text(value: object) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def as_json(value: Any) -> str:
    """Return indented JSON; numbers that are not finite become null, since JSON has none."""
    return json.dumps(_finite(value), indent=2, ensure_ascii=False, default=str)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
