"""The figures of the study `chain`; see `studies.chain.study` for what they show."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dem.record.manifest import RunManifest
from postprocess.measures.strain import (
    FRACTURE,
    PEAK,
    StrainTest,
    read_strain_test,
)
from postprocess.report import figures
from postprocess.statistics.points import marked
from studies.chain.findings import COUNTS, RANGE
from studies.chain.measure import BASELINE, CONFINEMENT, COUNT, VARIANT
from studies.framework.plots import draw_means, finished, marker

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    _Value = Callable[[StrainTest], NDArray[np.float64]]

_WIDE = 2 * figures.COLUMN_WIDTH
_LOOKS = {2: marker("o", figures.BLUE, figures.BLUE), 6: marker("s", figures.ORANGE, "white")}
_BIN = 0.005  # of strain, over which forces are averaged for a line


def draw(
    output: Path,
    *,
    points: pd.DataFrame,
    runs: pd.DataFrame,
    changes: pd.DataFrame,
    manifests: Sequence[RunManifest],
    footer: Sequence[str],
) -> list[Path]:
    """Draws and writes all figures.

    Args:
        output: Folder.
        points: See `measure.points`.
        runs: See `measure.chain_row`.
        changes: See `findings.sensitivity`.
        manifests: The runs.
        footer: Origin, one statement each.

    Returns:
        The files written.
    """
    pulls = {run.directory.name: read_strain_test(run) for run in manifests}
    written = []
    with figures.style():
        for name, label, value in (
            ("force_strain", "force of the pulled string [N]", lambda pull: pull.forces),
            ("width_strain", "width over that at the start [-]", lambda pull: pull.widths / pull.widths[0]),
        ):
            figure = _draw_curves(label, value, runs, pulls)
            told = f"One line per trial, means over {_BIN:g} of strain, up to the fracture; thick: first trials."
            written += finished(figure, output / name, [told], footer)
        written += _draw_confinement(output / "confinement", points, footer)
        if len(changes):
            written += _draw_sensitivity(output / "sensitivity", changes, footer)
    return written


def _draw_curves(label: str, value: _Value, runs: pd.DataFrame, pulls: dict[str, StrainTest]) -> Figure:
    base = runs[runs[VARIANT] == BASELINE]
    ratios = sorted(base[CONFINEMENT].unique())
    colours = dict(zip(ratios, figures.sequence(len(ratios), first=0.0, last=0.85), strict=True))
    figure = figures.blank_figure(_WIDE, 2.7)
    panels = figure.subplots(1, len(COUNTS), sharey=True)
    for axes, count in zip(panels, COUNTS, strict=True):
        for ratio in ratios:
            part = base[(base[COUNT] == count) & (base[CONFINEMENT] == ratio)]
            for k, run in enumerate(part["run"]):
                _draw_curve(axes, pulls[run], value, colours[ratio], f"h/H = {ratio:g}" if k == 0 else "")
        axes.set_xlabel("strain [-]")
        axes.set_title(f"n = {count}", fontsize=8)
        axes.legend(loc="upper left")
    panels[0].set_ylabel(label)
    return figure


def _draw_curve(axes: Axes, pull: StrainTest, value: _Value, colour: str, label: str) -> None:
    end = pull.fracture + 1
    place = np.floor(np.maximum.accumulate(pull.strains[:end]) / _BIN).astype(int)
    counts = np.maximum(np.bincount(place), 1)
    known = np.bincount(place) > 0
    means = np.bincount(place, value(pull)[:end]) / counts
    places = (np.flatnonzero(known) + 0.5) * _BIN
    width, strength = (1.1, 1.0) if label else (0.5, 0.45)
    axes.plot(places, means[known], color=colour, label=label or None, linewidth=width, alpha=strength)


def _draw_confinement(path: Path, points: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    figure = figures.blank_figure(_WIDE, 2.7)
    for axes, quantity in zip(figure.subplots(1, 2), (PEAK, FRACTURE), strict=True):
        axes.axvspan(*RANGE, color="#eeeeee", zorder=0, label="range of the paper")
        for count in COUNTS:
            part = points[(points[VARIANT] == BASELINE) & (points[COUNT] == count)].sort_values(CONFINEMENT)
            look = {"linestyle": "-", **_LOOKS[count]}
            errors = part[marked(quantity, "95 %")]
            draw_means(axes, part[CONFINEMENT], part[quantity], errors, look=look, label=f"n = {count}")
        axes.set_xlabel("confinement h/H [-]")
        axes.set_ylabel(quantity)
        axes.set_ylim(bottom=0)
        axes.legend(loc="lower right")
    return finished(figure, path, ["Means over trials, each with a seed of its own."], footer)


def _draw_sensitivity(path: Path, changes: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    names = list(dict.fromkeys(changes[VARIANT]))
    figure, axes = figures.new_figure(width=_WIDE, height=0.8 + 0.27 * len(names))
    for shift, quantity, look in ((0.14, PEAK, _LOOKS[2]), (-0.14, FRACTURE, _LOOKS[6])):
        part = changes[changes["quantity"] == quantity].set_index(VARIANT).loc[names]
        rows = -np.arange(len(names)) + shift
        name, bars = quantity.rpartition(" [")[0], part["change 95 % [%]"]
        draw_means(axes, part["change [%]"], rows, None, across=bars, look={"linestyle": "none", **look}, label=name)
    axes.axvline(0, color=figures.GREY, linewidth=0.6)
    axes.set_yticks(-np.arange(len(names)), names)
    axes.set_xlabel("change against the baseline [%]")
    axes.legend(loc="best")
    return finished(figure, path, ["Means over pairs of runs with the same servos, n = 2."], footer)
