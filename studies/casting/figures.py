"""The figures of the study `casting`; see `studies.casting.study` for what they show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dem.record.manifest import RunManifest
from postprocess.pictures.strip import Row, draw_strip
from postprocess.report import figures
from postprocess.statistics.columns import SEED
from postprocess.statistics.points import marked
from studies.base.release import ORDER, around, removal
from studies.casting.measure import (
    AFTER,
    FILLED,
    FILLED_AFTER,
    KEPT,
    LIKENESS,
    LIKENESS_BEFORE,
    OVERLAP,
    TIERS,
    WHOLE,
    WHOLE_AFTER,
    WHOLE_KEPT,
)
from studies.framework.plots import draw_means, finished, legend_above, procedure_marker
from studies.framework.procedures import INTERNAL, PROCEDURE, SHAPE, STATIC

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_LABELS = {STATIC: "static", INTERNAL: r"internal oscillation, $\theta$ = 10°", SHAPE: "shape change"}
_PLACES = [*TIERS, "whole"]
_STAGES = {
    "inside the pile before\n[share of the tier]": [*FILLED.values(), WHOLE],
    f"inside the pile {AFTER:g} s after\n[share of the tier]": [*FILLED_AFTER.values(), WHOLE_AFTER],
    "kept of what was filled\n[-]": [*KEPT.values(), WHOLE_KEPT],
}
_OVERALL = {
    "pile and mould,\nbefore": LIKENESS_BEFORE,
    "pile and mould,\nafter": LIKENESS,
    "pile before\nand after": OVERLAP,
}
_COLOURS = "Each smarticle has a colour of its own, the same in all pictures of a row; first seed."


def draw(
    output: Path,
    *,
    points: pd.DataFrame,
    runs: pd.DataFrame,
    manifests: Sequence[RunManifest],
    footer: Sequence[str],
) -> list[Path]:
    """Draws and writes all figures.

    Args:
        output: Folder.
        points: Means over seeds, see `base.release.means`.
        runs: Rows of `measure.casting_row`.
        manifests: The runs.
        footer: Origin, one statement each.

    Returns:
        The files written.
    """
    with figures.style():
        written = _draw_tiers(output / "tiers", points, footer)
        written += _draw_overlaps(output / "overlap", points, footer)
    by_name = {run.directory.name: run for run in manifests}
    return written + _draw_pictures(output / "pictures.png", runs, by_name, footer)


def _draw_tiers(path: Path, points: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    figure = figures.blank_figure(2 * figures.COLUMN_WIDTH, 2.4)
    panels = figure.subplots(1, len(_STAGES), sharex=True)
    for axes, (label, columns) in zip(panels, _STAGES.items(), strict=True):
        _draw_places(axes, points, columns)
        axes.set_xticks(range(len(_PLACES)), labels=_PLACES)
        axes.set_xlabel("tier of the mould")
        axes.set_ylabel(label)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return finished(figure, path, (), footer)


def _draw_overlaps(path: Path, points: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    figure, axes = figures.new_figure(height=2.6)
    _draw_places(axes, points, list(_OVERALL.values()))
    axes.set_xticks(range(len(_OVERALL)), labels=list(_OVERALL))
    axes.set_ylabel("common volume over that of both [-]")
    legend_above(axes)
    return finished(figure, path, (), footer)


def _draw_places(axes: Axes, points: pd.DataFrame, columns: Sequence[str]) -> None:
    for k, (procedure, label) in enumerate(_LABELS.items()):
        part = points[points[PROCEDURE] == procedure]
        if part.empty:
            continue
        point = part.iloc[0]
        values, errors = ([float(point[name]) for name in names] for names in (columns, map(_error, columns)))
        # Side by side, to keep error bars apart.
        x = np.arange(len(columns)) + 0.16 * (k - 1)
        draw_means(axes, x, values, errors, look={**procedure_marker(procedure), "linestyle": "none"}, label=label)
    # Error bars of a share may reach beyond 0 and 1; they are shown whole.
    axes.set_ylim(min(1.05 * axes.dataLim.y0, 0.0), max(1.02 * axes.dataLim.y1, 1.05))
    axes.set_xlim(-0.5, len(columns) - 0.5)


def _error(quantity: str) -> str:
    return marked(quantity, "95 %")


def _draw_pictures(
    path: Path, runs: pd.DataFrame, manifests: Mapping[str, RunManifest], footer: Sequence[str]
) -> list[Path]:
    """The first seed of each procedure."""
    rows = []
    for procedure in ORDER:
        part = runs[runs[PROCEDURE] == procedure].sort_values(SEED)
        if part.empty:
            continue
        run = manifests[str(part["run"].iloc[0])]
        start = removal(run).start
        if start is not None:
            times = (around(run)[0].time, start + 0.1, start + AFTER)
            rows.append(Row(directory=run.directory, label=_LABELS[procedure], times=times))
    if not rows:
        return []
    columns = ("before the walls go", "0.1 s after", f"{AFTER:g} s after")
    return [draw_strip(rows, path, columns=columns, footer=[_COLOURS, *footer])]
