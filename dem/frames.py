"""Frames: one small VTK file per recorded time, and the ParaView collection that lists them.

The format is the contract with `postprocess`; ARCHITECTURE.md describes it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.sax.saxutils import quoteattr

import meshio
import numpy as np
from numpy.typing import NDArray

from dem.engine import State
from dem.files import write_text, write_whole
from dem.particle import LINKS, Boxes

Array = NDArray[np.float64]

VERTICES = 4


def frame_mesh(
    boxes: Boxes,
    state: State,
    *,
    contacts: NDArray[np.int64],
    time: float,
    floor: float,
    phase: int,
) -> meshio.Mesh:
    """One frame as a mesh of lines.

    Args:
        boxes: one smarticle.
        state: all smarticles at this time.
        contacts: (N,) how many others each smarticle touches.
        time: simulated time [s].
        floor: height of the container's floor [m].
        phase: index of the phase.
    """
    n = len(state.positions)
    vertices = state.points(boxes.vertices)
    centres = (vertices[:, :-1] + vertices[:, 1:]) / 2
    arms = centres - state.positions[:, None]
    velocities = state.velocities[:, None] + np.cross(state.angular_velocities[:, None], arms)
    first = VERTICES * np.arange(n)[:, None] + np.arange(LINKS)
    lines = np.stack([first, first + 1], axis=-1).reshape(-1, 2)
    number = LINKS * n
    data = {
        "smarticle_id": np.repeat(np.arange(n), LINKS),
        "link": np.tile(np.arange(LINKS), n),
        "velocity_m_per_s": velocities.reshape(-1, 3),
        "angular_velocity_rad_per_s": np.repeat(state.angular_velocities, LINKS, axis=0),
        "contacts": np.repeat(contacts, LINKS),
        "time_s": np.full(number, time),
        "floor_z_m": np.full(number, floor),
        "phase": np.full(number, phase, dtype=np.int64),
    }
    return meshio.Mesh(
        vertices.reshape(-1, 3),
        [("line", lines)],
        cell_data={name: [values] for name, values in data.items()},
    )


@dataclass
class FrameWriter:
    """Writes frames into a run directory, and rewrites its `frames.pvd` at each.

    Args:
        folder: the run directory.
        times: times [s] of the frames written so far.
    """

    folder: Path
    times: list[float] = field(default_factory=list)

    def write(self, mesh: meshio.Mesh, time: float) -> None:
        """Write one frame.

        Raises:
            RunError: it cannot be written.
        """
        name = _name(len(self.times))
        write_whole(self.folder / name, lambda path: mesh.write(path, file_format="vtu"))
        self.times.append(time)
        write_text(self.folder / "frames.pvd", self._collection())

    def truncate(self, times: Sequence[float]) -> None:
        """Keep the first frames only, of the given times [s]; later files are removed."""
        self.times = list(times)
        kept = {self.folder / _name(k) for k in range(len(self.times))}
        for path in set((self.folder / "frames").glob("*.vtu")) - kept:
            path.unlink()
        write_text(self.folder / "frames.pvd", self._collection())

    def _collection(self) -> str:
        rows = [
            f'    <DataSet timestep="{time:.9g}" group="" part="0" file={quoteattr(_name(k))}/>'
            for k, time in enumerate(self.times)
        ]
        head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
        return head + "  <Collection>\n" + "\n".join(rows) + "\n  </Collection>\n</VTKFile>\n"


def _name(number: int) -> str:
    return f"frames/frame_{number:06d}.vtu"
