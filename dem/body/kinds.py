"""Kinds of bodies in a pile, with the spheres that represent them, and the kind of each body."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from dem.arrays import Array, Numbers
from dem.body.bars import Bars
from dem.body.filament import Filament
from dem.body.linkage import Linkage
from dem.body.particle import HINGE_CLEARANCE, Particle, smallest_effective_mass


class Body(Protocol):
    """What a smarticle and a kind of other bodies have in common. SI throughout."""

    @property
    def filament(self) -> Filament | None:
        """What a filament is made of; None: it is no filament."""

    @property
    def linkage(self) -> Linkage | None:
        """Links and joints of a linkage; None: it is no linkage."""

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
        """Length of the longest bar [m]; of a smarticle that of its middle link, w."""

    @property
    def thicknesses(self) -> tuple[float, float]:
        """Thickness along the normal and in the plane [m]."""

    @property
    def centres(self) -> Array:
        """(S, 3) centres of the spheres in the body's frame [m]."""

    @property
    def radius(self) -> float:
        """Radius of the spheres [m]."""

    @property
    def reach(self) -> float:
        """Largest distance of any material point, bars or spheres, from the centre of mass [m]."""


@dataclass(frozen=True, kw_only=True)
class Kind:
    """One kind of body: its bars, and the spheres that represent them in contacts."""

    name: str
    bars: Bars
    rows: int  #: Rows of spheres, or strands, side by side along the normal of each bar; 1 for a round section
    diameter: float  #: Of a sphere, or strand [m]
    pitch: float  #: Largest distance of neighbouring spheres along a bar [m]
    #: What the body is made of if it is a filament; its bars are then its segments as they are poured
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
        """Mass [kg]."""
        return self.bars.mass

    @property
    def inertia(self) -> Array:
        """(3,) principal moments about the centre of mass [kg m²]."""
        return self.bars.inertia

    @property
    def volume(self) -> float:
        """Sum of the bars' volumes [m³]."""
        return self.bars.volume

    @cached_property
    def size(self) -> float:
        """Length of the longest bar [m]."""
        return float(self.bars.lengths.max())

    @cached_property
    def length(self) -> float:
        """Sum of the bars' lengths [m]."""
        return float(self.bars.lengths.sum())

    @property
    def thicknesses(self) -> tuple[float, float]:
        """Thickness along the normal and in the plane [m]."""
        return self.bars.thickness_normal, self.bars.thickness_in_plane

    @property
    def radius(self) -> float:
        """Radius of the spheres [m]."""
        return self.diameter / 2

    def _stations(self, bar: int) -> Array:
        """Return (n,) distances of a bar's spheres from its start [m].

        A joint has a sphere of the bar that owns it; other bars begin a diameter and `HINGE_CLEARANCE` away. The last
        sphere's surface is the tip of a free end. Source: `dem.body.particle.Particle`.
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

    @cached_property
    def _layout(self) -> tuple[Array, Numbers]:
        bars, centres, links = self.bars, [], []
        reach = bars.thickness_normal / 2 - self.radius if self.rows > 1 else 0.0
        for k, (ends, frame) in enumerate(zip(bars.ends, bars.frames, strict=True)):
            for station in self._stations(k):
                for offset in np.linspace(-reach, reach, self.rows) if self.rows > 1 else (0.0,):
                    centres.append(ends[0] + station * frame[:, 0] + offset * frame[:, 2])
                    links.append(k)
        return np.array(centres), np.array(links, dtype=np.int64)

    @property
    def centres(self) -> Array:
        """(S, 3) centres of the spheres in the body's frame [m]."""
        return self._layout[0]

    @property
    def links(self) -> Numbers:
        """(S,) bar of each sphere."""
        return self._layout[1]

    @property
    def reach(self) -> float:
        """Largest distance of any material point, bars or spheres, from the centre of mass [m]."""
        spheres = float(np.linalg.norm(self.centres, axis=1).max()) + self.radius
        half = self.diameter / 2 if self.bars.round else math.hypot(*self.thicknesses) / 2
        return max(spheres, float(np.linalg.norm(self.bars.ends, axis=2).max()) + half)

    @cached_property
    def smallest_effective_mass(self) -> float:
        """Smallest effective mass of the body at any sphere's centre, in any direction [kg]."""
        return smallest_effective_mass(self.mass, self.inertia, self.centres)


