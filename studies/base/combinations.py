"""Figures of factorial studies: quantities at every combination of the factors, one row each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import pandas as pd

from postprocess.report import figures
from postprocess.statistics.columns import ASPECT
from postprocess.statistics.points import marked
from studies.base.figures import draw_means, finished, legend_above, marker

_MARKERS = (("o", figures.BLUE, figures.BLUE), ("s", figures.ORANGE, "white"), ("^", figures.GREY, "white"))
_APART = 0.16  # of the rows' places, so that bars do not lie on each other


def draw_combinations(
    path: Path,
    *,
    points: pd.DataFrame,
    factors: Mapping[str, tuple[object, object]],
    shown: Mapping[str, str],
    named: Callable[[pd.Series], str],
    told: Sequence[str] = (),
    footer: Sequence[str],
) -> list[Path]:
    """Draws and writes quantities of every combination, those with all first levels at the top.

    Args:
        path: Of the figure, without suffix.
        points: Means of combinations by aspect ratio, with their `… 95 %`.
        factors: Both levels of each, by column; the first ones change most slowly from row to row.
        shown: Labels of the axes, by column.
        named: Name of a combination's row.
        told: What the figure says besides.
        footer: Lines below the figure.

    Returns:
        The files.
    """
    second = pd.DataFrame({name: points[name] == levels[1] for name, levels in factors.items()})
    weights = [2**place for place in reversed(range(len(factors)))]
    rows = points.assign(_changed=second.sum(axis=1), _order=second.to_numpy() @ weights)
    first_of = rows.drop_duplicates("_order").sort_values(["_changed", "_order"])
    order = list(first_of["_order"])
    with figures.style():
        figure = figures.blank_figure(7.0, 0.9 + 0.32 * max(len(order), 2))
        for axes, (quantity, label) in zip(figure.subplots(1, len(shown), sharey=True), shown.items(), strict=True):
            for number, (aspect, group) in enumerate(rows.sort_values("_order").groupby(ASPECT)):
                places = [order.index(one) + _APART * (number - 0.5) for one in group["_order"]]
                look = {**marker(*_MARKERS[number % len(_MARKERS)]), "linestyle": "none"}
                bars = group[marked(quantity, "95 %")]
                draw_means(axes, group[quantity], places, None, look=look, label=f"l/w = {aspect:g}", across=bars)
            axes.set_xlabel(label)
        first = figure.axes[0]
        first.set_yticks(range(len(order)), [named(row) for _, row in first_of.iterrows()])
        first.invert_yaxis()
        legend_above(first)
        figure.tight_layout()
        return finished(figure, path, list(told), footer)
