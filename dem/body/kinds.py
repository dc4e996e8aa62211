"""Kinds of bodies in a pile, with the spheres that represent them, and the kind of each body."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from dem.arrays import Array, Numbers
from dem.body.bars import JOINED, Bars
from dem.body.filament import Filament
from dem.body.linkage import Linkage
from dem.body.particle import HINGE_CLEARANCE, Particle, smallest_effective_mass


class Body(Protocol):
    """Interface of a smarticle and of a kind of other bodies, in SI units."""

    @property
    def filament(self) -> Filament | None:
        """Filament that a flexible body consists of; None for other bodies."""

    @property
    def linkage(self) -> Linkage | None:
        """Links and joints of a chain; None for other bodies."""

    @property
    def mass(self) -> float:
        """Mass [kg]."""

    @property
    def inertia(self) -> Array:
        """(3,) principal moments about the centre of mass, along the axes of the body's frame [kg m²]."""

    @property
    def volume(self) -> float:
        """Solid volume [m³]."""

    @property
    def size(self) -> float:
        """Length of the longest bar [m]; of a smarticle the length w of its middle link."""

    @property
    def thicknesses(self) -> tuple[float, float]:
        """Thickness along the normal and in the plane [m]."""

    @property
    def centres(self) -> Array:
        """(S, 3) centres of the spheres in the body's frame [m]."""

    @property
    def outline(self) -> Array:
        """(P, 3) centres of spheres, of that radius, that reach as far as the body: `centres`, and ends of strands [m].

        Coordinates are in the body's frame.
        """

    @property
    def outline_links(self) -> Numbers:
        """(P,) number of the link, or bar, of each point of `outline`."""

    @property
    def radius(self) -> float:
        """Radius of the spheres [m]."""

    @property
    def breadth(self) -> float:
        """Extent of a bar across its axis, over all rows of its spheres, where it is largest [m]."""

    @property
    def reach(self) -> float:
        """Largest distance of a point of bars or spheres from the centre of mass [m]."""


