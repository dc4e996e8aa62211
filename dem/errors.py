"""Errors of the project, `InputError` and `RunError`, and functions that word their messages."""

import difflib
import math
import re
from collections.abc import Iterable
from typing import Any


class InputError(ValueError):
    """A scene, a file or a command line is wrong; exit status 2."""


class RunError(RuntimeError):
    """A run failed, e.g. it was unstable, did not settle, or the disk was full; exit status 1."""


def reject(failing: Any, time: float, cause: str, way_out: str) -> None:
    """Raise RunError with cause and way out that names the failing smarticles (N,); do nothing if none fails."""
    if failing.any():
        ids = failing.nonzero()[0]
        shown = ", ".join(str(k) for k in ids[:5]) + (", …" if len(ids) > 5 else "")
        raise RunError(f"at t = {time:.4f} s: {len(ids)} smarticle(s) ({shown}): {cause}; {way_out}")


_ROUNDING = 1e-12  # relative error of the product with a power of ten
_BREAK = re.compile(r"\s*\n\s*")  # as in arrays


def shown(value: object) -> str:
    """Return a value as YAML in one line; after 60 characters an ellipsis replaces the rest."""
    constants = {None: "null", True: "true", False: "false"}
    try:
        text = constants[value] if value is None or isinstance(value, bool) else _BREAK.sub(" ", repr(value))
    except ValueError:  # a whole number of thousands of digits
        text = "a number of thousands of digits"
    return text if len(text) <= 60 else f"{text[:60]}…"


def rounded_up(value: float, digits: int = 3) -> str:
    """Return, as text, a positive number rounded up to significant digits: a least value that is accepted."""
    scale = _scale(value, digits)
    return f"{math.ceil(value * scale * (1 - _ROUNDING)) / scale:.{digits}g}"


def rounded_down(value: float, digits: int = 3) -> str:
    """Return, as text, a positive number rounded down to significant digits: a largest value that is accepted."""
    scale = _scale(value, digits)
    return f"{math.floor(value * scale * (1 + _ROUNDING)) / scale:.{digits}g}"


def _scale(value: float, digits: int) -> float:
    """Return the factor that makes a number one with so many digits before the point [1]."""
    return 10.0 ** (digits - 1 - math.floor(math.log10(value)))


def nearest(word: str, known: Iterable[str], *, cutoff: float = 0.6) -> str:
    """Return `did you mean …` with the nearest known word, or the list of known words if none is near.

    `cutoff` is the least similarity of a near word, from 0 to 1, as in `difflib.get_close_matches`.
    """
    words = list(known)
    close = difflib.get_close_matches(word, words, n=1, cutoff=cutoff)
    return f"did you mean {close[0]!r}?" if close else f"known: {', '.join(words) or 'none'}"
