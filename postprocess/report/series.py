"""Draw recorded series of a run against time, with the run's phases as bands."""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from dem.arrays import Array
from dem.errors import InputError
from dem.record.columns import COMPONENTS, EVERY
from dem.record.run import Run, open_run
from postprocess.report.figures import BLUE, GREEN, GREY, ORANGE, style
from postprocess.report.tables import reject_existing, whole_file

FORMATS = (".png", ".pdf", ".svg")  #: Suffixes of charts

_BAND = "#f0f1f2"
_MOST_POINTS = 400
_WIDTH, _HEIGHT = 4.6, 1.9  # of the chart of one series [inch]
_POINTS, _SMALL = 72, 5.5  # points in an inch; size of the types of phases [points]
_AXES = 0.8  # about the width and height of axes over those of the figure
_RESOLUTION = 150  # in a notebook [dots per inch]

Spans = Sequence[tuple[float, float, str]]  #: Start [s], end [s] and type of phases


class Chart(Figure):
    """A figure that notebooks show, and that is saved with the fonts of all figures."""

    def __init__(self, width: float, height: float) -> None:
        super().__init__(figsize=(width, height), dpi=_RESOLUTION, facecolor="white", layout="constrained")
        FigureCanvasAgg(self)

    def savefig(self, fname: Any, **options: Any) -> None:
        """Save the figure to a file, whose suffix chooses the format; options are those of Matplotlib."""
        with style():
            super().savefig(fname, **options)

    def _repr_png_(self) -> bytes:
        # Matplotlib's own display needs pyplot, which would show the figure a second time.
        with io.BytesIO() as file:
            self.savefig(file, format="png", dpi=_RESOLUTION)
            return file.getvalue()


def spans_of(run: Run) -> list[tuple[float, float, str]]:
    """Return start [s], end [s] and type of the phases from which the run has samples."""
    series, spans = run.series, []
    for phase in run.phases:
        inside = series.time[series["phase"] == phase.index]
        if len(inside):
            start = float(inside[0]) if phase.start_s is None else phase.start_s
            spans.append((start, float(inside[-1]) if phase.end_s is None else phase.end_s, phase.type))
    return spans


def shade(axes: Axes, phases: Spans, *, named: bool = True) -> None:
    """Draw phases as bands over the whole time axis, with their types above if `named`.

    A type that would run into the one before is written a line higher.
    """
    if not phases:
        return
    begin, finish = phases[0][0], phases[-1][1]
    if finish > begin:
        axes.set_xlim(begin, finish)
    figure = axes.get_figure(root=True)
    assert figure is not None
    wide, high = (_POINTS * side * _AXES for side in figure.get_size_inches())
    high /= len(figure.axes)
    filled: list[float] = []  # end of the text in each line [s]
    for number, (start, end, kind) in enumerate(phases):
        if number % 2:
            axes.axvspan(start, end, color=_BAND, linewidth=0, zorder=0)
        middle, half = (start + end) / 2, 0.35 * _SMALL * (len(kind) + 1) / wide * (finish - begin)
        line = next((k for k, used in enumerate(filled) if used <= middle - half), len(filled))
        filled[line : line + 1] = [middle + half]
        if named:
            axes.text(
                middle, 1.02 + 1.3 * _SMALL * line / high, kind, ha="center", va="bottom", fontsize=_SMALL, color=GREY,
                transform=axes.get_xaxis_transform(), parse_math=False, clip_on=False,
            )  # fmt: skip


def thinned(times: Array, values: Array) -> tuple[Array, Array]:
    """Reduce a curve to at most 400 points, without NaN; return its times and values.

    A curve with more points, times (n,) and values (n,), is cut into 200 intervals with about equal numbers of points;
    the points with the least and the greatest value of each interval are kept.
    """
    finite = np.isfinite(values)
    times, values = times[finite], values[finite]
    if len(times) <= _MOST_POINTS:
        return times, values
    intervals = np.array_split(np.arange(len(times)), _MOST_POINTS // 2)
    kept = np.unique([index for s in intervals for index in (s[values[s].argmin()], s[values[s].argmax()])])
    return times[kept], values[kept]


def draw_series(run: Run, names: Sequence[str]) -> Chart:
    """Draw recorded series against time, one below the other; vectors have a curve for each component.

    `names` are names in `Run.series`, such as "com_height_m". InputError if the run has no such series.
    """
    series, spans = run.series, spans_of(run)
    columns = [series[name] for name in names]
    if not columns:
        raise InputError(f"{series.path}: no series is named; choose one of: {', '.join(series)}")
    with style():
        chart = Chart(_WIDTH, 0.4 + _HEIGHT * len(columns))
        rows = chart.subplots(len(columns), 1, squeeze=False, sharex=True)[:, 0]
        for row, (axes, name, values) in enumerate(zip(rows, names, columns, strict=True)):
            parts = values.reshape(len(values), -1)
            labels = COMPONENTS.get(parts.shape[1], ("",))
            for label, part, colour in zip(labels, parts.T, (BLUE, ORANGE, GREEN), strict=False):
                axes.plot(*broken(series.time, part.astype(np.float64)), color=colour, label=label)
            if parts.shape[1] > 1:
                axes.legend(loc="best")
            shade(axes, spans, named=row == 0)
            label, unit = EVERY[name].label if name in EVERY else name, series.units[name]
            axes.set_ylabel(label if unit == "1" else f"{label} [{unit}]", parse_math=False)
        rows[-1].set_xlabel("time [s]")
    return chart


def broken(times: Array, values: Array) -> tuple[Array, Array]:
    """Return a curve of few points, with a gap, a NaN, wherever values are missing."""
    known = np.isfinite(values)
    edges = np.flatnonzero(np.diff(known.astype(int))) + 1
    parts = [thinned(*part) for part in zip(np.split(times, edges), np.split(values, edges), strict=True)]
    gap = np.full(1, np.nan)
    joined = [np.concatenate([one for part in parts for one in (part[place], gap)]) for place in (0, 1)]
    return joined[0], joined[1]


def write_series(
    directory: Path | str, names: Sequence[str], *, output: Path | str | None = None, overwrite: bool = False
) -> Path:
    """Write the chart of a run's series to a file; return its path.

    Args:
        directory: run directory; the run may be unfinished.
        names: names of series.
        output: file to write, whose suffix is one of `FORMATS`; None: `NAME.png` in the run directory, of the first
            name.
        overwrite: whether to replace an existing file.

    Raises:
        InputError: an unknown series or suffix, or a file that exists.
    """
    run = open_run(directory)
    chart = draw_series(run, names)
    path = run.path / f"{names[0]}.png" if output is None else Path(output)
    if path.suffix not in FORMATS:
        raise InputError(f"{path}: a chart must end in {' or '.join(FORMATS)}: got {path.suffix!r}")
    reject_existing(path, overwrite=overwrite)
    dates: dict[str, dict[str, None]] = {".svg": {"Date": None}, ".pdf": {"CreationDate": None, "ModDate": None}}
    with whole_file(path, overwrite=overwrite) as temporary:
        chart.savefig(temporary, format=path.suffix[1:], dpi=2 * _RESOLUTION, metadata=dates.get(path.suffix))
    return path
