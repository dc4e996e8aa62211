"""The motors at the hinges: velocity-controlled, of limited torque. Pure arithmetic, once per control period."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

Law = Literal["halt", "stall", "ease", "slip", "servo"]
EASED = 0.5  # of the speed, for a motor that eases
PATIENCE = 20  # findings in a row, of both barbs of a smarticle one after the other, after which it stops
_MEMORY = ("commands", "schedule", "angles", "torques", "work", "begun", "halted")


@dataclass(frozen=True, kw_only=True)
class MotorLaw:
    """What all motors of a scene have in common.

    Args:
        torque_limit: τ_max [N m].
        speed_limit: ω, the greatest speed of a command [rad/s].
        stiffness: twist stiffness of the shaft between motor and barb [N m/rad].
        law: "halt": a motor whose torque is at τ_max or above no longer advances against it, and holds with whatever
            torque it takes; "stall": it does not move at all until its torque has fallen, the paper's rule to the
            letter; "ease": it goes on at half the speed with whatever torque that takes, and stops only when twenty
            barbs in a row, those of the smarticle in turn, were found there: what the paper's own code does; "slip": a
            spring that gives way at τ_max; "servo": the same with a damper beside the spring, the
            torque as a whole limited.
        damping: a servo's derivative gain [N m s/rad].
    """

    torque_limit: float
    speed_limit: float
    stiffness: float
    law: Law
    damping: float = 0.0


class Motors:
    """Two motors on each of N smarticles.

    A motor turns one end of its shaft to the command; the barb is at the other end, at the actual angle, and feels the
    torque k (command - actual). A motor that halts may always give way: only a command that would load the shaft
    further is refused. One that stalls, in both directions, comes free only when its neighbours move, since the load
    of an elastic contact stays when the motor stops.

    Args:
        law: what all motors have in common.
        angles: (N, 2) angles at the start [rad].
        strengths: (N, 2) factors on torque limit and stiffness [1]; None: all are alike.
    """

    def __init__(self, law: MotorLaw, angles: Array, strengths: Array | None = None) -> None:
        self.law = law
        factor = 1.0 if strengths is None else strengths
        self._stiffness = law.stiffness * factor
        self._limit = law.torque_limit * factor
        self.commands: Array = angles.copy()
        """(N, 2) angles that the motors hold at present [rad]."""
        self.schedule: Array = angles.copy()
        """(N, 2) angles that they were told at the last look [rad]; a motor that halts falls behind."""
        self.angles: Array = angles.copy()
        """(N, 2) actual angles at the last look [rad]."""
        self.torques: Array = np.zeros_like(angles)
        """(N, 2) torques on the barbs since the last look [N m]; positive ones raise the angle."""
        self.work: Array = np.zeros_like(angles)
        """(N, 2) work done on the links since the start, ∫ τ dα [J]."""
        self.halted: NDArray[np.bool_] = np.zeros(angles.shape, dtype=bool)
        """(N, 2) whether a motor wanted to advance at the last look and did not."""
        self._begun: Array = angles.copy()
        self._rates: Array = np.zeros_like(angles)
        self._over = np.zeros(len(angles), dtype=np.int64)

    def engage(self, angles: Array) -> None:
        """Take hold of barbs at (N, 2) angles [rad], without torque."""
        self.commands, self.schedule, self.angles, self._begun = (angles.copy() for _ in range(4))
        self.torques, self._rates = np.zeros_like(angles), np.zeros_like(angles)
        self.halted = np.zeros(angles.shape, dtype=bool)

    def look(
        self, angles: Array, targets: Array, interval: float, time_step: float, rates: Array | None = None
    ) -> Array:
        """What the motors do in the control period that begins now.

        Args:
            angles: (N, 2) actual angles [rad].
            targets: (N, 2) angles at the end of the period according to the schedule [rad].
            interval: length of the period [s].
            time_step: dt of the integration [s].
            rates: (N, 2) how fast the angles change [rad/s], which servos damp; None: not told.

        Returns:
            (N, 2) torques on the barbs [N m].
        """
        before = self._torque(angles)
        # A torque that is set now acts from the middle of the step on: the leapfrog scheme changes velocities there. In
        # between the torque is linear in the angle, so that the trapezium is exact.
        middle = angles + (angles - self.angles) * (time_step / interval / 2)
        self.work += self._work_since_look(middle)
        self._begun = middle
        most = self.law.speed_limit * interval
        advance = np.clip(targets - self.commands, -most, most)
        self.halted = np.abs(before) >= self._limit
        if self.law.law == "ease":
            advance = np.where(self.halted, np.clip(advance, -EASED * most, EASED * most), advance)
            for barb in range(angles.shape[1]):
                self._over = np.where(self.halted[:, barb], self._over + 1, 0)
                self.halted[:, barb] &= self._over >= PATIENCE
        if self.law.law == "halt":
            self.halted &= advance * before > 0
        if self.law.law in ("halt", "stall", "ease"):
            advance = np.where(self.halted, 0.0, advance)
        self.commands, self.schedule = self.commands + advance, targets
        self.angles = angles
        if rates is not None:
            self._rates = rates
        self.torques = self._torque(angles)
        return self.torques

    def work_until(self, angles: Array) -> float:
        """Work of all motors since the start, up to (N, 2) angles that the barbs have between two looks [J]."""
        return float((self.work + self._work_since_look(angles)).sum())

    def _work_since_look(self, angles: Array) -> Array:
        work: Array = (self._torque(self._begun) + self._torque(angles)) / 2 * (angles - self._begun)
        return work

    def _torque(self, angles: Array) -> Array:
        torque = self._stiffness * (self.commands - angles)
        if self.law.law == "servo":
            torque = torque - self.law.damping * self._rates
        if self.law.law in ("slip", "servo"):
            torque = np.clip(torque, -self._limit, self._limit)
        result: Array = torque
        return result

    @property
    def memory(self) -> dict[str, Any]:
        """Plain data that `restore` needs."""
        arrays = (self.commands, self.schedule, self.angles, self.torques, self.work, self._begun, self.halted)
        memory = dict(zip(_MEMORY, (array.tolist() for array in arrays), strict=True))
        return memory | self._more_memory()

    def _more_memory(self) -> dict[str, Any]:
        if self.law.law == "servo":
            return {"rates": self._rates.tolist()}
        return {"over": self._over.tolist()} if self.law.law == "ease" else {}

    def restore(self, memory: Mapping[str, Any]) -> None:
        """Go on from where `memory` was taken."""
        shape = self.commands.shape
        self.commands, self.schedule, self.angles, self.torques, self.work, self._begun = (
            np.array(memory[name], dtype=np.float64).reshape(shape) for name in _MEMORY[:-1]
        )
        self.halted = np.array(memory["halted"], dtype=bool).reshape(shape)
        if self.law.law == "servo":
            self._rates = np.array(memory["rates"], dtype=np.float64).reshape(shape)
        if self.law.law == "ease":
            self._over = np.array(memory["over"], dtype=np.int64)
