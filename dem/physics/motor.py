"""The motors at the hinges: velocity-controlled, of limited torque. Pure arithmetic, once per control period."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from dem.arrays import Array, Flags

Law = Literal["halt", "stall", "ease", "slip", "servo"]
LAWS: tuple[Law, ...] = get_args(Law)
HALT, STALL, EASE, SLIP, SERVO = range(len(LAWS))
EASED = 0.5  # of the speed, for a motor at its torque limit that eases
PATIENCE = 20  # findings in a row, of both barbs of a smarticle one after the other, after which it stops


@dataclass(frozen=True, kw_only=True)
class MotorLaw:
    """What all motors of a scene have in common."""

    torque_limit: float  #: Τ_max [N m]
    speed_limit: float  #: ω, the greatest speed of a command [rad/s]
    stiffness: float  #: Twist stiffness of the shaft between motor and barb [N m/rad]
    #: "halt": a motor whose torque is at τ_max or above no longer advances against it, and holds with whatever torque
    #: it takes; "stall": it does not move at all until its torque has fallen, the rule of the paper's text; "ease": it
    #: goes on at half the speed with whatever torque that takes, and stops only when twenty barbs in a row, those of
    #: the smarticle in turn, were found there, the rule of the paper's code; "slip": a spring that gives way at τ_max;
    #: "servo": a spring with a damper beside it, their torque limited as a whole
    law: Law
    damping: float = 0.0  #: A servo's derivative gain [N m s/rad]


# The next two take scalars, or arrays: compiled code calls them for one barb, `Motors` for all barbs of a side.


def speed_factor(law: int, over: Any) -> Any:
    """Return the factor on a motor's greatest speed [1]; arguments as in `halts`."""
    return 1.0 - (1.0 - EASED) * over if law == EASE else 1.0


def halts(law: int, over: Any, advance: Any, torque: Any, findings: Any) -> Any:
    """Return whether a motor halts.

    Args:
        law: number of the law in `LAWS`.
        over: whether the torque is at its limit.
        advance: of the command that is wanted, or its rate; the sign matters.
        torque: on the barb since the last control update [N m].
        findings: how many barbs in a row, of this smarticle in turn, were found at the limit, with this one.
    """
    if law == HALT:
        return over & (advance * torque > 0.0)
    if law == EASE:
        return over & (findings >= PATIENCE)
    return over


class Motors:
    """Two motors on each of N smarticles.

    A motor turns one end of its shaft to the command; the barb is at the other end, at the actual angle, and feels the
    torque k (command - actual). A motor that halts may always give way: only a command that would load the shaft
    further is rejected. One that stalls, in both directions, comes free only when its neighbours move, since the load
    of an elastic contact stays when the motor stops.

    Args:
        angles: (N, 2) angles at the start [rad].
        strengths: (N, 2) factors on torque limit and stiffness [1]; None: all are equal.
    """

    def __init__(self, law: MotorLaw, angles: Array, strengths: Array | None = None) -> None:
        self.law = law
        factor = 1.0 if strengths is None else strengths
        self._stiffness = law.stiffness * factor
        self._limit = law.torque_limit * factor
        self.work: Array = np.zeros_like(angles)  #: (N, 2) work done on the links since the start, ∫ τ dα [J]
        self._over = np.zeros(len(angles), dtype=np.int64)
        self.engage(angles)

    def engage(self, angles: Array) -> None:
        """Take hold of barbs at (N, 2) angles [rad], without torque."""
        self.commands: Array = angles.copy()  #: (N, 2) angles that the motors hold at present [rad]
        self.schedule: Array = angles.copy()
        """(N, 2) angles of the schedule at the last control update [rad]; a motor that halts falls behind."""
        self.angles: Array = angles.copy()  #: (N, 2) actual angles at the last control update [rad]
        self.torques: Array = np.zeros_like(angles)
        """(N, 2) torques on the barbs since the last control update [N m]; positive ones raise the angle."""
        self.halted: Flags = np.zeros(angles.shape, dtype=bool)
        """(N, 2) whether a motor wanted to advance at the last control update and did not."""
        self._begun: Array = angles.copy()
        self._rates: Array = np.zeros_like(angles)

    def update(
        self, angles: Array, targets: Array, interval: float, time_step: float, rates: Array | None = None
    ) -> Array:
        """Return the torques (N, 2) on the barbs in the control period that begins now [N m].

        Args:
            angles: (N, 2) actual angles [rad].
            targets: (N, 2) angles at the end of the period according to the schedule [rad].
            interval: length of the period [s].
            time_step: dt of the integration [s].
            rates: (N, 2) how fast the angles change [rad/s], which servos damp; None: unknown.
        """
        before = self._torque(angles)
        # A torque that is set now acts from the middle of the step on: the leapfrog scheme changes velocities there. In
        # between the torque is linear in the angle, so that the trapezium is exact.
        middle = angles + (angles - self.angles) * (time_step / interval / 2)
        self.work += self._work_since_update(middle)
        self._begun = middle
        law, over = LAWS.index(self.law.law), np.abs(before) >= self._limit
        most = self.law.speed_limit * interval * speed_factor(law, over)
        advance = np.clip(targets - self.commands, -most, most)
        self.halted = np.empty_like(over)
        for barb in range(angles.shape[1]):
            self._over = np.where(over[:, barb], self._over + 1, 0)
            self.halted[:, barb] = halts(law, over[:, barb], advance[:, barb], before[:, barb], self._over)
        if law < SLIP:
            advance = np.where(self.halted, 0.0, advance)
        self.commands, self.schedule = self.commands + advance, targets
        self.angles = angles
        if rates is not None:
            self._rates = rates
        self.torques = self._torque(angles)
        return self.torques

    def work_until(self, angles: Array) -> float:
        """Return the work of all motors since the start, up to (N, 2) angles between two control updates [J]."""
        return float((self.work + self._work_since_update(angles)).sum())

    def _work_since_update(self, angles: Array) -> Array:
        return np.asarray((self._torque(self._begun) + self._torque(angles)) / 2 * (angles - self._begun))

    def _torque(self, angles: Array) -> Array:
        torque: Array = self._stiffness * (self.commands - angles)
        if self.law.law == "servo":
            torque = torque - self.law.damping * self._rates
        return torque if self.law.law not in ("slip", "servo") else np.clip(torque, -self._limit, self._limit)

    # -- memory ------------------------------------------------------------------------------------------------

    def _kept(self) -> dict[str, str]:
        """Attributes by their keys in `memory`."""
        kept = {name: name for name in ("commands", "schedule", "angles", "torques", "work", "halted")}
        own = {"servo": {"rates": "_rates"}, "ease": {"over": "_over"}}
        return kept | {"begun": "_begun"} | own.get(self.law.law, {})

    @property
    def memory(self) -> dict[str, Any]:
        """Plain data that `restore` needs."""
        return {key: getattr(self, name).tolist() for key, name in self._kept().items()}

    def restore(self, memory: Mapping[str, Any]) -> None:
        """Go on from where `memory` was taken."""
        for key, name in self._kept().items():
            present = getattr(self, name)
            setattr(self, name, np.array(memory[key], dtype=present.dtype).reshape(present.shape))
