"""The stable time step on the links engine, from its stiffest modes.

Leapfrog takes the dashpots' velocity half a step late: with M, K and C the matrices of mass, stiffness and damping of a
mode's smarticle, it is stable while K dt² + 2 C dt - 4 M has no positive eigenvalue.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dem.body.linear import matrix_product, positive_definite
from dem.body.particle import Particle
from dem.engine.links.arrays import PLANE
from dem.engine.links.motion.planar import lay_out
from dem.engine.links.shape import Shape, shape_of
from dem.physics.contact import ContactLaw

Array = NDArray[np.float64]

# Contacts that push a tip along the same line at the same time; more act along different directions.
CONTACTS_AT_A_TIP = 2
# Bonds between neighbours that move against each other, above and below, each at twice the motion of one.
AGAINST_NEIGHBOURS = 4
SHAPES = 8  # angles that are tried where motors may turn the barbs, from straight to beyond the U
WIDEST = math.radians(105.0)
PRECISE = 1e-12  # of a step


def links_stable_time_step(
    particle: Particle,
    law: ContactLaw,
    *,
    articulated: bool = False,
    free: bool = False,
    strings: Sequence[tuple[float, float]] = (),
) -> float:
    """Largest stable time step [s] over the stiffest modes of a smarticle among others.

    A barb's tip against another such tip, and against a boundary; a pile of smarticles that lie flat on each other,
    with contacts at all ends of all links, which move against those above and below, or roll against them; and a
    string at a tip. Prescribed rates add no stiffness, whatever the motor does; free angles make tips lighter.

    Args:
        particle: one smarticle.
        law: contact law.
        articulated: whether barbs may have other angles than those of the particle.
        free: whether angles are free: motors that slip.
        strings: stiffness [N/m] and damping [N s/m] of each.
    """
    boxes = particle.boxes
    shapes = [boxes.angles]
    if articulated and boxes.barb_length > 0:
        shapes += [(angle, angle) for angle in np.linspace(0.0, WIDEST, SHAPES)]
    return min(
        _step_of(shape_of(replace(particle, boxes=replace(boxes, angles=angles))), angles, law, free, strings)
        for angles in shapes
    )


def _step_of(
    shape: Shape, angles: tuple[float, float], law: ContactLaw, free: bool, strings: Sequence[tuple[float, float]]
) -> float:
    row = np.zeros(PLANE)
    lay_out(shape, float(angles[0]), float(angles[1]), row)
    mass = _mass(shape, row, free)
    kn, ks, cn, cw = law.normal_stiffness, law.tangential_stiffness, law.normal_damping, law.wall_damping
    cs = law.tangential_damping
    tip = [_motion_of(shape, row, end, z, free) for end in _ends(shape, row)[:1] for z in shape.offsets]
    every = [_motion_of(shape, row, end, z + shape.radius, free) for end in _ends(shape, row) for z in shape.offsets]
    tips = sum((matrix_product(push.T, push) for push in tip), np.zeros_like(mass))
    heave = sum((matrix_product(push[2:].T, push[2:]) for push in every), np.zeros_like(mass))
    rub = sum((matrix_product(push[:2].T, push[:2]) for push in every), np.zeros_like(mass))
    flat = max(cn, cw / 2)
    modes = [
        (2 * CONTACTS_AT_A_TIP * kn * tips, 2 * CONTACTS_AT_A_TIP * cn * tips),
        (CONTACTS_AT_A_TIP * kn * tips, CONTACTS_AT_A_TIP * cw * tips),
        (AGAINST_NEIGHBOURS * kn * heave, AGAINST_NEIGHBOURS * flat * heave),
        (AGAINST_NEIGHBOURS * ks * rub, AGAINST_NEIGHBOURS * flat * cs * rub),
    ]
    modes += [(stiffness * tips, damping * tips) for stiffness, damping in strings]
    return _stable_step(mass, *(np.array(each) for each in zip(*modes, strict=True)))


def _mass(shape: Shape, row: Array, free: bool) -> Array:
    """Mass matrix: velocity, angular velocity in the middle link's axes, and rates of free angles."""
    mass = np.zeros((8, 8))
    mass[:3, :3] = shape.mass * np.eye(3)
    xx, yy, zz, xy, b1, b2, a, c = row[14:22]
    mass[3:6, 3:6] = [[xx, xy, 0.0], [xy, yy, 0.0], [0.0, 0.0, zz]]
    mass[5, 6:] = mass[6:, 5] = [b1, b2]
    mass[6:, 6:] = [[a, c], [c, a]]
    return mass if free and shape.barb_mass > 0 else mass[:6, :6]


def _ends(shape: Shape, row: Array) -> list[tuple[int, Array]]:
    """Link and place in the plane, about the centre of mass [m], of the ends of all links, a barb's tip first."""
    com, ends = row[:2], []
    for kind, x, direction in ((0, -shape.half, row[10:12]), (2, shape.half, row[12:14])):
        if kind in shape.kinds:
            ends.append((kind, np.array([x, 0.0]) + shape.tip * direction - com))
    return ends + [(1, np.array([x, 0.0]) - com) for x in (-shape.end, shape.end)]


def _motion_of(shape: Shape, row: Array, end: tuple[int, Array], z: float, free: bool) -> Array:
    """(3, n): velocity of a point of a link from those of the smarticle."""
    kind, (x, y) = end
    motion = np.zeros((3, 8))
    motion[:, :3] = np.eye(3)
    motion[:, 3:6] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    share = shape.barb_mass / shape.mass
    for k, barb in enumerate((0, 2)):
        motion[:2, 6 + k] = -share * row[6 + 2 * k : 8 + 2 * k]
        if kind == barb:
            sign, hinge = (-1.0, -shape.half) if k == 0 else (1.0, shape.half)
            motion[:2, 6 + k] += sign * np.array([-(y + row[1]), x + row[0] - hinge])
    return motion if free and shape.barb_mass > 0 else motion[:, :6]


def _stable_step(mass: Array, stiffness: Array, damping: Array) -> float:
    """Largest step [s] up to which 4 M - K dt² - 2 C dt is positive definite for all modes (n, k, k), by bisection."""
    # Degrees of freedom of one scale each: elimination then loses no digits.
    scale = 1 / np.sqrt(np.diag(mass))
    mass, stiffness, damping = (each * scale[:, None] * scale for each in (mass, stiffness, damping))
    low, high = 0.0, 2 / math.sqrt(float(np.einsum("nii->n", stiffness).max() / len(scale)))
    while (
        not positive_definite(4 * mass - stiffness * high**2 - 2 * damping * high).all() and high - low > PRECISE * high
    ):
        middle = 0.5 * (low + high)
        if positive_definite(4 * mass - stiffness * middle**2 - 2 * damping * middle).all():
            low = middle
        else:
            high = middle
    return high
