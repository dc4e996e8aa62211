"""Colours of exported bodies: any field by the palette of the pictures, and the colours of what is not a smarticle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import to_rgb

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.export.fields import Field, checked_field, link_values
from postprocess.pictures.colouring import Colouring, ColourScale

if TYPE_CHECKING:
    from numpy.typing import NDArray

ALIASES: Mapping[str, str] = MappingProxyType({"speed": "speed_m_per_s", "height": "height_m", "id": "smarticle_id"})
"""What pictures call some of the fields."""

UNKNOWN = (201, 201, 201)
"""Where a field has no value."""


@dataclass(frozen=True)
class Paint:
    """Colour of a kind of body, as hexadecimal sRGB, and how much of it hides what is behind [-]."""

    colour: str
    opacity: float = 1.0


PAINTS: Mapping[str, Paint] = MappingProxyType(
    {
        "smarticles": Paint("#ffffff"),  # under the colours of a field
        "wall": Paint("#9db4c8", 0.22),
        "floor": Paint("#e9e9e7"),
        "hooks": Paint("#b3261e"),
        "strings": Paint("#5b4636"),
        "crossings": Paint("#1a1a1a"),
        "forces": Paint("#a11a2e"),
    }
)
"""As in the pictures."""


def colour_field(name: str | None, run: Run) -> Field:
    """The field to colour by: crossings, or of motion in a plane, which has none, the number of the smarticle.

    Raises:
        InputError: It is no field, or the run has no such.
    """
    usual = "smarticle_id" if run.manifest.planar else "crossings"
    field = checked_field(usual if name is None else ALIASES.get(name, name))
    if not field.told_of(run):
        msg = f"{run.path}: this run has no {field.name} ({field.meaning}); choose another field to colour by"
        raise InputError(msg)
    return field


def scalars(field: Field, frame: Frame, run: Run) -> NDArray[np.float64]:
    """(N, 3) values to colour by, one per link: of a vector its length; NaN where there is none."""
    values = link_values(field, frame, run)
    if values is None:
        return np.full((frame.count, 3), np.nan)
    return np.linalg.norm(values, axis=2) if values.ndim == 3 else np.asarray(values, dtype=np.float64)


def span(values: NDArray[np.float64]) -> tuple[float, float]:
    """The least and the greatest of the values that there are; 0 and 1 without any."""
    finite = values[np.isfinite(values)]
    return (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)


def scale(field: Field, bounds: tuple[float, float]) -> ColourScale:
    """The palette of a field for values between two bounds."""
    label = field.name if field.unit == "-" else f"{field.name} [{field.unit}]"
    colouring = Colouring(label=label, kind=field.kind, values=lambda _, __: np.empty(0))
    return ColourScale.of(colouring, *bounds)


def painted(palette: ColourScale, values: NDArray[Any]) -> NDArray[np.uint8]:
    """(n, 3) sRGB colours, 0 to 255, of (n,) values; grey where there is none."""
    known = np.isfinite(values)
    colours = np.full((len(values), 3), UNKNOWN, dtype=np.uint8)
    colours[known] = palette.colours(values[known])
    return colours


def linear(colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """SRGB colours as shares of light, 0 to 255: what glTF wants of the colours of points.

    Source:
        IEC 61966-2-1; glTF 2.0, section 3.9.2.
    """
    shares = colours / 255
    light = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
    return np.round(255 * light).astype(np.uint8)


def paint_of(kind: str) -> NDArray[np.uint8]:
    """(3,) sRGB colour of a kind of body, 0 to 255."""
    return np.round(255 * np.array(to_rgb(PAINTS[kind].colour))).astype(np.uint8)
