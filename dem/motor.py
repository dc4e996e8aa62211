"""The motors at the hinges: velocity-controlled, of limited torque. Pure arithmetic, once per control period."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

Law = Literal["halt", "stall", "slip"]
_MEMORY = ("commands", "angles", "torques", "work", "begun", "halted")


@dataclass(frozen=True, kw_only=True)
class MotorLaw:
    """What all motors of a scene have in common.

    Args:
        torque_limit: τ_max [N m].
        speed_limit: ω, the greatest speed of a command [rad/s].
        stiffness: twist stiffness of the shaft between motor and barb [N m/rad].
        law: "halt": a motor whose torque is at τ_max or above no longer advances against it, and holds with whatever
            torque it takes; "stall": it does not move at all until its torque has fallen, the paper's rule to the
            letter; "slip": a servo that gives way at τ_max.
    """

    torque_limit: float
    speed_limit: float
    stiffness: float
    law: Law


class Motors:
    """Two motors on each of N smarticles.

    A motor turns one end of its shaft to the command; the barb is at the other end, at the actual angle, and feels the
    torque k (command - actual). A motor that halts may always give way: only a command that would load the shaft
    further is refused. One that stalls, in both directions, comes free only when its neighbours move, since the load
    of an elastic contact stays when the motor stops.

    Args:
        law: what all motors have in common.
        angles: (N, 2) angles at the start [rad].
    """

    def __init__(self, law: MotorLaw, angles: Array) -> None:
        self.law = law
        self.commands: Array = angles.copy()
        """(N, 2) angles that the motors hold at present [rad]."""
        self.angles: Array = angles.copy()
        """(N, 2) actual angles at the last look [rad]."""
        self.torques: Array = np.zeros_like(angles)
        """(N, 2) torques on the barbs since the last look [N m]; positive ones raise the angle."""
        self.work: Array = np.zeros_like(angles)
        """(N, 2) work done on the links since the start, ∫ τ dα [J]."""
        self.halted: NDArray[np.bool_] = np.zeros(angles.shape, dtype=bool)
        """(N, 2) whether a motor wanted to advance at the last look and did not."""
        self._begun: Array = angles.copy()

    def engage(self, angles: Array) -> None:
        """Take hold of barbs at (N, 2) angles [rad], without torque."""
        self.commands, self.angles, self._begun = angles.copy(), angles.copy(), angles.copy()
        self.torques = np.zeros_like(angles)
        self.halted = np.zeros(angles.shape, dtype=bool)

    def look(self, angles: Array, targets: Array, interval: float, time_step: float) -> Array:
        """What the motors do in the control period that begins now.

        Args:
            angles: (N, 2) actual angles [rad].
            targets: (N, 2) angles at the end of the period according to the schedule [rad].
            interval: length of the period [s].
            time_step: dt of the integration [s].

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
        self.halted = np.abs(before) >= self.law.torque_limit
        if self.law.law == "halt":
            self.halted &= advance * before > 0
        if self.law.law != "slip":
            advance = np.where(self.halted, 0.0, advance)
        self.commands = self.commands + advance
        self.angles = angles
        self.torques = self._torque(angles)
        return self.torques

    def work_until(self, angles: Array) -> float:
        """Work of all motors since the start, up to (N, 2) angles that the barbs have between two looks [J]."""
        return float((self.work + self._work_since_look(angles)).sum())

    def _work_since_look(self, angles: Array) -> Array:
        work: Array = (self._torque(self._begun) + self._torque(angles)) / 2 * (angles - self._begun)
        return work

    def _torque(self, angles: Array) -> Array:
        torque = self.law.stiffness * (self.commands - angles)
        if self.law.law == "slip":
            torque = np.clip(torque, -self.law.torque_limit, self.law.torque_limit)
        result: Array = torque
        return result

    @property
    def memory(self) -> dict[str, Any]:
        """Plain data that `restore` needs."""
        arrays = (self.commands, self.angles, self.torques, self.work, self._begun, self.halted)
        return dict(zip(_MEMORY, (array.tolist() for array in arrays), strict=True))

    def restore(self, memory: Mapping[str, Any]) -> None:
        """Go on from where `memory` was taken."""
        shape = self.commands.shape
        self.commands, self.angles, self.torques, self.work, self._begun = (
            np.array(memory[name], dtype=np.float64).reshape(shape) for name in _MEMORY[:-1]
        )
        self.halted = np.array(memory["halted"], dtype=bool).reshape(shape)
