"""Outline of bodies: the surface that touches others.

A flat bar has several rows of spheres, or strands, side by side along its normal. The surfaces of the outermost ones
are farther from the bar's axis than a radius.
"""

import numpy as np

from dem.arrays import Array
from dem.body.kinds import Mixture
from dem.body.particle import Particle
from dem.body.state import BarState, PileState, RigidState, spheres_of

VERTEX_LINKS = [0, 1, 1, 2]  # link whose rows count at each vertex of a smarticle


def outline_of(state: PileState, model: Particle | Mixture) -> Array:
    """Return (N, P, 3) centres of spheres that reach as far as the bodies in every direction [m].

    They are all spheres of a body, and all ends of its strands. In a mixture shorter rows repeat the last point.
    """
    if isinstance(model, Mixture) and isinstance(state, RigidState):
        return state.placed(model.outlines)
    return spheres_of(state, model)


def tops_of(state: PileState, model: Particle | Mixture) -> Array:
    """Return (N,) heights that no point of each body's surface exceeds [m], for states of any bodies.

    They are the heights of the highest points, except where this is a tip: strands and rows of spheres end at a tip,
    but count here as if their last sphere were centred on it, so that the value is up to a radius too high.
    """
    if isinstance(model, Particle):
        smarticles = state.smarticles
        aside = model.spread * np.abs(smarticles.link_rotations[..., 2, 2])
        highest = smarticles.vertices[..., 2] + aside[:, VERTEX_LINKS]
        return np.asarray(highest.max(axis=1) + model.radius)
    bodies = state.bodies
    assert isinstance(bodies, BarState)  # a pile of these kinds has no smarticles
    aside = model.spreads[bodies.kind[bodies.body]] * np.abs(bodies.normals[:, 2])
    return bodies.largest(bodies.segments[..., 2].max(axis=1) + aside) + model.radii[bodies.kind]
