"""What the figures of studies share: means with their error bars, and histories averaged over seeds.

Error bars are of one kind in all of them, 95 % confidence of a mean over seeds: `draw_means` draws them, `finished`
says so in one sentence. Where a band is something else, such as the range of the seeds, the figure has no error bars.
`draw_combinations` is a whole figure, that of factorial studies.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.container import ErrorbarContainer

from postprocess.report import figures
from postprocess.report.figures import hold_everything
from postprocess.statistics.points import ASPECT, marked
from studies.framework.procedures import EXTERNAL, INTERNAL, SHAPE, STATIC
from studies.framework.runs import BARS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike, NDArray

ASPECT_LABEL, THETA_LABEL = r"aspect ratio $l/w$ [-]", r"amplitude $\theta$ [degree]"
CROSSINGS_LABEL = r"links through a plane $\langle N\rangle$ [-]"

_CONFIDENCE = "_95 %"  # label of the lines of error bars; those that begin with _ stay out of legends

COLOURS: Mapping[str, str] = MappingProxyType(
    {SHAPE: figures.ORANGE, EXTERNAL: figures.BLUE, INTERNAL: figures.SKY, STATIC: figures.GREY}
)
"""Colour of each procedure, the same in all studies."""

SHAPES: Mapping[str, str] = MappingProxyType({SHAPE: "s", EXTERNAL: "D", INTERNAL: "o", STATIC: "^"})
"""Marker of each procedure, the same in all studies."""

BAND = "band: lowest to highest seed, no error"
"""What the bands of histories are, for footers."""

_MARKERS_OF_ASPECTS = (("o", figures.BLUE, figures.BLUE), ("s", figures.ORANGE, "white"), ("^", figures.GREY, "white"))
_ASIDE = 0.16  # of the rows' places, so that bars do not lie on each other

_LEAST_BIN = 0.1  # s: three periods of shaking at 30 Hz
_BINS = 100


@dataclass(frozen=True, kw_only=True, eq=False)
class History:
    """A quantity of one run from the phase before its activity to the end.

    Attributes:
        times: (n,) since the activity began [s].
        values: (n,).
        active: Time at which the activity ended [s].
    """

    times: NDArray[np.float64]
    values: NDArray[np.float64]
    active: float


def bin_width(ends: Sequence[float]) -> float:
    """Width of the intervals over which histories are averaged [s].

    Args:
        ends: Times at which activities ended [s].
    """
    return max(max(ends, default=0.0) / _BINS, _LEAST_BIN)


def binned(histories: Sequence[History], width: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Means over equal intervals of time: centres (n,) [s] and values (seeds, n).

    No interval reaches across the beginning of the activity; those that lack a sample of any seed are
    left out.
    """
    first = math.floor(min(history.times[0] for history in histories) / width)
    last = math.ceil(max(history.times[-1] for history in histories) / width)
    count = max(last - first, 1)
    rows = []
    for history in histories:
        # A sample at the very end belongs to the last interval.
        place = np.clip(np.floor(history.times / width).astype(int) - first, 0, count - 1)
        samples = np.bincount(place, minlength=count)
        sums = np.bincount(place, history.values, count)
        rows.append(np.where(samples > 0, sums / np.maximum(samples, 1), np.nan))
    means = np.array(rows)
    whole = np.isfinite(means).all(axis=0)
    return (first + np.arange(count) + 0.5)[whole] * width, means[:, whole]


def draw_history(
    axes: Axes,
    histories: Sequence[History],
    width: float,
    *,
    colour: str,
    label: str | None = None,
    style: Any = "solid",
) -> None:
    """The mean over seeds as a line of some style, from the lowest to the highest seed as a band."""
    centres, means = binned(histories, width)
    axes.plot(centres, means.mean(axis=0), color=colour, label=label, linestyle=style)
    if len(means) > 1:
        axes.fill_between(centres, means.min(axis=0), means.max(axis=0), color=colour, alpha=0.25, linewidth=0)


def draw_ends(axes: Axes, ends: Sequence[float]) -> None:
    """Broken lines where activities begin and end [s]."""
    for time in sorted({0.0, *ends}):
        axes.axvline(time, color=figures.GREY, linewidth=0.6, linestyle=(0, (4, 3)))


def draw_means(
    axes: Axes,
    x: ArrayLike,
    y: ArrayLike,
    half_widths: ArrayLike | None,
    *,
    look: Mapping[str, Any],
    label: str,
    across: ArrayLike | None = None,
) -> None:
    """Means over seeds with their error bars; a mean over one seed has none.

    Args:
        axes: To draw in.
        x: (n,) places, or means.
        y: (n,) means, or places.
        half_widths: (n,) of the 95 % intervals of `y`, NaN where there is none; None: `y` are no means.
        look: Marker and line, see `marker`.
        label: For the legend.
        across: (n,) the same of `x`.
    """
    styled = {"markersize": 3.4, "linewidth": 0.7, **look}
    bars = axes.errorbar(x, y, yerr=half_widths, xerr=across, **styled, label=label)
    known = [np.isfinite(np.asarray(part, dtype=np.float64)) for part in (half_widths, across) if part is not None]
    if any(part.any() for part in known):
        for lines in bars.lines[2]:
            lines.set_label(_CONFIDENCE)


