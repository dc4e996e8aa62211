"""The figures of the study `procedures`; see `studies.procedures.study` for what they show."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dem.errors import InputError
from dem.record.manifest import RunManifest
from postprocess.report import figures
from postprocess.statistics.columns import ASPECT
from postprocess.statistics.points import marked
from studies.base.activity import ENERGY, PHI_ACTIVE, height_history
from studies.base.engines import TOLD, engines_of, judging, of_engine
from studies.base.figures import (
    ASPECT_LABEL,
    COLOURS,
    CROSSINGS_LABEL,
    THETA_LABEL,
    History,
    bin_width,
    draw_ends,
    draw_history,
    draw_means,
    finished,
    legend_above,
    marker,
    procedure_marker,
    told_histories,
)
from studies.base.procedures import (
    ACTIVE,
    AMPLITUDE,
    CROSSINGS,
    EXTERNAL,
    INTERNAL,
    PROCEDURE,
    SHAPE,
    STATIC,
    THETA,
    of_procedure,
)
from studies.procedures.energy_readings import draw_readings

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_SHOWN_ASPECT = 0.7
"""Aspect ratio whose heights are drawn against time, as in the paper [-]."""

_PHI_LABEL = "packing fraction $\\phi_\\mathrm{f}$\nat the end of the activity [-]"
_ENERGY_LABEL = "energy per smarticle [J]"
_INTERNAL_LABEL = rf"internal oscillation, $\theta$ = {AMPLITUDE:g}°"
_LABELS = {
    SHAPE: "shape change",
    EXTERNAL: "external oscillation",
    INTERNAL: _INTERNAL_LABEL,
    STATIC: r"static ($\phi_0$)",
}
# To keep error bars apart.
_SHIFTS = {SHAPE: -0.006, EXTERNAL: 0.006, INTERNAL: 0.0, STATIC: 0.0}
_NAMED = 2
"""Runs without a time series that a figure names; the others are counted."""

_APART = "Set apart sideways by 0.006 in l/w."


def draw(
    output: Path,
    *,
    points: pd.DataFrame,
    runs: pd.DataFrame,
    manifests: Sequence[RunManifest],
    footer: Sequence[str],
) -> list[Path]:
    """Draws and writes all figures.

    Args:
        output: Folder.
        points: See `base.procedures.points`.
        runs: See `activity.procedure_row`.
        manifests: The runs, in the order of the table.
        footer: Origin, one statement each.

    Returns:
        The files written.
    """
    panels = [
        _Panel(name="phi_aspect", quantity=PHI_ACTIVE, label=_PHI_LABEL, lines=_of_procedures),
        _Panel(name="crossings_aspect", quantity=CROSSINGS, label=CROSSINGS_LABEL, lines=_of_procedures),
        _Panel(name="energy_aspect", quantity=ENERGY, label=_ENERGY_LABEL, lines=_of_energies, log=True),
        _Panel(name="phi_theta", quantity=PHI_ACTIVE, label=_PHI_LABEL, x=THETA, lines=_of_aspects),
        _Panel(name="crossings_theta", quantity=CROSSINGS, label=CROSSINGS_LABEL, x=THETA, lines=_of_aspects),
        _Panel(name="energy_theta", quantity=ENERGY, label=_ENERGY_LABEL, x=THETA, lines=_of_aspects, log=True),
    ]
    moved = {name: _LABELS[name] for name in (SHAPE, INTERNAL)}
    with figures.style():
        written = _draw_heights(output / "height_time", runs, manifests, footer)
        for panel in panels:
            written += _draw_panel(output / panel.name, panel, points, footer)
        written += draw_readings(output / "energy_readings", points, moved, footer)
    return written


@dataclass(frozen=True, kw_only=True, eq=False)
class _Line:
    """Points of one line, with their look."""

    points: pd.DataFrame
    label: str
    look: Mapping[str, Any]
    shift: float = 0.0


@dataclass(frozen=True, kw_only=True)
class _Panel:
    """One figure of means against l/w or θ."""

    name: str
    quantity: str
    label: str
    lines: Callable[[pd.DataFrame], list[_Line]]
    x: str = ASPECT
    log: bool = False


def _of_procedures(points: pd.DataFrame) -> list[_Line]:
    return [
        _Line(points=of_procedure(points, name), label=label, look=procedure_marker(name), shift=_SHIFTS[name])
        for name, label in _LABELS.items()
    ]


def _of_energies(points: pd.DataFrame) -> list[_Line]:
    """Procedures, and the internal oscillation at its other amplitudes as thin lines."""
    internal = points[points[PROCEDURE] == INTERNAL]
    others = sorted(theta for theta in internal[THETA].unique() if theta != AMPLITUDE)
    thin = {"markersize": 2.2, "linewidth": 0.5, "linestyle": (0, (2, 1.5))}
    lines = [
        _Line(
            points=internal[internal[THETA] == theta],
            label=rf"internal, $\theta$ = {theta:g}°",
            look={**marker("o", colour, "white"), **thin},
        )
        for theta, colour in zip(others, figures.sequence(len(others), last=0.85), strict=True)
    ]
    return [line for line in _of_procedures(points) if line.label != _LABELS[STATIC]] + lines


def _of_aspects(points: pd.DataFrame) -> list[_Line]:
    """The internal oscillation, a line for each aspect ratio with more than one amplitude."""
    internal = points[points[PROCEDURE] == INTERNAL]
    several = {aspect: part for aspect, part in internal.groupby(ASPECT) if part[THETA].nunique() > 1}
    colours = figures.sequence(len(several), last=0.85)
    return [
        _Line(points=part.sort_values(THETA), label=rf"$l/w$ = {aspect:g}", look=marker(shape, colour, colour))
        for (aspect, part), colour, shape in zip(several.items(), colours, "oD^s" * len(several), strict=False)
    ]


def _draw_panel(path: Path, panel: _Panel, points: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    figure, axes = figures.new_figure(height=2.8)
    known = points[points[panel.quantity].notna()]
    lines = [line for line in panel.lines(judging(known)) if len(line.points)]
    for line in lines:
        x, values = line.points[panel.x] + line.shift, line.points[panel.quantity]
        half_widths = line.points[marked(panel.quantity, "95 %")].to_numpy()
        draw_means(axes, x, values, half_widths, look=line.look, label=line.label)
    for engine in engines_of(known)[1:]:
        _draw_beside(axes, panel, of_engine(known, engine), TOLD.get(engine, engine))
    axes.set_xlabel(ASPECT_LABEL if panel.x == ASPECT else THETA_LABEL)
    axes.set_ylabel(panel.label)
    if not lines:
        axes.text(0.5, 0.5, "no runs for this yet", transform=axes.transAxes, ha="center", va="center")
    elif panel.log and all((line.points[panel.quantity] > 0).all() for line in lines):
        axes.set_yscale("log")
    else:
        axes.set_ylim(bottom=0)
    legend_above(axes)
    shifted = any(line.shift for line in lines)
    return finished(figure, path, [_APART] if shifted else [], footer)


def _draw_beside(axes: Axes, panel: _Panel, points: pd.DataFrame, engine: str) -> None:
    """The points of another engine: open green markers, set apart sideways by twice as much, told once."""
    label: str | None = f"the same on {engine}: green"
    apart = 0.012 if panel.x == ASPECT else 0.6
    for line in panel.lines(points):
        if len(line.points):
            half_widths = line.points[marked(panel.quantity, "95 %")].to_numpy()
            look = {**line.look, "color": figures.GREEN, "markerfacecolor": "white", "linestyle": "none"}
            x, values = line.points[panel.x] + line.shift + apart, line.points[panel.quantity]
            draw_means(axes, x, values, half_widths, look=look, label=label or "_")
            label = None


def _draw_heights(
    path: Path, runs: pd.DataFrame, manifests: Sequence[RunManifest], footer: Sequence[str]
) -> list[Path]:
    """h/h0 against time of each procedure, at the aspect ratio of the paper or the nearest one."""
    runs = judging(runs)
    aspect = min(runs[ASPECT].unique(), key=lambda value: abs(value - _SHOWN_ASPECT))
    at_aspect = runs[runs[ASPECT] == aspect]
    by_name = {run.directory.name: run for run in manifests}
    histories: dict[str, list[History]] = {}
    without = []
    for procedure in _LABELS:
        for _, row in of_procedure(at_aspect, procedure).iterrows():
            try:
                values, times = height_history(by_name[row["run"]])
            except InputError:
                without.append(row["run"])
            else:
                history = History(times=times, values=values, active=float(row[ACTIVE]))
                histories.setdefault(procedure, []).append(history)
    figure, axes = figures.new_figure(height=2.8)
    ends = [history.active for seeds in histories.values() for history in seeds]
    width = bin_width(ends)
    for procedure, seeds in histories.items():
        draw_history(axes, seeds, width, colour=COLOURS[procedure], label=_LABELS[procedure])
    draw_ends(axes, ends)
    axes.axhline(1.0, color=figures.GREY, linewidth=0.6)
    axes.set_xlabel("time since the activity began [s]")
    axes.set_ylabel(r"height of the centre of mass $h/h_0$ [-]")
    legend_above(axes)
    told = [f"l/w = {aspect:g}. {told_histories(width, 'Each activity')}"]
    if without:
        named = ", ".join(without[:_NAMED]) + (f" and {len(without) - _NAMED} more" if len(without) > _NAMED else "")
        told.append(f"No time series of the height: {named}.")
    return finished(figure, path, told, footer)
