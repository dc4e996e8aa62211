"""The motors of a simulation on YADE: what decides, and the hinges that it acts on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.engine.interface import MotorReadings
from dem.engine.yade.assembly import Assembly
from dem.engine.yade.hinges import Hinges
from dem.engine.yade.ledger import YadeLedger
from dem.engine.yade.library import Yade
from dem.physics.motor import MotorLaw, Motors

Array = NDArray[np.float64]


class YadeMotors:
    """See `dem.engine.interface.Motors`.

    Args:
        yade: the simulation.
        assembly: the smarticles.
        ledger: gets what welding dissipates.
        law: what all motors have in common; None in scenes without any.
        strengths: (N, 2) factors on what the motors can do [1]; None: all are alike.
    """

    def __init__(
        self,
        yade: Yade,
        assembly: Assembly,
        ledger: YadeLedger,
        law: MotorLaw | None,
        strengths: Array | None,
    ) -> None:
        self._yade = yade
        self._assembly = assembly
        self._ledger = ledger
        self._law = law
        self._strengths = strengths
        self.deciding: Motors | None = None
        """What the motors decide, look by look; None before the first articulation."""

    @property
    def present(self) -> bool:
        """See the interface."""
        return self._law is not None

    @property
    def articulated(self) -> bool:
        """See the interface."""
        return self._assembly.hinges is not None

    def articulate(self) -> None:
        """See the interface: welded smarticles are split into hinged links."""
        if self.articulated:
            return
        assert self._law is not None  # the engine was built for scenes that never articulate
        self._assembly.articulate()
        # Spheres of one smarticle may touch each other from now on: neighbours must be looked for anew.
        collider = self._yade.classes.InsertionSortCollider
        next(engine for engine in self._yade.omega.engines if isinstance(engine, collider)).doSort = True
        angles = self._hinges.angles()
        if self.deciding is None:
            self.deciding = Motors(self._law, angles, self._strengths)
        else:
            self.deciding.engage(angles)

    def weld(self) -> None:
        """See the interface: motors that hold, at a third of the cost."""
        self._ledger.dissipated += self._assembly.weld()

    @property
    def looks_at_once(self) -> int:
        """See the interface: between two looks YADE comes back to Python anyhow."""
        return 1

    def actuate(self, targets: Array, interval: float) -> None:
        """See the interface."""
        assert self.deciding is not None  # only articulated smarticles are actuated
        time_step = float(self._yade.omega.dt)
        rates = self._hinges.rates() if self.deciding.law.damping else None
        torques = self.deciding.look(self._hinges.angles(), targets[0], interval, time_step, rates)
        self._hinges.set_torques(torques, time_step)

    @property
    def readings(self) -> MotorReadings | None:
        """See the interface."""
        told = self.deciding
        if told is None:
            return None
        return MotorReadings(
            schedule=told.schedule,
            commands=told.commands,
            torques=told.torques,
            work=told.work,
            halted=told.halted,
        )

    @property
    def work(self) -> float:
        """See the interface."""
        if self.deciding is None:
            return 0.0
        if self.articulated:
            return self.deciding.work_until(self._hinges.angles())
        return float(self.deciding.work.sum())

    def gaps(self) -> Array:
        """See the interface."""
        hinges = self._assembly.hinges
        return np.zeros((self._assembly.count, 2)) if hinges is None else hinges.gaps()

    @property
    def _hinges(self) -> Hinges:
        assert self._assembly.hinges is not None
        return self._assembly.hinges

    @property
    def memory(self) -> dict[str, Any] | None:
        """Plain data that `restore` needs besides the loaded simulation."""
        return None if self.deciding is None else self.deciding.memory

    def restore(self, memory: Mapping[str, Any] | None) -> None:
        """Go on from where `memory` was taken."""
        if memory is not None:
            assert self._law is not None  # a checkpoint belongs to its scene
            self.deciding = Motors(self._law, np.zeros((self._assembly.count, 2)), self._strengths)
            self.deciding.restore(memory)
