"""The parts of a scene: smarticle, container, contact, fidelity, phases, recording. Each is validated and frozen.

SI units throughout. Every key carries its unit in its name or in its description.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from dem.particle import Boxes

LONGEST_LENGTH = 1.0  # m; a longer smarticle or container is taken for a mistaken unit


class Part(BaseModel):
    """A frozen part of a scene: no unknown keys, no NaN, no infinity, no silent conversion of text to numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, data: Any) -> Any:
        if isinstance(data, Mapping):
            for key in data:
                if key not in cls.model_fields:
                    msg = f"unknown key {key!r}; {cls._nearest(str(key))}"
                    raise ValueError(msg)
        return data

    @classmethod
    def _nearest(cls, key: str) -> str:
        """The way out for an unknown key: a key of this part that is spelt alike, or of the part it belongs in."""
        here = difflib.get_close_matches(key, cls.model_fields, n=1, cutoff=0.7)
        if here:
            return f"did you mean {here[0]!r}?"
        for part in Part.__subclasses__():
            there = difflib.get_close_matches(key, part.model_fields, n=1, cutoff=0.65)
            if there:
                return f"{there[0]!r} belongs in {part.__name__.lower()}"
        return "known keys: " + ", ".join(cls.model_fields)

    @model_validator(mode="before")
    @classmethod
    def _refuse_other_kinds_as_numbers(cls, data: Any) -> Any:
        # YAML reads `yes` and `on` as true, and true would pass as 1; "0.4" in quotes would pass as 0.4.
        if isinstance(data, Mapping):
            for key, value in data.items():
                field = cls.model_fields.get(str(key))
                if field is None:
                    continue
                for item in value if isinstance(value, list) else [value]:
                    if isinstance(item, bool) and field.annotation is not bool:
                        msg = f"{key}: got the boolean {str(item).lower()}, expected {_kind(field.annotation)}"
                        raise ValueError(msg)
                    if isinstance(item, str) and _kind(field.annotation) == "a number":
                        msg = f"{key}: got the text {item!r}, expected a number; leave out the quotes and the unit"
                        raise ValueError(msg)
        return data


_NUMBERS = (int, float, float | None, int | None, tuple[float, float])


def _kind(annotation: Any) -> str:
    return "a number" if annotation in _NUMBERS else "a value of its kind"


def _refuse_wrong_unit(value: float | None) -> float | None:
    if value is not None and value > LONGEST_LENGTH:
        msg = (
            f"{value:g} means {value:g} m, which no smarticle scene needs; "
            f"lengths are in metres: for {value:g} mm write {value / 1000:g}"
        )
        raise ValueError(msg)
    return value


Length = Annotated[float, Field(gt=0)]
Duration = Annotated[float, Field(gt=0)]


