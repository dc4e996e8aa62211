"""Lines of the texts that studies write: tables, findings, and what columns mean."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence


def table_lines(header: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """A table."""
    lines = [f"| {' | '.join(header)} |", "| --- " * len(header) + "|"]
    return [*lines, *(f"| {' | '.join(row)} |" for row in rows)]


def meaning_lines(file: str, meanings: Mapping[str, str]) -> list[str]:
    """What the columns of a file are."""
    return ["", f"What the columns of `{file}` are:", "", *(f"- `{name}`: {told}" for name, told in meanings.items())]
