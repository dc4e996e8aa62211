"""Make the arrays of linkages for the kernels of `dem.engine.links.motion.joining`."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from dem.body.linkage import Joint, Linkage, Swing
from dem.engine.links.arrays import Bodies, Linkages, bodies_for, joined
from dem.engine.links.motion import bending, joining
from dem.engine.links.motion.planar import invert
from dem.engine.links.rods import gaits_of
from dem.engine.links.shapes import Shape, table_of
from dem.physics.contact import ContactLaw

Array = NDArray[np.float64]

PIN = 2.0  # stiffness of a pin over that of a contact: a joint bears what contacts do to the links on both sides
LAWS = {"free": joining.FREE, "elastic": joining.ELASTIC, "motor": joining.MOTOR}


def pins_of(linkage: Linkage, law: ContactLaw) -> tuple[float, float, float, float]:
    """Return stiffness and damping of pins [N/m, N s/m], and about directions in which links cannot turn.

    A pin is `PIN` times as stiff as a contact, unless the linkage has a stiffness of its own, and has the damping ratio
    of contacts. About a direction in which links cannot turn, stiffness and damping [N m/rad, N m s/rad] are those of
    two pins at half the width from the axis. The width is the diameter of the round rod that has the links' axial
    inertia, so that such a twist is about as fast as other motions of a pin.
    """
    link = linkage.links[0]
    half = 4 * float(link.inertia[0]) / link.mass  # half of the square of the width [m²]
    stiffness = linkage.pin_stiffness or PIN * law.normal_stiffness
    damping = law.normal_damping * math.sqrt(stiffness / law.normal_stiffness)
    return stiffness, damping, half * stiffness, half * damping


def row_of(linkage: Linkage, number: int, law: ContactLaw) -> Array:
    """Return the constants (JOINT,) of joint `number`, in the columns from `joining.BEFORE` on."""
    joint, before, after = linkage.joints[number], linkage.links[number], linkage.links[number + 1]
    axis = np.array(joint.axes[0])
    across = np.array(joint.axes[1]) if len(joint.axes) == 2 else np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    return np.array(
        [
            before.lengths[0] / 2, after.lengths[0] / 2, *pins_of(linkage, law), joint.stiffness, joint.damping,
            joint.most, joint.breaks, joint.speed, *axis, *(across / math.sqrt((across**2).sum())),
        ]
    )  # fmt: skip


def rest_of(joint: Joint) -> Array:
    """Return the rotation (4,) at rest of a joint: angles [rad]; of three axes a quaternion (w, x, y, z)."""
    if len(joint.axes) < 3:
        return np.array([*joint.rest, 0.0])
    x, y, z, w = Rotation.from_rotvec(joint.vector(joint.rest)).as_quat()
    return np.array([w, x, y, z])


def swings_of(linkage: Linkage, swings: Sequence[Swing]) -> Array:
    """Return the motions (n, 3, SWING) of all motors of a linkage, in the columns from `joining.QUIET` on.

    Motors without an entry in `swings` hold their angle at the start.
    """
    found = np.zeros((len(linkage.links), 3, joining.SWING))
    for k, joint in enumerate(linkage.joints):
        found[k, :, joining.QUIET] = found[k, :, joining.CENTRE] = joint.poured
    for swing in swings:
        row = found[swing.joint, swing.axis]
        row[joining.CENTRE] = row[joining.QUIET] if swing.centre is None else swing.centre
        row[joining.AMPLITUDE] = swing.amplitude
        row[joining.COSINE], row[joining.SINE] = math.cos(swing.phase), math.sin(swing.phase)
    return found


def none_of(shapes: Sequence[Shape]) -> Linkages:
    """Return arrays for a pile without linkages yet; `shapes`: shapes of the links of all kinds."""
    f, i = np.zeros, np.int64
    return Linkages(
        f(0, np.int32), f(1, np.int32), f((0, bending.GAIT)), f(0, i), f(0, i), f((0, joining.JOINT)),
        f((0, 3, joining.SWING)), f((0, 4)), f((0, 3)), f((0, 3)), f((0, 3)), f(0, np.uint8), f(1, i),
        f((0, joining.LOST)), f(0, i), f((0, 3)), f((0, 3)), f(bending.SUMS), bodies_for(0), table_of(shapes), None,
        None, None,
    )  # fmt: skip


def linkages_at(
    old: Linkages,
    linkage: Linkage,
    body: int,
    links: Bodies,
    law: ContactLaw,
    *,
    start: float,
    seed: int,
    angles: Array | None = None,
) -> Linkages:
    """Return arrays of the linkages of `old` and of a new one.

    Args:
        law: contact law, from which stiffness and damping of pins follow.
        start: initial angle ψ of the waves of its motors [rad].
        seed: seed of the times at which waves reverse.
        angles: (n - 1, 3) present angles of the joints, from which commands of motors begin [rad]; None: as poured.
    """
    n = len(linkage.links)
    for row, link in zip(links.plane, linkage.links, strict=True):
        row[14:17] = link.inertia
        invert(row)
    present = [joint.poured for joint in linkage.joints] if angles is None else angles
    present = np.array([*present, np.zeros(3)])
    fresh: dict[str, Any] = {
        "body": np.array([body], np.int32),
        "begin": np.array([len(old.law) + n], np.int32),
        "gait": gaits_of(np.array([body]), np.array([start]), seed),
        "law": np.array([*(LAWS[joint.law] for joint in linkage.joints), joining.NONE]),
        "axes": np.array([*(len(joint.axes) for joint in linkage.joints), 0]),
        "row": np.array([*(row_of(linkage, k, law) for k in range(n - 1)), np.zeros(joining.JOINT)]),
        "swing": swings_of(linkage, ()),
        "rest": np.array([*(rest_of(joint) for joint in linkage.joints), np.zeros(4)]),
        "command": present,
        "angle": present,
        "torque": np.zeros((n, 3)),
        "broken": np.zeros(n, np.uint8),
        "lost": np.zeros((n, joining.LOST)),
        "grip": np.zeros(n, np.int64),
    }
    arrays: dict[str, Any] = {name: np.concatenate([getattr(old, name), rows]) for name, rows in fresh.items()}
    arrays["driven"] = old.driven + sum(joint.law == "motor" for joint in linkage.joints)
    return old._replace(links=joined(old.links, links), **arrays)
