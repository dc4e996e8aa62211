"""What a case says: checks, each good or not."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Answer:
    """One quantity, measured and in theory: a check whose answer is on paper.

    Args:
        quantity: what it is.
        unit: of it.
        theory: the answer on paper [unit].
        measured: what the engine gave [unit].
        tolerance: largest error that passes, relative to the scale [1].
        reason: of the tolerance.
        scale: what the error is relative to [unit]; 0: the theory itself.
    """

    quantity: str
    unit: str
    theory: float
    measured: float
    tolerance: float
    reason: str
    scale: float = 0.0

    @property
    def error(self) -> float:
        """(measured − theory) / scale [1]."""
        return (self.measured - self.theory) / (self.scale or abs(self.theory))

    @property
    def good(self) -> bool:
        """Whether the error is within the tolerance; a NaN is not."""
        return abs(self.error) <= self.tolerance


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
