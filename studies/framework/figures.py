"""Figures of studies: means against a variable, rows of means, heat maps, histories and scatter plots.

All error bars are 95 % intervals: `draw_means` draws them, `finish` explains them once in the figure's footer.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure as Canvas
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import ArrayLike, NDArray

from dem.errors import InputError
from dem.record.run import Run
from postprocess.report import figures as style
from postprocess.statistics.points import marked
from studies.framework.procedures import EXTERNAL, INTERNAL, PROCEDURE, SHAPE, STATIC, of_procedure
from studies.framework.runs import ENGINE_NAMES, Quantity, engines_of, judging, of_engine

ASPECT_LABEL, THETA_LABEL = r"aspect ratio $l/w$ [-]", r"amplitude $\theta$ [degree]"
CROSSINGS_LABEL = r"links through a plane $\langle N\rangle$ [-]"
BARS = "Error bars: 95 % confidence of the mean over seeds, Student's t"
POOLED = f"{BARS}, scatter pooled over all points"

_CONFIDENCE = "_95 %"  # label of the lines of error bars; Matplotlib keeps labels that begin with _ out of legends
_COLOURS = {SHAPE: style.ORANGE, EXTERNAL: style.BLUE, INTERNAL: style.SKY, STATIC: style.GREY}
_SHAPES = {SHAPE: "s", EXTERNAL: "D", INTERNAL: "o", STATIC: "^"}
_ASIDE = 0.16  # distance of the series in a row, over the distance of two rows: error bars must not overlap
_SHORT = 100  # ratio of the ends of a logarithmic axis below which 1, 2 and 5 times powers of ten have labels
_LEAST_BIN = 0.1  # s, three periods of shaking at 30 Hz
_BINS = 100  # intervals of a history
_CELL = math.sqrt(2)  # factor in x from the outermost points of a heat map to the edges of their cells
_PAGE = 2 * style.COLUMN_WIDTH  # inch

Select = Callable[[pd.DataFrame], pd.DataFrame]  #: Selects the rows of a table that are drawn


@dataclass(frozen=True, kw_only=True)
class Analysis:
    """Tables and runs that the figures of a study are drawn from."""

    tables: Mapping[str, pd.DataFrame] = field(repr=False)  #: Tables by name
    runs: Mapping[str, Run] = field(repr=False)  #: Measured runs by the name of their directory
    footer: Sequence[str]  #: Statements about the origin of the results

    def table(self, name: str) -> pd.DataFrame:
        """Return the rows of a table that are from the judging engine, whose runs decide the findings.

        The result is empty if the study has no table of this name.
        """
        return judging(self.tables.get(name, pd.DataFrame()))


@dataclass(frozen=True, kw_only=True)
class Series:
    """Rows of a table that are drawn with one marker and one entry in the legend."""

    rows: pd.DataFrame = field(repr=False)  #: Points or runs, in the order of the line through them
    label: str  #: Text in the legend
    properties: Mapping[str, Any]  #: Properties of marker and line by Matplotlib's names, see `marker`
    shift: float = 0.0  #: Added to x, so that error bars of neighbouring series do not overlap


@dataclass(frozen=True, kw_only=True, eq=False)
class History:
    """Values of a quantity of one run over time, from the phase before its activity to the end."""

    times: NDArray[np.float64]  #: (n,) times since the activity began [s], or another increasing variable
    values: NDArray[np.float64]  #: (n,) values in the unit of the quantity
    active: float = 0.0  #: Duration of the activity, whose ends are marked [s]; 0: no marks


Split = Callable[[pd.DataFrame], list[Series]]  #: Makes the series of a table of points or runs


@dataclass(frozen=True)
class SplitBy:
    """Splits a table of points or runs into series by the values of one column."""

    column: str  #: Column whose values make series; `Study` checks that it is a key
    series: Split

    def __call__(self, table: pd.DataFrame) -> list[Series]:
        """Return the series of a table."""
        return self.series(table)


Fit = Callable[
    [Mapping[str, pd.DataFrame], pd.DataFrame, str, NDArray[np.float64]], Mapping[str, tuple[ArrayLike, ArrayLike]]
]
"""Computes the curves fitted to a series.

