"""List of the engines, with facts about each engine that are known before a simulation exists."""

from collections.abc import Mapping
from typing import Protocol

from dem.engine.demand import Activity, Demand
from dem.engine.effect import Adds, EffectName
from dem.engine.interface import Engine
from dem.errors import InputError


class EngineKind(Protocol):
    """Facts about an engine, costs of scenes on it, and the function that builds its simulations."""

    name: str  #: Name in scenes
    workers: str  #: Noun for parallel workers in messages: "threads", or "ranks", which are processes
    damps_once_per_update: bool
    """Whether dampers of servos use rates of the last control update, and so need an update in every step."""
    idle_knobs: tuple[str, ...]  #: Parameters of the fidelity that have no effect on the engine
    adds: Mapping[EffectName, Adds]  #: Additions of each effect to the engine; none for effects without an entry

    @property
    def order(self) -> tuple[str, ...]:
        """Names of all parts of the engine, see `Adds.engines`, in the order in which a step runs them."""

    def version(self) -> str:
        """Return the engine's version, on which results depend; raise RunError if it is not installed."""

    def threads(self) -> int:
        """Return the number of threads, or ranks, that a run in this process uses."""

    def stable_step(self, scene: Demand, *, articulated: bool) -> float:
        """Return the largest stable time step [s]; `articulated`: whether barbs can turn or have turned."""

    def seconds_per_second(self, scene: Demand, time_step: float, activity: Activity) -> float:
        """Return the estimated wall time per simulated time [1] of a phase on one core."""

    def seconds_to_compile(self, scene: Demand) -> float:
        """Return the estimated processor time [s] to compile the code that a scene needs and the cache lacks."""

    def build(self, scene: Demand, time_step: float) -> Engine:
        """Return a simulation of a scene, without bodies yet.

        `time_step` is the shortest of all phases [s]; whether it is stable is not checked.
        """


def engine_kind(name: str) -> EngineKind:
    """Return the facts about an engine by its name in scenes; raise InputError for an unknown name."""
    # Imported only when used, since each engine needs software of its own.
    if name == "yade":
        from dem.engine.yade.kind import YadeKind  # noqa: PLC0415

        return YadeKind()
    if name == "links":
        from dem.engine.links.kind import LinksKind  # noqa: PLC0415

        return LinksKind()
    if name == "lammps":
        from dem.engine.lammps.kind import LammpsKind  # noqa: PLC0415

        return LammpsKind()
    raise InputError(f"engine: {name!r} is not built into this version; use yade, links or lammps")
