"""YADE as an engine: what is asked of it before there is a simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from dem.engine.demand import Demand, contact_law_of
from dem.engine.doing import Doing
from dem.engine.effect import Adds, EffectName
from dem.engine.yade.construction import ADDS, in_order
from dem.engine.yade.engine import YadeEngine
from dem.engine.yade.hinges import DAMPER_TIME, HingeLaw
from dem.engine.yade.library import yade_threads, yade_version
from dem.engine.yade.stable_step import hinged_stable_time_step, planar_stable_time_step, stable_time_step
from dem.physics.motor import MotorLaw

# Wall seconds per sphere and step in a dense pile, one core, measured with `make bench` (see README); machines
# differ by a factor of two.
COST_PER_SPHERE_STEP = 3.3e-7
# Of that: a pour costs about half of the same time in the full pile, since the pile grows from nothing; motors mean
# three bodies and four bonds for each smarticle, and looks.
SHARES = {Doing.POUR: 0.5, Doing.ACTUATE: 1.7}


class YadeKind:
    """See `dem.engine.kinds.EngineKind`."""

    name = "yade"
    workers = "threads"
    damps_once_per_look = True
    idle_knobs: tuple[str, ...] = ()

    def version(self) -> str:
        """See the interface."""
        return yade_version()

    def threads(self) -> int:
        """See the interface."""
        return yade_threads()

    def adds(self, effect: EffectName) -> Adds:
        """See the interface."""
        return ADDS.get(effect, Adds())

    def in_order(self, engines: Sequence[str]) -> tuple[str, ...]:
        """See the interface."""
        return in_order(engines)

    def stable_step(self, scene: Demand, *, articulated: bool) -> float:
        """See the interface."""
        law = contact_law_of(scene)
        if articulated and scene.channel is not None:
            return planar_stable_time_step(scene.particle, law, hinge_law(scene), scene.pulled_by)
        stable = stable_time_step(scene.particle, law)
        if articulated:
            stable = min(stable, hinged_stable_time_step(scene.particle, law, hinge_law(scene)))
        return stable

    def seconds_per_second(self, scene: Demand, time_step: float, doing: Doing) -> float:
        """See the interface."""
        per_step = COST_PER_SPHERE_STEP * len(scene.particle.centres) * scene.count
        return per_step / time_step * SHARES.get(doing, 1.0)

    def build(self, scene: Demand, time_step: float) -> YadeEngine:
        """See the interface."""
        return YadeEngine(
            particle=scene.particle,
            cylinder=scene.cylinder,
            law=contact_law_of(scene),
            gravity=scene.gravity_m_per_s2,
            time_step=time_step,
            shaken=scene.calls_for(EffectName.CONTAINER_MOTION),
            # No damper may relax more than all of its force in a step.
            hinges=(replace(hinge_law(scene), damper_time=max(DAMPER_TIME, time_step)), motor_law(scene))
            if scene.actuates
            else None,
            track_work=scene.recording.energies,
            dissipation_interval=scene.recording.dissipation_interval_s,
            hooks=None if scene.hooks is None else scene.hooks.crosses,
            channel=scene.channel,
            strengths=scene.motor_strengths,
        )


def hinge_law(scene: Demand) -> HingeLaw:
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


def motor_law(scene: Demand) -> MotorLaw:
    """The motors of a scene that actuates."""
    return MotorLaw(
        torque_limit=scene.torque_limit,
        speed_limit=scene.motor.speed_limit_rad_per_s,
        stiffness=scene.motor.stiffness_N_m_per_rad,
        law=scene.motor.law,
        damping=scene.motor.damping_N_m_s_per_rad,
    )
