"""Measure how well a pile fills a mould, and how well the pile keeps this shape without the mould."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dem.record.run import Run
from postprocess.geometry.links import Flags, Floats, Vertices, checked_vertices, link_lengths
from postprocess.geometry.outline import outlines
from postprocess.geometry.voxel import Region

_SAMPLES = 50  # number of points along a link


@dataclass(frozen=True, kw_only=True, eq=False)
class Cast:
    """Comparison of a pile in a mould of T tiers ("before") and without the mould ("after").

    A pile takes the space inside its outline, see `postprocess.geometry.outline`. The Jaccard index of two regions is
    the volume of their intersection over the volume of their union: 1 if they are identical, 0 if they are disjoint.
    """

    filled_before: Floats  #: (T,) fraction of each tier's volume that is inside the pile before [-]
    filled_after: Floats  #: (T,) fraction of each tier's volume that is inside the pile after [-]
    kept: Floats  #: (T,) fraction of the volume filled before that is still filled after [-]; NaN for an empty tier
    material_before: Floats  #: (T,) fraction of the total length of links inside each tier before [-]
    material_after: Floats  #: (T,) fraction of the total length of links inside each tier after [-]
    overlap: float  #: Jaccard index of the pile before and the pile after [-]
    likeness: float  #: Jaccard index of the pile after and the mould [-]
    likeness_before: float  #: Jaccard index of the pile before and the mould [-]


def cast(before: ArrayLike, after: ArrayLike, tiers: Sequence[Region], *, thickness: float, ball: float) -> Cast:
    """Compare a pile in a mould with the pile after the mould was removed.

    `before` and `after` are vertices (N, 4, 3) [m]; `tiers` are the T tiers, from the lowest. Heights count from the
    floor. Links are round with the diameter `thickness` [m]. A ball of the radius `ball` [m] finds the outlines.
    """
    grid = outlines([before, after], thickness=thickness, ball=ball, regions=tiers)
    with_mould, without_mould = grid.inside
    masks = [grid.within(tier) for tier in tiers]
    mould = np.logical_or.reduce(masks)
    kept = with_mould & without_mould
    return Cast(
        filled_before=np.array([_fraction(with_mould & mask, mask) for mask in masks]),
        filled_after=np.array([_fraction(without_mould & mask, mask) for mask in masks]),
        kept=np.array([_fraction(kept & mask, with_mould & mask) for mask in masks]),
        material_before=_material(before, tiers),
        material_after=_material(after, tiers),
        overlap=_fraction(kept, with_mould | without_mould),
        likeness=_fraction(without_mould & mould, without_mould | mould),
        likeness_before=_fraction(with_mould & mould, with_mould | mould),
    )


def read_tiers(run: Run) -> tuple[Region, ...]:
    """Return the tiers of a run's mould from the lowest, in heights above the floor; empty for a cylinder."""
    container = run.scene.get("container")
    found, bottom = [], 0.0
    for tier in (container or {}).get("tiers") or ():
        top = bottom + tier["height_m"]
        found.append(Region(radius=tier["radius_m"], bottom=bottom, top=top))
        bottom = top
    return tuple(found)


def _fraction(part: Flags, whole: Flags) -> float:
    total = int(whole.sum())
    return float(part.sum() / total) if total else float("nan")


def _material(vertices: Vertices, tiers: Sequence[Region]) -> Floats:
    """Return the fraction of the total length of links in each tier, (T,), by points along each link."""
    vertices = checked_vertices(vertices)
    shares = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    along = np.diff(vertices, axis=1)[:, :, None]
    points = (vertices[:, :-1, None] + shares[:, None] * along).reshape(-1, 3)
    weights = np.repeat(link_lengths(vertices).ravel(), _SAMPLES)
    inside: Floats = np.array([weights[tier.contains(points)].sum() / weights.sum() for tier in tiers])
    return inside
