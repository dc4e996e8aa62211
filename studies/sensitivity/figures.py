"""The figure of the studies of sensitivity: φ before and after shaking, one row per variant."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from postprocess.report import figures
from studies.base.references import DIGITISING_ERROR
from studies.base.runs import DEFINITION
from studies.base.shaken import STAGES

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_WIDTH = 1.5 * figures.COLUMN_WIDTH
_ROW = 0.19  # inch per variant
_BELOW = 0.28  # rows by which single runs stand below their mean
_MARGIN = 0.85  # inch for title, axis and legend
_SYMBOLS = {"phi_0": r"$\phi_0$", "phi_f": r"$\phi_\mathrm{f}$"}


def draw(
    path: Path,
    *,
    runs: pd.DataFrame,
    summary: pd.DataFrame,
    reference: Mapping[str, float],
    footer: Sequence[str],
) -> list[Path]:
    """Draws and writes the figure.

    Args:
        path: Without suffix.
        runs: See `measure.sensitivity_row`.
        summary: See `measure.summarise_variants`; its first row is the baseline.
        reference: Gravish's value of each stage, NaN without one [-].
        footer: Origin, one statement each.

    Returns:
        The files written.
    """
    with figures.style():
        figure = figures.blank_figure(_WIDTH, _MARGIN + _ROW * len(summary))
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
        figures.add_footer(figure, ["Small dots: single runs.", *footer])
        return figures.save(figure, path)


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
    axes.errorbar(values, rows, xerr=bars, **_marker(), label="mean over seeds, 95 %")
    axes.set_xlabel(f"{_SYMBOLS[stage]} {STAGES[stage]} [-]")
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)


def _marker() -> dict[str, Any]:
    return {
        "linestyle": "none",
        "marker": "D",
        "markersize": 3.2,
        "color": figures.BLUE,
        "elinewidth": 0.8,
        "capthick": 0.8,
    }
