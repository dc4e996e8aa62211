"""The engines that exist, and what can be asked of one before there is a simulation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from dem.engine.demand import Activity, Demand
from dem.engine.effect import Adds, EffectName
from dem.engine.interface import Engine
from dem.errors import InputError


class EngineKind(Protocol):
    """One engine: what it is, what scenes cost on it, and how a simulation on it begins."""

    name: str  #: Its name in scenes
    workers: str  #: What a run on several cores has several of: threads, or ranks, which are processes
    damps_once_per_update: bool
    """Whether a servo's damper acts on the rates of the last control update, so that one is needed every step."""
    idle_knobs: tuple[str, ...]  #: Knobs of the fidelity that have no meaning on it
    adds: Mapping[EffectName, Adds]  #: What an effect adds to its work; effects without an entry add nothing

    @property
    def order(self) -> tuple[str, ...]:
        """All names of `Adds.engines`, in the order in which a step runs them."""

    def version(self) -> str:
        """Return the version of what results depend on.

        Raises:
            RunError: it is not installed.
        """

    def threads(self) -> int:
        """Return the number of threads, or ranks, that it runs with here."""

    def stable_step(self, scene: Demand, *, articulated: bool) -> float:
        """Return the largest stable time step [s]; articulated where barbs may turn, or have turned before."""

    def seconds_per_second(self, scene: Demand, time_step: float, activity: Activity) -> float:
        """Estimate the wall seconds that a simulated second costs on one core, with a time step [s]."""

    def build(self, scene: Demand, time_step: float) -> Engine:
        """Build an empty simulation; the time step [s] is that of phases with motors and is not checked."""


def engine_kind(name: str) -> EngineKind:
    """Return the engine that a scene names.

    Raises:
        InputError: there is none of that name.
    """
    # Imported when asked for: a scene on one engine needs nothing of the others.
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
