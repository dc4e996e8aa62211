"""Decide whether the bodies of a frame are one pile in a cylinder, which is what a packing fraction describes.

A pile lies on the floor within the wall, and only these two bear it. While bodies fall, or hang from a grip or a hook,
the height of the highest ones is not that of a pile: a pile of φ = 0.12 with one raised body would have φ = 0.02.
"""

import math

import numpy as np

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.run import Run

POUR = "deposit"  #: Type of the phase that pours bodies


def why_no_pile(frame: Frame, run: Run) -> str:
    """Return the reason why the bodies of a frame are not one pile in a cylinder; "" if they are."""
    made = run.manifest
    if made.container_tiers > 1:
        return f"a mould of {made.container_tiers} tiers"
    if not made.walled(frame.phase):
        return "no wall"
    if frame.count < 2:
        return "fewer than 2 smarticles"
    if made.held(frame.phase):
        return "a grip or a raised hook holds bodies"
    falls = made.phases[frame.phase].type == POUR or made.dropped(frame.phase)
    return "the bodies have not settled" if falls and not settled(frame, run) else ""


def settled(frame: Frame, run: Run) -> bool:
    """Return whether all bodies of a run are in a frame, none of them faster than the settled pile of its scene."""
    return frame.count == run.manifest.count and _fastest(frame) <= _settled_speed(run)


def _fastest(frame: Frame) -> float:
    """Return the largest speed of a body [m/s], each the mean over its links."""
    sums = np.zeros((frame.count, 3))
    np.add.at(sums, frame.body, frame.link_velocity.reshape(-1, 3))
    return float(np.linalg.norm(sums / np.bincount(frame.body)[:, None], axis=1).max())


def _settled_speed(run: Run) -> float:
    """Return the largest speed in a pile that counts as settled [m/s]; infinity if the scene has none."""
    try:
        first, *_ = run.scene.get("phases") or [{}]
    except InputError:  # frames can be measured without the scene file
        return math.inf
    return float((first.get("settle") or {}).get("speed_m_per_s", math.inf))
