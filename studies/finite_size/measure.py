"""One run of the study `finite-size`: φ, ⟨N⟩ and the entanglement graph, at rest before and after the shake.

A pile of 100 thin smarticles is lower than one of them is long, so that one that stands up spans its height alone. A
pile counts as spanned where a cluster joins floor and top, and one wall and wall.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from dem.errors import InputError
from dem.record.frames import FrameSequence, read_frames
from dem.record.manifest import RunManifest
from postprocess.measures.clusters import entanglement_clusters, spans_height, spans_width
from postprocess.measures.entanglement import entanglement
from postprocess.measures.packing import packing_of
from postprocess.measures.spread import escaped
from postprocess.statistics.columns import ASPECT, SEED
from studies.framework.runs import DEFINITION, duration

COUNT, RADIUS = "smarticles [-]", "container radius over w [-]"
BEFORE, AFTER = "before", "after"
STAGES: Mapping[str, str] = MappingProxyType({BEFORE: "phi_0", AFTER: "phi_f"})
"""When a pile is at rest, before and after the shake, and what its φ is called."""

DEFINITIONS = (DEFINITION, "top-percentile", "voxel")
"""Of φ: the paper's, one whose height no single smarticle decides, and one that leaves walls and top out."""

MOVING = f"phi_f shaken {DEFINITION} [-]"
WINDOW = 1.0
"""Over how long φ is averaged at the end of the shake [s]: 30 periods."""

PHASES = ("deposit", "relax", "shake", "relax")


def phi(stage: str, definition: str = DEFINITION) -> str:
    """Column of φ of a pile at rest."""
    return f"{STAGES[stage]} {definition} [-]"


def crossings(stage: str) -> str:
    """Column of ⟨N⟩."""
    return f"crossings {stage} [-]"


def share(stage: str) -> str:
    """Column of the share of the smarticles in the largest entangled cluster."""
    return f"largest cluster {stage} [-]"


def spans(stage: str, what: str = "pile") -> str:
    """Column of whether a cluster spans the height, the width or, both of them, the pile."""
    return f"spans {what} {stage} [-]"


QUANTITIES: Mapping[str, str] = MappingProxyType(
    {
        **{phi(stage, one): f"φ {stage} the shake, at rest, by {one}" for stage in STAGES for one in DEFINITIONS},
        MOVING: f"φ over the last {WINDOW:g} s of the shake",
        **{crossings(stage): f"⟨N⟩ {stage} the shake, at rest" for stage in STAGES},
        **{share(stage): f"share of the smarticles in the largest entangled cluster {stage}" for stage in STAGES},
        **{spans(stage, "height"): f"1 where an entangled cluster joins floor and top {stage}" for stage in STAGES},
        **{spans(stage, "width"): f"1 where one joins wall and wall {stage}" for stage in STAGES},
        **{spans(stage): f"1 where both is so {stage}" for stage in STAGES},
    }
)
"""What is measured, and what it is."""


def size_row(run: RunManifest) -> dict[str, object]:
    """One run's row of the table of runs.

    Args:
        run: A finished run.

    Raises:
        InputError: It is no pour, rest, shake and rest, or cannot be read.
    """
    types = tuple(phase.type for phase in run.phases)
    if types != PHASES:
        msg = f"{run.directory}: its phases are {', '.join(types)}, not {', '.join(PHASES)}"
        raise InputError(msg)
    frames = read_frames(run.directory)
    row: dict[str, object] = {
        ASPECT: round(run.aspect_ratio, 6),
        COUNT: run.count,
        SEED: run.seed,
        RADIUS: run.container_radius / run.middle_length,
        "fidelity": run.fidelity,
        "time shaken [s]": duration(run.phases[2]),
    }
    for stage, phase in zip(STAGES, (1, 3), strict=True):
        row |= _at_rest(run, frames, stage, phase)
    late = frames.in_phase(2).after((run.phases[2].end or 0.0) - WINDOW - 1e-6)
    row[MOVING] = float(np.mean([packing_of(frame, run, definition=DEFINITION) for frame in late])) if late else np.nan
    return row | {
        "escaped at the end [-]": escaped(frames[-1], run),
        "frames averaged [-]": len(late),
        "scene_sha256": run.scene_sha256,
        "run": run.directory.name,
    }


def _at_rest(run: RunManifest, frames: FrameSequence, stage: str, phase: int) -> dict[str, object]:
    """The last frame of a rest."""
    part = frames.in_phase(phase)
    if not part:
        msg = f"{run.directory}: no frame of phase {phase} (relax); run it again"
        raise InputError(msg)
    frame = part[-1]
    vertices, diameter = frame.vertices, run.sphere_diameter
    clusters = entanglement_clusters(vertices)
    height = spans_height(clusters, vertices, diameter=diameter, floor_z=frame.floor_z)
    width = spans_width(clusters, vertices, diameter=diameter, wall_radius=run.container_radius)
    return {
        **{phi(stage, one): packing_of(frame, run, definition=one) for one in DEFINITIONS},
        crossings(stage): entanglement(vertices).mean,
        share(stage): clusters.largest,
        spans(stage, "height"): float(height),
        spans(stage, "width"): float(width),
        spans(stage): float(height and width),
    }
