"""Define the fields of smarticles and links: names, units, meanings, and their values in a frame."""

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
from postprocess.geometry.bars import body_centres, entries
from postprocess.geometry.links import Floats, UndefinedMeasureError, link_lengths
from postprocess.geometry.segments import segments_of
from postprocess.geometry.voronoi import local_packing
from postprocess.geometry.voxel import Region
from postprocess.measures.clusters import Clusters, contact_graph, entanglement_clusters
from postprocess.measures.crossing_number import average_crossing_numbers
from postprocess.measures.entanglement import frame_crossings
from postprocess.measures.force_chains import force_chains
from postprocess.measures.registry import any_in_space, in_one_cylinder, in_space

LINKS = 3
LINK_NAMES = ("barb 1", "middle link", "barb 2")  #: Names of a smarticle's links

IDENTITY = ("smarticle_id", "link")  #: Fields that every export contains

CELLS_PER_LENGTH = 4
"""Points per w along a link for local packing fractions.

The packing fraction "voronoi" uses 8, which takes three times as long. In piles of 100 and 135 smarticles the medians
by 4 and by 8 points differ by 1 %. The 10 % and 90 % quantiles mostly differ by less than 6 %."""


@dataclass(frozen=True)
class Field:
    """A quantity of each smarticle, or of each of its links."""

    name: str  #: Name with the unit, as in the frames of a run
    unit: str  #: SI unit; "-" for a pure number
    meaning: str  #: Description in one sentence
    #: Returns the values of a frame: (N,) per smarticle, (N, 3) per link, (N, 3, 3) a vector per link; None if the
    #: frame lacks the field
    take: Callable[[Frame, Run], NDArray[Any] | None]
    #: "count": a number of things; "value": a continuous quantity; "name": a number that identifies something
    kind: Literal["count", "value", "name"] = "value"
    of: Literal["smarticle", "link"] = "smarticle"  #: Whether each smarticle or each link has a value
    available_for: Callable[[Run], bool] = lambda _: True  #: Returns whether a run has the field
    costly: bool = False  #: Whether the field takes tenths of a second per frame or more
    on_request: bool = False  #: Whether only exports and pictures that name the field have it
    label: str = ""  #: Text of the colour bar; the name if empty
    shown: tuple[float, str] | None = None  #: Factor from SI and unit of the numbers at the colour bar; None: SI
    #: Returns the names of a run's values for a legend, by value; empty for a field without legend
    names: Callable[[Run], Mapping[int, str]] = lambda _: {}

    @property
    def title(self) -> str:
        """Text of the colour bar with the unit."""
        unit, text = self.shown[1] if self.shown else self.unit, self.label or self.name
        return text if unit == "-" else f"{text} [{unit}]"


def _entry_names(run: Run) -> dict[int, str]:
    return {number: f"{number} {run.scene['particle'][number]['shape']}" for number in entries(run)}


def _kind_names(run: Run) -> dict[int, str]:
    """Return the names of all kinds that have bodies, with the length of one body."""
    kinds = enumerate(run.manifest.kinds or ())
    return {number: f"{number} {kind.shape} {1e3 * kind.length_m:.3g} mm" for number, kind in kinds if kind.bodies}


def _speed(frame: Frame, run: Run) -> Floats:
    if frame.bars is not None:
        lengths = np.linalg.norm(frame.segments[:, 1] - frame.segments[:, 0], axis=1)
        sums = [np.bincount(frame.body, lengths * part) for part in frame.link_velocity.T]
        return np.asarray(np.linalg.norm(sums, axis=0) / np.bincount(frame.body, lengths))
    sections = np.array(run.manifest.thicknesses_in_plane_m) / run.manifest.thickness_in_plane_m
    weights = (link_lengths(frame.vertices) * sections)[:, :, None]
    velocity = (weights * frame.link_velocity).sum(axis=1) / weights.sum(axis=1)
    speed: Floats = np.linalg.norm(velocity, axis=1)
    return speed


def _records_forces(run: Run) -> bool:
    return run.forces is not None


def _recorded(name: str) -> Callable[[Frame, Run], NDArray[Any] | None]:
    return lambda frame, _: frame.cell_data.get(name)


