"""Strings that pull a chain on YADE, as forces that are set before every step.

The far end of each string, its anchor, is a point in space that may move. Forces use the positions and velocities that
YADE's contact laws use, so that a string is as stable as a contact of equal stiffness.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from dem.arrays import Array
from dem.body.chain import Tie
from dem.body.linear import transformed
from dem.engine.yade.assembly import Assembly
from dem.engine.yade.library import Yade, rows_of
from dem.physics.contact import StringLaw


@dataclass(frozen=True, kw_only=True)
class End:
    """One string: the point at which it is tied to a link, and its anchor."""

    body: int  #: Id of the link's body
    arm: Sequence[float]  #: (3,) point at which the string is tied, in YADE's frame of the body [m]
    anchor: Sequence[float]  #: (3,) position of the anchor at the start [m]
    speed: float  #: Velocity of the anchor along x [m/s]


class YadeStrings:
    """`dem.engine.interface.Strings` on YADE."""

    def __init__(self, yade: Yade, assembly: Assembly) -> None:
        self._yade = yade
        self._assembly = assembly
        self._law: StringLaw | None = None
        self._bind([], [], [])

    def _bind(self, ends: Sequence[End], anchors: Sequence[Sequence[float]], sums: Sequence[Sequence[float]]) -> None:
        vector, bodies = self._yade.vector, self._yade.omega.bodies
        self._ends = ends
        self._states = [bodies[end.body].state for end in ends]
        self._arms = [vector(*end.arm) for end in ends]
        self._anchors = [vector(*anchor) for anchor in anchors]
        self._sums = [vector(*total) for total in sums]

    @property
    def tied(self) -> bool:
        return bool(self._ends)

    def tie(self, ties: Sequence[Tie], law: StringLaw, speeds: Sequence[float]) -> None:
        state, ends = self._assembly.state(), []
        for tie, speed in zip(ties, speeds, strict=True):
            point = np.array([tie.along, 0.0, 0.0])
            body, arm = self._assembly.anchor(tie.smarticle, tie.link, point)
            position = state.link_positions[tie.smarticle, tie.link]
            position = position + transformed(state.link_rotations[tie.smarticle, tie.link], point)
            away = math.copysign(1.0, position[0])
            anchor = [float(position[0] + away * math.sqrt(law.length**2 - position[1] ** 2)), 0.0, 0.0]
            ends.append(End(body=body, arm=arm.tolist(), anchor=anchor, speed=away * speed))
        self._law = law
        self._bind(ends, [end.anchor for end in ends], [(0, 0, 0) for _ in ends])

    def pull(self, time_step: float) -> float:
        """Set the forces for a step dt [s] and move the anchors; return the work on the links [J]."""
        assert self._law is not None  # called while strings are tied only
        work = 0.0
        forces, vector = self._yade.omega.forces, self._yade.vector
        for k, (end, state) in enumerate(zip(self._ends, self._states, strict=True)):
            arm = state.ori * self._arms[k]
            along = self._anchors[k] - state.pos - arm
            length = along.norm()
            along /= length
            motion = state.vel + state.angVel.cross(arm)
            rate = along.dot(vector(end.speed, 0, 0) - motion)
            force = along * self._law.tension(length, rate)
            forces.setPermF(end.body, force)
            forces.setPermT(end.body, arm.cross(force))
            self._sums[k] += force
            self._anchors[k] += vector(end.speed * time_step, 0, 0)
            work += force.dot(motion) * time_step
        return work

    def untie(self) -> None:
        for end in self._ends:
            self._yade.omega.forces.setPermF(end.body, self._yade.vector(0, 0, 0))
            self._yade.omega.forces.setPermT(end.body, self._yade.vector(0, 0, 0))
        self._bind([], [], [])

    @property
    def sums(self) -> Array:
        return rows_of(self._sums)

    @property
    def pulled(self) -> float:
        starts = np.array([end.anchor for end in self._ends])
        return float(np.ptp(rows_of(self._anchors)[:, 0]) - np.ptp(starts[:, 0]))

    @property
    def ties(self) -> Array:
        return rows_of(state.pos + state.ori * arm for state, arm in zip(self._states, self._arms, strict=True))

    @property
    def memory(self) -> dict[str, Any] | None:
        if self._law is None or not self.tied:
            return None
        return {
            "law": asdict(self._law),
            "ends": [asdict(end) for end in self._ends],
            "anchors": rows_of(self._anchors).tolist(),
            "sums": self.sums.tolist(),
        }

    def restore(self, memory: Mapping[str, Any] | None) -> None:
        if memory is not None:
            self._law = StringLaw(**memory["law"])
            self._bind([End(**end) for end in memory["ends"]], memory["anchors"], memory["sums"])
