"""The figures of the study `gravish`; see `postprocess.gravish` for what they show."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dem.errors import InputError
from postprocess import figures
from postprocess.manifest import RunManifest
from postprocess.series import read_series

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

_ASPECT = "aspect ratio [-]"
_SERIES = "packing_fraction"
_LEAST_BIN = 0.1  # s: three periods of shaking at 30 Hz
_BINS = 100
_SHIFT = 0.005  # in l/w, to keep error bars apart


def draw(
    output: Path,
    *,
    summary: pd.DataFrame,
    reference: pd.DataFrame,
    manifests: Sequence[RunManifest],
    definition: str,
    reading_error: float,
    footer: Sequence[str],
) -> list[Path]:
    """Draws and writes all figures.

    Args:
        output: Folder.
        summary: See `gravish_answers.summarise_runs`.
        reference: See `gravish_reference.read_reference`.
        manifests: The runs behind the summary.
        definition: Of the packing fraction that is compared.
        reading_error: Of the reference's points [-].
        footer: Origin, one statement each.

    Returns:
        The files written.
    """
    with figures.style():
        return [
            *_draw_packing(
                output / "phi",
                summary,
                reference,
                footer,
                definition=definition,
                reading_error=reading_error,
            ),
            *_draw_crossings(output / "crossings", summary, footer),
            *_draw_history(output / "phi_time", manifests, footer),
        ]


def _draw_packing(
    path: Path,
    summary: pd.DataFrame,
    reference: pd.DataFrame,
    footer: Sequence[str],
    *,
    definition: str,
    reading_error: float,
) -> list[Path]:
    figure, axes = figures.new_figure(height=2.7)
    for column, face, label in (
        ("phi_initial", "white", r"experiment, $\phi_0$ before shaking"),
        ("phi_final", figures.ORANGE, r"experiment, $\phi_\mathrm{f}$ after shaking"),
    ):
        axes.errorbar(
            reference["l_over_w"],
            reference[column],
            yerr=reading_error,
            **_marker("o", figures.ORANGE, face),
            markersize=5.5,
            linestyle="none",
            label=label,
        )
    blue, sky = figures.BLUE, figures.SKY
    for stage, shape, colour, face, label in (
        ("phi_0", "D", blue, "white", r"simulation, $\phi_0$ before shaking"),
        ("phi_f relaxed", "^", sky, sky, r"simulation, $\phi_\mathrm{f}$ at rest again"),
        ("phi_f", "D", blue, blue, r"simulation, $\phi_\mathrm{f}$ at the end of shaking"),
    ):
        _draw_means(axes, summary, f"{stage} {definition}", _marker(shape, colour, face), label)
    axes.set_xlabel(r"aspect ratio $l/w$ [-]")
    axes.set_ylabel(r"packing fraction $\phi$ [-]")
    axes.set_ylim(bottom=0)
    axes.legend(loc="upper right")
    return _finished(figure, path, footer)


def _draw_crossings(path: Path, summary: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    figure, axes = figures.new_figure(height=2.4)
    for quantity, face, label, shift in (
        ("crossings before", "white", "before shaking", -_SHIFT),
        ("crossings after", figures.BLUE, "at the end of shaking", _SHIFT),
    ):
        marker = _marker("D", figures.BLUE, face)
        _draw_means(axes, summary, quantity, marker, label, shift=shift)
    axes.set_xlabel(r"aspect ratio $l/w$ [-]")
    axes.set_ylabel(r"links through a plane $\langle N\rangle$ [-]")
    axes.set_ylim(bottom=0)
    axes.legend(loc="best")
    return _finished(figure, path, ["Points are set apart sideways by 0.01 in l/w.", *footer])


def _draw_history(path: Path, manifests: Sequence[RunManifest], footer: Sequence[str]) -> list[Path]:
    figure, axes = figures.new_figure(height=2.7)
    histories: dict[float, list[_History]] = {}
    without, ends = [], [0.0]
    for run in manifests:
        try:
            history = _history(run)
        except InputError:
            without.append(run.directory.name)
        else:
            histories.setdefault(round(run.aspect_ratio, 6), []).append(history)
            ends.append(history.shaken)
    width = max(max(ends) / _BINS, _LEAST_BIN)
    decimals = 1 if all(round(ratio, 1) == ratio for ratio in histories) else 2
    colours = figures.sequence(len(histories), last=0.9)
    for (ratio, seeds), colour in zip(sorted(histories.items()), colours, strict=True):
        centres, means = _binned(seeds, width)
        axes.plot(centres, means.mean(axis=0), color=colour, label=f"{ratio:.{decimals}f}")
        if len(means) > 1:
            low, high = means.min(axis=0), means.max(axis=0)
            axes.fill_between(centres, low, high, color=colour, alpha=0.25, linewidth=0)
    for time in sorted(set(ends)):
        axes.axvline(time, color=figures.GREY, linewidth=0.6, linestyle=(0, (4, 3)))
    axes.set_xlabel("time since shaking began [s]")
    axes.set_ylabel(r"packing fraction $\phi$ [-]")
    if histories:
        axes.legend(title=r"$l/w$", loc="center left", bbox_to_anchor=(1.0, 0.5))
    told = [
        f"Line: mean over seeds of means over {width:.2g} s; band: lowest to highest seed. "
        "Shaking begins and ends at the broken lines."
    ]
    if without:
        told.append(f"No time series of φ: {', '.join(without)}.")
    return _finished(figure, path, [*told, *footer])


@dataclass(frozen=True, kw_only=True, eq=False)
class _History:
    """φ of one run from the phase before shaking to the end.

    Attributes:
        times: (n,) since shaking began [s].
        values: (n,) φ [-].
        shaken: Time at which shaking ended [s].
    """

    times: NDArray[np.float64]
    values: NDArray[np.float64]
    shaken: float


def _history(run: RunManifest) -> _History:
    """Reads one run's history.

    Raises:
        InputError: There is none.
    """
    series = read_series(run.directory)
    shakes = [phase for phase in run.phases if phase.type == "shake"]
    start, end = shakes[0].start, shakes[-1].end
    values = np.asarray(series[_SERIES], dtype=np.float64)
    shown = (series["phase"] >= shakes[0].index - 1) & np.isfinite(values)
    if start is None or end is None or not shown.any():
        msg = f"{run.directory}: no packing fraction was recorded while shaking"
        raise InputError(msg)
    return _History(times=series.time[shown] - start, values=values[shown], shaken=end - start)


def _binned(histories: Sequence[_History], width: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Means over equal intervals of time: centres (n,) [s] and values (seeds, n).

    No interval reaches across the beginning of shaking; those that lack a sample of any seed are
    left out.
    """
    first = math.floor(min(history.times[0] for history in histories) / width)
    last = math.ceil(max(history.times[-1] for history in histories) / width)
    count = max(last - first, 1)
    rows = []
    for history in histories:
        # A sample at the very end belongs to the last interval.
        place = np.clip(np.floor(history.times / width).astype(int) - first, 0, count - 1)
        samples = np.bincount(place, minlength=count)
        sums = np.bincount(place, history.values, count)
        rows.append(np.where(samples > 0, sums / np.maximum(samples, 1), np.nan))
    means = np.array(rows)
    whole = np.isfinite(means).all(axis=0)
    return (first + np.arange(count) + 0.5)[whole] * width, means[:, whole]


def _draw_means(
    axes: Axes,
    summary: pd.DataFrame,
    quantity: str,
    marker: Mapping[str, Any],
    label: str,
    *,
    shift: float = 0.0,
) -> None:
    """Means over seeds with their error bars; a mean over one seed has none."""
    if f"{quantity} [-]" not in summary.columns:
        return
    axes.errorbar(
        summary[_ASPECT] + shift,
        summary[f"{quantity} [-]"],
        yerr=summary[f"{quantity} 95 % [-]"].to_numpy(),
        **marker,
        markersize=3.4,
        linewidth=0.7,
        label=label,
    )


def _marker(shape: str, colour: str, face: str) -> dict[str, Any]:
    return {
        "marker": shape,
        "color": colour,
        "markerfacecolor": face,
        "markeredgewidth": 0.9,
        "elinewidth": 0.8,
        "capthick": 0.8,
    }


def _finished(figure: Any, path: Path, footer: Sequence[str]) -> list[Path]:
    figures.add_footer(figure, footer)
    return figures.save(figure, path)