def _labels(find: Callable[[Frame, Run], Clusters]) -> Callable[[Frame, Run], NDArray[Any]]:
    def take(frame: Frame, run: Run) -> NDArray[Any]:
        return find(frame, run).labels if frame.count else np.empty(0, dtype=np.int64)

    return take


def _local_packing(frame: Frame, run: Run) -> Floats:
    """Return local packing fractions (N,) [-]; NaN if a smarticle has no cell, or if there is no wall."""
    if not run.manifest.fills_cylinder(frame.phase) or frame.count == 0:
        return np.full(frame.count, np.nan)
    top = float(frame.vertices[..., 2].max())
    # Cells need the true wall, not the corrected radius of the packing fraction.
    pile = Region(radius=run.manifest.container_radius_m, bottom=frame.floor_z, top=top)
    spacing = run.manifest.middle_length_m / CELLS_PER_LENGTH
    try:
        _, found = local_packing(frame.vertices, pile, pile, solid_volume=run.manifest.solid_volume_m3, spacing=spacing)
    except UndefinedMeasureError:
        return np.full(frame.count, np.nan)
    closed = np.isfinite(found) & (found > 0)
    return np.where(closed, run.manifest.solid_volume_m3 / np.where(closed, found, 1.0), np.nan)


def _crossings(frame: Frame, _: Run) -> Floats:
    """Return the crossings (N,) [-] of bodies; NaN for those that span no plane."""
    crossings, planes = frame_crossings(frame)
    return np.where(planes, crossings, np.nan)


def _pressed(frame: Frame, _: Run) -> Floats:
    forces = read_forces(frame)
    found, between = forces.contacts, forces.between
    total = np.zeros(frame.count)
    np.add.at(total, found.smarticles[:, 0], found.normal)
    np.add.at(total, found.smarticles[between, 1], found.normal[between])
    return total


def _chain(frame: Frame, _: Run) -> NDArray[Any]:
    """Return which force chain each smarticle belongs to, (N,) int: equal numbers mark one chain.

    A smarticle in no chain has a number of its own. If no smarticles touch, all numbers differ.
    """
    try:
        return force_chains(frame).labels
    except UndefinedMeasureError:
        return np.arange(frame.count)


