"""The figures of the study `strength`; see `studies.strength.study` for what they show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dem.record.manifest import RunManifest
from dem.record.series import read_series
from postprocess.measures.pull import moving_mean, read_pull, weight_of_one
from postprocess.report import figures
from postprocess.statistics.points import marked
from studies.base.figures import (
    BAND,
    COLOURS,
    CROSSINGS_LABEL,
    SHAPES,
    History,
    draw_against,
    draw_history,
    draw_means,
    draw_runs,
    finished,
    legend_above,
    procedure_marker,
)
from studies.base.procedures import (
    AMPLITUDE,
    CROSSINGS,
    EXTERNAL,
    INTERNAL,
    PROCEDURE,
    SHAPE,
    STATIC,
    THETA,
    of_procedure,
)
from studies.base.release import ORDER
from studies.strength.findings import compared
from studies.strength.measure import CARRIED, HELD_FAST, PEAK, PEAK_RAISED, UPPER, WORK

if TYPE_CHECKING:
    import pandas as pd

_LABELS = {
    SHAPE: "shape change",
    EXTERNAL: "external",
    INTERNAL: rf"internal, $\theta$ = {AMPLITUDE:g}°",
    STATIC: "static",
}
_FORCE, _RAISED = r"force on the hook $F/(n W_\mathrm{s})$ [-]", "hook raised by [mm]"
_PEAK = r"peak force $F_\mathrm{max}/(n W_\mathrm{s})$ [-]"
_WIDTH = 0.5  # mm of the hook's way over which forces are averaged: the side of its bars
_PANELS = {
    PEAK: (_PEAK, 1.0),
    PEAK_RAISED: ("hook raised at the peak [mm]", 1e3),
    WORK: (r"work $W/(n W_\mathrm{s} w)$ [-]", 1.0),
    CARRIED: ("share carried off [-]", 1.0),
}


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
        runs: Rows of `measure.strength_row`.
        manifests: The runs, in any order.
        footer: Origin, one statement each.

    Returns:
        The files written.
    """
    by_name = {run.directory.name: run for run in manifests}
    with figures.style():
        written = _draw_forces(output / "force_raised", compared(runs), by_name, footer)
        written += _draw_means(output / "strength", compared(points), footer)
        written += _draw_crossings(output / "peak_crossings", points, runs, footer)
    return written


def _history(run: RunManifest) -> History:
    """Force over n W_s against the hook's way [mm]."""
    pull = read_pull(run, read_series(run.directory), run.phases[-1].index)
    times, force = moving_mean(pull)
    way = 1e3 * np.interp(times, pull.edges, pull.raised)
    return History(times=way, values=force / run.count / weight_of_one(run), active=0.0)


def _draw_forces(
    path: Path, runs: pd.DataFrame, by_name: Mapping[str, RunManifest], footer: Sequence[str]
) -> list[Path]:
    """One panel for each height of the hook; every run as a thin line, means over seeds as thick ones."""
    heights = sorted(runs[UPPER].unique())
    figure = figures.blank_figure(2 * figures.COLUMN_WIDTH, 2.6)
    panels = figure.subplots(1, len(heights), sharey=True, squeeze=False)[0]
    for axes, height in zip(panels, heights, strict=True):
        for procedure in ORDER:
            part = runs[(runs[UPPER] == height) & (runs[PROCEDURE] == procedure)]
            seeds = [_history(by_name[name]) for name in part["run"]]
            if seeds:
                draw_history(axes, seeds, _WIDTH, colour=COLOURS[procedure], label=_LABELS[procedure])
        axes.axhline(0.0, color=figures.GREY, linewidth=0.6)
        axes.set_xlabel(_RAISED)
        axes.set_title(f"hook {1e3 * height:g} mm above the floor")
    panels[0].set_ylabel(_FORCE)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4)
    told = f"Line: mean over seeds, as far as all of them go, over {_WIDTH:g} mm; {BAND}."
    return finished(figure, path, [told], footer)


def _draw_means(path: Path, points: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    heights = sorted(points[UPPER].unique())
    figure = figures.blank_figure(2 * figures.COLUMN_WIDTH, 4.4)
    grid = figure.subplots(2, 2, sharex=True)
    for axes, (quantity, (label, scale)) in zip(grid.flat, _PANELS.items(), strict=True):
        for k, procedure in enumerate(ORDER):
            part = points[points[PROCEDURE] == procedure].sort_values(UPPER)
            if part.empty:
                continue
            # Side by side, to keep error bars apart.
            x = np.array([heights.index(height) for height in part[UPPER]]) + 0.14 * (k - 1.5)
            look = {**procedure_marker(procedure), "linestyle": "none"}
            errors = scale * part[marked(quantity, "95 %")].to_numpy()
            draw_means(axes, x, scale * part[quantity], errors, look=look, label=_LABELS[procedure])
        axes.set_xticks(range(len(heights)), labels=[f"{1e3 * height:g}" for height in heights])
        axes.set_xlim(-0.5, len(heights) - 0.5)
        axes.set_ylim(bottom=0)
        axes.set_ylabel(label)
    for axes in grid[1]:
        axes.set_xlabel("hook above the floor [mm]")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4)
    return finished(figure, path, [], footer)


def _draw_crossings(path: Path, points: pd.DataFrame, runs: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    """Peak force against ⟨N⟩: every run, an arrow where it held fast, and the means of each height and θ."""
    figure, axes = figures.new_figure(height=2.8)
    length = 0.08 * float(runs[PEAK].max())
    for procedure in ORDER:
        one, mean = runs[runs[PROCEDURE] == procedure], of_procedure(points, procedure)
        if one.empty:
            continue
        shape, colour = SHAPES[procedure], COLOURS[procedure]
        draw_runs(axes, one, CROSSINGS, PEAK, bounds=HELD_FAST, length=length, shape=shape, colour=colour)
        look = {"markersize": 4.2, **procedure_marker(procedure)}
        draw_against(axes, mean, CROSSINGS, PEAK, look=look, label=_LABELS[procedure])
    others = points[(points[PROCEDURE] == INTERNAL) & (points[THETA] != AMPLITUDE)]
    open_marker = {**procedure_marker(INTERNAL), "markerfacecolor": "white", "zorder": 6}
    draw_against(axes, others, CROSSINGS, PEAK, look=open_marker, label="")
    for k, (_, point) in enumerate(others.sort_values(CROSSINGS).iterrows()):
        # Above runs nearby, by turns at two heights, with a line down to its mean.
        place, above = (point[CROSSINGS], point[PEAK]), (point[CROSSINGS], (0.36 + 0.07 * (k % 2)) * axes.dataLim.y1)
        line = {"arrowstyle": "-", "color": COLOURS[INTERNAL], "linewidth": 0.6, "shrinkA": 0, "shrinkB": 2}
        axes.annotate(f"{point[THETA]:g}°", place, above, color=COLOURS[INTERNAL], ha="center", arrowprops=line)
    axes.set_xlabel(CROSSINGS_LABEL)
    axes.set_ylabel(_PEAK)
    axes.set_ylim(bottom=0)
    legend_above(axes)
    told = "Small: single runs, with an arrow: held fast, a lower bound; large: means over seeds of each height"
    told += "." if others.empty else ", open: of the internal oscillation at another θ."
    return finished(figure, path, [told], footer)
