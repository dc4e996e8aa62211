"""One frame: a small VTK file of the centrelines of all smarticles at one recorded time; and one of their spheres.

docs/reference/files.md describes the format.
"""

from __future__ import annotations

import contextlib
import io
import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, NoReturn

import meshio
import numpy as np
from numpy.typing import NDArray

from dem.body.particle import LINKS, Particle
from dem.body.state import State
from dem.record.files import cannot_read
from dem.record.names import FRAME, SCENE, collection

Array = NDArray[np.float64]

VERTICES = 4


def _remedy(path: Path) -> str:
    """What to do about a frame that cannot be read. A run that goes on does not write the frames of before again."""
    scene = path.parent.parent / SCENE
    return f"remove its line from {scene.with_name(collection(FRAME))} to do without it, or run {scene} anew elsewhere"


def frame_mesh(
    state: State,
    *,
    contacts: NDArray[np.int64],
    time: float,
    floor: float,
    phase: int,
    hinged: bool = False,
    torques: NDArray[np.float64] | None = None,
    work: NDArray[np.float64] | None = None,
    halted: NDArray[np.bool_] | None = None,
) -> meshio.Mesh:
    """One frame as a mesh of lines.

    Args:
        state: all smarticles at this time.
        contacts: (N,) how many others each smarticle touches.
        time: simulated time [s].
        floor: height of the container's floor [m].
        phase: index of the phase.
        hinged: whether the scene has hinges and motors at all.
        torques: (N, 2) of the motors on the barbs [N m]; None while welded.
        work: (N, 2) of the motors since the start [J]; None while welded.
        halted: (N, 2) whether a motor is halted; None while welded.
    """
    extra = {}
    if hinged:
        none = np.full((state.count, 2), np.nan)
        extra = {
            "angle_rad": _per_link(state.angles),
            "motor_torque_N_m": _per_link(none if torques is None else torques),
            "motor_work_J": _per_link(none if work is None else work),
            "halted": np.nan_to_num(_per_link(none if halted is None else halted)).astype(np.int64),
        }
    return centreline_mesh(
        state.vertices,
        velocities=state.link_velocities,
        spins=state.link_spins,
        contacts=contacts,
        time=time,
        floor=floor,
        phase=phase,
        extra=extra,
    )


def centreline_mesh(
    vertices: Array,
    *,
    velocities: Array,
    spins: Array,
    contacts: NDArray[np.int64],
    time: float,
    floor: float,
    phase: int,
    extra: Mapping[str, NDArray[Any]] | None = None,
) -> meshio.Mesh:
    """One frame of smarticles of any shape, each its own.

    Args:
        vertices: (N, 4, 3) barb tip, hinge, hinge, barb tip of each smarticle [m].
        velocities: (N, 3, 3) of the links' centres [m/s].
        spins: (N, 3, 3) angular velocities of the links [rad/s].
        contacts: (N,) how many others each smarticle touches.
        time: simulated time [s].
        floor: height of the container's floor [m].
        phase: index of the phase.
        extra: (3N,) further values, one per link.
    """
    n = len(vertices)
    first = VERTICES * np.arange(n)[:, None] + np.arange(LINKS)
    lines = np.stack([first, first + 1], axis=-1).reshape(-1, 2)
    number = LINKS * n
    data = {
        "smarticle_id": np.repeat(np.arange(n), LINKS),
        "link": np.tile(np.arange(LINKS), n),
        "velocity_m_per_s": velocities.reshape(-1, 3),
        "angular_velocity_rad_per_s": spins.reshape(-1, 3),
        "contacts": np.repeat(contacts, LINKS),
        "time_s": np.full(number, time),
        "floor_z_m": np.full(number, floor),
        "phase": np.full(number, phase, dtype=np.int64),
        **(extra or {}),
    }
    return meshio.Mesh(
        vertices.reshape(-1, 3),
        [("line", lines)],
        cell_data={name: [values] for name, values in data.items()},
    )


