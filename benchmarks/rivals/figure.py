"""The figure: what a simulated second costs against how deep smarticles are in each other, one marker per setting."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from benchmarks.rivals.running import COST, DEPTH
from postprocess.report import figures

LOOKS: Mapping[str, tuple[str, str]] = {
    "links": ("o", figures.BLUE),
    "YADE": ("s", figures.SKY),
    "LAMMPS": ("D", figures.GREEN),
    "MuJoCo": ("^", figures.ORANGE),
    "Bullet": ("v", figures.BLACK),
    "Rapier": ("P", figures.GREY),
}


def draw(path: Path, table: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    """Draw and write.

    Args:
        path: without suffix.
        table: see `benchmarks.rivals.table.medians`.
        footer: what is to be known, one statement each.

    Returns:
        The files written.
    """
    activities = list(table["activity"].unique())
    with figures.style():
        figure = figures.blank_figure(figures.COLUMN_WIDTH * len(activities), 3.0)
        panels = figure.subplots(1, len(activities), sharey=True, squeeze=False)[0]
        for axes, activity in zip(panels, activities, strict=True):
            rows = table[table["activity"] == activity]
            for engine, (shape, colour) in LOOKS.items():
                own = rows[rows["engine"] == engine].sort_values(DEPTH)
                if len(own):
                    axes.plot(1e3 * own[DEPTH], own[COST], marker=shape, color=colour, label=engine, linestyle="none")
                for row in own.to_dict("records"):
                    axes.annotate(
                        row["setting"], (1e3 * row[DEPTH], row[COST]), xytext=(3, 3), textcoords="offset points",
                        fontsize=4, color=colour,
                    )  # fmt: skip
            axes.set(xscale="log", yscale="log", title=activity, xlabel="deepest overlap [mm]")
            axes.margins(0.15)
        panels[0].set_ylabel("processor time per simulated time [s/s]")
        panels[0].legend()
        figures.add_footer(figure, footer)
        return figures.save(figure, path)
