"""Pictures of several runs at several times in one figure: a row for each run, all in one scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from postprocess.bodies.colours import ColourScale
from postprocess.pictures.canvas import Canvas, Look, Shot, drawn, union
from postprocess.report import figures

_SIZE = (400, 400)  # pixel, of a picture with its caption, which is left out


@dataclass(frozen=True, kw_only=True)
class Row:
    """Pictures of one run."""

    directory: Path  #: The run
    label: str  #: What is written beside them
    times: tuple[float, ...]  #: Simulated times [s]; of each the nearest frame is drawn


def draw_strip(rows: Sequence[Row], output: Path, *, columns: Sequence[str], footer: Sequence[str]) -> Path:
    """Draw a picture of each run at each of its times, and write them as one figure, columns named above.

    A smarticle has one colour in all pictures of a run.

    Raises:
        InputError: A run has no frames.
        RunError: This machine lacks the libraries to draw without a display.
    """
    shots = [Shot(row.directory) for row in rows]
    look = Look.of([shot.run for shot in shots[:1]], color_by="id", size=_SIZE, view="front")
    shown = [
        [int(np.argmin(np.abs(shot.frames.times - time))) for time in row.times]
        for shot, row in zip(shots, rows, strict=True)
    ]
    for shot, indices in zip(shots, shown, strict=True):
        shot.bodies.hold(shot.frames[i] for i in indices)
    extent = union([shot.extent(indices, look.axes) for shot, indices in zip(shots, shown, strict=True)])
    scale, pictures = ColourScale.of(look.field, (0.0, 1.0)), []
    for shot, indices in zip(shots, shown, strict=True):
        with Canvas(look, extent, shot.run) as canvas:
            for index, values in zip(indices, shot.values(indices, look), strict=True):
                frame = shot.frames[index]
                canvas.show(0, frame, drawn(shot.bodies, frame, look.axes[2]), scale.painted(values))
                pictures.append(np.asarray(look.panel(canvas.image())))
    inked = np.flatnonzero((np.array(pictures) < 255).any(axis=(0, 2, 3)))
    part = slice(inked[0], inked[-1] + 1)
    height, width = inked[-1] + 1 - inked[0], look.pixel(extent) * _SIZE[0]
    with figures.style():
        wide = 2 * figures.COLUMN_WIDTH
        figure = figures.blank_figure(wide + 0.3, wide * len(rows) * height / (len(columns) * _SIZE[0]))
        grid = figure.subplots(len(rows), len(columns), squeeze=False)
        for number, (axes, picture) in enumerate(zip(grid.flat, pictures, strict=True)):
            axes.imshow(picture[part], extent=(0, width, 0, width * height / _SIZE[0]))
            axes.set(xticks=[], yticks=[], frame_on=False)
            if number < len(columns):
                axes.set_title(columns[number], fontsize=7)
            if number % len(columns) == 0:
                axes.set_ylabel(rows[number // len(columns)].label)
        figures.add_footer(figure, [f"A picture is {width:.3g} mm wide.", *footer])
        with figures.whole_file(output) as temporary:
            figure.savefig(temporary, format="png", dpi=130)
    return output
