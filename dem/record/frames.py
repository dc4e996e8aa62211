"""Frames: one small VTK file per recorded time, and the ParaView collection that lists them; spheres the same way.

The format is the contract with `postprocess`; ARCHITECTURE.md describes it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import meshio
import numpy as np
from numpy.typing import NDArray

from dem.body.particle import LINKS, Particle
from dem.body.state import State
from dem.record import names
from dem.record.files import write_text, write_whole

Array = NDArray[np.float64]

VERTICES = 4


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
    n = state.count
    first = VERTICES * np.arange(n)[:, None] + np.arange(LINKS)
    lines = np.stack([first, first + 1], axis=-1).reshape(-1, 2)
    number = LINKS * n
    data = {
        "smarticle_id": np.repeat(np.arange(n), LINKS),
        "link": np.tile(np.arange(LINKS), n),
        "velocity_m_per_s": state.link_velocities.reshape(-1, 3),
        "angular_velocity_rad_per_s": state.link_spins.reshape(-1, 3),
        "contacts": np.repeat(contacts, LINKS),
        "time_s": np.full(number, time),
        "floor_z_m": np.full(number, floor),
        "phase": np.full(number, phase, dtype=np.int64),
    }
    if hinged:
        none = np.full((n, 2), np.nan)
        data |= {
            "angle_rad": _per_link(state.angles),
            "motor_torque_N_m": _per_link(none if torques is None else torques),
            "motor_work_J": _per_link(none if work is None else work),
            "halted": np.nan_to_num(_per_link(none if halted is None else halted)).astype(np.int64),
        }
    return meshio.Mesh(
        state.vertices.reshape(-1, 3),
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


@dataclass
class FrameWriter:
    """Writes frames into a run directory, and rewrites its `frames.pvd` at each.

    Args:
        folder: the run directory.
        noun: what one file is called; "sphere": `spheres.pvd` and `spheres/sphere_000000.vtu` and so on.
        times: times [s] of the frames written so far.
    """

    folder: Path
    noun: str = names.FRAME
    times: list[float] = field(default_factory=list)

    def write(self, mesh: meshio.Mesh, time: float) -> None:
        """Write one frame.

        Raises:
            RunError: it cannot be written.
        """
        name = names.member(self.noun, len(self.times))
        write_whole(self.folder / name, lambda path: mesh.write(path, file_format="vtu"))
        self.times.append(time)
        write_text(self.folder / names.collection(self.noun), self._collection())

    def truncate(self, times: Sequence[float]) -> None:
        """Keep the first frames only, of the given times [s]; later files are removed."""
        self.times = list(times)
        kept = {self.folder / names.member(self.noun, k) for k in range(len(self.times))}
        for path in set((self.folder / names.folder(self.noun)).glob("*.vtu")) - kept:
            path.unlink()
        write_text(self.folder / names.collection(self.noun), self._collection())

    def _collection(self) -> str:
        rows = [
            f'    <DataSet timestep="{time:.9g}" group="" part="0" file={quoteattr(names.member(self.noun, k))}/>'
            for k, time in enumerate(self.times)
        ]
        head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
        return head + "  <Collection>\n" + "\n".join(rows) + "\n  </Collection>\n</VTKFile>\n"
