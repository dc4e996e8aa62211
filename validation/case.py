"""Register what is simulated to be checked: cases, and ladders over the time step."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

from validation.engines import ENGINES

Function = TypeVar("Function", bound=Callable[..., Any])

COARSE, MIDDLE, FINE = (8e-5, 4e-5, 2e-5, 1e-5), (4e-5, 2e-5, 1e-5, 5e-6), (2e-5, 1e-5, 5e-6, 2.5e-6)  # s
LEAPFROG = "leapfrog is of second order"


@dataclass(frozen=True)
class Case:
    """A small simulation whose answer is on paper.

    Args:
        name: unique.
        about: what happens in it.
        theory: formula, and its source.
        absent: why it has no meaning, by engine.
        run: simulates with the access that it is given, and returns answers.
    """

    name: str
    about: str
    theory: str
    absent: Mapping[str, str]
    run: Callable[..., Any]


@dataclass(frozen=True)
class Ladder:
    """A trajectory at several time steps: how its error falls with the step.

    Args:
        name: unique.
        about: what moves.
        quantity: the error that is measured.
        unit: of it.
        size: of the motion, to which errors are compared [unit].
        steps: from coarse to fine [s].
        scheme: order of the scheme in this motion [1], and its reason; by engine.
        phases: of the onset within a step, in the quick form; None: the function has no such option.
        errors: returns the error of each of some steps [unit], by access.
    """

    name: str
    about: str
    quantity: str
    unit: str
    size: float
    steps: tuple[float, ...]
    scheme: Mapping[str, tuple[int, str]]
    phases: int | None
    errors: Callable[..., list[float]]


CASES: dict[str, Case] = {}
LADDERS: dict[str, Ladder] = {}


def case(
    name: str, about: str, theory: str, *, absent: Mapping[str, str] | None = None, **options: Any
) -> Callable[[Function], Function]:
    """Register a function, called with options, as a case; see `Case`."""

    def register(function: Function) -> Function:
        assert name not in CASES, name
        CASES[name] = Case(name, about, theory, absent or {}, partial(function, **options))
        return function

    return register


def ladder(  # noqa: PLR0917 # a row of a table
    name: str,
    about: str,
    quantity: str,
    unit: str,
    size: float,
    steps: tuple[float, ...],
    scheme: Mapping[str, tuple[int, str]],
    *,
    phases: int | None = None,
    **options: Any,
) -> Callable[[Function], Function]:
    """Register a function, called with options, as a ladder; see `Ladder`."""

    def register(function: Function) -> Function:
        assert name not in LADDERS, name
        run = partial(function, **options)
        LADDERS[name] = Ladder(name, about, quantity, unit, size, steps, scheme, phases, run)
        return function

    return register


def on_both(order: int, why: str) -> dict[str, tuple[int, str]]:
    """Return the same order on both engines, for the same reason."""
    return dict.fromkeys(ENGINES, (order, why))
