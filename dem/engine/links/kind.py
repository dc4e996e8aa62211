"""Facts about links as an engine, and the function that builds its simulations."""

from __future__ import annotations

import numba

from dem.engine.demand import Activity, Demand, contact_law_of, motor_law_of
from dem.engine.effect import EffectName
from dem.engine.links.adds import ADDS, ORDER
from dem.engine.links.compiler import stamp
from dem.engine.links.cost import seconds_per_second
from dem.engine.links.engine import LinksEngine
from dem.engine.links.stable_step import links_stable_time_step


class LinksKind:
    """`dem.engine.kinds.EngineKind` of links."""

    name = "links"
    workers = "threads"
    damps_once_per_update = False
    idle_knobs: tuple[str, ...] = ("pitch", "wall_facets", "hinge_stiffness_N_per_m")
    adds = ADDS
    order = ORDER

    def version(self) -> str:
        """Return the hash of the sources and the version of Numba."""
        return f"{stamp()} (Numba {numba.__version__})"

    def threads(self) -> int:
        """Return 1: the engine has one thread."""
        return 1

    def stable_step(self, scene: Demand, *, articulated: bool) -> float:
        return links_stable_time_step(
            scene.particle,
            contact_law_of(scene),
            articulated=articulated,
            free=articulated and scene.motor.law in ("slip", "servo"),
            strings=scene.pulled_by,
        )

    def seconds_per_second(self, scene: Demand, time_step: float, activity: Activity) -> float:
        return seconds_per_second(scene, time_step, activity)

    def build(self, scene: Demand, time_step: float) -> LinksEngine:
        return LinksEngine(
            particle=scene.particle,
            cylinder=scene.cylinder,
            law=contact_law_of(scene),
            gravity=scene.gravity_m_per_s2,
            time_step=time_step,
            shaken=scene.calls_for(EffectName.CONTAINER_MOTION),
            motor_law=motor_law_of(scene),
            keep_ledger=scene.recording.dissipation_interval_s is not None,
            hooks=None if scene.hooks is None else scene.hooks.crosses,
            channel=scene.channel,
            strengths=scene.motor_strengths,
        )