FIELDS: tuple[Field, ...] = (
    Field(
        "smarticle_id",
        "-",
        "number of the smarticle, constant in all frames",
        lambda frame, _: frame.smarticle_ids,
        kind="name",
    ),
    Field(
        "link",
        "-",
        "0 barb 1, 1 middle link, 2 barb 2; of other bodies the number of the bar",
        lambda frame, _: frame.link if frame.bars is not None else np.tile(np.arange(LINKS), (frame.count, 1)),
        kind="name",
        of="link",
        names=lambda run: dict(enumerate(LINK_NAMES)) if run.manifest.kinds is None else {},
    ),
    Field(
        "entry",
        "-",
        "entry of the scene's list `particle` that the body is made from; scenes with the key particle",
        lambda frame, run: np.array(entries(run))[frame.kind],
        kind="name",
        available_for=lambda run: run.manifest.kinds is not None,
        label="entry of the scene's particle",
        names=_entry_names,
    ),
    Field(
        "kind",
        "-",
        "kind of the body, a place in `kinds` of run.json; an entry with a spread makes one kind for each size; scenes "
        "with the key particle",
        lambda frame, _: frame.kind,
        kind="name",
        available_for=lambda run: run.manifest.kinds is not None,
        names=_kind_names,
    ),
    Field("speed_m_per_s", "m/s", "of the smarticle's centre of mass", _speed, label="speed of its centre of mass"),
    Field(
        "height_m",
        "m",
        "of the smarticle's centre of mass above the floor",
        lambda frame, _: body_centres(frame)[:, 2] - frame.floor_z,
        label="height of its centre of mass",
        shown=(1e3, "mm"),
    ),
    Field("velocity_m_per_s", "m/s", "vector, of the link's centre", lambda frame, _: frame.link_velocity, of="link"),
    Field(
        "angular_velocity_rad_per_s",
        "rad/s",
        "vector, of the link",
        lambda frame, _: frame.link_angular_velocity,
        of="link",
    ),
    Field(
        "contacts",
        "-",
        "other smarticles that it touches, as the engine counted them",
        lambda frame, _: frame.contacts,
        kind="count",
        label="smarticles that it touches",
    ),
    Field(
        "crossings",
        "-",
        "links of others that pass through its plane; their mean is ⟨N⟩; NaN for bodies without a plane, such as rods",
        _crossings,
        kind="count",
        label="links of others through its plane",
        available_for=any_in_space,
    ),
    Field(
        "average_crossing_number",
        "-",
        "average crossing number with all others; their mean is ⟨ACN⟩; on request: costs 0.3 µs per pair of links",
        lambda frame, _: average_crossing_numbers(*segments_of(frame)).per_body,
        label="average crossing number with all others",
        available_for=any_in_space,
        costly=True,
        on_request=True,
    ),
    Field(
        "contact_cluster",
        "-",
        "number of its cluster of smarticles whose spheres or strands touch in the engine, 0 the largest",
        _labels(contact_graph),
        kind="name",
        available_for=lambda run: run.manifest.kinds is None,
    ),
    Field(
        "entanglement_cluster",
        "-",
        "number of its cluster of smarticles joined by crossings, 0 the largest",
        _labels(lambda frame, _: entanglement_clusters(frame.vertices)),
        kind="name",
        available_for=in_space,
    ),
    Field(
        "local_packing_fraction",
        "-",
        f"its volume over that of its set-Voronoi cell, of points every w/{CELLS_PER_LENGTH}; cells end at "
        "floor, wall and the pile's highest point; NaN without one cylindrical wall",
        _local_packing,
        available_for=in_one_cylinder,
        costly=True,
    ),
    Field(
        "normal_force_N",
        "N",
        "sum of the normal forces at all its contacts, boundaries among them; runs that record forces",
        _pressed,
        available_for=_records_forces,
    ),
    Field(
        "force_chain",
        "-",
        "number of its cluster of smarticles joined by forces above the mean, 0 the largest; runs that record forces",
        _chain,
        kind="name",
        available_for=_records_forces,
    ),
    *(
        Field(name, unit, meaning, _recorded(name), of="link", kind="count" if name == "halted" else "value")
        for name, unit, meaning in (
            ("angle_rad", "rad", "of the barb, 0 straight; NaN on the middle link; scenes that actuate"),
            (
                "motor_torque_N_m",
                "N m",
                "of the motor at the barb's hinge; NaN on the middle link and while welded; scenes that actuate",
            ),
            (
                "motor_work_J",
                "J",
                "of the motor at the barb's hinge since the start; NaN on the middle link; scenes that actuate",
            ),
            ("halted", "-", "1 if the motor at the barb's hinge is halted, else 0; scenes that actuate"),
        )
    ),
)  #: All fields, in the order of tables

BY_NAME: Mapping[str, Field] = MappingProxyType({field.name: field for field in FIELDS})


def fields_of(run: Run) -> tuple[Field, ...]:
    """Return the fields that are available for a run, see `Field.available_for`."""
    return tuple(field for field in FIELDS if field.available_for(run))


def checked_field(name: str, aliases: Mapping[str, str] = MappingProxyType({})) -> Field:
    """Return the field with a name; InputError if the name is unknown.

    `aliases` maps short names, which are accepted too, to the names of fields.
    """
    field = BY_NAME.get(aliases.get(name, name))
    if field is None:
        raise InputError(f"{name!r} is no field; {nearest(name, [*aliases, *BY_NAME], cutoff=0.5)}")
    return field


def link_values(field: Field, frame: Frame, run: Run) -> NDArray[Any] | None:
    """Return the values (N, L) or vectors (N, L, 3) of a field, one per link; None if the frame lacks it.

    N is the number of bodies. L is 3 for smarticles; other bodies have up to L bars, and the values of missing bars are
    NaN, or 0 for a field of whole numbers.
    """
    values = field.take(frame, run)
    if values is None or (field.of == "link" and frame.bars is None):
        return values
    most = LINKS if frame.bars is None else int(frame.link.max()) + 1
    if field.of == "smarticle":
        spread: NDArray[Any] = np.repeat(values[:, None], most, axis=1)
        return spread
    empty = np.nan if values.dtype.kind == "f" else 0
    found: NDArray[Any] = np.full((frame.count, most, *values.shape[1:]), empty, dtype=values.dtype)
    found[frame.body, frame.link] = values.reshape(len(frame.body), *values.shape[1:])
    return found
