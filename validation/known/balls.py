"""Balls on both engines, their contact laws from elastic constants, and impacts integrated apart from the engines.

The engines have no balls. A bar whose length exceeds its diameter by `STUB` stands in for one: on the engine links a
swept segment of nearly zero length, on YADE one sphere. Mass and inertia are those of a solid ball, 2/5 m R².

Laws of contact here are linear, those of the sources Hertz's. The normal stiffness gives Hertz's contact time, the
tangential one the phase of Mindlin's tangential vibration; see `Hertz`.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import beta

from dem.body.bars import Bars
from dem.body.kinds import Kind
from dem.body.particle import Boxes, SphereChain
from dem.physics.contact import ContactLaw, damping_ratio
from validation.access import Ball, EngineAccess
from validation.bench import Array, add

STUB = 1e-9  # length of a ball's axis, in diameters
SOLID = 2 / 5  # moment of inertia of a solid ball, in m R²
RESOLVED = 400  # time steps per elastic contact


@dataclass(frozen=True, kw_only=True)
class Material:
    """Elastic constants and density of a published test."""

    name: str
    young: float  #: E [Pa]
    poisson: float
    density: float  #: [kg/m³]

    @property
    def plane_strain(self) -> float:
        """E/(1 - ν²) [Pa]."""
        return self.young / (1 - self.poisson**2)

    @property
    def mindlin(self) -> float:
        """Tangential over normal stiffness of a Hertzian contact [1], 2(1 - ν)/(2 - ν). Source: Mindlin (1949)."""
        return 2 * (1 - self.poisson) / (2 - self.poisson)

    def mass(self, radius: float) -> float:
        """Return the mass [kg] of a ball of a radius [m]."""
        return self.density * 4 / 3 * math.pi * radius**3


@dataclass(frozen=True, kw_only=True)
class Hertz:
    """Elastic impact of a ball on a plane or on a ball by Hertz, and the linear springs that take its place."""

    modulus: float  #: E* [Pa]
    radius: float  #: R* [m]
    mass: float  #: Effective mass [kg]
    speed: float  #: Approach speed [m/s]

    @property
    def deepest(self) -> float:
        """Largest overlap [m], (5 m v²/(4 k_H))^(2/5) with k_H = 4/3 E* √R*."""
        stiffness = 4 / 3 * self.modulus * math.sqrt(self.radius)
        return float((5 * self.mass * self.speed**2 / (4 * stiffness)) ** 0.4)

    @property
    def duration(self) -> float:
        """Contact time [s], 4/5 B(2/5, 1/2) = 2.943 times the largest overlap over the speed."""
        return float(0.8 * beta(0.4, 0.5)) * self.deepest / self.speed

    @property
    def stiffness(self) -> float:
        """Stiffness of the linear spring of equal contact time [N/m]."""
        return self.mass * (math.pi / self.duration) ** 2


# Phase of the tangential vibration of a ball that does not slip, ∫ω dt over the contact. With a tangential stiffness
# κ times the normal one it is π √(7κ/2) for linear springs, and √(15/8) 4/5 π √(7κ/2) for Hertz's: equal at κ 6/5.
EQUAL_PHASE = 6 / 5


@dataclass(frozen=True, kw_only=True)
class _SolidBoxes(Boxes):
    """Box with the mass and the inertia of a solid ball of a `radius` [m]."""

    radius: float

    @property
    def _moment(self) -> float:
        return SOLID * self.mass * self.radius**2

    @property
    def link_inertias(self) -> Array:
        """(3, 3) principal moments of the links [kg m²]: those of the ball, and 0 of the missing barbs."""
        return np.array([[0.0] * 3, [self._moment] * 3, [0.0] * 3])

    @property
    def inertia(self) -> Array:
        """(3,) principal moments [kg m²]."""
        return np.full(3, self._moment)


@dataclass(frozen=True, kw_only=True)
class _SolidBars(Bars):
    """One round bar with the mass and the inertia of a solid ball of its diameter."""

    @property
    def masses(self) -> Array:
        """(1,) mass of the ball [kg]."""
        return np.array([self.density * math.pi / 6 * self.thickness_in_plane**3])

    @cached_property
    def _principal(self) -> tuple[Array, Array]:
        return np.full(3, SOLID * self.mass * self.thickness_in_plane**2 / 4), np.eye(3)


def ball(radius: float, density: float) -> Ball:
    """Return a ball of a radius [m] and a density [kg/m³]."""
    length = 2 * radius * (1 + STUB)
    side = math.sqrt(4 / 3 * math.pi * radius**3 / length)
    boxes = _SolidBoxes(
        middle_length=length,
        barb_length=0.0,
        thickness_normal=side,
        thickness_in_plane=side,
        density=density,
        radius=radius,
    )
    return Ball(boxes, SphereChain(rows=1, diameter=2 * radius, pitch=2 * radius))


def ball_kind(radius: float, density: float) -> Kind:
    """Return a ball as a kind of a mixture; the radius is in [m], the density in [kg/m³]."""
    points = np.array([[[0.0, 0.0, 0.0], [2 * radius * (1 + STUB), 0.0, 0.0]]])
    bars = _SolidBars(
        points=points,
        normals=np.array([[0.0, 0.0, 1.0]]),
        thickness_normal=2 * radius,
        thickness_in_plane=2 * radius,
        density=density,
        round=True,
    )
    return Kind(name="ball", bars=bars, rows=1, diameter=2 * radius, pitch=2 * radius)


def ends_at_plane(access: EngineAccess) -> int:
    """Return the number of points with which a ball touches a plane: a bar on links does so with both its ends."""
    return 2 if access.name == "links" else 1


def law(
    access: EngineAccess,
    *,
    stiffness: float,
    mass: float,
    restitution: float = 1.0,
    friction: float = 0.0,
    ratio: float = 1.0,
    dashpot: float = 0.0,
    plane: bool = True,
) -> ContactLaw:
    """Return the law of a ball's contact of a stiffness [N/m] in all, at a plane or with an equal ball.

    `mass` is the ball's [kg], `ratio` the tangential over the normal stiffness, `dashpot` the tangential over the
    normal damping [1].
    """
    each = stiffness / (ends_at_plane(access) if plane else 1)
    critical = 2 * damping_ratio(restitution) * math.sqrt(stiffness * mass)
    return ContactLaw(
        normal_stiffness=each,
        tangential_stiffness=ratio * each,
        normal_damping=critical / math.sqrt(2),
        wall_damping=critical * each / stiffness,
        tangential_damping=dashpot,
        friction=friction,
        wall_friction=friction,
    )


@dataclass(frozen=True)
class Rebound:
    """Motion of a ball after an impact."""

    normal: float  #: Velocity away from the plane [m/s]
    along: float  #: Velocity along the plane [m/s]
    spin: float  #: Spin, positive as that of a ball that rolls backwards [rad/s]

    def slip(self, radius: float) -> float:
        """Return the velocity of the ball's lowest point along the plane [m/s], for its radius [m]."""
        return self.along + radius * self.spin


