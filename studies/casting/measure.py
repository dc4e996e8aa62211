"""What is measured of each run of the study `casting`: how a mould was filled, and what is left of its shape."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dem.errors import InputError
from dem.record.manifest import RunManifest
from postprocess.geometry.outline import BALL
from postprocess.geometry.region import Region
from postprocess.measures.heights import heights
from postprocess.measures.mould import cast, read_tiers
from studies.base.release import around, labels, removal
from studies.framework.runs import duration

AFTER = 1.0
"""When the pile is measured after the walls went, as in the paper [s]."""

TIERS = ("lower", "middle", "upper")
FILLED, FILLED_AFTER, KEPT, MATERIAL, MATERIAL_AFTER = (
    {tier: f"{quantity} {tier} [-]" for tier in TIERS}
    for quantity in ("filled", "filled after", "kept", "material", "material after")
)
"""Names of columns, by tier."""

NECK, WHOLE = "material in the neck [-]", "filled whole [-]"
WHOLE_AFTER, WHOLE_KEPT = "filled whole after [-]", "kept whole [-]"
IN_MOULD, OVERLAP = "material in the mould after [-]", "overlap before and after [-]"
LIKENESS_BEFORE, LIKENESS = "likeness to the mould [-]", "likeness to the mould after [-]"
HEIGHT, CENTRE = "height of 95 % [m]", "com height over that before [-]"

QUANTITIES: Mapping[str, str] = MappingProxyType(
    {
        **{name: f"share of the volume of the {tier} tier inside the pile before" for tier, name in FILLED.items()},
        **{name: f"the same of the {tier} tier after the walls went" for tier, name in FILLED_AFTER.items()},
        **{
            name: f"of what was inside the pile in the {tier} tier, the share that still is; empty below a ball"
            for tier, name in KEPT.items()
        },
        **{name: f"share of the pile's material in the {tier} tier before" for tier, name in MATERIAL.items()},
        **{name: f"the same of the {tier} tier after" for tier, name in MATERIAL_AFTER.items()},
        NECK: "share of the material above the mould, in the neck it was poured through, before",
        WHOLE: "share of the volume of the whole mould inside the pile before",
        WHOLE_AFTER: "the same after",
        WHOLE_KEPT: "of what was inside the pile in the mould, the share that still is",
        IN_MOULD: "share of the material where the mould was, after",
        OVERLAP: "volume common to the pile before and after over that of both together",
        LIKENESS_BEFORE: "volume common to pile and mould over that of both together, before",
        LIKENESS: "the same after",
        HEIGHT: "height below which 95 % of the material lies, before",
        CENTRE: "height of the centre of mass after, over that before",
    }
)
"""What is averaged over seeds: columns of the table of runs."""


def mould(run: RunManifest) -> tuple[Region, ...]:
    """The tiers of the mould: those of the container but the top one, the neck that it is filled through.

    Raises:
        InputError: The container does not have three tiers and a neck.
    """
    tiers = read_tiers(run.directory)
    if len(tiers) != len(TIERS) + 1:
        msg = f"{run.directory}: a mould has {len(TIERS)} tiers and a neck: container.tiers has {len(tiers)}"
        raise InputError(msg)
    return tiers[:-1]


def casting_row(run: RunManifest) -> dict[str, object]:
    """One run's row of the table of runs.

    Args:
        run: A finished run.

    Raises:
        InputError: It does not end with a rest and the removal of a mould, or cannot be read.
    """
    tiers = mould(run)
    before, frames = around(run)
    start = removal(run).start or before.time
    after = frames[int(np.argmin(np.abs(frames.times - start - AFTER)))]
    one, other = (above_floor(frame.vertices, frame.floor_z) for frame in (before, after))
    ball = BALL * run.middle_length
    found = cast(one, other, tiers, thickness=run.sphere_diameter, ball=ball)
    volumes = np.array([tier.volume for tier in tiers])
    filled = found.filled_before * volumes
    # Of less than the ball that tells inside from outside, a share says nothing.
    kept = np.where(filled > 4 / 3 * math.pi * ball**3, found.kept, math.nan)
    row = labels(run)
    for k, tier in enumerate(TIERS):
        row |= {
            FILLED[tier]: found.filled_before[k],
            FILLED_AFTER[tier]: found.filled_after[k],
            KEPT[tier]: kept[k],
            MATERIAL[tier]: found.material_before[k],
            MATERIAL_AFTER[tier]: found.material_after[k],
        }
    levels = heights(one), heights(other)
    return row | {
        NECK: 1 - found.material_before.sum(),
        WHOLE: filled.sum() / volumes.sum(),
        WHOLE_AFTER: found.filled_after @ volumes / volumes.sum(),
        WHOLE_KEPT: np.nansum(found.kept * filled) / filled.sum(),
        IN_MOULD: found.material_after.sum(),
        OVERLAP: found.overlap,
        LIKENESS_BEFORE: found.likeness_before,
        LIKENESS: found.likeness,
        HEIGHT: levels[0].top,
        CENTRE: levels[1].mean_com / levels[0].mean_com,
        "time after [s]": after.time - start,
        "time without the wall [s]": duration(removal(run)),
        "scene_sha256": run.scene_sha256,
        "run": run.directory.name,
    }


def above_floor(vertices: ArrayLike, floor_z: float) -> NDArray[np.float64]:
    """Vertices with their heights above the floor [m]."""
    moved: NDArray[np.float64] = np.asarray(vertices) - np.array([0.0, 0.0, floor_z])
    return moved
