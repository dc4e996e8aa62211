"""The figures of the study `collapse`; see `studies.collapse.study` for what they show."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from postprocess.report import figures
from postprocess.statistics.columns import ASPECT
from studies.base.collapse.column import COM, CORE, REMAINING, column_history, vibration
from studies.collapse.law import ACTIVATION, AT_LEAST, CENSORED, HALF_WIDTH, LOG_HALF_WIDTH
from studies.collapse.measure import DEFINITION, GAMMA, LOG, WATCHED
from studies.collapse.reference import ACCELERATIONS, read_collapse_reference, told_points
from studies.framework.plots import (
    ASPECT_LABEL,
    BAND,
    History,
    bin_width,
    draw_bounds,
    draw_history,
    draw_means,
    finished,
    marker,
)

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from dem.record.manifest import RunManifest

_LABELS = {REMAINING: "remaining", COM: "centre of mass", CORE: "centre of mass within the radius"}
_LOOKS = {
    REMAINING: marker("o", figures.BLUE, figures.BLUE),
    COM: marker("s", figures.ORANGE, "white"),
    CORE: marker("^", figures.SKY, "white"),
}
_SHIFTS = {REMAINING: 0.0, COM: -0.012, CORE: 0.012}
_MOST_COLUMNS = 3


def draw(
    output: Path,
    *,
    rows: pd.DataFrame,
    levels: pd.DataFrame,
    activations: pd.DataFrame,
    manifests: Sequence[RunManifest],
    footer: Sequence[str],
) -> list[Path]:
    """Draws and writes all figures.

    Args:
        output: Folder.
        rows: See `measure.collapse_rows`.
        levels: See `law.levels`.
        activations: See `law.activations`.
        manifests: The runs.
        footer: Origin, one statement each.

    Returns:
        The files written.
    """
    with figures.style():
        return [
            *_draw_heights(output / "height_time", rows, manifests, footer),
            *_draw_law(output / "time_acceleration", levels, activations, footer),
            *_draw_activations(output / "delta_aspect", activations, footer),
        ]


def _draw_heights(
    path: Path, rows: pd.DataFrame, manifests: Sequence[RunManifest], footer: Sequence[str]
) -> list[Path]:
    """Height against time, a panel for each aspect ratio, a line for each Γ."""
    aspects, gammas = sorted(rows[ASPECT].unique()), sorted(rows[GAMMA].unique())
    colours = dict(zip(gammas, figures.sequence(len(gammas), last=0.8), strict=True))
    columns = min(len(aspects), _MOST_COLUMNS)
    lines = math.ceil(len(aspects) / columns)
    figure = figures.blank_figure(2.2 * columns + 0.3, 2.1 * lines + 0.3)
    grid = np.atleast_1d(figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)).ravel()
    width = bin_width(list(rows[WATCHED]))
    for axes, aspect in zip(grid, aspects, strict=False):
        own = [run for run in manifests if round(run.aspect_ratio, 6) == aspect]
        for gamma, colour in colours.items():
            histories = _histories(own, gamma)
            if histories:
                draw_history(axes, histories, width, colour=colour, label=rf"$\Gamma$ = {gamma:g}")
        axes.axhline(1 / math.e, color=figures.GREY, linewidth=0.6, linestyle=(0, (4, 3)))
        axes.set_title(rf"$l/w$ = {aspect:g}", fontsize=7.5, pad=3)
        axes.set_ylim(0, 1.09)
    for axes in grid[len(aspects) :]:
        axes.set_visible(False)
    for axes in grid[max(len(aspects) - columns, 0) : len(aspects)]:
        axes.set_xlabel("time since the vibration began [s]", fontsize=7)
        axes.tick_params(labelbottom=True)
    for axes in grid[::columns]:
        axes.set_ylabel(r"height remaining $h/h_0$ [-]", fontsize=7)
    fullest = max(grid, key=lambda axes: len(axes.get_legend_handles_labels()[1]))
    fullest.legend(loc="upper right")
    told = (
        f"Line: mean over seeds of means over {width:.2g} s; {BAND}. Broken line: 1/e, which a stretched exponential "
        "to 0 crosses at τ whatever its exponent."
    )
    return finished(figure, path, [told], footer)


def _histories(runs: Sequence[RunManifest], gamma: float) -> list[History]:
    found = []
    for run in runs:
        shaken = vibration(run)
        if shaken.acceleration == gamma:
            history = column_history(run, REMAINING, shaken)
            found.append(History(times=history.times, values=history.heights, active=float(history.times[-1])))
    return found


def _draw_law(path: Path, levels: pd.DataFrame, activations: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    """ln(fτ) against 1/Γ, with the law's line for each aspect ratio that has a Δ."""
    figure, axes = figures.new_figure(height=2.9)
    own = levels[levels[DEFINITION] == REMAINING]
    aspects = sorted(own[ASPECT].unique())
    deltas = activations[activations[DEFINITION] == REMAINING].set_index(ASPECT)[ACTIVATION]
    places = np.linspace(-0.004, 0.004, len(aspects))
    looks = zip(figures.sequence(len(aspects), last=0.85), "osD^vP" * len(aspects), strict=False)
    end = 1.12 / own[GAMMA].min()
    for aspect, place, (colour, shape) in zip(aspects, places, looks, strict=True):
        part = own[own[ASPECT] == aspect]
        look = marker(shape, colour, colour) | {"linestyle": "none"}
        seen = part[part[CENSORED] == 0]
        draw_means(
            axes,
            1 / seen[GAMMA] + place,
            seen[LOG],
            seen[LOG_HALF_WIDTH],
            look=look,
            label=rf"$l/w$ = {aspect:g}",
        )
        _draw_open(axes, 1 / part[GAMMA] + place, part[LOG].where(part[CENSORED] > 0), look)
        if math.isfinite(deltas[aspect]):
            axes.plot([0, end], [0, deltas[aspect] * end], color=colour, linewidth=0.7)
    axes.set_xlim(0, end)
    axes.set_ylim(0, None)
    axes.set_xlabel(r"inverse peak acceleration $1/\Gamma$ [-]")
    axes.set_ylabel(r"collapse time $\ln(f\tau)$ [-]")
    axes.legend(loc="upper left")
    told = (
        "By the height `remaining`, set apart sideways by a little. Lines: τ = (1/f) exp(Δ/Γ) with the Δ of each l/w. "
        "Open, with an arrow: a run did not collapse, the mean is a bound."
    )
    return finished(figure, path, [told], footer)


