"""The figure of a ladder of accuracy: errors against what a simulated second costs, one marker per knob."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from postprocess.report import figures
from postprocess.statistics.points import marked
from studies.accuracy.measure import COST, IS_REFERENCE, KNOB, VERDICT, measured
from studies.framework.plots import draw_means, finished, marker

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_WIDTH, _HEIGHT = 2 * figures.COLUMN_WIDTH, 4.6
_COLUMNS = 2
_SYMBOLS = {"phi_0": r"$\phi_0$", "phi_f": r"$\phi_\mathrm{f}$", "height": "$h_0$", "crossings": r"$\langle N\rangle$"}
_SYMBOLS |= {"hook_force": r"$F_\mathrm{peak}$"}
_LOOKS = (
    ("o", figures.BLUE),
    ("s", figures.ORANGE),
    ("^", figures.BLACK),
    ("x", figures.GREY),
    ("v", figures.SKY),
    ("P", figures.BLUE),
    ("D", figures.ORANGE),
)
# The scene itself is a rung of every knob: knobs stand side by side, by a factor in the cost.
_APART = 1.05


def draw(path: Path, *, table: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    """Draws and writes the figure.

    Args:
        path: Without suffix.
        table: See `measure.work_precision`.
        footer: Origin, one statement each.

    Returns:
        The files written.
    """
    with figures.style():
        figure = figures.blank_figure(_WIDTH, _HEIGHT)
        names = measured(table)
        panels = list(figure.subplots(math.ceil(len(names) / _COLUMNS), _COLUMNS, sharex=True).flat)
        for axes in panels[len(names) :]:
            axes.remove()
        for axes, name in zip(panels, names, strict=False):
            _draw_panel(axes, name, table)
        shown = {
            label: handle for axes in panels for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
        }
        if shown:
            figure.legend(shown.values(), shown.keys(), loc="outside upper center", ncols=math.ceil(len(shown) / 2))
        told = "Hollow: references. Band: median of the error bars."
        return finished(figure, path, [told], footer, pooled=True)


def _draw_panel(axes: Axes, name: str, table: pd.DataFrame) -> None:
    errors, bands = f"{name} error [%]", f"{name} error 95 % [%]"
    others = table[table[VERDICT] != IS_REFERENCE]
    typical = float(np.median(others[bands].dropna())) if others[bands].notna().any() else math.nan
    if math.isfinite(typical):
        axes.axhspan(-typical, typical, color=figures.SKY, alpha=0.25, linewidth=0, label="seed-to-seed band, 95 %")
    axes.axhline(0.0, color=figures.GREY, linewidth=0.6)
    knobs = list(dict.fromkeys(table[KNOB]))
    for place, knob in enumerate(knobs):
        shape, colour = _LOOKS[place % len(_LOOKS)]
        rows = table[(table[KNOB] == knob) & table[COST].notna() & table[errors].notna()]
        if rows.empty:
            continue
        shift = _APART ** (place - (len(knobs) - 1) / 2)
        if not rows["sensitivity"].any():
            axes.plot(rows[COST] * shift, rows[errors], color=colour, linewidth=0.5, alpha=0.6)
        for own, face in ((False, colour), (True, "white")):
            part = rows[(rows[VERDICT] == IS_REFERENCE) == own]
            if part.empty:
                continue
            look = marker(shape if not own or shape != "x" else "o", colour, face) | {"linestyle": "none"}
            # A reference has no error of its own: its scatter is in the bands of the others.
            high = np.full(len(part), math.nan) if own else part[bands].to_numpy()
            wide = part[marked(COST, "95 %")].to_numpy()
            label = "_nolegend_" if own else f"{knob} (sensitivity)" if rows["sensitivity"].any() else knob
            draw_means(axes, part[COST] * shift, part[errors], high, across=wide, look=look, label=label)
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda cost, _: f"{cost:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("processor time per simulated time [s/s]")
    axes.set_ylabel(f"error of {_SYMBOLS[name]} [%]")
