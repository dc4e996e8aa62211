"""Frames: VTK files of centrelines, or of spheres, at one time; see docs/reference/files.md."""

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

from dem.arrays import Array, Flags, Numbers
from dem.body.particle import LINKS, Particle
from dem.body.state import State
from dem.record.files import cannot_read
from dem.record.names import FRAME, SCENE, collection

VERTICES = 4


def _remedy(path: Path) -> str:
    """Return what to do about an unreadable frame; a resumed run does not write earlier frames again."""
    scene = path.parent.parent / SCENE
    return f"remove its line from {scene.with_name(collection(FRAME))} to do without it, or run {scene} anew elsewhere"


def centreline_mesh(
    vertices: Array,
    *,
    velocities: Array,
    spins: Array,
    contacts: Numbers,
    time: float,
    floor: float,
    phase: int,
    extra: Mapping[str, NDArray[Any]] | None = None,
) -> meshio.Mesh:
    """Return one frame of N smarticles as a mesh of 3N lines, one for each link.

    Args:
        vertices: (N, 4, 3) barb tip, hinge, hinge, barb tip of each smarticle [m].
        velocities: (N, 3, 3) velocities of the links' centres [m/s].
        spins: (N, 3, 3) angular velocities of the links [rad/s].
        contacts: (N,) number of other smarticles that each smarticle touches.
        time: simulated time [s].
        floor: height of the container's floor [m].
        extra: further cell data by name, (3N,) or (3N, 3), such as `motor_fields`.
    """
    n, number = len(vertices), LINKS * len(vertices)
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
    cell_data = {name: [values] for name, values in data.items()}
    return meshio.Mesh(vertices.reshape(-1, 3), [("line", _lines(n))], cell_data=cell_data)


def motor_fields(
    angles: Array,
    torques: Array | None = None,
    work: Array | None = None,
    halted: Flags | None = None,
) -> dict[str, NDArray[Any]]:
    """Return cell data (3N,) of scenes with motors, by name; NaN on middle links.

    Args:
        angles: (N, 2) angles of the barbs [rad].
        torques: (N, 2) torques of the motors on the barbs [N m]; None while welded.
        work: (N, 2) work of the motors since the start [J]; None while welded.
        halted: (N, 2) whether motors are halted; None while welded.
    """
    none = np.full(angles.shape, np.nan)
    fields = {
        "angle_rad": angles,
        "motor_torque_N_m": none if torques is None else torques,
        "motor_work_J": none if work is None else work,
        "halted": none if halted is None else halted,
    }
    found: dict[str, NDArray[Any]] = {}
    for name, barbs in fields.items():
        links = np.full((len(barbs), LINKS), np.nan)
        links[:, [0, 2]] = barbs
        found[name] = links.ravel()
    return found | {"halted": np.nan_to_num(found["halted"]).astype(np.int64)}


def sphere_mesh(state: State, particle: Particle) -> meshio.Mesh:
    """Return the spheres of all smarticles as points, for ParaView's glyphs."""
    count, spheres = state.count, len(particle.centres)
    number = count * spheres
    data = {
        "radius_m": np.full(number, particle.radius),
        "smarticle_id": np.repeat(np.arange(count), spheres),
        "link": np.tile(particle.links, count).astype(np.int64),
    }
    points = state.spheres(particle).reshape(-1, 3)
    return meshio.Mesh(points, [("vertex", np.arange(number)[:, None])], point_data=data)


def _lines(count: int) -> Numbers:
    """Return (3N, 2) numbers of the two vertices of each link of N smarticles."""
    first = VERTICES * np.arange(count)[:, None] + np.arange(LINKS)
    return np.stack([first, first + 1], axis=-1).reshape(-1, 2)


