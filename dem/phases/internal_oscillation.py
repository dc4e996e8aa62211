"""The phase that swings barbs at their motors' speed."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from dem.phases.actuate import ActiveFraction, Offsets
from dem.phases.gaits.actuated import ActuatedPhase
from dem.phases.gaits.drive import Gait
from dem.setting.motion import Triangle
from dem.setting.motor import Motor
from dem.setting.part import REFERENCE_ASPECT_RATIO, Duration, Part
from dem.setting.smarticle import Smarticle


class InternalOscillation(Part, ActuatedPhase):
    """Swing both barbs at the motor's speed limit, θ/2 to either side of the smarticle's own angles."""

    type: Literal["internal-oscillation"]
    theta_deg: float = Field(..., ge=1e-6, le=240, description="θ, full swing, peak to peak [deg]")
    scaled: bool = Field(
        True,
        description="swing by θ · 0.7/(l/w) instead, so that the arc of a barb's tip is the same for every l/w",
    )
    duration_s: Duration = Field(5.0, description="length of the phase [s]")
    active_fraction: ActiveFraction = 1.0
    offsets: Offsets = "none"

    @property
    def known_duration(self) -> float:
        """See `Phase.known_duration`."""
        return self.duration_s

    def gait(self, smarticle: Smarticle, motor: Motor) -> Gait:
        """See `ActuatedPhase.gait`."""
        scale = REFERENCE_ASPECT_RATIO / smarticle.aspect_ratio if self.scaled else 1.0
        barb_1, barb_2 = (
            Triangle(
                type="triangle",
                centre_deg=angle,
                amplitude_deg=self.theta_deg / 2 * scale,
                speed_rad_per_s=motor.speed_limit_rad_per_s,
            )
            for angle in smarticle.angles_deg
        )
        return Gait(
            motions=(barb_1, barb_2),
            keys=("barb_1", "barb_2"),
            duration=self.duration_s,
            active_fraction=self.active_fraction,
            offsets=self.offsets,
        )

    def own(self, key: str) -> tuple[str, float | None]:
        """See `ActuatedPhase.own`."""
        return "theta_deg", self.theta_deg
