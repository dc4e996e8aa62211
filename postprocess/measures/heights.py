"""Measure how high a pile stands above the container's floor."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.packing import second_highest
from dem.record.run import Run
from postprocess.geometry.bars import body_centres, body_masses, segment_volumes
from postprocess.geometry.links import (
    Floats,
    UndefinedMeasureError,
    Vertices,
    centres_of_mass,
    checked_vertices,
    link_lengths,
)
from postprocess.measures.registry import FrameMeasure, Quantity, Shown, any_in_space


@dataclass(frozen=True, kw_only=True)
class Heights:
    """Heights of a pile above the floor."""

    mean_com: float  #: Height of the centre of mass of all smarticles [m]
    second_highest_com: float  #: Second-largest height of a smarticle's centre of mass [m]; NaN for one smarticle
    top: float  #: Height below which 95 % of the material lies [m]


def heights(vertices: Vertices, *, floor_z: float = 0.0) -> Heights:
    """Compute the heights of a pile by its vertices (N, 4, 3) [m] and the height of its floor [m].

    UndefinedMeasureError if there is no smarticle.
    """
    vertices = checked_vertices(vertices)
    if len(vertices) == 0:
        raise UndefinedMeasureError("a height needs at least 1 smarticle: got 0")
    com = np.sort(centres_of_mass(vertices)[:, 2]) - floor_z
    weights = link_lengths(vertices).sum(axis=1)
    return Heights(
        # Smarticles may differ in length, so their centres are weighted by it.
        mean_com=float(np.average(centres_of_mass(vertices)[:, 2], weights=weights) - floor_z),
        second_highest_com=second_highest(com),
        top=material_height(vertices, floor_z=floor_z),
    )


def least_reaching(growing: Callable[[float], float], level: float, low: float, high: float) -> float:
    """Return the least argument at which a non-decreasing function reaches a level.

    The function may have steps. At `low` it must be at or below the level, at `high` at or above the level.
    """
    for _ in range(60):  # more than the 52 bits of a float
        middle = (low + high) / 2
        low, high = (middle, high) if growing(middle) < level else (low, middle)
    return high


def material_height(vertices: Vertices, *, floor_z: float = 0.0, percentile: float = 95.0) -> float:
    """Return the height above the floor [m] below which a percentage of the material lies.

    The material is spread evenly along each link's centreline. The fraction below a height is then a sum of clipped
    linear functions, and the height is found by bisection.

    Args:
        floor_z: Height of the floor [m].
        percentile: Percentage of the material, above 0 and up to 100 [%].

    Raises:
        InputError: The percentile is out of its range.
        UndefinedMeasureError: There is no smarticle.
    """
    vertices = checked_vertices(vertices)
    if not 0 < percentile <= 100:
        raise InputError(f"percentile must be above 0 % and up to 100 %: got {percentile} %; 95 is usual")
    if len(vertices) == 0:
        raise UndefinedMeasureError("a height needs at least 1 smarticle: got 0")
    z = vertices[:, :, 2] - floor_z
    ends = np.stack([z[:, :-1].ravel(), z[:, 1:].ravel()])
    return _filled_height(ends, link_lengths(vertices).ravel(), percentile)


def _filled_height(ends: Floats, weights: Floats, percentile: float) -> float:
    """Return the height [m] below which a percentage of the material lies.

    Heights of both ends of all segments are (2, M) [m], weights (M,) are their material in any unit.
    """
    lower, upper = ends.min(axis=0), ends.max(axis=0)
    level = weights.sum() * percentile / 100
    # A horizontal link would divide by 0; a small span makes its step a steep slope.
    span = np.maximum(upper - lower, 1e-12 * (upper.max() - lower.min()) + 1e-15)
    return least_reaching(
        lambda height: weights @ np.clip((height - lower) / span, 0, 1), level, float(lower.min()), float(upper.max())
    )


def frame_heights(frame: Frame, run: Run) -> Heights:
    """Compute the heights of a frame's pile of bodies of any shape; UndefinedMeasureError without bodies."""
    if frame.bars is None:
        return heights(frame.vertices, floor_z=frame.floor_z)
    com = body_centres(frame)[:, 2] - frame.floor_z
    return Heights(
        mean_com=float(np.average(com, weights=body_masses(frame, run))),
        second_highest_com=second_highest(com),
        top=_filled_height(frame.segments[..., 2].T - frame.floor_z, segment_volumes(frame, run), 95.0),
    )


def _heights_of(frame: Frame, run: Run) -> tuple[float, ...]:
    levels = frame_heights(frame, run)
    return levels.mean_com, levels.second_highest_com, levels.top


MEASURES = (
    FrameMeasure(
        name="heights",
        place=30,
        quantities=(
            Quantity("com height", "m", Shown(heading="z [mm]", place=30, form=".2f", factor=1e3)),
            Quantity("second-highest com height", "m"),
            Quantity("top 95 % height", "m"),
        ),
        take=_heights_of,
        available_for=any_in_space,
    ),
)
