"""Figures of studies: means against a variable, rows of means, histories and scatter.

All error bars are 95 % intervals: `draw_means` draws them, `finish` names them once below the figure.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import pandas as pd
from matplotlib.container import ErrorbarContainer

from dem.errors import InputError
from dem.record.run import Run
from postprocess.report import figures as style
from postprocess.report.figures import hold_everything
from postprocess.statistics.points import marked
from studies.framework.procedures import EXTERNAL, INTERNAL, SHAPE, STATIC, of_procedure
from studies.framework.runs import ENGINE_NAMES, Quantity, engines_of, judging, of_engine

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas
    from numpy.typing import ArrayLike, NDArray

ASPECT_LABEL, THETA_LABEL = r"aspect ratio $l/w$ [-]", r"amplitude $\theta$ [degree]"
CROSSINGS_LABEL = r"links through a plane $\langle N\rangle$ [-]"
BARS = "Error bars: 95 % confidence of the mean over seeds, Student's t"
POOLED = f"{BARS}, scatter pooled over all points"

_CONFIDENCE = "_95 %"  # label of the lines of error bars; those that begin with _ stay out of legends
_COLOURS = {SHAPE: style.ORANGE, EXTERNAL: style.BLUE, INTERNAL: style.SKY, STATIC: style.GREY}
_SHAPES = {SHAPE: "s", EXTERNAL: "D", INTERNAL: "o", STATIC: "^"}
_ASIDE = 0.16  # of the rows' places, so that bars do not lie on each other
_LEAST_BIN, _BINS = 0.1, 100  # s: three periods of shaking at 30 Hz
_PAGE = 2 * style.COLUMN_WIDTH

Select = Callable[[pd.DataFrame], pd.DataFrame]


@dataclass(frozen=True, kw_only=True)
class Analysis:
    """What figures are drawn from."""

    tables: Mapping[str, pd.DataFrame] = field(repr=False)
    manifests: Mapping[str, Run] = field(repr=False)
    footer: Sequence[str]  #: Origin, one statement each

    def table(self, name: str) -> pd.DataFrame:
        """Select the rows of the engine that judges; empty where there is no such table."""
        return judging(self.tables.get(name, pd.DataFrame()))


@dataclass(frozen=True, kw_only=True)
class Series:
    """Rows that are drawn alike."""

    rows: pd.DataFrame = field(repr=False)  #: Points or runs, in the order of a line through them
    label: str
    look: Mapping[str, Any]  #: Marker and line, see `marker`
    shift: float = 0.0  #: Along x, to keep error bars apart


@dataclass(frozen=True, kw_only=True, eq=False)
class History:
    """A quantity of one run from the phase before its activity to the end."""

    times: NDArray[np.float64]  #: (n,) since the activity began [s]
    values: NDArray[np.float64]  #: (n,)
    active: float = 0.0  #: Time at which the activity ended [s]


Split = Callable[[pd.DataFrame], list[Series]]  #: Makes the series of a table of points or runs


class Figure(Protocol):
    """A figure of a study."""

    @property
    def name(self) -> str:
        """Name of its files, without suffix."""

    def draw(self, path: Path, analysis: Analysis) -> list[Path]:
        """Draw and write the figure; gives the files, none where there is nothing to draw."""


@dataclass(frozen=True, kw_only=True)
class Means:
    """Means with their error bars against a variable: a panel for each quantity and each value of a column."""

    name: str
    quantities: Sequence[Quantity]
    x: str
    x_label: str
    split: Split
    table: str = "points"
    rows: Select = lambda table: table
    panels: str = ""  #: Column with a column of panels for each value; empty: none
    panel: str = "l/w = {:g}"  #: Title of a panel, with `{}` for its value
    transform: Callable[[Any], Any] = lambda x: x  #: What is drawn of x
    log: bool = False
    log_x: bool = False
    marks: Sequence[float] = ()
    ticks: bool = False  #: Whether the x axis has ticks at the values of x alone
    share_y: bool = False
    #: Horizontal lines of a panel's rows, by label
    levels: Callable[[pd.DataFrame], Mapping[str, float]] = lambda _: {}
    #: Lower bounds for the quantities without a mean, by column
    bounds: Mapping[str, str] = field(default_factory=dict)
    #: Published values by the column that they are set against: places and values
    reference: Mapping[str, tuple[pd.Series, pd.Series]] = field(default_factory=dict)
    notes: Sequence[str] = ()
    bars: str = BARS

    def draw(self, path: Path, analysis: Analysis) -> list[Path]:
        """Draw the judging engine filled, other engines open beside it."""
        every = analysis.tables.get(self.table, pd.DataFrame())
        every = self.rows(every) if len(every) else every
        columns = [quantity.column for quantity in self.quantities]
        shown = (
            pd.concat([every.iloc[:0], *(series.rows for series in self.split(judging(every)))])
            if len(every)
            else every
        )
        if shown.empty or shown[[*columns, *self.bounds.values()]].isna().all().all():
            return []
        values = sorted(shown[self.panels].unique()) if self.panels else [None]
        shape = {"columns": len(values) if len(columns) > 1 and self.panels else 2 if len(values) < 3 else 4}
        figure, grid = panels(len(columns) * len(values), **shape, sharex=True, sharey="row" if self.share_y else False)
        for axes, (quantity, value) in zip(grid, product(self.quantities, values), strict=True):
            part = every if value is None else every[every[self.panels] == value]
            self._panel(axes, quantity, part)
            if value is not None and (quantity is self.quantities[0]):
                axes.set_title(self.panel.format(value), fontsize=8)
        return finish(figure, path, self.notes, analysis.footer, bars=self.bars)

    def _panel(self, axes: Axes, quantity: Quantity, table: pd.DataFrame) -> None:
        column, scale = quantity.column, quantity.scale
        for x in self.marks:
            axes.axvline(x, color=style.GREY, linewidth=0.6, linestyle=(0, (2, 2)))
        for (label, level), line in zip(self.levels(judging(table)).items(), ("solid", (0, (4, 3))), strict=False):
            axes.axhline(level, color=style.ORANGE, linewidth=0.9, linestyle=line, label=label)
        if column in self.reference:
            look = {**marker("o", style.ORANGE, style.ORANGE), "linestyle": "none"}
            draw_means(axes, *self.reference[column], None, look=look, label="experiment")
        positive = True
        for number, engine in enumerate(engines_of(table) or ("",)):
            label = f"simulation on {ENGINE_NAMES.get(engine, engine)}"
            for series in self.split(of_engine(table, engine) if engine else table):
                rows = series.rows[series.rows[column].notna()]
                x, look = self.transform(series.rows[self.x]) + series.shift * (1 + 2 * number), dict(series.look)
                if number:
                    look |= {"color": style.GREEN, "markerfacecolor": "white", "linestyle": "none"}
                if len(rows):
                    errors = scale * rows[marked(column, "95 %")].to_numpy()
                    across = rows.get(marked(self.x, "95 %"))
                    shown = label if number else series.label
                    draw_means(axes, x[rows.index], scale * rows[column], errors, across=across, look=look, label=shown)
                    positive &= bool((rows[column] > 0).all())
                    label = "_"
                if column in self.bounds:
                    least = scale * series.rows[self.bounds[column]].where(series.rows[column].isna())
                    draw_bounds(axes, x, least, 0.05 * least.abs() + 0.2, look={**look, "markerfacecolor": "white"})
        place = axes.get_subplotspec()
        # Panels of one quantity share the label of their row; those of several quantities have their own.
        if not (self.share_y and self.panels) or place is None or place.is_first_col():
            axes.set_ylabel(quantity.axis or column)
        axes.set_xlabel(self.x_label)
        if self.ticks:
            places = self.transform(np.unique(table[self.x].dropna()))
            axes.set_xticks(places, labels=[f"{place:g}" for place in places])
        axes.set_xscale("log" if self.log_x else "linear")
        if self.log and positive:
            axes.set_yscale("log")
        elif positive:
            axes.set_ylim(bottom=0)


@dataclass(frozen=True, kw_only=True)
class Rows:
    """Means with their error bars across, a row for each name and a panel for each quantity."""

    name: str
    quantities: Sequence[Quantity]
    row: str | Callable[[pd.Series], str]  #: Column with the names of the rows, or a function of a row of the table
    table: str = "points"
    split: Split = lambda table: [Series(rows=table, label="mean over seeds", look=marker("o", style.BLUE, style.BLUE))]
    rows: Select = lambda table: table  #: Selects what is drawn, in the order of the rows
    ends: Sequence[str] = ()  #: Columns of the ends of the intervals; empty: means with half-widths
    margin: str = ""  #: Column with the half-width of a band about 0
    levels: Mapping[str, float] = field(default_factory=dict)
    columns: int = 2
    notes: Sequence[str] = ()
    bars: str = BARS

    def draw(self, path: Path, analysis: Analysis) -> list[Path]:
        """Draw the series beside each other in every row."""
        table = analysis.table(self.table)
        table = self.rows(table) if len(table) else table
        if table.empty:
            return []
        own = table[self.row] if isinstance(self.row, str) else table.apply(self.row, axis=1)
        names = {name: place for place, name in enumerate(own.unique())}
        places = own.map(names)
        height = max(0.6 + 0.2 * len(names), 2.2)
        figure, grid = panels(len(self.quantities), columns=self.columns, height=height, width=_PAGE, sharey=True)
        for axes, quantity in zip(grid, self.quantities, strict=True):
            column, split = quantity.column, self.split(table)
            if self.margin:
                wide = table[self.margin]
                axes.barh(places, 2 * wide, left=-wide, height=0.62, color=style.SKY, alpha=0.3, linewidth=0)
            if column in self.levels:
                axes.axvline(self.levels[column], color=style.ORANGE, linewidth=0.9)
            for number, series in enumerate(split):
                rows = series.rows[series.rows[column].notna()]
                y = places[rows.index] + _ASIDE * (number - (len(split) - 1) / 2)
                across = rows.get(marked(column, "95 %"))
                if self.ends:
                    across = np.abs(rows[list(self.ends)].to_numpy().T - rows[column].to_numpy())
                look = {**series.look, "linestyle": "none"}
                draw_means(axes, rows[column], y, None, across=across, look=look, label=series.label)
            axes.set_xlabel(quantity.axis or column)
            axes.set_yticks(range(len(names)), list(names))
        grid[0].set_ylim(len(names) - 0.4, -0.6)
        return finish(figure, path, self.notes, analysis.footer, bars=self.bars)


@dataclass(frozen=True, kw_only=True)
class Histories:
    """Quantities of runs against time or another variable: means over seeds, lowest to highest seed as a band."""

    name: str
    quantities: Mapping[str, str]  #: Label of the y axis by column of the table `times`, or "" for what `history` reads
    x_label: str
    split: Split  #: Makes the series of the runs; its look has a colour
    #: Reads the history of a run; an InputError leaves the run out. None: the table `times`.
    history: Callable[[Run], History] | None = None
    x: str = ""  #: Column of the time in the table `times`
    rows: Select = lambda runs: runs
    panels: str = ""  #: Column with a panel for each value; empty: none
    panel: str = "l/w = {:g}"  #: Title of a panel, with `{}` for its value times `panel_scale`
    panel_scale: float = 1.0
    width: float = 0.0  #: Of the intervals that are averaged over; 0: a hundredth of the longest activity
    unit: str = "s"  #: Of that width
    log: bool = False  #: Whether x and its intervals are logarithmic
    level: float | None = None
    notes: Sequence[str] = ()

    def draw(self, path: Path, analysis: Analysis) -> list[Path]:
        """Draw a line and a band for each series that has histories."""
        runs = self.rows(analysis.table("runs"))
        if runs.empty or (self.history is None and "times" not in analysis.tables):
            return []
        values = sorted(runs[self.panels].unique()) if self.panels else [None]
        many = len(self.quantities) * len(values)
        figure, grid = panels(many, columns=3, sharey="row" if self.panels else False, sharex=bool(self.x))
        missing, width = 0, 0.0
        for axes, ((quantity, label), value) in zip(grid, product(self.quantities.items(), values), strict=True):
            drawn: list[tuple[Series, list[History]]] = []
            for series in self.split(runs):
                rows = series.rows if value is None else series.rows[series.rows[self.panels] == value]
                found = [self._read(analysis, str(run), quantity) for run in rows["run"]]
                missing += found.count(None)
                drawn.append((series, [one for one in found if one is not None]))
            ends = {one.active for _, histories in drawn for one in histories if one.active > 0}
            last = max([*ends, *(one.times[-1] for _, histories in drawn for one in histories if self.x)], default=0.0)
            width = self.width or max(last / _BINS, _LEAST_BIN)
            for series, histories in drawn:
                if histories:
                    colour = series.look["color"]
                    draw_history(axes, histories, width, log=self.log, color=colour, label=series.label)
            for time in sorted({0.0, *ends}) if ends else ():
                axes.axvline(time, color=style.GREY, linewidth=0.6, linestyle=(0, (4, 3)))
            if self.level is not None:
                axes.axhline(self.level, color=style.GREY, linewidth=0.6)
            axes.set_xlabel(self.x_label)
            axes.set_ylabel(label)
            axes.set_xscale("log" if self.log and any(histories for _, histories in drawn) else "linear")
            if value is not None:
                axes.set_title(self.panel.format(self.panel_scale * value), fontsize=8)
        means = "logarithmic intervals" if self.log else f"{width:.2g} {self.unit}"
        notes = [f"Line: mean over seeds of means over {means}; band: lowest to highest seed, no error.", *self.notes]
        if missing:
            notes.append(f"Without a recorded history: {missing} runs.")
        return finish(figure, path, notes, analysis.footer)

    def _read(self, analysis: Analysis, run: str, quantity: str) -> History | None:
        if self.history is None:
            times = analysis.tables["times"]
            own = times[times["run"] == run]
            return History(times=own[self.x].to_numpy(), values=own[quantity].to_numpy()) if len(own) else None
        try:
            return self.history(analysis.manifests[run])
        except (InputError, KeyError):
            return None


@dataclass(frozen=True, kw_only=True)
class Scatter:
    """A quantity against others, a panel each: every run as a small marker, means over seeds as large ones."""

    name: str
    xs: Sequence[Quantity]
    y: Quantity
    split: Split  #: Makes the series of runs and of points; its look has a marker and a colour
    bounds: str  #: Column that is above 0 where y is a lower bound, drawn as an arrow
    means: bool = True

    def draw(self, path: Path, analysis: Analysis) -> list[Path]:
        """Draw runs, then means with the error bars of both quantities."""
        figure, grid = panels(len(self.xs), columns=3, sharey=True)
        runs, y = analysis.table("runs"), self.y.column
        length = 0.08 * float(runs[y].max())
        for axes, quantity in zip(grid, self.xs, strict=True):
            x = quantity.column
            for series in self.split(runs):
                rows, colour = series.rows, series.look["color"]
                small = {"color": colour, "alpha": 0.55}
                label = "_" if self.means else series.label
                axes.plot(rows[x], rows[y], series.look["marker"], markersize=1.8, **small, label=label)
                held = rows[rows[self.bounds] > 0]
                draw_bounds(axes, held[x], held[y], length, look={**small, "elinewidth": 0.6, "capsize": 1.6})
            for series in self.split(analysis.table("points")) if self.means else ():
                look = {"markersize": 4.2, **series.look, "linestyle": "none"}
                errors, across = (series.rows[marked(name, "95 %")] for name in (y, x))
                draw_means(axes, series.rows[x], series.rows[y], errors, across=across, look=look, label=series.label)
            axes.set_xlabel(quantity.axis or x)
            axes.set_ylabel(self.y.axis or y)
            axes.set_ylim(bottom=0)
        note = "Small: runs, with an arrow: a lower bound; large: means over seeds."
        return finish(figure, path, [note], analysis.footer)


def one_by_one(column: str, label: Callable[[Any], str], *, last: float = 0.85) -> Split:
    """Make a series of each value of a column, in colours from light to dark."""

    def split(table: pd.DataFrame) -> list[Series]:
        values = sorted(table[column].dropna().unique())
        shapes = np.resize(list("oD^sv<>p"), len(values))
        return [
            Series(rows=table[table[column] == value], label=label(value), look=marker(str(shape), colour, colour))
            for value, shape, colour in zip(values, shapes, style.sequence(len(values), last=last), strict=True)
        ]

    return split


PROCEDURE_LABELS: Mapping[str, str] = MappingProxyType(
    {
        STATIC: "static",
        EXTERNAL: "external oscillation",
        INTERNAL: r"internal oscillation, $\theta$ = 10°",
        SHAPE: "shape change",
    }
)


def by_procedure(labels: Mapping[str, str] = PROCEDURE_LABELS, *, apart: float = 0.0, line: bool = True) -> Split:
    """Make a series of each procedure, the internal oscillation at the amplitude that procedures are compared at.

    Labels are in the order of the legend; `apart` is the distance of neighbouring series along x.
    """

    def split(table: pd.DataFrame) -> list[Series]:
        plain = {} if line else {"linestyle": "none"}
        return [
            Series(
                rows=of_procedure(table, name),
                label=label,
                look={**procedure_marker(name), **plain},
                shift=apart * (number - (len(labels) - 1) / 2),
            )
            for number, (name, label) in enumerate(labels.items())
        ]

    return split


def marker(shape: str, colour: str, face: str) -> dict[str, Any]:
    """Make a marker with an error bar of its colour."""
    edges = {"markeredgewidth": 0.9, "elinewidth": 0.8, "capthick": 0.8}
    return {"marker": shape, "color": colour, "markerfacecolor": face, **edges}


def procedure_marker(procedure: str) -> dict[str, Any]:
    """Make the marker of a procedure; that of the static state, which is none, is open."""
    colour = _COLOURS[procedure]
    return marker(_SHAPES[procedure], colour, "white" if procedure == STATIC else colour)


def panels(
    count: int, *, columns: int, width: float | None = None, height: float | None = None, **shared: Any
) -> tuple[Canvas, list[Axes]]:
    """Make a figure with a number of panels, line by line [inch]."""
    columns = min(count, columns)
    lines = -(-count // columns)
    size = width or min(columns * style.COLUMN_WIDTH, _PAGE), height or 2.8
    figure = style.blank_figure(size[0], size[1] if lines == 1 else (height or 2.2) * lines)
    grid = figure.subplots(lines, columns, squeeze=False, **shared)
    for axes in grid.flat[count:]:
        axes.set_visible(False)
    return figure, list(grid.flat[:count])


def binned(
    histories: Sequence[History], width: float, *, log: bool = False
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Average over equal intervals of time: centres (n,) [s] and values (seeds, n).

    No interval reaches across the beginning of the activity; those without a sample of a seed are left out.
    """
    first, last = (edge(one.times[at] for one in histories) for edge, at in ((min, 0), (max, -1)))
    if log:
        edges = np.geomspace(max(first, 0.1), last * (1 + 1e-9), _BINS // 2)
        centres = np.sqrt(edges[:-1] * edges[1:])
    else:
        start = math.floor(first / width)
        edges = width * np.arange(start, max(math.ceil(last / width), start + 1) + 1)
        centres = (edges[:-1] + edges[1:]) / 2
        edges[-1] = np.inf  # a sample at the very end belongs to the last interval
    means = np.array(
        [
            pd.Series(one.values).groupby(np.searchsorted(edges, one.times + 1e-12, side="right") - 1).mean()
            .reindex(range(len(centres))).to_numpy()
            for one in histories
        ]
    )  # fmt: skip
    whole = np.isfinite(means).all(axis=0)
    return centres[whole], means[:, whole]


def draw_history(axes: Axes, histories: Sequence[History], width: float, *, log: bool = False, **look: Any) -> None:
    """Draw the mean over seeds as a line, from the lowest to the highest seed as a band."""
    centres, means = binned(histories, width, log=log)
    axes.plot(centres, means.mean(axis=0), **look)
    if len(means) > 1:
        axes.fill_between(centres, means.min(axis=0), means.max(axis=0), color=look["color"], alpha=0.25, linewidth=0)


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
    """Draw means (n,) with their error bars, the half-widths (n,) of the 95 % intervals of y, NaN where there is none.

    Without half-widths y are no means; `across` are half-widths of x, (n,) or, below and above, (2, n).
    """
    bars = axes.errorbar(
        x, y, yerr=half_widths, xerr=across, **{"markersize": 3.4, "linewidth": 0.7, **look}, label=label
    )
    if any(part is not None and np.isfinite(np.asarray(part, float)).any() for part in (half_widths, across)):
        for lines in bars.lines[2]:
            lines.set_label(_CONFIDENCE)


def draw_bounds(axes: Axes, x: ArrayLike, least: ArrayLike, lengths: ArrayLike, *, look: Mapping[str, Any]) -> None:
    """Draw lower bounds: markers with an arrow upwards of some length, which is no error; NaN are left out."""
    at, from_, long = np.broadcast_arrays(*(np.asarray(part, dtype=np.float64) for part in (x, least, lengths)))
    known = np.isfinite(from_)
    if known.any():
        look = {"markersize": 3.4, **look, "linestyle": "none"}
        axes.errorbar(at[known], from_[known], yerr=long[known], lolims=True, **look)


def finish(figure: Canvas, path: Path, notes: Sequence[str], footer: Sequence[str], *, bars: str = BARS) -> list[Path]:
    """Put legend and footer to a figure, and write it; no limit of an axis hides anything.

    The path has no suffix; `bars` says what error bars are, where there are any.
    """
    fullest = max(figure.axes, key=lambda axes: len(axes.get_legend_handles_labels()[1]))
    handles, labels = fullest.get_legend_handles_labels()
    if len(labels) > 1:
        columns = 2 if figure.get_size_inches()[0] < 1.5 * style.COLUMN_WIDTH else 4
        figure.legend(handles, labels, loc="outside upper center", ncols=columns)
    hidden = hold_everything(figure)
    there = any(
        lines.get_label() == _CONFIDENCE
        for axes in figure.axes
        for container in axes.containers
        if isinstance(container, ErrorbarContainer)
        for lines in container.lines[2]
    )
    style.add_footer(figure, [*notes, *([f"{bars}."] if there else []), *hidden, *footer])
    return style.save(figure, path)
