"""The part of a scene that engines use."""

from collections.abc import Sequence
from enum import Enum, auto
from typing import Protocol

from dem.arrays import Array
from dem.body.kinds import Kind, Mixture
from dem.body.particle import Particle
from dem.engine.effect import EffectName
from dem.physics.contact import ContactLaw, contact_law
from dem.physics.motor import MotorLaw
from dem.setting.contact import Contact
from dem.setting.container import Cylinder
from dem.setting.fidelity import Fidelity
from dem.setting.hooks import Hooks
from dem.setting.liquid import Liquid
from dem.setting.motor import Motor
from dem.setting.plane import Channel
from dem.setting.recording import Recording
from dem.setting.smarticle import Smarticle


class Activity(Enum):
    """Kinds of phases, which differ in the cost of a time step."""

    POUR = auto()
    REST = auto()
    SHAKE = auto()
    ACTUATE = auto()


class Demand(Protocol):
    """The members of a scene that engines use, described in `dem.scene.scene.Scene`."""

    @property
    def smarticle(self) -> Smarticle: ...
    @property
    def count(self) -> int: ...
    @property
    def hooks(self) -> Hooks | None: ...
    @property
    def liquid(self) -> Liquid | None: ...
    @property
    def contact(self) -> Contact: ...
    @property
    def motor(self) -> Motor: ...
    @property
    def gravity_m_per_s2(self) -> float: ...
    @property
    def fidelity(self) -> Fidelity: ...
    @property
    def recording(self) -> Recording: ...
    @property
    def body(self) -> Particle: ...
    @property
    def mixture(self) -> Mixture | None: ...
    @property
    def model(self) -> Particle | Mixture: ...
    @property
    def bodies(self) -> Sequence[Particle | Kind]: ...
    @property
    def cylinder(self) -> Cylinder: ...
    @property
    def channel(self) -> Channel | None: ...
    @property
    def torque_limit(self) -> float: ...
    @property
    def motor_strengths(self) -> Array | None: ...
    @property
    def wave_seed(self) -> int: ...
    @property
    def actuates(self) -> bool: ...
    @property
    def activities(self) -> frozenset[Activity]: ...
    @property
    def pulled_by(self) -> Sequence[tuple[float, float]]: ...
    def calls_for(self, effect: EffectName) -> bool: ...


def mean_spheres(scene: Demand) -> float:
    """Return the mean number of spheres of a body."""
    each = [float(len(body.centres)) for body in scene.bodies]
    return each[0] if scene.mixture is None else scene.mixture.mean(each)


def contact_law_of(scene: Demand) -> ContactLaw:
    """Return the contact law of a scene, which does not depend on the engine."""
    return contact_law(scene.bodies[0], scene.contact, scene.fidelity.stiffness_N_per_m)


def motor_law_of(scene: Demand) -> MotorLaw | None:
    """Return the motor law of a scene, which does not depend on the engine; None if no phase has motors."""
    if not scene.actuates:
        return None
    return MotorLaw(
        torque_limit=scene.torque_limit,
        speed_limit=scene.motor.speed_limit_rad_per_s,
        stiffness=scene.motor.stiffness_N_m_per_rad,
        law=scene.motor.law,
        damping=scene.motor.damping_N_m_s_per_rad,
    )
