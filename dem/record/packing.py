"""Packing fraction by the second-highest centre of mass, the paper's definition: its one formula."""

from __future__ import annotations

import math

import numpy as np

from dem.arrays import Array


def second_highest(heights: Array) -> float:
    """Return the second-highest of (N,) heights; NaN for fewer than two."""
    return float(np.partition(heights, -2)[-2]) if len(heights) > 1 else math.nan


def filled(count: int, *, solid_volume: float, radius: float, height: float) -> float:
    """Return N V_s / (pi r² z) [1].

    Args:
        solid_volume: of one smarticle [m³].
        radius: of the container [m].
        height: of the pile [m].
    """
    return float(count * solid_volume / (math.pi * radius**2 * height))


def packing_fraction(heights: Array, *, solid_volume: float, radius: float) -> float:
    """Return φ of (N,) centres of mass above the floor [m]; NaN for fewer than two, and for none above the floor."""
    height = second_highest(heights)
    return filled(len(heights), solid_volume=solid_volume, radius=radius, height=height) if height > 0 else math.nan
