"""Frames: VTK files of centrelines, or of spheres, at one time; see docs/reference/files.md."""

import contextlib
import io
import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any, NoReturn

import meshio
import numpy as np
from numpy.typing import NDArray

from dem.arrays import Array, Flags, Numbers
from dem.body.kinds import Kind, Mixture
from dem.body.particle import LINKS, Particle
from dem.body.state import BarState, PileState
from dem.notebook import Facts, Shown
from dem.record.document import Manifest
from dem.record.files import cannot_read
from dem.record.kinematics import RecordedPoses, poses_of_bars, poses_of_bodies
from dem.record.names import FRAME, MANIFEST, SCENE, VTKHDF, collection
from dem.record.vtkhdf import REMEDY, read_step

VERTICES = 4


def _remedy(path: Path) -> str:
    """Return advice to the user about a frame that cannot be read, for an error message.

    To resume the run is no remedy, since it would not write the frame again.
    """
    if path.suffix == ".vtkhdf":
        return REMEDY.format(path.with_name(SCENE))
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
        extra: further cell data by name, (3N,) or (3N, 3), such as those of `motor_fields`.
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
    """Return the fields that frames of scenes with motors add: (3N,) cell data by name, one value per link.

    The fields are `angle_rad`, `motor_torque_N_m`, `motor_work_J` and `halted`. Middle links, and all links where an
    argument is None, have NaN; in `halted`, which holds 0 and 1, they have 0.

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


def segment_mesh(state: BarState, *, contacts: Numbers, time: float, floor: float, phase: int) -> meshio.Mesh:
    """Return one frame of bodies of any shape as a mesh of lines, one for each of their M bars."""
    body = state.body
    number = len(body)
    data = {
        "smarticle_id": body,
        "link": state.bar,
        "velocity_m_per_s": state.bar_velocities,
        "angular_velocity_rad_per_s": state.bar_spins,
        "contacts": contacts[body],
        "time_s": np.full(number, time),
        "floor_z_m": np.full(number, floor),
        "phase": np.full(number, phase, dtype=np.int64),
        "kind": state.kind[body],
        "normal": state.normals,
    }
    lines = np.arange(2 * number).reshape(-1, 2)
    cell_data = {name: [values] for name, values in data.items()}
    return meshio.Mesh(state.segments.reshape(-1, 3), [("line", lines)], cell_data=cell_data)


def sphere_mesh(state: PileState, particle: Particle | Mixture) -> meshio.Mesh:
    """Return the centres of all bodies' spheres as a mesh of points, for ParaView's glyphs."""
    bodies: Sequence[Particle | Kind]
    if state.bodies is not None:
        bodies = [state.bodies.mixture.kinds[k] for k in state.bodies.kind]
        points = np.concatenate(state.bodies.spheres_by_body())
    else:
        assert isinstance(particle, Particle)  # a pile of smarticles
        bodies, points = [particle] * state.count, state.smarticles.spheres(particle).reshape(-1, 3)
    sizes = [len(body.centres) for body in bodies]
    data = {
        "radius_m": np.repeat([body.radius for body in bodies], sizes),
        "smarticle_id": np.repeat(np.arange(state.count), sizes),
        "link": np.concatenate([body.links for body in bodies]),
    }
    return meshio.Mesh(points, [("vertex", np.arange(len(points))[:, None])], point_data=data)


def _lines(count: int) -> Numbers:
    """Return (3N, 2) numbers of the two vertices of each link of N smarticles."""
    first = VERTICES * np.arange(count)[:, None] + np.arange(LINKS)
    return np.stack([first, first + 1], axis=-1).reshape(-1, 2)


@dataclass(frozen=True, eq=False)
class RecordedBars:
    """All M bars of N bodies that are no smarticles, body by body."""

    segments: Array  #: (M, 2, 3) both ends of each bar [m]
    body: Numbers  #: (M,) number of the body to which each bar belongs
    number: Numbers  #: (M,) number of each bar in its body
    kind: Numbers  #: (N,) kind of each body, as index of `Manifest.kinds`
    normals: Array  #: (M, 3) unit vectors along the normal of flat sections; zeros where the section is round [1]


@dataclass(frozen=True, kw_only=True, eq=False)
class Frame(Shown):
    """The bodies at one recorded time; all arrays are read-only.

    Piles of smarticles have `vertices`, and values of links in the form (N, 3, …). Piles of other bodies have bars in
    any number, M in all, and values of links in the form (M, …). Both have `segments` and `body`.
    """

    path: Path  #: The file
    number: int  #: Index in the sequence of the run's frames
    time: float  #: Simulated time [s]
    floor_z: float  #: Height of the container's floor [m]; heights are measured from it
    phase: int  #: Index of the phase in `Run.phases`
    #: (N, 4, 3) float64 [m], barb tip, hinge, hinge, barb tip of each smarticle, in its shape at that time; (N, 0, 3)
    #: for bodies that are no smarticles
    vertices: Array = field(repr=False)
    smarticle_ids: Numbers = field(repr=False)  #: (N,) int64, numbers of the smarticles
    #: (N, 3, 3) or (M, 3) float64 [m/s], velocities of the centres of barb 1, middle link and barb 2, or of bars
    link_velocity: Array = field(repr=False)
    #: (N, 3, 3) or (M, 3) float64 [rad/s], angular velocities of barb 1, middle link and barb 2, or of bars
    link_angular_velocity: Array = field(repr=False)
    contacts: Numbers = field(repr=False)  #: (N,) int64, number of other bodies that each body touches
    #: Further values of links in the file, by name: (N, 3, …) for smarticles, (M, …) for other bodies. Frames of scenes
    #: that actuate have `angle_rad`, `motor_torque_N_m` and `motor_work_J`, NaN on the middle link and on welded
    #: smarticles, and `halted`
    cell_data: Mapping[str, NDArray[Any]] = field(repr=False)
    bars: RecordedBars | None = field(repr=False, default=None)  #: Bars of other bodies; None for smarticles

    def _facts(self) -> Facts:
        yield "frame", f"{self.number}, at {self.time:.4g} s, in phase {self.phase}"
        yield "bodies", f"{self.count}, with {len(self.body)} {'links' if self.bars is None else 'bars'}"
        if self.count:
            yield "highest point", f"{1e3 * (self.segments[..., 2].max() - self.floor_z):.3g} mm above the floor"
            yield "contacts", f"{self.contacts.mean():.3g} other bodies touch a body, on average"
        yield "further values", ", ".join(self.cell_data) or "none"
        yield "file", str(self.path)

    @property
    def directory(self) -> Path:
        """The run directory."""
        return self.path.parent if self.path.name == VTKHDF else self.path.parent.parent

    @property
    def count(self) -> int:
        """Number of bodies poured so far, N."""
        return len(self.vertices)

    @property
    def segments(self) -> Array:
        """(M, 2, 3) both ends of all bars, or links, body by body [m]."""
        if self.bars is not None:
            return self.bars.segments
        return np.stack([self.vertices[:, :-1], self.vertices[:, 1:]], axis=2).reshape(-1, 2, 3)

    @property
    def body(self) -> Numbers:
        """(M,) number of the body to which each segment belongs."""
        return np.repeat(np.arange(self.count), LINKS) if self.bars is None else self.bars.body

    @property
    def link(self) -> Numbers:
        """(M,) number of each segment in its body."""
        return np.tile(np.arange(LINKS), self.count) if self.bars is None else self.bars.number

    @property
    def kind(self) -> Numbers:
        """(N,) kind of each body, as index of `Manifest.kinds`; 0 for smarticles."""
        return np.zeros(self.count, np.int64) if self.bars is None else self.bars.kind

    @property
    def normals(self) -> Array | None:
        """(M, 3) normals of bars, zeros where the section is round [1]; None for smarticles."""
        return None if self.bars is None else self.bars.normals

    @cached_property
    def _manifest(self) -> Manifest:
        return Manifest.read(self.directory / MANIFEST)

    @cached_property
    def links(self) -> RecordedPoses:
        """Poses, velocities, masses and inertias of all M bars, or links, in the order of `segments`."""
        return poses_of_bars(self, self._manifest)

    @cached_property
    def bodies(self) -> RecordedPoses:
        """Poses, velocities, masses and inertias of all N bodies."""
        return poses_of_bodies(self, self._manifest, self.links)


def read_frame(path: Path | str, number: int | None = None) -> Frame:
    """Return a frame of a `.vtu` or `.vtkhdf` file; raise InputError if it is missing or damaged.

    The number of the frame in its run is needed for `.vtkhdf`. None: from the name of the file.
    """
    path = Path(path)
    if number is None:
        last = path.stem.rpartition("_")[2]
        number = int(last) if last.isdecimal() else 0
    mesh = read_mesh(path, number=number)

    def reject(cause: str) -> NoReturn:
        cannot_read(f"frame {number} of" if path.suffix == ".vtkhdf" else "frame", path, cause, _remedy(path))

    if [block.type for block in mesh.cells] != ["line"]:
        reject("it must hold one block of lines and no other cells")
    points, lines = np.asarray(mesh.points), np.asarray(mesh.cells[0].data)
    data = {name: np.asarray(values[0]) for name, values in mesh.cell_data.items()}
    general = "kind" in data
    form = _form(points, lines, reject, general=general)

    def per_link(name: str, kind: Any, *shape: int) -> NDArray[Any]:
        """Remove and return cell data by name: (N, 3, …) of smarticles, (M, …) of other bodies.

        Numbers of the type `kind` are returned; `shape` is that of the value of one link: none for a number, 3 for a
        vector.
        """
        values = data.pop(name, None)
        if values is None:
            reject(f"cell data '{name}' is missing")
        if values.shape != (len(lines), *shape):
            reject(f"cell data '{name}' has shape {values.shape}")
        return frozen(values.astype(kind).reshape(*form, *shape))

    def constant(name: str) -> float:
        values = per_link(name, np.float64)
        first = float(values.flat[0])
        if not math.isfinite(first) or np.any(values != first):
            reject(f"'{name}' must be finite and the same for all lines")
        return first

    identifiers, links = per_link("smarticle_id", np.int64), per_link("link", np.int64)
    phase = constant("phase")
    if phase < 0 or phase != math.floor(phase):
        reject(f"'phase' must be a whole number, 0 or more: got {phase:g}")
    points = frozen(points.astype(np.float64))
    if general:
        if np.any(np.diff(identifiers) < 0):
            reject("'smarticle_id' does not go body by body")
        _, first, body = np.unique(identifiers, return_index=True, return_inverse=True)
        bars = RecordedBars(
            segments=points.reshape(-1, 2, 3),
            body=frozen(body),
            number=links,
            kind=frozen(per_link("kind", np.int64)[first]),
            normals=per_link("normal", np.float64, 3),
        )
        vertices = frozen(np.empty((len(first), 0, 3)))
    else:
        if np.any((identifiers != identifiers[:, :1]) | (links != np.arange(LINKS))):
            reject("'smarticle_id' and 'link' are not in smarticle-major order")
        bars, first, vertices = None, LINKS * np.arange(form[0]), points.reshape(-1, VERTICES, 3)
    return Frame(
        path=path,
        number=number,
        time=constant("time_s"),
        floor_z=constant("floor_z_m"),
        phase=int(phase),
        vertices=vertices,
        smarticle_ids=frozen(identifiers.ravel()[first]),
        link_velocity=per_link("velocity_m_per_s", np.float64, 3),
        link_angular_velocity=per_link("angular_velocity_rad_per_s", np.float64, 3),
        contacts=frozen(per_link("contacts", np.int64).ravel()[first]),
        # `data` now holds only what `per_link` has not removed.
        cell_data=MappingProxyType(
            {name: frozen(values.reshape(*form, *values.shape[1:])) for name, values in data.items()}
        ),
        bars=bars,
    )


def _form(
    points: NDArray[Any], lines: NDArray[Any], reject: Callable[[str], NoReturn], *, general: bool
) -> tuple[int, ...]:
    """Return the shape of an array of link values: (N, 3) for smarticles, (M,) for other bodies.

    `reject` is called if points or lines are damaged; `general`: whether the bodies are no smarticles.
    """
    form: tuple[int, ...]
    if general:
        form, expected, joined = (len(lines),), 2 * len(lines), "its own two points"
        order = np.arange(expected).reshape(-1, 2)
    else:
        count = len(lines) // LINKS
        form, expected, joined = (count, LINKS), VERTICES * count, "tip, hinge, hinge, tip"
        order = _lines(count)
    if form[0] == 0:
        reject("it holds no smarticle")
    if points.shape != (expected, 3):
        reject(f"{len(lines)} lines need {expected} points of 3 coordinates: got {points.shape}")
    if not np.array_equal(lines, order):
        reject(f"its lines do not join {joined} in order")
    if not np.all(np.isfinite(points)):
        reject("a point is not finite")
    return form


def read_mesh(path: Path, what: str = "frame", remedy: str | None = None, *, number: int = 0) -> Any:
    """Return the mesh of a VTK file; raise InputError if it cannot be read.

    `what` is the kind of the file, `remedy` the advice for the message; None: that for frames. A `.vtkhdf`, which holds
    all frames, needs the number of the frame in its run.
    """
    if path.suffix == ".vtkhdf":
        return read_step(path, number)
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
