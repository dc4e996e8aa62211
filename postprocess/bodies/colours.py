"""Colour bodies: smarticles by the values of a field, all other bodies by their kind."""

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal, Self

import numpy as np
from matplotlib.colors import Colormap, ListedColormap, Normalize, hsv_to_rgb, to_rgb
from numpy.typing import NDArray

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.bodies.fields import Field, checked_field, link_values
from postprocess.geometry.bars import entries
from postprocess.geometry.links import Floats
from postprocess.report import figures

ALIASES: Mapping[str, str] = MappingProxyType({"speed": "speed_m_per_s", "height": "height_m", "id": "smarticle_id"})
"""Fields by their short names."""

_MOST_COUNTS = 12  # larger counts have the colour of this one

# Of Okabe and Ito, distinct with common colour blindness, bright enough for shading.
_NAMED = ("#56b4e9", "#e69f00", "#009e73", "#f0e442", "#0072b2", "#d55e00", "#cc79a7")

UNKNOWN = (201, 201, 201)  #: Colour of a missing value

Span = tuple[float, float]


@dataclass(frozen=True)
class Paint:
    """Colour of a kind of body, as hexadecimal sRGB, and its opacity [-]."""

    colour: str
    opacity: float = 1.0

    @property
    def rgb(self) -> NDArray[np.uint8]:
        """Colour as sRGB, (3,) uint8."""
        return np.round(255 * np.array(to_rgb(self.colour))).astype(np.uint8)


PAINTS: Mapping[str, Paint] = MappingProxyType(
    {
        "smarticles": Paint("#ffffff"),  # multiplied by the colours of a field
        "wall": Paint("#9db4c8", 0.22),
        "floor": Paint("#e9e9e7"),
        "hooks": Paint("#b3261e"),
        "plate": Paint("#6d7f91", 0.35),
        "strings": Paint("#5b4636"),
        "crossings": Paint("#1a1a1a"),
        "forces": Paint("#a11a2e"),
    }
)


@dataclass(frozen=True, kw_only=True, eq=False)
class ColourScale:
    """Mapping from the values of a field to colours, with its colour bar or its legend."""

    kind: Literal["count", "value", "name"]  #: Kind of the field's values, see `Field.kind`
    colours: Colormap | None = None  #: Colour map of the bar; None for a field of kind "name", without bar
    low: float = 0.0  #: Value at the lower end of the bar
    high: float = 1.0  #: Value at the upper end of the bar
    #: Labels of the bar, or of the legend of a field of kind "name", by value
    labels: Mapping[float, str] = dataclasses.field(default_factory=dict)

    @classmethod
    def of(cls, field: Field, bounds: Span, runs: Sequence[Run] = ()) -> Self:
        """Return the colour scale of a field whose values lie between two bounds.

        The legend of a field of kind "name" has the names of its values in all given runs.
        """
        low, high = bounds
        if field.kind == "name":
            named: dict[int, list[str]] = {}
            for value, name in (each for run in runs if field.available_for(run) for each in field.names(run).items()):
                if name not in named.setdefault(value, []):
                    named[value].append(name)
            return cls(kind="name", labels={float(value): " or ".join(named[value]) for value in sorted(named)})
        if field.kind == "count":
            top = max(1, min(int(high), _MOST_COUNTS))
            labels = {float(count): str(count) for count in range(top + 1)}
            if int(high) > top:
                labels[float(top)] = f"{top}+"
            colours = ListedColormap(["#c9c9c9", *figures.sequence(top)])
            return cls(kind="count", colours=colours, low=-0.5, high=top + 0.5, labels=labels)
        if not high > low:  # all values are equal
            low, high = low - 0.5, high + 0.5
        factor = field.shown[0] if field.shown else 1.0
        labels = {float(value): f"{factor * value:.3g}" for value in np.linspace(low, high, 5)}
        return cls(kind="value", colours=ListedColormap(figures.sequence(256)), low=low, high=high, labels=labels)

    def painted(self, values: NDArray[Any]) -> NDArray[np.uint8]:
        """Return the sRGB colours (…, 3) uint8 of values (…); grey for a value that is not finite."""
        values = np.asarray(values, dtype=np.float64)
        known = np.isfinite(values)
        found = np.full((*values.shape, 3), UNKNOWN, dtype=np.uint8)
        if self.colours is None:
            # Golden-ratio steps give successive numbers very different hues.
            hue = (values[known] * (math.sqrt(5) - 1) / 2) % 1
            tone = np.stack([hue, np.full_like(hue, 0.50), np.full_like(hue, 0.88)], axis=-1)
            found[known] = (255 * hsv_to_rgb(tone)).astype(np.uint8)
            for number, colour in enumerate(_NAMED if self.labels else ()):
                found[values == number] = Paint(colour).rgb
        else:
            places = Normalize(self.low, self.high, clip=True)(values[known])
            found[known] = self.colours(np.asarray(places), bytes=True)[..., :3]
        return found


def colour_field(name: str | None, run: Run) -> Field:
    """Return the field of a run by its name, or by its short name in `ALIASES`.

    If the name is None, the field of smarticles is "crossings", or "smarticle_id" in a planar run. The field of other
    bodies is then "contacts", or "entry" if the scene lists several bodies. InputError if the name is unknown, or the
    run lacks the field.
    """
    usual = "smarticle_id" if run.manifest.planar else "crossings"
    if run.manifest.kinds is not None:
        usual = "contacts" if len(set(entries(run))) == 1 else "entry"
    field = checked_field(usual if name is None else name, ALIASES)
    if not field.available_for(run):
        msg = f"{run.path}: this run has no {field.name} ({field.meaning}); choose another field to colour by"
        raise InputError(msg)
    return field


def scalars(field: Field, frame: Frame, run: Run) -> Floats:
    """Return a field as one number per link, (N, L), see `link_values`.

    A vector is replaced by its length. All numbers are NaN if the frame lacks the field.
    """
    values = link_values(field, frame, run)
    if values is None:
        return np.full((frame.count, 1 + int(frame.link.max(initial=2))), np.nan)
    return np.linalg.norm(values, axis=2) if values.ndim == 3 else np.asarray(values, dtype=np.float64)


def span(values: Iterable[Floats]) -> Span:
    """Return the least and the greatest of all finite values in several arrays; (0, 1) if there are none."""
    finite = [each[np.isfinite(each)] for each in values]
    joined = np.concatenate([np.empty(0), *finite])
    return (float(joined.min()), float(joined.max())) if joined.size else (0.0, 1.0)


def linear(colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Convert sRGB colours to linear colours, which glTF uses for vertices; both are uint8.

    Source:
        IEC 61966-2-1; glTF 2.0, section 3.9.2.
    """
    values = colours / 255
    light = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    return np.round(255 * light).astype(np.uint8)
