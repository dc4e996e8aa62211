"""Names beside markers that run over neither each other nor a marker, each as near to its own as that allows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Annotation

Array = NDArray[np.float64]

SIZE = 4.5  # points, of the letters
HALF = 2.6  # points, half of a marker's width
# Points from a marker, and directions.
DISTANCES = (1.5, 4.0, 7.0, 11.0, 16.0, 22.0, 30.0, 40.0, 54.0, 70.0)
DIRECTIONS = np.array(
    [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1), (2, 1), (2, -1), (-2, 1), (-2, -1)]
)
LINED = 5.0  # points from a marker beyond which a line tells whose name it is
# Points farther that a name rather goes than that its line meets a marker; a name or another line.
MARKER_MET, NAME_MET = 8.0, 40.0


@dataclass(frozen=True)
class Label:
    """A name that stands at a marker.

    Args:
        at: the marker, in the units of the axes.
        text: the name.
        colour: of its letters.
    """

    at: tuple[float, float]
    text: str
    colour: str


def place(axes: Axes, labels: Sequence[Label]) -> list[Annotation]:
    """Write names; call it when the figure has its final size and limits.

    Of the places that are free the nearest one is taken, where a line that meets something counts as farther away;
    where none is free the name stands over others, at the right.

    Args:
        axes: drawn, their layout settled.
        labels: names; all their markers are kept free.

    Returns:
        The names, in the order given.
    """
    figure = axes.get_figure(root=True)
    assert figure is not None
    figure.draw_without_rendering()
    renderer = cast("Any", figure.canvas).get_renderer()
    point = figure.dpi / 72
    # Everything from here on in points; boxes are (x0, y0, x1, y1).
    centres = np.array([axes.transData.transform(label.at) for label in labels]).reshape(-1, 2) / point
    markers = np.concatenate([centres - HALF, centres + HALF], axis=1)
    inside = np.array(axes.get_window_extent(renderer).extents) / point
    names, lines, written = np.empty((0, 4)), np.empty((0, 2)), []
    for label, centre in zip(labels, centres, strict=True):
        boxes = np.tile(centre, 2) + _around(_size(axes, label, renderer) / point)
        away = np.array([_gap(box, centre) for box in boxes])
        # A name that is too near to its own marker for a line has none.
        ways = [
            _between(centre, box) if gap > HALF + LINED else lines[:0] for box, gap in zip(boxes, away, strict=True)
        ]
        within = (boxes[:, :2] >= inside[:2]).all(axis=1) & (boxes[:, 2:] <= inside[2:]).all(axis=1)
        free = within & ~_overlap(boxes, np.concatenate([markers, names])).any(axis=1)
        dear = np.array(
            [MARKER_MET * _met(markers, way) + NAME_MET * (_met(names, way) + _met(box[None], lines))
             for box, way in zip(boxes, ways, strict=True)]
        )  # fmt: skip
        best = int(np.argmin(np.where(free, away + dear, np.inf))) if free.any() else 0
        names, lines = np.concatenate([names, boxes[best : best + 1]]), np.concatenate([lines, ways[best]])
        written.append(_write(axes, label, boxes[best, :2] - centre, lined=len(ways[best]) > 0))
    return written


def _around(size: Array) -> Array:
    """(P, 4) boxes of a size about a marker at (0, 0), near ones first."""
    found = []
    for distance in DISTANCES:
        for right, up in DIRECTIONS:
            way = np.array([right, up], float)
            # Straight above or below it the middle of the name, elsewhere its near end.
            low = (HALF + distance) * way - size * np.where(way == 0, 0.5, np.where(way < 0, 1.0, 0.0))
            found.append([*low, *(low + size)])
    return np.array(found)


def _size(axes: Axes, label: Label, renderer: Any) -> Array:
    """Width and height of a name [pixels]."""
    text = axes.text(*label.at, label.text, fontsize=SIZE)
    box = text.get_window_extent(renderer)
    text.remove()
    return np.array([box.width, box.height])


def _overlap(boxes: Array, others: Array) -> NDArray[np.bool_]:
    """(P, Q) which boxes overlap which."""
    one, two = boxes[:, None], others[None]
    apart = (one[..., :2] >= two[..., 2:]) | (two[..., :2] >= one[..., 2:])
    found: NDArray[np.bool_] = ~np.any(apart, axis=-1)
    return found


def _gap(box: Array, point: Array) -> float:
    """From a point to the nearest one of a box."""
    return float(np.linalg.norm(np.maximum(0.0, np.maximum(box[:2] - point, point - box[2:]))))


def _between(centre: Array, box: Array) -> Array:
    """(n, 2) points of the line from beside a marker to the middle of its name."""
    share = np.linspace(0.0, 1.0, 40)[:, None]
    line: Array = (1 - share) * centre + share * (box[:2] + box[2:]) / 2
    # Another marker at the same place is met by every line.
    beyond: Array = line[np.abs(line - centre).max(axis=1) > 2 * HALF]
    return beyond


def _met(boxes: Array, line: Array) -> int:
    """How many boxes a line goes through."""
    inside = (line[None] > boxes[:, None, :2]) & (line[None] < boxes[:, None, 2:])
    return int(np.any(np.all(inside, axis=-1), axis=1).sum())


def _write(axes: Axes, label: Label, offset: Array, *, lined: bool) -> Annotation:
    line = {"arrowstyle": "-", "linewidth": 0.3, "color": label.colour, "shrinkA": 0.0, "shrinkB": HALF}
    return axes.annotate(
        label.text, label.at, xytext=(float(offset[0]), float(offset[1])), textcoords="offset points", fontsize=SIZE,
        color=label.colour, ha="left", va="bottom", annotation_clip=False, arrowprops=line if lined else None,
    )  # fmt: skip
