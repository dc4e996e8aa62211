"""Pictures of several runs at several times in one: a row for each run, all from the same distance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from postprocess.pictures.camera import Look
from postprocess.pictures.colouring import ColourScale
from postprocess.pictures.page import draw_scale_bar
from postprocess.pictures.shot import Shot
from postprocess.report import figures

_SIZE = (400, 400)  # pixel, of a picture with its caption, which is left out
_GAP = 6  # pixel
_FOOT = 28  # height of the scale bar's strip [pixel]


@dataclass(frozen=True, kw_only=True)
class Row:
    """Pictures of one run.

    Attributes:
        directory: The run.
        label: What is written beside them.
        times: Simulated times [s]; of each the nearest frame is drawn.
    """

    directory: Path
    label: str
    times: tuple[float, ...]


def draw_strip(rows: Sequence[Row], output: Path, *, columns: Sequence[str], footer: Sequence[str]) -> Path:
    """Draws a picture of each run at each of its times, and writes them as one.

    A smarticle has the same colour in all pictures of a run. All pictures share one scale, which a bar below the first
    of the last row tells.

    Args:
        rows: The runs, from above.
        output: File to write, `.png`.
        columns: What is written above the pictures, one each.
        footer: Origin, one statement each.

    Returns:
        The file.

    Raises:
        InputError: A run has no frames.
        RunError: This machine lacks the libraries to draw without a display.
    """
    pictures, pixel = _pictures(rows)
    width, height = pictures[0][0].size
    across, below = len(columns) * (width + _GAP), len(rows) * (height + _GAP)
    down = below + _FOOT
    canvas = Image.new("RGB", (across, down), "white")
    for i, line in enumerate(pictures):
        for k, picture in enumerate(line):
            canvas.paste(picture, (k * (width + _GAP), i * (height + _GAP)))
    draw_scale_bar(canvas, (_GAP, below + _FOOT / 2), pixel, room=width, unit=_FOOT / 4)
    with figures.style():
        scale = 2 * figures.COLUMN_WIDTH / across
        figure = figures.blank_figure(2 * figures.COLUMN_WIDTH + 0.3, down * scale)
        axes = figure.add_subplot()
        axes.imshow(np.asarray(canvas))
        axes.grid(visible=False)
        axes.set_frame_on(False)
        axes.set_xticks([(k + 0.5) * (width + _GAP) for k in range(len(columns))], labels=list(columns))
        axes.set_yticks([(i + 0.5) * (height + _GAP) for i in range(len(rows))], labels=[row.label for row in rows])
        axes.tick_params(length=0, labeltop=True, labelbottom=False)
        for label in axes.get_yticklabels():
            label.set(rotation=90, va="center")
        figures.add_footer(figure, footer)
        with figures.whole_file(output) as temporary:
            figure.savefig(temporary, format="png", dpi=130)
    return output


def _pictures(rows: Sequence[Row]) -> tuple[list[list[Image.Image]], float]:
    """Pictures of each run, all of one size without empty rows, and how long a pixel is at mid-depth [mm]."""
    from postprocess.pictures.canvas import Canvas  # noqa: PLC0415  (imports PyVista)

    look = Look.checked(color_by="id", size=_SIZE, view="front")
    shots = [Shot.of(row.directory) for row in rows]
    shown = [
        [int(np.argmin(np.abs(shot.frames.times - time))) for time in row.times]
        for shot, row in zip(shots, rows, strict=True)
    ]
    extents = [shot.extent(indices, look) for shot, indices in zip(shots, shown, strict=True)]
    scale, pictures, pixel = ColourScale.of(look.colouring, 0.0, 1.0), [], 1.0
    for shot, indices in zip(shots, shown, strict=True):
        with Canvas(shot.run, look, shot.around, np.concatenate(extents)) as canvas:
            values = shot.values(indices, look)
            panels = [
                canvas.panel(shot.frames[index], scale.colours(of_frame))
                for index, of_frame in zip(indices, values, strict=True)
            ]
            pictures.append(panels)
            pixel = canvas.pixel
    drawn = np.flatnonzero((np.array(pictures) < 255).any(axis=(0, 1, 3, 4)))
    part = slice(max(drawn[0] - _GAP, 0), drawn[-1] + _GAP)
    return [[Image.fromarray(panel[part]) for panel in panels] for panels in pictures], pixel