class Smarticle(Part):
    """Geometry and material of one smarticle."""

    middle_length_m: Length = Field(0.0117, description="w, length of the middle link, hinge to hinge [m]")
    aspect_ratio: float = Field(0.7, ge=0, le=2, description="l/w, barb length over middle length [1]")
    thickness_normal_m: Length = Field(
        1.27e-3, description="t1, thickness along the normal of the smarticle's plane [m]"
    )
    thickness_in_plane_m: Length = Field(0.5e-3, description="t2, thickness in the smarticle's plane [m]")
    density_kg_per_m3: float = Field(
        7850.0,
        gt=0,
        description="density of the links [kg/m³]; mass and inertia are those of the boxes",
    )
    angles_deg: tuple[float, float] = Field(
        (90.0, 90.0),
        description="barb angles (α1, α2) [deg]: 0 straight, 90 the U; from -15 to 105",
    )

    _length_unit = field_validator("middle_length_m", "thickness_normal_m", "thickness_in_plane_m")(_refuse_wrong_unit)

    @field_validator("density_kg_per_m3")
    @classmethod
    def _density_unit(cls, value: float) -> float:
        if not 50 <= value <= 25000:
            msg = f"{value:g} kg/m³ is outside 50 … 25000 kg/m³; density is in kg/m³: steel is 7850, not 7.85"
            raise ValueError(msg)
        return value

    @field_validator("angles_deg")
    @classmethod
    def _angle_range(cls, value: tuple[float, float]) -> tuple[float, float]:
        for angle in value:
            if not -15 <= angle <= 105:
                msg = f"{angle:g}° is outside -15° … 105°, the range of the hinges"
                raise ValueError(msg)
        return value

    @model_validator(mode="after")
    def _barbs_apart(self) -> Self:
        inward = -sum(math.cos(math.radians(angle)) for angle in self.angles_deg if angle > 90)
        free = self.middle_length_m * (1 - self.aspect_ratio * inward) - self.thickness_in_plane_m
        if free < 0:
            msg = (
                f"angles_deg: at {self.angles_deg[0]:g}° and {self.angles_deg[1]:g}° the barbs of l/w = "
                f"{self.aspect_ratio:g} cross; use angles nearer to 90° or a smaller aspect_ratio"
            )
            raise ValueError(msg)
        return self

    @model_validator(mode="after")
    def _thinner_than_long(self) -> Self:
        thickest = max(self.thickness_normal_m, self.thickness_in_plane_m)
        if thickest > self.middle_length_m / 2:
            msg = (
                f"thickness {thickest:g} m is more than half of middle_length_m = {self.middle_length_m:g} m; "
                "a smarticle is a chain of thin links"
            )
            raise ValueError(msg)
        return self

    @property
    def boxes(self) -> Boxes:
        """Exact geometry, mass and inertia."""
        return Boxes(
            middle_length=self.middle_length_m,
            barb_length=self.aspect_ratio * self.middle_length_m,
            thickness_normal=self.thickness_normal_m,
            thickness_in_plane=self.thickness_in_plane_m,
            density=self.density_kg_per_m3,
            angles=(math.radians(self.angles_deg[0]), math.radians(self.angles_deg[1])),
        )


class Container(Part):
    """Upright hollow cylinder, closed at the bottom, open at the top."""

    radius_m: Length = Field(0.0234, description="inner radius [m]; the paper's is 2w")
    height_m: float | None = Field(
        None, gt=0, description="height of the wall [m]; by default high enough for the pour"
    )

    _length_unit = field_validator("radius_m", "height_m")(_refuse_wrong_unit)


class Contact(Part):
    """Contact of smarticles with each other and with the container."""

    friction_smarticle: float = Field(0.4, ge=0, le=10, description="Coulomb coefficient, smarticle-smarticle [1]")
    friction_wall: float = Field(0.4, ge=0, le=10, description="Coulomb coefficient, smarticle-container [1]")
    restitution: float = Field(
        0.7,
        ge=0.01,
        le=1,
        description="normal restitution of a single contact at a typical lever, where the effective mass is the "
        "harmonic mean over the smarticle's spheres and directions [1]; 0.7: steel on steel below 1 m/s",
    )
    tangential_stiffness_ratio: float = Field(
        0.82, gt=0, le=1, description="ks/kn [1]; Mindlin's 2(1-ν)/(2-ν) is 0.82 for steel, ν = 0.3"
    )
    tangential_damping_ratio: float = Field(
        0.9,
        ge=0,
        le=1,
        description="cs/cn of a sticking contact [1]; √(ks/kn) = 0.9 damps both directions by the same ratio",
    )


