"""Write a run as one GSD file for OVITO and HOOMD-blue: a particle for each strand of each link, a rounded polyhedron.

Strands are the capsules by which the engine represents links in contacts; of a sphere chain they are its envelope.

Sources: https://gsd.readthedocs.io/en/stable/schema-hoomd.html and shapes.html. OVITO draws polyhedra of two vertices
with a rounding radius as capsules: https://www.ovito.org/manual/reference/file_formats/input/gsd.html
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from dem.record.document import Kind
from dem.record.frame import Frame, RecordedBars
from dem.record.run import Run
from postprocess.bodies.fields import BY_NAME, Field, link_values
from postprocess.geometry.links import Floats, Whole, checked_vertices, strands
from postprocess.measures.contacts import chain_of

_JOINED = 1e-6  # of the longest bar: ends of a body that are nearer are one joint
_NAMES = ("barb 1", "middle link", "barb 2")


@dataclass(frozen=True, kw_only=True)
class Capsules:
    """Capsules of a frame, P of them; those of one type have equal sizes."""

    ends: Floats  #: (P, 2, 3) ends of the axes [m]
    body: Whole  #: (P,) index of the body in the frame
    link: Whole  #: (P,) number of the link in the body
    types: Sequence[str]  #: Names of all types
    type_of: Whole  #: (P,) type of each capsule, a place in `types`
    radii: Floats  #: (types,) [m]


def capsules_of(frame: Frame, run: Run) -> Capsules:
    """Return the capsules of all links, or bars, of a frame, see `dem.engine.links.shapes`."""
    if frame.bars is not None:
        return _capsules_of_bars(frame, frame.bars, run)
    chain = chain_of(run)
    axes = strands(checked_vertices(frame.vertices), chain)
    ends = np.stack([axes[:, :, :-1], axes[:, :, 1:]], axis=3)
    body, _, link = np.indices(ends.shape[:3]).reshape(3, -1)
    return Capsules(
        ends=ends.reshape(-1, 2, 3),
        body=body,
        link=link,
        types=_NAMES,
        type_of=link,
        radii=np.full(len(_NAMES), chain.diameter / 2),
    )


def _capsules_of_bars(frame: Frame, bars: RecordedBars, run: Run) -> Capsules:
    kinds, kind = run.manifest.kinds or (), bars.kind[bars.body]
    radius = np.array([each.sphere_diameter_m / 2 for each in kinds])[kind]
    ends = bars.segments.copy()
    along = ends[:, 1] - ends[:, 0]
    lengths = np.linalg.norm(along, axis=1)
    # A free end is a tip, which the surface of the capsule reaches; at joints axes meet.
    free = np.ones(2 * len(ends), dtype=bool)
    near = cKDTree(ends.reshape(-1, 3)).query_pairs(_JOINED * lengths.max(), output_type="ndarray")
    free[near[bars.body[near[:, 0] // 2] == bars.body[near[:, 1] // 2]]] = False
    free &= ~np.repeat(np.array([each.flexible for each in kinds])[kind], 2)
    inset = np.minimum(radius / lengths, 0.5)[:, None, None] * (free.reshape(-1, 2, 1) * along[:, None])
    ends += inset * np.array([1.0, -1.0])[:, None]
    offsets = [_offsets(each, run.scene["fidelity"]["rows"]) for each in kinds]
    own = np.repeat(np.arange(len(ends)), [len(offsets[k]) for k in kind])
    aside = np.concatenate([np.zeros(0), *(offsets[k] for k in kind)])
    names = [(k, j) for k, each in enumerate(kinds) for j in range(each.bars)]
    first = np.cumsum([0, *(each.bars for each in kinds)])
    return Capsules(
        ends=ends[own] + (aside[:, None] * bars.normals[own])[:, None],
        body=bars.body[own],
        link=bars.number[own],
        types=[f"{k} {kinds[k].shape}, bar {j}" for k, j in names],
        type_of=(first[kind] + bars.number)[own],
        radii=np.array([kinds[k].sphere_diameter_m / 2 for k, _ in names]),
    )


def _offsets(kind: Kind, rows: int) -> Floats:
    """Return the offsets of a bar's strands along its normal [m], see `dem.engine.links.shapes.rigid_shape`."""
    reach = (kind.thickness_normal_m - kind.sphere_diameter_m) / 2
    return np.linspace(-reach, reach, rows) if rows > 1 and reach > 0 and not kind.round else np.zeros(1)


def orientations(directions: Floats) -> Floats:
    """Return unit quaternions (P, 4), the real part first, that turn the x axis along the directions (P, 3)."""
    unit = directions / np.maximum(np.linalg.norm(directions, axis=1, keepdims=True), 1e-300)
    unit = np.where(unit[:, :1] < 0, -unit, unit)  # a capsule has no head
    x, y, z = unit.T
    turned = np.column_stack([1 + x, np.zeros_like(x), -z, y])
    return np.asarray(turned / np.linalg.norm(turned, axis=1, keepdims=True))


def shapes_of(capsules: Capsules) -> list[dict[str, Any]]:
    """Return the shape of each type as GSD describes it: along x, the mean of its capsules."""
    lengths = np.linalg.norm(capsules.ends[:, 1] - capsules.ends[:, 0], axis=1)
    shapes = []
    for number, radius in enumerate(capsules.radii):
        own = lengths[capsules.type_of == number]
        half = float(own.mean()) / 2 if len(own) else 0.0
        vertices = [[-half, 0.0, 0.0], [half, 0.0, 0.0]] if half > 0 else [[0.0, 0.0, 0.0]]
        shapes.append({"type": "ConvexPolyhedron", "rounding_radius": float(radius), "vertices": vertices})
    return shapes


def write_trajectory(
    path: Path, run: Run, frames: Iterable[tuple[int, Frame]], fields: Sequence[Field], *, first: Iterable[Frame]
) -> int:
    """Write frames of a run as a GSD file, and return their number.

    Positions are those of the run, in metres. The box is as large as the bodies need, and around the origin.

    Args:
        frames: the frames with their numbers.
        fields: fields to write as `log/particles/NAME`.
        first: the frames once more, read before all others for the size of the box.
    """
    import gsd.hoomd  # noqa: PLC0415 - an extra

    half, written = np.zeros(3), 0
    shapes: list[dict[str, Any]] = []
    for frame in first:
        capsules = capsules_of(frame, run)
        shapes = shapes or shapes_of(capsules)
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
