"""Contact stiffness, damping and the stable time step, from masses and inertias rather than from sphere size."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, eigh
from scipy.optimize import brentq

from dem.body.particle import LINKS, Boxes, Particle
from dem.engine.yade.hinges import HingeLaw
from dem.errors import InputError
from dem.phases.actuation import actuated
from dem.phases.chain import Strain
from dem.scene.scene import Scene

Array = NDArray[np.float64]

# Contacts that push one barb tip along the same line at the same time. A tip sphere between the beads of another
# smarticle's chain touches two of them; more act along different directions and do not add up in one mode.
CONTACTS_AT_A_TIP = 2
# Contacts of a sphere in a row with another row along it, as far as it is pressed in by less than a twentieth of the
# square of the pitch, in diameters: the spheres beside the nearest one are touched, those beyond are not.
CONTACTS_IN_A_ROW = 3
# Sphere diameters by which a phase may move walls, hooks or strings in a step. Measured with a hook drawn out of piles
# of 30, draft and standard, 3 to 4 seeds: the deepest contact is 0.29 to 0.55 diameters deep at 0.03, 0.42 to 0.70 at
# 0.05 and 0.61 to 0.66 at 0.1, where the watchdog's limit is 0.5; at 0.3 the hook leaves the pile behind.
MOST_PER_STEP = 0.05


@dataclass(frozen=True, kw_only=True)
class ContactLaw:
    """Linear spring, dashpot and Coulomb friction of one contact.

    Args:
        normal_stiffness: kn [N/m].
        tangential_stiffness: ks [N/m].
        normal_damping: cn between smarticles [N s/m].
        wall_damping: cn against the container [N s/m].
        tangential_damping: cs over cn [1].
        friction: Coulomb coefficient between smarticles [1].
        wall_friction: Coulomb coefficient against the container [1].
    """

    normal_stiffness: float
    tangential_stiffness: float
    normal_damping: float
    wall_damping: float
    tangential_damping: float
    friction: float
    wall_friction: float


def typical_effective_mass(particle: Particle) -> float:
    """Harmonic mean [kg] of the mass felt by a push on a smarticle, over its spheres and all directions.

    The mobility of a point r is 1/m + (r × n)·I⁻¹(r × n); averaged over directions n it is a third of its trace.
    """
    inverse = 1.0 / particle.boxes.inertia
    x, y, z = particle.centres.T
    rotation = (inverse[0] * (y**2 + z**2) + inverse[1] * (x**2 + z**2) + inverse[2] * (x**2 + y**2)) / 3
    return float(1.0 / np.mean(1.0 / particle.boxes.mass + rotation))


def restitution_of(damping_ratio: float) -> float:
    """Restitution [1] of a linear spring and dashpot that never pulls.

    The contact ends when its force is zero, before the spring is back at zero length.

    Source: Schwager and Pöschel, Granular Matter 9, 465 (2007): with ω = √(1 - ζ²) in units of the undamped frequency,
    e = exp[-(ζ/ω)(π - arg(ω² - ζ² + 2iζω))] for ζ < 1, and its continuation above.
    """
    zeta = damping_ratio
    if zeta < 1:
        omega = math.sqrt(1 - zeta**2)
        return math.exp(-zeta / omega * (math.pi - math.atan2(2 * zeta * omega, omega**2 - zeta**2)))
    if zeta == 1:
        return math.exp(-2)
    omega = math.sqrt(zeta**2 - 1)
    return float(((zeta + omega) / (zeta - omega)) ** (-zeta / omega))


def damping_ratio(restitution: float) -> float:
    """Damping ratio ζ [1] of a contact with the given restitution, the inverse of `restitution_of`."""
    if restitution == 1:
        return 0.0
    return float(brentq(lambda zeta: restitution_of(zeta) - restitution, 0.0, 1e4, xtol=1e-14))


def contact_law(scene: Scene) -> ContactLaw:
    """The contact law of a scene; restitution holds at the typical effective mass of a pair."""
    stiffness = scene.fidelity.stiffness_N_per_m
    single = typical_effective_mass(scene.particle)
    zeta = damping_ratio(scene.contact.restitution)
    return ContactLaw(
        normal_stiffness=stiffness,
        tangential_stiffness=stiffness * scene.contact.tangential_stiffness_ratio,
        normal_damping=2 * zeta * math.sqrt(stiffness * single / 2),
        wall_damping=2 * zeta * math.sqrt(stiffness * single),
        tangential_damping=scene.contact.tangential_damping_ratio,
        friction=scene.contact.friction_smarticle,
        wall_friction=scene.contact.friction_wall,
    )


def stable_time_step(particle: Particle, law: ContactLaw) -> float:
    """Largest stable time step [s] of the leapfrog scheme over the stiffest modes of contact.

    Modes are masses on parallel springs and dashpots: the lightest points of two smarticles against each other and
    against the container, `CONTACTS_AT_A_TIP` contacts each; a pile of smarticles lying flat, every sphere in contact
    with the neighbours above and below that move against it, which is the stiffest of any such pile and stiffer than
    one lying on the container; and the same pile in which all roll alike, surfaces rubbing against those above and
    below, stiffer still for bars with barbs below l/w = 0.2, which have little inertia about themselves. Smarticles
    that break the flat or the rolling mode do not blow up but chatter for ever, which shakes the pile and lets it
    compact. YADE takes the dashpot's velocity half a step late, so a mode is stable while ω²dt² + 2c dt ≤ 4 with
    ω² = K/m, c = C/m.

    Source: characteristic polynomial λ² - (2 - c dt - ω²dt²) λ + (1 - c dt) at λ = -1; chain of equal masses at the
    edge of its band, K = 4k.
    """
    lightest, mass, spheres = particle.smallest_effective_mass, particle.boxes.mass, len(particle.centres)
    flat_damping = max(law.normal_damping, law.wall_damping / 2)
    modes = [
        (lightest / 2, CONTACTS_AT_A_TIP, law.normal_stiffness, law.normal_damping),
        (lightest, CONTACTS_AT_A_TIP, law.normal_stiffness, law.wall_damping),
        (mass / 4, spheres, law.normal_stiffness, flat_damping),
    ]
    arms = float(((particle.centres[:, 2] + particle.radius) ** 2).sum())
    modes += [
        (inertia / arms, 4, law.tangential_stiffness, flat_damping * law.tangential_damping)
        for inertia in particle.boxes.inertia[:2]
    ]
    steps = []
    for moved, contacts, stiffness, damping in modes:
        squared = contacts * stiffness / moved
        rate = contacts * damping / moved
        steps.append((math.sqrt(rate**2 + 4 * squared) - rate) / squared)
    return min(steps)


def hinged_stable_time_step(particle: Particle, law: ContactLaw, hinges: HingeLaw) -> float:
    """Largest stable time step [s] of an articulated smarticle, over its stiffest modes of hinges and contact together.

    Three free links, 18 degrees of freedom, joined by the springs of the pins, in the same three surroundings as in
    `stable_time_step`: the tip of a barb against another such tip, against the container, and all of it in a flat pile.
    With M, K and C the matrices of mass, stiffness and damping, stable while K dt² + 2 C dt - 4 M has no positive
    eigenvalue.

    Args:
        particle: one smarticle.
        law: contact law.
        hinges: stiffness of the hinges.
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
    # Links that roll about themselves all alike in a flat pile: surfaces rub against those above and below, and a link
    # has little inertia about itself. In series, the wall's dashpot is at most twice the other.
    roll = _roll_shape(particle)
    damping = max(law.normal_damping, law.wall_damping / 2) * law.tangential_damping
    steps.append(_stable_step(mass, pins + 4 * law.tangential_stiffness * roll, 4 * damping * roll))
    return min(steps)


