"""The figure of the studies of sensitivity: φ before and after shaking, one row per variant."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from postprocess.report import figures
from studies.base.shaken import STAGES
from studies.framework.plots import draw_means, finished, marker
from studies.framework.provenance import DIGITISING_ERROR, told_reference
from studies.framework.runs import DEFINITION

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_WIDTH = 1.5 * figures.COLUMN_WIDTH
_ROW = 0.19  # inch per variant
_BELOW = 0.28  # rows by which single runs stand below their mean
_MARGIN = 0.85  # inch for title, axis and legend
_LEAST = 2.2  # inch: a footer is a fifth of the figure at most
_SYMBOLS = {"phi_0": r"$\phi_0$", "phi_f": r"$\phi_\mathrm{f}$"}


def draw(
    path: Path,
    *,
    runs: pd.DataFrame,
    summary: pd.DataFrame,
    aspect: float,
    reference: Mapping[str, float],
    footer: Sequence[str],
) -> list[Path]:
    """Draws and writes the figure.

    Args:
        path: Without suffix.
        runs: See `measure.sensitivity_row`.
        summary: See `measure.summarise_variants`; its first row is the baseline.
        aspect: Aspect ratio of the runs [-].
        reference: Gravish's value of each stage, NaN without one [-].
        footer: Origin, one statement each.

    Returns:
        The files written.
    """
    with figures.style():
        figure = figures.blank_figure(_WIDTH, max(_MARGIN + _ROW * len(summary), _LEAST))
        panels = figure.subplots(1, len(reference), sharey=True)
        for axes, (stage, value) in zip(panels, reference.items(), strict=True):
            _draw_panel(axes, stage, runs, summary, value)
        panels[0].set_yticks(range(len(summary)), labels=list(summary["variant"]))
        panels[0].set_ylim(len(summary) - 0.4, -0.6)
        # The first panel need not have all: Gravish has some stages only.
        shown = {
            label: handle for axes in panels for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
        }
        figure.legend(shown.values(), shown.keys(), loc="outside upper center", ncols=len(shown))
        return finished(figure, path, ["Small dots: single runs.", told_reference([aspect], list(reference))], footer)


def _draw_panel(axes: Axes, stage: str, runs: pd.DataFrame, summary: pd.DataFrame, reference: float) -> None:
    column = f"{stage} {DEFINITION} [-]"
    rows = range(len(summary))
    values, bars = summary[column].to_numpy(), summary[f"{stage} {DEFINITION} 95 % [-]"].to_numpy()
    if math.isfinite(bars[0]):
        low, high = values[0] - bars[0], values[0] + bars[0]
        axes.axvspan(low, high, color=figures.SKY, alpha=0.3, linewidth=0, label="baseline, 95 %")
    if math.isfinite(reference):
        axes.axvspan(
            reference - DIGITISING_ERROR, reference + DIGITISING_ERROR, color=figures.ORANGE, alpha=0.12, linewidth=0
        )
        axes.axvline(reference, color=figures.ORANGE, linewidth=0.9, label="Gravish et al. 2012")
    places = {variant: row for row, variant in enumerate(summary["variant"])}
    below = runs["variant"].map(places) + _BELOW
    axes.plot(runs[column], below, linestyle="none", marker=".", markersize=2.4, color=figures.GREY)
    look = {**marker("D", figures.BLUE, figures.BLUE), "linestyle": "none"}
    draw_means(axes, values, rows, None, across=bars, look=look, label="mean over seeds")
    axes.set_xlabel(f"{_SYMBOLS[stage]} {STAGES[stage]} [-]")
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)