@dataclass(frozen=True, kw_only=True)
class Kind:
    """One kind of body: its bars, and the spheres that represent them in contacts."""

    name: str
    bars: Bars
    rows: int  #: Rows of spheres, or strands, side by side along the normal of each bar; 1 for a round section
    diameter: float  #: Diameter of a sphere, or strand [m]
    pitch: float  #: Largest distance of neighbouring spheres along a bar [m]
    #: Filament of a flexible body, whose `bars` are its segments in the shape in which it is poured; None: other bodies
    filament: Filament | None = None
    linkage: Linkage | None = None  #: Links and joints if it is a linkage; its bars are then its links as poured

    @property
    def bends(self) -> bool:
        """Whether the body changes its shape."""
        return self.filament is not None or self.linkage is not None

    @cached_property
    def pieces(self) -> tuple[Kind, ...]:
        """The links of a linkage as bodies by themselves; none of other bodies."""
        own = () if self.linkage is None else self.linkage.links
        return tuple(replace(self, name="link", bars=bars, linkage=None) for bars in own)

    @property
    def mass(self) -> float:
        return self.bars.mass

    @property
    def inertia(self) -> Array:
        return self.bars.inertia

    @property
    def volume(self) -> float:
        """Sum of the bars' volumes [m³]."""
        return self.bars.volume

    @cached_property
    def size(self) -> float:
        return float(self.bars.lengths.max())

    @cached_property
    def length(self) -> float:
        """Sum of the bars' lengths [m]."""
        return float(self.bars.lengths.sum())

    @property
    def thicknesses(self) -> tuple[float, float]:
        return self.bars.thickness_normal, self.bars.thickness_in_plane

    @property
    def radius(self) -> float:
        return self.diameter / 2

    def _stations(self, bar: int) -> Array:
        """Return (n,) distances of a bar's spheres from its start [m].

        At a joint, a common end of bars, only the bar that owns it, see `Bars.owned`, has a sphere; other bars begin 1
        + `HINGE_CLEARANCE` diameters away from it. At a free end the last sphere reaches just to the tip; in a filament
        its centre is at the tip. See `dem.body.particle.Particle`.
        """
        length, d = float(self.bars.lengths[bar]), self.diameter
        free, owned = self.bars.free[bar], self.bars.owned[bar]
        # The round caps of a filament reach beyond its ends.
        tip = d / 2 if self.filament is None else 0.0
        insets = np.where(free, tip, np.where(owned, 0.0, d * (1 + HINGE_CLEARANCE)))
        start, end = float(insets[0]), length - float(insets[1])
        if end <= start:
            # A short bar with a free end keeps the sphere at its tip.
            tips = [place for place, at in ((end, free[1]), (start, free[0])) if at and 0 < place < length]
            return np.array(tips[:1])
        return np.linspace(start, end, max(2, math.ceil((end - start) / self.pitch - 1e-9) + 1))

    @cached_property
    def stations(self) -> Array:
        """(S,) distance of each sphere from the start of its bar, over the bar's length [1]."""
        lengths = self.bars.lengths
        each = [np.repeat(self._stations(k) / lengths[k], self.rows) for k in range(len(lengths))]
        return np.concatenate(each)

    @property
    def offsets(self) -> Array:
        """(rows,) offsets of the rows from a bar's axis, along its normal [m]; the outermost reach to its faces."""
        reach = self.bars.thickness_normal / 2 - self.radius
        return np.linspace(-reach, reach, self.rows) if self.rows > 1 else np.zeros(1)

    @cached_property
    def _layout(self) -> tuple[Array, Numbers]:
        bars, centres, links = self.bars, [], []
        for k, (ends, frame) in enumerate(zip(bars.ends, bars.frames, strict=True)):
            for station in self._stations(k):
                for offset in self.offsets:
                    centres.append(ends[0] + station * frame[:, 0] + offset * frame[:, 2])
                    links.append(k)
        return np.array(centres), np.array(links, dtype=np.int64)

    @property
    def centres(self) -> Array:
        return self._layout[0]

    @property
    def links(self) -> Numbers:
        """(S,) number of the bar to which each sphere belongs."""
        return self._layout[1]

    @property
    def spread(self) -> float:
        """Distance of the outermost rows from a bar's axis, along its normal [m]."""
        return float(self.offsets[-1])

    @property
    def breadth(self) -> float:
        return 2 * self.spread + self.diameter

    @cached_property
    def _uncovered(self) -> tuple[Array, Numbers]:
        """Ends (n, 3) of strands at joints, where no sphere is [m], and the number (n,) of the bar of each.

        These are strands of bars that are twisted against each other, and of bars too short for a sphere. Where
        bodies change their shape, the spheres of `BarState.spheres` alone count.
        """
        if self.bends:
            return np.zeros((0, 3)), np.zeros(0, np.int64)
        normals = self.bars.frames[:, None, None, :, 2]
        ends = self.bars.ends[:, :, None] + self.offsets[:, None] * normals  # (bars, 2, rows, 3)
        bars, sides = np.nonzero(~self.bars.free)
        points, bars = ends[bars, sides].reshape(-1, 3), np.repeat(bars, self.rows)
        off = np.abs(points[:, None] - self.centres).max(axis=-1).min(axis=1, initial=np.inf) > JOINED * self.size
        return points[off], bars[off]

    @cached_property
    def outline(self) -> Array:
        return np.concatenate([self.centres, self._uncovered[0]])

    @property
    def outline_links(self) -> Numbers:
        return np.concatenate([self.links, self._uncovered[1]])

    @property
    def reach(self) -> float:
        spheres = float(np.linalg.norm(self.centres, axis=1).max()) + self.radius
        half = self.diameter / 2 if self.bars.round else math.hypot(*self.thicknesses) / 2
        return max(spheres, float(np.linalg.norm(self.bars.ends, axis=2).max()) + half)

    @cached_property
    def smallest_effective_mass(self) -> float:
        """Smallest effective mass of the body over all spheres' centres and all directions [kg]."""
        return smallest_effective_mass(self.mass, self.inertia, self.centres)


