"""What the driver wrote, as a run directory: so that measures of ours see Chrono's piles as they see any other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from dem.body.particle import LINKS, Boxes
from dem.body.state import State
from dem.errors import InputError
from dem.record.columns import COLUMNS, ENERGY_COLUMNS, MOTOR_COLUMNS
from dem.record.files import write_text
from dem.record.frame import frame_mesh
from dem.record.frames import FrameWriter
from dem.record.manifest import mark_done, write_manifest
from dem.record.names import SCENE
from dem.record.packing import packing_fraction
from dem.record.series import SeriesWriter
from dem.run.run import manifest
from dem.scene.reading import dump_scene, scene_hash
from dem.scene.scene import Scene

Array = NDArray[np.float64]

HEAD, LINK, BARB = 5, 13, 4  # numbers of a row: of the whole pile, of each link, of each barb
BARBS = 2
PHASES, ACTIVITY = 4, 2  # of the scene: settling after the take-over, rest, activity, rest; and the third one's index

TOLD = (
    *("time_s", "phase", "count", "container_z_m", "com_height_m", "kinetic_energy_J", "max_speed_m_per_s"),
    *("packing_fraction", "angle_rad", "motor_torque_N_m", "halted_fraction", "motor_work_J", "gravitational_energy_J"),
)
"""Columns of the series that the driver's records can fill."""


@dataclass(frozen=True, eq=False)
class Records:
    """A simulation from look to look; R of them.

    Args:
        time: (R,) since the beginning [s].
        wall: (R,) wall time [s].
        contacts: (R,) points of contact [1].
        deepest: (R,) greatest overlap of two bodies, by the engine [m].
        phase: (R,) index in the scene: 0 settling, 1 rest, 2 activity, 3 rest.
        links: (R, N, 3, 13) place, quaternion with the scalar first, velocity, spin [m, 1, m/s, rad/s].
        barbs: (R, N, 2, 4) angle, torque, work, halted [rad, N m, J, 1].
        neighbours: (R, N) other smarticles that each touches [1].
    """

    time: Array
    wall: Array
    contacts: Array
    deepest: Array
    phase: NDArray[np.int64]
    links: Array
    barbs: Array
    neighbours: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.time)

    def state(self, look: int, boxes: Boxes) -> State:
        """All smarticles at a look."""
        row = self.links[look]
        turns = Rotation.from_quat(row[..., [4, 5, 6, 3]].reshape(-1, 4)).as_matrix().reshape(*row.shape[:2], 3, 3)
        return State(boxes, row[..., :3], turns, row[..., 7:10], row[..., 10:13])


