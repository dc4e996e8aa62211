"""Write a run as one GSD file for OVITO and HOOMD-blue, with its links as capsules.

The capsules, or strands, are those by which the engine represents links in contacts; a link may consist of several side
by side. Of a sphere chain they are its envelope. GSD stores a capsule as a polyhedron of two vertices with a rounding
radius. Capsules share the mass and the inertia of their link. Angular momenta are quaternions, as HOOMD-blue defines
them. Poses of whole bodies are in `log/bodies/NAME`.

Source:
    https://gsd.readthedocs.io/en/stable/schema-hoomd.html and shapes.html. OVITO draws such polyhedra as capsules:
    https://www.ovito.org/manual/reference/file_formats/input/gsd.html
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.bodies.fields import Field, link_values
from postprocess.geometry.links import Floats, Whole
from postprocess.measures.contacts import strands_of

_NAMES: tuple[str, ...] = ("barb 1", "middle link", "barb 2")
_OF_BODIES = (
    "position_m", "orientation", "velocity_m_per_s", "angular_velocity_rad_per_s", "mass_kg", "moment_of_inertia_kg_m2",
    "kind",
)  # fmt: skip


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


@dataclass(frozen=True, kw_only=True)
class CapsuleMotion:
    """Poses, masses and motion of P capsules, in frames with z along the capsule and y along the link's normal."""

    orientation: Floats  #: (P, 4) unit quaternions, real part first [1]
    velocity: Floats  #: (P, 3) [m/s]
    mass: Floats  #: (P,) mass of the link over its number of capsules [kg]
    moment_inertia: Floats  #: (P, 3) principal moments of the link over its number of capsules [kg m²]
    angmom: Floats  #: (P, 4) 2 q S, with the orientation q and the angular momentum S in the own frame [kg m²/s]


def motion_of(capsules: Capsules, frame: Frame) -> CapsuleMotion:
    """Return poses, masses and motion of the capsules of a frame, see `RecordedPoses`."""
    links = frame.links
    link = np.searchsorted(links.body, capsules.body) + capsules.link
    share = 1 / np.bincount(link, minlength=len(links))[link]
    cycle = [1, 2, 0]  # axes of a link, along which x, y and z of a capsule are
    turns = Rotation.from_matrix(links.rotation[link][:, :, cycle])
    spins = links.spin_kg_m2_per_s[link][:, cycle] * share[:, None]
    quaternions = turns.as_quat(scalar_first=True)
    real, vector = quaternions[:, :1], quaternions[:, 1:]
    products = np.column_stack([-(vector * spins).sum(axis=1), real * spins + np.cross(vector, spins)])
    return CapsuleMotion(
        orientation=quaternions,
        velocity=links.velocity_m_per_s[link],
        mass=links.mass_kg[link] * share,
        moment_inertia=links.moment_of_inertia_kg_m2[link][:, cycle] * share[:, None],
        angmom=2 * products,
    )


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
            motion = motion_of(capsules, frame)
            for name in ("orientation", "velocity", "mass", "moment_inertia", "angmom"):
                setattr(particles, name, getattr(motion, name))
            particles.diameter = 2 * capsules.radii[capsules.type_of]
            particles.body = frame.smarticle_ids[capsules.body]
            made.log = {"time_s": np.array([frame.time]), "phase": np.array([frame.phase])}
            made.log |= {f"bodies/{name}": getattr(frame.bodies, name) for name in _OF_BODIES}
            for field in fields:
                values = link_values(field, frame, run)
                if values is not None:
                    made.log[f"particles/{field.name}"] = np.asarray(values)[capsules.body, capsules.link]
            file.append(made)
            written += 1
    return written
