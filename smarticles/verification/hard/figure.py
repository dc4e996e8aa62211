"""The figure of the stable step: from which factor on scenes chatter and blow up."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd

from postprocess.report import figures
from smarticles.verification.hard.onset import onsets

WATCHED = 0.9  # fraction of the stable step that the named fidelities use
MOST = 4.0  # factor by which blow-up is to begin


def draw_onset(out: Path) -> Path:
    """Work out the onsets from all runs in a folder, `onset.csv`, and draw them.

    Returns:
        The figure.
    """
    runs = pd.read_csv(out / "onset_runs.csv")
    table = onsets(runs)
    table.to_csv(out / "onset.csv", index=False, float_format="%.4g")
    factors = np.sort(runs["factor [1]"].unique())
    with figures.style():
        figure, axes = figures.new_figure(width=2 * figures.COLUMN_WIDTH, height=0.5 + 0.2 * len(table))
        axes.grid(visible=False, axis="y")
        for factor, style, label in (
            (WATCHED, ":", "step used, 0.9"),
            (1.0, "-", "stable step of the estimate, 1"),
            (MOST, "--", "blow-up is to begin by 4"),
        ):
            axes.axvline(factor, color=figures.GREY, linestyle=style, linewidth=0.8, label=label)
        marks = (("chatter", figures.SKY, "o", 0.16), ("blow-up", figures.ORANGE, "s", -0.16))
        for what, colour, marker, shift in marks:
            places, middles, errors = [], [], []
            for place, row in table.iterrows():
                least, most = row[f"{what} from, least [1]"], row[f"{what} from, most [1]"]
                if not math.isfinite(least):
                    continue
                # Between the last step without and the first with, and over the seeds.
                below = factors[factors < least].max(initial=0.45)
                most = min(most, factors.max())
                places.append(len(table) - 1 - place + shift)
                middles.append(math.sqrt(below * most))
                errors.append((middles[-1] - below, most - middles[-1]))
            bars, label = np.array(errors).T, f"{what} begins"
            axes.errorbar(middles, places, xerr=bars, fmt=marker, color=colour, markersize=3.5, label=label)
        axes.set_yticks(range(len(table)), labels=table["scene"][::-1])
        axes.set_xscale("log")
        axes.set_xticks([0.5, 0.7, 1, 1.5, 2, 3, 4], labels=["0.5", "0.7", "1", "1.5", "2", "3", "4"])
        axes.minorticks_off()
        axes.set_xlim(0.7, 4.6)
        axes.set_xlabel("time step over the stable step [1]")
        figure.legend(loc="outside upper center", ncols=3)
        seeds = sorted(runs["seed"].unique())
        figures.add_footer(
            figure,
            [
                "Bars: from the last step without to the first step with, over all seeds. Chatter: smarticles that "
                "rest at half the stable step move at more than 1 mm/s (root mean square); scenes that are not at rest "
                "then tell nothing of it. Blow-up: energy from nowhere that could lift all smarticles by a sphere's "
                "diameter.",
                f"{len(runs)} runs, seeds {', '.join(map(str, seeds))}; commits "
                f"{', '.join(sorted(set(runs['commit'])))}. Command: python -m stability onset, then figure.",
            ],
        )
        return figures.save(figure, out / "onset", formats=("png",))[0]
