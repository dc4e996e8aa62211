"""LAMMPS (Debian's `lmp`) with the deck of `smarticles export --to lammps`: rigid bodies of spheres."""

import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.rivals.task import ACTIVITY, CREEP, Array, Knobs, Outcome, Task, rigid_links
from dem.deck import DECK, DUMP, write_deck
from dem.plan.steps import time_steps

LOOP = re.compile(r"^Loop time of (\S+) on 1 procs", re.MULTILINE)
SHARE = re.compile(r"^(\S+)% CPU use", re.MULTILINE)


def simulate(task: Task, knobs: Knobs) -> Outcome:
    """Simulate a task; `knobs` are empty. The last `run` command of the deck is the activity."""
    folder, scene = Path(task.folder) / "deck", task.scene
    write_deck(scene, folder)
    subprocess.run([shutil.which("lmp") or "lmp", "-in", DECK], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    log = (folder / "log.lammps").read_text(encoding="utf-8")
    times, places, turns = _dumped(folder / DUMP, task)
    dt = min(time_steps(scene))
    activity = round(task.activity_s / task.sample_s)
    start = len(times) - activity - 1
    links = [rigid_links(task.boxes, place, turn) for place, turn in zip(places, turns, strict=True)]
    rested = start - round(CREEP / task.sample_s)
    # Positions relative to the floor, which moves.
    floors = [np.array([0.0, 0.0, task.floor(time - times[start])]) for time in times]
    shaken = [(links[k][0] - floors[k], links[k][1]) for k in range(start + 1, len(times))]
    positions, frames = (np.array(each) for each in zip(links[rested], links[start], *shaken, strict=True))
    return Outcome(
        time_step=dt,
        processor_s=float(LOOP.findall(log)[ACTIVITY]) * float(SHARE.findall(log)[ACTIVITY]) / 100,
        positions=positions,
        frames=frames,
        version=log.splitlines()[0].strip("()"),
    )


def _dumped(path: Path, task: Task) -> tuple[Array, Array, Array]:
    """Read times (F,) [s], centres of mass (F, N, 3) [m] and rotations (F, N, 3, 3) from a dump of a task.

    Rotations are from body frame to laboratory frame.
    """
    times, rows = zip(*_blocks(path), strict=True)
    table = np.array(rows)
    quaternions = Rotation.from_quat(table[:, :, [8, 9, 10, 7]].reshape(-1, 4)).as_matrix()
    turned = quaternions.reshape(*table.shape[:2], 3, 3)
    # LAMMPS chooses the principal axes; the first frame gives their orientation in the body frame of this project.
    own = np.swapaxes(turned[0], 1, 2) @ task.turns
    return np.array(times) * min(time_steps(task.scene)), table[:, :, 1:4], turned @ own


def _blocks(path: Path) -> Iterator[tuple[int, Array]]:
    """Yield the step and the rows of each frame in a dump.

    Rows are sorted by the number of the smarticle, which is their first column; the others are centre of mass, velocity
    and quaternion (w, x, y, z).
    """
    text = path.read_text(encoding="utf-8")
    for block in text.split("ITEM: TIMESTEP\n")[1:]:
        lines = block.splitlines()
        start = next(k for k, line in enumerate(lines) if line.startswith("ITEM: ENTRIES")) + 1
        rows = np.array([[float(word) for word in line.split()] for line in lines[start:]])
        yield int(lines[0]), rows[np.argsort(rows[:, 0])]