@dataclass(frozen=True, kw_only=True, eq=False)
class Frame:
    """The smarticles at one recorded time; all arrays are read-only."""

    path: Path  #: The file
    time: float  #: Simulated time [s]
    floor_z: float  #: Height of the container's floor [m]; heights are measured from it
    phase: int  #: Index into `Run.phases`
    #: (N, 4, 3) float64 [m], barb tip, hinge, hinge, barb tip of each smarticle, in its shape at that time
    vertices: Array = field(repr=False)
    smarticle_ids: Numbers = field(repr=False)  #: (N,) int64, numbers of the smarticles
    #: (N, 3, 3) float64 [m/s], velocities of the centres of barb 1, middle link and barb 2
    link_velocity: Array = field(repr=False)
    #: (N, 3, 3) float64 [rad/s], angular velocities of barb 1, middle link and barb 2
    link_angular_velocity: Array = field(repr=False)
    contacts: Numbers = field(repr=False)  #: (N,) int64, number of other smarticles that each smarticle touches
    #: Further data of the file, (N, 3, …) one value per link, by name. Frames of scenes that actuate have `angle_rad`,
    #: `motor_torque_N_m` and `motor_work_J`, NaN on the middle link and on welded smarticles, and `halted`.
    cell_data: Mapping[str, NDArray[Any]] = field(repr=False)

    @property
    def count(self) -> int:
        """Number of smarticles poured so far."""
        return len(self.vertices)


def read_frame(path: Path | str) -> Frame:
    """Return the content of a frame file, `.vtu`; raise InputError if it is missing or damaged."""
    path = Path(path)
    mesh = read_mesh(path)

    def reject(cause: str) -> NoReturn:
        cannot_read("frame", path, cause, _remedy(path))

    if [block.type for block in mesh.cells] != ["line"]:
        reject("it must hold one block of lines and no other cells")
    points, lines = np.asarray(mesh.points), np.asarray(mesh.cells[0].data)
    count = len(lines) // LINKS
    if count == 0:
        reject("it holds no smarticle")
    if points.shape != (VERTICES * count, 3):
        reject(f"{len(lines)} lines need {VERTICES * count} points of 3 coordinates: got {points.shape}")
    if not np.array_equal(lines, _lines(count)):
        reject("its lines do not join tip, hinge, hinge, tip in order")
    if not np.all(np.isfinite(points)):
        reject("a point is not finite")
    data = {name: np.asarray(values[0]) for name, values in mesh.cell_data.items()}

    def per_link(name: str, kind: Any, *shape: int) -> NDArray[Any]:
        values = data.pop(name, None)
        if values is None:
            reject(f"cell data '{name}' is missing")
        if values.shape != (LINKS * count, *shape):
            reject(f"cell data '{name}' has shape {values.shape}")
        return frozen(values.astype(kind).reshape(count, LINKS, *shape))

    def constant(name: str) -> float:
        values = per_link(name, np.float64)
        first = float(values.flat[0])
        if not math.isfinite(first) or np.any(values != first):
            reject(f"'{name}' must be finite and the same for all lines")
        return first

    identifiers, links = per_link("smarticle_id", np.int64), per_link("link", np.int64)
    if np.any(identifiers != identifiers[:, :1]) or np.any(links != np.arange(LINKS)):
        reject("'smarticle_id' and 'link' are not in smarticle-major order")
    phase = constant("phase")
    if phase < 0 or phase != math.floor(phase):
        reject(f"'phase' must be a whole number, 0 or more: got {phase:g}")
    return Frame(
        path=path,
        time=constant("time_s"),
        floor_z=constant("floor_z_m"),
        phase=int(phase),
        vertices=frozen(points.astype(np.float64).reshape(count, VERTICES, 3)),
        smarticle_ids=frozen(identifiers[:, 0]),
        link_velocity=per_link("velocity_m_per_s", np.float64, 3),
        link_angular_velocity=per_link("angular_velocity_rad_per_s", np.float64, 3),
        contacts=frozen(per_link("contacts", np.int64)[:, 0]),
        # `data` now holds only what `per_link` has not removed.
        cell_data=MappingProxyType(
            {name: frozen(values.reshape(count, LINKS, *values.shape[1:])) for name, values in data.items()}
        ),
    )


def read_mesh(path: Path, what: str = "frame", remedy: str | None = None) -> Any:
    """Return the mesh of a VTK file; raise InputError if it cannot be read.

    Args:
        what: kind of the file, for the message.
        remedy: what to do, for the message; None: advice for frames.
    """
    # `meshio.read` prints and exits on damaged files. The reader of the format raises any exception, or prints a
    # warning and continues, which the callers' checks of shapes find.
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
        cannot_read(what, path, f"truncated or not VTK ({type(error).__name__})", remedy or _remedy(path))


def frozen(values: NDArray[Any]) -> NDArray[Any]:
    """Return the values as a contiguous, read-only array."""
    values = np.ascontiguousarray(values)
    values.flags.writeable = False
    return values
