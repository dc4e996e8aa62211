"""LAMMPS (Debian's `lmp`), on the deck that `smarticles export --to lammps` writes: rigid bodies of spheres."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.rivals.given import ACTIVITY, CREEP, Array, Given, Knobs, Outcome, rigid_links
from dem.deck import DECK, DUMP, write_deck
from dem.plan.steps import time_steps

LOOP = re.compile(r"^Loop time of (\S+) on 1 procs", re.MULTILINE)
SHARE = re.compile(r"^(\S+)% CPU use", re.MULTILINE)


def simulate(given: Given, knobs: Knobs) -> Outcome:
    """Simulate; knobs are those of the scene already. The deck's last run is the activity."""
    folder, scene = Path(given.folder) / "deck", given.scene
    write_deck(scene, folder)
    subprocess.run([shutil.which("lmp") or "lmp", "-in", DECK], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    log = (folder / "log.lammps").read_text(encoding="utf-8")
    times, places, turns = _dumped(folder / DUMP, given)
    dt = min(time_steps(scene))
    activity = round(given.activity_s / given.look_s)
    begun = len(times) - activity - 1
    links = [rigid_links(given.boxes, place, turn) for place, turn in zip(places, turns, strict=True)]
    rested = begun - round(CREEP / given.look_s)
    shaken = [(_seen(given, times[k] - times[begun], links[k][0]), links[k][1]) for k in range(begun + 1, len(times))]
    positions, frames = (np.array(each) for each in zip(links[rested], links[begun], *shaken, strict=True))
    return Outcome(
        time_step=dt,
        processor_s=float(LOOP.findall(log)[ACTIVITY]) * float(SHARE.findall(log)[ACTIVITY]) / 100,
        positions=positions,
        frames=frames,
        version=log.splitlines()[0].strip("()"),
    )


def _seen(given: Given, time_s: float, positions: Array) -> Array:
    """From the container, whose floor has moved."""
    seen: Array = positions - np.array([0.0, 0.0, given.floor(time_s)])
    return seen


def _dumped(path: Path, given: Given) -> tuple[Array, Array, Array]:
    """(F,) times [s], (F, N, 3) centres of mass [m], (F, N, 3, 3) rotations, body frame to laboratory frame."""
    times, rows = zip(*_blocks(path), strict=True)
    table = np.array(rows)
    quaternions = Rotation.from_quat(table[:, :, [8, 9, 10, 7]].reshape(-1, 4)).as_matrix()
    turned = quaternions.reshape(*table.shape[:2], 3, 3)
    # LAMMPS chooses principal axes of its own; the first frame tells how they lie in ours.
    own = np.swapaxes(turned[0], 1, 2) @ given.turns
    return np.array(times) * min(time_steps(given.scene)), table[:, :, 1:4], turned @ own


def _blocks(path: Path) -> Iterator[tuple[int, Array]]:
    """Step and rows, sorted by number, of each time."""
    text = path.read_text(encoding="utf-8")
    for block in text.split("ITEM: TIMESTEP\n")[1:]:
        lines = block.splitlines()
        start = next(k for k, line in enumerate(lines) if line.startswith("ITEM: ENTRIES")) + 1
        rows = np.array([[float(word) for word in line.split()] for line in lines[start:]])
        yield int(lines[0]), rows[np.argsort(rows[:, 0])]