def read_records(path: Path, count: int) -> Records:
    """The rows of doubles that the driver wrote; a last one that it did not finish is left out.

    Args:
        path: of the driver's file, or of its part so far.
        count: smarticles.

    Raises:
        InputError: Rows are of another number of smarticles, or not at even times, as where two processes wrote them.
    """
    width = HEAD + count * (LINKS * LINK + BARBS * BARB + 1)
    values = np.fromfile(path, dtype=np.float64)
    rows = values[: len(values) // width * width].reshape(-1, width)
    steps = np.diff(rows[:, 0])
    if len(rows) < 2 or not np.isfinite(rows).all() or not np.allclose(steps, steps[0], rtol=1e-6) or steps[0] <= 0:
        msg = (
            f"{path}: {len(values)} numbers are no rows of {width}, those of {count} smarticles at even times; remove "
            "it, and run it again"
        )
        raise InputError(msg)
    links_end = HEAD + count * LINKS * LINK
    barbs_end = links_end + count * BARBS * BARB
    return Records(
        time=rows[:, 0],
        wall=rows[:, 1],
        contacts=rows[:, 2],
        deepest=-rows[:, 3],
        phase=rows[:, 4].astype(np.int64),
        links=rows[:, HEAD:links_end].reshape(-1, count, LINKS, LINK),
        barbs=rows[:, links_end:barbs_end].reshape(-1, count, BARBS, BARB),
        neighbours=rows[:, barbs_end:].astype(np.int64),
    )


def tilts(state: State) -> Array:
    """(N, 2) angles by which hinges let barbs out of the plane of their smarticle [rad]; 0 of a hinge that holds."""
    normals = state.link_rotations[..., 2]
    cosines = np.einsum("nki,ni->nk", normals[:, [0, 2]], normals[:, 1])
    angles: Array = np.arccos(np.clip(cosines, -1.0, 1.0))
    return angles


def constraints(records: Records, scene: Scene, every: int) -> dict[str, float]:
    """How well the solver held hinges, motors and contacts during the activity.

    Args:
        records: the whole of it.
        scene: take-over, rest, activity, rest.
        every: looks from one that is taken to the next.
    """
    looks = np.flatnonzero(records.phase == ACTIVITY)[::every]
    tilted = np.array([tilts(records.state(int(look), scene.particle.boxes)) for look in looks])
    torque = np.abs(records.barbs[looks, ..., 1]) / float(scene.torque_limit)
    return {
        "mean_tilt_rad": float(tilted.mean()),
        "largest_tilt_rad": float(tilted.max()),
        "over_limit_share": float((torque >= 1).mean()),
        "greatest_torque_over_limit": float(torque.max()),
        "deepest_m": float(records.deepest[records.phase > 0].max()),
    }


def write_run(
    records: Records, scene: Scene, out: Path, *, frame_every: int, time_step: float, version: str, command: str
) -> None:
    """A run directory of what Chrono simulated.

    Args:
        records: the whole of it.
        scene: take-over, rest, activity, rest.
        out: the run directory, made here.
        frame_every: looks from one frame to the next.
        time_step: dt [s].
        version: of the engine.
        command: for the manifest.
    """
    out.mkdir(parents=True, exist_ok=True)
    boxes = scene.particle.boxes
    made = manifest(
        scene, out, steps=[time_step] * len(scene.phases), command=command, made_by=("chrono", version), threads=1
    )
    write_manifest(replace(made, engine="chrono", fidelity="-"))
    write_text(out / SCENE, dump_scene(scene, out))
    known = {**COLUMNS, **MOTOR_COLUMNS, **ENERGY_COLUMNS}
    described = {name: known[name] for name in TOLD}
    series = SeriesWriter(out, described, {"scene_sha256": scene_hash(scene), "seed": scene.seed})
    frames = FrameWriter(out)
    for look in range(len(records)):
        state, barbs = records.state(look, boxes), records.barbs[look]
        phase, time = int(records.phase[look]), float(records.time[look])
        series.add(_row(state, barbs, scene, phase=phase, time=time))
        if look % frame_every == 0:
            acting = phase == ACTIVITY
            mesh = frame_mesh(
                state,
                contacts=records.neighbours[look],
                time=time,
                floor=0.0,
                phase=phase,
                hinged=True,
                torques=barbs[..., 1] if acting else None,
                work=barbs[..., 2],
                halted=barbs[..., 3] > 0 if acting else None,
            )
            frames.write(mesh, time)
    series.write()
    wall = float(records.wall[-1])
    mark_done(
        out,
        time=float(records.time[-1]),
        steps=round(float(records.time[-1]) / time_step),
        wall=wall,
        cpu=wall,
        phases=_spans(records, scene),
    )


def _row(state: State, barbs: Array, scene: Scene, *, phase: int, time: float) -> dict[str, Any]:
    boxes, heights = scene.particle.boxes, state.positions[:, 2]
    acting = phase == ACTIVITY
    return {
        "time_s": time,
        "phase": phase,
        "count": state.count,
        "container_z_m": 0.0,
        "com_height_m": heights.mean(),
        "kinetic_energy_J": state.kinetic_energy,
        "max_speed_m_per_s": np.linalg.norm(state.velocities, axis=1).max(),
        "packing_fraction": packing_fraction(
            heights, solid_volume=boxes.volume, radius=scene.container.measured_radius
        ),
        "angle_rad": barbs[..., 0].mean(axis=0),
        "motor_torque_N_m": np.sqrt(np.square(barbs[..., 1]).mean()) if acting else np.nan,
        "halted_fraction": barbs[..., 3].mean() if acting else np.nan,
        "motor_work_J": barbs[..., 2].sum(),
        "gravitational_energy_J": state.potential_energy(scene.gravity_m_per_s2, 0.0),
    }


def _spans(records: Records, scene: Scene) -> list[Mapping[str, Any]]:
    """Of each phase when it began and ended."""
    lasts = [int(np.flatnonzero(records.phase == k)[-1]) for k in range(PHASES)]
    ends, walls = records.time[lasts].tolist(), records.wall[lasts].tolist()
    spans: list[Mapping[str, Any]] = []
    begun = spent = 0.0
    for index, (phase, end, wall) in enumerate(zip(scene.phases, ends, walls, strict=True)):
        span = {"index": index, "type": phase.kind, "start_s": begun, "end_s": end}
        spans.append({**span, "wall_s": wall - spent, "cpu_s": wall - spent})
        begun, spent = end, wall
    return spans
