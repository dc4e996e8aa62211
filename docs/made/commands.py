"""The command line as it tells itself: what `--help` prints, of every command."""

from __future__ import annotations

import os

from made.tables import cell, code, table

WIDTH = "100"
"""Columns that the help is broken at, whatever the terminal of whoever builds."""


def command_list() -> str:
    """Every command in a line, linked to its help."""
    from smarticles.main import build_parser  # noqa: PLC0415

    _, commands = build_parser()
    rows = []
    for name, parser in commands.parsers.items():
        summary = (parser.description or "").partition("\n")[0].rstrip(".")
        rows.append((f"[{code(name)}](#command-{name})", cell(summary)))
    return table(("command", "what it does"), rows)


def command_help() -> str:
    """What `--help` prints, of `smarticles` and of every command."""
    os.environ["COLUMNS"] = WIDTH
    os.environ["NO_COLOR"] = "1"
    from smarticles.main import build_parser  # noqa: PLC0415

    parser, commands = build_parser()
    texts = [("smarticles", "smarticles", parser.format_help())]
    texts += [(name, f"smarticles {name}", found.format_help()) for name, found in commands.parsers.items()]
    return "\n".join(f"(command-{name})=\n## {title}\n\n```text\n{text.rstrip()}\n```\n" for name, title, text in texts)
