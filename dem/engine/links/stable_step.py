"""Stable time steps on the engine links, from the stiffest modes of vibration.

Leapfrog takes the velocities of dashpots half a step late. With the matrices M of mass, K of stiffness and C of damping
of a body in a mode, a step dt is stable while K dt² + 2 C dt - 4 M has no positive eigenvalue.

A mode of several bodies is never stiffer than modes of each body alone, whose contacts are stiffer: for any θ > 0,
|a - b|² ≤ (1 + θ) |a|² + (1 + 1/θ) |b|² for the motions a and b of two bodies at their contact. Between equal bodies
θ = 1: neighbours that move against each other double the stiffness.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dem.body.filament import Filament
from dem.body.kinds import Mixture
from dem.body.linear import matrix_product, positive_definite
from dem.body.linkage import Linkage
from dem.body.particle import Particle
from dem.engine.links.arrays import PLANE
from dem.engine.links.joints import pins_of
from dem.engine.links.motion.bending import RESOLVED
from dem.engine.links.motion.planar import lay_out
from dem.engine.links.shapes import AT_END, AT_START, RADIUS, Shape, kind_shape, link_shapes, smarticle_shape
from dem.physics.contact import ContactLaw

Array = NDArray[np.float64]
Mode = tuple[Array, Array]  # stiffness and damping (k, k) of the degrees of freedom of a body

# Contacts that push a tip along the same line at the same time; more act along different directions.
CONTACTS_AT_A_TIP = 2
# Bonds between neighbours that move against each other, above and below, each at twice the motion of one.
AGAINST_NEIGHBOURS = 4
# Strands up to which a bar counts as narrow: it does not lie on a neighbour with all strands at both ends at once.
NARROW = 3
SHAPES = 8  # angles that are tried where motors may turn the barbs, from straight to beyond the U
WIDEST = math.radians(105.0)
PRECISE = 1e-12  # of a step


def links_stable_time_step(
    particle: Particle,
    law: ContactLaw,
    *,
    articulated: bool = False,
    strings: Sequence[tuple[float, float]] = (),
) -> float:
    """Return the largest stable time step [s] over the stiffest modes of a smarticle in a pile.

    The modes are:

    - a barb's tip against another tip, or against a boundary;
    - a pile of smarticles that lie flat on each other, with contacts at all ends of all links; a smarticle moves up
      while its neighbours above and below move down;
    - a flat pile in which links rub against links above and below;
    - a tip with a string.

    If motors may turn the barbs (`articulated`), the angles are free, which reduces the effective mass of a tip.
    Strings have a stiffness [N/m] and a damping [N s/m] each.
    """
    boxes = particle.boxes
    angles = [boxes.angles]
    if articulated and boxes.barb_length > 0:
        angles += [(angle, angle) for angle in np.linspace(0.0, WIDEST, SHAPES)]
    shapes = (smarticle_shape(replace(particle, boxes=replace(boxes, angles=each))) for each in angles)
    return min(_step_of(shape, each, law, articulated, strings) for shape, each in zip(shapes, angles, strict=True))


def mixture_stable_time_step(mixture: Mixture, law: ContactLaw) -> float:
    """Return the largest stable time step [s] over the modes of all kinds of a mixture.

    The pair of kinds i and j with the typical effective masses m and m' has the stiffness k and a dashpot
    c ∝ √(m m'/(m + m')). With θ = √(m/m') the body i by itself has the stiffness (1 + θ) k, which is largest beside the
    lightest kind, and the damping (1 + θ) c, which is largest beside its own kind. So the modes of each kind are taken
    among its equals, with its own dashpots and (1 + θ)/2 times the stiffness.
    """
    shapes = [kind_shape(kind) for kind in mixture.kinds]
    masses, steps = [shape.effective_mass for shape in shapes], []
    for kind, shape, mass in zip(mixture.kinds, shapes, masses, strict=True):
        own = law.scaled(dashpots=math.sqrt(mass / masses[0]))
        bound = own.scaled(springs=(1 + math.sqrt(mass / min(masses))) / 2)
        if kind.linkage is not None:
            steps.append(linkage_stable_time_step(kind.linkage, link_shapes(kind), bound, own))
        elif kind.filament is not None:
            steps.append(filament_stable_time_step(kind.filament, bound))
        else:
            steps.append(rigid_stable_time_step(shape, bound))
    return min(steps)


def filament_stable_time_step(filament: Filament, law: ContactLaw) -> float:
    """Return the largest stable time step [s] over the stiffest modes of a filament among filaments.

    In these modes neighbouring nodes move in opposite directions: along the filament, across it, or about its axis. The
    stiffness is that of stretching, bending or twisting plus that of contacts. Two cases of contacts are considered:
    contacts at a tip, and contacts along both sides of the filament, one per diameter. The bodies that touch a node are
    assumed to move opposite to it.
    """
    length, mass = filament.segment_length, filament.mass / (filament.nodes - 1)
    cn = max(2 * law.normal_damping, law.wall_damping) / mass
    kn, ks, cs = 2 * law.normal_stiffness / mass, 2 * law.tangential_stiffness / mass, cn * law.tangential_damping
    # A tip has half the mass of a node; contacts a diameter apart share their push between neighbouring nodes.
    tip, side = 2 * CONTACTS_AT_A_TIP, max(CONTACTS_AT_A_TIP, length / filament.diameter)
    along, bent, twisted = filament.stiffest
    # Squares of frequencies [1/s²] and rates of damping [1/s]; a push on the side of a filament that can roll meets a
    # third of its mass.
    modes = (
        (along + max(tip * kn, side * ks), filament.stretching_time * along + max(tip * cn, side * cs)),
        (bent + max(tip * kn, side * kn), filament.bending_time * bent + max(tip, side) * cn),
        (bent + 3 * side * ks, filament.bending_time * bent + 3 * side * cs),
        (twisted + 2 * side * ks, filament.stretching_time * twisted + 2 * side * cs),
    )
    drag = filament.drags[0] * length / mass
    return min(min((math.sqrt((c + drag) ** 2 + 4 * k) - (c + drag)) / k, RESOLVED / math.sqrt(k)) for k, c in modes)


def _step_of(
    shape: Shape, angles: tuple[float, float], law: ContactLaw, free: bool, strings: Sequence[tuple[float, float]]
) -> float:
    assert shape.planar is not None
    free = free and shape.planar.barb_mass > 0
    row = np.zeros(PLANE)
    lay_out(shape.planar, float(angles[0]), float(angles[1]), row)
    mass = _mass(shape, row, free)
    # Strands of a link lie one above the other along the normal: a tip's are pushed together from the side, but the
    # highest and the lowest one alone touch the links that lie flat above and below.
    ends, radius = _ends(shape), float(shape.lines[:, RADIUS].max())
    highest = max(z for _, (_, _, z) in ends)
    tip = [_motion_of(shape, row, link, (x, y, z), free) for link, (x, y, z) in ends if (link, x, y) == _tip_of(ends)]
    flat = [end for end in ends if end[1][2] == highest]
    top = [_motion_of(shape, row, link, (x, y, z + radius), free) for link, (x, y, z) in flat]
    tips = sum((matrix_product(push.T, push) for push in tip), np.zeros_like(mass))
    heave = sum((matrix_product(push[2:].T, push[2:]) for push in top), np.zeros_like(mass))
    rub = sum((matrix_product(push[:2].T, push[:2]) for push in top), np.zeros_like(mass))
    modes = [*_modes_of_end(law, tips), *_modes_of_pile(law, heave, rub)]
    modes += [(stiffness * tips, damping * tips) for stiffness, damping in strings]
    if len(tip) > NARROW:
        for link in range(3):
            places = [place for of, place in ends if of == link]
            face = [_motion_of(shape, row, link, place, free) for place in places]
            modes += _modes_of_face(law, face, _in_grooves(np.array(places), radius))
    return _step_of_modes(mass, modes)


def linkage_stable_time_step(linkage: Linkage, links: Sequence[Shape], law: ContactLaw, pins: ContactLaw) -> float:
    """Return the largest stable time step [s] over the stiffest modes of a linkage's links in a pile.

    They are those of rigid bodies, with the joints at both ends of a link, which the neighbours move against it: since
    |a + b|² ≤ 2 (|a|² + |b|²), a joint of stiffness k is never stiffer than 2 k on each of its links by itself. The
    springs of joints follow from the law `pins` of the linkage's own contacts.
    """
    known: dict[bytes, float] = {}
    for number, shape in enumerate(links):
        joints = _joints_of(linkage, number, pins)
        key = shape.lines.tobytes() + joints[0].tobytes() + joints[1].tobytes()
        if key not in known:  # most links are alike
            known[key] = rigid_stable_time_step(shape, law, joints)
    return min(known.values())


def _joints_of(linkage: Linkage, number: int, law: ContactLaw) -> Mode:
    """Return stiffness and damping (6, 6) of a link's joints, for motions of this link alone."""
    pin, damping, off, off_damping = pins_of(linkage, law)
    stiffness, resisting, half = np.zeros((6, 6)), np.zeros((6, 6)), linkage.links[number].lengths[0] / 2
    for before in (number - 1, number):
        if not 0 <= before < len(linkage.joints):
            continue
        joint, side = linkage.joints[before], 1 if before == number else -1
        motion = _motion(np.array([side * half, 0.0, 0.0]))
        push = 2 * matrix_product(motion.T, motion)
        # The second of two axes turns about the first, seen from either link, and may have any direction across it.
        axes = joint.axes if len(joint.axes) != 2 else joint.axes[:1] if side > 0 else joint.axes[1:]
        turns = 2 * matrix_product(np.array(axes).T, np.array(axes))
        across = 2 * np.eye(3) - turns
        several = len(joint.axes) == 2
        stiffness += pin * push
        stiffness[3:, 3:] += joint.stiffness * turns + max(off, several * joint.stiffness) * across
        resisting += damping * push
        resisting[3:, 3:] += joint.damping * turns + max(off_damping, several * joint.damping) * across
    return stiffness, resisting


def rigid_stable_time_step(shape: Shape, law: ContactLaw, joints: Mode | None = None) -> float:
    """Return the largest stable time step [s] over the stiffest modes of a rigid body among bodies.

    The modes are: an end of a bar, with all its strands (segments side by side), against another such end or against a
    boundary; a bar of more than `NARROW` strands that lies on others with all strands at both ends; and a pile of
    bodies that lie on their broad side, with a contact at every end, in which neighbours above and below move in
    opposite directions, across or along the broad side.

    The stiffness and damping `joints` (6, 6) of a link's joints are added to each mode.
    """
    mass = np.diag([*[shape.mass] * 3, *shape.inertia[:3]])
    places: dict[tuple[int, int], list[Array]] = {}  # strands at each end of each bar
    for line, link, shared in zip(shape.lines, shape.link, shape.shared, strict=True):
        for bit, place in ((AT_END, line[:3] + line[3:6]), (AT_START, line[:3])):
            if not shared & bit:
                places.setdefault((int(link), bit), []).append(place)
    ends, radius = list(places.values()), float(shape.lines[:, RADIUS].max())
    modes: list[Mode] = []
    for strands in ends:
        tips = sum((matrix_product(push.T, push) for push in map(_motion, strands)), np.zeros((6, 6)))
        modes += _modes_of_end(law, tips)
    for link in {link for (link, _), strands in places.items() if len(strands) > NARROW}:
        face = [place for (of, _), strands in places.items() if of == link for place in strands]
        modes += _modes_of_face(law, [_motion(place) for place in face], _in_grooves(np.array(face), radius))
    # The broad side is across the axis along which the bars reach least: strands lie one above the other there.
    spread = np.ptp([np.mean(strands, axis=0) for strands in ends], axis=0)
    within = np.sum([np.ptp(strands, axis=0) for strands in ends], axis=0)
    up = int(np.lexsort((-within, np.round(spread / (spread.max() + 1e-30), 6)))[0])
    across = [axis for axis in range(3) if axis != up]
    heave, rub = np.zeros((6, 6)), np.zeros((6, 6))
    for strands in ends:
        top = max(strands, key=lambda place: float(place[up])) + radius * np.eye(3)[up]
        push = _motion(top)
        heave += matrix_product(push[[up]].T, push[[up]])
        rub += matrix_product(push[across].T, push[across])
    modes += _modes_of_pile(law, heave, rub)
    if joints is not None:
        modes = [(stiffness + joints[0], resisting + joints[1]) for stiffness, resisting in modes]
    return _step_of_modes(mass, modes)


def _modes_of_end(law: ContactLaw, tips: Array) -> list[Mode]:
    """Return the modes of a bar's end against another end, and against a boundary.

    `tips` (k, k) is the sum of Jᵀ J over the strands at the end; J is the matrix from the k velocities of the body to
    the velocity of a strand's end.
    """
    kn, cn, cw = law.normal_stiffness, law.normal_damping, law.wall_damping
    return [
        (2 * CONTACTS_AT_A_TIP * kn * tips, 2 * CONTACTS_AT_A_TIP * cn * tips),
        (CONTACTS_AT_A_TIP * kn * tips, CONTACTS_AT_A_TIP * cw * tips),
    ]


def _modes_of_face(law: ContactLaw, pushes: Sequence[Array], stiffer: float) -> list[Mode]:
    """Return the modes of a bar that lies on others with all strands at both ends, `stiffer` times as stiff as one end.

    `pushes` are the matrices from the k velocities of the body to the velocity of each strand's end.
    """
    both = sum((matrix_product(push.T, push) for push in pushes), np.zeros((pushes[0].shape[1],) * 2))
    return [(stiffer * stiffness, stiffer * damping) for stiffness, damping in _modes_of_end(law, both)]


def _in_grooves(places: Array, radius: float) -> float:
    """Return how many times as stiff strands are that lie between two strands of another bar, instead of on one [1].

    The two contacts of a strand of the diameter d are inclined by φ, with sin φ = p/2d at the pitch p of strands, and
    are 2 cos² φ times as stiff as one. `places` (n, 3) are those of strands' ends [m].
    """
    apart = np.linalg.norm(places[1:] - places[:-1], axis=1)
    return float(max(1.0, 2 * (1 - (apart.min() / (4 * radius)) ** 2)))


def _modes_of_pile(law: ContactLaw, heave: Array, rub: Array) -> list[Mode]:
    """Return the modes of a pile of bodies that lie on their broad side.

    J is the matrix from the k velocities of a body to the velocity of a point of contact; `heave` and `rub` (k, k) are
    sums of Jᵀ J over all contacts, with the rows of J across and along the broad side.
    """
    kn, ks, cs = law.normal_stiffness, law.tangential_stiffness, law.tangential_damping
    damping = max(law.normal_damping, law.wall_damping / 2)
    return [
        (AGAINST_NEIGHBOURS * kn * heave, AGAINST_NEIGHBOURS * damping * heave),
        (AGAINST_NEIGHBOURS * ks * rub, AGAINST_NEIGHBOURS * damping * cs * rub),
    ]


def _motion(place: Array) -> Array:
    """Return the matrix (3, 6) that maps a body's velocity and spin to a point's velocity; place in m."""
    x, y, z = place
    return np.column_stack([np.eye(3), [[0, z, -y], [-z, 0, x], [y, -x, 0]]])


def _step_of_modes(mass: Array, modes: Sequence[Mode]) -> float:
    stiffness, resisting = (np.array(each) for each in zip(*modes, strict=True))
    # Without dashpots the longest stable step would resolve a contact by three steps, and energy would drift.
    return min(
        _stable_step(mass, stiffness, resisting), RESOLVED / 2 * _stable_step(mass, stiffness, np.zeros_like(resisting))
    )


def _mass(shape: Shape, row: Array, free: bool) -> Array:
    """Return the mass matrix (6, 6), with free angles (8, 8), of a smarticle with plane geometry `row`.

    Rows are for velocity, angular velocity in the middle link's axes and, if `free`, rates of the angles.
    """
    mass = np.zeros((8, 8))
    mass[:3, :3] = shape.mass * np.eye(3)
    xx, yy, zz, xy, b1, b2, a, c = row[14:22]
    mass[3:6, 3:6] = [[xx, xy, 0.0], [xy, yy, 0.0], [0.0, 0.0, zz]]
    mass[5, 6:] = mass[6:, 5] = [b1, b2]
    mass[6:, 6:] = [[a, c], [c, a]]
    return mass if free else mass[:6, :6]


def _ends(shape: Shape) -> list[tuple[int, tuple[float, float, float]]]:
    """Return link and position from the centre of mass [m] of each end of a segment; a joint occurs once."""
    ends = []
    for line, link, shared in zip(shape.lines, shape.link, shape.shared, strict=True):
        for bit, place in ((AT_END, line[:3] + line[3:6]), (AT_START, line[:3])):
            if not shared & bit:
                x, y, z = (float(value) for value in place)
                ends.append((int(link), (x, y, z)))
    return ends


def _tip_of(ends: list[tuple[int, tuple[float, float, float]]]) -> tuple[int, float, float]:
    """Return link, x and y [m] of a tip: of barb 1, or without barbs of the middle link."""
    link, (x, y, _) = ends[0]
    return link, x, y


def _motion_of(shape: Shape, row: Array, link: int, place: tuple[float, float, float], free: bool) -> Array:
    """Return the matrix (3, 6) that maps a smarticle's velocity and spin to a point's velocity.

    If `free`, the matrix is (3, 8): two more columns are for the rates of both angles.
    The row is the plane geometry of the smarticle; `place` is that of the point on its link, from the centre of mass
    [m].
    """
    planar, (x, y, z) = shape.planar, place
    assert planar is not None
    motion = np.zeros((3, 8))
    motion[:, :3] = np.eye(3)
    motion[:, 3:6] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    share = planar.barb_mass / planar.mass
    for k, barb in enumerate((0, 2)):
        motion[:2, 6 + k] = -share * row[6 + 2 * k : 8 + 2 * k]
        if link == barb:
            sign, hinge = (-1.0, -planar.half) if k == 0 else (1.0, planar.half)
            motion[:2, 6 + k] += sign * np.array([-(y + row[1]), x + row[0] - hinge])
    return motion if free else motion[:, :6]


def _stable_step(mass: Array, stiffness: Array, damping: Array) -> float:
    """Return the largest step [s] up to which 4 M - K dt² - 2 C dt is positive definite for all modes.

    M is (k, k); K and C of each mode are (n, k, k).
    """
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