def planar_stable_time_step(
    particle: Particle, law: ContactLaw, hinges: HingeLaw, strings: Sequence[tuple[float, float]] = ()
) -> float:
    """The same for smarticles that lie flat in a plane, where none lies on another.

    The stiffest surroundings are then a barb that lies along another one that moves against it, each of its spheres
    among `CONTACTS_IN_A_ROW` of the other's, and a middle link that lies along a wall, each sphere in contact with it;
    and a barb with a string at its tip.

    Args:
        particle: one smarticle.
        law: contact law.
        hinges: stiffness of the hinges.
        strings: stiffness [N/m] and damping [N s/m] of each.
    """
    boxes = particle.boxes
    mass, pins = _mass_matrix(boxes), _hinge_stiffness(boxes, hinges)
    twisted = hinges.shaft_damping * _twist_shape()
    steps = []
    for link, contacts, damping in ((0, 2 * CONTACTS_IN_A_ROW, law.normal_damping), (1, 1, law.wall_damping)):
        across = boxes.link_rotations[link][:, 1][None, :]
        shape = _push_shape(particle, np.flatnonzero(particle.links == link), across)
        stiffness = pins + contacts * law.normal_stiffness * shape
        steps.append(_stable_step(mass, stiffness, contacts * damping * shape + twisted))
    tip = _velocity_of(boxes, 0, boxes.vertices[0])[:2]
    for pulled, damping in strings:
        steps.append(_stable_step(mass, pins + pulled * tip.T @ tip, damping * tip.T @ tip + twisted))
    return min(steps)


