"""Stable time steps on YADE, from masses and inertias of bodies, not from sphere sizes.

The 18 degrees of freedom of three links are velocity and angular velocity of each link, in the body frame.
"""

import math
from collections.abc import Iterable, Sequence

import numpy as np
from scipy.linalg import block_diag, eigh
from scipy.optimize import brentq

from dem.arrays import Array
from dem.body.filament import Filament
from dem.body.kinds import Kind
from dem.body.particle import LINKS, Boxes, Particle
from dem.engine.yade.beams import FREEDOMS, matrices, springs
from dem.engine.yade.hinges import HingeLaw
from dem.physics.contact import ContactLaw

# Contacts that push a barb's tip along one line at one time. A sphere at a tip that lies between two spheres of another
# chain touches both; further contacts act in other directions and do not add up in one mode.
CONTACTS_AT_A_TIP = 2
# Contacts of a sphere with a parallel row of spheres: the nearest sphere and its two neighbours, while the overlap in
# diameters is below a twentieth of the pitch squared.
CONTACTS_IN_A_ROW = 3
# Contacts of two filaments that cross at a node of both: YADE counts each pair of segments that meet there.
CONTACTS_AT_A_NODE = 4
NODES = 12  # of a filament that are enough for its highest frequency


def stable_time_step(body: Particle | Kind, law: ContactLaw) -> float:
    """Return the largest stable time step [s] of the leapfrog scheme for rigid bodies in contact.

    The step is the least over the stiffest modes, each a mass on parallel springs and dashpots:

    - the lightest points of two smarticles against each other, or of one against the container, with
      `CONTACTS_AT_A_TIP` contacts;
    - a pile of smarticles that lie flat, where every sphere touches spheres above and below that move in the
      opposite direction;
    - a flat pile where all smarticles roll in one sense and rub against those above and below. This mode is the
      stiffest below l/w = 0.2, where smarticles have little inertia about their length.

    A step that is too long for the second or third mode makes smarticles vibrate for ever, which compacts the pile.
    YADE takes the dashpot's velocity half a step late, so that a mode is stable while ω²dt² + 2c dt ≤ 4, with ω² = K/m
    and c = C/m.

    Source: characteristic polynomial λ² - (2 - c dt - ω²dt²) λ + (1 - c dt) at λ = -1; chain of equal masses at the
    edge of its band, K = 4k.
    """
    lightest, mass, spheres = body.smallest_effective_mass, body.mass, len(body.centres)
    # Bodies lie on their broad side, across the axis along which their spheres reach least: z of smarticles.
    up = 2 if isinstance(body, Particle) else int(np.argmin(np.ptp(body.centres, axis=0)))
    flat_damping = max(law.normal_damping, law.wall_damping / 2)
    modes = [
        (lightest / 2, CONTACTS_AT_A_TIP, law.normal_stiffness, law.normal_damping),
        (lightest, CONTACTS_AT_A_TIP, law.normal_stiffness, law.wall_damping),
        (mass / 4, spheres, law.normal_stiffness, flat_damping),
    ]
    arms = float(((body.centres[:, up] + body.radius) ** 2).sum())
    modes += [
        (inertia / arms, 4, law.tangential_stiffness, flat_damping * law.tangential_damping)
        for inertia in np.delete(body.inertia, up)
    ]
    steps = []
    for moved, contacts, stiffness, damping in modes:
        squared = contacts * stiffness / moved
        rate = contacts * damping / moved
        steps.append((math.sqrt(rate**2 + 4 * squared) - rate) / squared)
    return min(steps)


