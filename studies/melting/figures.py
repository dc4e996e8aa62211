"""The figures of the study `melting`; see `studies.melting.study` for what they show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from postprocess.pictures.strip import Row, draw_strip
from postprocess.report import figures
from postprocess.statistics.columns import ASPECT, SEED
from studies.base.release import ORDER, around, removal
from studies.framework.plots import BAND, COLOURS, History, bin_width, draw_history, finished
from studies.framework.procedures import EXTERNAL, INTERNAL, PROCEDURE, SHAPE, STATIC
from studies.framework.runs import MeasuredRun
from studies.melting.measure import CONTACT, ENTANGLED, HEIGHT, LIFT, SINCE, SLOUGHED, SPREAD, TILT

if TYPE_CHECKING:
    import pandas as pd

_PANELS = {
    CONTACT: "largest cluster\nby contact [-]",
    ENTANGLED: "largest cluster\nby crossings [-]",
    HEIGHT: "height of the centre\nof mass $h/h_0$ [-]",
    SPREAD: "radius of 95 %\nover that before [-]",
    SLOUGHED: "sloughed\nshare [-]",
    TILT: "tilt [degree]",
}
_RANGES = {
    CONTACT: (0.8, 1.02),
    ENTANGLED: (0.8, 1.02),
    HEIGHT: (0.8, 1.02),
    SPREAD: (0.98, 1.2),
    SLOUGHED: (-0.002, 0.1),
    TILT: (0.0, 10.0),
}
_COLOURS = (
    "Each smarticle has a colour of its own, the same in all pictures of a row; first seed; a ring marks the wall."
)
LABELS: Mapping[str, str] = {
    STATIC: "static",
    EXTERNAL: "external oscillation",
    INTERNAL: r"internal oscillation, $\theta$ = 10°",
    SHAPE: "shape change",
}


def draw(
    output: Path,
    *,
    runs: pd.DataFrame,
    melted: Sequence[MeasuredRun],
    footer: Sequence[str],
) -> list[Path]:
    """Draws and writes all figures.

    Args:
        output: Folder.
        runs: Rows of `measure.measure_melting`, in order.
        melted: The runs, with what was measured against time.
        footer: Origin, one statement each.

    Returns:
        The files written.
    """
    by_name = {run.name: run for run in melted}
    written = []
    with figures.style():
        for (lift, aspect), part in runs.groupby([LIFT, ASPECT]):
            name = f"time_lw{aspect:.2f}" + ("_lifted" if lift else "")
            written += _draw_times(output / name, part, by_name, footer, lift=float(lift), aspect=float(aspect))
    return written + _draw_pictures(output / "pictures.png", runs, by_name, footer)


def _draw_times(
    path: Path,
    runs: pd.DataFrame,
    melted: Mapping[str, MeasuredRun],
    footer: Sequence[str],
    *,
    lift: float,
    aspect: float,
) -> list[Path]:
    figure = figures.blank_figure(2 * figures.COLUMN_WIDTH, 3.9)
    grid = figure.subplots(2, 3, sharex=True)
    ends = [float(melted[name].history[SINCE][-1]) for name in runs["run"]]
    width = bin_width(ends)
    for axes, (quantity, label) in zip(grid.flat, _PANELS.items(), strict=True):
        for procedure in ORDER:
            seeds = [
                History(times=one[SINCE], values=one[quantity], active=float(one[SINCE][-1]))
                for one in (melted[name].history for name in runs[runs[PROCEDURE] == procedure]["run"])
            ]
            if seeds:
                draw_history(axes, seeds, width, colour=COLOURS[procedure], label=LABELS[procedure])
        axes.set_ylabel(label)
        # At least so much of the axis, lest a change of one smarticle look like a fall.
        least, most = _RANGES[quantity]
        axes.set_ylim(min(axes.dataLim.y0, least), max(axes.dataLim.y1, most))
    for axes in grid[1]:
        axes.set_xlabel("time since the wall went [s]")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4)
    how = f"lifted at {lift:g} m/s" if lift else "gone at once"
    told = (
        f"l/w = {aspect:g}, wall {how}; time from when it began to. Line: mean over seeds of means over {width:.2g} s; "
        f"{BAND}."
    )
    return finished(figure, path, [told], footer)


def _draw_pictures(
    path: Path, runs: pd.DataFrame, melted: Mapping[str, MeasuredRun], footer: Sequence[str]
) -> list[Path]:
    """The first seed of each procedure, its wall gone at once, at the aspect ratio nearest to the paper's."""
    at_once = runs[runs[LIFT] == 0]
    rows = []
    for procedure in ORDER:
        part = at_once[at_once[PROCEDURE] == procedure]
        if part.empty:
            continue
        part = part.assign(apart=(part[ASPECT] - 0.7).abs()).sort_values(["apart", SEED])
        run = melted[str(part["run"].iloc[0])].manifest
        start, end = removal(run).start, run.end_time
        if start is not None and end is not None:
            times = (around(run)[0].time, start + 0.1, end)
            rows.append(Row(directory=run.directory, label=LABELS[procedure], times=times))
    if not rows:
        return []
    columns = ("before the wall goes", "0.1 s after", "at the end")
    return [draw_strip(rows, path, columns=columns, footer=[_COLOURS, *footer])]
