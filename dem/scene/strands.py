"""Number of strands, or rows of spheres, side by side that leave no hole in a flat bar for any body of a scene.

Two strands of the diameter d, with their axes p apart, let a strand of the diameter d' sink in between them. Midway it
overlaps both by δ = (d + d' - p)/2, and the two contacts have the energy kn u(δ)², with the stretched overlap u of
`dem.engine.links.contact.barrier`. In the hardest impact for which the stiffness is chosen, a body that hits a wall
reaches the overlap x of `dem.scene.stiffness.WANTED`, and has the energy kn x²/2. Two bodies that hit each other at
this speed have half of it, since their reduced mass is half of a body's. So no impact pushes a strand through if

    u(δ) ≥ x/2.

Chains of spheres have no barrier, and a hard push takes them through each other at any number of rows. Rows and pitch
leave no hole that a sphere or a hook's bar passes without force.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

from dem.body.bars import Bars
from dem.body.particle import mean_width
from dem.scene.stiffness import WANTED
from dem.setting.fidelity import MOST_ROWS

# Part of the room up to which a contact is linear: `LINEAR` of `dem.engine.links.contact.barrier`, whose import would
# load Numba for every scene. `tests/links/test_strands.py` holds both functions together.
_LINEAR = 0.25


@dataclass(frozen=True, kw_only=True)
class Section:
    """Section of a bar, and whether strands may lie side by side in it. Lengths in m."""

    normal: float  #: Thickness along the normal, across which strands lie side by side
    in_plane: float  #: Thickness in the plane
    round: bool = False  #: Whether the section is a disc; both thicknesses are then its diameter
    single: bool = False  #: Whether one strand represents it, however flat it is

    @classmethod
    def of(cls, bars: Bars, *, single: bool = False) -> Self:
        """Return the section of bars."""
        return cls(normal=bars.thickness_normal, in_plane=bars.thickness_in_plane, round=bars.round, single=single)

    @property
    def width(self) -> float:
        """Mean width [m]."""
        return self.in_plane if self.round else mean_width(self.normal, self.in_plane)

    def is_wide(self, diameter: float | None) -> bool:
        """Return whether strands of a diameter [m], by default `in_plane`, have room side by side."""
        return self.normal > (diameter or self.in_plane) and not self.round and not self.single


@dataclass(frozen=True, kw_only=True)
class Sections:
    """Sections of all bodies of a scene, and the thinnest bars of its hooks. Lengths in m."""

    sections: Sequence[Section]
    diameter: float | None  #: Diameter of all strands that the scene gives; None: from the sections
    hook: float  #: Side of the hooks' bars; inf without hooks

    def _diameter(self, section: Section, *, rows: bool) -> float:
        """Return the diameter of the strands of a section, of several `rows` or one."""
        return self.diameter or (section.in_plane if rows and section.is_wide(None) else section.width)

    @property
    def thinnest(self) -> float:
        """Thickness of the thinnest bars [m]: of the hooks, or the diameter of strands side by side or of one."""
        return min(self.hook, *(self._diameter(section, rows=True) for section in self.sections))

    def rows(self, *, smooth: bool, pitch: float) -> int:
        """Return the least number of strands, or rows of spheres, of the flat bars; 1 without any.

        It is `MOST_ROWS` + 1 for all numbers above `MOST_ROWS`. `pitch` is the distance of neighbouring spheres along a
        bar over their diameter [1]; strands of `smooth` links have none.
        """
        thinnest = self.thinnest
        impact = WANTED["standard"] * min(mean_width(section.normal, section.in_plane) for section in self.sections)
        most = 1
        for section in self.sections:
            if not section.is_wide(self.diameter):
                continue
            d = self._diameter(section, rows=True)
            for rows in range(2, MOST_ROWS + 2):
                apart = (section.normal - d) / (rows - 1)
                if smooth and _stretched((d + thinnest - apart) / 2, (d + thinnest) / 2) >= impact / 2:
                    break
                if not smooth and math.hypot(apart, pitch * d) <= d + thinnest:
                    break
            most = max(most, rows)
        return most

    def holes(self, rows: int, least: int) -> str | None:
        """Return a message if `rows` strands side by side are less than `least`, those of `rows`; None otherwise."""
        if not 1 < rows < least:
            return None
        wide = max(section.normal for section in self.sections if section.is_wide(self.diameter))
        several = f"at least {least}" if least <= MOST_ROWS else f"thicker bars, since {MOST_ROWS} rows are too few"
        return (
            f"fidelity.rows: {rows} rows side by side leave holes in bars of thickness_normal_m = {wide:g} m, which "
            f"bars of {self.thinnest:.3g} m pass through; use {several}, or 1, a row as thick as the mean width"
        )

    def overhang(self, rows: int) -> str | None:
        """Return a warning if the axis of a thin strand may lie within a flat bar, beyond its one round strand."""
        if self.diameter is not None:
            return None
        each = [(section, self._diameter(section, rows=rows > 1)) for section in self.sections]
        thinnest = min(self.hook, *(d for _, d in each))
        for section, d in each:
            wide = max(section.normal, section.in_plane)
            if not section.round and not (rows > 1 and section.is_wide(None)) and wide > d + thinnest:
                other = "use fidelity: standard on links" if section.is_wide(None) else "compare with other sections"
                return (
                    f"fidelity.rows: a round strand of {d:.3g} m stands for bars {wide:g} m wide, so that the axes of "
                    f"bars of {thinnest:.3g} m may lie within their edges; {other}"
                )
        return None

    @property
    def widest_pitch(self) -> float:
        """Largest pitch of spheres over their diameter at which no sphere or hook passes between two of one row [1].

        Two chains of equal pitch that cross have the least distance where the gaps of both meet. It is the half
        diagonal of a rectangle whose sides are their pitches.
        """
        each = [self._diameter(section, rows=False) for section in self.sections]
        least, most = min(each), max(each)
        return min((least + most) / math.hypot(least, most), 1 + self.hook / most)


def _stretched(depth: float, room: float) -> float:
    """Return the stretched overlap u [m] of an overlap below the room [m], at which axes meet; see the module."""
    rest = (1 - _LINEAR) * room
    x = max(0.0, depth - _LINEAR * room) / rest
    return depth + room * x**3 / (1 - x)
