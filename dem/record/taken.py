"""One frame of a run that another run begins from."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.run import Run, open_run

LAST = "last"
"""The frame at the end of a run that is done."""


@dataclass(frozen=True)
class Taken:
    """One frame of another run.

    Args:
        run: the run.
        number: of the frame.
        frame: the frame.
    """

    run: Run
    number: int
    frame: Frame

    @property
    def vertices(self) -> NDArray[np.float64]:
        """(N, 4, 3) [m], as if the floor were at height 0, wherever the container was."""
        return self.frame.vertices - [0.0, 0.0, self.frame.floor_z]

    @property
    def sha256(self) -> str:
        """Of these vertices: all of a frame that decides what comes after."""
        return hashlib.sha256(np.ascontiguousarray(self.vertices, dtype="<f8").tobytes()).hexdigest()

    @property
    def fastest(self) -> float:
        """Greatest speed of a link's centre [m/s], which is not taken over."""
        return float(np.linalg.norm(self.frame.link_velocity, axis=-1).max())

    def __str__(self) -> str:
        return f"frame {self.number} of {self.run.path}"


def take(path: Path, frame: int | str) -> Taken:
    """Read a frame of a run, by its number or `LAST`.

    Raises:
        InputError: there is no such run or frame, it is damaged, or the run still goes on; begins with `run` or
            `frame`, the key that is wrong.
    """
    try:
        run = open_run(path)
        frames, state = run.frames, run.status.state
    except InputError as error:
        msg = f"run: {error}"
        raise InputError(msg) from None
    if state == "running":
        msg = f"run: {run} is still being computed; wait until it is done: smarticles status {run}"
        raise InputError(msg)
    if frame == LAST and state != "done":
        msg = (
            f"frame: {LAST}, but {run} is {state}; go on with it (smarticles resume {run}), or give the "
            "number of a frame"
        )
        raise InputError(msg)
    number = len(frames) - 1 if frame == LAST else int(frame)
    if number >= len(frames):
        msg = f"frame: {number}, but the frames of {run} are 0 … {len(frames) - 1}; use one of them, or {LAST}"
        raise InputError(msg)
    try:
        return Taken(run, number, frames[number])
    except InputError as error:
        msg = f"frame: {error}"
        raise InputError(msg) from None
