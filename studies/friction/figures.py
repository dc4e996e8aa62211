"""The figures of the study `friction`: φ against friction, its deviation from Gravish's, and φ against time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from postprocess.report import figures
from postprocess.statistics.columns import ASPECT
from postprocess.statistics.points import marked
from studies.framework.plots import BAND, History, binned, draw_means, finished, marker
from studies.framework.provenance import DIGITISING_ERROR, SHAKE_TIME, read_reference, reference_at, told_reference
from studies.framework.runs import MeasuredRun
from studies.framework.shaken import STAGES
from studies.friction.measure import FRICTION, WINDOW, history_of
from studies.friction.steel import AS_IT_COMES, CLEANED, spanned
from studies.friction.tables import DEVIATION, MARGIN, PHI, REFERENCE, STAGE

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_FRICTION_LABEL, _PHI_LABEL = r"coefficient of friction $\mu$ [-]", r"packing fraction $\phi$ [-]"
_PANEL, _HEIGHT = 2.05, 2.75  # inch
_SYMBOLS = {"phi_0": r"$\phi_0$", "phi_f": r"$\phi_\mathrm{f}$", "phi_f relaxed": r"$\phi_\mathrm{f}$"}
_LOOKS = {
    "phi_0": ("D", figures.BLUE, "white"),
    "phi_f relaxed": ("^", figures.SKY, figures.SKY),
    "phi_f": ("D", figures.BLUE, figures.BLUE),
}
_SHAPES = ("D", "s", "^", "o", "v", "P", "X", "<")
_BESIDE = 0.006  # of friction, to keep error bars apart


def draw(
    output: Path,
    *,
    points: pd.DataFrame,
    crossings: pd.DataFrame,
    runs: Sequence[MeasuredRun],
    footer: Sequence[str],
) -> list[Path]:
    """Draws and writes all figures.

    Args:
        output: Folder.
        points: See `tables.points`.
        crossings: See `tables.crossings`.
        runs: The runs behind them, rows of `measure.friction_run`.
        footer: Origin, one statement each.

    Returns:
        The files written.
    """
    with figures.style():
        return [
            *_draw_packing(output / "phi_friction", points, crossings, footer),
            *_draw_deviation(output / "deviation_friction", points, footer),
            *_draw_history(output / "phi_time", runs, footer),
        ]


def _draw_packing(path: Path, points: pd.DataFrame, crossings: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    ratios = sorted(points[ASPECT].unique())
    figure, panels = _panels(len(ratios))
    for axes, ratio in zip(panels, ratios, strict=True):
        here = points[points[ASPECT] == ratio]
        for stage, (shape, colour, face) in _LOOKS.items():
            part = here[here[STAGE] == stage]
            if len(part):
                look = {**marker(shape, colour, face), "linestyle": "-"}
                label = f"{_SYMBOLS[stage]} {STAGES[stage].replace(' that follows shaking', '')}"
                draw_means(axes, part[FRICTION], part[PHI], part[marked(PHI, "95 %")], look=look, label=label)
        for stage, style in (("phi_0", (0, (4, 2))), ("phi_f", "solid")):
            value = reference_at(read_reference(), ratio, stage)
            if np.isfinite(value):
                axes.axhspan(
                    value - DIGITISING_ERROR, value + DIGITISING_ERROR, color=figures.ORANGE, alpha=0.18, linewidth=0
                )
                label = f"Gravish, {_SYMBOLS[stage]}"
                axes.axhline(value, color=figures.ORANGE, linewidth=0.9, linestyle=style, label=label)
        _draw_crossings(axes, crossings[crossings[ASPECT] == ratio] if len(crossings) else crossings)
        axes.set_title(_told(ratio), fontsize=8)
        axes.set_xlabel(_FRICTION_LABEL)
    panels[0].set_ylabel(_PHI_LABEL)
    panels[0].set_ylim(bottom=0)
    _legend(figure, panels)
    told = "Crosses: friction at which φ is Gravish's, with its 95 % interval as far as it was measured."
    return finished(figure, path, [told, told_reference(ratios, ("phi_0", "phi_f"))], footer, pooled=True)


def _draw_crossings(axes: Axes, crossings: pd.DataFrame) -> None:
    """Crosses where φ before and at the end of shaking is Gravish's."""
    for _, row in crossings.iterrows():
        if row[STAGE] in ("phi_0", "phi_f") and np.isfinite(row[FRICTION]):
            ends = np.clip([row["from [-]"], row["to [-]"]], row["measured from [-]"], row["measured to [-]"])
            axes.plot(ends, [row[REFERENCE]] * 2, color=figures.BLACK, linewidth=0.8, zorder=4)
            axes.plot(row[FRICTION], row[REFERENCE], marker="x", color=figures.BLACK, markersize=4.5, zorder=5)


