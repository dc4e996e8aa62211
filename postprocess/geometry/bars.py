"""Compute centres and volumes of bodies of any shape from their segments."""

import math

import numpy as np

from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.links import Floats, Whole, centres_of_mass


def centres_of_bodies(segments: Floats, body: Whole) -> Floats:
    """Return the centres of mass (N, 3) [m] of bodies; all segments of a body have equal cross-sections.

    Both ends of all segments are (M, 2, 3) [m]; `body` (M,) are indices of their bodies, from 0, without gaps.
    """
    lengths = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
    total = np.bincount(body, lengths)
    middles = lengths[:, None] * segments.mean(axis=1)
    return np.stack([np.bincount(body, part) / total for part in middles.T], axis=1)


def body_centres(frame: Frame) -> Floats:
    """Return the centres of mass (N, 3) [m] of all bodies of a frame; links have equal cross-sections."""
    return centres_of_mass(frame.vertices) if frame.bars is None else centres_of_bodies(frame.segments, frame.body)


def body_volumes(frame: Frame, run: Run) -> Floats:
    """Return the solid volumes (N,) [m³] of all bodies; overlaps at common ends of bars count twice."""
    if run.manifest.kinds is None:
        return np.full(frame.count, run.manifest.solid_volume_m3)
    return np.array([kind.volume_m3 for kind in run.manifest.kinds])[frame.kind]


def body_masses(frame: Frame, run: Run) -> Floats:
    """Return the masses (N,) [kg] of all bodies."""
    if run.manifest.kinds is None:
        return np.full(frame.count, run.manifest.smarticle_mass_kg)
    return np.array([kind.mass_kg for kind in run.manifest.kinds])[frame.kind]


def segment_volumes(frame: Frame, run: Run) -> Floats:
    """Return the solid volumes (M,) [m³] of all segments of a frame whose bodies are no smarticles."""
    areas = [
        kind.thickness_normal_m * kind.thickness_in_plane_m * (math.pi / 4 if kind.round else 1.0)
        for kind in run.manifest.kinds or ()
    ]
    lengths = np.linalg.norm(frame.segments[:, 1] - frame.segments[:, 0], axis=1)
    return np.asarray(np.array(areas)[frame.kind[frame.body]] * lengths)


def entries(run: Run) -> list[int]:
    """Return for each of the run's kinds of bodies the entry of the scene's list `particle` it comes from.

    An entry with a spread makes several kinds, one for each size; all such entries make equally many. An entry without
    bodies, `share: 0` or `count: 0`, makes none.
    """
    spread = {
        number: bool(entry.get("spread"))
        for number, entry in enumerate(run.scene["particle"])
        if 0 not in (entry.get("share"), entry.get("count"))
    }
    single = len(spread) - sum(spread.values())
    sizes = (len(run.manifest.kinds or ()) - single) // max(len(spread) - single, 1)
    return [number for number, several in spread.items() for _ in range(sizes if several else 1)]
