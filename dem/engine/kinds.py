"""The engines that there are, and what is asked of one before there is a simulation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from dem.engine.demand import Demand
from dem.engine.doing import Doing
from dem.engine.effect import Adds, EffectName
from dem.engine.interface import Engine
from dem.errors import InputError


class EngineKind(Protocol):
    """One engine: what it is, what scenes cost on it, and how a simulation on it begins."""

    @property
    def name(self) -> str:
        """What a scene calls it."""

    @property
    def damps_once_per_look(self) -> bool:
        """Whether a servo's damper acts on what the last look told; it must then look in every step."""

    @property
    def idle_knobs(self) -> tuple[str, ...]:
        """Knobs of the fidelity that have no meaning on it."""

    def version(self) -> str:
        """Version of what results depend on.

        Raises:
            RunError: it is not installed.
        """

    @property
    def workers(self) -> str:
        """What a run on several cores has several of: threads, or ranks, which are processes."""

    def threads(self) -> int:
        """Threads, or ranks, that it runs with here."""

    def adds(self, effect: EffectName) -> Adds:
        """What an effect adds to what it does."""

    def in_order(self, engines: Sequence[str]) -> tuple[str, ...]:
        """What runs in every step, in the order in which it does."""

    def stable_step(self, scene: Demand, *, articulated: bool) -> float:
        """Largest stable time step [s] of a scene.

        Args:
            scene: the scene.
            articulated: whether barbs may turn, or have turned before.
        """

    def seconds_per_second(self, scene: Demand, time_step: float, doing: Doing) -> float:
        """Wall seconds that a simulated second costs, one core, about.

        Args:
            scene: the scene.
            time_step: [s].
            doing: what the smarticles do.
        """

    def build(self, scene: Demand, time_step: float) -> Engine:
        """A simulation of a scene, empty, with a time step [s] of its phases with motors that is not checked."""


def engine_kind(name: str) -> EngineKind:
    """The engine that a scene names.

    Raises:
        InputError: there is none of that name.
    """
    # Imported when asked for: a scene on one engine needs nothing of the other.
    if name == "yade":
        from dem.engine.yade.kind import YadeKind  # noqa: PLC0415

        return YadeKind()
    if name == "links":
        from dem.engine.links.kind import LinksKind  # noqa: PLC0415

        return LinksKind()
    if name == "lammps":
        from dem.engine.lammps.kind import LammpsKind  # noqa: PLC0415

        return LammpsKind()
    msg = f"engine: {name!r} is not built into this version; use yade, links or lammps"
    raise InputError(msg)