def sphere_mesh(state: State, particle: Particle) -> meshio.Mesh:
    """The spheres of all smarticles as points, for ParaView's glyphs: what the engine sees of them.

    Args:
        state: all smarticles at this time.
        particle: one smarticle, of S spheres.
    """
    count, spheres = state.count, len(particle.centres)
    number = count * spheres
    data = {
        "radius_m": np.full(number, particle.radius),
        "smarticle_id": np.repeat(np.arange(count), spheres),
        "link": np.tile(particle.links, count).astype(np.int64),
    }
    points = state.spheres(particle).reshape(-1, 3)
    return meshio.Mesh(points, [("vertex", np.arange(number)[:, None])], point_data=data)


def _per_link(barbs: NDArray[Any]) -> Array:
    """(3N,) values on the barbs, from (N, 2); NaN on the middle links."""
    links = np.full((len(barbs), LINKS), np.nan)
    links[:, [0, 2]] = barbs
    return links.ravel()


@dataclass(frozen=True, kw_only=True, eq=False)
class Frame:
    """The smarticles at one recorded time; all arrays are read-only.

    Attributes:
        path: The file it came from.
        time: Simulated time [s].
        floor_z: Height of the container's floor [m]; heights are measured from it.
        phase: Index into `Run.phases`.
        vertices: (N, 4, 3) float64 [m], barb tip, hinge, hinge, barb tip of each smarticle, in the shape that it has
            at that time.
        smarticle_ids: (N,) int64.
        link_velocity: (N, 3, 3) float64 [m/s], of the centres of barb 1, middle link, barb 2.
        link_angular_velocity: (N, 3, 3) float64 [rad/s].
        contacts: (N,) int64, how many other smarticles each one touches, by the engine.
        cell_data: Further data of the file, (N, 3, …) one value per link, by name. Frames of scenes that actuate have
            `angle_rad`, `motor_torque_N_m` and `motor_work_J`, NaN on the middle link and on welded smarticles, and
            `halted`.
    """

    path: Path
    time: float
    floor_z: float
    phase: int
    vertices: NDArray[np.float64] = field(repr=False)
    smarticle_ids: NDArray[np.int64] = field(repr=False)
    link_velocity: NDArray[np.float64] = field(repr=False)
    link_angular_velocity: NDArray[np.float64] = field(repr=False)
    contacts: NDArray[np.int64] = field(repr=False)
    cell_data: Mapping[str, NDArray[Any]] = field(repr=False)

    @property
    def count(self) -> int:
        """Number of smarticles poured so far."""
        return len(self.vertices)


def read_frame(path: Path | str) -> Frame:
    """Reads one frame file.

    Args:
        path: A `.vtu` file as described in docs/reference/files.md.

    Returns:
        The frame.

    Raises:
        InputError: The file is missing, damaged, or lacks what a frame must have.

    Source:
        docs/reference/files.md.
    """
    path = Path(path)
    return _FrameReader(path, read_mesh(path)).frame()


def read_mesh(path: Path, what: str = "frame", remedy: str | None = None) -> Any:
    """A file of VTK as meshio has it.

    Args:
        path: the file.
        what: what it is, for messages.
        remedy: what to do about one that cannot be read; None: that of frames.

    Raises:
        InputError: it cannot be read.
    """
    # meshio's own dispatch prints and calls sys.exit on damaged files, hence the format's reader;
    # that one fails with whatever exception the damaged bytes happen to cause, or prints a warning
    # and goes on, which the checks of shapes catch.
    noise = io.StringIO()
    try:
        with (
            warnings.catch_warnings(action="ignore"),
            contextlib.redirect_stdout(noise),
            contextlib.redirect_stderr(noise),
        ):
            return meshio.vtu.read(str(path))
    except OSError as error:
        cannot_read(what, path, error, remedy or _remedy(path))
    except (Exception, SystemExit) as error:
        cause = f"truncated or not VTK ({type(error).__name__})"
        cannot_read(what, path, cause, remedy or _remedy(path))


