"""Facts about the engine links, and the function that builds its simulations."""

from collections.abc import Iterator

import numba

from dem.engine.demand import Activity, Demand, contact_law_of, motor_law_of
from dem.engine.effect import EffectName
from dem.engine.links.adds import ADDS, ORDER
from dem.engine.links.cache import announce, is_kept, stamp
from dem.engine.links.cost import COMPILE_FIRST, COMPILE_MORE, seconds_per_second
from dem.engine.links.engine import LinksEngine
from dem.engine.links.stable_step import (
    links_stable_time_step,
    mixture_stable_time_step,
)

# Groups of arrays without which `advance` is compiled where a scene has none of them.
OF_FILAMENTS = frozenset({"bends", "filaments", "flexible", "stretch"})
# Links of linkages are rigid: the table of their shapes has no "flexible", which therefore counts as absent.
OF_LINKAGES = frozenset({"bends", "linkages"})
OPTIONAL = OF_FILAMENTS | OF_LINKAGES | {"channel", "cords", "grips", "hooks", "ledger", "motors", "rims"}


class LinksKind:
    """The engine `links`, with the members of `dem.engine.kinds.EngineKind`."""

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
        if scene.mixture is not None:
            return mixture_stable_time_step(scene.mixture, contact_law_of(scene))
        return links_stable_time_step(
            scene.body,
            contact_law_of(scene),
            articulated=articulated,
            strings=scene.pulled_by,
        )

    def seconds_per_second(self, scene: Demand, time_step: float, activity: Activity) -> float:
        return seconds_per_second(scene, time_step, activity)

    def seconds_to_compile(self, scene: Demand) -> float:
        missing = [present for present in _present(scene) if not is_kept(OPTIONAL - present)]
        # While a wall is lifted its edge is there as well; whether one is lifted or vanishes is not known here.
        lifted = scene.calls_for(EffectName.WALL_REMOVAL)
        return COMPILE_FIRST + COMPILE_MORE * (len(missing) - 1 + lifted) if missing else 0.0

    def build(self, scene: Demand, time_step: float) -> LinksEngine:
        if seconds := self.seconds_to_compile(scene):
            announce(seconds)
        return LinksEngine(
            particle=scene.model,
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
            wave_seed=scene.wave_seed,
            gripped=scene.calls_for(EffectName.GRIPS),
        )


def _present(scene: Demand) -> Iterator[frozenset[str]]:
    """Yield the names of those `OPTIONAL` groups of arrays that exist in phases of a scene.

    The first set of names is for phases without motors, the second one for phases with motors. A set is left out if
    the scene has no such phase.
    """
    mixture, of_bodies = scene.mixture, frozenset[str]()
    if mixture is not None:
        of_bodies = OF_FILAMENTS if mixture.flexible else OF_LINKAGES if mixture.jointed else of_bodies
    known = {
        "channel": scene.channel is not None,
        **dict.fromkeys(of_bodies, True),
        "grips": scene.calls_for(EffectName.GRIPS),
        "hooks": scene.hooks is not None,
        "ledger": scene.recording.dissipation_interval_s is not None,
        "rims": scene.channel is None and bool(scene.cylinder.upper),
    }
    always = frozenset(name for name, there in known.items() if there)
    if scene.activities - {Activity.ACTUATE}:
        yield always
    if Activity.ACTUATE in scene.activities:
        yield always | {"motors", *(["cords"] if scene.pulled_by else [])}
