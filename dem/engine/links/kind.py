"""The links engine: what is asked of it before there is a simulation."""

from __future__ import annotations

from collections.abc import Sequence

import numba

from dem.engine.demand import Demand, contact_law_of
from dem.engine.doing import Doing
from dem.engine.effect import Adds, EffectName
from dem.engine.links.adds import ADDS, ORDER
from dem.engine.links.compiler import stamp
from dem.engine.links.cost import seconds_per_second
from dem.engine.links.engine import LinksEngine
from dem.engine.links.stable_step import links_stable_time_step
from dem.physics.motor import MotorLaw


class LinksKind:
    """See `dem.engine.kinds.EngineKind`."""

    name = "links"
    workers = "threads"
    damps_once_per_look = False
    idle_knobs: tuple[str, ...] = ("pitch", "wall_facets", "hinge_stiffness_N_per_m")

    def version(self) -> str:
        """See the interface: the sources' own hash, and the compiler."""
        return f"{stamp()} (Numba {numba.__version__})"

    def threads(self) -> int:
        """Return 1: the engine has one thread."""
        return 1

    def adds(self, effect: EffectName) -> Adds:
        """See the interface."""
        return ADDS.get(effect, Adds())

    def in_order(self, engines: Sequence[str]) -> tuple[str, ...]:
        """See the interface."""
        return tuple(sorted(engines, key=ORDER.index))

    def stable_step(self, scene: Demand, *, articulated: bool) -> float:
        """See the interface."""
        return links_stable_time_step(
            scene.particle,
            contact_law_of(scene),
            articulated=articulated,
            free=articulated and scene.motor.law in ("slip", "servo"),
            strings=scene.pulled_by,
        )

    def seconds_per_second(self, scene: Demand, time_step: float, doing: Doing) -> float:
        """See the interface."""
        return seconds_per_second(scene, time_step, doing)

    def build(self, scene: Demand, time_step: float) -> LinksEngine:
        """See the interface."""
        motor = scene.motor
        return LinksEngine(
            particle=scene.particle,
            cylinder=scene.cylinder,
            law=contact_law_of(scene),
            gravity=scene.gravity_m_per_s2,
            time_step=time_step,
            shaken=scene.calls_for(EffectName.CONTAINER_MOTION),
            motor_law=MotorLaw(
                torque_limit=scene.torque_limit,
                speed_limit=motor.speed_limit_rad_per_s,
                stiffness=motor.stiffness_N_m_per_rad,
                law=motor.law,
                damping=motor.damping_N_m_s_per_rad,
            )
            if scene.actuates
            else None,
            keep_ledger=scene.recording.dissipation_interval_s is not None,
            hooks=None if scene.hooks is None else scene.hooks.crosses,
            channel=scene.channel,
            strengths=scene.motor_strengths,
        )
