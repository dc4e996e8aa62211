"""The figure of the study `factors`: every combination of the paper's two sets of rules."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from postprocess.report import figures
from postprocess.statistics.columns import ASPECT
from postprocess.statistics.points import marked
from studies.base.activity import HEIGHT
from studies.base.figures import draw_means, finished, legend_above, marker
from studies.base.procedures import CROSSINGS

_SHOWN = {CROSSINGS: r"$\langle N \rangle$ after the shape change [-]", HEIGHT: r"height over $h_0$ after it [-]"}
_MARKERS = (("o", figures.BLUE, figures.BLUE), ("s", figures.ORANGE, "white"), ("^", figures.GREY, "white"))
_APART = 0.16  # of the aspect ratios' places, so that bars do not lie on each other


def draw(
    output: Path, *, points: pd.DataFrame, factors: Mapping[str, tuple[object, object]], footer: Sequence[str]
) -> list[Path]:
    """Draws and writes ⟨N⟩ and height of every combination, text at the top and code at the bottom.

    Args:
        output: Folder.
        points: Means of combinations, see `factors.Factors.tabulate`.
        factors: The rules, by the text and by the code.
        footer: Lines below the figure.

    Returns:
        The files.
    """
    by_code = pd.DataFrame({name: points[name] == rule[1] for name, rule in factors.items()})
    rows = points.assign(_changed=by_code.sum(axis=1), _order=by_code.to_numpy() @ [4, 2, 1])
    names = [_named(row) for _, row in rows.drop_duplicates("_order").sort_values(["_changed", "_order"]).iterrows()]
    order = list(rows.drop_duplicates("_order").sort_values(["_changed", "_order"])["_order"])
    with figures.style():
        figure = figures.blank_figure(7.0, 0.9 + 0.32 * max(len(order), 2))
        for axes, (quantity, label) in zip(figure.subplots(1, 2, sharey=True), _SHOWN.items(), strict=True):
            for number, (aspect, group) in enumerate(rows.sort_values("_order").groupby(ASPECT)):
                places = [order.index(one) + _APART * (number - 0.5) for one in group["_order"]]
                look = {**marker(*_MARKERS[number % len(_MARKERS)]), "linestyle": "none"}
                bars = group[marked(quantity, "95 %")]
                draw_means(axes, group[quantity], places, None, look=look, label=f"l/w = {aspect:g}", across=bars)
            axes.set_xlabel(label)
        first = figure.axes[0]
        first.set_yticks(range(len(order)), names)
        first.invert_yaxis()
        legend_above(first)
        figure.tight_layout()
        return finished(figure, output / "factors", [], footer)


def _named(row: pd.Series) -> str:
    return f"{row['law']}, μ = {row['friction [-]']:g}, r = {1e3 * row['wall radius [m]']:.1f} mm"
