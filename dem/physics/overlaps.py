"""Overlaps of contacts and extremes of a pile, which the watchdog checks."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import combinations

from dem.arrays import Flags

APART = 0.1  # of the depth that is too deep; boundaries that have moved against each other by less have not


@dataclass(frozen=True)
class Held:
    """A smarticle between boundaries that have moved `apart` [m]: only its contacts give way."""

    smarticle: int
    between: tuple[str, str]
    apart: float


@dataclass(frozen=True)
class Overlaps:
    """All contacts and hinges at one instant."""

    deepest: float  #: Overlap of the deepest contact [m]
    deep: Flags  #: (N,) smarticles with a contact deeper than the limit asked for
    elastic_energy: float  #: Upper bound of what the springs of all contacts and hinges hold [J]
    held: tuple[Held, ...] = ()  #: Those of the deep ones that two boundaries hold


@dataclass(frozen=True, kw_only=True)
class Extremes:
    """The extremes of all smarticles at one instant; NaN is within no limit."""

    fastest: float  #: Speed of the fastest link's centre [m/s]
    lowest: float  #: Height of the lowest point that must stay inside [m]
    highest: float  #: Height of the highest one [m]
    widest: float  #: Largest distance of such a point from the vertical axis [m]
    gap: float  #: Largest distance between the links of a hinge [m]
    deepest: float  #: Overlap of the deepest contact [m]
    elastic_energy: float  #: As in `Overlaps` [J]


def held_between(touched: Mapping[int, Collection[str]], raised: Mapping[str, float], least: float) -> tuple[Held, ...]:
    """Return smarticles that touch two boundaries which have moved apart by more than `least` [m].

    Args:
        touched: names of the boundaries that a smarticle touches, by its number.
        raised: how far each boundary was raised since the start [m], by name.
        least: distance [m].
    """
    return tuple(
        Held(k, (first, second), apart)
        for k, names in sorted(touched.items())
        for first, second in combinations([name for name in raised if name in names], 2)
        if (apart := abs(raised[first] - raised[second])) > least
    )
