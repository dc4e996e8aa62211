"""Draw pictures of several runs at several times in one figure, with one row per run and one scale."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from postprocess.bodies.colours import ColourScale
from postprocess.pictures.canvas import Canvas, Style, Subject, union, visible_meshes
from postprocess.report import figures
from postprocess.report.tables import whole_file

_LABEL = 14  # characters in a line of a row's label, about the height of a picture
_SIZE = (400, 400)  # of a picture with room for a caption, which is cut off [pixel]


@dataclass(frozen=True, kw_only=True)
class Row:
    """One row of pictures, all of one run."""

    directory: Path  #: Run directory
    label: str  #: Text beside the row
    times: tuple[float, ...]  #: Simulated times of the pictures [s]; each shows the nearest frame


def draw_strip(rows: Sequence[Row], output: Path, *, columns: Sequence[str], footer: Sequence[str]) -> Path:
    """Draw a row of pictures for each run, and write them as one figure, a `.png`; return its path.

    A row has one time per column. A smarticle has one colour in all pictures of a run. `columns` are the titles of the
    columns; the lines of the footer are below the pictures.
    """
    subjects = [Subject(row.directory) for row in rows]
    style = Style.of([subject.run for subject in subjects[:1]], color_by="id", size=_SIZE, view="front")
    shown = [
        [int(np.argmin(np.abs(subject.frames.times - time))) for time in row.times]
        for subject, row in zip(subjects, rows, strict=True)
    ]
    for subject, indices in zip(subjects, shown, strict=True):
        subject.bodies.hold(subject.frames[i] for i in indices)
    extent = union([subject.extent(indices, style.axes) for subject, indices in zip(subjects, shown, strict=True)])
    scale, pictures = ColourScale.of(style.field, (0.0, 1.0)), []
    for subject, indices in zip(subjects, shown, strict=True):
        with Canvas(style, extent, subject.run) as canvas:
            for index, values in zip(indices, subject.values(indices, style), strict=True):
                frame = subject.frames[index]
                canvas.show(0, frame, visible_meshes(subject.bodies, frame, style.axes[2]), scale.painted(values))
                pictures.append(np.asarray(style.panel(canvas.image())))
    inked = np.flatnonzero((np.array(pictures) < 255).any(axis=(0, 2, 3)))
    part = slice(inked[0], inked[-1] + 1)
    height, width = inked[-1] + 1 - inked[0], style.pixel(extent) * _SIZE[0]
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
                axes.set_ylabel(textwrap.fill(rows[number // len(columns)].label, _LABEL), fontsize=7)
        figures.add_footer(figure, [f"A picture is {width:.3g} mm wide.", *footer])
        with whole_file(output) as temporary:
            figure.savefig(temporary, format="png", dpi=130)
    return output
