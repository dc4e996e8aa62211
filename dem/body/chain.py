"""A chain of interlocked smarticles: its layout, and whether it has parted.

⊔-⊓-⊔: every second smarticle is turned by half a turn, and neighbouring barbs hook into each other. The chain lies
along x, its middle at the origin. Source: Savoie et al., Soft Matter 2023, "Robophysical experiment".
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from dem.arrays import Array
from dem.body.particle import Particle
from dem.body.placement import Poses
from dem.body.state import State


@dataclass(frozen=True)
class Tie:
    """Point where a string is tied: smarticle, link, and distance along x from the link's centre [m]."""

    smarticle: int
    link: int
    along: float


@dataclass(frozen=True)
class Chain:
    """Layout of a chain of U shapes with a free distance of neighbours, `gap`. Lengths in m."""

    particle: Particle
    count: int
    gap: float

    @property
    def offset(self) -> float:
        """Distance of the two rows of middle links: the tips of each row are a gap away from the other row's links."""
        return self.particle.boxes.barb_length + self.gap + self._half

    @property
    def _half(self) -> float:
        """Distance of a middle link's faces from its axis."""
        return self.particle.boxes.bulge + self.particle.radius

    @property
    def width(self) -> float:
        """h, the whole width [m]."""
        return self.offset + 2 * self._half

    @property
    def step(self) -> float:
        """Distance of neighbouring middle links along x: their hooked barbs are a gap apart."""
        return self.particle.boxes.middle_length - 2 * self.particle.radius - self.gap

    @property
    def length(self) -> float:
        """Distance along x of the two points where strings are tied."""
        return (self.count - 1) * self.step + self.particle.boxes.middle_length

    def poses(self) -> Poses:
        """Return the poses of the centres of mass."""
        numbers = np.arange(self.count)
        turned = numbers % 2 == 1
        sign = np.where(turned, 1.0, -1.0)
        # From the middle link towards the mouth.
        inwards = -self.particle.boxes.vertices[1, 1]
        across = sign * (self.offset / 2 - inwards)
        along = (numbers - (self.count - 1) / 2) * self.step
        positions = np.stack([along, across, np.zeros(self.count)], axis=1)
        return Poses(positions, tuple(Rotation.from_rotvec([0.0, 0.0, math.pi * half]) for half in turned))

    def ties(self, tied_at: Literal["tip", "axis"]) -> tuple[Tie, Tie]:
        """Return the ties of the strings at the lower and the higher x, on the outer barbs; see `Strain.tied_at`."""
        half = self.particle.boxes.barb_length / 2
        along = half - self.particle.radius if tied_at == "tip" else self.offset / 2 - half
        last = self.count - 1
        return Tie(0, 0, along), Tie(last, 0 if last % 2 else 2, along)


def parted(state: State, diameter: float) -> bool:
    """Return whether a straight line across the chain separates two neighbours, which can then not hook again."""
    places = _corners(state)[..., 0]
    return bool((places[:-1].max(axis=1) + diameter < places[1:].min(axis=1)).any())


def extent(state: State, diameter: float) -> float:
    """Return the width of the chain across its axis, with the links' thickness [m]."""
    places = _corners(state)[..., 1]
    return float(np.ptp(places) + diameter)


def _corners(state: State) -> Array:
    """Return (N, V, 3) tips and hinges, and of thicker middle links the ends of the rows at their faces [m]."""
    bulge, vertices = state.boxes.bulge, state.vertices
    if not bulge:
        return vertices
    across = bulge * state.link_rotations[:, None, 1, :, 1]
    hinges = vertices[:, 1:3]
    return np.concatenate([vertices, hinges - across, hinges + across], axis=1)
