"""Pictures of several runs at several times in one: a row for each run, under one camera each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from dem.record.frame import Frame
from dem.record.frames import read_frames
from dem.record.manifest import read_run
from postprocess.pictures.camera import Look, extent
from postprocess.pictures.surroundings import read_surroundings
from postprocess.report import figures

_SIZE = (400, 400)  # pixel, of a picture with its caption, which is left out
_GAP = 6  # pixel


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

    A smarticle has the same colour in all pictures of a run.

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
    pictures = [_pictures(row) for row in rows]
    width, height = pictures[0][0].size
    across, down = len(columns) * (width + _GAP), len(rows) * (height + _GAP)
    canvas = Image.new("RGB", (across, down), "white")
    for i, line in enumerate(pictures):
        for k, picture in enumerate(line):
            canvas.paste(picture, (k * (width + _GAP), i * (height + _GAP)))
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


def _pictures(row: Row) -> list[Image.Image]:
    from postprocess.pictures.canvas import Canvas  # noqa: PLC0415  (imports PyVista)

    run, frames = read_run(row.directory), read_frames(row.directory)
    shown: list[Frame] = [frames[int(np.argmin(np.abs(frames.times - time)))] for time in row.times]
    look = Look.checked(color_by="id", size=_SIZE, view="front")
    around = read_surroundings(run)
    extents = np.concatenate([extent(frame, run, look, around) for frame in shown])
    width, height = look.panel
    below = (0, _SIZE[1] - height, width, _SIZE[1])
    with Canvas(run, look, around, extents, (0.0, 1.0)) as canvas:
        return [canvas.picture(frame, look.colouring.values(frame)).crop(below) for frame in shown]
