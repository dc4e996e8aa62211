"""How many smarticles there are, and how many of them are where they should not be."""

from __future__ import annotations

import numpy as np

from dem.record.frame import Frame
from dem.record.manifest import RunManifest
from postprocess.geometry.links import centres_of_mass
from postprocess.measures.registry import FrameMeasure, Quantity, Shown, in_space


def escaped(frame: Frame, run: RunManifest) -> int:
    """Smarticles with their centre of mass beside or below the container."""
    centres = centres_of_mass(frame.vertices)
    outside = np.hypot(centres[:, 0], centres[:, 1]) > run.container_radius
    return int((outside | (centres[:, 2] < frame.floor_z)).sum())


MEASURES = (
    FrameMeasure(
        name="smarticles",
        place=10,
        quantities=(Quantity("smarticles", "-", Shown(heading="smarticles", place=0, form=".4g")),),
        take=lambda frame, _: (frame.count,),
    ),
    FrameMeasure(
        name="escaped",
        place=20,
        quantities=(Quantity("escaped", "-"),),
        take=lambda frame, run: (escaped(frame, run),),
        told_of=in_space,
    ),
)