def filament_stable_time_step(filament: Filament, law: ContactLaw) -> float:
    """Return the largest stable time step [s] of a filament whose nodes touch others on all sides.

    The filament is straight, with its bonds. At each node there are `CONTACTS_AT_A_NODE` contacts with others that move
    in the opposite direction, on two sides, and as many tangential springs.

    Implicit damping and drag that act on velocities before the springs do need ω dt ≤ √2 instead of 2, if strong.
    """
    nodes = min(filament.nodes, NODES)
    moved = np.minimum(filament.masses[:nodes], filament.masses[::-1][:nodes][::-1])
    inertia = filament.axial_inertia * moved / filament.masses[1]
    mass = np.repeat(np.stack([moved, inertia], axis=1), 3, axis=1)
    edges = np.tile([filament.segment_length, 0.0, 0.0], (nodes - 1, 1))
    stiffness = np.zeros((mass.size, mass.size))
    for k, block in enumerate(matrices(edges, np.tile(springs(filament), (nodes - 1, 1)))):
        own = slice(FREEDOMS * k, FREEDOMS * (k + 2))
        stiffness[own, own] += block
    radius, sides = filament.diameter / 2, 4 * CONTACTS_AT_A_NODE
    pushed = np.tile([1.0, 1.0, 1.0, 0.0, 0.0, 0.0], nodes)
    rubbed = np.tile([0.0, 0.0, 0.0, 1.0, 1.0, 1.0], nodes) * radius**2
    stiffness += np.diag(sides * (law.normal_stiffness * pushed + law.tangential_stiffness * rubbed))
    # At most the floor and the wall touch a node and have dashpots.
    damping = 2 * law.wall_damping * np.diag(pushed + law.tangential_damping * rubbed)
    return _stable_step(np.diag(mass.ravel()), stiffness, damping) / math.sqrt(2)


def hinged_stable_time_step(particle: Particle, law: ContactLaw, hinges: HingeLaw) -> float:
    """Return the largest stable time step [s] of an articulated smarticle with its hinges and contacts.

    The smarticle has three links with 18 degrees of freedom, joined by the hinges' springs. Its contacts are those of
    `stable_time_step`: a barb's tip at another tip or at the container, a flat pile, and a rolling one. With matrices M
    of mass, K of stiffness and C of damping, a step is stable while K dt² + 2 C dt - 4 M has no positive eigenvalue.
    """
    boxes = particle.boxes
    mass = _mass_matrix(boxes)
    pins = _hinge_stiffness(boxes, hinges)
    tip = _push_shape(particle, [int(np.flatnonzero(particle.links == 0)[-1])], np.eye(3))
    flat = _push_shape(particle, range(len(particle.centres)), np.array([[0.0, 0.0, 1.0]]))
    steps = []
    for shape, contacts, damping in (
        (tip, 2 * CONTACTS_AT_A_TIP, law.normal_damping),
        (tip, CONTACTS_AT_A_TIP, law.wall_damping),
        (flat, 4, max(law.normal_damping, law.wall_damping / 2)),
    ):
        stiffness = pins + contacts * law.normal_stiffness * shape
        damped = contacts * damping * shape
        if hinges.shaft_damping:
            damped = damped + hinges.shaft_damping * _twist_shape()
        steps.append(_stable_step(mass, stiffness, damped))
    # Links that all roll in one sense in a flat pile rub against those above and below, and have little inertia about
    # their length. In series, the wall's dashpot is at most twice the other.
    roll = _roll_shape(particle)
    damping = max(law.normal_damping, law.wall_damping / 2) * law.tangential_damping
    steps.append(_stable_step(mass, pins + 4 * law.tangential_stiffness * roll, 4 * damping * roll))
    return min(steps)


def planar_stable_time_step(
    particle: Particle, law: ContactLaw, hinges: HingeLaw, strings: Sequence[tuple[float, float]] = ()
) -> float:
    """Return the largest stable time step [s] of articulated smarticles that lie side by side in a plane.

    The step is the least over the stiffest modes:

    - a barb that lies along another barb, which moves in the opposite direction; each sphere touches
      `CONTACTS_IN_A_ROW` spheres;
    - a middle link that lies along a wall, which all spheres of its outer row touch;
    - a barb with a string at its tip.

    Args:
        strings: stiffness [N/m] and damping [N s/m] of each string.
    """
    boxes = particle.boxes
    mass, pins = _mass_matrix(boxes), _hinge_stiffness(boxes, hinges)
    twisted = hinges.shaft_damping * _twist_shape()
    steps = []
    for link, contacts, damping in ((0, 2 * CONTACTS_IN_A_ROW, law.normal_damping), (1, 1, law.wall_damping)):
        across = boxes.link_rotations[link][:, 1][None, :]
        outer = particle.local_centres[:, 1] > (particle.boxes.bulge if link == 1 else 0.0) - particle.radius / 2
        shape = _push_shape(particle, np.flatnonzero((particle.links == link) & outer), across)
        stiffness = pins + contacts * law.normal_stiffness * shape
        steps.append(_stable_step(mass, stiffness, contacts * damping * shape + twisted))
    tip = _velocity_of(boxes, 0, boxes.vertices[0])[:2]
    for pulled, damping in strings:
        steps.append(_stable_step(mass, pins + pulled * tip.T @ tip, damping * tip.T @ tip + twisted))
    return min(steps)


