"""Compute the packing fraction of a pile in a cylinder, by one of several named definitions.

Values by two definitions differ by several per cent, so each result names its definition. A pile has the radius of its
container, unless the scene states another radius with `container.packing_radius_m`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.packing import filled
from dem.record.run import Run
from postprocess.geometry.bars import body_volumes
from postprocess.geometry.links import UndefinedMeasureError, Vertices, checked_vertices
from postprocess.geometry.voronoi import local_packing
from postprocess.geometry.voxel import Region, solid_fraction
from postprocess.measures.heights import frame_heights, heights, material_height
from postprocess.measures.pile import why_no_pile
from postprocess.measures.registry import FrameMeasure, Quantity, Shown, any_in_space, in_space

DEFINITIONS: Mapping[str, str] = MappingProxyType(
    {
        "second-highest-com": ("N V_s / (π r² z), z = second-highest smarticle centre of mass above the floor"),
        "top-percentile": ("N V_s / (π r² h), 95 % of the links' material lies below h above the floor"),
        "voxel": ("share of the inner cylinder (0.75 r, 20 % to 80 % of the height) inside the true boxes"),
        "voronoi": ("V_s over the mean set-Voronoi cell of the smarticles centred in the inner cylinder"),
    }
)
"""Definitions of the packing fraction by name, with their meanings."""

COSTLY_DEFINITIONS = frozenset({"voxel", "voronoi"})
"""Definitions that take tenths of a second or more per frame; the others take milliseconds."""


@dataclass(frozen=True, kw_only=True)
class PackingFraction:
    """A packing fraction with its definition."""

    value: float  #: Volume of the smarticles over the volume that they occupy [-]
    definition: str  #: Key of `DEFINITIONS`
    height: float  #: Height of the pile above the floor by this definition [m]


def packing_fraction(
    vertices: Vertices,
    *,
    radius: float,
    solid_volume: float,
    definition: str = "second-highest-com",
    floor_z: float = 0.0,
    thickness_normal: float | None = None,
    thickness_in_plane: float | None = None,
) -> PackingFraction:
    """Compute the packing fraction of smarticles in an upright cylinder around x = y = 0.

    Args:
        vertices: (N, 4, 3) [m].
        radius: Radius of the container [m].
        solid_volume: Volume of one smarticle [m³].
        definition: Key of `DEFINITIONS`.
        floor_z: Height of the container's floor [m].
        thickness_normal: t1, along the normal of the smarticle's plane [m]; "voxel" only.
        thickness_in_plane: t2, in the smarticle's plane [m]; "voxel" only.

    Raises:
        InputError: Unknown definition, bad sizes, or missing thicknesses.
        UndefinedMeasureError: Fewer than two smarticles, no height above the floor, or no smarticle in the inner
            cylinder of "voxel" and "voronoi".

    Source:
        "second-highest-com": wsavoie/SmarticleSim, without the factor (0.0234/0.0224)² = 1.091
        that one of its scripts applies. "voronoi": see `postprocess.geometry.voronoi`.

    Example:
        >>> from postprocess import read_frames
        >>> frame = read_frames("runs/pile")[-1]
        >>> result = packing_fraction(frame.vertices, radius=0.0234, solid_volume=1.783e-8, floor_z=frame.floor_z)
        >>> round(result.value, 3), result.definition
        (0.132, 'second-highest-com')
    """
    vertices = checked_vertices(vertices)
    if definition not in DEFINITIONS:
        raise InputError(f"unknown definition of the packing fraction '{definition}': {list(DEFINITIONS)}")
    for name, size, unit in (("radius", radius, "m"), ("solid_volume", solid_volume, "m³")):
        if not (math.isfinite(size) and size > 0):
            raise InputError(f"{name} must be above 0 {unit}: got {size} {unit}")
    if len(vertices) < 2:
        raise UndefinedMeasureError(f"a packing fraction needs at least 2 smarticles: got {len(vertices)}")
    if definition == "second-highest-com":
        height = heights(vertices, floor_z=floor_z).second_highest_com
    else:
        height = material_height(vertices, floor_z=floor_z)
    if not height > 0:
        raise UndefinedMeasureError(f"the pile has no height above its floor: {height:g} m; check floor_z")
    pile = Region(radius=radius, bottom=floor_z, top=floor_z + height)
    if definition == "voxel":
        if thickness_normal is None or thickness_in_plane is None:
            raise InputError("definition 'voxel' needs thickness_normal and thickness_in_plane [m]: got None")
        value = solid_fraction(
            vertices, pile.inner, thickness_normal=thickness_normal, thickness_in_plane=thickness_in_plane
        )
    elif definition == "voronoi":
        value = local_packing(vertices, pile, pile.inner, solid_volume=solid_volume)[0]
    else:
        value = filled(len(vertices), solid_volume=solid_volume, radius=radius, height=pile.top - pile.bottom)
    return PackingFraction(value=value, definition=definition, height=height)


def packing_of(frame: Frame, run: Run, *, definition: str) -> float:
    """Return the packing fraction [-] of a frame by a key of `DEFINITIONS`; NaN if it is undefined.

    It is undefined where `why_no_pile` has a reason, and for a pile without height.
    """
    if why_no_pile(frame, run):
        return math.nan
    # The costly definitions use an inner cylinder, to which a corrected radius does not apply.
    radius = run.manifest.container_radius_m if definition in COSTLY_DEFINITIONS else run.manifest.measured_radius_m
    if frame.bars is not None:
        return _packing_of_bars(frame, run, definition=definition, radius=radius)
    try:
        return packing_fraction(
            frame.vertices,
            radius=radius,
            solid_volume=run.manifest.solid_volume_m3,
            definition=definition,
            floor_z=frame.floor_z,
            thickness_normal=run.manifest.thickness_normal_m,
            thickness_in_plane=run.manifest.thickness_in_plane_m,
        ).value
    except UndefinedMeasureError:
        return math.nan


def _packing_of_bars(frame: Frame, run: Run, *, definition: str, radius: float) -> float:
    """Return the packing fraction [-] of bodies that are no smarticles; NaN if it is undefined.

    `definition` is a key of `DEFINITIONS`; `radius` is that of the cylinder [m].
    """
    if definition in COSTLY_DEFINITIONS:
        return math.nan
    levels = frame_heights(frame, run)
    height = levels.second_highest_com if definition == "second-highest-com" else levels.top
    if not height > 0:
        return math.nan
    return float(body_volumes(frame, run).sum() / (math.pi * radius**2 * height))


def _packing(definition: str, frame: Frame, run: Run) -> tuple[float]:
    return (packing_of(frame, run, definition=definition),)


HEADINGS: Mapping[str, str] = MappingProxyType(
    {"second-highest-com": "φ", "top-percentile": "φ top 95 %", "voxel": "φ voxel", "voronoi": "φ Voronoi"}
)
"""Headings of the definitions in short tables; the first is the one that experiments use."""

# Short tables show the error of the first definition alone.
_SHOWN = {
    name: Shown(heading=HEADINGS[name], place=10 + place, form=".4f", with_error=place == 0)
    for place, name in enumerate(DEFINITIONS)
}

MEASURES = tuple(
    FrameMeasure(
        name=f"phi {definition}",
        place=70,
        quantities=(Quantity(f"phi {definition}", "-", _SHOWN[definition]),),
        take=partial(_packing, definition),
        available_for=in_space if definition in COSTLY_DEFINITIONS else any_in_space,
        definition=definition,
        costly=definition in COSTLY_DEFINITIONS,
    )
    for definition in DEFINITIONS
)
