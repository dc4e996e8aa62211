"""LAMMPS as an engine: what is asked of it before there is a simulation."""

from __future__ import annotations

from collections.abc import Sequence

from dem.engine.demand import Demand, contact_law_of
from dem.engine.doing import Doing
from dem.engine.effect import Adds, EffectName
from dem.engine.lammps.child import lammps_version
from dem.engine.lammps.cost import seconds_per_second
from dem.engine.lammps.engine import LammpsEngine
from dem.engine.lammps.ranks import ranks
from dem.engine.yade.stable_step import stable_time_step

ADDS = {
    EffectName.CONTACT: Adds(
        engines=("neighbour lists", "pair gran/hooke/history", "fix rigid/small"), shapes=("chains of spheres",)
    ),
    EffectName.CONTAINER: Adds(engines=("fix wall/gran/region",), shapes=("plane", "round wall")),
    EffectName.GRAVITY: Adds(engines=("fix gravity",)),
    EffectName.CONTAINER_MOTION: Adds(python="sets the sines of floor and wall"),
    EffectName.WALL_REMOVAL: Adds(python="takes the wall away"),
}
ORDER = ("neighbour lists", "pair gran/hooke/history", "fix gravity", "fix wall/gran/region", "fix rigid/small")


class LammpsKind:
    """See `dem.engine.kinds.EngineKind`."""

    name = "lammps"
    workers = "ranks"
    damps_once_per_look = False
    idle_knobs: tuple[str, ...] = ("wall_facets", "hinge_stiffness_N_per_m", "control_interval_s")

    def version(self) -> str:
        """See the interface."""
        return lammps_version()

    def threads(self) -> int:
        """See the interface: ranks."""
        return ranks()

    def adds(self, effect: EffectName) -> Adds:
        """See the interface."""
        return ADDS.get(effect, Adds())

    def in_order(self, engines: Sequence[str]) -> tuple[str, ...]:
        """See the interface."""
        return tuple(sorted(engines, key=ORDER.index))

    def stable_step(self, scene: Demand, *, articulated: bool) -> float:
        """See the interface: that of YADE, whose spheres, law and scheme of integration these are."""
        return stable_time_step(scene.particle, contact_law_of(scene))

    def seconds_per_second(self, scene: Demand, time_step: float, doing: Doing) -> float:
        """See the interface; on one rank."""
        return seconds_per_second(scene, time_step, doing)

    def build(self, scene: Demand, time_step: float) -> LammpsEngine:
        """See the interface."""
        return LammpsEngine(
            particle=scene.particle,
            cylinder=scene.cylinder,
            law=contact_law_of(scene),
            gravity=scene.gravity_m_per_s2,
            time_step=time_step,
            ranks=ranks(),
        )
