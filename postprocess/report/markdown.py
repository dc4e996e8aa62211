"""Write tables and the meanings of columns as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence


def table_lines(header: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of a table."""
    lines = [f"| {' | '.join(header)} |", "| --- " * len(header) + "|"]
    return [*lines, *(f"| {' | '.join(row)} |" for row in rows)]


def meaning_lines(file: str, meanings: Mapping[str, str]) -> list[str]:
    """Return lines that say what the columns of a file are."""
    return ["", f"What the columns of `{file}` are:", "", *(f"- `{name}`: {text}" for name, text in meanings.items())]
