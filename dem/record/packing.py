"""Packing fraction by the paper's definition: up to the height of the second-highest centre of mass."""

import math

import numpy as np

from dem.arrays import Array


def second_highest(heights: Array) -> float:
    """Return the second-highest of (N,) heights; NaN for fewer than two."""
    return float(np.partition(heights, -2)[-2]) if len(heights) > 1 else math.nan


def filled(count: int, *, solid_volume: float, radius: float, height: float) -> float:
    """Return the packing fraction N V_s / (π r² z) [1] of N = `count` smarticles in a cylinder.

    Args:
        solid_volume: volume V_s of one smarticle [m³].
        radius: radius r of the container [m].
        height: height z of the pile [m].
    """
    return float(count * solid_volume / (math.pi * radius**2 * height))


def packing_fraction(heights: Array, *, solid_volume: float, radius: float) -> float:
    """Return the packing fraction φ [1]; NaN if fewer than two centres of mass are above the floor.

    Args:
        heights: (N,) heights of the centres of mass above the floor [m].
        solid_volume: volume of one smarticle [m³].
        radius: radius of the container [m].
    """
    height = second_highest(heights)
    return filled(len(heights), solid_volume=solid_volume, radius=radius, height=height) if height > 0 else math.nan
