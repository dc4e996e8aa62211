"""Outline of bodies: the surface that touches others.

A flat bar has several rows of spheres, or strands, side by side along its normal. The surfaces of the outermost ones
are farther from the bar's axis than a radius. At a free end the surface ends at the tip, a radius nearer than a sphere
about the tip would.
"""

import numpy as np

from dem.arrays import Array
from dem.body.kinds import Mixture
from dem.body.particle import Particle
from dem.body.state import PileState, RigidState, spheres_of


def outline_of(state: PileState, model: Particle | Mixture) -> Array:
    """Return (N, P, 3) centres of spheres that reach as far as the bodies in every direction [m].

    They are all spheres of a body, and all ends of its strands. In a mixture shorter rows repeat the last point.
    """
    if isinstance(model, Mixture) and isinstance(state, RigidState):
        return state.placed(model.outlines)
    return spheres_of(state, model)


def tops_of(state: PileState, model: Particle | Mixture) -> Array:
    """Return (N,) heights of the highest points of the bodies' surfaces [m]."""
    highest = outline_of(state, model)[..., 2].max(axis=1)
    if isinstance(model, Particle):
        return np.asarray(highest + model.radius)
    assert state.bodies is not None  # a pile of these kinds has no smarticles
    return np.asarray(highest + model.radii[state.bodies.kind])