def _draw_open(axes: Axes, x: pd.Series, least: pd.Series, look: Mapping[str, Any]) -> None:
    """Lower bounds: open markers with an arrow upwards."""
    draw_bounds(axes, x, least, 0.05 * least.abs() + 0.2, look={"markersize": 3.4, **look, "markerfacecolor": "white"})


def _draw_activations(path: Path, activations: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    """Δ against l/w by each definition, on Gravish's points."""
    figure, axes = figures.new_figure(height=2.9)
    reference = read_collapse_reference()
    axes.plot(
        reference["l_over_w"],
        reference["delta"],
        linestyle="none",
        marker="D",
        markersize=4,
        color=figures.BLACK,
        markerfacecolor="white",
        label=rf"Gravish et al., experiment, $\Gamma$ = {ACCELERATIONS[0]:g} to {ACCELERATIONS[1]:g}",
    )
    for name, label in _LABELS.items():
        part = activations[activations[DEFINITION] == name]
        look = _LOOKS[name] | ({} if name == REMAINING else {"linewidth": 0.5, "linestyle": (0, (2, 1.5))})
        x = part[ASPECT] + _SHIFTS[name]
        draw_means(axes, x, part[ACTIVATION], part[HALF_WIDTH], look=look, label=f"here, {label}")
        _draw_open(axes, x, part[AT_LEAST].where(part[ACTIVATION].isna()), look)
    axes.set_ylim(0, None)
    axes.set_xlabel(ASPECT_LABEL)
    axes.set_ylabel(r"activation $\Delta$ [-]")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=1)
    told = (
        "Set apart sideways by 0.012 in l/w. Open, with an arrow: no acceleration at which all runs collapsed, a bound."
    )
    return finished(figure, path, [told, told_points(sorted(activations[ASPECT].unique()))], footer)