def on_plane(
    access: EngineAccess, body: Ball, law: ContactLaw, *, speed: float, along: float = 0.0, spin: float = 0.0, dt: float
) -> Rebound:
    """Throw a ball at the floor without gravity, and return its motion after the impact.

    Args:
        speed: downward velocity [m/s].
        along: velocity along x [m/s].
        spin: spin, see `Rebound` [rad/s].
        dt: time step, 1/`RESOLVED` of the elastic contact [s].
    """
    engine = access.build(body, law, dt=dt)
    add(engine, (0, 0, body.radius + 3.3 * speed * dt))
    access.push(engine, 0, velocity=(along, 0, -speed), spin=(0, -spin, 0))
    engine.advance(4 + 2 * RESOLVED)
    state = engine.state().smarticles
    found = Rebound(float(state.velocities[0, 2]), float(state.velocities[0, 0]), -float(state.link_spins[0, 1, 1]))
    assert found.normal > 0  # it has left the floor
    return found


def impacts(
    along: Array,
    spin: Array,
    *,
    friction: float,
    restitution: float,
    ratio: float,
    dashpot: float = 0.0,
    lever: float | Array = 1.0,
    steps: int = 4000,
) -> tuple[Array, Array]:
    """Integrate oblique impacts on linear springs with Coulomb friction; all in units of ball and normal spring.

    The approach speed, the ball's mass, its radius and the normal stiffness are 1. The contact ends when the normal
    force is zero. A tangential spring beyond Coulomb's limit is cut to it; the tangential dashpot does not act then.

    Args:
        along: (n,) velocities along the plane.
        spin: (n,) spins, see `Rebound`.
        ratio: tangential over normal stiffness.
        dashpot: tangential over normal damping.
        lever: distance of the contact from the ball's centre.
        steps: number of steps of an elastic contact.

    Returns:
        Velocities along the plane and spins after the impact, (n,) each.
    """
    damping, dt = 2 * damping_ratio(restitution), math.pi / steps
    depth, speed, along, spin = 0.0, 1.0, along.copy(), spin.copy()
    stretch = np.zeros(len(along))
    while True:
        depth += 0.5 * dt * speed  # leapfrog: forces in the middle of the step
        load = depth + damping * speed
        if load <= 0:
            return along, spin
        slip = along + lever * spin
        stretch += dt * slip
        limit = friction * load / ratio
        slides = np.abs(stretch) > limit
        stretch = np.clip(stretch, -limit, limit)
        force = ratio * stretch + np.where(slides, 0.0, dashpot * damping * slip)
        along -= dt * force
        spin -= dt * lever * force / SOLID
        speed -= dt * load
        depth += 0.5 * dt * speed


