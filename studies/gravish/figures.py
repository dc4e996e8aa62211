"""The figures of the study `gravish`; see `studies.gravish.study` for what they show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dem.errors import InputError
from dem.record.manifest import RunManifest
from postprocess.report import figures
from studies.framework.engines import TOLD, engines_of, judging, of_engine
from studies.framework.plots import (
    ASPECT_LABEL,
    CROSSINGS_LABEL,
    History,
    bin_width,
    draw_ends,
    draw_history,
    draw_means,
    finished,
    legend_above,
    marker,
    told_histories,
)
from studies.framework.provenance import told_reference
from studies.framework.runs import ENGINES
from studies.framework.shaken import SHAKEN, packing_history

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_ASPECT = "aspect ratio [-]"
_WIDE = 1.4 * figures.COLUMN_WIDTH  # for the longer legend of two engines
_SHIFT = 0.005  # in l/w, to keep error bars apart


def draw(
    output: Path,
    *,
    summary: pd.DataFrame,
    reference: pd.DataFrame,
    manifests: Sequence[RunManifest],
    definition: str,
    footer: Sequence[str],
) -> list[Path]:
    """Draws and writes all figures.

    Args:
        output: Folder.
        summary: See `findings.summarise_runs`.
        reference: See `references.read_reference`.
        manifests: The runs behind the summary.
        definition: Of the packing fraction that is compared.
        footer: Origin, one statement each.

    Returns:
        The files written.
    """
    with figures.style():
        return [
            *_draw_packing(output / "phi", summary, reference, footer, definition=definition),
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
) -> list[Path]:
    several = engines_of(summary)
    figure, axes = figures.new_figure(width=_WIDE, height=3.4) if several else figures.new_figure(height=2.7)
    whose = TOLD.get(several[0], several[0]) if several else "simulation"
    for column, face, label in (
        ("phi_initial", "white", r"experiment, $\phi_0$ before"),
        ("phi_final", figures.ORANGE, r"experiment, $\phi_\mathrm{f}$ after"),
    ):
        # Without error bars: that of reading is less than the circles, and no error of ours.
        look = {**marker("o", figures.ORANGE, face), "markersize": 5.5, "linestyle": "none"}
        draw_means(axes, reference["l_over_w"], reference[column], None, look=look, label=label)
    blue, sky = figures.BLUE, figures.SKY
    for stage, shape, colour, face, label in (
        ("phi_0", "D", blue, "white", rf"{whose}, $\phi_0$ before"),
        ("phi_f relaxed", "^", sky, sky, rf"{whose}, $\phi_\mathrm{{f}}$ at rest again"),
        ("phi_f", "D", blue, blue, rf"{whose}, $\phi_\mathrm{{f}}$ at the end"),
    ):
        _draw_means(axes, judging(summary), f"{stage} {definition}", marker(shape, colour, face), label)
    for engine in several[1:]:
        part = of_engine(summary, engine)
        time = ", ".join(sorted({f"{value:.3g}" for value in part[SHAKEN]}, key=float))
        look = {"linestyle": "none", "markersize": 4.2}
        for stage, face, when in (
            ("phi_0", "white", r"$\phi_0$"),
            ("phi_f", figures.GREEN, rf"$\phi_\mathrm{{f}}$ after {time} s"),
        ):
            squares = {**marker("s", figures.GREEN, face), **look}
            _draw_means(axes, part, f"{stage} {definition}", squares, f"{TOLD[engine]}, {when}", shift=2 * _SHIFT)
    axes.set_xlabel(ASPECT_LABEL)
    axes.set_ylabel(r"packing fraction $\phi$ [-]")
    axes.set_ylim(bottom=0)
    legend_above(axes)
    ratios = sorted({*reference["l_over_w"].round(6), *summary[_ASPECT]})
    return finished(figure, path, [told_reference(ratios, ("phi_0", "phi_f"))], footer)


def _draw_crossings(path: Path, summary: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    figure, axes = figures.new_figure(height=2.4)
    for quantity, face, label, shift in (
        ("crossings before", "white", "before shaking", -_SHIFT),
        ("crossings after", figures.BLUE, "at the end of shaking", _SHIFT),
    ):
        _draw_means(axes, judging(summary), quantity, marker("D", figures.BLUE, face), label, shift=shift)
        for engine in engines_of(summary)[1:]:
            look = {**marker("s", figures.GREEN, "white" if face == "white" else figures.GREEN), "linestyle": "none"}
            part = of_engine(summary, engine)
            _draw_means(axes, part, quantity, look, f"{TOLD[engine]}, {label}", shift=shift + 2 * _SHIFT)
    axes.set_xlabel(ASPECT_LABEL)
    axes.set_ylabel(CROSSINGS_LABEL)
    axes.set_ylim(bottom=0)
    if engines_of(summary):
        legend_above(axes)
    else:
        axes.legend(loc="best")
    return finished(figure, path, ["Set apart sideways by 0.01 in l/w."], footer)


def _draw_history(path: Path, manifests: Sequence[RunManifest], footer: Sequence[str]) -> list[Path]:
    figure, axes = figures.new_figure(height=2.7)
    first = next((name for name in ENGINES if any(run.engine == name for run in manifests)), "")
    histories: dict[tuple[float, str], list[History]] = {}
    without, ends = [], []
    for run in manifests:
        try:
            history = packing_history(run)
        except InputError:
            without.append(run.directory.name)
        else:
            histories.setdefault((round(run.aspect_ratio, 6), run.engine), []).append(history)
            ends.append(history.active)
    width = bin_width(ends)
    ratios = sorted({ratio for ratio, _ in histories})
    decimals = 1 if all(round(ratio, 1) == ratio for ratio in ratios) else 2
    colours = dict(zip(ratios, figures.sequence(len(ratios), last=0.9), strict=True))
    for (ratio, engine), seeds in sorted(histories.items()):
        if engine == first:
            draw_history(axes, seeds, width, colour=colours[ratio], label=f"{ratio:.{decimals}f}")
        else:
            draw_history(axes, seeds, width, colour=colours[ratio], style=(0, (2, 1)))
    others = sorted({TOLD.get(engine, engine) for _, engine in histories if engine != first})
    draw_ends(axes, ends)
    axes.set_xlabel("time since shaking began [s]")
    axes.set_ylabel(r"packing fraction $\phi$ [-]")
    if histories:
        axes.legend(title=r"$l/w$", loc="center left", bbox_to_anchor=(1.0, 0.5))
    told = [told_histories(width, "Shaking")]
    if others:
        told.append(f"Dashed: {', '.join(others)}; lines without dashes: {TOLD.get(first, first)}.")
    if without:
        told.append(f"No time series of φ: {', '.join(without)}.")
    return finished(figure, path, told, footer)


def _draw_means(
    axes: Axes,
    summary: pd.DataFrame,
    quantity: str,
    shape: Mapping[str, Any],
    label: str,
    *,
    shift: float = 0.0,
) -> None:
    if f"{quantity} [-]" in summary.columns:
        values, half_widths = summary[f"{quantity} [-]"], summary[f"{quantity} 95 % [-]"].to_numpy()
        draw_means(axes, summary[_ASPECT] + shift, values, half_widths, look=shape, label=label)
