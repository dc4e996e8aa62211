"""Run directories without a simulation: random smarticles in a cylinder, packed to order."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import yaml
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from dem.record.columns import EVERY
from dem.record.document import Done, Failed, Manifest, Phase
from dem.record.frame import centreline_mesh, read_mesh
from dem.record.frames import FrameWriter, OneFileWriter, read_frames
from dem.record.series import SeriesWriter
from synthetic.shapes import RADIUS, T1, T2, W, u_shape

PHASES = ("deposit", "relax", "shake", "relax")
SETTINGS = {"shape-change": {"straight_deg": 0.0, "opening_s": 1.5, "straight_hold_s": 0.0, "closing_s": 1.5}}
ACTUATED = ("shape-change", "internal-oscillation")


@dataclass(frozen=True, kw_only=True)
class SyntheticRun:
    """A made-up run; `packing` is φ at the end of each phase.

    `work` [J] is done steadily during the activity, by the motors or, with "shake", by the container. Each phase took
    `wall_s` [s]; `more` are constant series: name, value. The scene has a contact where there is a `friction`, which
    walls share unless they have their own.
    """

    aspect_ratio: float = 0.7
    seed: int = 1
    count: int = 12
    fidelity: str = "draft"
    packing: tuple[float, float, float, float] = (0.100, 0.105, 0.130, 0.132)
    frames_per_phase: int = 4
    shake_time: float = 20.0
    oscillate_time: float = 5.0
    theta: float = 10.0
    work: float | None = None
    status: str = "done"
    series: bool = True
    floor_z: float = 0.0
    name: str = "synthetic"
    wall_s: float = 1.0
    more: tuple[tuple[str, float], ...] = ()
    friction: float | None = None
    friction_wall: float | None = None
    phases: tuple[str, ...] = field(default=PHASES)

    @property
    def solid_volume(self) -> float:
        return T1 * T2 * W * (1 + 2 * self.aspect_ratio)

    def height(self, packing: float) -> float:
        """Second-highest centre of mass [m] that makes this packing fraction."""
        return self.count * self.solid_volume / (math.pi * RADIUS**2 * packing)

    @property
    def durations(self) -> dict[str, float]:
        """Duration of each type of phase [s]."""
        fixed = {"deposit": 1.0, "relax": 0.5, "shape-change": 3.0, "pull-hook": 2.0, "remove-container": 2.0}
        driven = {"shake": self.shake_time, "internal-oscillation": self.oscillate_time}
        return {**fixed, **driven, "arrange": 1.0, "strain": 3.0, "tension": 2.0}

    def shares(self) -> NDArray[np.float64]:
        """(N,) centres of mass over the second-highest one."""
        return self._poses()[2]

    def _poses(self) -> tuple[np.random.Generator, NDArray[np.float64], NDArray[np.float64]]:
        """A random generator with which to go on, (N, 3, 3) rotations and (N,) shares of the height."""
        random = np.random.default_rng(self.seed)
        turn = Rotation.random(self.count, rng=random).as_matrix()
        share = np.sort(random.uniform(0.0, 1.0, self.count))
        share[-2:] = 1.0
        return random, turn, share

    def vertices(self, packing: float) -> NDArray[np.float64]:
        """(N, 4, 3) [m]; the two highest centres of mass share the height that φ asks for."""
        random, turn, share = self._poses()
        radius = (RADIUS - 0.8 * W) * np.sqrt(random.uniform(0.0, 1.0, self.count))
        angle = random.uniform(0, 2 * math.pi, self.count)
        z = share * self.height(packing) + self.floor_z
        centres = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)
        shape = u_shape(self.aspect_ratio * W)
        return centres[:, None] + np.einsum("nij,kj->nki", turn, shape)


def mesh_of(
    vertices: NDArray[np.float64],
    *,
    time: float = 0.0,
    phase: int = 0,
    floor_z: float = 0.0,
    contacts: ArrayLike | None = None,
    extra: Mapping[str, NDArray[Any]] | None = None,
) -> meshio.Mesh:
    """One frame of smarticles at rest."""
    count = len(vertices)
    return centreline_mesh(
        vertices,
        velocities=np.zeros((count, 3, 3)),
        spins=np.zeros((count, 3, 3)),
        contacts=np.arange(count) % 5 if contacts is None else np.asarray(contacts),
        time=time,
        floor=floor_z,
        phase=phase,
        extra=extra,
    )


def write_frame(path: Path, vertices: NDArray[np.float64], **content: Any) -> None:
    """One frame file; keywords as `mesh_of`."""
    meshio.vtu.write(str(path), mesh_of(vertices, **content))


def write_series(directory: Path, columns: Mapping[str, ArrayLike], *, seed: int, scene_sha256: str = "0" * 64) -> None:
    """Write `series.h5` with some of its columns, and all their samples."""
    described = {name: EVERY[name] for name in columns}
    writer = SeriesWriter(directory, described, {"scene_sha256": scene_sha256, "seed": seed})
    writer.restore({name: np.asarray(values) for name, values in columns.items()})
    writer.write()


def write_run(directory: Path, run: SyntheticRun | None = None) -> Path:
    """A whole run directory; returns it."""
    run = run or SyntheticRun()
    directory.mkdir(parents=True, exist_ok=True)
    write_manifest(directory, run)
    _write_scene(directory, run)
    frames, rows, spans, start = FrameWriter(directory), [], [], 0.0
    previous = run.packing[0]
    for index, kind in enumerate(run.phases):
        end = start + run.durations[kind]
        target = run.packing[index]
        # Frames at the end of a phase scatter about its φ; their mean is φ to second order.
        times = np.linspace(start, end, run.frames_per_phase + 1)[1:].tolist()
        wobble = 0.002 * np.cos(np.pi * np.arange(run.frames_per_phase))
        for time, shift in zip(times, wobble, strict=True):
            vertices = run.vertices(target * (1 + shift))
            frames.write(mesh_of(vertices, time=time, phase=index, floor_z=run.floor_z), time)
        for time in np.linspace(start, end, 200)[1:]:
            part = (time - start) / (end - start)
            packing = previous + (target - previous) * (1 - math.exp(-5 * part))
            active = kind not in ("deposit", "relax")
            done = part if active else float(any(row[4] > 0 for row in rows))
            rows.append((time, index, packing, run.shares().mean() * run.height(packing), done))
        spans.append((start, end))
        start, previous = end, target
    if run.series:
        _write_series(directory, run, np.array(rows))
    write_ending(directory, run.phases, spans, status=run.status, wall=run.wall_s)
    return directory


def write_ending(
    directory: Path, phases: Sequence[str], spans: Iterable[tuple[float, float]], *, status: str, wall: float
) -> None:
    """Write `done.json`, `failed.json`, or neither, by status; `spans` are start and end of each phase [s].

    Each phase took `wall` of wall and processor time [s].
    """
    timed = [
        {"index": k, "type": kind, "start_s": float(start), "end_s": float(end), "wall_s": wall, "cpu_s": wall}
        for k, (kind, (start, end)) in enumerate(zip(phases, spans, strict=True))
    ]
    end, total = timed[-1]["end_s"], wall * len(timed)
    if status == "done":
        phases = tuple(Phase(**one) for one in timed)
        Done(time_s=end, steps=1000, wall_s=total, cpu_s=total, phases=phases).mark(directory)
    elif status != "unfinished":
        Failed(status=status, cause="a smarticle escaped", time_s=end).mark(directory)


def write_manifest(directory: Path, run: SyntheticRun, **more: Any) -> None:
    """`run.json`; `more` are further fields of `Manifest`."""
    manifest = Manifest(
        name=run.name,
        scene_sha256=f"{round(1000 * run.aspect_ratio):032x}{run.seed:032x}",
        seed=run.seed,
        command="smarticles run scene.yaml",
        started="2026-11-21T12:00:00+00:00",
        versions={"smarticles": "0.1.0", "git": "0e4b151", "yade": "2023.02a", "numpy": "2", "python": "3.11"},
        threads=1,
        fidelity=run.fidelity,
        count=run.count,
        aspect_ratio=run.aspect_ratio,
        middle_length_m=W,
        barb_length_m=run.aspect_ratio * W,
        thickness_normal_m=T1,
        thickness_in_plane_m=T2,
        smarticle_mass_kg=7850 * run.solid_volume,
        solid_volume_m3=run.solid_volume,
        container_radius_m=RADIUS,
        sphere_diameter_m=T1,
        spheres_per_smarticle=22,
        time_step_s=1e-5,
        engine="yade",
        phases=tuple(Phase(index=k, type=kind, time_step_s=1e-5) for k, kind in enumerate(run.phases)),
    )
    Manifest(**{**dict(manifest), **more}).write(directory / "run.json")


def _write_scene(directory: Path, run: SyntheticRun) -> None:
    settings = {"internal-oscillation": {"theta_deg": run.theta, "scaled": True}, **SETTINGS}
    phases = [{"type": kind, **settings.get(kind, {"duration_s": run.durations[kind]})} for kind in run.phases]
    scene: dict[str, Any] = {"schema_version": 1, "phases": phases}
    if run.friction is not None:
        wall = run.friction if run.friction_wall is None else run.friction_wall
        contact = {"friction_smarticle": run.friction, "friction_wall": wall, "restitution": 0.7}
        scene["contact"] = contact
    (directory / "scene.yaml").write_text(yaml.safe_dump(scene))


def _write_series(directory: Path, run: SyntheticRun, rows: NDArray[np.float64]) -> None:
    columns = {
        "time_s": rows[:, 0],
        "phase": rows[:, 1].astype(np.int64),
        "packing_fraction": rows[:, 2],
        "com_height_m": rows[:, 3],
    }
    moved = [kind for kind in run.phases if kind in ACTUATED]
    if moved:
        angle = np.full((len(rows), 2), math.pi / 2)
        columns |= {"commanded_angle_rad": angle, "angle_rad": angle}
        columns |= {"tracking_error_rad": np.full(len(rows), math.nan)}
    if run.work is not None:
        columns["motor_work_J" if moved else "container_work_J"] = run.work * rows[:, 4]
    columns |= {name: np.full(len(rows), value) for name, value in run.more}
    write_series(directory, columns, seed=run.seed)


def write_ended(directory: Path, scene_sha256: str, *, status: str = "done") -> None:
    """Write what sweeps read of a run that has ended: its manifest and its end."""
    directory.mkdir(parents=True)
    write_manifest(directory, SyntheticRun(phases=("deposit",)), scene_sha256=scene_sha256)
    write_ending(directory, ("deposit",), [(0.0, 1.0)], status=status, wall=2.0)


def put_into_one_file(directory: Path) -> None:
    """Replace the frames of a run, `.vtu`, by one file with the same content."""
    frames = read_frames(directory)
    writer = OneFileWriter(directory, radii=[T2 / 2] * 3)
    for number, path in enumerate(frames.paths):
        writer.write(read_mesh(path), float(frames.times[number]))
    FrameWriter(directory).truncate([])
    (directory / "frames.pvd").unlink()
