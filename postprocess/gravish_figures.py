"""The figures of the study `gravish`; see `postprocess.gravish` for what they show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
        summary: See `gravish.summarise_runs`.
        reference: See `gravish.read_reference`.
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
            linestyle="none",
            label=label,
        )
    for stage, face, label in (
        ("phi_0", "white", r"simulation, $\phi_0$"),
        ("phi_f", figures.BLUE, r"simulation, $\phi_\mathrm{f}$"),
    ):
        _draw_means(axes, summary, f"{stage} {definition}", _marker("s", figures.BLUE, face), label)
    axes.set_xlabel(r"aspect ratio $l/w$ [-]")
    axes.set_ylabel(r"packing fraction $\phi$ [-]")
    axes.set_ylim(bottom=0)
    axes.legend(loc="upper right")
    return _finished(figure, path, footer)


def _draw_crossings(path: Path, summary: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    figure, axes = figures.new_figure(height=2.4)
    for quantity, face, label in (
        ("crossings before", "white", "before shaking"),
        ("crossings after", figures.BLUE, "at the end of shaking"),
    ):
        _draw_means(axes, summary, quantity, _marker("s", figures.BLUE, face), label)
    axes.set_xlabel(r"aspect ratio $l/w$ [-]")
    axes.set_ylabel(r"links through a plane $\langle N\rangle$ [-]")
    axes.set_ylim(bottom=0)
    axes.legend(loc="best")
    return _finished(figure, path, footer)


def _draw_history(path: Path, manifests: Sequence[RunManifest], footer: Sequence[str]) -> list[Path]:
    figure, axes = figures.new_figure(height=2.7)
    ratios = sorted({round(run.aspect_ratio, 6) for run in manifests})
    without: list[str] = []
    width = 0.0
    for ratio, colour in zip(ratios, figures.sequence(len(ratios), last=0.9), strict=True):
        runs = [run for run in manifests if round(run.aspect_ratio, 6) == ratio]
        histories = []
        for run in runs:
            try:
                histories.append(_history(run))
            except InputError:
                without.append(run.directory.name)
        if not histories:
            continue
        start = max(times[0] for times, _ in histories)
        end = min(times[-1] for times, _ in histories)
        width = max(width, (end - max(start, 0.0)) / _BINS, _LEAST_BIN)
        centres, means = _binned(histories, start, end, max((end - start) / _BINS, _LEAST_BIN))
        axes.plot(centres, means.mean(axis=0), color=colour, label=f"{ratio:g}")
        if len(means) > 1:
            axes.fill_between(
                centres,
                means.min(axis=0),
                means.max(axis=0),
                color=colour,
                alpha=0.25,
                linewidth=0,
            )
    axes.axvline(0, color=figures.GREY, linewidth=0.6, linestyle=(0, (4, 3)))
    axes.set_xlabel("time since shaking began [s]")
    axes.set_ylabel(r"packing fraction $\phi$ [-]")
    axes.set_ylim(bottom=0)
    if axes.lines[:-1]:
        axes.legend(title=r"$l/w$", loc="center left", bbox_to_anchor=(1.0, 0.5))
    told = [f"Line: mean over seeds of means over {width:.2g} s; band: lowest to highest seed."]
    if without:
        told.append(f"No time series of φ: {', '.join(without)}.")
    return _finished(figure, path, [*told, *footer])


def _history(run: RunManifest) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Time since shaking began [s] and φ, from the phase before shaking to its end."""
    series = read_series(run.directory)
    shakes = [phase.index for phase in run.phases if phase.type == "shake"]
    phase, phi = series["phase"], np.asarray(series[_SERIES], dtype=np.float64)
    shown = (phase >= shakes[0] - 1) & (phase <= shakes[-1]) & np.isfinite(phi)
    origin = run.phases[shakes[0]].start
    if origin is None or not shown.any():
        msg = f"{run.directory}: no packing fraction was recorded while shaking"
        raise InputError(msg)
    return series.time[shown] - origin, phi[shown]


def _binned(
    histories: Sequence[tuple[NDArray[np.float64], NDArray[np.float64]]],
    start: float,
    end: float,
    width: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Means over equal intervals of time: centres (n,) [s] and values (seeds, n).

    No interval reaches across the beginning of shaking; those that lack a sample of any seed are
    left out.
    """
    before = -np.arange(0, -min(start, 0.0) + width / 2, width)[::-1]
    edges = np.concatenate([before[:-1], np.arange(0, end + width / 2, width)])
    rows = []
    for times, values in histories:
        place = np.digitize(times, edges) - 1
        inside = (place >= 0) & (place < len(edges) - 1)
        sums = np.bincount(place[inside], values[inside], len(edges) - 1)
        counts = np.bincount(place[inside], minlength=len(edges) - 1)
        rows.append(np.where(counts > 0, sums / np.maximum(counts, 1), np.nan))
    means = np.array(rows)
    whole = np.isfinite(means).all(axis=0)
    return ((edges[:-1] + edges[1:]) / 2)[whole], means[:, whole]


def _draw_means(axes: Axes, summary: pd.DataFrame, quantity: str, marker: Mapping[str, Any], label: str) -> None:
    """Means over seeds with their error bars; a mean over one seed has none."""
    if f"{quantity} [-]" not in summary.columns:
        return
    axes.errorbar(
        summary[_ASPECT],
        summary[f"{quantity} [-]"],
        yerr=summary[f"{quantity} 95 % [-]"].to_numpy(),
        **marker,
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
