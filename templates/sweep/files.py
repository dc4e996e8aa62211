"""Text files in, CSV read strictly."""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path

from dem.errors import InputError

IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")


def read_text(path: Path, what: str) -> str:
    """Text of a file.

    Raises:
        InputError: the file cannot be read, or is not UTF-8 text.
    """
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        msg = f"{path}: not UTF-8 text (byte {error.start}); a {what} is a text file"
        raise InputError(msg) from error
    except OSError as error:
        msg = f"{path}: cannot read the {what}: {error.strerror}; check the path"
        raise InputError(msg) from error


def parse_table(text: str, source: str) -> list[dict[str, int | float | str]]:
    """Rows of a CSV text whose first line names the columns; cells are numbers where they can be.

    Raises:
        InputError: no rows, a bad column name, a row of another length, an empty cell.
    """
    rows = [row for row in csv.reader(io.StringIO(text)) if row]
    if len(rows) < 2:
        msg = f"{source}: the table has no rows; the first line names the columns, rows follow"
        raise InputError(msg)
    header = [name.strip() for name in rows[0]]
    for name in header:
        if not IDENTIFIER.match(name) or header.count(name) > 1:
            msg = (
                f"{source}, line 1: column {name!r} cannot be a variable; column names are "
                "letters, digits and _, each once"
            )
            raise InputError(msg)
    table = []
    for number, row in enumerate(rows[1:], start=2):
        if len(row) != len(header) or not all(cell.strip() for cell in row):
            msg = f"{source}, row {number}: expected {len(header)} filled cells ({', '.join(header)}): got {row!r}"
            raise InputError(msg)
        table.append({name: _cell(cell.strip()) for name, cell in zip(header, row, strict=True)})
    return table


def _cell(text: str) -> int | float | str:
    for convert in (int, float):
        try:
            return convert(text)
        except ValueError:
            continue
    return text
