"""The container: an upright cylinder with a floor, or several coaxial cylinders, narrower upwards."""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Self

import numpy as np
from pydantic import Field, model_validator

from dem.arrays import Array
from dem.setting.part import Length, Part


class Tier(Part):
    """One of several coaxial cylinders that stand on each other."""

    radius_m: Length = Field(..., description="inner radius [m]; at most that of the tier below")
    height_m: Length = Field(..., description="height of this tier alone [m]")


class Container(Part):
    """Upright hollow cylinder, closed at the bottom, open at the top; or a mould of several tiers."""

    radius_m: Length = Field(0.0234, description="inner radius [m]; the paper's is 2w")
    height_m: Length | None = Field(None, description="height of the wall [m]; by default high enough for the pour")
    packing_radius_m: Length | None = Field(
        None,
        description="radius for packing fractions [m]; default: radius_m; the paper's own code uses a radius other "
        "than that of its wall",
    )

    tiers: tuple[Tier, ...] | None = Field(
        None,
        min_length=1,
        description="instead of radius_m and height_m: coaxial cylinders from the bottom up, none wider than the one "
        "below; a flat ceiling closes each step, the top tier is open",
    )

    @model_validator(mode="before")
    @classmethod
    def _size_of_tiers(cls, data: Any) -> Any:
        # Tiers set radius_m to the widest radius, and height_m to the sum of their heights.
        try:
            radii, heights = ([0.0 + tier[key] for tier in data["tiers"]] for key in ("radius_m", "height_m"))
            size = {"radius_m": radii[0], "height_m": math.fsum(heights)}
        except (KeyError, IndexError, TypeError):
            return data  # no tiers, or validation reports what is wrong with them
        if min(*radii, *heights) <= 0:
            return data
        return size | {key: value for key, value in data.items() if value is not None}

    @model_validator(mode="after")
    def _narrower_upwards(self) -> Self:
        tiers = self.tiers or ()
        if tiers and self.packing_radius_m is not None:
            msg = f"packing_radius_m: {self.packing_radius_m:g} m, but tiers have no packing fraction; leave it out"
            raise ValueError(msg)
        for number, (below, tier) in enumerate(pairwise(tiers), 1):
            if tier.radius_m > below.radius_m:
                raise ValueError(
                    f"tiers.{number}.radius_m: {tier.radius_m:g} m is wider than the tier below, {below.radius_m:g} m; "
                    "a mould is filled from the top and lifted off: order tiers from wide to narrow"
                )
        if tiers:
            whole = math.fsum(tier.height_m for tier in tiers)
            for key, own in (("radius_m", tiers[0].radius_m), ("height_m", whole)):
                given = getattr(self, key)
                if given is not None and not math.isclose(given, own, rel_tol=1e-9):
                    raise ValueError(f"{key}: {given:g} m, but tiers give {own:g} m; leave {key} out")
        return self

    @property
    def measured_radius(self) -> float:
        """Radius r in packing fractions [m]: `packing_radius_m` if it is given, otherwise `radius_m`."""
        return self.radius_m if self.packing_radius_m is None else self.packing_radius_m


@dataclass(frozen=True, kw_only=True)
class Cylinder:
    """The container of a simulation, its wall made of flat facets. Lengths in m."""

    radius: float  #: Inner radius of the wall, or of its lowest tier
    height: float  #: Height of the wall's top above the floor
    facets: int  #: Number of flat facets around the wall
    #: Height of the lower end above the floor, and radius, of each tier except the lowest, from below
    upper: tuple[tuple[float, float], ...] = ()

    @property
    def corner_radius(self) -> float:
        """Distance of the wall's vertical edges from the axis [m]; facets enclose the area π `radius`²."""
        return self.corner_radius_of(self.radius)

    def corner_radius_of(self, radius: float) -> float:
        """Return the distance [m] of the wall's vertical edges from the axis, for a tier with this radius [m]."""
        turn = 2 * math.pi / self.facets
        return radius * math.sqrt(turn / math.sin(turn))

    @property
    def inner_radius(self) -> float:
        """Distance of the wall's flats from the axis [m], slightly less than the radius."""
        return self.corner_radius * math.cos(math.pi / self.facets)

    @property
    def bottom(self) -> float:
        """Height [m] of the wall's lower edge from the floor at the start; negative, so below the floor."""
        return -0.1 * self.radius

    def radii(self, heights: Array) -> Array:
        """Return the container's radii [m] at heights above the floor [m], in the shape of `heights`.

        At the height where two tiers meet, the radius is that of the lower tier.
        """
        steps, radii = [bottom for bottom, _ in self.upper], [self.radius, *(radius for _, radius in self.upper)]
        return np.asarray(np.array(radii)[np.searchsorted(steps, heights, side="left")])

    def inner_radii(self, heights: Array) -> Array:
        """Return the distances [m] of the wall's flats from the axis at heights above the floor [m]."""
        return self.radii(heights) * (self.inner_radius / self.radius)
