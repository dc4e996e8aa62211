"""Geometry and material of one smarticle."""

import math
from typing import Self

from pydantic import Field, field_validator, model_validator

from dem.body.particle import Boxes
from dem.setting.part import Density, Length, Part, in_hinge_range


class Smarticle(Part):
    """Geometry and material of one smarticle."""

    middle_length_m: Length = Field(0.0117, description="w, length of the middle link, hinge to hinge [m]")
    aspect_ratio: float = Field(0.7, ge=0, le=2, description="l/w, barb length over middle length [1]")
    thickness_normal_m: Length = Field(
        1.27e-3, description="t1, thickness along the normal of the smarticle's plane [m]"
    )
    thickness_in_plane_m: Length = Field(0.5e-3, description="t2, thickness in the smarticle's plane [m]")
    middle_thickness_in_plane_m: Length | None = Field(
        None,
        description="thickness of the middle link in the smarticle's plane [m], where it differs from the barbs' as in "
        "robots with a body; centred on the line from hinge to hinge; only with the key plane and engine: yade; "
        "default: thickness_in_plane_m",
    )
    density_kg_per_m3: Density = Field(
        7850.0,
        description="density of the links [kg/m³]; mass and inertia are those of the boxes",
    )
    angles_deg: tuple[float, float] = Field(
        (90.0, 90.0),
        description="barb angles (α1, α2) [deg]: 0 straight, 90 the U; from -15 to 105",
    )

    @field_validator("angles_deg")
    @classmethod
    def _angle_range(cls, value: tuple[float, float]) -> tuple[float, float]:
        return (in_hinge_range(value[0]), in_hinge_range(value[1]))

    @model_validator(mode="after")
    def _thin_links_apart(self) -> Self:
        barbs, middle = self.thickness_in_plane_m, self.middle_thickness_in_plane_m
        thickest, msg = max(self.thickness_normal_m, barbs, middle or 0.0), ""
        if thickest > self.middle_length_m / 2:
            msg = (
                f"thickness {thickest:g} m is more than half of middle_length_m = {self.middle_length_m:g} m; "
                "a smarticle is a chain of thin links"
            )
        elif middle is not None and middle < barbs:
            msg = (
                f"middle_thickness_in_plane_m: {middle:g} m is less than thickness_in_plane_m = {barbs:g} m, that of "
                "the barbs; use as much at least, or leave it out"
            )
        elif self.tip_clearance(self.angles_deg) < 0:
            msg = (
                f"angles_deg: at {self.angles_deg[0]:g}° and {self.angles_deg[1]:g}° the barbs of l/w = "
                f"{self.aspect_ratio:g} cross; use angles nearer to 90° or a smaller aspect_ratio"
            )
        if msg:
            raise ValueError(msg)
        return self

    def tip_clearance(self, angles_deg: tuple[float, float]) -> float:
        """Return the gap between the barb tips [m] at angles of barb 1 and 2 [deg]; negative: the barbs cross.

        An angle below 90° is taken as 90°.
        """
        inward = -sum(math.cos(math.radians(angle)) for angle in angles_deg if angle > 90)
        return self.middle_length_m * (1 - self.aspect_ratio * inward) - self.thickness_in_plane_m

    @property
    def boxes(self) -> Boxes:
        """Exact geometry of the smarticle, with its mass and inertia."""
        return Boxes(
            middle_length=self.middle_length_m,
            barb_length=self.aspect_ratio * self.middle_length_m,
            thickness_normal=self.thickness_normal_m,
            thickness_in_plane=self.thickness_in_plane_m,
            middle_thickness_in_plane=self.middle_thickness_in_plane_m,
            density=self.density_kg_per_m3,
            angles=(math.radians(self.angles_deg[0]), math.radians(self.angles_deg[1])),
        )
