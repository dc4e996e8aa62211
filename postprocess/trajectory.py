"""Write a run as one GSD file for OVITO and HOOMD-blue, with its links as capsules.

The capsules, or strands, are those by which the engine represents links in contacts; a link may consist of several side
by side. Of a sphere chain they are its envelope. GSD stores a capsule as a polyhedron of two vertices with a rounding
radius.

Source:
    https://gsd.readthedocs.io/en/stable/schema-hoomd.html and shapes.html. OVITO draws such polyhedra as capsules:
    https://www.ovito.org/manual/reference/file_formats/input/gsd.html
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.bodies.fields import BY_NAME, Field, link_values
from postprocess.geometry.links import Floats, Whole
from postprocess.measures.contacts import strands_of

_NAMES: tuple[str, ...] = ("barb 1", "middle link", "barb 2")


@dataclass(frozen=True, kw_only=True)
class Capsules:
    """P capsules (cylinders with round ends) of a frame; capsules of one type have equal sizes."""

    ends: Floats  #: (P, 2, 3) ends of the axes [m]
    body: Whole  #: (P,) index of the body in the frame
    link: Whole  #: (P,) number of the link in the body
    types: Sequence[str]  #: Names of all types
    type_of: Whole  #: (P,) type of each capsule, a place in `types`
    radii: Floats  #: (types,) radius of the capsules of each type [m]


def capsules_of(frame: Frame, run: Run) -> Capsules:
    """Return the capsules of all links, or bars, of a frame, see `dem.engine.links.shapes`."""
    found, kinds = strands_of(frame, run), run.manifest.kinds
    if kinds is None:
        types, first, radii = _NAMES, np.zeros(1, np.int64), np.full(len(_NAMES), run.manifest.sphere_diameter_m / 2)
    else:
        types = tuple(f"{k} {kind.shape}, bar {j}" for k, kind in enumerate(kinds) for j in range(kind.bars))
        first = np.cumsum([0, *(kind.bars for kind in kinds)])
        radii = np.repeat([kind.sphere_diameter_m / 2 for kind in kinds], np.diff(first))
    type_of = first[frame.kind[found.body]] + found.link
    return Capsules(ends=found.axes, body=found.body, link=found.link, types=types, type_of=type_of, radii=radii)


def orientations(directions: Floats) -> Floats:
    """Return unit quaternions (P, 4), real part first, that turn the z axis along directions (P, 3)."""
    unit = directions / np.maximum(np.linalg.norm(directions, axis=1, keepdims=True), 1e-300)
    unit = np.where(unit[:, 2:] < 0, -unit, unit)  # a capsule has no head
    x, y, z = unit.T
    turned = np.column_stack([1 + z, -y, x, np.zeros_like(z)])
    return np.asarray(turned / np.linalg.norm(turned, axis=1, keepdims=True))


def shapes_of(capsules: Capsules) -> list[dict[str, Any]]:
    """Return the shape of each type as GSD describes it, with the mean length of its capsules.

    Capsules are along z, since OVITO opens no files with polyhedra along other axes; without length they are spheres.
    """
    lengths = np.linalg.norm(capsules.ends[:, 1] - capsules.ends[:, 0], axis=1)
    shapes = []
    for number, radius in enumerate(capsules.radii):
        own = lengths[capsules.type_of == number]
        half = float(own.mean()) / 2 if len(own) else 0.0
        if half > 0:
            vertices = [[0.0, 0.0, -half], [0.0, 0.0, half]]
            shapes.append({"type": "ConvexPolyhedron", "rounding_radius": float(radius), "vertices": vertices})
        else:
            shapes.append({"type": "Sphere", "diameter": 2 * float(radius)})
    return shapes


def write_trajectory(
    path: Path, run: Run, frames: Iterable[tuple[int, Frame]], fields: Sequence[Field], *, first: Iterable[Frame]
) -> int:
    """Write frames of a run as a GSD file, and return their number.

    Positions are those of the run, in metres. The box is as large as the bodies need, and around the origin. Fields are
    written as `log/particles/NAME`. The frames `first` are the same without numbers; they are read first, to find the
    shapes and the size of the box.
    """
    import gsd.hoomd  # noqa: PLC0415 - an extra

    half, most, written = np.zeros(3), 0, 0
    shapes: list[dict[str, Any]] = []
    for frame in first:
        capsules = capsules_of(frame, run)
        if len(capsules.ends) > most:  # earlier frames may lack whole types
            shapes, most = shapes_of(capsules), len(capsules.ends)
        half = np.maximum(half, np.abs(capsules.ends).max(axis=(0, 1)) + capsules.radii.max())
    with gsd.hoomd.open(path, "w") as file:
        for number, frame in frames:
            capsules = capsules_of(frame, run)
            made = gsd.hoomd.Frame()
            made.configuration.step = number
            made.configuration.box = [*(2 * half), 0.0, 0.0, 0.0]
            particles = made.particles
            particles.N = len(capsules.ends)
            particles.types, particles.type_shapes = list(capsules.types), shapes
            particles.typeid = capsules.type_of
            particles.position = capsules.ends.mean(axis=1)
            particles.orientation = orientations(capsules.ends[:, 1] - capsules.ends[:, 0])
            particles.diameter = 2 * capsules.radii[capsules.type_of]
            particles.body = frame.smarticle_ids[capsules.body]
            velocity = np.asarray(link_values(BY_NAME["velocity_m_per_s"], frame, run))
            particles.velocity = velocity[capsules.body, capsules.link]
            made.log = {"time_s": np.array([frame.time]), "phase": np.array([frame.phase])}
            for field in fields:
                values = link_values(field, frame, run)
                if values is not None:
                    made.log[f"particles/{field.name}"] = np.asarray(values)[capsules.body, capsules.link]
            file.append(made)
            written += 1
    return written
