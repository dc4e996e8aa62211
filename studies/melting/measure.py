"""What is measured of each run of the study `melting`, against time and at its end."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from dem.record.manifest import RunManifest
from postprocess.measures.heights import heights
from postprocess.measures.spread import centre_of_mass, free_pile, has_toppled
from postprocess.scene_file import read_phases
from studies.base.release import around, labels, removal
from studies.framework.runs import MeasuredRun, duration

LIFT, SINCE = "lift speed [m/s]", "time since the wall began to go [s]"
BASE, TOP, CENTRE = "radius of 95 % before [m]", "height of 95 % before [m]", "com height before [m]"
CONTACT, ENTANGLED = "largest cluster by contact [-]", "largest cluster by crossings [-]"
HEIGHT, TOP_KEPT = "com height over that before [-]", "height of 95 % over that before [-]"
SPREAD, SLOUGHED = "radius of 95 % over that before [-]", "sloughed [-]"
TILT, OFFSET, TOPPLED = "tilt [degree]", "com offset over the base's radius [-]", "toppled [-]"

BEFORE: Mapping[str, str] = MappingProxyType(
    {
        BASE: "radius about the centre of mass that holds 95 % of the material, while the wall is there",
        TOP: "height below which 95 % of the material lies, while the wall is there",
        CENTRE: "height of the centre of mass, while the wall is there",
    }
)
FREE: Mapping[str, str] = MappingProxyType(
    {
        CONTACT: "share of the smarticles in the largest cluster joined by contact",
        ENTANGLED: "share of them in the largest cluster joined by links that pass through planes",
        HEIGHT: "height of the centre of mass over that before the wall went",
        TOP_KEPT: "the same for the height below which 95 % of the material lies",
        SPREAD: "the same for the radius about the centre of mass that holds 95 % of it",
        SLOUGHED: "share of the smarticles whose centre of mass is farther from the pile's middle than the wall was "
        "by w/2",
        TILT: "angle from the vertical of the line to the centre of mass from where it stood above the floor",
        OFFSET: "how far the centre of mass moved sideways, over the radius of 95 % before",
    }
)
"""What is measured of every frame after the wall began to go."""

QUANTITIES: Mapping[str, str] = MappingProxyType(
    {**BEFORE, **FREE, TOPPLED: "1 where the centre of mass ends beyond the radius of 95 % before, 0 otherwise"}
)
"""What is averaged over seeds: columns of the table of runs."""


def measure_melting(run: RunManifest) -> MeasuredRun:
    """What a pile was before its wall began to go, and in the end; its history begins with the former.

    Args:
        run: A finished run.

    Raises:
        InputError: It does not end with a rest and the removal of its wall, or cannot be read.
    """
    before, after = around(run)
    phase = removal(run)
    settings = read_phases(run.directory)[phase.index]
    lift = 0.0 if settings.values.get("speed_m_per_s") is None else settings.number("speed_m_per_s")
    centre = centre_of_mass(before.vertices)
    foot = (float(centre[0]), float(centre[1]))
    levels = heights(before.vertices, floor_z=before.floor_z)
    base = free_pile(before.vertices, run, floor_z=before.floor_z, foot=foot).radius_most
    rows = []
    for frame in (before, *after):
        pile = free_pile(frame.vertices, run, floor_z=frame.floor_z, foot=foot)
        level = heights(frame.vertices, floor_z=frame.floor_z)
        rows.append(
            {
                CONTACT: pile.touching,
                ENTANGLED: pile.entangled,
                HEIGHT: level.mean_com / levels.mean_com,
                TOP_KEPT: level.top / levels.top,
                SPREAD: pile.radius_most / base,
                SLOUGHED: pile.sloughed,
                TILT: pile.tilt,
                OFFSET: pile.offset / base,
            }
        )
    start = before.time if phase.start is None else phase.start
    times = np.array([start, *(frame.time for frame in after)]) - start
    row: dict[str, object] = {
        **labels(run),
        LIFT: lift,
        "time without the wall [s]": duration(phase),
        BASE: base,
        TOP: levels.top,
        CENTRE: levels.mean_com,
        **rows[-1],
        TOPPLED: float(has_toppled(rows[-1][OFFSET] * base, base)),
        "scene_sha256": run.scene_sha256,
        "run": run.directory.name,
    }
    values = {name: np.array([one[name] for one in rows]) for name in FREE}
    return MeasuredRun(manifest=run, rows=[row], history={SINCE: times, **values})