Arguments: the study's tables, the rows of the series, the column that is drawn, and places x (n,). Returns values (n,)
and their 95 % half-widths (n,), NaN where unknown, by the label of each curve."""


class Figure(Protocol):
    """A figure of a study."""

    @property
    def name(self) -> str:
        """Name of the figure's files without suffix."""

    def draw(self, path: Path, analysis: Analysis) -> list[Path]:
        """Draw the figure and return the paths of its files; none if there is nothing to draw."""


@dataclass(frozen=True, kw_only=True)
class Means:
    """Means with error bars against a variable: a panel for each quantity and each value of a column."""

    name: str  #: Name of the files without suffix
    quantities: Sequence[Quantity]  #: Drawn along y, in a panel each
    x: str  #: Column that is drawn along x
    x_label: str
    split: Split  #: Makes the series of each panel
    table: str = "points"  #: Name of the study's table that is drawn
    rows: Select = lambda table: table
    panels: str = ""  #: Column whose values have a panel each; empty: one panel for each quantity
    panel: str = "l/w = {:g}"  #: Title of a panel, with `{}` for the value of the column `panels`
    transform: Callable[[Any], Any] = lambda x: x  #: Computes the place along x from the value in the column
    log: bool = False  #: Whether y is logarithmic; it stays linear if a value is 0 or less
    log_x: bool = False  #: Whether x is logarithmic
    marks: Sequence[float] = ()  #: Places of vertical broken lines, in the unit of the x axis
    share_y: bool = False  #: Whether all panels of one quantity, or of one line of panels, have one y axis
    #: Computes the horizontal lines of a panel from its rows: y by label; a line at NaN is left out
    levels: Callable[[pd.DataFrame], Mapping[str, float]] = lambda _: {}
    #: Columns with lower bounds, by column of the quantity; a bound is drawn where the mean is unknown
    bounds: Mapping[str, str] = field(default_factory=dict)
    #: Published values: places along x and values, by the column of the quantity
    reference: Mapping[str, tuple[pd.Series, pd.Series]] = field(default_factory=dict)
    published: str = "experiment"  #: Text in the legend for the published values
    fit: Fit | None = None  #: Computes curves from x = 0 to the last point of each series
    #: Returns the crosses of a panel from the study's tables and the panel's value: columns `x`, `y`, and `low` and
    #: `high`, the 95 % interval of x
    crosses: Callable[[Mapping[str, pd.DataFrame], Any], pd.DataFrame] | None = None
    notes: Sequence[str] = ()  #: Sentences for the footer
    bars: str = BARS  #: Explains the error bars in the footer

    def draw(self, path: Path, analysis: Analysis) -> list[Path]:
        """Draw the means of the judging engine with filled markers, and those of other engines with open ones.

        The judging engine is the one whose runs decide the findings. Open markers are beside the filled ones. Returns
        the files; none if there is nothing to draw.
        """
        every = analysis.tables.get(self.table, pd.DataFrame())
        every = self.rows(every) if len(every) else every
        columns = [quantity.column for quantity in self.quantities]
        drawn = self.split(judging(every)) if len(every) else []
        shown = pd.concat([every.iloc[:0], *(series.rows for series in drawn)])
        if shown.empty or shown[[*columns, *self.bounds.values()]].isna().all().all():
            return []
        values = sorted(shown[self.panels].unique()) if self.panels else [None]
        shape = {"columns": len(values) if len(columns) > 1 and self.panels else 2 if len(values) < 3 else 4}
        figure, grid = panels(len(columns) * len(values), **shape, sharex=True, sharey="row" if self.share_y else False)
        for axes, (quantity, value) in zip(grid, product(self.quantities, values), strict=True):
            part = every if value is None else every[every[self.panels] == value]
            self._panel(axes, quantity, part, analysis.tables)
            for cross in () if self.crosses is None else self.crosses(analysis.tables, value).itertuples():
                axes.plot([cross.low, cross.high], [cross.y] * 2, color=style.BLACK, linewidth=0.8, zorder=4)
                axes.plot(cross.x, cross.y, "x", color=style.BLACK, markersize=4.5, zorder=5)
            if value is not None and (quantity is self.quantities[0]):
                axes.set_title(self.panel.format(value), fontsize=8)
        return finish(figure, path, self.notes, analysis.footer, bars=self.bars)

    def _panel(self, axes: Axes, quantity: Quantity, table: pd.DataFrame, tables: Mapping[str, pd.DataFrame]) -> None:
        column, scale = quantity.column, quantity.scale
        for x in self.marks:
            axes.axvline(x, color=style.GREY, linewidth=0.6, linestyle=(0, (2, 2)))
        for (label, level), line in zip(self.levels(judging(table)).items(), ("solid", (0, (4, 3))), strict=False):
            if math.isfinite(level):
                axes.axhline(level, color=style.ORANGE, linewidth=0.9, linestyle=line, label=label)
        if column in self.reference:
            properties = {**marker("o", style.ORANGE, style.ORANGE), "linestyle": "none"}
            draw_means(axes, *self.reference[column], None, properties=properties, label=self.published)
        positive = True
        for number, engine in enumerate(engines_of(table) or ("",)):
            label = f"simulation on {ENGINE_NAMES.get(engine, engine)}"
            for series in self.split(of_engine(table, engine) if engine else table):
                rows = series.rows[series.rows[column].notna()]
                x = self.transform(series.rows[self.x]) + series.shift * (1 + 2 * number)
                properties = dict(series.properties)
                if number:
                    properties |= {"color": style.GREEN, "markerfacecolor": "white", "linestyle": "none"}
                if len(rows) and self.fit is not None and not number:
                    places = np.linspace(0, 1.05 * float(x.max()), 60)
                    draw_fits(axes, places, self.fit(tables, rows, column, places), properties["color"])
                    properties["linestyle"] = "none"
                if len(rows):
                    errors = scale * rows[marked(column, "95 %")].to_numpy()
                    shown = {"label": label if number else series.label, "across": rows.get(marked(self.x, "95 %"))}
                    draw_means(axes, x[rows.index], scale * rows[column], errors, properties=properties, **shown)
                    positive &= bool((rows[column] > 0).all())
                    label = "_"
                if column in self.bounds:
                    least = scale * series.rows[self.bounds[column]].where(series.rows[column].isna())
                    draw_bounds(
                        axes, x, least, 0.05 * least.abs() + 0.2, properties={**properties, "markerfacecolor": "white"}
                    )
        self._label(axes, quantity)
        self._scale(axes, self.transform(table[self.x]).dropna().unique())
        if self.log and positive:
            axes.set_yscale("log")
        elif positive:
            axes.set_ylim(bottom=0)

    def _scale(self, axes: Axes, places: ArrayLike) -> None:
        axes.set_xscale("log" if self.log_x else "linear")
        if np.size(places) == 1:
            # Series are shifted from it, and ticks between would look like values.
            axes.set_xticks(np.atleast_1d(places))

    def _label(self, axes: Axes, quantity: Quantity) -> None:
        place = axes.get_subplotspec()
        # A line of panels of one quantity has one label; panels of several quantities have a label each.
        if not (self.share_y and self.panels) or place is None or place.is_first_col():
            axes.set_ylabel(quantity.axis or quantity.column)
        axes.set_xlabel(self.x_label)


