"""Write files that appear complete or not at all, and report files that cannot be read."""

from __future__ import annotations

import contextlib
import os
import warnings
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from dem.errors import InputError, RunError
from dem.record.names import partial

if TYPE_CHECKING:
    import pandas as pd

GONE = "is gone; put it back and continue with `smarticles resume`, or start the run anew"
_CHOOSE = "or choose another --out; everything written before is whole"


@contextlib.contextmanager
def whole(path: Path, *, before: Path | None = None, shared: bool = False) -> Iterator[Path]:
    """Context manager: yield a temporary path; rename it to `path` at the end, or remove it after an error.

    An existing file is first moved to `before`, if given. With `shared` several processes may write the file at once,
    each with its own temporary path.
    """
    name = f"{path.stem}.{os.getpid()}{path.suffix}" if shared else path.name
    temporary = path.with_name(partial(name))
    try:
        yield temporary
        if before is not None and path.exists():
            os.replace(path, before)  # noqa: PTH105 - the atomic call by its name
        os.replace(temporary, path)  # noqa: PTH105
    except BaseException:
        # If this fails as well, the first error is reported.
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise


def write_whole(path: Path, write: Callable[[Path], object], *, make_folder: bool = True) -> None:
    """Write or replace a file, completely or not at all.

    `write` writes the content to a given path, which is temporary; `make_folder`: whether to make a missing folder.
    RunError if the disk is full or the folder cannot be written; an existing file is unchanged.
    """
    try:
        if make_folder:
            path.parent.mkdir(exist_ok=True)
        with whole(path) as temporary:
            write(temporary)
    except OSError as error:
        cannot_write(path, error)


def cannot_write(path: Path, error: Exception, remedy: str = _CHOOSE) -> NoReturn:
    """Raise RunError about a file of a run that cannot be written; `remedy` follows "free space"."""
    if isinstance(error, FileNotFoundError) and path.parent.is_dir():
        raise RunError(f"{path}: {GONE}") from error
    if isinstance(error, FileNotFoundError):
        raise RunError(
            f"{path}: cannot be written, its folder is gone; if it was moved, what is written in it is whole, and a "
            "run goes on from there: smarticles resume DIR"
        ) from error
    cause = getattr(error, "strerror", None) or error
    raise RunError(f"{path}: cannot be written ({cause}); free space {remedy}") from error


def write_text(path: Path, text: str, *, make_folder: bool = True) -> None:
    """Write or replace a text file in UTF-8, completely or not at all.

    `make_folder`: make a missing folder. RunError if writing fails; an existing file is then unchanged.
    """
    write_whole(path, lambda temporary: temporary.write_bytes(text.encode()), make_folder=make_folder)


def reject_inflated(archive: zipfile.ZipFile | None, most: int) -> None:
    """Raise ValueError if a ZIP archive, which may be malicious, would unpack to more than `most` bytes."""
    total = sum(member.file_size for member in archive.infolist()) if archive else 0
    if total > most:
        raise ValueError(f"it would unpack to {total} bytes, at most {most} are possible")


def read_csv(what: str, path: Path, remedy: str, **options: Any) -> pd.DataFrame:
    """Return a CSV file as a table, by `pandas.read_csv` with its options; see `cannot_read` for `what` and `remedy`.

    InputError if it cannot be read, or rows have more cells than the header has names: pandas would take the first
    cells for an index, and all columns would be those of their neighbours.
    """
    import pandas as pd  # noqa: PLC0415  (slow to import, and no run needs it)

    with warnings.catch_warnings(action="error", category=pd.errors.ParserWarning):
        try:
            return pd.read_csv(path, index_col=False, **options)
        except pd.errors.ParserWarning:
            cause = "rows have more cells than the first line has names"
            cannot_read(what, path, cause, "name each column, or take out the other cells")
        except (OSError, ValueError) as error:
            cannot_read(what, path, error, remedy)


def cannot_read(what: str, path: Path, cause: BaseException | str, remedy: str) -> NoReturn:
    """Raise InputError about a file that is missing, truncated or wrong; `what` is its kind."""
    if isinstance(cause, BaseException):
        lines = str(cause).strip().splitlines()
        named = ": ".join([type(cause).__name__, *lines[:1]])
        # The text of an OSError would repeat the path.
        cause = getattr(cause, "strerror", None) or named
    raise InputError(f"cannot read {what} {path}: {cause}; {remedy}") from None
