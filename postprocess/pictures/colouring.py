"""What the colours of a picture mean, and the colour bar that says so."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from textwrap import wrap
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize, hsv_to_rgb
from matplotlib.ticker import FuncFormatter

from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.links import centres_of_mass, link_lengths
from postprocess.measures.entanglement import link_crossings
from postprocess.report import figures

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray


_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True, kw_only=True)
class Colouring:
    """What the colour of a smarticle means.

    Attributes:
        label: For the colour bar, with the unit.
        kind: "count" for whole numbers, "value" for a continuous quantity, "name" for identity.
        values: (N,) of a frame of a run.
    """

    label: str
    kind: Literal["count", "value", "name"]
    values: Callable[[Frame, Run], NDArray[Any]]


def _height(frame: Frame, _: Run) -> NDArray[np.float64]:
    return (centres_of_mass(frame.vertices)[:, 2] - frame.floor_z) * 1e3


def _speed(frame: Frame, run: Run) -> NDArray[np.float64]:
    sections = np.array(run.manifest.thicknesses_in_plane_m) / run.manifest.thickness_in_plane_m
    weights = (link_lengths(frame.vertices) * sections)[:, :, None]
    velocity = (weights * frame.link_velocity).sum(axis=1) / weights.sum(axis=1)
    speed: NDArray[np.float64] = np.linalg.norm(velocity, axis=1)
    return speed


COLOURINGS: Mapping[str, Colouring] = MappingProxyType(
    {
        "crossings": Colouring(
            label="links of others through its plane",
            kind="count",
            values=lambda frame, _: link_crossings(frame.vertices),
        ),
        "contacts": Colouring(label="smarticles that it touches", kind="count", values=lambda frame, _: frame.contacts),
        "height": Colouring(label="height of its centre of mass [mm]", kind="value", values=_height),
        "speed": Colouring(label="speed of its centre of mass [m/s]", kind="value", values=_speed),
        "id": Colouring(label="smarticle", kind="name", values=lambda frame, _: frame.smarticle_ids),
    }
)
"""What `color_by` can be."""


class ColourScale:
    """Turns values into colours and draws the colour bar that says so."""

    def __init__(
        self,
        mappable: ScalarMappable | None,
        ticks: tuple[int, ...] = (),
        labels: tuple[str, ...] = (),
    ) -> None:
        self._mappable = mappable
        self._ticks = ticks
        self._labels = labels

    @classmethod
    def of(cls, colouring: Colouring, low: float, high: float) -> Self:
        """The scale for values between two bounds, in the colouring's unit."""
        if colouring.kind == "count":
            counts = figures.count_colours(int(high))
            return cls(ScalarMappable(counts.norm, counts.colours), counts.ticks, counts.labels)
        if colouring.kind == "value":
            if not high > low:  # one smarticle, or all alike
                low, high = low - 0.5, high + 0.5
            return cls(ScalarMappable(Normalize(low, high), ListedColormap(figures.sequence(256))))
        return cls(None)

    def colours(self, values: NDArray[Any]) -> NDArray[np.uint8]:
        """Colours (n, 3), 0 to 255, of (n,) values."""
        if self._mappable is None:
            return _identity_colours(values)
        colours: NDArray[np.uint8] = self._mappable.to_rgba(values, bytes=True)[:, :3]
        return colours

    @property
    def keys(self) -> NDArray[np.uint8]:
        """(n, 3) colours, 0 to 255, by which the bar is read; none where the colours only tell identity."""
        if self._mappable is None:
            return np.empty((0, 3), dtype=np.uint8)
        if self._ticks:
            return self.colours(np.array(self._ticks))
        colours: NDArray[np.uint8] = np.round(255 * self._mappable.cmap(np.linspace(0, 1, 48))[:, :3]).astype(np.uint8)
        return colours

    def draw(self, figure: Figure, label: str, unit: float, *, right: float = 0.0) -> None:
        """Draws the bar at the right edge, unless the colours only tell identity.

        Args:
            figure: Where to.
            label: What the colours mean.
            unit: What text is measured by [pixel].
            right: What to leave free at the edge [pixel].
        """
        if self._mappable is None:
            return
        width, whole = (side * figure.dpi for side in figure.get_size_inches())
        height = min(0.055 * len(self._ticks), 0.46) if self._ticks else 0.46
        axes = figure.add_axes((1 - (11.5 * unit + right) / width, 0.47 - height / 2, 2.4 * unit / width, height))
        bar = figure.colorbar(self._mappable, cax=axes)
        bar.minorticks_off()
        bar.outline.set_linewidth(0.08 * unit)
        axes.tick_params(labelsize=1.8 * unit, length=0.7 * unit, width=0.12 * unit)
        if not self._ticks:
            power = _power(self._mappable.get_clim())
            bar.formatter = FuncFormatter(lambda value, _: f"{value / 10.0**power:.6g}")
            label = label.replace("[", f"[10{str(power).translate(_RAISED)} ") if power else label
        # Broken where it is longer than the picture is high.
        lines = wrap(label, max(12, int(0.8 * whole / (0.62 * 1.9 * unit))))
        bar.set_label("\n".join(lines), fontsize=1.9 * unit, labelpad=0.9 * unit, parse_math=False)
        if self._ticks:
            bar.set_ticks(list(self._ticks), labels=list(self._labels))
            axes.tick_params(length=0)


def _power(ends: tuple[float | None, float | None]) -> int:
    """The power of ten by which the numbers of a bar are divided, so that they are short; 0 for handy ones."""
    largest = max(abs(end or 0.0) for end in ends)
    power = math.floor(math.log10(largest)) if largest > 0 else 0
    return 0 if -1 <= power <= 3 else power


def _identity_colours(identifiers: NDArray[Any]) -> NDArray[np.uint8]:
    """Bright colours that differ between neighbours in number: golden-ratio steps of the hue."""
    hue = (np.asarray(identifiers, dtype=np.float64) * (math.sqrt(5) - 1) / 2) % 1
    tone = np.stack([hue, np.full_like(hue, 0.50), np.full_like(hue, 0.88)], axis=-1)
    colours: NDArray[np.uint8] = (255 * hsv_to_rgb(tone)).astype(np.uint8)
    return colours
