"""Measure the packing fraction φ(r, z) in concentric rings and horizontal layers of a cylinder."""

import math
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from dem.errors import InputError
from dem.record.run import Run
from postprocess.geometry.links import Floats, Vertices
from postprocess.geometry.voxel import solid_points


@dataclass(frozen=True, kw_only=True, eq=False)
class PackingProfile:
    """Packing fraction in R rings and Z layers of an upright cylinder; a cell is one ring of one layer."""

    radii: Floats = field(repr=False)  #: (R + 1,) float64 [m], edges of the rings, 0 to the container's radius
    heights: Floats = field(repr=False)  #: (Z + 1,) float64 [m], edges of the layers, from the floor up
    packing: Floats = field(repr=False)  #: (R, Z) float64 [-], fraction of each cell inside the links' boxes
    outside: float  #: Volume of the links' boxes outside all cells [m³]

    @property
    def volumes(self) -> Floats:
        """Volumes of the cells: (R, Z) [m³]."""
        volumes: Floats = math.pi * np.outer(np.diff(self.radii**2), np.diff(self.heights))
        return volumes

    @property
    def solid_volume(self) -> float:
        """Volume of the union of all links' boxes [m³], inside and outside the cells.

        The two boxes at a hinge of a U share the volume t1 t2² / 2; t1 t2 (w + 2l) counts this twice.
        """
        return float((self.packing * self.volumes).sum()) + self.outside


def packing_profile(
    vertices: Vertices,
    *,
    radius: float,
    thickness_normal: float,
    thickness_in_plane: float,
    floor_z: float = 0.0,
    rings: int = 6,
    layer: float | None = None,
    pitch: float | None = None,
) -> PackingProfile:
    """Compute φ(r, z) in an upright cylinder around x = y = 0, by grid points inside the links' boxes.

    Args:
        vertices: (N, 4, 3) [m].
        radius: Radius of the container [m].
        thickness_normal: t1, along the normal of the smarticle's plane [m].
        thickness_in_plane: t2, in the smarticle's plane [m].
        floor_z: Height of the container's floor [m].
        rings: Number of rings, all of one width.
        layer: Thickness of the layers [m]; the width of a ring if not given. The uppermost layer ends above the pile.
        pitch: Spacing of the grid points [m]; half the smaller thickness if not given.

    Raises:
        InputError: A size is not above 0, or the number of rings below 1.
    """
    if not (math.isfinite(radius) and radius > 0 and rings >= 1):
        raise InputError(f"a profile needs a radius above 0 m and 1 ring or more: got {radius} m, {rings} rings")
    layer = radius / rings if layer is None else layer
    if not (math.isfinite(layer) and layer > 0):
        raise InputError(f"layer must be above 0 m: got {layer} m; leave it out for the width of a ring")
    points, pitch = solid_points(
        vertices, thickness_normal=thickness_normal, thickness_in_plane=thickness_in_plane, pitch=pitch
    )
    z = points[:, 2] - floor_z
    layers = max(1, math.ceil(z.max(initial=0.0) / layer))
    radii = np.linspace(0.0, radius, rings + 1)
    heights = layer * np.arange(layers + 1.0)
    found, _, _ = np.histogram2d(np.hypot(points[:, 0], points[:, 1]), z, bins=(radii, heights))
    profile = PackingProfile(
        radii=radii, heights=heights, packing=found, outside=float((len(points) - found.sum()) * pitch**3)
    )
    profile.packing[:] *= pitch**3 / profile.volumes
    return profile


def reject_without_profile(run: Run) -> None:
    """Raise InputError if a run has no φ(r, z): it needs smarticles in one upright cylinder."""
    why = None
    if run.manifest.kinds is not None:
        shapes = ", ".join(sorted({kind.shape for kind in run.manifest.kinds}))
        why = f"needs smarticles: the bodies of this run are of the shape {shapes}"
    elif run.manifest.planar:
        why = "needs one upright cylinder: this run moves in a plane"
    elif run.manifest.container_tiers > 1:
        why = f"needs one upright cylinder: this run has a container of {run.manifest.container_tiers} tiers"
    if why is not None:
        raise InputError(f"{run.path}: φ(r, z) {why}; leave out the profile")


def profile_table(run: Run, *, rings: int = 6, layer: float | None = None) -> pd.DataFrame:
    """Compute φ(r, z) for the last frame of every phase.

    Args:
        run: A run in one cylinder.
        rings: Number of rings.
        layer: Thickness of the layers [m]; the width of a ring if not given.

    Returns:
        A table with one row per phase, ring and layer, and units in its column names.

    Raises:
        InputError: `reject_without_profile`, or `rings` or `layer` are not above 0.
    """
    reject_without_profile(run)
    frames = run.frames
    rows: list[dict[str, object]] = []
    for phase in run.phases:
        part = frames.in_phase(phase.index)
        if not part:
            continue
        frame = part[-1]
        profile = packing_profile(
            frame.vertices,
            radius=run.manifest.container_radius_m,
            thickness_normal=run.manifest.thickness_normal_m,
            thickness_in_plane=run.manifest.thickness_in_plane_m,
            floor_z=frame.floor_z,
            rings=rings,
            layer=layer,
        )
        rows += [
            {
                "run": str(run.path),
                "phase": phase.index,
                "phase type": phase.type,
                "time [s]": frame.time,
                "inner radius [m]": profile.radii[ring],
                "outer radius [m]": profile.radii[ring + 1],
                "bottom [m]": profile.heights[step],
                "top [m]": profile.heights[step + 1],
                "phi voxel [-]": packing,
            }
            for (ring, step), packing in np.ndenumerate(profile.packing)
        ]
    return pd.DataFrame(rows)
