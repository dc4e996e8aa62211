"""The figure of the study `compaction`: φ against time with the two laws, and what they leave."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from postprocess.report import figures
from studies.framework.plots import BAND, finished
from studies.framework.provenance import SHAKE_TIME
from studies.framework.runs import MeasuredRun
from studies.friction.laws import LOGARITHMIC, STRETCHED, fit, spread_out
from studies.friction.measure import FRICTION, while_shaken

_LINES = {STRETCHED: "solid", LOGARITHMIC: (0, (4, 2))}
_PHI, _TIME = r"packing fraction $\phi$ [-]", "time since shaking began [s]"


def draw(output: Path, *, runs: Sequence[MeasuredRun], footer: Sequence[str]) -> list[Path]:
    """Draws and writes the figure.

    Args:
        output: Folder.
        runs: Rows of `measure.friction_run`, with their histories.
        footer: Origin, one statement each.

    Returns:
        The files written.
    """
    frictions = sorted({float(str(run.row[FRICTION])) for run in runs})
    with figures.style():
        figure = figures.blank_figure(6.4, 2.9)
        left, right = figure.subplots(1, 2)
        for friction, colour in zip(frictions, (figures.BLUE, figures.ORANGE, figures.GREEN), strict=False):
            piles = [spread_out(*while_shaken(run)) for run in runs if run.row[FRICTION] == friction]
            times, values = piles[0][0], np.stack([packing for _, packing in piles])
            mean = values.mean(axis=0)
            if len(values) > 1:
                left.fill_between(times, values.min(axis=0), values.max(axis=0), color=colour, alpha=0.2, linewidth=0)
            left.plot(times, mean, "o", color=colour, markersize=2.2, label=rf"$\mu = {friction:g}$")
            for law, line in _LINES.items():
                found = fit(law, times, mean)
                left.plot(times, found.at(times), color=colour, linestyle=line, linewidth=0.9)
                right.plot(times, 1e3 * (mean - found.at(times)), color=colour, linestyle=line, linewidth=0.9)
        for law, line in _LINES.items():
            left.plot([], [], color=figures.GREY, linestyle=line, linewidth=0.9, label=law)
        left.axvline(SHAKE_TIME, color=figures.GREY, linewidth=0.6, linestyle=":")
        right.axhline(0.0, color=figures.GREY, linewidth=0.6)
        left.set_ylabel(_PHI)
        right.set_ylabel(r"$\phi$ less the law [$10^{-3}$]")
        for axes in (left, right):
            axes.set_xscale("log")
            axes.set_xlabel(_TIME)
        figure.legend(*left.get_legend_handles_labels(), loc="outside upper center", ncols=4)
        told = f"Points: mean over seeds, {BAND}; lines: laws fitted to it; dotted: Gravish's {SHAKE_TIME:g} s."
        return finished(figure, output / "phi_time", [told], footer)