@dataclass(frozen=True, kw_only=True)
class Rows:
    """Means with horizontal error bars: a line for each name, and a panel for each quantity."""

    name: str  #: Name of the files without suffix
    quantities: Sequence[Quantity]  #: Drawn along x, in a panel each
    row: str | Callable[[pd.Series], str]  #: Column with the names of lines, or function of a table's row
    table: str = "points"  #: Name of the study's table that is drawn
    split: Split = lambda table: [
        Series(rows=table, label="mean over seeds", properties=marker("o", style.BLUE, style.BLUE))
    ]
    rows: Select = lambda table: table  #: Selects the rows that are drawn, in the order of the lines
    ends: Sequence[str] = ()  #: Columns with both ends of the 95 % interval; empty: the half-widths in the table
    margin: str = ""  #: Column with the half-width of a band about 0; empty: no band
    levels: Mapping[str, float] = field(default_factory=dict)  #: Place of a vertical line by the quantity's column
    columns: int = 2  #: Panels beside each other
    notes: Sequence[str] = ()  #: Sentences for the footer
    bars: str = BARS  #: Explains the error bars in the footer

    def draw(self, path: Path, analysis: Analysis) -> list[Path]:
        """Draw the means of all series, slightly apart within each line."""
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
                properties = {**series.properties, "linestyle": "none"}
                draw_means(axes, rows[column], y, None, across=across, properties=properties, label=series.label)
            axes.set_xlabel(quantity.axis or column)
            axes.set_yticks(range(len(names)), list(names))
        grid[0].set_ylim(len(names) - 0.4, -0.6)
        return finish(figure, path, self.notes, analysis.footer, bars=self.bars)


