"""Run directories without a simulation: random smarticles in a cylinder, packed to order."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path

import meshio
import numpy as np
import yaml
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from synthetic.series import write_series

W, T1, T2, RADIUS = 0.0117, 0.00127, 0.0005, 0.0234
PHASES = ("deposit", "relax", "shake", "relax")
SETTINGS = {"shape-change": {"straight_deg": 0.0, "opening_s": 1.5, "straight_hold_s": 0.0, "closing_s": 1.5}}
ACTUATED = ("shape-change", "internal-oscillation")


@dataclass(frozen=True, kw_only=True)
class SyntheticRun:
    """What a made-up run is to look like; `packing` is φ at the end of each phase.

    `work` [J] is done steadily during the activity, by the motors or, with "shake", by the container. At the middle of
    a "shape-change" the centre of mass stands `straight` times as high as φ alone would have it. Each phase took
    `wall_s` [s]; `more` are constant series: name, value, unit.
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
    straight: float = 1.0
    status: str = "done"
    series: bool = True
    floor_z: float = 0.0
    name: str = "synthetic"
    wall_s: float = 1.0
    more: tuple[tuple[str, float, str], ...] = ()
    phases: tuple[str, ...] = field(default=PHASES)

    @property
    def solid_volume(self) -> float:
        return T1 * T2 * W * (1 + 2 * self.aspect_ratio)

    def height(self, packing: float) -> float:
        """Second-highest centre of mass [m] that makes this packing fraction."""
        return self.count * self.solid_volume / (math.pi * RADIUS**2 * packing)

    @property
    def durations(self) -> dict[str, float]:
        """How long each type of phase takes [s]."""
        return {
            "deposit": 1.0,
            "relax": 0.5,
            "shake": self.shake_time,
            "shape-change": 3.0,
            "internal-oscillation": self.oscillate_time,
            "pull-hook": 2.0,
            "remove-container": 2.0,
            "strain": 3.0,
        }

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


def u_shape(barb: float, middle: float = W) -> NDArray[np.float64]:
    """(4, 3) [m]: a U in the x-y plane with its centre of mass at the origin."""
    shape = np.array([[-1.0, 0, 0], [-1, 0, 0], [1, 0, 0], [1, 0, 0]]) * middle / 2
    shape[[0, 3], 1] = barb
    shape[:, 1] -= barb**2 / (middle + 2 * barb)
    return shape


def write_frame(
    path: Path,
    vertices: NDArray[np.float64],
    *,
    time: float,
    phase: int,
    floor_z: float = 0.0,
    contacts: NDArray[np.int64] | None = None,
) -> None:
    """One frame as in ARCHITECTURE.md."""
    count = len(vertices)
    first = 4 * np.arange(count)[:, None] + np.arange(3)
    lines = np.stack([first, first + 1], axis=-1).reshape(-1, 2)
    contacts = np.arange(count) % 5 if contacts is None else contacts
    data = {
        "smarticle_id": np.repeat(np.arange(count), 3),
        "link": np.tile(np.arange(3), count),
        "velocity_m_per_s": np.zeros((3 * count, 3)),
        "angular_velocity_rad_per_s": np.zeros((3 * count, 3)),
        "contacts": np.repeat(contacts, 3).astype(np.int64),
        "time_s": np.full(3 * count, time),
        "floor_z_m": np.full(3 * count, floor_z),
        "phase": np.full(3 * count, phase, dtype=np.int64),
    }
    mesh = meshio.Mesh(vertices.reshape(-1, 3), [("line", lines)], cell_data={k: [v] for k, v in data.items()})
    meshio.vtu.write(str(path), mesh)


