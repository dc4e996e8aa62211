"""What engines see of smarticles in place of their boxes: chains of spheres, or strands that a sphere sweeps.

Frames hold the centrelines alone. Where each sphere is follows from them, from the chain's rows and pitch, and, of
several rows, from the plane of the smarticle; a straight smarticle has none, and some plane through it is taken.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from postprocess.geometry.links import Floats, link_lengths, plane_frames, swept_axes

# `dem.body.particle.HINGE_CLEARANCE` and `INWARDS`; a test holds the two places together.
_CLEARANCE, _INWARDS = 0.01, math.radians(15)


@dataclass(frozen=True, kw_only=True)
class Chain:
    """How spheres stand for a smarticle.

    Attributes:
        diameter: Of the spheres [m].
        rows: Rows, or strands, side by side along the smarticle's normal.
        width: Of the rows together, along the normal [m].
        pitch: Largest distance of neighbouring centres along a link [m]; 0: spheres are swept along the links.
        bulge: By how much the middle link is thicker than the barbs, to either side in the plane [m]; not of what is
            swept.
    """

    diameter: float
    rows: int
    width: float
    pitch: float
    bulge: float = 0.0

    @property
    def _offsets(self) -> Floats:
        reach = (self.width - self.diameter) / 2 if self.rows > 1 else 0.0
        return np.linspace(-reach, reach, self.rows) if self.rows > 1 else np.zeros(1)


def strands(vertices: Floats, chain: Chain) -> Floats:
    """What a sphere is swept along: (N, R, 4, 3) [m] for (N, 4, 3) [m] vertices and R strands."""
    return _side_by_side(swept_axes(vertices, chain.diameter), vertices, chain)


def spheres(vertices: Floats, chain: Chain) -> Floats:
    """Centres of the spheres: (N, S, 3) [m] for (N, 4, 3) [m] vertices.

    Source:
        `dem.body.particle`: the hinges' spheres belong to the middle link; a barb's begin a diameter and a little from
        there, and end where the last one's surface is the tip; a thicker middle link has rows beside each other.
    """
    lengths = link_lengths(vertices).mean(axis=0)
    parts = []
    for link, (start, end) in enumerate(((1, 0), (1, 2), (2, 3))):
        along = vertices[:, end] - vertices[:, start]
        along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
        stations = _stations(float(lengths[link]), chain, middle=link == 1, barbs=bool(lengths[[0, 2]].any()))
        points = vertices[:, start, None] + stations[:, None] * along[:, None]
        if link == 1 and chain.bulge:
            across = np.cross(plane_frames(vertices)[:, 2], along)[:, None]
            parts += [points + side * across for side in _sides(chain)]
        else:
            parts.append(points)
    return _side_by_side(np.concatenate(parts, axis=1), vertices, chain).reshape(len(vertices), -1, 3)


def _side_by_side(points: Floats, vertices: Floats, chain: Chain) -> Floats:
    """Points (N, P, 3) of smarticles once per row: (N, R, P, 3)."""
    if chain.rows == 1:
        return points[:, None]
    normals = plane_frames(vertices)[:, 2]
    shifted: Floats = points[:, None] + (chain._offsets[:, None] * normals[:, None])[:, :, None]
    return shifted


def _sides(chain: Chain) -> Floats:
    """Offsets of a thicker middle link's rows in the plane [m]."""
    return np.linspace(-chain.bulge, chain.bulge, 2 * math.ceil(chain.bulge / chain.diameter) + 1)


def _stations(length: float, chain: Chain, *, middle: bool, barbs: bool) -> Floats:
    """Distances of the centres along a link from its hinge [m]."""
    if middle:
        inset = 0.0 if barbs else chain.diameter / 2
        start, end = inset, length - inset
    else:
        start, end = chain.diameter * (1 + _CLEARANCE), length - chain.diameter / 2
        if chain.bulge:
            start = (chain.bulge + start) / math.cos(_INWARDS)
        if end <= 0:
            return np.empty(0)
        if end <= start:
            return np.array([end])
    return np.linspace(start, end, max(2, math.ceil((end - start) / chain.pitch - 1e-9) + 1))
