"""Register cases: known answers, ladders over the time step, hard cases; and what they return."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

import pytest
from _pytest.mark.structures import ParameterSet

from validation.access import ENGINES

Function = TypeVar("Function", bound=Callable[..., Any])

COARSE, MIDDLE, FINE = (8e-5, 4e-5, 2e-5, 1e-5), (4e-5, 2e-5, 1e-5, 5e-6), (2e-5, 1e-5, 5e-6, 2.5e-6)  # s
LEAPFROG = "leapfrog is of second order"


@dataclass(frozen=True)
class Answer:
    """One quantity, measured and in theory."""

    what: str  #: Quantity and unit, as in `speed [m/s]`
    theory: float  #: The answer on paper [unit]
    measured: float  #: What the engine gave [unit]
    tolerance: float  #: Largest error that passes, relative to the scale [1]
    reason: str = ""  #: Of the tolerance
    scale: float = 0.0  #: What the error is relative to [unit]; 0: the theory itself

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
    return Check("the error", text or "nothing", " … ".join(parts), good)


# Parameters of `test_known_answer`, `test_order_is_the_schemes` and `test_hard_case`, in the order of the arguments.
CASES: list[ParameterSet] = []
LADDERS: list[ParameterSet] = []
HARD: list[ParameterSet] = []


def _register(
    table: list[ParameterSet], name: str, options: Mapping[str, Any], *values: Any
) -> Callable[[Function], Function]:
    def register(function: Function) -> Function:
        table.append(pytest.param(name, partial(function, **options), *values, id=name))
        return function

    return register


def case(
    name: str, about: str, theory: str, *, absent: Mapping[str, str] | None = None, **options: Any
) -> Callable[[Function], Function]:
    """Register a function as a known answer: it simulates with the access that it is given, and returns answers.

    `absent` says why it has no meaning, by engine; other keywords are the function's.
    """
    return _register(CASES, name, options, about, theory, absent or {})


def ladder(  # noqa: PLR0917 # a row of a table
    name: str,
    about: str,
    quantity: str,
    size: float,
    steps: tuple[float, ...],
    scheme: tuple[int, str] | dict[str, tuple[int, str]],
    *,
    phases: int | None = None,
    **options: Any,
) -> Callable[[Function], Function]:
    """Register a function as a ladder: it returns the error of a trajectory at each of some time steps.

    Its size is that of the motion, in the unit of the quantity, its steps go from coarse to fine [s], its scheme has
    the order in this motion [1] and the reason, of all engines or by engine. `phases` of the onset within a step are
    those of the quick form (None: the function has no such option); other keywords are the function's.
    """
    by_engine = scheme if isinstance(scheme, dict) else dict.fromkeys(ENGINES, scheme)
    return _register(LADDERS, name, options, about, quantity, size, steps, by_engine, phases)


def hard(
    name: str,
    short: Mapping[str, Any] | None,
    long: Mapping[str, Any] | None = None,
    absent: Mapping[str, str] | None = None,
) -> Callable[[Function], Function]:
    """Register a function as a hard case: it simulates with an access and in a folder, and returns checks.

    `short` are its options in continuous integration (None: the long form only), `long` what differs in the long form;
    `absent` says why it has no meaning, by engine.
    """
    return _register(HARD, name, {}, short, long or {}, absent or {})