def _roll_shape(particle: Particle) -> Array:
    """(18, 18): the stiffness matrix of springs of 1 N/m across the highest point of every sphere, against rolling."""
    shape = np.zeros((6 * LINKS, 6 * LINKS))
    for link, height in zip(particle.links, particle.centres[:, 2] + particle.radius, strict=True):
        about = slice(6 * int(link) + 3, 6 * int(link) + 5)
        shape[about, about] += np.eye(2) * height**2
    return shape


def _stable_step(mass: Array, stiffness: Array, damping: Array) -> float:
    def excess(step: float) -> float:
        return float(eigh(stiffness * step**2 + 2 * damping * step, mass, eigvals_only=True)[-1]) - 4

    undamped = 2 / math.sqrt(float(eigh(stiffness, mass, eigvals_only=True)[-1]))
    return float(brentq(excess, 0.0, undamped, xtol=1e-12)) if damping.any() else undamped


def _mass_matrix(boxes: Boxes) -> Array:
    """(18, 18) of three links: velocity and angular velocity of each, in the body frame."""
    blocks = []
    for moved, moments, rotation in zip(boxes.link_masses, boxes.link_inertias, boxes.link_rotations, strict=True):
        blocks += [moved * np.eye(3), rotation @ np.diag(moments) @ rotation.T]
    return np.asarray(block_diag(*blocks))


def _velocity_of(boxes: Boxes, link: int, point: Array) -> Array:
    """(3, 18): velocity of a point of a link (3,) [m], body frame, from those of all links."""
    x, y, z = point - boxes.link_centres[link]
    rows = np.zeros((3, 6 * LINKS))
    rows[:, 6 * link : 6 * link + 3] = np.eye(3)
    rows[:, 6 * link + 3 : 6 * link + 6] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    return rows


def _hinge_stiffness(boxes: Boxes, law: HingeLaw) -> Array:
    """(18, 18): the stiffness matrix of both hinges."""
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
    """(1, 18): how much a barb turns against the middle link, about the normal."""
    row = np.zeros((1, 6 * LINKS))
    row[0, 6 * barb + 5], row[0, 11] = 1, -1
    return row


def _twist_shape() -> Array:
    """(18, 18): the matrix of twist springs of 1 N m/rad at both hinges."""
    return np.asarray(sum(_twist(barb).T @ _twist(barb) for barb in (0, 2)))


def _push_shape(particle: Particle, spheres: Iterable[int], directions: Array) -> Array:
    """(18, 18): the stiffness matrix of springs of 1 N/m on spheres, along directions (k, 3)."""
    shape = np.zeros((6 * LINKS, 6 * LINKS))
    for sphere in spheres:
        rows = directions @ _velocity_of(particle.boxes, int(particle.links[sphere]), particle.centres[sphere])
        shape += rows.T @ rows
    return shape


def hinge_law(scene: Scene) -> HingeLaw:
    """The hinges of a scene that actuates."""
    motor, pin = scene.motor, scene.fidelity.hinge_stiffness_N_per_m
    return HingeLaw(
        pin_stiffness=pin,
        # As if the pin were held at both faces of the links.
        tilt_stiffness=pin * (scene.smarticle.thickness_normal_m / 2) ** 2,
        shaft_stiffness=motor.stiffness_N_m_per_rad,
        torque_cap=scene.torque_limit if motor.law in ("slip", "servo") else None,
        shaft_damping=motor.damping_N_m_s_per_rad,
    )