class _FrameReader:
    """Turns the mesh of one file into a frame and names what is wrong with it."""

    def __init__(self, path: Path, mesh: Any) -> None:
        self._path = path
        blocks = [block for block in mesh.cells if block.type == "line"]
        if len(mesh.cells) != 1 or len(blocks) != 1:
            self._refuse("it must hold one block of lines and no other cells")
        self._points = np.asarray(mesh.points)
        self._lines = np.asarray(blocks[0].data)
        self._data = {name: np.asarray(values[0]) for name, values in mesh.cell_data.items()}
        self._count = len(self._lines) // LINKS

    def frame(self) -> Frame:
        self._check_topology()
        identifiers = self._per_link("smarticle_id", np.int64, ())
        links = self._per_link("link", np.int64, ())
        if np.any(identifiers != identifiers[:, :1]) or np.any(links != np.arange(LINKS)):
            self._refuse("'smarticle_id' and 'link' are not in smarticle-major order")
        phase = self._constant("phase")
        if phase < 0 or phase != math.floor(phase):
            self._refuse(f"'phase' must be a whole number, 0 or more: got {phase:g}")
        return Frame(
            path=self._path,
            time=self._constant("time_s"),
            floor_z=self._constant("floor_z_m"),
            phase=int(phase),
            vertices=self._vertices(),
            smarticle_ids=_frozen(identifiers[:, 0]),
            link_velocity=self._per_link("velocity_m_per_s", np.float64, (3,)),
            link_angular_velocity=self._per_link("angular_velocity_rad_per_s", np.float64, (3,)),
            contacts=_frozen(self._per_link("contacts", np.int64, ())[:, 0]),
            # What is left once the contract's own data are taken out.
            cell_data=MappingProxyType({name: _frozen(self._folded(values)) for name, values in self._data.items()}),
        )

    def _refuse(self, cause: str) -> NoReturn:
        cannot_read("frame", self._path, cause, _remedy(self._path))

    def _check_topology(self) -> None:
        if self._count == 0:
            self._refuse("it holds no smarticle")
        if self._points.shape != (VERTICES * self._count, 3):
            self._refuse(
                f"{len(self._lines)} lines need {VERTICES * self._count} points of 3 coordinates: "
                f"got {self._points.shape}"
            )
        first = VERTICES * np.arange(self._count)[:, None] + np.arange(LINKS)
        expected = np.stack([first, first + 1], axis=-1).reshape(-1, 2)
        if not np.array_equal(self._lines, expected):
            self._refuse("its lines do not join tip, hinge, hinge, tip in order")

    def _vertices(self) -> NDArray[np.float64]:
        if not np.all(np.isfinite(self._points)):
            self._refuse("a point is not finite")
        return _frozen(self._points.astype(np.float64).reshape(self._count, VERTICES, 3))

    def _folded(self, values: NDArray[Any]) -> NDArray[Any]:
        return values.reshape(self._count, LINKS, *values.shape[1:])

    def _per_link(self, name: str, kind: Any, shape: tuple[int, ...]) -> NDArray[Any]:
        values = self._data.pop(name, None)
        if values is None:
            self._refuse(f"cell data '{name}' is missing")
        if values.shape != (LINKS * self._count, *shape):
            self._refuse(f"cell data '{name}' has shape {values.shape}")
        return _frozen(self._folded(values.astype(kind)))

    def _constant(self, name: str) -> float:
        values = self._per_link(name, np.float64, ())
        first = float(values.flat[0])
        if not math.isfinite(first) or np.any(values != first):
            self._refuse(f"'{name}' must be finite and the same for all lines")
        return first


def _frozen(values: NDArray[Any]) -> NDArray[Any]:
    values = np.ascontiguousarray(values)
    values.flags.writeable = False
    return values
