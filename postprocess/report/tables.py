"""Write tables to CSV files, and format tables as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import pandas as pd

from dem.errors import InputError, RunError
from dem.record.files import whole


def write_table(table: pd.DataFrame, path: Path | str, *, overwrite: bool = False) -> Path:
    """Write a table as CSV to a temporary file and rename it, so that the file is never incomplete.

    Returns:
        The path.

    Raises:
        InputError: The path does not end in `.csv`, the file exists, or its folder is missing or read-only.
        RunError: Writing fails, for example because the disk is full.
    """
    path = Path(path)
    if path.suffix != ".csv":
        raise InputError(f"cannot write table {path}: tables are CSV; let its name end in .csv")
    if path.exists() and not overwrite:
        raise InputError(f"cannot write table {path}: it exists; choose another name or ask to overwrite it")
    try:
        with whole(path, shared=True) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
            table.to_csv(file, index=False)
    except (FileNotFoundError, PermissionError) as error:
        raise InputError(f"cannot write table {path}: {error.strerror}; choose a folder that can be written") from None
    except OSError as error:  # whose text may name the temporary file
        msg = f"cannot write table {path}: {error.strerror or error}; free space or choose another folder"
        raise RunError(msg) from error
    return path


def table_lines(header: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of a Markdown table."""
    lines = [f"| {' | '.join(header)} |", "| --- " * len(header) + "|"]
    return [*lines, *(f"| {' | '.join(row)} |" for row in rows)]


def meaning_lines(file: str, meanings: Mapping[str, str]) -> list[str]:
    """Return lines of Markdown that describe the columns of a file."""
    return ["", f"Columns of `{file}`:", "", *(f"- `{name}`: {text}" for name, text in meanings.items())]
