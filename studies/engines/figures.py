"""The figures of the study `engines`; see `studies.engines.study` for what they show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from postprocess.report import figures
from studies.engines.findings import PITCH, REFINED, Equivalence, Verdict
from studies.framework.plots import draw_means, finished, marker

if TYPE_CHECKING:
    import pandas as pd

_COLOURS: Mapping[Verdict, str] = MappingProxyType(
    {"equivalent": figures.GREEN, "different": figures.ORANGE, "not resolved": figures.GREY, "no data": figures.GREY}
)


def draw(output: Path, *, judged: Sequence[Equivalence], pitch: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    """Draws and writes all figures.

    Args:
        output: Folder.
        judged: Every quantity with its verdict.
        pitch: See `findings.refinement`.
        footer: Origin, one statement each.

    Returns:
        The files written.
    """
    with figures.style():
        return [
            *_draw_differences(output / "differences", judged, footer),
            *_draw_pitch(output / "pitch", pitch, footer),
        ]


def _draw_differences(path: Path, judged: Sequence[Equivalence], footer: Sequence[str]) -> list[Path]:
    """A row per quantity: the difference with its error over the band of its margin."""
    shown = [one for one in judged if one.pairs]
    figure, axes = figures.new_figure(height=0.8 + 0.19 * len(shown))
    for place, one in enumerate(shown):
        colour, margin = _COLOURS[one.verdict], one.quantity.margin
        axes.barh(place, 2 * margin, left=-margin, height=0.62, color=figures.SKY, alpha=0.3, linewidth=0)
        look = {**marker("o", colour, colour), "linestyle": "none"}
        draw_means(axes, [one.percent], [place], None, across=[one.half_width], look=look, label="_nolegend_")
    for verdict in dict.fromkeys(one.verdict for one in shown):
        axes.plot([], [], "o", color=_COLOURS[verdict], markersize=3.4, label=verdict)
    axes.axvline(0.0, color=figures.BLACK, linewidth=0.6)
    axes.set_yticks(range(len(shown)), [one.quantity.told for one in shown])
    axes.set_ylim(len(shown) - 0.4, -0.6)
    axes.set_xlabel("links less YADE over YADE's mean [%]")
    if shown:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, columnspacing=1.0)
    return finished(figure, path, ["Bands: margins, chosen beforehand."], footer)


def _draw_pitch(path: Path, pitch: pd.DataFrame, footer: Sequence[str]) -> list[Path]:
    """Means against pitch over those of links, which stand at 0."""
    figure, axes = figures.new_figure(height=2.6)
    told = [quantity.told for quantity in REFINED]
    colours = dict(zip(told, figures.sequence(len(told), last=0.85), strict=True))
    for place, (name, shape) in enumerate(zip(told, "oDs^v", strict=True)):
        part = (
            pitch[(pitch["quantity"] == name) & pitch["mean [-]"].notna()].sort_values(PITCH) if len(pitch) else pitch
        )
        if part.empty or not (part[PITCH] == 0).any():
            continue
        limit = float(part.loc[part[PITCH] == 0, "mean [-]"].iloc[0])
        x = part[PITCH] + 0.012 * (place - 2)
        values, errors = part["mean [-]"] / limit, part["mean 95 % [-]"].to_numpy() / limit
        draw_means(axes, x, values, errors, look=marker(shape, colours[name], colours[name]), label=name)
    axes.axhline(1.0, color=figures.GREY, linewidth=0.6)
    axes.set_xlabel("pitch over sphere diameter; links at 0 [-]")
    axes.set_ylabel("mean over that of links [-]")
    if axes.get_legend_handles_labels()[1]:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, columnspacing=1.0)
    return finished(figure, path, ["Set apart sideways; the error bar of links' own mean stands at 0."], footer)
