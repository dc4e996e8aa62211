"""The figures of the study `finite-size`: φ and ⟨N⟩ against N^(-1/3), the entanglement graph against l/w and ⟨N⟩."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from postprocess.report import figures
from postprocess.statistics.columns import ASPECT
from studies.finite_size.findings import PAPER_ASPECT, PAPER_COUNT
from studies.finite_size.measure import AFTER, BEFORE, COUNT, STAGES, crossings, phi, share, spans
from studies.finite_size.percolation import near
from studies.finite_size.scaling import POWER, fitted
from studies.framework.plots import CROSSINGS_LABEL, draw_means, finished, marker

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_SIZE = r"$N^{-1/3}$ [-]"
_COLOURS = (figures.SKY, figures.BLUE, figures.GREEN, figures.ORANGE, figures.BLACK)
_MARKS = ("o", "s", "D", "^", "v")
_NAMES = {BEFORE: "poured", AFTER: "shaken"}
_LOOKS = {BEFORE: ("o", figures.BLUE), AFTER: ("s", figures.ORANGE)}
_PAGE = 2 * figures.COLUMN_WIDTH
_VOXEL = "voxel"


def draw(output: Path, *, runs: pd.DataFrame, points: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    """Draws and writes all figures.

    Args:
        output: Folder.
        runs: Rows of `measure.size_row`.
        points: Means of them over seeds.
        footer: Origin, one statement each.

    Returns:
        The files written.
    """
    with figures.style():
        return [
            *_draw_scaling(output / "scaling", runs, points, footer),
            *_draw_percolation(output / "percolation", runs, points, footer),
        ]


def _draw_scaling(path: Path, runs: pd.DataFrame, points: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    """φ by the paper's definition, φ of the inside, and ⟨N⟩ at the paper's l/w, with the law fitted to each."""
    here = points[points[ASPECT] == PAPER_ASPECT].sort_values(COUNT)
    if here.empty:
        return []
    figure = figures.blank_figure(_PAGE, 2.7)
    panels = figure.subplots(1, 3)
    shown: tuple[tuple[str, Callable[[str], str]], ...] = (
        (r"packing fraction $\phi$ [-]", phi),
        (r"$\phi$ of the inside, by voxels [-]", lambda stage: phi(stage, _VOXEL)),
        (CROSSINGS_LABEL, crossings),
    )
    for axes, (label, column) in zip(panels, shown, strict=True):
        for stage in _LOOKS:
            _draw_law(axes, runs, here, column(stage), stage)
        axes.axvline(PAPER_COUNT**-POWER, color=figures.GREY, linewidth=0.6, linestyle=":")
        axes.set_xlim(left=0)
        axes.set_xlabel(_SIZE)
        axes.set_ylabel(label)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    told = (
        f"l/w = {PAPER_ASPECT:g}; lines: fits of q_∞ + a N^(-1/3), bands: 95 % of them; 0 is a pile without end; "
        f"dotted: the paper's {PAPER_COUNT} smarticles."
    )
    return finished(figure, path, [told], footer, pooled=True)


def _draw_law(axes: Axes, runs: pd.DataFrame, here: pd.DataFrame, column: str, stage: str) -> None:
    """Means over seeds of one quantity at every size, and the law."""
    mark, colour = _LOOKS[stage]
    look, name = {**marker(mark, colour, colour), "linestyle": "none"}, _NAMES[stage]
    places, means = here[COUNT].to_numpy(dtype=np.float64) ** -POWER, here[column].to_numpy()
    law = fitted(runs, PAPER_ASPECT, column)
    if law is None:
        draw_means(axes, places, means, None, look=look, label=name)
        return
    errors = [law.scatter.error(count, number) for count, number in here[[COUNT, "seeds [-]"]].to_numpy().tolist()]
    draw_means(axes, places, means, errors, look=look, label=name)
    along = np.linspace(0, places.max() * 1.05, 60)
    line = law.bulk + law.slope * along
    band = np.array([law.error(1, float(one)) for one in along])
    axes.plot(along, line, color=colour, linewidth=0.9)
    if np.isfinite(band).all():
        axes.fill_between(along, line - band, line + band, color=colour, alpha=0.15, linewidth=0)


def _draw_percolation(path: Path, runs: pd.DataFrame, points: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    """Share of the piles that are spanned against l/w, and of smarticles in the largest cluster against ⟨N⟩."""
    rows, each = near(points), near(runs)
    if rows.empty:
        return []
    figure = figures.blank_figure(_PAGE, 4.6)
    grid = figure.subplots(2, len(STAGES), sharex="row", sharey="row", squeeze=False)
    sizes = sorted(rows[COUNT].unique())
    for panel, stage in enumerate(STAGES):
        upper, lower = grid[0][panel], grid[1][panel]
        for size, colour, mark in zip(sizes, _COLOURS, _MARKS, strict=False):
            part = rows[rows[COUNT] == size].sort_values(ASPECT)
            look = {**marker(mark, colour, colour), "linewidth": 0.9}
            draw_means(upper, part[ASPECT], part[spans(stage)], None, look=look, label=f"N = {size}")
            single = each[each[COUNT] == size]
            lower.plot(
                single[crossings(stage)], single[share(stage)], mark, color=colour, markersize=3, label=f"N = {size}"
            )
        upper.set_title(_NAMES[stage], fontsize=8)
        upper.set_xlabel(r"$l/w$ [-]")
        lower.set_xlabel(CROSSINGS_LABEL)
    grid[0][0].set_ylabel("share of the piles that are spanned [-]")
    grid[1][0].set_ylabel("share of the largest cluster [-]")
    figure.legend(*grid[0][0].get_legend_handles_labels(), loc="outside upper center", ncols=len(sizes))
    told = "Spanned: entangled clusters join floor and top, and wall and wall. Above: shares of seeds; below: each run."
    return finished(figure, path, [told], footer)
