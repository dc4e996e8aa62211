"""Text for terminals, logs and pipes alike: nothing is cut to a width."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path


class Cell(str):
    """A number that is written as wanted already; aligned as numbers are."""

    __slots__ = ()


def columns(header: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """A table of aligned columns; numbers to the right, NaN and None as a dash."""
    cells = [[_text(value) for value in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(header, *cells, strict=True)]
    right = [
        bool(rows) and all(isinstance(row[k], int | float | Cell | None) for row in rows) for k in range(len(header))
    ]
    lines = [
        "  ".join(
            cell.rjust(width) if flush else cell.ljust(width)
            for cell, width, flush in zip(line, widths, right, strict=True)
        ).rstrip()
        for line in [list(header), *cells]
    ]
    return "\n".join(lines)


def _text(value: object) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def told_results(table: str, told: Sequence[str], files: Mapping[str, Path], output: Path) -> str:
    """What an analysis says at the terminal: its table, its sentences, and where the rest is."""
    figures = [f"figure: {path}" for path in files.values() if path.suffix == ".png"]
    return "\n".join([table, "", *told, "", *figures, f"tables, and the origin of every number: {output}"])
