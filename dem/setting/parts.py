"""The parts of a scene: smarticle, container, contact, fidelity, phases, recording. Each is validated and frozen.

SI units throughout. Every key carries its unit in its name or in its description.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from dem.body.particle import Boxes
from dem.phases.actuation import Actuate, InternalOscillation, ShapeChange
from dem.phases.chain import Arrange, Strain
from dem.phases.release import RemoveContainer
from dem.setting.hooks import PullHook
from dem.setting.part import Duration, Length, Part, in_hinge_range, refuse_wrong_unit


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

    _length_unit = field_validator("middle_length_m", "thickness_normal_m", "thickness_in_plane_m")(refuse_wrong_unit)

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
        return (in_hinge_range(value[0]), in_hinge_range(value[1]))

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

    @model_validator(mode="after")
    def _barbs_apart(self) -> Self:
        if self.tip_clearance(self.angles_deg) < 0:
            msg = (
                f"angles_deg: at {self.angles_deg[0]:g}° and {self.angles_deg[1]:g}° the barbs of l/w = "
                f"{self.aspect_ratio:g} cross; use angles nearer to 90° or a smaller aspect_ratio"
            )
            raise ValueError(msg)
        return self

    def tip_clearance(self, angles_deg: tuple[float, float]) -> float:
        """Free distance [m] between the barb tips at angles [deg] beyond 90°; negative: the barbs cross."""
        inward = -sum(math.cos(math.radians(angle)) for angle in angles_deg if angle > 90)
        return self.middle_length_m * (1 - self.aspect_ratio * inward) - self.thickness_in_plane_m

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


class Tier(Part):
    """One of several coaxial cylinders that stand on each other."""

    radius_m: Length = Field(..., description="inner radius [m]; at most that of the tier below")
    height_m: Length = Field(..., description="height of this tier alone [m]")

    _length_unit = field_validator("radius_m", "height_m")(refuse_wrong_unit)


class Container(Part):
    """Upright hollow cylinder, closed at the bottom, open at the top; or a mould of several tiers."""

    radius_m: Length = Field(0.0234, description="inner radius [m]; the paper's is 2w")
    height_m: float | None = Field(
        None, gt=0, description="height of the wall [m]; by default high enough for the pour"
    )

    tiers: tuple[Tier, ...] | None = Field(
        None,
        min_length=1,
        description="instead of radius_m and height_m: coaxial cylinders from the bottom up, none wider than the one "
        "below; a flat ceiling closes each step, the top tier is open",
    )

    _length_unit = field_validator("radius_m", "height_m")(refuse_wrong_unit)

    @model_validator(mode="before")
    @classmethod
    def _size_of_tiers(cls, data: Any) -> Any:
        # What needs one radius and one height takes the widest and the whole one.
        try:
            radii, heights = ([0.0 + tier[key] for tier in data["tiers"]] for key in ("radius_m", "height_m"))
            size = {"radius_m": radii[0], "height_m": math.fsum(heights)}
        except (KeyError, IndexError, TypeError):
            return data  # there are none, or validation says what is wrong with them
        if min(*radii, *heights) <= 0:
            return data
        return size | {key: value for key, value in data.items() if value is not None}

    @model_validator(mode="after")
    def _narrower_upwards(self) -> Self:
        tiers = self.tiers or ()
        for number, (below, tier) in enumerate(pairwise(tiers), 1):
            if tier.radius_m > below.radius_m:
                msg = (
                    f"tiers.{number}.radius_m: {tier.radius_m:g} m is wider than the tier below, {below.radius_m:g} m; "
                    "a mould is filled from the top and lifted off: order tiers from wide to narrow"
                )
                raise ValueError(msg)
        if tiers:
            whole = math.fsum(tier.height_m for tier in tiers)
            for key, given, own in (
                ("radius_m", self.radius_m, tiers[0].radius_m),
                ("height_m", self.height_m, whole),
            ):
                if given is not None and not math.isclose(given, own, rel_tol=1e-9):
                    msg = f"{key}: {given:g} m, but tiers make it {own:g} m; leave {key} out"
                    raise ValueError(msg)
        return self


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


class Motor(Part):
    """The motor of each hinge: velocity-controlled, of limited torque."""

    torque_limit_N_m: float | None = Field(
        None,
        gt=0,
        description="τ_max [N m]; default: the weight of the smarticle with l/w = 0.7 of this material and section "
        "at the lever w",
    )
    speed_limit_rad_per_s: float = Field(6.0, gt=0, description="ω, greatest speed of a motor [rad/s]")
    law: Literal["halt", "stall", "slip", "servo"] = Field(
        "halt",
        description="at τ_max or above: halt: the motor stops advancing towards the load and holds; stall: it does not "
        "move in either direction, the paper's rule to the letter; slip: it gives way, a spring capped at τ_max; "
        "servo: as slip, and damped: proportional and derivative gain, the torque as a whole capped at τ_max",
    )
    stiffness_N_m_per_rad: float = Field(
        3e-3, gt=0, description="twist stiffness of the shaft between motor and barb, a servo's gain [N m/rad]"
    )
    damping_N_m_s_per_rad: float = Field(0.0, ge=0, description="a servo's derivative gain [N m s/rad]")
    strength_spread: float = Field(
        0.0,
        ge=0,
        lt=1,
        description="τ_max and stiffness of each motor are multiplied by a factor of its own, drawn from the scene's "
        "seed, uniform within 1 ± this [1]",
    )

    @model_validator(mode="after")
    def _damps_as_a_servo(self) -> Self:
        if self.damping_N_m_s_per_rad and self.law != "servo":
            msg = (
                f"damping_N_m_s_per_rad: {self.damping_N_m_s_per_rad:g} N m s/rad, but law is {self.law}, which has "
                "none; use law: servo"
            )
            raise ValueError(msg)
        return self


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
    control_interval_s: float = Field(
        ..., gt=0, description="time between two looks of the motor control [s]; the paper's time step is 2e-4 s"
    )
    hinge_stiffness_N_per_m: float = Field(
        ..., gt=0, description="stiffness of the pin that holds the two links of a hinge together [N/m]"
    )


# The pin of standard and reference gives way by 1 % of a sphere's diameter under a pull of 100 times the own weight, up
# to l/w = 1; the softer one of draft allows longer time steps and gives way by as much in a pile that is actuated.
FIDELITIES: Mapping[str, Mapping[str, Any]] = {
    "draft": {
        "rows": 1,
        "pitch": 1.3,
        "stiffness_N_per_m": 250.0,
        "time_step_fraction": 0.9,
        "control_interval_s": 2e-4,
        "hinge_stiffness_N_per_m": 5000.0,
    },
    "standard": {
        "rows": 1,
        "pitch": 1.0,
        "stiffness_N_per_m": 500.0,
        "time_step_fraction": 0.9,
        "control_interval_s": 2e-4,
        "hinge_stiffness_N_per_m": 14500.0,
    },
    "reference": {
        "rows": 2,
        "pitch": 1.0,
        "stiffness_N_per_m": 500.0,
        "time_step_fraction": 0.9,
        "control_interval_s": 2e-4,
        "hinge_stiffness_N_per_m": 14500.0,
    },
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
    """Shake the whole container along the vertical, z = A sin(2πft) with A = Γg/(2πf)².

    After a phase that takes the container away, its floor alone is shaken, a plane without end: what rolls off the
    pile goes on being shaken.
    """

    type: Literal["shake"]
    duration_s: Duration = Field(20.0, description="length of the phase [s]")
    frequency_hz: float = Field(30.0, gt=0, le=2000, description="f, frequency [Hz]")
    peak_acceleration_g: float = Field(2.0, ge=0, le=100, description="Γ, peak acceleration in units of gravity [1]")


def shake_amplitude(phase: Shake, gravity: float) -> float:
    """A = Γ g / (2πf)² [m]."""
    return phase.peak_acceleration_g * gravity / (2 * math.pi * phase.frequency_hz) ** 2


Phase = Annotated[
    Deposit
    | Relax
    | Shake
    | Actuate
    | ShapeChange
    | InternalOscillation
    | RemoveContainer
    | PullHook
    | Arrange
    | Strain,
    Field(discriminator="type"),
]


class Recording(Part):
    """What is written, and how often."""

    frame_interval_s: float = Field(
        0.04,
        gt=0,
        description="time between VTK frames [s]; not a multiple of the shaking period, to sample all its phases",
    )
    sphere_interval_s: float | None = Field(
        None,
        gt=0,
        description="time between VTK files of the spheres that stand for the smarticles, for ParaView's glyphs [s]; "
        "null: none",
    )
    series_interval_s: float = Field(0.004, gt=0, description="time between samples of the HDF5 series [s]")
    energy: bool = Field(
        False,
        strict=True,
        description="whether to record energies and the work of the container as well as the motors'",
    )
    dissipation_interval_s: float | None = Field(
        None,
        gt=0,
        description="time between samples of what contacts dissipate [s], which closes the account of energies; null: "
        "none. A sample costs 10 µs per contact, as much as some twenty steps of a small pile; 2e-4 s is dense enough",
    )
    checkpoint_interval_s: float | None = Field(
        0.4,
        gt=0,
        description="simulated time between checkpoints [s]; null: none. At a checkpoint the run reloads itself, so "
        "that a resumed run has the same bits; runs with other intervals differ in their last bits",
    )

    def samples_in(self, interval_s: float | None) -> int:
        """Samples of the series in one of the other intervals [s]; 0 for none."""
        return round((interval_s or 0.0) / self.series_interval_s)

    @property
    def energies(self) -> bool:
        """Whether energies are recorded: asked for, or needed by the account."""
        return self.energy or self.dissipation_interval_s is not None
