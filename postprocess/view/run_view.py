"""A run as the page sees it: its frames, the field it is coloured by, and what is picked."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.frames import FrameSequence, read_frames
from dem.record.run import open_run
from postprocess.export.bodies import KINDS, ON_REQUEST, Bodies
from postprocess.export.colours import colour_field, painted, scalars, scale, span
from postprocess.export.fields import FIELDS, IDENTITY, Field, fields_of, link_values
from postprocess.view.window import BOX_FACES, Window

if TYPE_CHECKING:
    from numpy.typing import NDArray

PICKED = (255, 0, 170)
"""Colour of the smarticle that is picked, which no palette has."""

_SAMPLES, _COSTLY_SAMPLES = 12, 3
_STEPS = 7  # of a continuous scale in the legend


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
        self.window = Window(self.run)
        kinds = [kind for kind in KINDS if kind not in ON_REQUEST]
        self._bodies = Bodies.read(self.run, kinds, [each for each in self.fields if each.name in IDENTITY])
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
        bodies = self._bodies.at(self._frame)
        values = scalars(self.field, self._frame, self.run)
        palette = scale(self.field, self._widened(values))
        colours = np.empty((0, 3), dtype=np.uint8)
        if "smarticles" in bodies:
            colours = painted(palette, values[self._boxes(bodies["smarticles"])])
            if self.pick is not None:
                chosen = bodies["smarticles"].cell_data["smarticle_id"][::BOX_FACES] == self.pick.smarticle_id
                colours[chosen] = PICKED
        self.window.show(bodies, colours, self._frame.floor_z)

    def look(self) -> None:
        """Turn the camera to all that is drawn: from the front, a little from above; at a plane from above."""
        if self.run.manifest.planar:
            self.window.look_from((0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
        else:
            self.window.look_from((0.0, -1.0, 0.35), (0.0, 0.0, 1.0))

    def legend(self) -> list[dict[str, str]]:
        """Colours with their labels, from the greatest; none where colours only tell identity."""
        low, high = self._bounds.get(self.field.name, (0.0, 1.0))
        if self.field.kind == "name":
            return []
        if self.field.kind == "count":
            values = np.arange(max(int(high), 1) + 1, dtype=np.float64)
            labels = [f"{value:g}" for value in values]
        else:
            values = np.linspace(low, high, _STEPS)
            labels = [f"{value:.3g}" for value in values]
        colours = painted(scale(self.field, (low, high)), values)
        shown = [
            {"colour": "#{:02x}{:02x}{:02x}".format(*colour), "label": label}
            for colour, label in zip(colours.tolist(), labels, strict=True)
        ]
        return shown[::-1]

    def pick_along(self, ray: NDArray[np.float64]) -> None:
        """Pick the smarticle that a ray (2, 3) [mm] meets first, or none."""
        box = self.window.picked(ray)
        self.pick = None
        if box is None:
            return
        mesh = self._bodies.at(self._frame)["smarticles"]
        owner, link = (int(mesh.cell_data[name][BOX_FACES * box]) for name in ("smarticle_id", "link"))
        self.pick = Pick(owner, link)

    def told(self) -> list[dict[str, str]]:
        """All fields of what is picked, as text: name, unit, value; none where nothing is."""
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

    def _boxes(self, mesh: Any) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Places in the frame's arrays of the boxes' smarticles, and links."""
        owner, link = (mesh.cell_data[name][::BOX_FACES] for name in ("smarticle_id", "link"))
        order = np.argsort(self._frame.smarticle_ids)
        return order[np.searchsorted(self._frame.smarticle_ids, owner, sorter=order)], link

    def _spread(self, number: int) -> list[int]:
        return sorted({round(place) for place in np.linspace(0, len(self.frames) - 1, number)})

    def _widened(self, values: NDArray[np.float64]) -> tuple[float, float]:
        """Bounds of the field's scale: of some frames of the run and of all that were shown."""
        name = self.field.name
        if name not in self._bounds:
            samples = [values]
            for index in self._spread(_COSTLY_SAMPLES if self.field.costly else _SAMPLES):
                try:
                    samples.append(scalars(self.field, self.frames[index], self.run))
                except InputError:  # told when that frame is gone to
                    continue
            self._bounds[name] = span(np.concatenate([sample.ravel() for sample in samples]))
        low, high = self._bounds[name]
        if np.isfinite(values).any():
            least, greatest = span(values)
            self._bounds[name] = min(low, least), max(high, greatest)
        return self._bounds[name]


def colour_names(fields: tuple[Field, ...] = FIELDS) -> list[dict[str, str]]:
    """Fields for a list to choose from: name, and title with the unit."""
    return [
        {"name": field.name, "title": field.name if field.unit == "-" else f"{field.name} [{field.unit}]"}
        for field in fields
    ]


def _text(value: Any) -> str:
    if np.ndim(value):
        return "(" + ", ".join(f"{part:.4g}" for part in value) + ")"
    return str(int(value)) if isinstance(value, np.integer) else f"{value:.4g}"