@dataclass(frozen=True, kw_only=True)
class Heatmap:
    """Means as colours over two variables: a panel for each quantity and each value of a column.

    Points at x = 0, which a logarithmic axis cannot show, are drawn left of a broken line in all panels.
    """

    name: str  #: Name of the files without suffix
    quantities: Sequence[Quantity]
    x: Quantity  #: Drawn along x, on a logarithmic axis
    y: Quantity
    panels: str  #: Column whose values have a panel each
    panel: str  #: Title of a panel, with `{}` for its value
    notes: Sequence[str] = ()  #: Sentences for the footer

    def draw(self, path: Path, analysis: Analysis) -> list[Path]:
        """Draw a cell for each point; neighbouring cells meet midway, along x at the geometric mean."""
        points, x, y = analysis.table("points"), self.x.column, self.y.column
        table, zero = points[(points[x] > 0) & points[self.panels].notna()], points[points[x] == 0]
        if table.empty:
            return []
        values, half = sorted(table[self.panels].unique()), np.diff(np.unique(table[y])).min(initial=0.1) / 2
        left = table[x].min() / _CELL
        size: dict[str, Any] = {"columns": len(values), "height": 1.45, "width": _PAGE, "sharex": True, "sharey": True}
        figure, grid = panels(len(self.quantities) * len(values), **size)
        for number, (axes, (quantity, value)) in enumerate(zip(grid, product(self.quantities, values), strict=True)):
            means = pd.concat([table, zero])[quantity.column]
            colours: dict[str, Any] = {"cmap": "viridis", "norm": Normalize(means.min(), means.max())}
            for place, row in table[table[self.panels] == value].sort_values(x).groupby(y):
                xs = row[x].to_numpy()
                edges = [xs[0] / _CELL, *np.sqrt(xs[:-1] * xs[1:]), xs[-1] * _CELL]
                axes.pcolormesh(edges, [place - half, place + half], [row[quantity.column]], **colours)
                for mean in zero.loc[zero[y] == place, quantity.column]:
                    axes.pcolormesh([left / 4, left / 2], [place - half, place + half], [[mean]], **colours)
            axes.axvline(left / 1.4, color=style.GREY, linewidth=0.6, linestyle=(0, (4, 3)))
            axes.set_xscale("log")
            axes.grid(visible=False)
            if number < len(values):
                axes.set_title(self.panel.format(value), fontsize=8)
            if number % len(values) == 0:
                axes.set_ylabel(self.y.axis)
                line = grid[number : number + len(values)]
                figure.colorbar(ScalarMappable(**colours), ax=line, pad=0.01, aspect=12, label=quantity.axis)
        grid[-len(values) // 2].set_xlabel(self.x.axis)
        return finish(figure, path, self.notes, analysis.footer)


@dataclass(frozen=True, kw_only=True)
class Histories:
    """Quantities against time or another variable: means over seeds, with a band of all seeds."""

    name: str  #: Name of the files without suffix
    #: Label of the y axis by column of the table `times`; the key is "" if `history` reads the values
    quantities: Mapping[str, str]
    x_label: str
    split: Split  #: Makes the series of the runs, each with a colour in its properties
    #: Reads the history of a run; if it raises InputError, the run is left out. None: the table `times` is drawn
    history: Callable[[Run], History] | None = None
    x: str = ""  #: Column of the table `times` that is drawn along x
    rows: Select = lambda runs: runs
    panels: str = ""  #: Column whose values have a panel each; empty: one panel
    panel: str = "l/w = {:g}"  #: Title of a panel, with `{}` for its value times `panel_scale`
    panel_scale: float = 1.0
    width: float = 0.0  #: Width of averaged intervals of x; 0: 1 % of the longest activity, or of the range of x
    unit: str = "s"  #: Unit of `width`
    log: bool = False  #: Whether x and the intervals are logarithmic
    level: float | None = None  #: Place of a horizontal line
    marks: Sequence[float] = ()  #: Places of vertical broken lines, in the unit of the x axis
    fit: Fit | None = None  #: Computes curves over the times of each series
    notes: Sequence[str] = ()  #: Sentences for the footer

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
                    colour = series.properties["color"]
                    times = draw_history(axes, histories, width, log=self.log, color=colour, label=series.label)
                    if self.fit is not None:
                        fits = self.fit(analysis.tables, series.rows, quantity, times)
                        draw_fits(axes, times, fits, style.BLACK, lines=((0, (4, 2)), "dotted"))
            for time in sorted({0.0, *ends, *self.marks}) if ends or self.marks else ():
                axes.axvline(time, color=style.GREY, linewidth=0.6, linestyle=(0, (4, 3)))
            if self.level is not None:
                axes.axhline(self.level, color=style.GREY, linewidth=0.6)
            axes.set_xlabel(self.x_label)
            axes.set_ylabel(label)
            axes.set_xscale("log" if self.log and any(histories for _, histories in drawn) else "linear")
            if axes.get_xscale() == "log" and axes.get_xlim()[1] < _SHORT * axes.get_xlim()[0]:
                # Labels of powers alone are too few, those of all ticks overlap.
                axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
                axes.xaxis.set_major_formatter("{x:g}")
                axes.xaxis.set_minor_formatter(NullFormatter())
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
            return self.history(analysis.runs[run])
        except (InputError, KeyError):
            return None


@dataclass(frozen=True, kw_only=True)
class Scatter:
    """A quantity against several others, one per panel: runs as small markers, means over seeds as large."""

    name: str  #: Name of the files without suffix
    xs: Sequence[Quantity]  #: Drawn along x, in a panel each
    y: Quantity  #: Drawn along y in all panels
    split: Split  #: Makes the series of runs and of points; their properties have a marker and a colour
    bounds: str = ""  #: Column that is above 0 where y is a lower bound, which is drawn with an arrow; empty: none is
    means: bool = True  #: Whether means over seeds are drawn

    def draw(self, path: Path, analysis: Analysis) -> list[Path]:
        """Draw all runs, and then the means with error bars along x and y."""
        figure, grid = panels(len(self.xs), columns=3, sharey=True)
        runs, y = analysis.table("runs"), self.y.column
        length = 0.08 * float(runs[y].max())
        for axes, quantity in zip(grid, self.xs, strict=True):
            x = quantity.column
            for series in self.split(runs):
                rows, colour = series.rows, series.properties["color"]
                small = {"color": colour, "alpha": 0.55}
                label = "_" if self.means else series.label
                axes.plot(rows[x], rows[y], series.properties["marker"], markersize=1.8, **small, label=label)
                held = rows[rows[self.bounds] > 0] if self.bounds else rows.iloc[:0]
                draw_bounds(axes, held[x], held[y], length, properties={**small, "elinewidth": 0.6, "capsize": 1.6})
            for series in self.split(analysis.table("points")) if self.means else ():
                properties = {"markersize": 4.2, **series.properties, "linestyle": "none"}
                rows = series.rows
                errors, across = (rows[marked(name, "95 %")] for name in (y, x))
                shown: dict[str, Any] = {"across": across, "label": series.label, "properties": properties}
                draw_means(axes, rows[x], rows[y], errors, **shown)
            axes.set_xlabel(quantity.axis or x)
            axes.set_ylabel(self.y.axis or y)
            axes.set_ylim(bottom=0)
        arrows = ", with an arrow: a lower bound" if self.bounds else ""
        note = f"Small: runs{arrows}; large: means over seeds." if self.means or arrows else "A marker is a run."
        return finish(figure, path, [note], analysis.footer)


def one_by_one(column: str, label: Callable[[Any], str], *, last: float = 0.85) -> SplitBy:
    """Return a split of tables into one series per value of a column, in colours from dark to light.

    `label` makes the text in the legend from a value; `last` is the position of the lightest colour in the map, 0 to 1.
    """

    def split(table: pd.DataFrame) -> list[Series]:
        values = sorted(table[column].dropna().unique())
        shapes = np.resize(list("oD^sv<>p"), len(values))
        return [
            Series(
                rows=table[table[column] == value], label=label(value), properties=marker(str(shape), colour, colour)
            )
            for value, shape, colour in zip(values, shapes, style.sequence(len(values), last=last), strict=True)
        ]

    return SplitBy(column, split)


PROCEDURE_LABELS: Mapping[str, str] = MappingProxyType(
    {
        STATIC: "static",
        EXTERNAL: "external oscillation",
        INTERNAL: r"internal oscillation, $\theta$ = 10°",
        SHAPE: "shape change",
    }
)


def by_procedure(labels: Mapping[str, str] = PROCEDURE_LABELS, *, apart: float = 0.0, line: bool = True) -> SplitBy:
    """Return a split into one series per procedure; for the internal oscillation only θ = `AMPLITUDE`.

    `labels` are texts in the legend by procedure, in the order of the legend. Neighbouring series are shifted by
    `apart` along x, in the unit of the x axis. `line`: whether a line joins the points.
    """

    def split(table: pd.DataFrame) -> list[Series]:
        plain = {} if line else {"linestyle": "none"}
        return [
            Series(
                rows=of_procedure(table, name),
                label=label,
                properties={**procedure_marker(name), **plain},
                shift=apart * (number - (len(labels) - 1) / 2),
            )
            for number, (name, label) in enumerate(labels.items())
        ]

    return SplitBy(PROCEDURE, split)


def marker(shape: str, colour: str, face: str) -> dict[str, Any]:
    """Return Matplotlib's properties of a marker, line and error bars in `colour`; `face`: its inside."""
    edges = {"markeredgewidth": 0.9, "elinewidth": 0.8, "capthick": 0.8}
    return {"marker": shape, "color": colour, "markerfacecolor": face, **edges}


def procedure_marker(procedure: str) -> dict[str, Any]:
    """Return the properties of a procedure's marker, which is open for the static state."""
    colour = _COLOURS[procedure]
    return marker(_SHAPES[procedure], colour, "white" if procedure == STATIC else colour)


def panels(
    count: int, *, columns: int, width: float | None = None, height: float | None = None, **shared: Any
) -> tuple[Canvas, list[Axes]]:
    """Make a figure and its panels, which fill line by line.

    `columns` is the largest number of panels in a line, `width` the width of the figure and `height` the height of a
    line [inch]. `shared` are arguments of Matplotlib's `subplots`, such as `sharey`.
    """
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
    """Average each history over intervals of a width [s] or, with `log`, over 49 logarithmic intervals.

    Two intervals meet at time 0, when the activity begins. An interval is left out if a history has no sample in it.
    Returns the centres of the intervals (n,) [s] and the means of each history (histories, n).
    """
    first, last = (edge(one.times[at] for one in histories) for edge, at in ((min, 0), (max, -1)))
    if log:
        edges = np.geomspace(max(first, 0.1), last * (1 + 1e-9), _BINS // 2)
        centres = np.sqrt(edges[:-1] * edges[1:])
    else:
        start = math.floor(first / width)
        edges = width * np.arange(start, max(math.ceil(last / width), start + 1) + 1)
        centres = (edges[:-1] + edges[1:]) / 2
        edges[-1] = np.inf  # the last interval includes its right edge
    means = np.array(
        [
            pd.Series(one.values).groupby(np.searchsorted(edges, one.times + 1e-12, side="right") - 1).mean()
            .reindex(range(len(centres))).to_numpy()
            for one in histories
        ]
    )  # fmt: skip
    whole = np.isfinite(means).all(axis=0)
    return centres[whole], means[:, whole]


def draw_history(
    axes: Axes, histories: Sequence[History], width: float, *, log: bool = False, **properties: Any
) -> NDArray[np.float64]:
    """Draw mean (line) and range (band) of histories; return the times (n,) [s] of the drawn points.

    A point is an average over an interval of the width [s]; with `log`, over one of 49 logarithmic intervals, and the
    width has no effect. `properties` are arguments of Matplotlib's `Axes.plot`; one of them must be `color`.
    """
    centres, means = binned(histories, width, log=log)
    axes.plot(centres, means.mean(axis=0), **properties)
    if len(means) > 1:
        band = {"color": properties["color"], "alpha": 0.25, "linewidth": 0}
        axes.fill_between(centres, means.min(axis=0), means.max(axis=0), **band)
    return centres


def draw_fits(
    axes: Axes,
    x: NDArray[np.float64],
    fits: Mapping[str, tuple[ArrayLike, ArrayLike]],
    colour: str,
    *,
    lines: Sequence[Any] = ("solid",),
) -> None:
    """Draw curves of one colour over points x (n,), with bands.

    Fits are values (n,) and 95 % half-widths (n,) of the band by the label of the curve; `lines` are line styles.
    """
    for (label, (values, half_widths)), line in zip(fits.items(), lines, strict=False):
        axes.plot(x, values, color=colour, linewidth=0.9, linestyle=line, label=label)
        low, high = np.asarray(values) - half_widths, np.asarray(values) + half_widths
        axes.fill_between(x, low, high, color=colour, alpha=0.15, linewidth=0)


def draw_means(
    axes: Axes,
    x: ArrayLike,
    y: ArrayLike,
    half_widths: ArrayLike | None,
    *,
    properties: Mapping[str, Any],
    label: str,
    across: ArrayLike | None = None,
) -> None:
    """Draw means y (n,) at positions x (n,) with their error bars.

    Half-widths of the 95 % intervals are those of y (n,), and `across` those of x, (n,), or (2, n) for the lower and
    the upper side; NaN where unknown, None for no bars. `properties` are arguments of Matplotlib's `Axes.errorbar`.
    """
    # Without a known error the legend must not show a bar.
    up, aside = (
        None if part is None or not np.isfinite(np.asarray(part, float)).any() else part
        for part in (half_widths, across)
    )
    bars = axes.errorbar(x, y, yerr=up, xerr=aside, **{"markersize": 3.4, "linewidth": 0.7, **properties}, label=label)
    if up is not None or aside is not None:
        for lines in bars.lines[2]:
            lines.set_label(_CONFIDENCE)


def draw_bounds(
    axes: Axes, x: ArrayLike, least: ArrayLike, lengths: ArrayLike, *, properties: Mapping[str, Any]
) -> None:
    """Draw lower bounds `least` (n,) at positions x (n,) as markers with arrows upwards.

    Bounds that are NaN are left out. The lengths of the arrows, in the unit of y, have no physical meaning.
    `properties` are arguments of Matplotlib's `Axes.errorbar`.
    """
    at, from_, long = np.broadcast_arrays(*(np.asarray(part, dtype=np.float64) for part in (x, least, lengths)))
    known = np.isfinite(from_)
    if known.any():
        properties = {"markersize": 3.4, **properties, "linestyle": "none"}
        axes.errorbar(at[known], from_[known], yerr=long[known], lolims=True, **properties)


def finish(figure: Canvas, path: Path, notes: Sequence[str], footer: Sequence[str], *, bars: str = BARS) -> list[Path]:
    """Add legend and footer to a figure, write it to files, and return their paths.

    The limits of the axes are widened until they show everything.

    The path has no suffix. The footer has `notes` first; then, if there are error bars, their explanation `bars`.
    """
    legends = [
        {label: handle for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)} for axes in figure.axes
    ]
    entries: dict[str, Any] = {}
    for legend in sorted(legends, key=len, reverse=True):  # the fullest panel has its entries first
        for label, handle in legend.items():
            entries.setdefault(label, handle)
    if len(entries) > 1:
        columns = 2 if figure.get_size_inches()[0] < 1.5 * style.COLUMN_WIDTH else 4
        figure.legend(entries.values(), entries.keys(), loc="outside upper center", ncols=columns)
    hidden = style.hold_everything(figure)
    has_bars = any(
        lines.get_label() == _CONFIDENCE
        for axes in figure.axes
        for container in axes.containers
        if isinstance(container, ErrorbarContainer)
        for lines in container.lines[2]
    )
    style.add_footer(figure, [*notes, *([f"{bars}."] if has_bars else []), *hidden, *footer])
    return style.save(figure, path)
