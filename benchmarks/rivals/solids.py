"""The parts that smarticles have in contact, at given poses of their links: boxes, strands, spheres."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from benchmarks.rivals.overlap import Bars, Solid, Swept
from dem.body.particle import LINKS, Boxes, Particle
from dem.engine.links.shape import shape_of

Array = NDArray[np.float64]

SHAPES = ("boxes", "strands", "spheres")


def solid_of(shape: str, particle: Particle, positions: Array, frames: Array) -> Solid:
    """What an engine keeps apart, at one instant.

    Args:
        shape: one of `SHAPES`: the paper's boxes, what the links engine sweeps, or what YADE and LAMMPS are told.
        particle: one smarticle, with the spheres and strands of its fidelity.
        positions: (N, 3, 3) centres of the links [m].
        frames: (N, 3, 3, 3) their axes as columns: along the link, in the plane, normal [1].
    """
    parts: Mapping[str, Callable[[Particle, Array, Array], Solid]]
    parts = {"boxes": _boxes, "strands": _strands, "spheres": _spheres}
    return parts[shape](particle, positions, frames)


def halves_of(boxes: Boxes) -> Array:
    """(3, 3) half the sides of the links, along the axes of their frames [m]."""
    sections = np.tile([boxes.thickness_in_plane, boxes.thickness_normal], (LINKS, 1))
    return np.column_stack([boxes.lengths, sections]) / 2


def _boxes(particle: Particle, positions: Array, frames: Array) -> Bars:
    count = len(positions)
    halves = np.tile(halves_of(particle.boxes), (count, 1))
    return Bars(positions.reshape(-1, 3), frames.reshape(-1, 3, 3), halves, np.repeat(np.arange(count), LINKS))


def _strands(particle: Particle, positions: Array, frames: Array) -> Swept:
    """As `dem.engine.links.shape` describes them: barbs begin at the hinge and end a radius before the tip."""
    shape = shape_of(particle)
    spans = {0: (-shape.arm, shape.tip - shape.arm), 1: (-shape.end, shape.end), 2: (-shape.arm, shape.tip - shape.arm)}
    ends: tuple[list[Array], list[Array]] = ([], [])
    for link in shape.kinds:
        for offset in shape.offsets:
            for kept, along in zip(ends, spans[int(link)], strict=True):
                kept.append(positions[:, link] + along * frames[:, link, :, 0] + offset * frames[:, link, :, 2])
    starts, stops = (np.concatenate(kept) for kept in ends)
    owners = np.tile(np.arange(len(positions)), len(starts) // len(positions))
    return Swept(starts, stops, shape.radius, owners)


def _spheres(particle: Particle, positions: Array, frames: Array) -> Swept:
    turned = np.einsum("nsij,sj->nsi", frames[:, particle.links], particle.local_centres)
    centres = (positions[:, particle.links] + turned).reshape(-1, 3)
    owners = np.repeat(np.arange(len(positions)), len(particle.links))
    return Swept(centres, centres, particle.radius, owners)
