"""Figures: errors against the time step, flat impacts against the number of spheres, where stable steps end."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from postprocess.report import figures
from postprocess.report.limits import hold_everything
from smarticles.verification.hard.onset import onsets
from studies.framework.plots import finished

if TYPE_CHECKING:
    from matplotlib.axis import Axis
    from numpy.typing import NDArray

_WIDTH, _HEIGHT = 2 * figures.COLUMN_WIDTH, 3.5
_LOOKS = (
    ("o", figures.BLUE),
    ("s", figures.ORANGE),
    ("^", figures.BLACK),
    ("v", figures.SKY),
    ("D", figures.GREY),
    ("P", figures.BLUE),
)
_ORDINALS = {1: "first", 2: "second"}
USED = 0.9  # fraction of the stable step that the named fidelities use
MOST = 4.0  # factor by which blow-up is to begin


def _plain_ticks(axis: Axis, values: NDArray[np.float64]) -> None:
    """Ticks 1, 2, 5, 10, … of a logarithmic axis about the values, written out."""
    low, high = 0.8 * values.min(), 1.25 * values.max()
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    ticks = [m * 10.0**decade for decade in decades for m in (1, 2, 5) if low <= m * 10.0**decade <= high]
    axis.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.set_ticks([], minor=True)


def draw_orders(path: Path, *, trajectories: pd.DataFrame, orders: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    """Errors over the size of the motion against the time step, one panel per order of the scheme.

    Args:
        path: Without suffix.
        trajectories: One row per ladder and time step.
        orders: See `verification.order_table`.
        footer: Origin, one statement each.

    Returns:
        The files written.
    """
    schemes = sorted(set(orders["order of the scheme [1]"]))
    with figures.style():
        figure = figures.blank_figure(_WIDTH, _HEIGHT)
        for axes, scheme in zip(np.atleast_1d(figure.subplots(1, len(schemes))), schemes, strict=True):
            of_scheme = orders[orders["order of the scheme [1]"] == scheme]
            lowest = np.inf
            for (shape, colour), row in zip(_LOOKS, of_scheme.to_dict("records"), strict=False):
                own = trajectories[trajectories["ladder"] == row["ladder"]]
                error = own["error [unit]"] / own["size of the motion [unit]"]
                lowest = min(lowest, float(error.min()))
                axes.loglog(
                    own["time step [s]"] * 1e6,
                    error,
                    marker=shape,
                    color=colour,
                    linewidth=0.8,
                    label=f"{row['ladder']}: {row['order observed [1]']:.2f}",
                )
            steps = trajectories["time step [s]"][trajectories["ladder"].isin(of_scheme["ladder"])].to_numpy() * 1e6
            ends = np.array([steps.min(), steps.max()])
            axes.loglog(
                ends,
                0.4 * lowest * (ends / ends[0]) ** scheme,
                color=figures.GREY,
                linestyle=(0, (4, 3)),
                linewidth=0.8,
                label=f"slope {scheme}",
            )
            axes.set_xlabel("time step [µs]")
            axes.set_ylabel("error over the size of the motion [1]")
            _plain_ticks(axes.xaxis, ends)
            order = _ORDINALS.get(scheme, str(scheme))
            axes.legend(
                loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, title=f"scheme of {order} order: observed order"
            )
        return finished(figure, path, (), footer)


def draw_clumps(path: Path, *, clumps: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    """Restitution, contact time and depth of flat impacts against the number of contacts.

    Args:
        path: Without suffix.
        clumps: One row per sphere chain.
        footer: Origin, one statement each.

    Returns:
        The files written.
    """
    table = clumps.sort_values("contacts [1]")
    contacts = table["contacts [1]"]
    panels = (
        ("restitution, n in parallel and tilt [1]", "restitution measured [1]", 1.0, "restitution of a flat fall [1]"),
        ("contact time, theory [s]", "contact time measured [s]", 1e6, "time in contact [µs]"),
        ("depth at rest, theory [m]", "depth at rest measured [m]", 1e9, "depth under its own weight [nm]"),
    )
    with figures.style():
        figure = figures.blank_figure(_WIDTH, _HEIGHT - 0.9)
        for axes, (theory, measured, unit, label) in zip(figure.subplots(1, len(panels)), panels, strict=True):
            axes.plot(contacts, table[theory] * unit, color=figures.GREY, linewidth=0.8, label="theory: n in parallel")
            looks = dict(enumerate(_LOOKS, start=1))
            for rows in sorted(set(table["rows [1]"])):
                shape, colour = looks[int(rows)]
                part = table[table["rows [1]"] == rows]
                pitches = part["pitch [1]"]
                chain = f", pitch {pitches.max():g} … {pitches.min():g}" if pitches.any() else ""
                name = f"{rows} row{'s' if rows > 1 else ''}{chain}"
                axes.plot(
                    part["contacts [1]"],
                    part[measured] * unit,
                    linestyle="none",
                    marker=shape,
                    color=colour,
                    label=name,
                )
            axes.set_xscale("log")
            axes.set_xlabel("contacts with the floor, n [1]")
            axes.set_ylabel(label)
            _plain_ticks(axes.xaxis, contacts.to_numpy())
            if unit == 1.0:
                look = {"marker": "x", "color": figures.BLACK, "linestyle": "none", "markersize": 3.0}
                coarse = table["restitution at the scene's time step [1]"]
                axes.plot(contacts, coarse, **look, label="at a scene's step")
                asked = float(table["restitution asked for [1]"].iloc[0])
                axes.axhline(asked, color=figures.BLACK, linewidth=0.8, linestyle=(0, (4, 3)), label="asked for")
                axes.set_ylim(0, 1)
                figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=5)
            else:
                axes.set_yscale("log")
                _plain_ticks(axes.yaxis, table[measured].to_numpy() * unit)
        return finished(figure, path, (), footer)


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
            (USED, ":", "step used, 0.9"),
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
        hidden = hold_everything(figure)
        figures.add_footer(
            figure,
            [
                *hidden,
                "Bars: from the last step without to the first step with, over all seeds. Chatter: smarticles that "
                "rest at half the stable step move at more than 1 mm/s (root mean square); scenes that are not at rest "
                "then tell nothing of it. Blow-up: energy from nowhere that could lift all smarticles by a sphere's "
                "diameter.",
                f"{len(runs)} runs, seeds {', '.join(map(str, seeds))}; commits "
                f"{', '.join(sorted(set(runs['commit'])))}. Command: make stability.",
            ],
        )
        return figures.save(figure, out / "onset", formats=("png",))[0]
