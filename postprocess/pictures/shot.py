"""A run as pictures take it: its frames, and its bodies cut open in front."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

from dem.record.frames import FrameSequence, read_frames
from dem.record.run import Run, open_run
from postprocess.bodies.colours import scalars
from postprocess.bodies.fields import BY_NAME, IDENTITY
from postprocess.bodies.meshes import USUAL, Bodies
from postprocess.geometry.links import Floats
from postprocess.pictures.canvas import Look, Rectangle, drawn, rectangle, union


@dataclass(frozen=True, kw_only=True, eq=False)
class Shot:
    """A run to be drawn."""

    run: Run
    frames: FrameSequence = field(repr=False)
    bodies: Bodies = field(repr=False)

    @classmethod
    def of(cls, directory: Path | str, *, forces: bool = False) -> Self:
        """Return a shot of a run directory.

        Raises:
            InputError: Something of it is missing or damaged, or forces are wanted and not recorded.
        """
        run = open_run(directory)
        kinds = (*USUAL, "forces") if forces else USUAL
        bodies = Bodies(run, kinds, [BY_NAME[name] for name in IDENTITY], cut=True)
        return cls(run=run, frames=read_frames(directory), bodies=bodies)

    def room(self, indices: Iterable[int], axes: Floats) -> Rectangle:
        """Return what the camera must have in view to show some frames [mm]."""
        return union([rectangle(drawn(self.bodies, self.frames[i], axes[2]).values(), axes) for i in indices])

    def values(self, indices: Iterable[int], look: Look) -> list[Floats]:
        """Return values (N, 3) that the colours of some frames show."""
        return [scalars(look.field, self.frames[i], self.run) for i in indices]