class Fidelity(Part):
    """Knobs of accuracy against cost; none of them changes mass or inertia."""

    base: Literal["draft", "standard", "reference"] = Field(
        "standard", description="named setting that the other knobs start from"
    )
    rows: int = Field(..., ge=1, le=4, description="rows of spheres across t1, the thickness along the normal [1]")
    diameter_m: float | None = Field(
        None,
        gt=0,
        description="sphere diameter [m]; default: one row such that two crossing chains touch at the same mean "
        "distance as two bars of the true section, 2(t1+t2)/π; several rows t2, the true section",
    )
    pitch: float = Field(
        ...,
        gt=0,
        le=1.4,
        description="largest distance of neighbouring spheres over their diameter [1]; "
        "from √2 on chains pass through each other",
    )
    stiffness_N_per_m: float = Field(..., gt=0, description="normal stiffness kn of one contact [N/m]")
    time_step_fraction: float = Field(
        ...,
        gt=0,
        le=1,
        description="time step over the stable one, which is computed from masses and stiffness [1]",
    )
    time_step_s: float | None = Field(
        None,
        gt=0,
        description="time step [s] by hand; refused above the stable one; default: from the fraction",
    )
    wall_facets: int = Field(64, ge=16, le=512, description="flat facets around the cylinder's wall [1]")


FIDELITIES: Mapping[str, Mapping[str, Any]] = {
    "draft": {"rows": 1, "pitch": 1.3, "stiffness_N_per_m": 250.0, "time_step_fraction": 0.9},
    "standard": {"rows": 1, "pitch": 1.0, "stiffness_N_per_m": 500.0, "time_step_fraction": 0.9},
    "reference": {"rows": 2, "pitch": 1.0, "stiffness_N_per_m": 500.0, "time_step_fraction": 0.9},
}


class Settle(Part):
    """When a pile counts as settled: all hold at every look over a stretch of time."""

    speed_m_per_s: float = Field(0.02, gt=0, description="largest speed of any smarticle [m/s]")
    unbalanced_force: float = Field(0.05, gt=0, description="mean net force on a smarticle over its weight [1]")
    hold_s: float = Field(0.05, ge=0, description="how long both must hold [s]")
    timeout_s: Duration = Field(5.0, description="longest wait [s]; then the run fails with the residuals")


class Deposit(Part):
    """Pour smarticles in layers of random, non-overlapping poses just above the pile, then wait until it settles."""

    type: Literal["deposit"]
    per_layer: int = Field(10, ge=1, description="smarticles per layer [1]")
    layer_height_w: float = Field(
        1.0,
        gt=0,
        le=10,
        description="height of the slab above the pile that a layer is spread over, in units of w [1]",
    )
    landed_speed_m_per_s: float = Field(
        0.2,
        gt=0,
        description="a layer has come down when each of its smarticles touches something "
        "and falls slower than this [m/s]",
    )
    settle: Settle = Field(default_factory=Settle, description="when the poured pile counts as settled")


class Relax(Part):
    """Let the pile rest; nothing acts but gravity."""

    type: Literal["relax"]
    duration_s: Duration = Field(0.5, description="length of the phase [s]")


class Shake(Part):
    """Shake the whole container along the vertical, z = A sin(2πft) with A = Γg/(2πf)²."""

    type: Literal["shake"]
    duration_s: Duration = Field(20.0, description="length of the phase [s]")
    frequency_hz: float = Field(30.0, gt=0, le=2000, description="f, frequency [Hz]")
    peak_acceleration_g: float = Field(2.0, ge=0, le=100, description="Γ, peak acceleration in units of gravity [1]")


Phase = Annotated[Deposit | Relax | Shake, Field(discriminator="type")]


class Recording(Part):
    """What is written, and how often."""

    frame_interval_s: float = Field(
        0.04,
        gt=0,
        description="time between VTK frames [s]; not a multiple of the shaking period, to sample all its phases",
    )
    series_interval_s: float = Field(0.004, gt=0, description="time between samples of the HDF5 series [s]")
    checkpoint_interval_s: float | None = Field(
        0.4,
        gt=0,
        description="simulated time between checkpoints [s]; null: none. At a checkpoint the run reloads itself, so "
        "that a resumed run has the same bits; runs with other intervals differ in their last bits",
    )
