"""What all figures of studies have in common: a short footer, one kind of error bars, and nothing that is cut unsaid.

Every figure that any test of a study draws is checked, see `conftest.checked_figures`.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from postprocess.report import figures
from studies.framework.figures import BARS, draw_bounds, draw_means, finish, marker, panels
from studies.framework.shaken import gravish_note
from studies.framework.study import format_numbers

PROPERTIES = {**marker("o", figures.BLUE, "white"), "linestyle": "none"}
ORIGIN = ("Study toy: 2 of 2 runs.", "More: toy.md.")


def footer(figure: Figure, tmp_path: Path, *, notes: Sequence[str] = (), bars: str = BARS) -> str:
    """Finish a figure and return what stands below it."""
    finish(figure, tmp_path / "figure", notes, ORIGIN, bars=bars)
    return figure.texts[-1].get_text().replace("\n", " ")


def points(axes: Axes, middle: Sequence[float], half_widths: Sequence[float]) -> None:
    draw_means(axes, range(len(middle)), middle, half_widths, properties=PROPERTIES, label="points")


def test_error_bars_are_named_once_and_only_where_there_are_any(tmp_path: Path) -> None:
    figure, axes = figures.new_figure()
    points(axes, [1.0, 2.0], [0.1, np.nan])
    points(axes, [1.5, 2.5], [0.1, 0.1])
    assert footer(figure, tmp_path, notes=["Note."]) == f"Note. {BARS}. {' '.join(ORIGIN)}"
    figure, axes = figures.new_figure()
    points(axes, [1.0, 2.0], [np.nan, np.nan])
    assert not axes.containers[0].has_yerr, "the legend shows a bar"
    draw_bounds(axes, [0.0, 1.0], [1.0, np.nan], 0.2, properties=PROPERTIES)
    assert footer(figure, tmp_path) == " ".join(ORIGIN)


def test_the_legend_has_the_entries_of_all_panels_the_fullest_first(tmp_path: Path) -> None:
    figure, (first, second, third) = panels(3, columns=3)
    labels = {first: "cb", second: "dca", third: "e"}
    for axes, own in labels.items():
        for label in own:
            axes.plot([0, 1], [0, 1], label=label)
    finish(figure, tmp_path / "figure", [], ORIGIN)
    (legend,) = figure.legends
    assert "".join(text.get_text() for text in legend.get_texts()) == "dcabe"


def test_limits_are_widened_to_what_is_drawn(tmp_path: Path) -> None:
    figure, axes = figures.new_figure()
    points(axes, [0.5, 0.6], [0.7, 0.1])
    axes.fill_between([0, 1], [0.4, 0.5], [0.6, 1.4], alpha=0.2)
    axes.set_xlim(left=0.5)
    axes.set_ylim(0, 1)
    assert "cut" not in footer(figure, tmp_path)
    assert axes.get_ylim()[0] < -0.2
    assert axes.get_ylim()[1] > 1.4
    assert axes.get_xlim()[0] < 0


@pytest.mark.parametrize(
    ("half_widths", "stated"),
    [
        ([0.1, 1.0, 3.0], "1 error bar reaches to 0 or below: cut by the axis."),
        ([2.0, 3.0, 3.0], "3 error bars reach to 0 or below: cut by the axis."),
        ([0.1, 0.1, 0.1], None),
    ],
)
def test_what_a_logarithmic_axis_cannot_show_is_stated(
    half_widths: list[float], stated: str | None, tmp_path: Path
) -> None:
    figure, axes = figures.new_figure()
    points(axes, [1.0, 1.5, 2.0], half_widths)
    axes.set_yscale("log")
    axes.set_ylim(1.4, 1.6)
    said = footer(figure, tmp_path)
    assert (stated in said) if stated else "cut" not in said
    assert axes.get_ylim()[1] > 2 + half_widths[2]


def test_references_state_where_they_have_no_point() -> None:
    assert gravish_note([0.4, 0.7]).endswith("at every l/w shown.")
    assert gravish_note([0.4, 0.5, 0.55]).endswith("no φ_0 at l/w = 0.5, 0.55; no φ_f at l/w = 0.55.")


def test_seeds_that_follow_each_other_are_a_range() -> None:
    assert format_numbers([3, 1, 2, 2]) == "1 2 3"
    assert format_numbers([*range(1, 21), 30]) == "1 to 20 30"
