"""Charts for a page: SVG as an address that holds the picture itself, once for light pages and once for dark ones."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rc_context

from dem.errors import InputError
from postprocess.report.figures import BLACK, BLUE, GREY, ORANGE, new_figure, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

_GRID, _BAND = "#e6e6e6", "#f0f1f2"
# What each colour of a light page is on a dark one.
_DARK = {BLACK: "#e6e6e6", _GRID: "#33373b", _BAND: "#1f2225", BLUE: "#56b4e9", ORANGE: "#ff8f45", GREY: "#a5a9ad"}
_INK: dict[Any, Any] = {
    name: BLACK for name in ("text.color", "axes.labelcolor", "xtick.color", "ytick.color", "legend.labelcolor")
}
_MOST_POINTS = 400
_MIMES = {".png": "image/png", ".svg": "image/svg+xml", ".webp": "image/webp"}


@dataclass(frozen=True, kw_only=True)
class Curve:
    """A quantity against time, and what happens meanwhile.

    Attributes:
        label: of the axis, with its unit.
        times: (n,) [s].
        values: (n,) in that unit.
        phases: start, end [s] and type of each phase.
    """

    label: str
    times: NDArray[np.float64]
    values: NDArray[np.float64]
    phases: Sequence[tuple[float, float, str]]


@dataclass(frozen=True, kw_only=True)
class Points:
    """Means with their errors against a variable.

    Attributes:
        variable: label of the axis below.
        label: of the axis beside, with its unit.
        groups: by the name of each curve: x, means and errors, NaN where there is none.
    """

    variable: str
    label: str
    groups: Mapping[str, tuple[Sequence[object], Sequence[float], Sequence[float]]]


def against_time(curve: Curve) -> tuple[str, str]:
    """A curve as two pictures, light and dark."""

    def draw(axes: Axes) -> None:
        for number, (start, end, kind) in enumerate(curve.phases):
            if number % 2:
                axes.axvspan(start, end, color=_BAND, linewidth=0, zorder=0)
            axes.text(
                (start + end) / 2, 1.02, kind, ha="center", va="bottom", fontsize=5.5, color=GREY,
                transform=axes.get_xaxis_transform(), parse_math=False, clip_on=False,
            )  # fmt: skip
        times, values = thinned(curve.times, curve.values)
        axes.plot(times, values, color=BLUE, linewidth=1.0)
        axes.set_xlim(curve.phases[0][0] if curve.phases else None, curve.phases[-1][1] if curve.phases else None)
        axes.set_xlabel("time [s]")
        axes.set_ylabel(curve.label, parse_math=False)

    return _both(draw)


def against_variable(points: Points) -> tuple[str, str]:
    """Means with error bars as two pictures, light and dark."""

    def draw(axes: Axes) -> None:
        colours = (BLUE, ORANGE, BLACK, GREY)
        markers = "osD^v"
        numeric = all(isinstance(x, int | float) for xs, _, _ in points.groups.values() for x in xs)
        names = list(dict.fromkeys(str(x) for xs, _, _ in points.groups.values() for x in xs))
        every = np.array([_place(x, names, numeric) for xs, _, _ in points.groups.values() for x in xs])
        apart = np.diff(np.unique(every)).min() if len(np.unique(every)) > 1 else 1.0
        for number, (name, (xs, means, errors)) in enumerate(points.groups.items()):
            # A little beside each other, so that error bars do not hide each other.
            aside = 0.06 * apart * (number - (len(points.groups) - 1) / 2)
            places = [_place(x, names, numeric) + aside for x in xs]
            axes.errorbar(
                places, means, np.asarray(errors, dtype=float), color=colours[number % len(colours)], label=name,
                marker=markers[number % len(markers)], linestyle="-" if numeric else "none", linewidth=0.9,
            )  # fmt: skip
        if not numeric:
            axes.set_xticks(range(len(names)), names, parse_math=False)
        axes.set_xlabel(points.variable, parse_math=False)
        axes.set_ylabel(points.label, parse_math=False)
        if len(points.groups) > 1:
            # Above, where it hides nothing.
            legend = axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, borderaxespad=0.2)
            for text in legend.get_texts():
                text.set_parse_math(False)

    return _both(draw)


def _place(x: object, names: Sequence[str], numeric: bool) -> float:
    """Where on the axis a value stands: names in their order."""
    return float(str(x)) if numeric else float(names.index(str(x)))


def thinned(times: NDArray[np.float64], values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """At most some hundred points of a curve that keep its extremes: least and largest of each stretch.

    Args:
        times: (n,).
        values: (n,), NaN are left out.
    """
    known = np.isfinite(values)
    times, values = times[known], values[known]
    if len(times) <= _MOST_POINTS:
        return times, values
    stretches = np.array_split(np.arange(len(times)), _MOST_POINTS // 2)
    kept = np.unique([index for s in stretches for index in (s[values[s].argmin()], s[values[s].argmax()])])
    return times[kept], values[kept]


def embedded(path: Path) -> str:
    """A picture file as an address that holds it.

    Raises:
        InputError: it is no picture, or cannot be read.
    """
    try:
        return address(path.read_bytes(), _MIMES[path.suffix])
    except (KeyError, OSError) as error:
        msg = f"{path}: cannot be put into a report ({error}); use {', '.join(_MIMES)}"
        raise InputError(msg) from None


def address(content: bytes, mime: str) -> str:
    """An address that holds its content."""
    return f"data:{mime};base64,{base64.b64encode(content).decode()}"


def _both(draw: Callable[[Axes], None]) -> tuple[str, str]:
    with style(), rc_context(_INK):
        figure, axes = new_figure(width=4.2, height=2.2)
        figure.set_layout_engine("constrained")
        figure.patch.set_alpha(0)
        axes.patch.set_alpha(0)
        draw(axes)
        with io.BytesIO() as file:
            figure.savefig(file, format="svg", metadata={"Date": None})
            light = file.getvalue().decode()
    dark = re.sub("|".join(_DARK), lambda found: _DARK[found[0]], light)
    return address(light.encode(), "image/svg+xml"), address(dark.encode(), "image/svg+xml")