@dataclass(frozen=True)
class Mixture:
    """The kinds of bodies of a pile that are no smarticles, and which kind each body is, in the order of pouring."""

    kinds: tuple[Kind, ...]
    of: Numbers = field(repr=False)  #: (N,) number of each body's kind

    def mean(self, values: Sequence[float], kinds: Numbers | None = None) -> float:
        """Return the mean of a number of each kind over all bodies, or over bodies of `kinds` (n,)."""
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

    @cached_property
    def pieces(self) -> Mixture:
        """The links of all kinds of linkages, kind by kind, as kinds of their own."""
        return Mixture(tuple(piece for kind in self.kinds for piece in kind.pieces), np.zeros(0, np.int64))

    @cached_property
    def masses(self) -> Array:
        """(K,) of the kinds [kg]."""
        return np.array([kind.mass for kind in self.kinds])

    @cached_property
    def volumes(self) -> Array:
        """(K,) of the kinds [m³]."""
        return np.array([kind.volume for kind in self.kinds])

    @cached_property
    def inertias(self) -> Array:
        """(K, 3) principal moments of the kinds [kg m²]."""
        return np.array([kind.inertia for kind in self.kinds])

    @cached_property
    def sizes(self) -> Numbers:
        """(K,) numbers of bars of the kinds."""
        return np.array([len(kind.bars.points) for kind in self.kinds], dtype=np.int64)

    @cached_property
    def ends(self) -> Array:
        """(B, 2, 3) both ends of all bars of all kinds, in the frames of the kinds [m]."""
        return np.concatenate([kind.bars.ends for kind in self.kinds])

    @cached_property
    def normals(self) -> Array:
        """(B, 3) normals of all bars of all kinds, in the frames of the kinds; zeros where the section is round [1]."""
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
        """Length of the longest bar of all kinds [m]."""
        return max(kind.size for kind in self.kinds)

    @property
    def thicknesses(self) -> tuple[float, float]:
        """Smallest thickness along the normal and in the plane of all kinds [m]."""
        normal, in_plane = np.min([kind.thicknesses for kind in self.kinds], axis=0).tolist()
        return normal, in_plane

    @property
    def radius(self) -> float:
        """Radius of the thickest spheres [m]."""
        return max(kind.radius for kind in self.kinds)

    @property
    def diameter(self) -> float:
        """Diameter of the thinnest spheres, or strands, to which all overlaps refer [m]."""
        return min(kind.diameter for kind in self.kinds)

    @property
    def reach(self) -> float:
        """Largest distance of any material point from the centre of mass of its body [m]."""
        return max(kind.reach for kind in self.kinds)

    @cached_property
    def spheres(self) -> Array:
        """(K, S, 3) centres of the spheres of each kind in its frame [m]; the last sphere fills up the rows."""
        return padded([kind.centres for kind in self.kinds])


def bodies_of(model: Particle | Mixture) -> tuple[Particle | Kind, ...]:
    """Return one body of each kind."""
    return (model,) if isinstance(model, Particle) else model.kinds


def body_of(model: Particle | Mixture, kinds: Sequence[int] | Numbers, number: int) -> Particle | Kind:
    """Return what the body of a number is, given the kinds of all bodies of a mixture."""
    return model if isinstance(model, Particle) else model.kinds[kinds[number]]


def padded(rows: Sequence[Array]) -> Array:
    """Return arrays (n, …) of different lengths as one, each filled up with its last item."""
    longest = max(map(len, rows))
    return np.array([row[np.minimum(np.arange(longest), len(row) - 1)] for row in rows])
