"""Measure how well a pile fills the tiers of a mould, and how much of that is left without the mould."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dem.record.run import Run
from postprocess.geometry.links import Flags, Floats, Vertices, checked_vertices, link_lengths
from postprocess.geometry.outline import outlines
from postprocess.geometry.voxel import Region

_SAMPLES = 50  # points along a link


@dataclass(frozen=True, kw_only=True, eq=False)
class Cast:
    """A pile in its mould, and that pile without it, after."""

    #: (T,) share of each tier's volume that is inside the pile, see `postprocess.geometry.outline` [-]
    filled_before: Floats
    filled_after: Floats  #: (T,) likewise without the mould [-]
    kept: Floats  #: (T,) of what was filled before, the share that still is [-]; NaN for an empty tier
    material_before: Floats  #: (T,) share of all links' length inside each tier [-]
    material_after: Floats  #: (T,) likewise without the mould [-]
    overlap: float  #: Volume common to the pile before and after over that of both together (Jaccard) [-]
    likeness: float  #: Of the pile after and the whole mould: 1 for a perfect cast [-]
    likeness_before: float  #: Of the pile before and the mould [-]


def cast(
    before: ArrayLike,
    after: ArrayLike,
    tiers: Sequence[Region],
    *,
    thickness: float,
    ball: float,
) -> Cast:
    """Compare a pile in a mould with that pile after the mould was taken away.

    Shares of a tier are of its voxels, so that a tier that is all inside the pile has 1 and one without a link
    has 0, however coarse the voxels.

    Args:
        before: Vertices in the mould, heights above the floor.
        after: Vertices without the mould, likewise.
        tiers: T cylinders, from the lowest, heights above the floor.
        thickness: Of the links, taken as round [m].
        ball: Radius of the ball that the outline is found with [m].

    Raises:
        InputError: Bad sizes.
        UndefinedMeasureError: There is no smarticle, or a tier is smaller than a voxel.
    """
    found = outlines([before, after], thickness=thickness, ball=ball, regions=tiers)
    one, other = found.inside
    masks = [found.within(tier) for tier in tiers]
    mould = np.logical_or.reduce(masks)
    return Cast(
        filled_before=np.array([_share(one & mask, mask) for mask in masks]),
        filled_after=np.array([_share(other & mask, mask) for mask in masks]),
        kept=np.array([_share(one & other & mask, one & mask) for mask in masks]),
        material_before=_material(before, tiers),
        material_after=_material(after, tiers),
        overlap=_share(one & other, one | other),
        likeness=_share(other & mould, other | mould),
        likeness_before=_share(one & mould, one | mould),
    )


def read_tiers(run: Run) -> tuple[Region, ...]:
    """Read the tiers of a run's container, from below, heights above its floor; none of one cylinder.

    Raises:
        InputError: The file is missing or damaged, or a tier lacks its sizes.
    """
    container = run.scene.get("container")
    found, bottom = [], 0.0
    for tier in (container or {}).get("tiers") or ():
        top = bottom + tier["height_m"]
        found.append(Region(radius=tier["radius_m"], bottom=bottom, top=top))
        bottom = top
    return tuple(found)


def _share(part: Flags, whole: Flags) -> float:
    total = int(whole.sum())
    return float(part.sum() / total) if total else float("nan")


def _material(vertices: Vertices, tiers: Sequence[Region]) -> Floats:
    """Return shares (T,) of all links' length in each tier, by points evenly along each link."""
    vertices = checked_vertices(vertices)
    shares = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    along = np.diff(vertices, axis=1)[:, :, None]
    points = (vertices[:, :-1, None] + shares[:, None] * along).reshape(-1, 3)
    weights = np.repeat(link_lengths(vertices).ravel(), _SAMPLES)
    inside: Floats = np.array([weights[tier.contains(points)].sum() / weights.sum() for tier in tiers])
    return inside
