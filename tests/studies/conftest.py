"""What all tests of studies share: figures that are left out, and an eye on every figure that is not."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PathCollection, PolyCollection
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure
from numpy.typing import NDArray

from postprocess.report import figures


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the figures of all studies, which take most of the time."""
    monkeypatch.setattr("studies.framework.study.Study.draw", lambda *_: [])


@pytest.fixture(scope="session", autouse=True)
def checked_figures() -> Iterator[None]:
    """Check every figure that a test of a study draws.

    A footer is short and whole, error bars are of one kind that is named once, no limit of an axis cuts anything, and
    no label or legend leaves the figure.
    """
    add_footer, save = figures.add_footer, figures.save

    def add(figure: Figure, lines: Sequence[str]) -> None:
        add_footer(figure, lines)
        check_footer(figure, lines)

    def saved(figure: Figure, path: Path, **formats: Sequence[str]) -> list[Path]:
        check_bars(figure)
        check_limits(figure)
        check_edges(figure)
        return save(figure, path, **formats)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "add_footer", add)
        patch.setattr(figures, "save", saved)
        yield


def check_footer(figure: Figure, lines: Sequence[str]) -> None:
    """Check height and width of the footer as drawn, and that it is whole."""
    footer = figure.texts[-1]
    figure.draw_without_rendering()
    box = footer.get_window_extent()
    width, height = figure.get_size_inches() * figure.dpi
    assert box.height / height <= figures.FOOTER_SHARE, f"the footer takes {box.height / height:.0%} of the figure"
    assert box.x1 <= width, "the footer leaves the figure"
    assert footer.get_text().split() == " ".join(lines).split(), "the footer was cut: say less"


def check_bars(figure: Figure) -> None:
    """Check that error bars are named once, and nothing is named that is not there."""
    text = figure.texts[-1].get_text().replace("\n", " ")
    bars = [
        ends
        for axes in figure.axes
        for container in axes.containers
        if isinstance(container, ErrorbarContainer) and not bounds(container)
        for lines in container.lines[2]
        for ends in lines.get_segments()
        if np.isfinite(ends).all() and len(ends)
    ]
    assert text.count("Error bars: 95 % confidence") == bool(bars), text
    assert not [word for word in ("standard error", "SE)", "Error bars: one") if word in text], text


def bounds(container: ErrorbarContainer) -> bool:
    """Whether it is arrows: they have a cap that points, at one end alone."""
    return any(cap.get_marker() not in {"|", "_"} for cap in container.lines[1])


def check_limits(figure: Figure) -> None:
    """Check that everything lies within the axes; on a logarithmic one what is 0 or less cannot, and is stated."""
    text = figure.texts[-1].get_text()
    for axes in figure.axes:
        for k, (scale, limits) in enumerate(
            ((axes.get_xscale(), sorted(axes.get_xlim())), (axes.get_yscale(), sorted(axes.get_ylim())))
        ):
            values = drawn(axes, k)
            if scale == "log":
                assert (values > 0).all() or "or below: cut by the axis" in text
                values = values[values > 0]
            if len(values):
                room = 1e-9 * max(map(abs, limits))
                assert limits[0] - room <= values.min(), f"{values.min()} is cut by {limits}"
                assert values.max() <= limits[1] + room, f"{values.max()} is cut by {limits}"


def check_edges(figure: Figure) -> None:
    """Check that labels and legends are whole."""
    figure.draw_without_rendering()
    width, height = figure.get_size_inches() * figure.dpi
    words = [*figure.legends, *figure.texts]
    for axes in figure.axes:
        words += [axes.xaxis.label, axes.yaxis.label, axes.title, *filter(None, [axes.get_legend()])]
    for word in words:
        if not getattr(word, "get_text", lambda: "a legend")():
            continue
        box = word.get_window_extent()
        whole = box.x0 >= -1 and box.y0 >= -1 and box.x1 <= width + 1 and box.y1 <= height + 1
        assert whole, f"{word} leaves the figure: {box} of {width:g} × {height:g}"


def drawn(axes: object, k: int) -> NDArray[np.float64]:
    """Collect all coordinates, x (0) or y (1), of lines, error bars and bands that stand in coordinates of the data."""
    found = [np.asarray(line.get_xydata(), float) for line in axes.lines if line.get_transform() == axes.transData]
    for part in axes.collections:
        if isinstance(part, LineCollection):
            found += [np.asarray(segment, float) for segment in part.get_segments()]
        elif isinstance(part, PolyCollection) and not isinstance(part, PathCollection):
            found += [np.asarray(path.vertices, float) for path in part.get_paths()]
    values = np.concatenate([points[:, k] for points in found if len(points)] or [np.empty(0)])
    return values[np.isfinite(values)]
