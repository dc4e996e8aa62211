"""Pictures of scenes, runs, frames and sweeps in notebooks; a notebook shows the table alone where none can be drawn.

Importing this module registers the pictures for `dem.notebook.picture_of`.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from dem.notebook import beside, picture_of
from dem.record.frame import Frame, RecordedBars
from dem.record.run import Run
from dem.scene.scene import Scene

if TYPE_CHECKING:
    from PIL.Image import Image

_SIDE, _WIDEST = 500, 1000  # side of a picture of one run, and width of one of several [pixel]
_MOST_BYTES = 45_000  # of a picture; base64 makes it a third longer
_MOST_RUNS, _MOST_ROWS = 3, 10  # of a sweep in its picture and in its table


def _png(draw: Callable[[], Image]) -> bytes | None:
    """Return the picture that `draw` makes, as a small PNG; None if it cannot be drawn, for whatever reason."""
    if "yade" in sys.modules:  # its VTK library and PyVista's would end the process
        return None
    try:
        image = draw()
        for colours in (128, 32, 8):
            file = io.BytesIO()
            image.convert("RGB").quantize(colours).save(file, "PNG", optimize=True)
            if file.tell() <= _MOST_BYTES:
                return file.getvalue()
    except Exception:
        pass
    return None


@picture_of.register
def _of_run(run: Run) -> bytes | None:
    return _png(lambda: _piles([run]))


@picture_of.register
def _of_frame(frame: Frame) -> bytes | None:
    return _png(lambda: _piles([Run(frame.directory)], time=frame.time))


@picture_of.register
def _of_scene(scene: Scene) -> bytes | None:
    return _png(lambda: _particles(scene))


def _piles(runs: Sequence[Run], time: float | None = None) -> Image:
    """Draw frames of runs side by side, the nearest to a time [s] or the last ones."""
    from postprocess.pictures.canvas import Style, Subject  # noqa: PLC0415  (of the extra "viz")
    from postprocess.pictures.render import pictures  # noqa: PLC0415

    subjects = [Subject(run.path) for run in runs]
    indices = [[len(one.frames) - 1 if time is None else one.frames.nearest(time)] for one in subjects]
    style = Style.of([subject.run for subject in subjects], color_by=None, size=(_SIDE, _SIDE), view=None)
    image = next(pictures(subjects, indices, style, quick=True))
    image.thumbnail((_WIDEST, _SIDE))
    return image


def _particles(scene: Scene) -> Image:
    """Draw one body of each entry of a scene side by side, of the middle size."""
    from dem.run.run import kinds_of  # noqa: PLC0415  (slow to import)
    from postprocess.pictures.particles import draw_bars, draw_smarticle  # noqa: PLC0415  (of the extra "viz")

    if scene.particle is None or scene.mixture is None:
        boxes = scene.body.boxes
        thicknesses = boxes.thickness_normal, boxes.thicknesses_in_plane
        return draw_smarticle(boxes.vertices, *thicknesses, size=_SIDE, title=scene.name)
    shapes = {number: shape for number, shape in enumerate(scene.particle) if not shape.absent}
    sizes = [len(shape.factors) for shape in shapes.values()]
    middles = [sum(sizes[:number]) + size // 2 for number, size in enumerate(sizes)]
    kinds = [kinds_of(scene.mixture)[place] for place in middles]
    bars = [scene.mixture.kinds[place].bars for place in middles]
    parts = [
        RecordedBars(
            segments=one.ends,
            body=np.zeros(len(one.ends), np.int64),
            number=np.arange(len(one.ends)),
            kind=np.array([number]),
            normals=(not one.round) * one.frames[:, :, 2],
        )
        for number, one in enumerate(bars)
    ]
    names = [f"{number} {shape.tag()}" for number, shape in shapes.items()]
    return draw_bars(parts, kinds, names, size=_SIDE, title=scene.name)


def show_sweep(path: Path, runs: Sequence[Run], values: pd.DataFrame) -> str:
    """Return HTML of a sweep: a table with the values and the state of each run, and pictures of some runs."""
    states = [run.status.state for run in runs]
    shown = values.assign(state=states)
    head = f"{path}: {states.count('done')} of {len(runs)} runs are done"
    table = f"<div><p>{escape(head)}</p>{shown.to_html(max_rows=_MOST_ROWS, border=0)}</div>"
    drawn = [run for run in runs if run.has_frames]
    places = sorted({round(place) for place in np.linspace(0, len(drawn) - 1, min(_MOST_RUNS, len(drawn)))})
    return beside(table, _png(lambda: _piles([drawn[place] for place in places])) if drawn else None)
