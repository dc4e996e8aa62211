"""Write tables and other files so that no incomplete file is left, and format tables as Markdown."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import pandas as pd

from dem.errors import InputError, RunError
from dem.record.files import whole


@contextmanager
def whole_file(path: Path, *, overwrite: bool = True) -> Iterator[Path]:
    """Yield a temporary path, and rename this file to `path` when the block ends without an error.

    InputError if the file exists and must not be replaced, or its folder is missing or read-only; RunError if writing
    fails.
    """
    reject_existing(path, overwrite=overwrite)
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist: create it or choose another output")
    try:
        with whole(path, shared=True) as temporary:
            yield temporary
    except OSError as error:  # whose text may name the temporary file
        msg = f"{path}: cannot be written ({error.strerror or error}); free space or choose another output"
        raise (InputError if isinstance(error, PermissionError) else RunError)(msg) from error


def reject_existing(path: Path, *, overwrite: bool) -> None:
    """Check that an output does not exist, unless it may be replaced; InputError if it does."""
    if path.exists() and not overwrite:
        msg = f"{path}: exists already and is left as it is; choose another name, or let it be replaced (--overwrite)"
        raise InputError(msg)


def write_table(table: pd.DataFrame, path: Path | str, *, overwrite: bool = False) -> Path:
    """Write a table as CSV, and return its path.

    InputError unless the path ends in `.csv`; `whole_file` states the other errors.
    """
    path = Path(path)
    if path.suffix != ".csv":
        raise InputError(f"cannot write table {path}: tables are CSV; let its name end in .csv")
    with whole_file(path, overwrite=overwrite) as temporary:
        table.to_csv(temporary, index=False)
    return path


def table_lines(header: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of a Markdown table."""
    lines = [f"| {' | '.join(header)} |", "| --- " * len(header) + "|"]
    return [*lines, *(f"| {' | '.join(row)} |" for row in rows)]


def meaning_lines(file: str, meanings: Mapping[str, str]) -> list[str]:
    """Return lines of Markdown that list the columns of a file with their meanings.

    `file` is the name of the file; `meanings` maps the names of its columns to their meanings.
    """
    return ["", f"Columns of `{file}`:", "", *(f"- `{name}`: {text}" for name, text in meanings.items())]
