"""Generic figures of studies: means against a variable, histories, scatter with bounds, combinations of factors."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pandas as pd

from dem.errors import InputError
from dem.record.run import Run
from postprocess.report import figures as style
from postprocess.statistics.points import marked
from studies.framework import plots
from studies.framework.engines import TOLD, engines_of, judging, of_engine
from studies.framework.plots import History
from studies.framework.procedures import of_procedure
from studies.framework.quantities import Quantity


@dataclass(frozen=True, kw_only=True)
class Analysis:
    """What figures are drawn from.

    Attributes:
        tables: Tables of the study by name.
        manifests: Finished runs by name.
        footer: Origin, one statement each.
    """

    tables: Mapping[str, pd.DataFrame] = field(repr=False)
    manifests: Mapping[str, Run] = field(repr=False)
    footer: Sequence[str]

    @property
    def points(self) -> pd.DataFrame:
        """Points of the engine that judges."""
        return judging(self.tables["points"])

    @property
    def runs(self) -> pd.DataFrame:
        """Runs of the engine that judges."""
        return judging(self.tables["runs"])


@dataclass(frozen=True, kw_only=True)
class Series:
    """Rows that are drawn alike.

    Attributes:
        rows: Points or runs, in the order of a line through them.
        label: For the legend.
        look: Marker and line, see `plots.marker`.
        shift: Along x, to keep error bars apart.
    """

    rows: pd.DataFrame = field(repr=False)
    label: str
    look: Mapping[str, Any]
    shift: float = 0.0


_MOST_COLUMNS = 3

Split = Callable[[pd.DataFrame], list[Series]]
"""Makes the series of a table of points or runs."""


class Figure(Protocol):
    """A figure of a study."""

    @property
    def name(self) -> str:
        """Name of its files, without suffix."""

    def draw(self, path: Path, analysis: Analysis) -> list[Path]:
        """Draw and write the figure; gives the files, none where there is nothing to draw."""


@dataclass(frozen=True, kw_only=True)
class Drawing:
    """A figure of one study alone.

    Attributes:
        name: Of the files.
        of: Draws it below a footer and writes it to a path without suffix; gives the files.
    """

    name: str
    of: Callable[[Path, Analysis], list[Path]]

    def draw(self, path: Path, analysis: Analysis) -> list[Path]:
        """Draw and write the figure."""
        return self.of(path, analysis)


@dataclass(frozen=True, kw_only=True)
class Means:
    """Means of quantities with their error bars against a variable, a panel for each quantity.

    Attributes:
        name: Of the files.
        quantities: What is drawn.
        x: Column of the variable.
        x_label: Of the axis.
        split: Makes the series of the points.
        x_scale: Factor of x.
        log: Whether y is logarithmic where all means are above 0.
        marks: Values of x with a vertical line.
        ticks: Whether the axis has ticks at the values of x alone.
        share_y: Whether panels have one y axis.
        reference: Published values by the column that they are set against: places in the unit of x, and values.
        told: Lines for the footer.
    """

    name: str
    quantities: Sequence[Quantity]
    x: str
    x_label: str
    split: Split
    x_scale: float = 1.0
    log: bool = False
    marks: Sequence[float] = ()
    ticks: bool = False
    share_y: bool = False
    reference: Mapping[str, tuple[pd.Series, pd.Series]] = field(default_factory=dict)
    told: Sequence[str] = ()

    def draw(self, path: Path, analysis: Analysis) -> list[Path]:
        """Draw the judging engine filled, other engines open beside it."""
        drawn = pd.concat([series.rows for series in self.split(analysis.points)] or [analysis.points.iloc[:0]])
        if drawn[[quantity.column for quantity in self.quantities]].isna().all().any():
            return []
        columns = min(len(self.quantities), 2)
        rows = -(-len(self.quantities) // columns)
        width, height = columns * style.COLUMN_WIDTH, 2.8 if rows == 1 else 2.2 * rows
        figure = style.blank_figure(width, height)
        grid = figure.subplots(rows, columns, sharex=True, sharey=self.share_y, squeeze=False)
        for axes, quantity in zip(grid.flat, self.quantities, strict=False):
            self._panel(axes, quantity, analysis.tables["points"])
        for axes in grid[-1]:
            axes.set_xlabel(self.x_label)
            if self.ticks:
                values = self.x_scale * np.unique(analysis.points[self.x].dropna())
                axes.set_xticks(values, labels=[f"{value:g}" for value in values])
        if columns == 1:
            plots.legend_above(grid[0, 0])
        else:
            handles, labels = grid[0, 0].get_legend_handles_labels()
            figure.legend(handles, labels, loc="outside upper center", ncols=4)
        return plots.finished(figure, path, list(self.told), analysis.footer)

    def _panel(self, axes: Any, quantity: Quantity, points: pd.DataFrame) -> None:
        for x in self.marks:
            axes.axvline(x, color=style.GREY, linewidth=0.6, linestyle=(0, (2, 2)))
        if quantity.column in self.reference:
            look = {**plots.marker("o", style.ORANGE, style.ORANGE), "linestyle": "none"}
            plots.draw_means(axes, *self.reference[quantity.column], None, look=look, label="experiment")
        known = points[points[quantity.column].notna()]
        positive = True
        for number, engine in enumerate(engines_of(known) or ("",)):
            part = of_engine(known, engine) if engine else known
            label = f"the same on {TOLD.get(engine, engine)}: green"
            for series in self.split(part):
                if series.rows.empty:
                    continue
                rows, scale = series.rows, quantity.axis_scale
                x = self.x_scale * rows[self.x] + series.shift * (1 + 2 * number)
                errors = scale * rows[marked(quantity.column, "95 %")].to_numpy()
                look = dict(series.look)
                if number:
                    look |= {"color": style.GREEN, "markerfacecolor": "white", "linestyle": "none"}
                shown = label if number else series.label
                plots.draw_means(axes, x, scale * rows[quantity.column], errors, look=look, label=shown)
                positive &= bool((rows[quantity.column] > 0).all())
                label = "_"
        axes.set_ylabel(quantity.axis or quantity.column)
        if self.log and positive:
            axes.set_yscale("log")
        elif positive:
            axes.set_ylim(bottom=0)


@dataclass(frozen=True, kw_only=True)
class Histories:
    """A quantity of runs against time or another variable: means over seeds, lowest to highest seed as a band.

    Attributes:
        name: Of the files.
        history: Reads the history of a run; an InputError leaves the run out.
        split: Makes the series of the runs; its look has a colour.
        x_label: Of the axis.
        y_label: Of the axis.
        rows: Selects the runs that are drawn.
        panels: Column with a panel for each value; None: one panel.
        panel: Title of a panel, with `{}` for its value.
        panel_scale: Factor of that value.
        width: Of the intervals that are averaged over; None: a hundredth of the longest activity.
        unit: Of that width.
        log: Whether x is logarithmic; it must be positive.
        level: Horizontal line.
        told: Lines for the footer.
    """

    name: str
    history: Callable[[Run], History]
    split: Split
    x_label: str
    y_label: str
    rows: Callable[[pd.DataFrame], pd.DataFrame] = lambda runs: runs
    panels: str | None = None
    panel: str = "{:g}"
    panel_scale: float = 1.0
    width: float | None = None
    unit: str = "s"
    log: bool = False
    level: float = 0.0
    told: Sequence[str] = ()

    def draw(self, path: Path, analysis: Analysis) -> list[Path]:
        """Draw a line and a band for each series that has histories."""
        runs = self.rows(analysis.runs)
        if runs.empty:
            return []
        values = [None] if self.panels is None else sorted(runs[self.panels].unique())
        columns = min(len(values), _MOST_COLUMNS)
        lines = -(-len(values) // columns)
        figure = style.blank_figure(min(columns * style.COLUMN_WIDTH, 7.0), 2.8 if lines == 1 else 2.2 * lines)
        grid = figure.subplots(lines, columns, sharey=True, squeeze=False)
        missing, width = 0, 0.0
        split = self.split(runs)
        for axes, value in zip(grid.flat, values, strict=False):
            drawn: list[tuple[Series, list[History]]] = []
            for series in split:
                rows = series.rows if value is None else series.rows[series.rows[self.panels] == value]
                found = [self._read(analysis, str(run)) for run in rows["run"]]
                missing += found.count(None)
                drawn.append((series, [one for one in found if one is not None]))
            ends = [one.active for _, histories in drawn for one in histories if one.active > 0]
            width = self.width or plots.bin_width(ends)
            for series, histories in drawn:
                if histories:
                    plots.draw_history(axes, histories, width, colour=series.look["color"], label=series.label)
            if ends:
                plots.draw_ends(axes, ends)
            axes.axhline(self.level, color=style.GREY, linewidth=0.6)
            axes.set_xlabel(self.x_label)
            axes.set_xscale("log" if self.log and any(histories for _, histories in drawn) else "linear")
            if value is not None:
                axes.set_title(self.panel.format(self.panel_scale * value))
        for axes in grid.flat[len(values) :]:
            axes.set_visible(False)
        for axes in grid[:, 0]:
            axes.set_ylabel(self.y_label)
        if len(values) == 1:
            plots.legend_above(grid[0, 0])
        else:
            fullest = max(grid.flat, key=lambda axes: len(axes.get_legend_handles_labels()[1]))
            figure.legend(*fullest.get_legend_handles_labels(), loc="outside upper center", ncols=4)
        told = [f"Line: mean over seeds of means over {width:.2g} {self.unit}; {plots.BAND}.", *self.told]
        if missing:
            told.append(f"Without a recorded history: {missing} runs.")
        return plots.finished(figure, path, told, analysis.footer)

    def _read(self, analysis: Analysis, run: str) -> History | None:
        manifest = analysis.manifests.get(run)
        try:
            return None if manifest is None else self.history(manifest)
        except InputError:
            return None


@dataclass(frozen=True, kw_only=True)
class Times:
    """Columns of the table `times`, a panel each: means over seeds, lowest to highest seed as a band.

    Attributes:
        name: Of the files.
        quantities: Label of the y axis by column.
        x: Column of the time.
        x_label: Of the axis.
        split: Makes the series of the runs; its look has a colour.
        rows: Selects the runs that are drawn.
        spans: What the y axis shows at least, by column, lest a small change look large.
        told: Lines for the footer.
    """

    name: str
    quantities: Mapping[str, str]
    x: str
    x_label: str
    split: Split
    rows: Callable[[pd.DataFrame], pd.DataFrame] = lambda runs: runs
    spans: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    told: Sequence[str] = ()

    def draw(self, path: Path, analysis: Analysis) -> list[Path]:
        """Draw a line and a band for each series."""
        runs, times = self.rows(analysis.runs), analysis.tables.get("times")
        if times is None or runs.empty:
            return []
        by_run = dict(iter(times[times["run"].isin(runs["run"])].groupby("run")))
        width = plots.bin_width([float(one[self.x].max()) for one in by_run.values()])
        columns = min(len(self.quantities), 3)
        rows = -(-len(self.quantities) // columns)
        figure = style.blank_figure(min(columns, 2) * style.COLUMN_WIDTH, 0.5 + 1.7 * rows)
        grid = figure.subplots(rows, columns, sharex=True, squeeze=False)
        for axes, (quantity, label) in zip(grid.flat, self.quantities.items(), strict=False):
            for series in self.split(runs):
                seeds = [
                    History(times=one[self.x].to_numpy(), values=one[quantity].to_numpy(), active=0.0)
                    for one in (by_run[name] for name in series.rows["run"] if name in by_run)
                ]
                if seeds:
                    plots.draw_history(axes, seeds, width, colour=series.look["color"], label=series.label)
            axes.set_ylabel(label)
            least, most = self.spans.get(quantity, (axes.dataLim.y0, axes.dataLim.y1))
            axes.set_ylim(min(axes.dataLim.y0, least), max(axes.dataLim.y1, most))
        for axes in grid[-1]:
            axes.set_xlabel(self.x_label)
        figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
        told = f"Line: mean over seeds of means over {width:.2g} s; {plots.BAND}."
        return plots.finished(figure, path, [*self.told, told], analysis.footer)


@dataclass(frozen=True, kw_only=True)
class Scatter:
    """A quantity against another one: every run as a small marker, means over seeds as large ones.

    Attributes:
        name: Of the files.
        x: Quantity across.
        y: Quantity upwards.
        split: Makes the series of runs and of points; its look has a marker and a colour.
        bounds: Column that is above 0 where y is a lower bound, drawn as an arrow.
        told: Lines for the footer.
    """

    name: str
    x: Quantity
    y: Quantity
    split: Split
    bounds: str
    told: Sequence[str] = ()

    def draw(self, path: Path, analysis: Analysis) -> list[Path]:
        """Draw runs, then means with the error bars of both quantities."""
        figure, axes = style.new_figure(height=2.8)
        x, y = self.x.column, self.y.column
        length = 0.08 * float(analysis.runs[y].max())
        for series in self.split(analysis.runs):
            shape, colour = series.look["marker"], series.look["color"]
            plots.draw_runs(axes, series.rows, x, y, bounds=self.bounds, length=length, shape=shape, colour=colour)
        for series in self.split(analysis.points):
            look = {"markersize": 4.2, **series.look}
            plots.draw_against(axes, series.rows, x, y, look=look, label=series.label)
        axes.set_xlabel(self.x.axis or x)
        axes.set_ylabel(self.y.axis or y)
        axes.set_ylim(bottom=0)
        plots.legend_above(axes)
        told = "Small: runs, with an arrow: a lower bound; large: means over seeds."
        return plots.finished(figure, path, [told, *self.told], analysis.footer)


@dataclass(frozen=True, kw_only=True)
class Combinations:
    """Quantities of every combination of factors, those with all first levels at the top.

    Attributes:
        name: Of the files.
        quantities: What is drawn, a panel each.
        factors: Both levels of each factor, by column.
        row: Names a combination.
    """

    name: str
    quantities: Sequence[Quantity]
    factors: Mapping[str, tuple[object, object]]
    row: Callable[[pd.Series], str]

    def draw(self, path: Path, analysis: Analysis) -> list[Path]:
        """Draw a row for each combination."""
        return plots.draw_combinations(
            path,
            points=analysis.points,
            factors=self.factors,
            shown={quantity.column: quantity.axis or quantity.column for quantity in self.quantities},
            named=self.row,
            footer=analysis.footer,
        )


def one_by_one(column: str, label: Callable[[Any], str], *, last: float = 0.85) -> Split:
    """Make a series of each value of a column, in colours from light to dark."""

    def split(table: pd.DataFrame) -> list[Series]:
        values = sorted(table[column].dropna().unique())
        shapes = np.resize(list("oD^sv<>p"), len(values))
        colours = style.sequence(len(values), last=last)
        return [
            Series(
                rows=table[table[column] == value], label=label(value), look=plots.marker(str(shape), colour, colour)
            )
            for value, shape, colour in zip(values, shapes, colours, strict=True)
        ]

    return split


def by_procedure(labels: Mapping[str, str], *, apart: float = 0.0, line: bool = True) -> Split:
    """Make a series of each procedure, the internal oscillation at the amplitude that procedures are compared at.

    Args:
        labels: Labels by procedure, in the order of the legend.
        apart: Distance of neighbouring series along x.
        line: Whether a line joins the points.
    """

    def split(table: pd.DataFrame) -> list[Series]:
        middle = (len(labels) - 1) / 2
        return [
            Series(
                rows=of_procedure(table, name),
                label=label,
                look={**plots.procedure_marker(name), **({} if line else {"linestyle": "none"})},
                shift=apart * (number - middle),
            )
            for number, (name, label) in enumerate(labels.items())
        ]

    return split
