"""A chain of interlocked smarticles: its layout, and whether it has parted.

⊔-⊓-⊔: every second smarticle is turned by half a turn, and neighbouring barbs hook into each other. The chain lies
along x, its middle at the origin. Source: Savoie et al., Soft Matter 2023, "Robophysical experiment".
"""

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
    """Point of a link at which a string is tied."""

    smarticle: int  #: Number of the smarticle
    link: int  #: 0 barb 1, 2 barb 2
    along: float  #: Distance from the link's centre towards its tip [m]


@dataclass(frozen=True)
class Chain:
    """Layout of a chain of `count` U shapes, whose hooked barbs are `gap` apart. Lengths in m."""

    particle: Particle
    count: int
    gap: float

    @property
    def offset(self) -> float:
        """Distance in y [m] between the centrelines of the two rows of middle links.

        Between the barb tips of one row and the middle links of the other row is a gap of `gap`.
        """
        return self.particle.boxes.barb_length + self.gap + self._half

    @property
    def _half(self) -> float:
        """Half the thickness of a middle link in the plane [m]."""
        return self.particle.boxes.bulge + self.particle.radius

    @property
    def width(self) -> float:
        """Width h of the chain across its axis, including the thickness of the links [m]."""
        return self.offset + 2 * self._half

    @property
    def step(self) -> float:
        """Distance in x [m] between the centres of neighbouring middle links."""
        return self.particle.boxes.middle_length - 2 * self.particle.radius - self.gap

    @property
    def length(self) -> float:
        """Distance in x [m] between the two points at which strings are tied."""
        return (self.count - 1) * self.step + self.particle.boxes.middle_length

    def poses(self) -> Poses:
        """Return the poses of all smarticles, in their order along x."""
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
        """Return where strings are tied to the outer barbs: at the tips, or at the chain's axis."""
        half = self.particle.boxes.barb_length / 2
        along = half - self.particle.radius if tied_at == "tip" else self.offset / 2 - half
        last = self.count - 1
        return Tie(0, 0, along), Tie(last, 0 if last % 2 else 2, along)


def parted(state: State, diameter: float) -> bool:
    """Return whether a line across the chain separates two neighbours; `diameter`: links' thickness [m]."""
    along = _corners(state)[..., 0]
    return bool((along[:-1].max(axis=1) + diameter < along[1:].min(axis=1)).any())


def extent(state: State, diameter: float) -> float:
    """Return the present width [m] of a chain across its axis, with the links' thickness, `diameter` [m]."""
    across = _corners(state)[..., 1]
    return float(np.ptp(across) + diameter)


def _corners(state: State) -> Array:
    """Return (N, V, 3) ends of the axes of each smarticle's links, or rows of spheres [m].

    They are the barb tips and the hinges (V = 4). If the middle link is thicker than the barbs, the ends of its two
    outermost rows of spheres are added (V = 8).
    """
    bulge, vertices = state.boxes.bulge, state.vertices
    if not bulge:
        return vertices
    across = bulge * state.link_rotations[:, None, 1, :, 1]
    hinges = vertices[:, 1:3]
    return np.concatenate([vertices, hinges - across, hinges + across], axis=1)
