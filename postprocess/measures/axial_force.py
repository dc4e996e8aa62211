"""Measure the axial force along filaments and chains of links: what pulls at each segment or joint.

A segment of a filament bears EA times its strain. The pin at a joint of a chain is a spring between the ends of two
links; its axial force is the part along the mean direction of both. Damping is left out, so that forces are those of
bodies at rest. Pulls are positive.
"""

import math

import numpy as np

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.bars import entries
from postprocess.geometry.links import Floats, UndefinedMeasureError
from postprocess.measures.registry import FrameMeasure, Quantity, is_flexible

PIN = 2.0  # default stiffness of a pin over that of contacts, docs/theory.md


def axial_forces(frame: Frame, run: Run) -> Floats:
    """Return the axial force (M,) [N] of each segment of filaments, or of the joint after each link of chains.

    Pulls are positive. The last link of a chain has no joint, and NaN. UndefinedMeasureError for other bodies.
    """
    if frame.bars is None or not is_flexible(run):
        raise UndefinedMeasureError("axial forces are those of filaments and chains: got rigid bodies")
    edges = frame.segments[:, 1] - frame.segments[:, 0]
    lengths, kinds = np.linalg.norm(edges, axis=1), run.manifest.kinds or ()
    of, stiffness = frame.kind[frame.body], _stiffnesses(run)
    if kinds[0].shape == "filament":
        own = np.array([kind.length_m / kind.bars for kind in kinds])[of]
        return np.asarray(stiffness[of] * (lengths / own - 1))
    found = np.full(len(edges), math.nan)
    inner = np.flatnonzero(np.diff(frame.body) == 0)
    tangents = edges / lengths[:, None]
    along = tangents[inner] + tangents[inner + 1]
    sizes = np.linalg.norm(along, axis=1)
    gaps = frame.segments[inner + 1, 0] - frame.segments[inner, 1]
    # Links that are folded back have no mean direction.
    parts = np.divide((gaps * along).sum(axis=1), sizes, out=np.full(len(inner), math.nan), where=sizes > 1e-9)
    found[inner] = stiffness[of[inner]] * parts
    return found


def _stiffnesses(run: Run) -> Floats:
    """Return EA [N] of the filaments of each kind, or the stiffness [N/m] of the pins of its chains (K,)."""
    kinds = run.manifest.kinds or ()
    found = []
    for kind, entry in zip(kinds, entries(run), strict=True):
        shape = run.scene["particle"][entry]
        if kind.shape == "filament":
            found.append(shape["young_modulus_Pa"] * math.pi / 4 * kind.thickness_normal_m**2)
        else:
            pin = shape.get("pin_stiffness_N_per_m")
            found.append(PIN * run.scene["fidelity"]["stiffness_N_per_m"] if pin is None else pin)
    return np.array(found, dtype=np.float64)


def _of_frame(frame: Frame, run: Run) -> tuple[float, float]:
    try:
        forces = axial_forces(frame, run)
    except InputError:  # frames can be measured without the scene file
        return math.nan, math.nan
    forces = forces[np.isfinite(forces)]
    return (float(forces.max()), float(forces.mean())) if len(forces) else (math.nan, math.nan)


MEASURES = (
    FrameMeasure(
        name="axial force",
        place=35,
        quantities=(Quantity("greatest axial force", "N"), Quantity("mean axial force", "N")),
        take=_of_frame,
        available_for=is_flexible,
    ),
)
