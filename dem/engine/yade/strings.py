"""The two strings that hold and pull a chain, in YADE: forces set before every step.

Each is anchored at a point in space; one of the two moves. Their forces are worked out from where the tied links are
and how fast they move, as YADE's contact laws do, and so have the stability of such a contact.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.body.chain import Tie
from dem.body.state import State
from dem.engine.yade.assembly import Assembly
from dem.engine.yade.library import Yade
from dem.physics.strings import StringLaw

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class End:
    """One string.

    Args:
        body: id of the link that it is tied to.
        arm: (3,) where, in the body's own frame [m].
        anchor: (3,) its other end at the start [m].
        speed: of the anchor along x [m/s].
    """

    body: int
    arm: Sequence[float]
    anchor: Sequence[float]
    speed: float


class TautStrings:
    """Strings at work.

    Args:
        yade: the simulation.
        law: what they have in common.
        ends: one for each string.
    """

    def __init__(self, yade: Yade, law: StringLaw, ends: Sequence[End]) -> None:
        self._yade = yade
        self._law = law
        self._ends = ends
        self._anchors = [yade.vector(*end.anchor) for end in ends]
        self._sums = [yade.vector(0, 0, 0) for _ in ends]
        self.bind()

    def bind(self) -> None:
        """Take hold of YADE's objects; loading replaces them all."""
        bodies = self._yade.omega.bodies
        self._states = [bodies[end.body].state for end in self._ends]
        self._arms = [self._yade.vector(*end.arm) for end in self._ends]

    def pull(self, time_step: float) -> float:
        """Set the forces of the step that begins, and move the anchors on.

        Args:
            time_step: dt [s].

        Returns:
            Work of the strings on the links in the step [J], to first order in dt.
        """
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

    def release(self) -> None:
        """Let go."""
        for end in self._ends:
            self._yade.omega.forces.setPermF(end.body, self._yade.vector(0, 0, 0))
            self._yade.omega.forces.setPermT(end.body, self._yade.vector(0, 0, 0))

    @property
    def sums(self) -> Array:
        """(strings, 3) forces on the links, summed over all steps so far [N]."""
        return np.array([[s[0], s[1], s[2]] for s in self._sums])

    @property
    def anchors(self) -> Array:
        """(strings, 3) where the other ends are [m]."""
        return np.array([[a[0], a[1], a[2]] for a in self._anchors])

    @property
    def pulled(self) -> float:
        """How far the anchors have moved apart since the strings were tied [m]."""
        begun = [end.anchor for end in self._ends]
        return float(np.ptp(self.anchors[:, 0]) - np.ptp(np.array(begun)[:, 0]))

    @property
    def ties(self) -> Array:
        """(strings, 3) where the strings are tied [m]."""
        points = [state.pos + state.ori * arm for state, arm in zip(self._states, self._arms, strict=True)]
        return np.array([[p[0], p[1], p[2]] for p in points])

    @property
    def memory(self) -> dict[str, Any]:
        """Plain data that `restored` needs."""
        return {
            "law": asdict(self._law),
            "ends": [asdict(end) for end in self._ends],
            "anchors": self.anchors.tolist(),
            "sums": self.sums.tolist(),
        }

    @classmethod
    def restored(cls, yade: Yade, memory: Mapping[str, Any]) -> TautStrings:
        """The strings of a simulation that was loaded."""
        strings = cls(yade, StringLaw(**memory["law"]), [End(**end) for end in memory["ends"]])
        strings._anchors = [yade.vector(*anchor) for anchor in memory["anchors"]]
        strings._sums = [yade.vector(*total) for total in memory["sums"]]
        return strings


def tied(state: State, assembly: Assembly, ties: Sequence[Tie], law: StringLaw, speeds: Sequence[float]) -> list[End]:
    """Strings from some points of articulated smarticles, taut, their other ends outwards on the x-axis.

    Args:
        state: the smarticles.
        assembly: their bodies.
        ties: the points.
        law: what the strings have in common.
        speeds: of their other ends, away from the origin [m/s].
    """
    ends = []
    for tie, speed in zip(ties, speeds, strict=True):
        point = np.array([tie.along, 0.0, 0.0])
        body, arm = assembly.anchor(tie.smarticle, tie.link, point)
        place = state.link_positions[tie.smarticle, tie.link]
        place = place + state.link_rotations[tie.smarticle, tie.link] @ point
        away = math.copysign(1.0, place[0])
        anchor = np.array([place[0] + away * math.sqrt(law.length**2 - place[1] ** 2), 0.0, 0.0])
        ends.append(End(body=body, arm=arm.tolist(), anchor=anchor.tolist(), speed=away * speed))
    return ends


class YadeStrings:
    """The strings of a simulation, tied or not; see `dem.engine.interface.Strings`.

    Args:
        yade: the simulation.
        assembly: the smarticles.
    """

    def __init__(self, yade: Yade, assembly: Assembly) -> None:
        self._yade = yade
        self._assembly = assembly
        self.taut: TautStrings | None = None
        """The strings at work; None where none is tied."""

    @property
    def tied(self) -> bool:
        """See the interface."""
        return self.taut is not None

    def tie(self, ties: Sequence[Tie], law: StringLaw, speeds: Sequence[float]) -> None:
        """See the interface."""
        ends = tied(self._assembly.state(), self._assembly, ties, law, speeds)
        self.taut = TautStrings(self._yade, law, ends)

    def untie(self) -> None:
        """See the interface."""
        if self.taut is not None:
            self.taut.release()
            self.taut = None

    @property
    def sums(self) -> Array:
        """See the interface."""
        return self._at_work.sums

    @property
    def pulled(self) -> float:
        """See the interface."""
        return self._at_work.pulled

    @property
    def ties(self) -> Array:
        """See the interface."""
        return self._at_work.ties

    @property
    def _at_work(self) -> TautStrings:
        assert self.taut is not None  # asked while strings are tied only
        return self.taut

    @property
    def memory(self) -> dict[str, Any] | None:
        """Plain data that `restore` needs besides the loaded simulation."""
        return None if self.taut is None else self.taut.memory

    def restore(self, memory: Mapping[str, Any] | None) -> None:
        """Go on from where `memory` was taken."""
        if memory is not None:
            self.taut = TautStrings.restored(self._yade, memory)
