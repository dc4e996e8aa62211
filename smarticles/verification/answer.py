"""What a known answer is: cases with their checks, and ladders over the time step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Check:
    """One quantity, measured and in theory.

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
    def ok(self) -> bool:
        """Whether the error is within the tolerance; a NaN is not."""
        return abs(self.error) <= self.tolerance


@dataclass(frozen=True, kw_only=True)
class Case:
    """A small simulation whose answer is known.

    Args:
        name: short, unique.
        about: what it checks.
        theory: formula, and where it is from.
        measure: simulates and compares.
    """

    name: str
    about: str
    theory: str
    measure: Callable[[], list[Check]]


@dataclass(frozen=True, kw_only=True)
class Ladder:
    """A trajectory at several time steps: how its error falls with the step.

    Args:
        name: short, unique.
        about: what moves.
        quantity: the error that is measured.
        unit: of it.
        size: of the motion, that errors are told in parts of [unit].
        order: of the scheme, in this motion [1].
        why: where that order is from.
        steps: from coarse to fine [s].
        errors: of each of these steps [unit].
    """

    name: str
    about: str
    quantity: str
    unit: str
    size: float
    order: int
    why: str
    steps: tuple[float, ...]
    errors: Callable[[Sequence[float]], list[float]]
