"""Names beside markers: none over another, none over a marker, none out of the panel."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from benchmarks.rivals.labels import HALF, Label, place
from postprocess.report.figures import BLUE, blank_figure, style

WORDS = ("draft", "standard", "2048 N/mm", "2e-4 s, CG 50, stiff", "1e-3 s, 200 iterations", "2e-4 s, as shipped")


def crowded(count: int, seed: int) -> list[Label]:
    """Markers by twos and threes nearly at one place, over decades."""
    rng = np.random.default_rng(seed)
    centres = 10 ** rng.uniform([-4, -1], [1, 3], (count // 3 + 1, 2))
    places = centres[rng.integers(len(centres), size=count)] * 10 ** rng.normal(0, 0.03, (count, 2))
    return [Label((float(x), float(y)), WORDS[k % len(WORDS)], BLUE) for k, (x, y) in enumerate(places)]


def drawn(labels: list[Label]) -> tuple[Any, list[Bbox], list[Bbox]]:
    """Axes, boxes of names and boxes of markers [pixels]."""
    with style():
        figure = blank_figure(3.5, 3.8)
        axes = figure.subplots()
        axes.plot(*zip(*(label.at for label in labels), strict=True), "o")
        axes.set(xscale="log", yscale="log")
        axes.margins(0.12)
        names = place(axes, labels)
        figure.draw_without_rendering()
        half = HALF * figure.dpi / 72
        boxes = [Text.get_window_extent(name) for name in names]  # without the line
        markers = [
            Bbox([[x - half, y - half], [x + half, y + half]])
            for x, y in (axes.transData.transform(label.at) for label in labels)
        ]
    return axes, boxes, markers


def overlap(one: Bbox, other: Bbox) -> float:
    """How deep two boxes are in each other [pixels]."""
    width = min(one.x1, other.x1) - max(one.x0, other.x0)
    height = min(one.y1, other.y1) - max(one.y0, other.y0)
    return min(width, height)


@pytest.mark.parametrize("seed", range(4))
def test_names_run_over_nothing(seed: int) -> None:
    axes, boxes, markers = drawn(crowded(24, seed))
    assert max(overlap(one, other) for one, other in combinations(boxes, 2)) < 1
    assert max(overlap(one, other) for one in boxes for other in markers) < 1
    inside = axes.get_window_extent()
    assert all(box.x0 > inside.x0 - 1 and box.x1 < inside.x1 + 1 for box in boxes)
    assert all(box.y0 > inside.y0 - 1 and box.y1 < inside.y1 + 1 for box in boxes)


def test_a_name_stands_at_its_marker_and_a_line_leads_to_one_that_had_to_go_away() -> None:
    axes, (box,), (marker,) = drawn([Label((1.0, 1.0), "standard", BLUE)])
    assert 0 < box.x0 - marker.x1 < 3 * axes.figure.dpi / 72
    assert axes.texts[0].arrow_patch is None
    axes, _, _ = drawn([Label((1.0, 1.0), "standard", BLUE) for _ in range(14)])
    assert any(name.arrow_patch is not None for name in axes.texts)
