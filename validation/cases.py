"""Registries of validation cases, and the results that cases return.

Known answers compare a simulation with theory, ladders measure errors over the time step, hard cases check limits.
"""

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
    """Measured value of one quantity, compared with theory."""

    what: str  #: Quantity and unit, as in `speed [m/s]`
    theory: float  #: Value by theory [unit]
    measured: float  #: Value in the simulation [unit]
    tolerance: float  #: Largest allowed error, relative to the scale [1]
    reason: str = ""  #: Reason for the tolerance
    scale: float = 0.0  #: Value that the error is divided by [unit]; 0: the value by theory

    @property
    def error(self) -> float:
        """Relative error (measured − theory) / scale [1]."""
        return float((self.measured - self.theory) / (self.scale or abs(self.theory)))

    @property
    def good(self) -> bool:
        """Whether the error is within the tolerance; False for NaN."""
        return abs(self.error) <= self.tolerance


@dataclass(frozen=True)
class Check:
    """Result of one check."""

    what: str  #: Quantity and unit
    measured: str  #: Measured value or message
    limit: str  #: Limit as text
    good: bool  #: Whether the limit is met


def below(what: str, measured: float, limit: float) -> Check:
    """Check that a measured value is below a limit; NaN fails. `what` names quantity and unit."""
    return Check(what, f"{measured:.4g}", f"< {limit:.4g}", bool(measured < limit))


def above(what: str, measured: float, limit: float) -> Check:
    """Check that a measured value is above a limit; NaN fails. `what` names quantity and unit."""
    return Check(what, f"{measured:.4g}", f"> {limit:.4g}", bool(measured > limit))


def near(what: str, measured: float, expected: float, error: float) -> Check:
    """Check that a value (`what`: quantity, unit) is within ±`error` of the expected value; NaN fails."""
    return Check(what, f"{measured:.5g}", f"{expected:.5g} ± {error:.2g}", bool(abs(measured - expected) <= error))


def nothing(what: str, text: str | None) -> Check:
    """Check that nothing is reported: the message `text` of an error is None; `what` names the check."""
    return Check(what, text or "nothing", "nothing", text is None)


def says(text: str | None, *parts: str) -> Check:
    """Check that `text`, the message of an error, is not None and contains all `parts`."""
    good = text is not None and all(part in text for part in parts)
    return Check("the error", text or "nothing", " … ".join(parts), good)


# Registered cases: parameter sets of `test_known_answer`, `test_order_is_the_schemes` and `test_hard_case`.
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
    """Register a function `(access, **options) -> list[Answer]` as case `name` with a known answer.

    `about` describes the simulation, `theory` is the formula or source of the answer. `absent` has, by engine, the
    reason why the case does not apply to it. `options` are the keyword arguments with which a test calls the function.
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
    """Register a function `(access, steps, **options) -> list[float]`: an error for each time step.

    A test runs it and compares the order at which errors fall with the time step with the expected order.

    Args:
        size: size of the motion, in the unit of the quantity.
        steps: time steps [s], in decreasing order.
        scheme: expected order of convergence [1] and its reason, for all engines or by engine.
        phases: value of the function's argument `phases` in the short form of the test; None: it has no such argument.
    """
    by_engine = scheme if isinstance(scheme, dict) else dict.fromkeys(ENGINES, scheme)
    return _register(LADDERS, name, options, about, quantity, size, steps, by_engine, phases)


def hard(
    name: str,
    short: Mapping[str, Any] | None,
    long: Mapping[str, Any] | None = None,
    absent: Mapping[str, str] | None = None,
) -> Callable[[Function], Function]:
    """Register a function `(access, folder, **options) -> list[Check]` as the hard case `name`.

    `short` has the keyword arguments in continuous integration, or is None if the case has a long form only. `long` has
    the arguments that differ in the long form. `absent` has, by engine, the reason why the case does not apply to it.
    """
    return _register(HARD, name, {}, short, long or {}, absent or {})
