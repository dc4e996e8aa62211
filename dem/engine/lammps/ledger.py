"""Energies on LAMMPS: what is added and stopped is known; what contacts and boundaries do is not added up."""

from __future__ import annotations

import math
from collections.abc import Callable


class LammpsLedger:
    """See `dem.engine.interface.EnergyLedger`.

    Args:
        moving: whether a boundary moves at present.
        stored: what springs of contacts hold at most [J].
    """

    container_work = 0.0
    """See the interface: not added up, see `given`."""

    def __init__(self, moving: Callable[[], bool], stored: Callable[[], float]) -> None:
        self._moving, self._stored = moving, stored
        self.added = 0.0
        """See the interface."""
        self.dissipated = 0.0
        """See the interface: by stopping smarticles alone."""

    @property
    def given(self) -> float:
        """See the interface."""
        return math.nan if self._moving() else self.added + self.container_work

    def elastic(self) -> tuple[float, float]:
        """See the interface; an upper bound for contacts."""
        return self._stored(), 0.0

    def take_in(self) -> None:
        """See the interface."""
        self.added += self.elastic()[0]
