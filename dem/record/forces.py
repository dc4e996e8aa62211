"""Forces at contacts at one time: a VTK file of lines, one per contact; see docs/reference/files.md."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import meshio
import numpy as np
from numpy.typing import NDArray

from dem.arrays import Array, Flags, Numbers
from dem.body.forces import BOUNDARIES, NONE, ContactForces
from dem.record.files import cannot_read
from dem.record.frame import Frame, read_mesh
from dem.record.names import FORCE, collection, member

_HEAD, _EMPTY = 512, b'NumberOfCells="0"'
NO_FORCES = "a run does where its scene says recording.contact_forces: true"
"""Advice for messages about a run without recorded forces."""
_REMEDY = "run the scene anew; forces are recorded by recording.contact_forces: true"


def force_mesh(found: ContactForces, positions: Array, *, time: float, phase: int) -> meshio.Mesh:
    """Return a mesh of lines, one for each contact, for a VTK file.

    A line goes from the centre of mass of the first smarticle to that of the second smarticle, or to the point of
    contact at a boundary.

    Centres of mass are (N, 3) [m].
    """
    number, between = len(found.forces), found.boundaries == NONE
    ends = np.empty((number, 2, 3))
    ends[:, 0] = positions[found.smarticles[:, 0]]
    ends[:, 1] = found.points
    ends[between, 1] = positions[found.smarticles[between, 1]]
    values = {
        "first_smarticle": found.smarticles[:, 0],
        "first_link": found.links[:, 0],
        "second_smarticle": found.smarticles[:, 1],
        "second_link": found.links[:, 1],
        "fixture": found.boundaries,
        "normal_force_N": found.normal,
        "tangential_force_N": found.tangential,
        "force_N": found.forces,
        "point_m": found.points,
        "time_s": np.full(number, time),
        "phase": np.full(number, phase, dtype=np.int64),
    }
    lines = np.arange(2 * number).reshape(-1, 2)
    return meshio.Mesh(ends.reshape(-1, 3), [("line", lines)], cell_data={name: [v] for name, v in values.items()})


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedForces:
    """The forces at contacts at one recorded time."""

    path: Path  #: The file
    contacts: ContactForces = field(repr=False)  #: The contacts
    #: (M, 2, 3) ends of the lines [m]: the first smarticle's centre of mass, and that of the second, or the point of
    #: contact at a boundary
    ends: Array = field(repr=False)

    @property
    def between(self) -> Flags:
        """(M,) whether a contact is between two smarticles."""
        return np.asarray(self.contacts.boundaries == NONE)


def has_forces(directory: Path) -> bool:
    """Return whether a run directory holds recorded forces at contacts."""
    return (directory / collection(FORCE)).is_file()


def read_forces(frame: Frame) -> RecordedForces:
    """Return the forces recorded together with a frame; raise InputError if they are missing or damaged."""
    path = frame.directory / member(FORCE, frame.number)
    points, data = _content(path)
    number = len(points) // 2

    def values(name: str, *shape: int) -> Array:
        if not number:
            return np.zeros((0, *shape))
        found, wrong = data.get(name), ""
        if found is None:
            wrong = "is missing"
        elif found.shape != (number, *shape):
            wrong = f"has shape {found.shape}, for {number} contacts"
        elif not np.all(np.isfinite(found)):
            wrong = "is not finite"
        if found is None or wrong:
            cannot_read("forces", path, f"cell data '{name}' {wrong}", _REMEDY)
        return found.astype(np.float64)

    def numbers(*names: str, below: int) -> Numbers:
        found = np.column_stack([values(name) for name in names]).astype(np.int64)
        if np.any((found < NONE) | (found >= below)):
            cannot_read("forces", path, f"cell data '{names[0]}' is out of range", _REMEDY)
        return found

    contacts = ContactForces(
        smarticles=numbers("first_smarticle", "second_smarticle", below=frame.count),
        links=numbers("first_link", "second_link", below=1 + int(frame.link.max(initial=2))),
        boundaries=numbers("fixture", below=len(BOUNDARIES))[:, 0],
        points=values("point_m", 3),
        normal=values("normal_force_N"),
        tangential=values("tangential_force_N"),
        forces=values("force_N", 3),
    )
    return RecordedForces(path=path, contacts=contacts, ends=points.reshape(-1, 2, 3))


def _content(path: Path) -> tuple[Array, dict[str, NDArray[Any]]]:
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError as error:
        cannot_read("forces", path, error, _REMEDY)
    if _EMPTY in head:
        return np.empty((0, 3)), {}  # VTK reads it, meshio does not
    mesh = read_mesh(path, "forces", _REMEDY)
    return np.asarray(mesh.points, np.float64), {name: np.asarray(each[0]) for name, each in mesh.cell_data.items()}
