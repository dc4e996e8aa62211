"""Control updates of motors at the hinges, which are velocity-controlled and have a torque limit."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from dem.arrays import Array, Flags

Law = Literal["halt", "stall", "ease", "slip", "servo"]
LAWS: tuple[Law, ...] = get_args(Law)
HALT, STALL, EASE, SLIP, SERVO = range(len(LAWS))
EASED = 0.5  # factor on the speed limit of a motor at its torque limit, law "ease"
# Law "ease": a motor stops after this many barbs in a row at the torque limit, barb 1 and barb 2 counted in turn.
PATIENCE = 20


@dataclass(frozen=True, kw_only=True)
class MotorLaw:
    """Parameters that all motors of a scene share."""

    torque_limit: float  #: Torque limit τ_max [N m]
    speed_limit: float  #: Greatest speed of a command, ω [rad/s]
    stiffness: float  #: Twist stiffness of the shaft between motor and barb [N m/rad]
    law: Law  #: What a motor does when its torque reaches τ_max, as `dem.setting.motor.Motor.law` describes it
    damping: float = 0.0  #: A servo's derivative gain; on links also the damping of a shaft's twist [N m s/rad]


# `speed_factor` and `halts` take scalars or arrays: compiled code calls them for one barb, `Motors` for barb 1, then
# barb 2 of all smarticles.


def speed_factor(law: int, over: Any) -> Any:
    """Return the factor on a motor's speed limit [1].

    It is `EASED` under the law "ease" at the torque limit, and otherwise 1. `law` is an index in `LAWS`; `over`:
    whether the torque has reached its limit.
    """
    return 1.0 - (1.0 - EASED) * over if law == EASE else 1.0


def halts(law: int, over: Any, advance: Any, torque: Any, findings: Any) -> Any:
    """Return whether a motor halts, or for the laws "slip" and "servo" whether it is at its torque limit.

    Motors never halt under "slip" and "servo".

    Args:
        law: index of the law in `LAWS`.
        over: whether the torque has reached its limit.
        advance: change of the command that the schedule requires [rad], or its rate [rad/s]; only the sign matters.
        torque: torque on the barb since the last control update [N m].
        findings: how many times in a row a barb of the smarticle was found at the torque limit, this time included. An
            update looks at barb 1, then at barb 2, and both share one count.
    """
    if law == HALT:
        return over & (advance * torque > 0.0)
    if law == EASE:
        return over & (findings >= PATIENCE)
    return over


class Motors:
    """Two motors on each of N smarticles.

    A motor turns one end of its shaft to an angle, the command. The barb is at the other end, at the actual angle, and
    receives the torque k (command - actual). A motor halted under the law "stall" keeps its command, and with it the
    load of its contacts, so that it starts again only after neighbouring bodies have moved.

    Args:
        law: parameters of the motors.
        angles: (N, 2) angles of the barbs at the start [rad].
        strengths: (N, 2) factors on torque limit and stiffness [1]; None: 1 for all motors.
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
        """Reset commands to actual angles (N, 2) [rad], so that torques are 0."""
        self.commands: Array = angles.copy()  #: (N, 2) angles that the motors hold at present [rad]
        self.schedule: Array = angles.copy()  #: (N, 2) angles of the schedule at the last control update [rad]
        self.angles: Array = angles.copy()  #: (N, 2) actual angles at the last control update [rad]
        self.torques: Array = np.zeros_like(angles)  #: (N, 2) torques; positive torques raise angles [N m]
        self.halted: Flags = np.zeros(angles.shape, dtype=bool)
        """(N, 2) whether the last control update halted a motor, or under "slip" and "servo" found it at its limit."""
        self._begun: Array = angles.copy()
        self._rates: Array = np.zeros_like(angles)

    def update(
        self, angles: Array, targets: Array, interval: float, time_step: float, rates: Array | None = None
    ) -> Array:
        """Make a control update; return the torques (N, 2) on the barbs in the next control period [N m].

        Args:
            angles: (N, 2) actual angles [rad].
            targets: (N, 2) angles at the end of the period according to the schedule [rad].
            interval: length of the period [s].
            time_step: dt of the integration [s].
            rates: (N, 2) rates of the angles [rad/s], for the dampers of servos; None: the rates of the previous call.
        """
        before = self._torque(angles)
        # The new torque acts from the middle of the step on, where the leapfrog scheme changes velocities. Between
        # updates the torque is linear in the angle, so that the trapezoidal rule is exact.
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
        """Return the work of all motors since the start [J]; `angles`: (N, 2) present actual angles [rad]."""
        return float((self.work + self._work_since_update(angles)).sum())

    def _work_since_update(self, angles: Array) -> Array:
        return np.asarray((self._torque(self._begun) + self._torque(angles)) / 2 * (angles - self._begun))

    def _torque(self, angles: Array) -> Array:
        torque: Array = self._stiffness * (self.commands - angles)
        if self.law.law == "servo":
            torque = torque - self.law.damping * self._rates
        return torque if self.law.law not in ("slip", "servo") else np.clip(torque, -self._limit, self._limit)

    def _kept(self) -> dict[str, str]:
        """Return the names of attributes that `memory` stores, by their keys in `memory`."""
        kept = {name: name for name in ("commands", "schedule", "angles", "torques", "work", "halted")}
        own = {"servo": {"rates": "_rates"}, "ease": {"over": "_over"}}
        return kept | {"begun": "_begun"} | own.get(self.law.law, {})

    @property
    def memory(self) -> dict[str, Any]:
        """Plain data of the motors' present state, for `restore`."""
        return {key: getattr(self, name).tolist() for key, name in self._kept().items()}

    def restore(self, memory: Mapping[str, Any]) -> None:
        """Restore the state that `memory` returned."""
        for key, name in self._kept().items():
            present = getattr(self, name)
            setattr(self, name, np.array(memory[key], dtype=present.dtype).reshape(present.shape))
