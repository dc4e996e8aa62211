"""Packing fraction by the paper's definition: up to the height of the second-highest centre of mass."""

import math

import numpy as np

from dem.arrays import Array


def second_highest(heights: Array) -> float:
    """Return the second-highest of (N,) heights; NaN for fewer than two."""
    return float(np.partition(heights, -2)[-2]) if len(heights) > 1 else math.nan


def filled(count: int, *, solid_volume: float, radius: float, height: float) -> float:
    """Return the packing fraction N V_s / (π r² z) [1] of `count` smarticles in a cylinder, in [m], [m³]."""
    return float(count * solid_volume / (math.pi * radius**2 * height))


def packing_fraction(heights: Array, *, solid_volume: float, radius: float) -> float:
    """Return φ [1] from heights (N,) of centres of mass above the floor [m]; NaN for fewer than two above."""
    height = second_highest(heights)
    return filled(len(heights), solid_volume=solid_volume, radius=radius, height=height) if height > 0 else math.nan
