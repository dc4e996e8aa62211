"""Results of a case: checks, each good or not."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Answer:
    """One quantity, measured and in theory.

    Args:
        what: quantity and unit, as in `speed [m/s]`.
        theory: the answer on paper [unit].
        measured: what the engine gave [unit].
        tolerance: largest error that passes, relative to the scale [1].
        scale: what the error is relative to [unit]; 0: the theory itself.
        reason: of the tolerance.
    """

    what: str
    theory: float
    measured: float
    tolerance: float
    scale: float = 0.0
    reason: str = ""

    def because(self, reason: str) -> Answer:
        """Return it with the reason of its tolerance."""
        return replace(self, reason=reason)

    @property
    def quantity(self) -> str:
        """What was measured."""
        return self.what.rpartition(" [")[0]

    @property
    def unit(self) -> str:
        """Unit of all numbers."""
        return self.what.rpartition(" [")[2].removesuffix("]")

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
    """Check that a number is below a limit; a NaN is not."""
    return Check(what, f"{measured:.4g}", f"< {limit:.4g}", bool(measured < limit))


def above(what: str, measured: float, limit: float) -> Check:
    """Check that a number is above a limit."""
    return Check(what, f"{measured:.4g}", f"> {limit:.4g}", bool(measured > limit))


def near(what: str, measured: float, expected: float, error: float) -> Check:
    """Check that a number is the expected one, within an error."""
    return Check(what, f"{measured:.5g}", f"{expected:.5g} ± {error:.2g}", bool(abs(measured - expected) <= error))


def says(text: str | None, *parts: str) -> Check:
    """Check that an error contains some words."""
    good = text is not None and all(part in text for part in parts)
    return Check("the error says", text or "nothing", " … ".join(parts), good)
