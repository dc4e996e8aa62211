"""Errors of the project: `InputError` and `RunError`, and what their messages are made of."""

import difflib
from collections.abc import Iterable
from typing import Any


class InputError(ValueError):
    """The input is wrong: a scene, a file, a command line. Exit status 2."""


class RunError(RuntimeError):
    """A run failed: unstable, not settled, out of disk. Exit status 1."""


def reject(concerned: Any, time: float, cause: str, way_out: str) -> None:
    """Stop a run by RunError if any of the smarticles is concerned.

    Args:
        concerned: (N,) bool array.
    """
    if concerned.any():
        ids = concerned.nonzero()[0]
        shown = ", ".join(str(k) for k in ids[:5]) + (", …" if len(ids) > 5 else "")
        raise RunError(f"at t = {time:.4f} s: {len(ids)} smarticle(s) ({shown}): {cause}; {way_out}")


def shown(value: object) -> str:
    """Return a value as YAML would have it, in one line, cut where it is long."""
    named = {None: "null", True: "true", False: "false"}
    try:
        text = named[value] if value is None or isinstance(value, bool) else repr(value)
    except ValueError:  # a whole number of thousands of digits
        text = "a number of thousands of digits"
    return text if len(text) <= _MOST else f"{text[:_MOST]}…"


_MOST = 60  # characters of a value that are shown


def nearest(word: str, known: Iterable[str], *, cutoff: float = 0.6) -> str:
    """Return `did you mean …` where a known word is close, by more than `cutoff` [1], else the list of known words."""
    words = list(known)
    close = difflib.get_close_matches(word, words, n=1, cutoff=cutoff)
    return f"did you mean {close[0]!r}?" if close else f"known: {', '.join(words) or 'none'}"
