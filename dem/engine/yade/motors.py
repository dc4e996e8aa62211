"""Motors on YADE: control updates that set the torques of hinges."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from dem.arrays import Array
from dem.engine.interface import MotorReadings
from dem.engine.yade.assembly import Assembly
from dem.engine.yade.hinges import Hinges
from dem.engine.yade.ledger import YadeLedger
from dem.engine.yade.library import Yade
from dem.physics.motor import MotorLaw, Motors


class YadeMotors:
    """`dem.engine.interface.Motors` on YADE.

    Args:
        law: law of the motors; None if smarticles stay welded.
        strengths: (N, 2) factors on torque limit and stiffness [1]; None: 1 for all motors.
    """

    updates_at_once = 1  # YADE returns to Python after every step anyway

    def __init__(
        self, yade: Yade, assembly: Assembly, ledger: YadeLedger, law: MotorLaw | None, strengths: Array | None
    ) -> None:
        self._yade = yade
        self._assembly = assembly
        self._ledger = ledger
        self._law = law
        self._strengths = strengths
        self.control: Motors | None = None  #: State of all motors; None before the first articulation

    @property
    def present(self) -> bool:
        return self._law is not None

    @property
    def articulated(self) -> bool:
        return self._assembly.hinges is not None

    def articulate(self) -> None:
        if self.articulated:
            return
        assert self._law is not None  # the engine was built for scenes that never articulate
        self._assembly.articulate()
        # Spheres of one smarticle may touch each other from now on: neighbours must be searched again.
        collider = self._yade.classes.InsertionSortCollider
        next(engine for engine in self._yade.omega.engines if isinstance(engine, collider)).doSort = True
        angles = self._hinges.angles()
        if self.control is None:
            self.control = Motors(self._law, angles, self._strengths)
        else:
            self.control.engage(angles)

    def weld(self) -> None:
        # Articulated smarticles whose motors hold would cost three times as much as welded ones.
        self._ledger.dissipated += self._assembly.weld()

    def actuate(self, targets: Array, interval: float) -> None:
        assert self.control is not None  # only articulated smarticles are actuated
        time_step = float(self._yade.omega.dt)
        rates = self._hinges.rates() if self.control.law.damping else None
        torques = self.control.update(self._hinges.angles(), targets[0], interval, time_step, rates)
        self._hinges.set_torques(torques, time_step)

    @property
    def readings(self) -> MotorReadings | None:
        motors = self.control
        if motors is None:
            return None
        return MotorReadings(
            schedule=motors.schedule,
            commands=motors.commands,
            torques=motors.torques,
            work=motors.work,
            halted=motors.halted,
        )

    @property
    def work(self) -> float:
        if self.control is None:
            return 0.0
        return self.control.work_until(self._hinges.angles()) if self.articulated else float(self.control.work.sum())

    def gaps(self) -> Array:
        return self._hinges.gaps() if self.articulated else np.zeros((self._assembly.count, 2))

    @property
    def _hinges(self) -> Hinges:
        assert self._assembly.hinges is not None
        return self._assembly.hinges

    @property
    def memory(self) -> dict[str, Any] | None:
        return None if self.control is None else self.control.memory

    def restore(self, memory: Mapping[str, Any] | None) -> None:
        if memory is not None:
            assert self._law is not None  # a checkpoint belongs to its scene
            self.control = Motors(self._law, np.zeros((self._assembly.count, 2)), self._strengths)
            self.control.restore(memory)
