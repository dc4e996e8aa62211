"""Facts about the engine on LAMMPS, and the function that builds its simulations."""

from collections.abc import Mapping

from dem.engine.cores import ranks
from dem.engine.demand import Activity, Demand, contact_law_of, mean_spheres
from dem.engine.effect import Adds, EffectName
from dem.engine.lammps.child import lammps_version
from dem.engine.lammps.engine import LammpsEngine
from dem.engine.yade.stable_step import stable_time_step

ADDS: Mapping[EffectName, Adds] = {
    EffectName.CONTACT: Adds(
        engines=("neighbour lists", "pair gran/hooke/history", "fix rigid/small"), shapes=("chains of spheres",)
    ),
    EffectName.CONTAINER: Adds(engines=("fix wall/gran/region",), shapes=("plane", "round wall")),
    EffectName.GRAVITY: Adds(engines=("fix gravity",)),
    EffectName.CONTAINER_MOTION: Adds(python="sets the sines of floor and wall"),
    EffectName.WALL_REMOVAL: Adds(python="takes the wall away"),
}
ORDER = ("neighbour lists", "pair gran/hooke/history", "fix gravity", "fix wall/gran/region", "fix rigid/small")

# Cost on one rank. The cost of a step grows with the number of spheres. It is several times higher while they move,
# since neighbours are searched again, and higher per sphere in large piles, which do not fit into a processor's cache.
# At each sample of the series LAMMPS writes all bodies to a file, which this process reads and searches for contacts.
# Source: results/scaling: steps alone, N = 100 to 5000; results/bench, planned.csv: rest, pours and samples. STEP is in
# s per sphere and step. Pours, where the pile grows from nothing, would cost half of shaking, but layers must be
# checked and added.
STEP: Mapping[Activity, float] = {Activity.POUR: 1.2e-7, Activity.REST: 0.5e-7, Activity.SHAKE: 1.6e-7}
SAMPLE = (3e-3, 6e-5)  # s per sample, and s per sample and smarticle
# From MANY spheres on a step costs (1 + LONGER) times as much per sphere as with few; the factor grows linearly to
# there.
MANY, LONGER = 100_000, 1.3


class LammpsKind:
    """`dem.engine.kinds.EngineKind` of LAMMPS."""

    name = "lammps"
    workers = "ranks"
    damps_once_per_update = False
    idle_knobs: tuple[str, ...] = ("wall_facets", "hinge_stiffness_N_per_m", "control_interval_s")
    adds = ADDS
    order = ORDER
    version = staticmethod(lammps_version)
    threads = staticmethod(ranks)

    def stable_step(self, scene: Demand, *, articulated: bool) -> float:
        """Return the largest stable time step [s]; spheres, springs and scheme of integration are those of YADE.

        The dashpots of bodies of the masses m and m' are c ∝ m m'/(m + m'). As in
        `dem.engine.links.stable_step.mixture_stable_time_step`, but with θ = m/m', a body among others is bounded by
        one among its equals with the dashpots of its own kind, and springs (1 + θ)/2 times as stiff.
        """
        law, masses = contact_law_of(scene), [body.mass for body in scene.bodies]
        return min(
            stable_time_step(
                body, law.scaled(springs=(1 + body.mass / min(masses)) / 2, dashpots=body.mass / masses[0])
            )
            for body in scene.bodies
        )

    def seconds_per_second(self, scene: Demand, time_step: float, activity: Activity) -> float:
        spheres, per_sphere = mean_spheres(scene) * scene.count, STEP.get(activity, STEP[Activity.SHAKE])
        steps = per_sphere * spheres * (1 + LONGER * min(1.0, spheres / MANY)) / time_step
        return steps + (SAMPLE[0] + SAMPLE[1] * scene.count) / scene.recording.series_interval_s

    def seconds_to_compile(self, scene: Demand) -> float:
        return 0.0

    def build(self, scene: Demand, time_step: float) -> LammpsEngine:
        return LammpsEngine(
            particle=scene.model,
            cylinder=scene.cylinder,
            law=contact_law_of(scene),
            gravity=scene.gravity_m_per_s2,
            time_step=time_step,
            ranks=ranks(),
        )
