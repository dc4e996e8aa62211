"""Where a growing function reaches a level."""

from __future__ import annotations

from collections.abc import Callable

_HALVINGS = 60
"""More than the 52 bits of a number have."""


def least_reaching(growing: Callable[[float], float], level: float, low: float, high: float) -> float:
    """The least argument at which a growing function has reached a level, by bisection, to rounding.

    Args:
        growing: The function; it may have steps.
        level: In its unit.
        low: Where it is below the level, or just reaches it.
        high: Where it has reached it.
    """
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        if growing(middle) < level:
            low = middle
        else:
            high = middle
    return high
