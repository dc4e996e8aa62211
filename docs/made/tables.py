"""Tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from postprocess.report.tables import table_lines


def cell(text: str) -> str:
    """Text as it may stand in a cell: one line, and nothing in it that would end the cell or begin HTML."""
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")


def code(text: str) -> str:
    """A name as the code has it."""
    return f"`{text}`" if text else ""


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table.

    Args:
        head: titles of its columns.
        rows: cells, escaped already where they are data.
    """
    return "\n".join(table_lines(head, rows)) + "\n"
