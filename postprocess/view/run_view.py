"""A run as the page shows it: its frames, the field it is coloured by, and what is picked."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.frames import FrameSequence, read_frames
from dem.record.run import open_run
from postprocess.bodies.colours import ColourScale, colour_field, scalars, span
from postprocess.bodies.fields import IDENTITY, Field, fields_of, link_values
from postprocess.bodies.meshes import BOX_FACES, USUAL, Bodies, owners
from postprocess.geometry.links import Floats
from postprocess.pictures.canvas import VIEWS, add_bodies, axes_from, drawn

PICKED = (255, 0, 170)
"""Colour of the smarticle that is picked, which no palette has."""

_SAMPLES, _COSTLY_SAMPLES = 12, 3


@dataclass(frozen=True)
class Pick:
    """A smarticle that is looked at, and which of its links."""

    smarticle_id: int
    link: int


class RunView:
    """State of one page.

    Args:
        directory: A run directory with at least one frame.

    Raises:
        InputError: There is none, or it is damaged.
    """

    def __init__(self, directory: Path | str) -> None:
        self.run = open_run(directory)
        self.frames: FrameSequence = read_frames(directory)
        frame = self.frames[-1]
        self.fields = tuple(
            field for field in fields_of(self.run) if field.costly or field.take(frame, self.run) is not None
        )
        self.field = colour_field(None, self.run)
        self.pick: Pick | None = None
        window: Any = pv.Plotter(off_screen=True)
        self.plotter: Any = window
        window.set_background("white")
        self._bodies = Bodies(self.run, USUAL, [each for each in self.fields if each.name in IDENTITY])
        self._meshes: dict[str, pv.PolyData] = {}
        self._bodies.hold(self.frames[index] for index in self._spread(_SAMPLES))
        self._bounds: dict[str, tuple[float, float]] = {}
        self._index = len(self.frames) - 1
        self._frame = frame

    @property
    def index(self) -> int:
        """Of the frame shown."""
        return self._index

    @property
    def frame(self) -> Frame:
        """The frame shown."""
        return self._frame

    @property
    def phase(self) -> str:
        """Type of the phase of the frame shown."""
        phases = self.run.phases
        return phases[self._frame.phase].type if self._frame.phase < len(phases) else "?"

    @property
    def ended(self) -> bool:
        """Whether no more frames will come, as the run directory tells it now; so also where it is gone."""
        try:
            return open_run(self.run.path).status.state not in ("running", "stopped")
        except InputError:
            return True

    def grow(self) -> bool:
        """Look for new frames; whether there are any."""
        frames = read_frames(self.run.path)
        grown = len(frames) > len(self.frames)
        self.frames = frames
        return grown

    def go_to(self, index: int) -> None:
        """Show another frame.

        Raises:
            InputError: Its file is damaged; the frame shown stays.
        """
        index = min(max(index, 0), len(self.frames) - 1)
        frame = self.frames[index]
        self._bodies.hold([frame])
        self._index, self._frame = index, frame

    def colour_by(self, name: str) -> None:
        """Colour by another field.

        Raises:
            InputError: There is none of this name.
        """
        self.field = colour_field(name, self.run)

    def draw(self) -> None:
        """Put all bodies into the window."""
        values = scalars(self.field, self._frame, self.run)
        colours = ColourScale.of(self.field, self._widened(values)).painted(values)
        if self.pick is not None:
            colours[self._frame.smarticle_ids == self.pick.smarticle_id] = PICKED
        self._meshes = drawn(self._bodies, self._frame, np.zeros(3))
        boxes = colours[:0, 0]
        if "smarticles" in self._meshes:
            boxes = colours[owners(self._meshes["smarticles"], self._frame)]
        add_bodies(self.plotter, self._meshes, boxes)

    def aim(self) -> None:
        """Turn the camera to all that is drawn: from the front, a little from above; at a plane from above."""
        _, up, forward = axes_from(*VIEWS["top" if self.run.manifest.planar else "front"])
        camera = self.plotter.camera
        camera.focal_point, camera.position, camera.up = (0.0, 0.0, 0.0), tuple(-forward), tuple(up)
        self.plotter.reset_camera(render=False)

    def legend(self) -> list[dict[str, str]]:
        """Return colours with their labels, from the greatest; none where colours only tell identity."""
        scale = ColourScale.of(self.field, self._bounds.get(self.field.name, (0.0, 1.0)))
        colours = scale.painted(np.array(list(scale.labels)))
        shown = [
            {"colour": "#{:02x}{:02x}{:02x}".format(*colour), "label": label}
            for colour, label in zip(colours.tolist(), scale.labels.values(), strict=True)
        ]
        return shown[::-1]

    def pick_along(self, ray: Floats) -> None:
        """Pick the smarticle that a ray (2, 3) [mm] meets first, or none."""
        self.pick = None
        if "smarticles" in self._meshes:
            mesh = self._meshes["smarticles"]
            _, faces = mesh.triangulate().ray_trace(ray[0], ray[1], first_point=True)
            if np.size(faces):
                face = int(np.atleast_1d(faces)[0]) // (2 * BOX_FACES) * BOX_FACES
                self.pick = Pick(*(int(mesh.cell_data[name][face]) for name in IDENTITY))

    def describe(self) -> list[dict[str, str]]:
        """Return all fields of what is picked, as text: name, unit, value; none where nothing is."""
        if self.pick is None:
            return []
        (found,) = np.nonzero(self._frame.smarticle_ids == self.pick.smarticle_id)
        if not len(found):
            return []
        rows = []
        for field in self.fields:
            values = link_values(field, self._frame, self.run)
            if values is not None:
                value = values[int(found[0]), self.pick.link]
                rows.append({"name": field.name, "unit": field.unit, "value": _text(value), "meaning": field.meaning})
        return rows

    def _spread(self, number: int) -> list[int]:
        return sorted({round(place) for place in np.linspace(0, len(self.frames) - 1, number)})

    def _widened(self, values: Floats) -> tuple[float, float]:
        """Return bounds of the field's scale: of some frames of the run and of all that were shown."""
        name = self.field.name
        if name not in self._bounds:
            samples = [values]
            for index in self._spread(_COSTLY_SAMPLES if self.field.costly else _SAMPLES):
                try:
                    samples.append(scalars(self.field, self.frames[index], self.run))
                except InputError:  # reported when that frame is gone to
                    continue
            self._bounds[name] = span(samples)
        if np.isfinite(values).any():
            self._bounds[name] = span([np.array(self._bounds[name]), values])
        return self._bounds[name]


def colour_names(fields: tuple[Field, ...]) -> list[dict[str, str]]:
    """Return fields for a list to choose from: name, and title with the unit."""
    return [
        {"name": field.name, "title": field.name if field.unit == "-" else f"{field.name} [{field.unit}]"}
        for field in fields
    ]


def _text(value: Any) -> str:
    if np.ndim(value):
        return "(" + ", ".join(f"{part:.4g}" for part in value) + ")"
    return str(int(value)) if isinstance(value, np.integer) else f"{value:.4g}"
