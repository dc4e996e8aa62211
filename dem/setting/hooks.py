"""Two hooks in the pile; the phase pull-hook pulls the upper one."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from pydantic import Field

from dem.arrays import Array
from dem.setting.part import Length, Part

TOLERANCE = 1e-9  # relative; lengths and times that meet their limit up to rounding are allowed


class Hooks(Part):
    """Two horizontal crosses of two square bars each, on the container's axis.

    The lower hook may be a grid of bars, which holds the pile over its whole cross-section. Hooks are in place before
    the pour, have the container's friction and damping, and move with the container.
    """

    side_m: Length = Field(..., description="side of the bars' square section [m]; default: thickness_in_plane_m, t2")
    length_m: Length = Field(..., description="length of the bars [m]; default: middle_length_m, w")
    lower_height_m: Length = Field(
        ..., description="height of the lower cross's centre above the floor [m]; default: 10 t2"
    )
    upper_height_m: Length = Field(
        ..., description="height of the upper cross's centre above the floor at the start [m]; default: 20 t2"
    )
    lower_length_m: Length = Field(
        ..., description="length of the lower cross's bars, or diameter of a grid of bars [m]; default: length_m"
    )
    lower_bars: int = Field(
        1,
        ge=1,
        le=16,
        description="bars of the lower cross along x, and as many along y, evenly spaced over a disc [1]",
    )

    @property
    def crosses(self) -> tuple[Cross, Cross]:
        """The lower and the upper cross."""
        lower = Cross(height=self.lower_height_m, side=self.side_m, length=self.lower_length_m, count=self.lower_bars)
        return lower, Cross(height=self.upper_height_m, side=self.side_m, length=self.length_m)


# (a, b): the default is a w + b t2.
_HOOK_DEFAULTS = {"side_m": (0, 1), "length_m": (1, 0), "lower_height_m": (0, 10), "upper_height_m": (0, 20)}


def with_hook_defaults(hooks: Any, sizes: tuple[float, float]) -> Any:
    """Return unvalidated data of `Hooks`, with missing lengths from `sizes`, see `with_defaults`."""
    filled = with_defaults(hooks, _HOOK_DEFAULTS, sizes)
    return {"lower_length_m": filled["length_m"]} | filled if isinstance(filled, dict) else filled


def with_defaults(data: Any, defaults: Mapping[str, tuple[int, int]], sizes: tuple[float, float]) -> Any:
    """Return a mapping with its missing keys filled in; data that are no mapping are returned unchanged.

    Args:
        defaults: numbers (a, b) by key; the key's default is a w + b t2 [m].
        sizes: w and t2 of the smarticle, or the longest bar and smallest thickness of other bodies [m].
    """
    if not isinstance(data, Mapping):
        return data
    w, t2 = sizes
    return {key: a * w + b * t2 for key, (a, b) in defaults.items()} | dict(data)


class Bar(NamedTuple):
    """One bar of a hook."""

    middle: tuple[float, float]  #: (x, y) of the bar's centre, from the container's axis [m]
    half: tuple[float, float, float]  #: Half the lengths of the bar's edges along x, y, z [m]


@dataclass(frozen=True, kw_only=True)
class Cross:
    """One hook of a simulation. Lengths in m."""

    height: float  #: Height of the centre above the floor
    side: float  #: Side of the bars' square section
    length: float  #: Length of the bars if `count` is 1; otherwise diameter of the disc at whose edge bars end
    count: int = 1  #: Number of bars along x, which is also the number of bars along y; bars are evenly spaced

    @property
    def bars(self) -> tuple[Bar, ...]:
        """The 2 `count` bars, alternately along x and along y."""
        found: list[Bar] = []
        for k in range(self.count):
            place = self.length * ((k + 1) / (self.count + 1) - 0.5)
            long, thick = math.sqrt((self.length / 2) ** 2 - place**2), self.side / 2
            found += [Bar((0.0, place), (long, thick, thick)), Bar((place, 0.0), (thick, long, thick))]
        return tuple(found)

    @property
    def reach(self) -> float:
        """Largest distance of the bars' corners from the axis [m]."""
        return max(math.hypot(abs(x) + a, abs(y) + b) for (x, y), (a, b, _) in self.bars)

    def obstacles(self, diameter: float) -> Array:
        """Return (n, 3) points in the bars [m], which stand for the bars when bodies are placed.

        A sphere of this `diameter` [m] touches no bar if its centre is a diameter or more away from all points.
        """
        # No point of a bar is farther than √3/2 of the spacing from the grid, less than the radius that is kept away.
        points: list[tuple[float, ...]] = []
        for bar in self.bars:
            axes = [
                middle + np.linspace(-half, half, 1 + math.ceil(2 * half / (diameter / 2)))
                for middle, half in zip((*bar.middle, 0.0), bar.half, strict=True)
            ]
            points += list(itertools.product(*axes))
        return np.asarray(np.array(points) + np.array([0.0, 0.0, self.height]))

    def closed(self, *, wall: float, narrow: float) -> list[Array]:
        """Return closed curves (4, 3) [m] along bars that end at a wall, closed far outside of it.

        Gaps between these bars' ends and the wall, which has the radius `wall`, are below `narrow` [m].
        """
        found = []
        for bar in self.bars:
            (x, y), (a, b, _), far = bar.middle, bar.half, 10 * wall
            if wall - math.hypot(abs(x) + a, abs(y) + b) < narrow:
                ends = [[-far, y], [far, y]] if a > b else [[x, -far], [x, far]]
                found.append(
                    np.array([[*ends[0], self.height], [*ends[1], self.height], [*ends[1], -far], [*ends[0], -far]])
                )
        return found
