"""The energy ledger: what was brought in, and what was dissipated."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from dem.engine.yade.assembly import Assembly
from dem.engine.yade.boundaries import YadeBoundaries
from dem.engine.yade.dissipation import Meter
from dem.engine.yade.library import Yade


class YadeLedger:
    """Energies that have to be added up step by step, each only where it is asked for.

    Args:
        yade: the simulation.
        assembly: the smarticles.
        boundaries: what moves and does work.
        works: whether to add up the work of moving boundaries.
        dissipation_interval: time between samples of what is dissipated [s]; None: never.
    """

    def __init__(
        self,
        yade: Yade,
        assembly: Assembly,
        boundaries: YadeBoundaries,
        *,
        works: bool,
        dissipation_interval: float | None,
    ) -> None:
        self.container_work = 0.0
        """Work of moving boundaries, and of strings, on the smarticles since the start [J]."""
        self.added = 0.0
        """Energy of smarticles when they were added, in height and in contacts that were taken in [J]."""
        self.dissipated = 0.0
        """Energy dissipated since the start, by contacts, hinges and welding [J]; sampled, see `Meter`."""
        self._assembly = assembly
        self._boundaries = boundaries
        self._works = works
        self._interval = dissipation_interval
        self._time_step, self._every = 0.0, 0
        self._meter = Meter(yade, assembly)

    def count_in(self, time_step: float) -> None:
        """Take steps of a length [s] from now on."""
        self._time_step = time_step
        self._every = max(1, round(self._interval / time_step)) if self._interval else 0

    def step(self, number: int, advance: Callable[[], None]) -> None:
        """Make one step and add up what is due.

        Args:
            number: of the step.
            advance: makes it.
        """
        if not self._every or number % self._every:
            advance()
        else:
            before = self._meter.velocities()
            advance()
            self.dissipated += self._every * self._meter.dissipated(before, self._time_step)
        if self._works and self._boundaries.moving:
            self.container_work += self._boundaries.power() * self._time_step

    def elastic(self) -> tuple[float, float]:
        """Energy in the springs of contacts and of hinges [J]."""
        hinges = self._assembly.hinges
        return self._meter.contacts({}).elastic_energy, 0.0 if hinges is None else hinges.elastic_energy()

    def take_in(self) -> None:
        """Count what the springs of contacts hold as added."""
        self.added += self.elastic()[0]

    @property
    def given(self) -> float:
        """Energy added and work of boundaries since the start [J]; NaN while one moves whose work is not added up."""
        return math.nan if self._boundaries.moving and not self._works else self.added + self.container_work

    def removed(self, remove: Callable[[], None]) -> None:
        """Do something that takes contacts away; what their springs held is dissipated."""
        stored = self.elastic()[0] if self._every else 0.0
        remove()
        if self._every:
            self.dissipated += stored - self.elastic()[0]

    @property
    def memory(self) -> dict[str, float]:
        """Plain data that `restore` needs."""
        return {"container_work": self.container_work, "added": self.added, "dissipated": self.dissipated}

    def restore(self, memory: Mapping[str, float]) -> None:
        """Go on from where `memory` was taken."""
        self.container_work, self.added, self.dissipated = (
            memory[name] for name in ("container_work", "added", "dissipated")
        )
