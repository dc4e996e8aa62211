"""How the readers and measures say no, in one line."""

from __future__ import annotations

from typing import TYPE_CHECKING, NoReturn

from dem.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path


class UndefinedMeasureError(InputError):
    """The measure has no meaning for this frame, e.g. a packing fraction of one smarticle.

    Tables over whole runs show such values as NaN; every other error stops them.
    """


def refuse(what: str, path: Path, cause: BaseException | str, remedy: str) -> NoReturn:
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