def write_run(directory: Path, run: SyntheticRun | None = None) -> Path:
    """A whole run directory; returns it."""
    run = run or SyntheticRun()
    directory.mkdir(parents=True, exist_ok=True)
    write_manifest(directory, run)
    _write_scene(directory, run)
    (directory / "frames").mkdir(exist_ok=True)
    entries, rows, timed, start = [], [], [], 0.0
    previous = run.packing[0]
    for index, kind in enumerate(run.phases):
        end = start + run.durations[kind]
        target = run.packing[index]
        # Frames at the end of a phase scatter about its φ; their mean is φ to second order.
        times = np.linspace(start, end, run.frames_per_phase + 1)[1:]
        wobble = 0.002 * np.cos(np.pi * np.arange(run.frames_per_phase))
        for time, shift in zip(times, wobble, strict=True):
            name = f"frames/frame_{len(entries):06d}.vtu"
            vertices = run.vertices(target * (1 + shift))
            write_frame(directory / name, vertices, time=time, phase=index, floor_z=run.floor_z)
            entries.append((time, name))
        for time in np.linspace(start, end, 200)[1:]:
            part = (time - start) / (end - start)
            packing = previous + (target - previous) * (1 - math.exp(-5 * part))
            rise = 1 + (run.straight - 1) * (1 - abs(2 * part - 1)) if kind == "shape-change" else 1.0
            active = kind not in ("deposit", "relax")
            done = part if active else float(any(row[4] > 0 for row in rows))
            rows.append((time, index, packing, run.shares().mean() * run.height(packing) * rise, done))
        timed.append(
            {"index": index, "type": kind, "start_s": start, "end_s": end, "wall_s": run.wall_s, "cpu_s": run.wall_s}
        )
        start, previous = end, target
    sets = "".join(f'<DataSet timestep="{t!r}" file="{n}"/>' for t, n in map(_plain, entries))
    (directory / "frames.pvd").write_text(f'<VTKFile type="Collection"><Collection>{sets}</Collection></VTKFile>')
    if run.series:
        _write_series(directory, run, np.array(rows))
    if run.status == "done":
        wall = run.wall_s * len(run.phases)
        done = {"status": "done", "time_s": start, "steps": 1000, "wall_s": wall, "phases": timed}
        (directory / "done.json").write_text(json.dumps(done))
    elif run.status != "unfinished":
        failed = {"status": run.status, "cause": "a smarticle escaped", "time_s": start}
        (directory / "failed.json").write_text(json.dumps(failed))
    return directory


def _plain(entry: tuple[float, str]) -> tuple[float, str]:
    return float(entry[0]), entry[1]


def write_manifest(directory: Path, run: SyntheticRun) -> None:
    manifest = {
        "format": 1,
        "name": run.name,
        "scene_sha256": f"{round(1000 * run.aspect_ratio):032x}{run.seed:032x}",
        "seed": run.seed,
        "command": "smarticles run scene.yaml",
        "started": "2026-11-21T12:00:00+00:00",
        "versions": {
            "smarticles": "0.1.0",
            "git": "0e4b151",
            "yade": "2023.02a",
            "numpy": "2",
            "python": "3.11",
        },
        "threads": 1,
        "fidelity": run.fidelity,
        "count": run.count,
        "aspect_ratio": run.aspect_ratio,
        "middle_length_m": W,
        "barb_length_m": run.aspect_ratio * W,
        "thickness_normal_m": T1,
        "thickness_in_plane_m": T2,
        "smarticle_mass_kg": 7850 * run.solid_volume,
        "solid_volume_m3": run.solid_volume,
        "container_radius_m": RADIUS,
        "sphere_diameter_m": T1,
        "spheres_per_smarticle": 22,
        "time_step_s": 1e-5,
        "phases": [{"index": i, "type": kind} for i, kind in enumerate(run.phases)],
    }
    (directory / "run.json").write_text(json.dumps(manifest))


def _write_scene(directory: Path, run: SyntheticRun) -> None:
    settings = {"internal-oscillation": {"theta_deg": run.theta, "scaled": True}, **SETTINGS}
    phases = [{"type": kind, **settings.get(kind, {"duration_s": run.durations[kind]})} for kind in run.phases]
    (directory / "scene.yaml").write_text(yaml.safe_dump({"schema_version": 1, "phases": phases}))


def _write_series(directory: Path, run: SyntheticRun, rows: NDArray[np.float64]) -> None:
    columns = {
        "time_s": (rows[:, 0], "s"),
        "phase": (rows[:, 1].astype(np.int64), "-"),
        "packing_fraction": (rows[:, 2], "-"),
        "com_height_m": (rows[:, 3], "m"),
    }
    moved = [kind for kind in run.phases if kind in ACTUATED]
    if moved:
        angle = np.full((len(rows), 2), math.pi / 2)
        columns |= {"commanded_angle_rad": (angle, "rad"), "angle_rad": (angle, "rad")}
        columns |= {"tracking_error_rad": (np.full(len(rows), math.nan), "rad")}
    if run.work is not None:
        columns["motor_work_J" if moved else "container_work_J"] = (run.work * rows[:, 4], "J")
    columns |= {name: (np.full(len(rows), value), unit) for name, value, unit in run.more}
    write_series(directory, columns, seed=run.seed)