def stable_step(scene: Scene) -> float:
    """Largest stable time step [s] of a scene, articulated where a phase actuates."""
    law = contact_law(scene)
    stable = stable_time_step(scene.particle, law)
    if scene.actuates and scene.plane is not None:
        strings = [
            (phase.string_stiffness_N_per_m, phase.string_damping_N_s_per_m)
            for phase in scene.phases
            if isinstance(phase, Strain)
        ]
        return planar_stable_time_step(scene.particle, law, hinge_law(scene), strings)
    if scene.actuates:
        stable = min(stable, hinged_stable_time_step(scene.particle, law, hinge_law(scene)))
    return stable


def time_step(scene: Scene) -> float:
    """The time step [s] of a scene, a whole fraction of its recording intervals and of its control period.

    Raises:
        InputError: the given `time_step_s` is above the stable one, the recording intervals do not fit, or a phase
            moves something so fast that contacts cannot follow.
    """
    stable = stable_step(scene)
    given = scene.fidelity.time_step_s
    if given is not None and given > stable:
        # Half a percent less, so that the three digits are not above it.
        msg = (
            f"fidelity.time_step_s: {given:g} s is above the stable step {stable:.4g} s of this smarticle at "
            f"{scene.fidelity.stiffness_N_per_m:g} N/m; use at most {0.995 * stable:.3g} s or leave it out"
        )
        raise InputError(msg)
    wanted = given if given is not None else scene.fidelity.time_step_fraction * stable
    whole = scene.fidelity.control_interval_s if scene.actuates else scene.recording.series_interval_s
    steps = _steps_in(whole, wanted)
    if scene.actuates and scene.motor.law == "servo" and steps > 1:
        # A damper that acts a period late drives vibrations that are faster than the period.
        msg = (
            f"fidelity.control_interval_s: {whole:g} s is {steps} time steps, but a servo (motor.law) must damp in "
            f"each; use at most {wanted:.3g} s, or softer contacts, servos and strings"
        )
        raise InputError(msg)
    return whole / steps


def time_steps(scene: Scene) -> tuple[float, ...]:
    """The time step [s] of each phase.

    Until motors act for the first time, smarticles are the rigid bodies that were poured, which hinges do not concern:
    these phases have the step of a scene without motors, and so the same bits. After that a welded smarticle has
    whatever shape its motors left it in, for which no longer step than that of the hinges is known to be stable. A
    step given by hand is that of all phases.

    Raises:
        InputError: as in `time_step`, or something moves too fast for the step of its phase.
    """
    count, shortest = len(scene.phases), time_step(scene)
    first = next((k for k, phase in enumerate(scene.phases) if actuated(phase)), count)
    steps = (shortest,) * count
    if scene.fidelity.time_step_s is None and scene.plane is None and first < count:
        whole = scene.recording.series_interval_s
        stable = stable_time_step(scene.particle, contact_law(scene))
        poured = whole / _steps_in(whole, scene.fidelity.time_step_fraction * stable)
        steps = (poured,) * first + (shortest,) * (count - first)
    _check_speeds(scene, steps)
    return steps


def _steps_in(interval: float, wanted: float) -> int:
    """How many equal time steps an interval has, of at most the length that is wanted [s]."""
    return max(1, math.ceil(interval / wanted * (1 - 1e-12)))


def _check_speeds(scene: Scene, steps: Sequence[float]) -> None:
    """Refuse speeds of walls, hooks and strings that pass through smarticles before a contact can push them away."""
    diameter = scene.sphere_diameter
    for index, (phase, step) in enumerate(zip(scene.phases, steps, strict=True)):
        most = MOST_PER_STEP * diameter / step
        speed = getattr(phase, "speed_m_per_s", None) or 0.0
        if speed > most:
            # Half a percent less, so that the three digits are not above it.
            msg = (
                f"phases.{index}.speed_m_per_s: {speed:g} m/s ({phase.type}) is {speed * step / diameter:.3g} sphere "
                f"diameters in a time step of {step:.3g} s, which contacts cannot follow; use at most "
                f"{0.995 * most:.3g} m/s or a shorter fidelity.time_step_s"
            )
            raise InputError(msg)