def draw_against(axes: Axes, means: pd.DataFrame, x: str, y: str, *, look: Mapping[str, Any], label: str) -> None:
    """Means of one quantity against those of another, with the 95 % of both.

    Args:
        axes: To draw in.
        means: Rows with both quantities and what `postprocess.statistics.points.marked` calls their 95 %.
        x: Quantity across.
        y: Quantity upwards.
        look: Marker, see `marker`.
        label: For the legend.
    """
    errors = {"half_widths": means[marked(y, "95 %")], "across": means[marked(x, "95 %")]}
    draw_means(axes, means[x], means[y], look={**look, "linestyle": "none"}, label=label, **errors)


def draw_runs(
    axes: Axes, runs: pd.DataFrame, x: str, y: str, *, bounds: str, length: float, shape: str, colour: str
) -> None:
    """Every run as a small marker, with an arrow upwards where its y is a lower bound.

    Args:
        axes: To draw in.
        runs: One row each.
        x: Quantity across.
        y: Quantity upwards.
        bounds: Column that is above 0 where y is a lower bound.
        length: Of the arrows, in the unit of y.
        shape: Of the markers.
        colour: Of both.
    """
    axes.plot(runs[x], runs[y], shape, color=colour, markersize=1.8, alpha=0.55)
    held = runs[runs[bounds] > 0]
    draw_bounds(
        axes, held[x], held[y], length, look={"color": colour, "elinewidth": 0.6, "alpha": 0.55, "capsize": 1.6}
    )


def draw_bounds(axes: Axes, x: ArrayLike, least: ArrayLike, lengths: ArrayLike, *, look: Mapping[str, Any]) -> None:
    """Lower bounds: markers with an arrow upwards of some length, which is no error; NaN are left out."""
    at, from_, long = np.broadcast_arrays(*(np.asarray(part, dtype=np.float64) for part in (x, least, lengths)))
    known = np.isfinite(from_)
    if known.any():
        axes.errorbar(at[known], from_[known], yerr=long[known], lolims=True, **{**look, "linestyle": "none"})


def marker(shape: str, colour: str, face: str) -> dict[str, Any]:
    """A marker with an error bar of its colour."""
    return {
        "marker": shape,
        "color": colour,
        "markerfacecolor": face,
        "markeredgewidth": 0.9,
        "elinewidth": 0.8,
        "capthick": 0.8,
    }


def procedure_marker(procedure: str) -> dict[str, Any]:
    """The marker of a procedure; that of the static state, which is none, is open."""
    colour = COLOURS[procedure]
    return marker(SHAPES[procedure], colour, "white" if procedure == STATIC else colour)


def legend_above(axes: Axes) -> None:
    """Puts the legend above the axes, where there is one."""
    if axes.get_legend_handles_labels()[1]:
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)


def finished(
    figure: Figure, path: Path, told: Sequence[str], footer: Sequence[str], *, pooled: bool = False
) -> list[Path]:
    """Puts what is to be known below a figure and writes it; no limit of an axis hides anything.

    Args:
        figure: Drawn completely.
        path: Without suffix.
        told: What is to be known of this figure.
        footer: Origin, see `Origin.below_figures`.
        pooled: Whether the scatter behind error bars is that of all points together.

    Returns:
        The files.
    """
    hidden = hold_everything(figure)
    bars = [f"{BARS}, scatter pooled over all points." if pooled else f"{BARS}."] if _has_bars(figure) else []
    figures.add_footer(figure, [*told, *bars, *hidden, *footer])
    return figures.save(figure, path)


def _has_bars(figure: Figure) -> bool:
    return any(
        lines.get_label() == _CONFIDENCE
        for axes in figure.axes
        for bars in axes.containers
        if isinstance(bars, ErrorbarContainer)
        for lines in bars.lines[2]
    )


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
                places = [order.index(one) + _ASIDE * (number - 0.5) for one in group["_order"]]
                look = {**marker(*_MARKERS_OF_ASPECTS[number % len(_MARKERS_OF_ASPECTS)]), "linestyle": "none"}
                bars = group[marked(quantity, "95 %")]
                draw_means(axes, group[quantity], places, None, look=look, label=f"l/w = {aspect:g}", across=bars)
            axes.set_xlabel(label)
        first = figure.axes[0]
        first.set_yticks(range(len(order)), [named(row) for _, row in first_of.iterrows()])
        first.invert_yaxis()
        legend_above(first)
        figure.tight_layout()
        return finished(figure, path, list(told), footer)
