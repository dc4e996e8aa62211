"""One energy, read in two ways: integrated over every step, and summed over torque and angle 0.1 s apart.

The paper's code knew torque and angle together every 0.1 s alone. Barbs of one l/w swing at one frequency and meet such
samples at one phase, so that the sums of the internal oscillation tell the phase: bumps over l/w that the integral does
not have.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from postprocess.measures.motors import APART
from postprocess.report import figures
from postprocess.statistics.columns import ASPECT
from postprocess.statistics.points import marked
from studies.base.activity import ENERGY, SAMPLED
from studies.base.engines import judging
from studies.base.figures import ASPECT_LABEL, draw_means, finished, procedure_marker
from studies.base.procedures import of_procedure
from studies.procedures.energies import PEAK

if TYPE_CHECKING:
    import pandas as pd

READINGS: Mapping[str, str] = MappingProxyType(
    {ENERGY: "integrated over every step", SAMPLED: f"summed over samples {APART:g} s apart"}
)


def draw_readings(path: Path, points: pd.DataFrame, labels: Mapping[str, str], footer: Sequence[str]) -> list[Path]:
    """Energy per smarticle against l/w, a panel for each reading.

    Args:
        path: Without suffix.
        points: See `base.procedures.points`.
        labels: For the legend, of each procedure that is drawn.
        footer: Origin, one statement each.

    Returns:
        The files written; none where energies were not sampled.
    """
    known = judging(points[points[SAMPLED].notna()])
    if known.empty:
        return []
    figure = figures.blank_figure(2 * figures.COLUMN_WIDTH, 2.7)
    panels = figure.subplots(1, len(READINGS), sharex=True, sharey=True)
    for axes, (quantity, title) in zip(panels, READINGS.items(), strict=True):
        axes.axvline(PEAK, color=figures.GREY, linewidth=0.6, linestyle=(0, (2, 2)))
        axes.axhline(0.0, color=figures.GREY, linewidth=0.6)
        for name, label in labels.items():
            part = of_procedure(known, name).sort_values(ASPECT)
            errors = 1e6 * part[marked(quantity, "95 %")].to_numpy()
            draw_means(axes, part[ASPECT], 1e6 * part[quantity], errors, look=procedure_marker(name), label=label)
        axes.set_title(title)
        axes.set_xlabel(ASPECT_LABEL)
    panels[0].set_ylabel("energy per smarticle [µJ]")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=2)
    told = f"Broken line: l/w = {PEAK:g}, where the paper's energies have a local maximum."
    return finished(figure, path, [told], footer)
