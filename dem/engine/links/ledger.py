"""The energy ledger on the engine links, which kernels sum exactly, in every step."""

from __future__ import annotations

from collections.abc import Callable

from dem.engine.links.stepping import LOST, WORK
from dem.engine.links.world import World


class LinksLedger:
    """`dem.engine.interface.EnergyLedger` on links."""

    def __init__(self, world: World) -> None:
        self._world = world
        self.added = 0.0

    @property
    def container_work(self) -> float:
        return float(self._world.totals[WORK])

    @property
    def dissipated(self) -> float:
        """Energy dissipated since the start [J], by welding and stopping, and by contacts if recorded."""
        return float(self._world.totals[LOST])

    @property
    def given(self) -> float:
        return self.added + self.container_work

    def elastic(self) -> tuple[float, float]:
        """Return the energy in the springs of all contacts [J], and 0, since hinges have no springs."""
        return self._world.contacts().elastic_energy, 0.0

    def take_in(self) -> None:
        self.added += self.elastic()[0]

    def removed(self, remove: Callable[[], None]) -> None:
        """Call a function that removes contacts; if the ledger is kept, their energy counts as dissipated."""
        counted = self._world.ledger is not None
        stored = self.elastic()[0] if counted else 0.0
        remove()
        if counted:
            self._world.totals[LOST] += stored - self.elastic()[0]