def _roll_shape(particle: Particle) -> Array:
    """Return the stiffness matrix (18, 18) of tangential springs of 1 N/m at the top of every sphere."""
    shape = np.zeros((6 * LINKS, 6 * LINKS))
    for link, height in zip(particle.links, particle.centres[:, 2] + particle.radius, strict=True):
        about = slice(6 * int(link) + 3, 6 * int(link) + 5)
        shape[about, about] += np.eye(2) * height**2
    return shape


def _stable_step(mass: Array, stiffness: Array, damping: Array) -> float:
    def excess(step: float) -> float:
        return float(eigh(stiffness * step**2 + 2 * damping * step, mass, eigvals_only=True)[-1]) - 4

    undamped = 2 / math.sqrt(float(eigh(stiffness, mass, eigvals_only=True)[-1]))
    return float(brentq(excess, 0.0, undamped, xtol=1e-12)) if damping.any() and excess(undamped) > 0 else undamped


def _mass_matrix(boxes: Boxes) -> Array:
    """Return the mass matrix (18, 18) of three free links."""
    blocks = []
    for moved, moments, rotation in zip(boxes.link_masses, boxes.link_inertias, boxes.link_rotations, strict=True):
        blocks += [moved * np.eye(3), rotation @ np.diag(moments) @ rotation.T]
    return np.asarray(block_diag(*blocks))


def _velocity_of(boxes: Boxes, link: int, point: Array) -> Array:
    """Return the matrix (3, 18) from velocities of all links to the velocity of a point of `link`.

    Args:
        point: (3,) the point in the body frame [m].
    """
    x, y, z = point - boxes.link_centres[link]
    rows = np.zeros((3, 6 * LINKS))
    rows[:, 6 * link : 6 * link + 3] = np.eye(3)
    rows[:, 6 * link + 3 : 6 * link + 6] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    return rows


def _hinge_stiffness(boxes: Boxes, law: HingeLaw) -> Array:
    """Return the stiffness matrix (18, 18) of both hinges."""
    stiffness = np.zeros((6 * LINKS, 6 * LINKS))
    plane = np.eye(3)[:2]
    # The damper acts half way between the centre and the end of the axis (see `dem.engine.yade.hinges`).
    damper = np.array([0.0, 0.0, boxes.thickness_normal / 4])
    for hinge, barb in ((1, 0), (2, 2)):
        centre = boxes.vertices[hinge]
        apart = _velocity_of(boxes, barb, centre) - _velocity_of(boxes, 1, centre)
        damped = plane @ (_velocity_of(boxes, barb, centre + damper) - _velocity_of(boxes, 1, centre + damper))
        tilt = np.zeros((2, 6 * LINKS))
        tilt[:, 6 * barb + 3 : 6 * barb + 6], tilt[:, 9:12] = plane, -plane
        stiffness += law.pin_stiffness * apart.T @ apart
        stiffness += law.damper_stiffness * damped.T @ damped
        twist = _twist(barb)
        stiffness += law.tilt_stiffness * tilt.T @ tilt + law.shaft_stiffness * twist.T @ twist
    return stiffness


def _twist(barb: int) -> Array:
    """Return the matrix (1, 18) from velocities of all links to the rate of a barb's angle."""
    row = np.zeros((1, 6 * LINKS))
    row[0, 6 * barb + 5], row[0, 11] = 1, -1
    return row


def _twist_shape() -> Array:
    """Return the stiffness matrix (18, 18) of twist springs of 1 N m/rad at both hinges."""
    return np.asarray(sum(_twist(barb).T @ _twist(barb) for barb in (0, 2)))


def _push_shape(particle: Particle, spheres: Iterable[int], directions: Array) -> Array:
    """Return the stiffness matrix (18, 18) of springs of 1 N/m at the centres of spheres.

    Args:
        spheres: numbers of the spheres.
        directions: (k, 3) unit vectors along which k springs act at each sphere.
    """
    shape = np.zeros((6 * LINKS, 6 * LINKS))
    for sphere in spheres:
        rows = directions @ _velocity_of(particle.boxes, int(particle.links[sphere]), particle.centres[sphere])
        shape += rows.T @ rows
    return shape
