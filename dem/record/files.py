"""Files that appear whole or not at all, and the error about a file that cannot be read."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NoReturn

from dem.errors import InputError, RunError
from dem.record.names import partial


@contextlib.contextmanager
def whole(path: Path, *, before: Path | None = None, shared: bool = False) -> Iterator[Path]:
    """Yield a temporary path beside `path`, renamed to it when the block ends well, removed otherwise.

    Args:
        before: where the replaced file is kept; None: nowhere.
        shared: whether several processes may write the file at once.
    """
    name = f"{path.stem}.{os.getpid()}{path.suffix}" if shared else path.name
    temporary = path.with_name(partial(name))
    try:
        yield temporary
        if before is not None and path.exists():
            os.replace(path, before)  # noqa: PTH105 - the atomic call by its name
        os.replace(temporary, path)  # noqa: PTH105
    except BaseException:
        # Where even this fails, the first error is the one to report.
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise


def write_whole(path: Path, write: Callable[[Path], object], *, make_folder: bool = True) -> None:
    """Make or replace a file: `write` fills a temporary path; its folder is made, if wanted.

    Raises:
        RunError: the disk is full or the folder cannot be written; the file that was there is untouched.
    """
    try:
        if make_folder:
            path.parent.mkdir(exist_ok=True)
        with whole(path) as temporary:
            write(temporary)
    except FileNotFoundError as error:
        raise RunError(
            f"{path}: cannot be written, its folder is gone; if it was moved, what is written in it is whole, and a "
            "run goes on from there: smarticles resume DIR"
        ) from error
    except OSError as error:
        raise RunError(
            f"{path}: cannot be written ({error.strerror or error}); free space or choose another --out; "
            "everything written before is whole"
        ) from error


def write_text(path: Path, text: str, *, make_folder: bool = True) -> None:
    """Write text whole; errors as in `write_whole`."""
    write_whole(path, lambda temporary: temporary.write_bytes(text.encode()), make_folder=make_folder)


def cannot_read(what: str, path: Path, cause: BaseException | str, remedy: str) -> NoReturn:
    """Raise InputError: a file, e.g. a "frame", is missing, truncated or not what it should be."""
    if isinstance(cause, BaseException):
        lines = str(cause).strip().splitlines()
        named = ": ".join([type(cause).__name__, *lines[:1]])
        # The system's own words say enough, and str() would repeat the path.
        cause = getattr(cause, "strerror", None) or named
    raise InputError(f"cannot read {what} {path}: {cause}; {remedy}") from None
