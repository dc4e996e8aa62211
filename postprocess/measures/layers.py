"""Measure how the material of a pile is spread over the height: mass and packing fraction of horizontal layers."""

import math
from dataclasses import dataclass, field

import numpy as np

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.bars import body_volumes
from postprocess.geometry.links import Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class HeightProfile:
    """Material of Z horizontal layers, from the floor up."""

    edges_m: Floats = field(repr=False)  #: (Z + 1,) heights of the layers' edges above the floor [m]
    mass_kg: Floats = field(repr=False)  #: (Z,) mass of bodies in each layer [kg]
    volume_m3: Floats = field(repr=False)  #: (Z,) solid volume of bodies in each layer [m³]
    #: (Z,) packing fraction φ of each layer of the cylinder [-]; NaN if the pile is not in one cylinder
    packing: Floats = field(repr=False)

    @property
    def heights_m(self) -> Floats:
        """(Z,) heights of the layers' middles above the floor [m]."""
        middles: Floats = (self.edges_m[:-1] + self.edges_m[1:]) / 2
        return middles


def height_profile(frame: Frame, run: Run, *, layer: float | None = None) -> HeightProfile:
    """Compute mass, solid volume and packing fraction over the height for bodies of any shape.

    The material of each link, or bar, is spread evenly along its axis. Material below the floor is in the lowest layer.

    Args:
        frame: A frame.
        run: Its run.
        layer: Thickness of the layers [m]; left out: a twentieth of the pile's height.

    Raises:
        InputError: The thickness is not above 0, or the layers are more than 100 000.
    """
    z = frame.segments[..., 2] - frame.floor_z
    low, high = np.maximum(z.min(axis=1), 0.0), np.maximum(z.max(axis=1), 0.0)
    top = float(high.max(initial=0.0))
    layer = (top or 1.0) / 20 if layer is None else layer
    if not (0 < layer < math.inf and top / layer <= 100_000):
        raise InputError(
            f"layer: {layer:g} m, for a pile of {top:g} m; give a thickness above 0 m and below the height"
        )
    edges = layer * np.arange(max(1, math.ceil(top / layer - 1e-9)) + 1.0)
    # A horizontal link would divide by 0; a small span puts it into one layer.
    span = np.maximum(high - low, 1e-9 * layer)
    below = np.clip((edges[:, None] - low) / span, 0, 1)
    below[0], below[-1] = 0.0, 1.0
    bodies, links = frame.bodies, frame.links
    volumes = links.mass_kg * (body_volumes(frame, run) / bodies.mass_kg)[links.body]
    volume = np.diff(below @ volumes)
    area = math.pi * run.manifest.measured_radius_m**2 if run.manifest.fills_cylinder(frame.phase) else math.nan
    return HeightProfile(
        edges_m=edges, mass_kg=np.diff(below @ links.mass_kg), volume_m3=volume, packing=volume / (area * layer)
    )
