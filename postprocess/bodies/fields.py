"""Fields that every body of a smarticle carries: names, units, meanings, and their values in a frame."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from dem.errors import InputError, nearest
from dem.record.forces import read_forces
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.links import Floats, UndefinedMeasureError, centres_of_mass, link_lengths
from postprocess.geometry.voronoi import local_packing
from postprocess.geometry.voxel import Region
from postprocess.measures.clusters import Clusters, contact_graph, entanglement_clusters
from postprocess.measures.entanglement import link_crossings
from postprocess.measures.force_chains import force_chains
from postprocess.measures.registry import in_space

LINKS = 3

IDENTITY = ("smarticle_id", "link")
"""Fields that are never left out."""

CELLS_PER_LENGTH = 4
"""Points per w along a link for local packing fractions: half as many as the mean's, in a third of the time.

Of piles of 100 and 135, the medians of both differ by 1 %, their tenths and ninetieths mostly by less than 6 %."""


@dataclass(frozen=True, kw_only=True)
class Field:
    """One quantity of a smarticle, or of each of its links.

    Attributes:
        name: With its unit, as in the run's frames.
        unit: SI; "-" for a pure number.
        kind: "count" for whole numbers that count, "value" for a continuous quantity, "name" for identity.
        of: Whether it belongs to each smarticle or to each link.
        meaning: One sentence.
        take: (N,), (N, 3) or (N, 3, 3) values of a frame: one per smarticle, per link, or a vector per link; None where
            the frame does not have it.
        available_for: Whether a run has it at all.
        costly: Whether it takes tenths of a second per frame or more.
        label: For the colour bar of a picture; the name if empty.
        shown: Factor and unit of the numbers of that bar; None: as they are.
    """

    name: str
    unit: str
    kind: Literal["count", "value", "name"] = "value"
    of: Literal["smarticle", "link"] = "smarticle"
    meaning: str
    take: Callable[[Frame, Run], NDArray[Any] | None]
    available_for: Callable[[Run], bool] = lambda _: True
    costly: bool = False
    label: str = ""
    shown: tuple[float, str] | None = None

    @property
    def title(self) -> str:
        """What a colour bar says."""
        unit = self.unit if self.shown is None else self.shown[1]
        if self.label:
            return self.label if unit == "-" else f"{self.label} [{unit}]"
        return self.name if unit == "-" else f"{self.name} [{unit}]"


def _speed(frame: Frame, run: Run) -> Floats:
    sections = np.array(run.manifest.thicknesses_in_plane_m) / run.manifest.thickness_in_plane_m
    weights = (link_lengths(frame.vertices) * sections)[:, :, None]
    velocity = (weights * frame.link_velocity).sum(axis=1) / weights.sum(axis=1)
    speed: Floats = np.linalg.norm(velocity, axis=1)
    return speed


def _recorded(name: str) -> Callable[[Frame, Run], NDArray[Any] | None]:
    return lambda frame, _: frame.cell_data.get(name)


def _labels(find: Callable[[Frame, Run], Clusters]) -> Callable[[Frame, Run], NDArray[Any]]:
    def take(frame: Frame, run: Run) -> NDArray[Any]:
        return find(frame, run).labels if frame.count else np.empty(0, dtype=np.int64)

    return take


def _local_packing(frame: Frame, run: Run) -> Floats:
    """(N,) [-]; NaN where a smarticle has no cell, or no wall bounds them."""
    if not run.manifest.fills_cylinder(frame.phase) or frame.count == 0:
        return np.full(frame.count, np.nan)
    top = float(frame.vertices[..., 2].max())
    # Of a cylinder that holds everything only the part inside the wall is asked for: outside no image bounds a cell.
    pile = Region(radius=run.manifest.container_radius_m, bottom=frame.floor_z, top=top)
    spacing = run.manifest.middle_length_m / CELLS_PER_LENGTH
    try:
        found = local_packing(
            frame.vertices, pile, pile, solid_volume=run.manifest.solid_volume_m3, spacing=spacing
        ).volumes
    except UndefinedMeasureError:
        return np.full(frame.count, np.nan)
    closed = np.isfinite(found) & (found > 0)
    return np.where(closed, run.manifest.solid_volume_m3 / np.where(closed, found, 1.0), np.nan)


def _pressed(frame: Frame, _: Run) -> Floats:
    """(N,) [N]."""
    forces = read_forces(frame)
    found, between = forces.contacts, forces.between
    total = np.zeros(frame.count)
    np.add.at(total, found.smarticles[:, 0], found.normal)
    np.add.at(total, found.smarticles[between, 1], found.normal[between])
    return total


def _chain(frame: Frame, _: Run) -> NDArray[Any]:
    """(N,) numbers; each its own where nobody touches."""
    try:
        return force_chains(frame).labels
    except UndefinedMeasureError:
        return np.arange(frame.count)


FIELDS: tuple[Field, ...] = (
    Field(
        name="smarticle_id",
        unit="-",
        kind="name",
        meaning="number of the smarticle, the same in all frames",
        take=lambda frame, _: frame.smarticle_ids,
    ),
    Field(
        name="link",
        unit="-",
        kind="name",
        of="link",
        meaning="0 barb 1, 1 middle link, 2 barb 2",
        take=lambda frame, _: np.tile(np.arange(LINKS), (frame.count, 1)),
    ),
    Field(
        name="speed_m_per_s",
        unit="m/s",
        meaning="of the smarticle's centre of mass",
        take=_speed,
        label="speed of its centre of mass",
    ),
    Field(
        name="height_m",
        unit="m",
        meaning="of the smarticle's centre of mass above the floor",
        take=lambda frame, _: centres_of_mass(frame.vertices)[:, 2] - frame.floor_z,
        label="height of its centre of mass",
        shown=(1e3, "mm"),
    ),
    Field(
        name="velocity_m_per_s",
        unit="m/s",
        of="link",
        meaning="vector, of the link's centre",
        take=lambda frame, _: frame.link_velocity,
    ),
    Field(
        name="angular_velocity_rad_per_s",
        unit="rad/s",
        of="link",
        meaning="vector, of the link",
        take=lambda frame, _: frame.link_angular_velocity,
    ),
    Field(
        name="contacts",
        unit="-",
        kind="count",
        meaning="other smarticles that it touches, as the engine counted them",
        take=lambda frame, _: frame.contacts,
        label="smarticles that it touches",
    ),
    Field(
        name="crossings",
        unit="-",
        kind="count",
        meaning="links of others that pass through its plane; their mean is ⟨N⟩",
        take=lambda frame, _: link_crossings(frame.vertices),
        label="links of others through its plane",
        available_for=in_space,
    ),
    Field(
        name="contact_cluster",
        unit="-",
        kind="name",
        meaning="number of its cluster of touching ones, 0 the largest; touching: the engine's spheres or strands do",
        take=_labels(contact_graph),
    ),
    Field(
        name="entanglement_cluster",
        unit="-",
        kind="name",
        meaning="the same of smarticles of which one passes through the other's plane",
        take=_labels(lambda frame, _: entanglement_clusters(frame.vertices)),
        available_for=in_space,
    ),
    Field(
        name="local_packing_fraction",
        unit="-",
        meaning=f"its volume over that of its set-Voronoi cell, of points every w/{CELLS_PER_LENGTH}; cells end at "
        "floor, wall and the pile's highest point; NaN without one cylindrical wall",
        take=_local_packing,
        available_for=lambda run: in_space(run) and run.manifest.container_tiers == 1,
        costly=True,
    ),
    Field(
        name="normal_force_N",
        unit="N",
        meaning="sum of the normal forces at all its contacts, boundaries among them; runs that record forces",
        take=_pressed,
        available_for=lambda run: run.forces is not None,
    ),
    Field(
        name="force_chain",
        unit="-",
        kind="name",
        meaning="number of its cluster of smarticles joined by forces above the mean, 0 the largest; likewise",
        take=_chain,
        available_for=lambda run: run.forces is not None,
    ),
    Field(
        name="angle_rad",
        unit="rad",
        of="link",
        meaning="of the barb, 0 straight; NaN on the middle link; scenes that actuate",
        take=_recorded("angle_rad"),
    ),
    Field(
        name="motor_torque_N_m",
        unit="N m",
        of="link",
        meaning="of the motor at the barb's hinge; NaN on the middle link and while welded; scenes that actuate",
        take=_recorded("motor_torque_N_m"),
    ),
    Field(
        name="motor_work_J",
        unit="J",
        of="link",
        meaning="of that motor since the start; likewise",
        take=_recorded("motor_work_J"),
    ),
    Field(
        name="halted",
        unit="-",
        kind="count",
        of="link",
        meaning="1 where that motor is halted, else 0; scenes that actuate",
        take=_recorded("halted"),
    ),
)
"""All of them, in the order of tables."""

BY_NAME: Mapping[str, Field] = MappingProxyType({field.name: field for field in FIELDS})


def fields_of(run: Run) -> tuple[Field, ...]:
    """Return the fields that a run's frames may have."""
    return tuple(field for field in FIELDS if field.available_for(run))


def checked_field(name: str, aliases: Mapping[str, str] = MappingProxyType({})) -> Field:
    """Return the field of a name, or of one of its short names.

    Raises:
        InputError: There is none.
    """
    field = BY_NAME.get(aliases.get(name, name))
    if field is None:
        msg = f"{name!r} is no field; {nearest(name, [*aliases, *BY_NAME], cutoff=0.5)}"
        raise InputError(msg)
    return field


def link_values(field: Field, frame: Frame, run: Run) -> NDArray[Any] | None:
    """Return values (N, 3) of a field, or vectors (N, 3, 3), one per link; None where the frame does not have it."""
    values = field.take(frame, run)
    if values is None or field.of == "link":
        return values
    spread: NDArray[Any] = np.repeat(values[:, None], LINKS, axis=1)
    return spread
