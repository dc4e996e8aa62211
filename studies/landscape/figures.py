"""The figures of the study `landscape`: maps, strength against energy and measures, correlations, and cost."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from postprocess.report import figures
from postprocess.statistics.columns import ASPECT
from postprocess.statistics.points import marked
from studies.framework.plots import ASPECT_LABEL, CROSSINGS_LABEL, draw_means, finished, procedure_marker
from studies.framework.procedures import CROSSINGS, EXTERNAL, INTERNAL, PHI, PROCEDURE, SHAPE, STATIC, THETA
from studies.landscape.cost import COMMON, GAIN
from studies.landscape.measure import (
    ABOVE,
    CALLED,
    CONTACTS,
    ENERGY,
    ENTANGLED,
    HEIGHT,
    LIFTS,
    LINKING,
    PEAK,
    TOUCHING,
)
from studies.landscape.predictors import ALL, EVERY, HIGH, LOW, PART, PREDICTOR, RHO, SCOPE, STRENGTH, WITHIN

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

_STRENGTH = r"strength $F/(n W_\mathrm{s})$ [-]"
_ENERGY = "energy per smarticle [J]"
_LABELS: Mapping[str, str] = MappingProxyType(
    {
        PHI: r"packing fraction $\phi$ [-]",
        CROSSINGS: CROSSINGS_LABEL,
        LINKING: "linking number per smarticle [-]",
        CONTACTS: "contacts per smarticle [-]",
        TOUCHING: "largest cluster in contact [-]",
        ENTANGLED: "largest entangled cluster [-]",
        HEIGHT: "height of the centre of mass [m]",
        ABOVE: "share above the hook [-]",
        ENERGY: _ENERGY,
        PEAK: _STRENGTH,
    }
)
_MAPPED: Mapping[str, str] = MappingProxyType(
    {PHI: r"$\phi$ [-]", CROSSINGS: r"$\langle N\rangle$ [-]", LINKING: "linking\nnumber [-]", PEAK: "strength [-]"}
)
_NAMES = {STATIC: "poured", SHAPE: "shape change", EXTERNAL: "shaken", INTERNAL: "oscillation"}
_SHAPES = ("o", "v", "P", "X", "<")
_PAGE = 2 * figures.COLUMN_WIDTH
_CELL = 2.0**0.5  # cells of the maps reach by this factor of energy to either side, where no other one is nearer


def draw(
    output: Path,
    *,
    runs: pd.DataFrame,
    points: pd.DataFrame,
    predictors: pd.DataFrame,
    cost: pd.DataFrame,
    footer: Sequence[str],
) -> list[Path]:
    """Draws and writes all figures.

    Args:
        output: Folder.
        runs: Rows of `measure.landscape_row`.
        points: Means of them over seeds.
        predictors: See `predictors.predicted`.
        cost: See `cost.costs`.
        footer: Origin, one statement each.

    Returns:
        The files written.
    """
    with figures.style():
        return [
            *_draw_maps(output / "maps", points, footer),
            *_draw_energies(output / "strength_energy", points, footer),
            *_draw_measures(output / "strength_measures", runs, footer),
            *_draw_correlations(output / "correlations", predictors, footer),
            *_draw_costs(output / "cost", cost, footer),
        ]


# -- maps -------------------------------------------------------------------------------------------------------------


def _draw_maps(path: Path, points: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    """One row of maps for each quantity, one column for each θ; a strip on the left for piles as poured."""
    swung = points[(points[PROCEDURE] == INTERNAL) & (points[ENERGY] > 0)]
    poured = points[points[PROCEDURE] == STATIC]
    thetas = sorted(swung[THETA].unique())
    if not thetas:
        return []
    shown = points[points[PROCEDURE].isin([STATIC, INTERNAL])]
    ratios = sorted(shown[ASPECT].unique())
    half = min(np.diff(ratios), default=0.1) / 2
    left, right = float(swung[ENERGY].min()) / _CELL, float(swung[ENERGY].max()) * _CELL
    figure = figures.blank_figure(_PAGE, 1.35 * len(_MAPPED) + 0.5)
    grid = figure.subplots(len(_MAPPED), len(thetas), sharex=True, sharey=True, squeeze=False)
    for panels, (quantity, label) in zip(grid, _MAPPED.items(), strict=True):
        norm = Normalize(float(shown[quantity].min()), float(shown[quantity].max()))
        for axes, theta in zip(panels, thetas, strict=True):
            here = swung[swung[THETA] == theta]
            for aspect, row in here.groupby(ASPECT):
                _draw_row(axes, (float(aspect), half), row.sort_values(ENERGY), quantity, norm)
            for _, pile in poured[poured[ASPECT].isin(here[ASPECT])].iterrows():
                _draw_cells(axes, [left / 4, left / 2], (float(pile[ASPECT]), half), [float(pile[quantity])], norm)
            _spend(axes, sparse=True)
            axes.set_xlim(left / 5, right * 1.05)
            axes.grid(visible=False)
            axes.set_yticks(ratios)
            axes.axvline(left / 1.4, color=figures.GREY, linewidth=0.6, linestyle=(0, (4, 3)))
        bar = figure.colorbar(ScalarMappable(norm, "viridis"), ax=list(panels), pad=0.01, aspect=12)
        bar.set_label(label)
        panels[0].set_ylabel(r"$l/w$ [-]")
    for axes, theta in zip(grid[0], thetas, strict=True):
        axes.set_title(rf"$\theta$ = {theta:g}°", fontsize=8)
    grid[-1][len(thetas) // 2].set_xlabel(_ENERGY)
    told = "Left of the broken line: poured, no energy spent. Each cell is a point, a mean over its seeds; l/w and θ"
    return finished(figure, path, [f"{told} beyond what the hinge reaches are empty."], footer)


def _spend(axes: Axes, *, sparse: bool = False) -> None:
    """A logarithmic axis with numbers at powers of ten, and at thrice them unless they are to be sparse."""
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0,) if sparse else (1.0, 3.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(_told_energy))
    axes.xaxis.set_minor_formatter(NullFormatter())


def _told_energy(value: float, _: int | None) -> str:
    """`3e-5`, or `30`."""
    return f"{value:g}" if value > 1e-2 else f"{value:.0e}".replace("e-0", "e-")


def _draw_row(axes: Axes, place: tuple[float, float], row: pd.DataFrame, quantity: str, norm: Normalize) -> None:
    """The points of one l/w and θ as cells side by side, which meet midway between their energies.

    `place` is l/w and half the height of a cell.
    """
    energies = row[ENERGY].to_numpy(dtype=np.float64)
    between = np.sqrt(energies[:-1] * energies[1:])
    edges = [energies[0] / _CELL, *between, energies[-1] * _CELL]
    _draw_cells(axes, edges, place, row[quantity].tolist(), norm)


def _draw_cells(
    axes: Axes, edges: Sequence[float], place: tuple[float, float], values: Sequence[float], norm: Normalize
) -> None:
    axes.pcolormesh(edges, [place[0] - place[1], place[0] + place[1]], np.array([values]), norm=norm, cmap="viridis")


# -- strength ---------------------------------------------------------------------------------------------------------


def _theta_colours(thetas: Sequence[float]) -> dict[float, str]:
    return dict(zip(thetas, figures.sequence(len(thetas), last=0.85), strict=True))


def _draw_energies(path: Path, points: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    """A panel for each l/w: strength against energy, a line for each θ; the poured pile as a level."""
    ratios = sorted(points[ASPECT].unique())
    thetas = sorted(points.loc[points[PROCEDURE] == INTERNAL, THETA].unique())
    colours = _theta_colours(thetas)
    columns = min(len(ratios), 4)
    figure = figures.blank_figure(_PAGE, 1.75 * math.ceil(len(ratios) / columns) + 0.5)
    grid = figure.subplots(math.ceil(len(ratios) / columns), columns, sharex=True, sharey=True, squeeze=False)
    handles: dict[str, Artist] = {}
    for axes in grid.flat[len(ratios) :]:
        axes.set_visible(False)
    for axes, ratio in zip(grid.flat, ratios, strict=False):
        here = points[points[ASPECT] == ratio]
        for theta, shape in zip(thetas, _SHAPES, strict=False):
            part = here[(here[PROCEDURE] == INTERNAL) & (here[THETA] == theta)].sort_values(ENERGY)
            look = {"marker": shape, "color": colours[theta], "markersize": 3.2, "linewidth": 0.9}
            _draw_line(axes, part, look, rf"oscillation, $\theta$ = {theta:g}°")
        for name in (EXTERNAL, SHAPE):
            part = here[here[PROCEDURE] == name]
            _draw_line(axes, part, {**procedure_marker(name), "linestyle": "none"}, _NAMES[name])
        for level in here.loc[here[PROCEDURE] == STATIC, PEAK]:
            axes.axhline(level, color=figures.GREY, linewidth=0.8, linestyle=(0, (4, 3)), label="poured")
        _spend(axes)
        axes.set_ylim(bottom=0)
        axes.set_title(f"l/w = {ratio:g}", fontsize=8)
        handles |= dict(zip(*axes.get_legend_handles_labels()[::-1], strict=True))
    for axes in grid[:, 0]:
        axes.set_ylabel(_STRENGTH)
    for axes in grid[-1]:
        axes.set_xlabel(_ENERGY)
    figure.legend(list(handles.values()), list(handles), loc="outside upper center", ncols=4)
    return finished(figure, path, [], footer)


def _draw_line(axes: Axes, part: pd.DataFrame, look: Mapping[str, object], label: str) -> None:
    part = part[part[ENERGY] > 0]
    if len(part):
        draw_means(axes, part[ENERGY], part[PEAK], part[marked(PEAK, "95 %")].to_numpy(), look=look, label=label)


def _draw_measures(path: Path, runs: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    """A panel for each measure: strength of every run, coloured by l/w."""
    names = [name for name in _LABELS if name != PEAK]
    figure = figures.blank_figure(_PAGE, 6.0)
    grid = figure.subplots(3, 3, sharey=True)
    norm = Normalize(float(runs[ASPECT].min()), float(runs[ASPECT].max()))
    kinds = [(name, mark) for name, mark in ((INTERNAL, "o"), (STATIC, "^"), (EXTERNAL, "D"), (SHAPE, "s"))]
    for axes, name in zip(grid.flat, names, strict=True):
        known = runs[runs[name] > 0] if name == ENERGY else runs
        for procedure, mark in kinds:
            part = known[known[PROCEDURE] == procedure]
            if part.empty:
                continue
            axes.scatter(
                part[name],
                part[PEAK],
                c=part[ASPECT],
                norm=norm,
                cmap="viridis",
                marker=mark,
                s=9,
                linewidths=0.3,
                edgecolors=figures.BLACK,
                label=_NAMES[procedure],
            )
        if name == ENERGY:
            _spend(axes)
        axes.set_xlabel(_LABELS[name])
        axes.set_ylim(bottom=0)
    for axes in grid[:, 0]:
        axes.set_ylabel(_STRENGTH)
    figure.colorbar(ScalarMappable(norm, "viridis"), ax=grid, label=ASPECT_LABEL, pad=0.01, aspect=40)
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return finished(figure, path, ["Every run; energy: without piles as poured."], footer)


def _draw_correlations(path: Path, predictors: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    """Rank correlations of strength with each measure, over all l/w and within l/w, with their intervals."""
    if predictors.empty:
        return []
    found = predictors[(predictors[STRENGTH] == PEAK) & (predictors[PART] == EVERY)]
    figure, axes = figures.new_figure(width=1.5 * figures.COLUMN_WIDTH, height=2.9)
    names = found.loc[found[SCOPE] == WITHIN, PREDICTOR].tolist()[::-1]
    looks = {WITHIN: ("o", figures.ORANGE, 0.14), ALL: ("D", figures.BLUE, -0.14)}
    for scope, (mark, colour, beside) in looks.items():
        rows = found[found[SCOPE] == scope].set_index(PREDICTOR).loc[names]
        places = np.arange(len(names)) + beside
        axes.hlines(places, rows[LOW], rows[HIGH], color=colour, linewidth=1.0)
        axes.plot(rows[RHO], places, mark, color=colour, markersize=4, label=scope)
    axes.axvline(0, color=figures.GREY, linewidth=0.6)
    axes.set_xlim(-1, 1)
    axes.set_yticks(range(len(names)), [CALLED[name] for name in names])
    axes.set_xlabel("rank correlation with strength [-]")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    told = "Lines: 95 % by resampling whole trajectories within each l/w. Within l/w: of ranks among runs of one l/w."
    return finished(figure, path, [told], footer)


def _draw_costs(path: Path, cost: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    """Strength gained against energy, means over the l/w where everything was run."""
    table = cost[cost[SCOPE] == COMMON] if len(cost) else cost
    if table.empty:
        return []
    figure, axes = figures.new_figure(width=1.3 * figures.COLUMN_WIDTH, height=2.9)
    thetas = sorted(table.loc[table[PROCEDURE] == INTERNAL, THETA].unique())
    colours = _theta_colours(thetas)
    for theta, shape in zip(thetas, _SHAPES, strict=False):
        part = table[(table[PROCEDURE] == INTERNAL) & (table[THETA] == theta)].sort_values(LIFTS)
        look = {"marker": shape, "color": colours[theta], "markersize": 3.6, "linewidth": 0.9}
        label = rf"oscillation, $\theta$ = {theta:g}°"
        draw_means(axes, part[LIFTS], part[GAIN], part[marked(GAIN, "95 %")].to_numpy(), look=look, label=label)
    for name in (EXTERNAL, SHAPE):
        part = table[(table[PROCEDURE] == name) & (table[LIFTS] > 0)]
        if len(part):
            look = {**procedure_marker(name), "linestyle": "none"}
            errors = part[marked(GAIN, "95 %")].to_numpy()
            draw_means(axes, part[LIFTS], part[GAIN], errors, look=look, label=_NAMES[name])
    axes.axhline(0, color=figures.GREY, linewidth=0.6)
    _spend(axes)
    axes.set_xlabel(r"energy per smarticle over $W_\mathrm{s} w$ [-]")
    axes.set_ylabel(r"strength gained, over $n W_\mathrm{s}$ [-]")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    told = "Means over pairs of one l/w and seed, at the l/w at which everything was run; error bars count pairs."
    return finished(figure, path, [told], footer)
