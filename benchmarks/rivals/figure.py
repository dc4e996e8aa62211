"""The figure: what a simulated second costs against how deep smarticles are in each other, one marker per setting."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from benchmarks.rivals.labels import Label, place
from benchmarks.rivals.running import COST, DEPTH
from postprocess.report import figures

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HEIGHT = 4.4  # inch, of the panels
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
        figure = figures.blank_figure(figures.COLUMN_WIDTH * len(activities), HEIGHT)
        panels = figure.subplots(1, len(activities), sharey=True, squeeze=False)[0]
        for axes, activity in zip(panels, activities, strict=True):
            rows = table[table["activity"] == activity]
            for engine, (shape, colour) in LOOKS.items():
                own = rows[rows["engine"] == engine]
                if len(own):
                    axes.plot(1e3 * own[DEPTH], own[COST], marker=shape, color=colour, label=engine, linestyle="none")
            axes.set(xscale="log", yscale="log", title=activity, xlabel="deepest overlap [mm]")
            axes.margins(x=0.2, y=0.08)
        panels[0].set_ylabel("processor time per simulated time [s/s]")
        figure.legend(*_every_engine(panels), loc="outside upper center", ncols=len(LOOKS))
        figures.add_footer(figure, footer)
        for axes, activity in zip(panels, activities, strict=True):
            rows = table[table["activity"] == activity]
            place(axes, [
                Label((1e3 * row[DEPTH], row[COST]), row["setting"], LOOKS[row["engine"]][1])
                for row in rows.to_dict("records")
            ])  # fmt: skip
        return figures.save(figure, path)


def _every_engine(panels: Sequence[Axes]) -> tuple[list[Any], list[str]]:
    """Handles and names of a legend for all panels, in the order of the looks."""
    found: dict[str, Any] = {}
    for axes in panels:
        handles, names = axes.get_legend_handles_labels()
        found.update(zip(names, handles, strict=True))
    names = [name for name in LOOKS if name in found]
    return [found[name] for name in names], names
