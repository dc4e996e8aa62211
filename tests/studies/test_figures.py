"""What all figures of studies have in common: a short footer, one kind of error bars, and nothing that is cut unsaid.

Every figure that any test of a study draws is held against the same, see `conftest.looked_at`.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import studies
from postprocess.report import figures
from postprocess.report.figures import hold_everything
from studies.framework.plots import draw_bounds, draw_means, finished, marker
from studies.framework.provenance import told_gaps, told_reference
from studies.framework.runs import BARS, told_numbers

LOOK = {**marker("o", figures.BLUE, "white"), "linestyle": "none"}
ORIGIN = ("Study toy: 2 of 2 runs.", "More: toy.md.")


def finish(figure: Figure, tmp_path: Path, *, told: Sequence[str] = (), pooled: bool = False) -> str:
    """What stands below a figure."""
    finished(figure, tmp_path / "figure", told, ORIGIN, pooled=pooled)
    return figure.texts[-1].get_text().replace("\n", " ")


def points(axes: Axes, middle: Sequence[float], half_widths: Sequence[float]) -> None:
    draw_means(axes, range(len(middle)), middle, half_widths, look=LOOK, label="points")


# -- error bars ------------------------------------------------------------------------------------------------------


def test_error_bars_are_named_once_and_only_where_there_are_any(tmp_path: Path) -> None:
    figure, axes = figures.new_figure()
    points(axes, [1.0, 2.0], [0.1, np.nan])
    points(axes, [1.5, 2.5], [0.1, 0.1])
    assert finish(figure, tmp_path, told=["Told."]) == f"Told. {BARS}. {' '.join(ORIGIN)}"
    figure, axes = figures.new_figure()
    points(axes, [1.0, 2.0], [np.nan, np.nan])
    draw_bounds(axes, [0.0, 1.0], [1.0, np.nan], 0.2, look=LOOK)
    assert finish(figure, tmp_path) == " ".join(ORIGIN)


def test_scatter_that_points_share_is_told(tmp_path: Path) -> None:
    figure, axes = figures.new_figure()
    points(axes, [1.0], [0.1])
    assert f"{BARS}, scatter pooled over all points. " in finish(figure, tmp_path, pooled=True)


def test_error_bars_may_lie_across(tmp_path: Path) -> None:
    figure, axes = figures.new_figure()
    draw_means(axes, [3.0], [0], None, across=[0.5], look=LOOK, label="one")
    assert BARS in finish(figure, tmp_path)
    (bars,) = axes.containers
    assert np.concatenate(bars.lines[2][0].get_segments())[:, 0].tolist() == [2.5, 3.5]


def test_no_study_draws_error_bars_by_itself() -> None:
    """So that all are of one kind: `framework.plots` draws those of 95 %, and names them."""
    own = []
    for path in Path(studies.__file__).parent.rglob("*.py"):
        called = {
            node.func.attr
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
        }
        if called & {"errorbar", "savefig", "add_footer"}:
            own.append("/".join(path.parts[-2:]))
    assert own == ["framework/plots.py"]


# -- limits ----------------------------------------------------------------------------------------------------------


def test_limits_are_widened_to_what_is_drawn(tmp_path: Path) -> None:
    figure, axes = figures.new_figure()
    points(axes, [0.5, 0.6], [0.7, 0.1])
    axes.fill_between([0, 1], [0.4, 0.5], [0.6, 1.4], alpha=0.2)
    axes.set_xlim(left=0.5)
    axes.set_ylim(0, 1)
    assert "cut" not in finish(figure, tmp_path)
    assert axes.get_ylim()[0] < -0.2
    assert axes.get_ylim()[1] > 1.4
    assert axes.get_xlim()[0] < 0


def test_limits_that_hold_everything_stay() -> None:
    figure, axes = figures.new_figure()
    points(axes, [0.5, 0.6], [0.1, 0.1])
    axes.set_xlim(-2, 7)
    axes.set_ylim(1.1, 0)  # downwards
    assert hold_everything(figure) == []
    assert (*axes.get_xlim(), *axes.get_ylim()) == (-2, 7, 1.1, 0)
    axes.set_ylim(0.55, 0)
    hold_everything(figure)
    assert axes.get_ylim()[0] > 0.7
    assert axes.get_ylim()[1] == 0
    empty, _ = figures.new_figure()
    assert hold_everything(empty) == []


@pytest.mark.parametrize(
    ("half_widths", "told"),
    [
        ([0.1, 1.0, 3.0], "1 error bar reaches to 0 or below: cut by the axis."),
        ([2.0, 3.0, 3.0], "3 error bars reach to 0 or below: cut by the axis."),
        ([0.1, 0.1, 0.1], None),
    ],
)
def test_what_a_logarithmic_axis_cannot_show_is_told(
    half_widths: list[float], told: str | None, tmp_path: Path
) -> None:
    figure, axes = figures.new_figure()
    points(axes, [1.0, 1.5, 2.0], half_widths)
    axes.set_yscale("log")
    axes.set_ylim(1.4, 1.6)
    said = finish(figure, tmp_path)
    assert (told in said) if told else "cut" not in said
    assert axes.get_ylim()[1] > 2 + half_widths[2]


# -- footers ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("height", [1.5, 2.6, 4.6])
def test_a_footer_never_takes_more_than_its_share(height: float) -> None:
    figure, _ = figures.new_figure(height=height)
    # Behind the back of the test that looks at all figures: this one is to be cut.
    figures_module_footer(figure, ["word " * 300, "More: toy.md, provenance.json."])
    text = figure.texts[-1]
    figure.draw_without_rendering()
    share = text.get_window_extent().height / (figure.get_size_inches()[1] * figure.dpi)
    assert share <= figures.FOOTER_SHARE
    *_, cut, last = text.get_text().splitlines()
    assert (cut.endswith("word …"), last) == (True, "More: toy.md, provenance.json.")


@pytest.mark.parametrize("lines", [["One."], ["One.", "Two."], ["word " * 19, "More."]])
def test_a_short_footer_is_left_as_it_is(lines: list[str]) -> None:
    figure, _ = figures.new_figure()
    figures.add_footer(figure, lines)
    assert figure.texts[-1].get_text().splitlines() == [line.strip() for line in lines]


def figures_module_footer(figure: Figure, lines: Sequence[str]) -> None:
    """`figures.add_footer` as it is, without the eye of the tests on it."""
    wrapped = figures.add_footer
    original = next(
        cell.cell_contents
        for cell in wrapped.__closure__ or ()
        if getattr(cell.cell_contents, "__name__", "") == "add_footer"
    )
    original(figure, lines)


# -- points that were never digitised ----------------------------------------------------------------------------------


def test_references_tell_where_they_have_no_point() -> None:
    assert told_gaps({"φ_0": [0.5, 0.8], "φ_f": []}) == "no φ_0 at l/w = 0.5, 0.8"
    assert told_gaps({"φ_0": [0.55], "φ_f": [0.55]}) == "no φ_0 at l/w = 0.55; no φ_f at l/w = 0.55"
    assert told_reference([0.4, 0.7], ("phi_0", "phi_f")).endswith("at every l/w shown.")
    assert told_reference([0.4, 0.5, 0.85], ("phi_f",)).endswith("no φ_f at l/w = 0.85.")


def test_seeds_that_follow_each_other_are_told_as_a_range() -> None:
    assert told_numbers([3, 1, 2, 2]) == "1 2 3"
    assert told_numbers([*range(1, 21), 30]) == "1 to 20 30"
