"""Charts of a report, as SVG pictures in data URLs."""

import io
from collections.abc import Callable, Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dem.arrays import Array
from postprocess.report.figures import BLACK, BLUE, GREY, ORANGE, new_figure, style
from postprocess.report.series import Spans, shade, thinned
from smarticles.reporting.page import data_url

Groups = Mapping[str, tuple[Sequence[object], Sequence[float], Sequence[float]]]  #: x, means, errors by curve name


def against_time(times: Array, values: Array, label: str, phases: Spans) -> str:
    """Draw a quantity against time; return the chart as a data URL.

    Times (n,) are in [s], values (n,) in the unit of the label; phases are start [s], end [s] and type.
    """
    with style():
        figure, axes = _axes("time [s]", label)
        shade(axes, phases)
        axes.plot(*thinned(times, values), color=BLUE, linewidth=1.0)
        return _svg(figure)


def against_variable(variable: str, label: str, groups: Groups) -> str:
    """Draw means with error bars against a variable; return the chart as a data URL.

    Groups have, for each name in the legend, values of the variable (numbers or words), means, and half-lengths of the
    error bars, which may be NaN.
    """
    values = [x for xs, _, _ in groups.values() for x in xs]
    numeric = all(isinstance(x, int | float) for x in values)
    names = list(dict.fromkeys(map(str, values)))
    position: Callable[[Any], float] = float if numeric else (lambda x: float(names.index(str(x))))
    positions = np.unique([position(x) for x in values])
    spacing = np.diff(positions).min() if len(positions) > 1 else 1.0
    with style():
        figure, axes = _axes(variable, label)
        styled = zip(groups.items(), cycle((BLUE, ORANGE, BLACK, GREY)), cycle("osD^v"), strict=False)
        for number, ((name, (xs, means, errors)), colour, marker) in enumerate(styled):
            # Curves are shifted sideways, so that error bars do not cover each other.
            shift = 0.06 * spacing * (number - (len(groups) - 1) / 2)
            axes.errorbar(
                [position(x) + shift for x in xs], means, np.asarray(errors, dtype=float), color=colour, label=name,
                marker=marker, linestyle="-" if numeric else "none", linewidth=0.9,
            )  # fmt: skip
        if not numeric:
            axes.set_xticks(range(len(names)), names, parse_math=False)
        if len(groups) > 1:
            # Above the axes, where the legend covers no data.
            legend = axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, borderaxespad=0.2)
            for text in legend.get_texts():
                text.set_parse_math(False)
        return _svg(figure)


def _axes(x: str, y: str) -> tuple[Figure, Axes]:
    figure, axes = new_figure(width=4.2, height=2.2)
    figure.set_layout_engine("constrained")
    figure.patch.set_alpha(0)
    axes.patch.set_alpha(0)
    axes.set_xlabel(x, parse_math=False)
    axes.set_ylabel(y, parse_math=False)
    return figure, axes


def _svg(figure: Figure) -> str:
    with io.BytesIO() as file:
        figure.savefig(file, format="svg", metadata={"Date": None})
        return data_url(file.getvalue(), "image/svg+xml")