@dataclass(frozen=True)
class Mixture:
    """Kinds of bodies of a pile without smarticles, K in all, and the kind of each of its N bodies.

    Bodies are numbered in the order in which they are poured.
    """

    kinds: tuple[Kind, ...]
    of: Numbers = field(repr=False)  #: (N,) index in `kinds` for each body

    def mean(self, values: Sequence[float], kinds: Numbers | None = None) -> float:
        """Return the mean over bodies of a quantity that each kind has; NaN without bodies.

        `values` (K,) are those of the kinds, `kinds` (n,) the kinds of the bodies; None: all bodies of the pile.
        """
        each = np.array(values)[self.of if kinds is None else kinds]
        return float(each.mean()) if len(each) else float("nan")

    @property
    def flexible(self) -> bool:
        """Whether the bodies are filaments; a pile has only filaments, only linkages, or only rigid bodies."""
        return self.kinds[0].filament is not None

    @property
    def jointed(self) -> bool:
        """Whether the bodies are linkages."""
        return self.kinds[0].linkage is not None

    @property
    def bends(self) -> bool:
        """Whether the bodies change their shape: filaments or linkages."""
        return self.kinds[0].bends

    @cached_property
    def pieces(self) -> Mixture:
        """The links of all kinds of linkages, kind by kind, as kinds of their own."""
        return Mixture(tuple(piece for kind in self.kinds for piece in kind.pieces), np.zeros(0, np.int64))

    @cached_property
    def masses(self) -> Array:
        """(K,) mass of a body of each kind [kg]."""
        return np.array([kind.mass for kind in self.kinds])

    @cached_property
    def volumes(self) -> Array:
        """(K,) solid volume of a body of each kind [m³]."""
        return np.array([kind.volume for kind in self.kinds])

    @cached_property
    def inertias(self) -> Array:
        """(K, 3) principal moments of inertia of a body of each kind [kg m²]."""
        return np.array([kind.inertia for kind in self.kinds])

    @cached_property
    def sizes(self) -> Numbers:
        """(K,) number of bars of a body of each kind."""
        return np.array([len(kind.bars.points) for kind in self.kinds], dtype=np.int64)

    @cached_property
    def ends(self) -> Array:
        """(B, 2, 3) both ends of the bars of one body of each kind, in the body's frame [m].

        B is the sum of `sizes`; the bars of the first kind come first.
        """
        return np.concatenate([kind.bars.ends for kind in self.kinds])

    @cached_property
    def normals(self) -> Array:
        """(B, 3) normals of the bars of `ends`, in the body frame; zeros where the section is round [1]."""
        return np.concatenate([(not kind.bars.round) * kind.bars.frames[:, :, 2] for kind in self.kinds])

    @property
    def mass(self) -> float:
        """Mean mass of the bodies [kg]."""
        return self.mean(list(self.masses))

    @property
    def volume(self) -> float:
        """Mean solid volume of the bodies [m³]."""
        return self.mean(list(self.volumes))

    @property
    def size(self) -> float:
        """Length of the longest bar of any kind [m]."""
        return max(kind.size for kind in self.kinds)

    @property
    def thicknesses(self) -> tuple[float, float]:
        """Smallest thickness along the normal, and smallest thickness in the plane, of all kinds [m]."""
        normal, in_plane = np.min([kind.thicknesses for kind in self.kinds], axis=0).tolist()
        return normal, in_plane

    @property
    def radius(self) -> float:
        """Radius of the largest spheres of all kinds [m]."""
        return max(kind.radius for kind in self.kinds)

    @property
    def diameter(self) -> float:
        """Smallest diameter of the spheres, or strands, of all kinds [m]."""
        return min(kind.diameter for kind in self.kinds)

    @property
    def reach(self) -> float:
        """Largest distance of a point of any body from the centre of mass of this body [m]."""
        return max(kind.reach for kind in self.kinds)

    @cached_property
    def radii(self) -> Array:
        """(K,) radii of the spheres, or strands, of each kind [m]."""
        return np.array([kind.radius for kind in self.kinds])

    @cached_property
    def spreads(self) -> Array:
        """(K,) distance of the outermost rows from the axis of a bar of each kind, along its normal [m]."""
        return np.array([kind.spread for kind in self.kinds])

    @cached_property
    def outlines(self) -> Array:
        """(K, P, 3) points `Kind.outline` of each kind in its frame [m]; shorter rows repeat the last point."""
        return padded([kind.outline for kind in self.kinds])

    @cached_property
    def spheres(self) -> Array:
        """(K, S, 3) centres of the spheres of each kind in its frame [m]; shorter rows repeat the last sphere."""
        return padded([kind.centres for kind in self.kinds])


def bodies_of(model: Particle | Mixture) -> tuple[Particle | Kind, ...]:
    """Return one body of each kind: the smarticle, or the kinds of a mixture."""
    return (model,) if isinstance(model, Particle) else model.kinds


def body_of(model: Particle | Mixture, kinds: Sequence[int] | Numbers, number: int) -> Particle | Kind:
    """Return the smarticle or, in a mixture, the kind of body `number`; `kinds` (N,) are those of all."""
    return model if isinstance(model, Particle) else model.kinds[kinds[number]]


def padded(rows: Sequence[Array]) -> Array:
    """Return k arrays of different lengths as one array (k, n, …), where n is the largest length.

    Shorter arrays are filled up with their last item. All arrays must have at least one item.
    """
    longest = max(map(len, rows))
    return np.array([row[np.minimum(np.arange(longest), len(row) - 1)] for row in rows])
