"""Rigid bodies of spheres, with a mass and an inertia of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from dem.engine.yade.library import Yade

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Body:
    """A rigid body that is to be made of spheres that exist already.

    Args:
        members: ids of its spheres and hinge nodes.
        local: (k, 3) their centres in the body's principal frame [m].
        mass: [kg].
        inertia: (3,) principal moments [kg m²].
        position: (3,) centre of mass [m].
        rotation: (3, 3) principal frame to laboratory frame.
        velocity: (3,) of the centre of mass [m/s].
        angular_momentum: (3,) about the centre of mass [kg m²/s].
        planar: whether it only moves along x and y and turns about z, which is then its third principal axis.
    """

    members: Sequence[int]
    local: Array
    mass: float
    inertia: Array
    position: Array
    rotation: Array
    velocity: Array
    angular_momentum: Array
    planar: bool = False


def clump(yade: Yade, body: Body) -> tuple[int, Any]:
    """Make a clump in YADE.

    Returns:
        Its id, and the quaternion that takes YADE's own principal frame of the clump to the body's: q_body =
        q_clump · this.
    """
    # Clumped at the origin in the body frame, then moved: YADE's own mass properties of overlapping spheres depend on
    # the pose and count overlaps twice. The spheres weigh nothing; one ballast member carries the exact mass and
    # inertia and is erased again, which leaves the clump's state alone.
    omega, classes, vector = yade.omega, yade.classes, yade.vector
    upright = yade.quaternion(1, 0, 0, 0)
    for member, centre in zip(body.members, body.local, strict=True):
        state = omega.bodies[member].state
        state.pos, state.ori = vector(*centre), upright
    ballast = classes.Body()
    ballast.shape = classes.Box()
    ballast.material = omega.bodies[body.members[0]].material
    ballast.state.mass = body.mass
    # Where it turns about the third axis alone, the other moments do not matter. All alike, the axes keep their order,
    # and YADE's integration of spheres, which it falls back to where a rotation is blocked, is right.
    inertia = np.full(3, body.inertia[2]) if body.planar else body.inertia
    ballast.state.inertia = vector(*inertia)
    ballast_id = omega.bodies.append(ballast)
    clump_id = omega.bodies.clump([*body.members, ballast_id], discretization=0)
    omega.bodies.erase(ballast_id)
    state = omega.bodies[clump_id].state
    # YADE sorts the principal axes: a permutation of ours.
    principal = state.ori
    x, y, z, w = Rotation.from_matrix(body.rotation).as_quat()
    turned = yade.quaternion(w, x, y, z)
    spin = body.rotation @ ((body.rotation.T @ body.angular_momentum) / inertia)
    state.ori = turned * principal
    state.pos = vector(*body.position)
    state.vel = vector(*body.velocity)
    state.angVel = vector(*spin)
    state.angMom = vector(*body.angular_momentum)
    if body.planar:
        state.blockedDOFs = "zXY"
    arms = body.local @ body.rotation.T
    for member, arm in zip(body.members, arms, strict=True):
        own = omega.bodies[member].state
        own.pos, own.ori = vector(*(body.position + arm)), turned
        # Contact laws read the members' own velocities, before the integrator has moved them for the first time.
        own.vel, own.angVel = vector(*(body.velocity + np.cross(spin, arm))), state.angVel
    return clump_id, principal.inverse()
