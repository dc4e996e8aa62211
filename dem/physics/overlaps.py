"""Overlaps of contacts and extremes of a pile, which the watchdog checks."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import combinations

from dem.arrays import Flags

APART = 0.1  # of the limit for overlaps: boundaries that have moved apart by less count as unmoved


@dataclass(frozen=True)
class Held:
    """A body held between two boundaries whose distance has changed, so that its contacts are squeezed."""

    smarticle: int  #: Number of the body
    between: tuple[str, str]  #: Names of the boundaries
    apart: float  #: Change of the distance between the boundaries since the start [m]


@dataclass(frozen=True)
class Overlaps:
    """Overlaps and elastic energy of all contacts and hinges at one instant."""

    deepest: float  #: Overlap of the deepest contact [m]
    deep: Flags  #: (N,) whether a body has a contact deeper than the limit given to `Engine.overlaps`
    elastic_energy: float  #: Upper bound of the energy in the springs of all contacts and hinges [J]
    held: tuple[Held, ...] = ()  #: Bodies with a deep contact that are held between two boundaries


@dataclass(frozen=True, kw_only=True)
class Extremes:
    """Extremes over all bodies at one instant; NaN exceeds every limit."""

    fastest: float  #: Speed of the fastest link's centre [m/s]
    lowest: float  #: Height of the lowest point of the links' axes [m]
    highest: float  #: Height of the highest point of the links' axes [m]
    widest: float  #: Largest distance of a point of the links' axes from the container's axis [m]
    gap: float  #: Largest distance between the links of a hinge [m]
    deepest: float  #: Overlap of the deepest contact [m]
    elastic_energy: float  #: Upper bound of the energy in the springs of all contacts and hinges [J]


def held_between(touched: Mapping[int, Collection[str]], raised: Mapping[str, float], least: float) -> tuple[Held, ...]:
    """Return the bodies that touch two boundaries whose distance has changed by more than `least` [m].

    `touched` has the names of the boundaries that a body touches, `raised` the rise of each boundary since the start
    [m].
    """
    return tuple(
        Held(k, (first, second), apart)
        for k, names in sorted(touched.items())
        for first, second in combinations([name for name in raised if name in names], 2)
        if (apart := abs(raised[first] - raised[second])) > least
    )
