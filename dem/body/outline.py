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


def tops_of(state: PileState, model: Particle | Mixture) -> Array:
    """Return (N,) heights of the highest points of the bodies' surfaces [m].

    They are exact for strands, whose highest points are at their ends, and for spheres. Strands that meet at a joint
    count in a body of spheres, too.
    """
    if isinstance(model, Particle):
        return np.asarray(spheres_of(state, model)[..., 2].max(axis=1) + model.radius)
    bodies = state.bodies
    assert bodies is not None  # a pile of a mixture has no smarticles
    points = bodies.placed(model.outlines) if isinstance(bodies, RigidState) else bodies.spheres()
    return np.asarray(points[..., 2].max(axis=1) + model.radii[bodies.kind])