def _draw_deviation(path: Path, points: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    known = points[points[REFERENCE].notna()]
    ratios = sorted(points[ASPECT].unique())
    colours = dict(zip(ratios, figures.sequence(len(ratios), last=0.75), strict=True))
    shapes = dict(zip(ratios, _SHAPES, strict=False))
    figure, panels = _panels(len(STAGES))
    for axes, (stage, meaning) in zip(panels, STAGES.items(), strict=True):
        axes.axhspan(-MARGIN, MARGIN, color=figures.GREY, alpha=0.15, linewidth=0, label=f"within {MARGIN:g} %")
        axes.axhline(0.0, color=figures.GREY, linewidth=0.6)
        for place, ratio in enumerate(ratios):
            part = known[(known[STAGE] == stage) & (known[ASPECT] == ratio)]
            if len(part):
                look = {**marker(shapes[ratio], colours[ratio], colours[ratio]), "linestyle": "-"}
                across = part[FRICTION] + _BESIDE * (place - (len(ratios) - 1) / 2)
                errors = part[marked(DEVIATION, "95 %")]
                draw_means(axes, across, part[DEVIATION], errors, look=look, label=_told(ratio))
        axes.set_title(f"{_SYMBOLS[stage]} {meaning.replace(' that follows shaking', '')}", fontsize=8)
        axes.set_xlabel(_FRICTION_LABEL)
        _draw_steel(axes)
    panels[0].set_ylabel("deviation from Gravish [%]")
    _legend(figure, panels)
    steel = (
        "Green above the axis: published static coefficients of dry steel on steel, as it comes (line) and clean "
        f"(thick). Set apart sideways by {_BESIDE:g}; error bars have that of reading Gravish's points in them."
    )
    told = [steel, told_reference(ratios, ("phi_0", "phi_f"))]
    return finished(figure, path, told, footer, pooled=True)


def _draw_steel(axes: Axes) -> None:
    """Published coefficients of steel as bars just above the axis."""
    across = axes.get_xaxis_transform()
    for published, width in ((AS_IT_COMES, 1.4), (CLEANED, 4.0)):
        low, high = spanned(published)
        axes.plot([low, high], [0.02, 0.02], color=figures.GREEN, linewidth=width, transform=across)


def _draw_history(path: Path, runs: Sequence[MeasuredRun], footer: Sequence[str]) -> list[Path]:
    ratios = sorted({float(str(run.row[ASPECT])) for run in runs})
    frictions = sorted({float(str(run.row[FRICTION])) for run in runs})
    colours = dict(zip(frictions, figures.sequence(len(frictions), last=0.9), strict=True))
    figure, panels = _panels(len(ratios))
    for axes, ratio in zip(panels, ratios, strict=True):
        for friction in frictions:
            seeds = [history_of(run) for run in runs if run.row[ASPECT] == ratio and run.row[FRICTION] == friction]
            if seeds:
                _draw_growth(axes, seeds, colours[friction], f"{friction:g}")
        value = reference_at(read_reference(), ratio, "phi_f")
        if np.isfinite(value):
            axes.plot([SHAKE_TIME], [value], "o", color=figures.ORANGE, zorder=5)
        axes.set_xscale("log")
        axes.set_xticks([0.5, 1, 2, 5, 10, 20], labels=["0.5", "1", "2", "5", "10", "20"])
        axes.minorticks_off()
        axes.set_title(_told(ratio), fontsize=8)
        axes.set_xlabel("time since shaking began [s]")
    panels[0].set_ylabel(_PHI_LABEL)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, title=r"$\mu$", loc="outside right center")
    told = f"Line: mean over seeds of means over {WINDOW:g} s; {BAND}. Circle: φ_f of Gravish after {SHAKE_TIME:g} s."
    return finished(figure, path, [told, told_reference(ratios, ("phi_f",))], footer)


def _draw_growth(axes: Axes, seeds: Sequence[History], colour: str, label: str) -> None:
    """The mean over seeds while they are shaken, from the lowest to the highest as a band."""
    centres, means = binned(seeds, WINDOW)
    shaken = (centres > 0) & (centres < min(history.active for history in seeds))
    axes.plot(centres[shaken], means[:, shaken].mean(axis=0), color=colour, label=label)
    if len(means) > 1:
        low, high = means[:, shaken].min(axis=0), means[:, shaken].max(axis=0)
        axes.fill_between(centres[shaken], low, high, color=colour, alpha=0.2, linewidth=0)


def _told(ratio: float) -> str:
    return f"$l/w = {ratio:.{1 if round(ratio, 1) == ratio else 2}f}$"


def _panels(count: int) -> tuple[Figure, Sequence[Axes]]:
    """Panels side by side with one vertical axis."""
    figure = figures.blank_figure(max(_PANEL * count + 0.4, figures.COLUMN_WIDTH), _HEIGHT)
    return figure, figure.subplots(1, count, sharey=True, squeeze=False)[0]


def _legend(figure: Figure, panels: Sequence[Axes]) -> None:
    """One legend of all panels above them: not every panel has everything."""
    shown = {label: handle for axes in panels for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    figure.legend(
        list(shown.values()),
        list(shown),
        loc="outside upper center",
        ncols=4 if len(shown) == 4 else min(len(panels) + 1, 3),
    )
