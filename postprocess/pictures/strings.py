"""The two strings that pull a chain apart: where they are tied, and where their other ends are."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from dem.record.frame import Frame
from dem.record.names import SERIES
from dem.record.run import Run

if TYPE_CHECKING:
    from numpy.typing import NDArray

_STRAIN, _ARRANGE = "strain", "arrange"


@dataclass(frozen=True, kw_only=True, eq=False)
class ChainStrings:
    """Strings of a strain test; lengths in m.

    Attributes:
        phase: Index of the phase while they are tied.
        start: Time at which that phase begins [s].
        speed: Of the end that is moved [m/s].
        from_hinge: Where on a barb they are tied, from its hinge [m].
        anchors: (2, 3) the other ends at the start: at lower x, held, and at higher x, moved away along x.
    """

    phase: int
    start: float
    speed: float
    from_hinge: float
    anchors: NDArray[np.float64] = field(repr=False)

    def lines(self, frame: Frame) -> NDArray[np.float64]:
        """(2, 2, 3) knot and other end of each string [m]; (0, 2, 3) while none is tied."""
        if frame.phase != self.phase:
            return np.empty((0, 2, 3))
        ends = self.anchors.copy()
        ends[1, 0] += self.speed * (frame.time - self.start)
        return np.stack([knots(frame.vertices, self.from_hinge), ends], axis=1)


def knots(vertices: NDArray[np.float64], from_hinge: float) -> NDArray[np.float64]:
    """(2, 3) points on the outer barbs of a chain, at a distance from their hinges [m].

    Args:
        vertices: (N, 4, 3) [m]; every second smarticle is turned by half a turn.
        from_hinge: [m].

    Source:
        `dem.body.chain.Chain.ties`.
    """
    last = len(vertices) - 1
    points = []
    for smarticle, tip, hinge in ((0, 0, 1), (last, 0, 1) if last % 2 else (last, 3, 2)):
        along = vertices[smarticle, tip] - vertices[smarticle, hinge]
        points.append(vertices[smarticle, hinge] + from_hinge * along / np.linalg.norm(along))
    return np.array(points)


def read_strings(run: Run) -> ChainStrings | None:
    """The strings of a run's strain test; None where there is no such phase.

    They are tied to the chain as it was laid out, so a chain that moved before it was pulled would have them where they
    are to within that motion.

    Raises:
        InputError: The scene is damaged.

    Source:
        `dem.body.chain.Chain`: how a chain is laid out.
    """
    planned = run.scene["phases"]
    phases = {phase["type"]: phase for phase in planned}
    if _STRAIN not in phases or _ARRANGE not in phases:
        return None
    index = planned.index(phases[_STRAIN])
    index = planned.index(phases[_STRAIN])
    strain, gap = phases[_STRAIN], phases[_ARRANGE]["gap_m"]
    radius, barb = run.manifest.sphere_diameter_m / 2, run.manifest.barb_length_m
    offset = barb + gap + run.manifest.bulge_m + radius  # of the two rows of middle links
    from_hinge = barb - radius if strain.get("tied_at") == "tip" else offset / 2
    reach = (
        (run.manifest.count - 1) * (run.manifest.middle_length_m - 2 * radius - gap) + run.manifest.middle_length_m
    ) / 2
    length = strain["string_length_m"]
    ends = reach + np.sqrt(length**2 - (from_hinge - offset / 2) ** 2)
    return ChainStrings(
        phase=index,
        start=_start(run, index),
        speed=strain["speed_m_per_s"],
        from_hinge=from_hinge,
        anchors=np.array([[-ends, 0.0, 0.0], [ends, 0.0, 0.0]]),
    )


def _start(run: Run, index: int) -> float:
    """Time at which a phase begins [s]: a run that is not done tells it by its series alone."""
    start = run.phases[index].start_s
    if start is None and (run.path / SERIES).exists():
        series = run.series
        start = float(series.time[series["phase"] < index].max(initial=0.0))
    return start or 0.0
