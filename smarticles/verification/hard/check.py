"""One thing that a case checks: what was measured, and the limit that it must keep."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Check:
    """One thing checked.

    Args:
        what: in words, with the unit of the number.
        measured: number or text.
        limit: what it must be, in words.
        good: whether it is.
    """

    what: str
    measured: str
    limit: str
    good: bool


def below(what: str, measured: float, limit: float) -> Check:
    """A number that must be below a limit; one that is no number is not."""
    return Check(what, f"{measured:.4g}", f"< {limit:.4g}", bool(measured < limit))


def above(what: str, measured: float, limit: float) -> Check:
    """A number that must be above a limit."""
    return Check(what, f"{measured:.4g}", f"> {limit:.4g}", bool(measured > limit))


def near(what: str, measured: float, expected: float, error: float) -> Check:
    """A number that must be what is expected, within an error."""
    return Check(what, f"{measured:.5g}", f"{expected:.5g} ± {error:.2g}", bool(abs(measured - expected) <= error))


def says(text: str | None, *parts: str) -> Check:
    """An error that must contain some words."""
    return Check(
        "the error says", text or "nothing", " … ".join(parts), text is not None and all(p in text for p in parts)
    )
