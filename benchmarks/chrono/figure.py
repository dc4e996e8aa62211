"""The figure: height of the centre of mass against time, Chrono beside links from the same piles, both rules."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.chrono.cases import FIRST, INTERNAL, RULES, SHAPE, Case
from dem.record.manifest import read_run
from postprocess.report import figures
from studies.framework.activity import height_history

Array = NDArray[np.float64]

HEIGHT = 2.6  # inch, of the panels
WINDOW = 0.1  # s, over which heights are averaged
TITLES: Mapping[str, str] = {SHAPE: "shape change", INTERNAL: r"internal oscillation, $\theta$ = 10°"}
COLOURS: Mapping[str, str] = {"code": figures.ORANGE, "text": figures.BLUE}
STYLES: Mapping[str, str] = {"chrono": "-", "links": "--"}
NAMES: Mapping[str, str] = {"chrono": "Chrono", "links": "links"}


def draw(path: Path, folder: Path, cases: Sequence[Case]) -> list[Path]:
    """Draw and write; a line per run.

    Args:
        path: without suffix.
        folder: of the run directories.
        cases: those that are done.

    Returns:
        The files written.
    """
    shown = [case for case in cases if case.activity in FIRST and case.engine in STYLES]
    with figures.style():
        figure = figures.blank_figure(2 * figures.COLUMN_WIDTH, HEIGHT)
        panels = figure.subplots(1, len(FIRST), sharey=True)
        for axes, activity in zip(panels, FIRST, strict=True):
            for case in (case for case in shown if case.activity == activity):
                height, time = height_history(read_run(folder / case.name))
                axes.plot(
                    *smooth(time, height), STYLES[case.engine], color=COLOURS[case.rules], linewidth=0.9, alpha=0.85
                )
            axes.set(title=TITLES[activity], xlabel="time since the activity began [s]")
            axes.axhline(1.0, color=figures.GREY, linewidth=0.5, zorder=0)
        panels[0].set_ylabel("height of the centre of mass\nover that before $h/h_0$ [-]")
        for engine in STYLES:
            for rules in RULES:
                label = f"{NAMES[engine]}, by the {rules}"
                panels[0].plot([], [], STYLES[engine], color=COLOURS[rules], label=label)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
        figures.add_footer(figure, footer(shown))
        return figures.save(figure, path, formats=("png",))


def footer(cases: Sequence[Case]) -> list[str]:
    """Which runs: how many of each kind."""
    counts = [
        f"{NAMES[engine]}, {activity}, by the {rules}: n = "
        f"{sum((case.engine, case.activity, case.rules) == (engine, activity, rules) for case in cases)}"
        for activity in FIRST
        for engine in STYLES
        for rules in RULES
    ]
    number = cases[0].count if cases else 0
    return [f"N = {number}, l/w = 0.7; a line per pile, means over {WINDOW:g} s", "; ".join(counts)]


def smooth(time: Array, height: Array) -> tuple[Array, Array]:
    """Means over `WINDOW`, and the times of their middles [s]."""
    samples = max(round(WINDOW / float(np.median(np.diff(time)))), 1)
    kernel = np.full(samples, 1 / samples)
    return np.convolve(time, kernel, mode="valid"), np.convolve(height, kernel, mode="valid")
