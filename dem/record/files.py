"""Files that appear whole or not at all, and how a file that cannot be read is told."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NoReturn

from dem.errors import InputError, RunError
from dem.record.names import partial


@contextlib.contextmanager
def whole(path: Path, *, before: Path | None = None, shared: bool = False) -> Iterator[Path]:
    """A temporary path beside `path`, renamed to it when the block ends well, removed when it does not.

    Args:
        path: the file that is to appear, or to be replaced.
        before: where the file that is replaced is to be kept; None: nowhere.
        shared: whether several processes may write the same file at once.
    """
    name = f"{path.stem}.{os.getpid()}{path.suffix}" if shared else path.name
    temporary = path.with_name(partial(name))
    try:
        yield temporary
        if before is not None and path.exists():
            os.replace(path, before)  # noqa: PTH105 - the atomic call by its name
        os.replace(temporary, path)  # noqa: PTH105
    except BaseException:
        # Where even this fails, the first error is the one to tell.
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise


def write_whole(path: Path, write: Callable[[Path], None], *, make_folder: bool = True) -> None:
    """Let `write` make a file of a run, a sweep or a bench.

    Args:
        path: the file that is to appear, or to be replaced.
        write: called with the temporary path, which keeps the suffix of `path`.
        make_folder: whether its folder is made if needed; not where its absence means that somebody moved it away.

    Raises:
        RunError: the disk is full or the folder cannot be written; what was at `path` before is untouched.
    """
    try:
        if make_folder:
            path.parent.mkdir(exist_ok=True)
        with whole(path) as temporary:
            write(temporary)
    except FileNotFoundError as error:
        msg = (
            f"{path}: cannot be written, its folder is gone; if it was moved, what is written in it is whole, and a "
            "run goes on from there: smarticles resume DIR"
        )
        raise RunError(msg) from error
    except OSError as error:
        msg = (
            f"{path}: cannot be written ({error.strerror or error}); free space or choose another --out; "
            "everything written before is whole"
        )
        raise RunError(msg) from error


def write_text(path: Path, text: str, *, make_folder: bool = True) -> None:
    """Write text whole; errors as in `write_whole`."""

    def write(temporary: Path) -> None:
        temporary.write_text(text, encoding="utf-8")

    write_whole(path, write, make_folder=make_folder)


def write_json(path: Path, data: Any, *, make_folder: bool = True) -> None:
    """Write JSON whole; errors as in `write_whole`."""
    write_text(path, json.dumps(data, indent=2, ensure_ascii=False) + "\n", make_folder=make_folder)


def cannot_read(what: str, path: Path, cause: BaseException | str, remedy: str) -> NoReturn:
    """Says in one line that a file is missing, truncated or not what it should be.

    Args:
        what: What the file is, e.g. "frame".
        path: The file.
        cause: Why it cannot be used; of an exception only its first line is kept.
        remedy: The way out.

    Raises:
        InputError: Always. The exception behind it, if any, is left out of what the user sees.
    """
    if isinstance(cause, BaseException):
        lines = str(cause).strip().splitlines()
        named = ": ".join([type(cause).__name__, *lines[:1]])
        # The system's own words say enough, and str() would repeat the path.
        cause = getattr(cause, "strerror", None) or named
    msg = f"cannot read {what} {path}: {cause}; {remedy}"
    raise InputError(msg) from None
