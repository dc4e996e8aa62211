"""Completion of the command line in a shell: a script made from the parser, by shtab."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

SHELLS = ("bash", "zsh")


class PrintCompletion(argparse.Action):
    """`--completion SHELL`: prints the script and ends the program."""

    def __call__(
        self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: Any, option: str | None = None
    ) -> None:
        """Print the script of a shell."""
        print(script(parser, str(values)))
        parser.exit(0)


def add_completion(parser: argparse.ArgumentParser) -> None:
    """Add --completion."""
    parser.add_argument(
        "--completion",
        choices=SHELLS,
        action=PrintCompletion,
        metavar="SHELL",
        help=f"print the completion script of a shell ({', '.join(SHELLS)}) and end",
    )


def script(parser: argparse.ArgumentParser, shell: str) -> str:
    """The completion script of a shell; arguments that are paths complete to files, or to directories.

    Args:
        parser: of the whole command.
        shell: one of `SHELLS`.
    """
    import shtab  # noqa: PLC0415  (the only place that needs it)

    for action in _actions(parser):
        if action.type is Path:
            action.complete = shtab.DIRECTORY if "DIR" in str(action.metavar) else shtab.FILE  # type: ignore[attr-defined]
    return str(shtab.complete(parser, shell))


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """The arguments of a parser and of its subcommands."""
    actions: Sequence[argparse.Action] = parser._actions
    for action in actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for child in action.choices.values():
                yield from _actions(child)
