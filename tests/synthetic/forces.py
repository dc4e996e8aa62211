"""Forces at contacts made to order, beside the frames of a run."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dem.body.forces import ContactForces, at_boundaries, at_links, contacts_of_points
from dem.record.forces import force_mesh
from dem.record.frames import FrameWriter, read_frames
from dem.record.names import FORCE
from postprocess.geometry.links import centres_of_mass


def pressed(pairs: Sequence[tuple[int, int]], loads: Sequence[float], points: object = None) -> ContactForces:
    """Contacts of middle links of pairs of smarticles, pressed upwards [N]; a second one below 0 is a boundary."""
    first, second = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    ones = np.ones_like(first)
    forces = np.array(loads, dtype=float)[:, None] * [0.0, 0.0, 1.0]
    return contacts_of_points(
        at_links(first, ones),
        np.where(second < 0, at_boundaries(-1 - second), at_links(second, ones)),
        loads=np.array(loads, dtype=float),
        points=np.zeros((len(first), 3)) if points is None else np.asarray(points, dtype=float),
        friction=0.1 * np.roll(forces, 1, axis=1),
        forces=forces + 0.1 * np.roll(forces, 1, axis=1),
    )


def write_forces(directory: Path, found: ContactForces) -> None:
    """Write these forces with every frame of a run."""
    writer = FrameWriter(directory, FORCE)
    for frame in read_frames(directory):
        centres = centres_of_mass(frame.vertices)
        writer.write(force_mesh(found, centres, time=frame.time, phase=frame.phase), frame.time)
