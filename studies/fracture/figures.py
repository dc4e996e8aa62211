"""The figures of the study `fracture`; see `studies.fracture.study` for what they show."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dem.record.manifest import RunManifest
from postprocess.measures.pull import WINDOW
from postprocess.report import figures
from postprocess.statistics.columns import ASPECT
from postprocess.statistics.points import marked
from studies.fracture.findings import SHOWN_ASPECT, at_shown_aspect
from studies.fracture.measure import HELD_FAST, PEAK, force_history
from studies.framework.plots import (
    ASPECT_LABEL,
    BAND,
    COLOURS,
    SHAPES,
    THETA_LABEL,
    History,
    draw_against,
    draw_history,
    draw_means,
    draw_runs,
    finished,
    legend_above,
    marker,
    procedure_marker,
)
from studies.framework.procedures import (
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

if TYPE_CHECKING:
    import pandas as pd

_TIME_LABEL = "time since the hook began to rise [s]"
_FORCE_LABEL = r"force on the hook $F/(n W_\mathrm{s})$ [-]"
_NET_LABEL = r"upper less lower hook, $F/(n W_\mathrm{s})$ [-]"
_PEAK_LABEL = r"peak force $F_\mathrm{max}/(n W_\mathrm{s})$ [-]"
_CROSSINGS_LABEL = r"links through a plane $\langle N\rangle$ before the pull [-]"
_LABELS = {
    SHAPE: "shape change",
    EXTERNAL: "external",
    INTERNAL: rf"internal, $\theta$ = {AMPLITUDE:g}°",
    STATIC: "static",
}
_HISTORIES = f"Line: mean over seeds of means over {WINDOW:g} s, as far as all of them go; {BAND}; in brackets: seeds."


@dataclass(frozen=True, kw_only=True, eq=False)
class _Line:
    """What one line of a figure shows: a part of the table of runs or of points, and its look."""

    label: str
    colour: str
    shape: str
    part: Callable[[pd.DataFrame], pd.DataFrame]


def draw(
    output: Path,
    *,
    points: pd.DataFrame,
    runs: pd.DataFrame,
    manifests: Sequence[RunManifest],
    footer: Sequence[str],
) -> list[Path]:
    """Draws and writes all figures; those over θ and over l/w where there are several.

    Args:
        output: Folder.
        points: See `base.procedures.points`.
        runs: See `measure.fracture_row`.
        manifests: The runs, in any order.
        footer: Origin, one statement each.

    Returns:
        The files written.
    """
    by_name = {run.directory.name: run for run in manifests}
    amplitudes, aspects = _amplitudes(runs), _aspects(runs)
    at_aspect, at_amplitude = f"l/w = {SHOWN_ASPECT:g}.", f"θ = {AMPLITUDE:g}°."
    with figures.style():
        written = _draw_forces(output / "force_time", _procedures(), runs, by_name, footer, told=[at_aspect])
        told = [f"{at_aspect} Without what goes from hook to hook."]
        written += _draw_forces(output / "net_time", _procedures(), runs, by_name, footer, told=told, net=True)
        if len(amplitudes) > 1:
            told = [f"Internal oscillation, {at_aspect}"]
            written += _draw_forces(output / "force_time_theta", amplitudes, runs, by_name, footer, told=told)
            written += _draw_peaks(output / "peak_theta", THETA, points, told, footer)
        if len(aspects) > 1:
            told = [f"Internal oscillation, {at_amplitude}"]
            written += _draw_forces(output / "force_time_aspect", aspects, runs, by_name, footer, told=told)
            written += _draw_peaks(output / "peak_aspect", ASPECT, points, told, footer)
        written += _draw_crossings(output / "peak_crossings", points, runs, footer)
    return written


def _at_aspect_of(procedure: str) -> Callable[[pd.DataFrame], pd.DataFrame]:
    return lambda table: of_procedure(at_shown_aspect(table), procedure)


def _at_amplitude(theta: float) -> Callable[[pd.DataFrame], pd.DataFrame]:
    def part(table: pd.DataFrame) -> pd.DataFrame:
        shown = at_shown_aspect(table)
        return shown[(shown[PROCEDURE] == INTERNAL) & (shown[THETA] == theta)]

    return part


def _at_ratio(aspect: float) -> Callable[[pd.DataFrame], pd.DataFrame]:
    def part(table: pd.DataFrame) -> pd.DataFrame:
        shown = of_procedure(table, INTERNAL)
        return shown[shown[ASPECT] == aspect]

    return part


def _amplitudes(runs: pd.DataFrame, *, but: float | None = None) -> list[_Line]:
    """The internal oscillation at the aspect ratio of the comparison, a line for each θ but one."""
    shown = at_shown_aspect(runs[runs[PROCEDURE] == INTERNAL])
    thetas = sorted(theta for theta in shown[THETA].unique() if theta != but)
    colours = figures.sequence(len(thetas), last=0.85)
    return [
        _Line(label=rf"$\theta$ = {theta:g}°", colour=colour, shape="o", part=_at_amplitude(theta))
        for theta, colour in zip(thetas, colours, strict=True)
    ]


def _aspects(runs: pd.DataFrame, *, but: float | None = None) -> list[_Line]:
    """The internal oscillation at the amplitude of the comparison, a line for each aspect ratio but one."""
    ratios = sorted(ratio for ratio in of_procedure(runs, INTERNAL)[ASPECT].unique() if ratio != but)
    colours = figures.sequence(len(ratios), last=0.85)
    return [
        _Line(label=rf"$l/w$ = {ratio:g}", colour=colour, shape="v", part=_at_ratio(ratio))
        for ratio, colour in zip(ratios, colours, strict=True)
    ]


def _draw_forces(
    path: Path,
    lines: Sequence[_Line],
    runs: pd.DataFrame,
    by_name: Mapping[str, RunManifest],
    footer: Sequence[str],
    *,
    told: Sequence[str],
    net: bool = False,
) -> list[Path]:
    figure, axes = figures.new_figure(height=2.8)
    for line in lines:
        names = line.part(runs)["run"]
        histories = [
            History(times=times, values=force, active=0.0)
            for times, force in (force_history(by_name[name], net=net) for name in names)
        ]
        if histories:
            draw_history(axes, histories, WINDOW, colour=line.colour, label=f"{line.label} ({len(histories)})")
    axes.axhline(1.0, color=figures.GREY, linewidth=0.6, linestyle=(0, (4, 3)))
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=min(0.0, float(axes.dataLim.y0)))
    axes.set_xlabel(_TIME_LABEL)
    axes.set_ylabel(_NET_LABEL if net else _FORCE_LABEL)
    legend_above(axes)
    return finished(figure, path, [*told, f"{_HISTORIES} Broken line: weight of all smarticles."], footer)


def _draw_peaks(path: Path, x: str, points: pd.DataFrame, told: Sequence[str], footer: Sequence[str]) -> list[Path]:
    """Peak force of the internal oscillation over θ or l/w, and of the other procedures beside it."""
    figure, axes = figures.new_figure(height=2.6)
    internal = points[points[PROCEDURE] == INTERNAL]
    part = at_shown_aspect(internal) if x == THETA else of_procedure(internal, INTERNAL)
    part = part.sort_values(x)
    look: dict[str, Any] = procedure_marker(INTERNAL) | {"linestyle": (0, (2, 1.5))}
    draw_means(axes, part[x], part[PEAK], part[marked(PEAK, "95 %")].to_numpy(), look=look, label="mean over seeds")
    axes.set_xlabel(THETA_LABEL if x == THETA else ASPECT_LABEL)
    axes.set_ylabel(_PEAK_LABEL)
    axes.set_ylim(bottom=0)
    return finished(figure, path, told, footer)


def _draw_crossings(path: Path, points: pd.DataFrame, runs: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    """Peak force against ⟨N⟩: every run, and the means."""
    figure, axes = figures.new_figure(height=2.8)
    length = 0.08 * float(runs[PEAK].max())
    for line in _all_points(runs):
        one, mean = line.part(runs), line.part(points)
        if one.empty:
            continue
        draw_runs(axes, one, CROSSINGS, PEAK, bounds=HELD_FAST, length=length, shape=line.shape, colour=line.colour)
        look = {"markersize": 4.2, **marker(line.shape, line.colour, "white")}
        draw_against(axes, mean, CROSSINGS, PEAK, look=look, label=line.label)
    axes.set_xlabel(_CROSSINGS_LABEL)
    axes.set_ylabel(_PEAK_LABEL)
    axes.set_ylim(bottom=0)
    legend_above(axes)
    told = "Small: single runs, with an arrow: held fast, a lower bound; large: means over seeds."
    return finished(figure, path, [told], footer)


def _procedures() -> list[_Line]:
    """The procedures at the aspect ratio and the amplitude of the comparison."""
    return [
        _Line(label=label, colour=COLOURS[name], shape=SHAPES[name], part=_at_aspect_of(name))
        for name, label in _LABELS.items()
    ]


def _all_points(runs: pd.DataFrame) -> list[_Line]:
    """The procedures, and the internal oscillation of each other θ and l/w."""
    others = [*_amplitudes(runs, but=AMPLITUDE), *_aspects(runs, but=SHOWN_ASPECT)]
    return [*_procedures(), *(replace(line, label=f"internal, {line.label}") for line in others)]
