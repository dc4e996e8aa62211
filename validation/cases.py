"""Register cases: known answers, ladders over the time step, hard cases; and what they return."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

from validation.access import ENGINES

Function = TypeVar("Function", bound=Callable[..., Any])

COARSE, MIDDLE, FINE = (8e-5, 4e-5, 2e-5, 1e-5), (4e-5, 2e-5, 1e-5, 5e-6), (2e-5, 1e-5, 5e-6, 2.5e-6)  # s
LEAPFROG = "leapfrog is of second order"


@dataclass(frozen=True)
class Answer:
    """One quantity, measured and in theory.

    Args:
        what: quantity and unit, as in `speed [m/s]`.
        theory: the answer on paper [unit].
        measured: what the engine gave [unit].
        tolerance: largest error that passes, relative to the scale [1].
        reason: of the tolerance.
        scale: what the error is relative to [unit]; 0: the theory itself.
    """

    what: str
    theory: float
    measured: float
    tolerance: float
    reason: str = ""
    scale: float = 0.0

    @property
    def error(self) -> float:
        """(measured − theory) / scale [1]."""
        return float((self.measured - self.theory) / (self.scale or abs(self.theory)))

    @property
    def good(self) -> bool:
        """Whether the error is within the tolerance; a NaN is not."""
        return abs(self.error) <= self.tolerance


@dataclass(frozen=True)
class Check:
    """One thing checked: what (with the unit of the number), number or text, limit in words, whether it is kept."""

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


def nothing(what: str, text: str | None) -> Check:
    """Check that there is no error."""
    return Check(what, text or "nothing", "nothing", text is None)


def says(text: str | None, *parts: str) -> Check:
    """Check that an error contains some words."""
    good = text is not None and all(part in text for part in parts)
    return Check("the error says", text or "nothing", " … ".join(parts), good)


@dataclass(frozen=True)
class Case:
    """A small simulation whose answer is on paper.

    Args:
        run: simulates with the access that it is given, and returns answers.
        about: what happens in it.
        theory: formula, and its source.
        absent: why it has no meaning, by engine.
    """

    run: Callable[..., list[Answer]]
    about: str
    theory: str
    absent: Mapping[str, str]


@dataclass(frozen=True)
class Ladder:
    """A trajectory at several time steps: how its error falls with the step.

    Args:
        errors: returns the error of each of some steps [unit], by access.
        about: what moves.
        quantity: the error that is measured, with its unit.
        size: of the motion, to which errors are compared [unit].
        steps: from coarse to fine [s].
        scheme: order of the scheme in this motion [1], and its reason; by engine.
        phases: of the onset within a step, in the quick form; None: the function has no such option.
    """

    errors: Callable[..., list[float]]
    about: str
    quantity: str
    size: float
    steps: tuple[float, ...]
    scheme: Mapping[str, tuple[int, str]]
    phases: int | None


@dataclass(frozen=True)
class Hard:
    """A hard case.

    Args:
        run: simulates with the access and in the folder that it is given, and returns checks.
        short: its size in continuous integration; None: the long form only.
        long: what differs from that in the long form.
        absent: why it has no meaning, by engine.
    """

    run: Callable[..., list[Check]]
    short: Mapping[str, Any] | None
    long: Mapping[str, Any]
    absent: Mapping[str, str]


CASES: dict[str, Case] = {}
LADDERS: dict[str, Ladder] = {}
HARD: dict[str, Hard] = {}


def _register(table: dict[str, Any], name: str, make: Callable[[Any], Any]) -> Callable[[Function], Function]:
    def register(function: Function) -> Function:
        assert name not in table, name
        table[name] = make(function)
        return function

    return register


def case(
    name: str, about: str, theory: str, *, absent: Mapping[str, str] | None = None, **options: Any
) -> Callable[[Function], Function]:
    """Register a function, called with options, as a known answer; see `Case`."""
    return _register(CASES, name, lambda function: Case(partial(function, **options), about, theory, absent or {}))


def ladder(
    name: str,
    about: str,
    quantity: str,
    *,
    size: float,
    steps: tuple[float, ...],
    scheme: Mapping[str, tuple[int, str]],
    phases: int | None = None,
    **options: Any,
) -> Callable[[Function], Function]:
    """Register a function, called with options, as a ladder; see `Ladder`."""
    rest = (about, quantity, size, steps, scheme, phases)
    return _register(LADDERS, name, lambda function: Ladder(partial(function, **options), *rest))


def on_both(order: int, why: str) -> dict[str, tuple[int, str]]:
    """Return the same order on both engines, for the same reason."""
    return dict.fromkeys(ENGINES, (order, why))


def hard(
    name: str,
    short: Mapping[str, Any] | None,
    long: Mapping[str, Any] | None = None,
    *,
    absent: Mapping[str, str] | None = None,
) -> Callable[[Function], Function]:
    """Register a function as a hard case; see `Hard`."""
    return _register(HARD, name, lambda function: Hard(function, short, long or {}, absent or {}))