def slid(
    along: Array, spin: Array, *, friction: float, restitution: float, lever: float | Array = 1.0
) -> tuple[Array, Array]:
    """Return velocities along the plane and spins after impacts in which balls slide throughout.

    Units and arguments are those of `impacts`. The tangential impulse is μ(1 + e), whatever the law of contact. Source:
    impulse theory with Coulomb friction, as in Chung and Ooi, Granular Matter 13, 643 (2011).
    """
    impulse = friction * (1 + restitution) * np.sign(along + spin)
    return along - impulse, spin - lever * impulse / SOLID


def slides(along: Array, spin: Array, *, friction: float, restitution: float, margin: float = 1.25) -> Array:
    """Return whether each ball slides throughout; its slip is `margin` times that at which it just does [1]."""
    return np.asarray(np.abs(along + spin) > margin * friction * (1 + restitution) * (1 + 1 / SOLID))


def mindlin_impacts(along: Array, *, friction: float, ratio: float, steps: int = 4000) -> tuple[Array, Array]:
    """Integrate elastic oblique impacts with the incremental law of Hertz and Mindlin, and Coulomb friction.

    Units, `along` and what is returned are those of `impacts`, but the constant of Hertz's law is 1. `ratio` is the
    tangential over the normal stiffness at every overlap [1].
    """
    hertz = Hertz(modulus=0.75, radius=1.0, mass=1.0, speed=1.0)
    dt, depth, speed = hertz.duration / steps, 0.0, 1.0
    along, spin, force = along.copy(), np.zeros(len(along)), np.zeros(len(along))
    while True:
        depth += 0.5 * dt * speed
        if depth <= 0:
            return along, spin
        load, stiffness = depth**1.5, 1.5 * ratio * math.sqrt(depth)
        force = np.clip(force + dt * stiffness * (along + spin), -friction * load, friction * load)
        along -= dt * force
        spin -= dt * force / SOLID
        speed -= dt * load
        depth += 0.5 * dt * speed
