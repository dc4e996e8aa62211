"""The phase that straightens smarticles and bends them back."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from dem.phases.gaits.actuated import ActuatedPhase
from dem.phases.gaits.drive import Gait
from dem.setting.motion import Hold, Motion, Ramp, Return, Sequence
from dem.setting.motor import Motor
from dem.setting.part import Duration, HingeAngle, Part
from dem.setting.smarticle import Smarticle


class ShapeChange(Part, ActuatedPhase):
    """Straighten both barbs, and turn them back to the angles where they began."""

    type: Literal["shape-change"]
    straight_deg: HingeAngle = Field(0.0, description="angle that the barbs are turned to [deg]")
    opening_s: Duration = Field(1.5, description="time to get there [s]")
    straight_hold_s: float = Field(0.0, ge=0, le=1e6, description="time to stay there [s]")
    closing_s: Duration = Field(1.5, description="time to get back [s]")

    @property
    def duration_s(self) -> float:
        """Length of the phase [s]."""
        return self.opening_s + self.straight_hold_s + self.closing_s

    @property
    def known_duration(self) -> float:
        """See `Phase.known_duration`."""
        return self.duration_s

    def gait(self, smarticle: Smarticle, motor: Motor) -> Gait:
        """See `ActuatedPhase.gait`."""
        steps: list[Motion] = [Ramp(type="ramp", to_deg=self.straight_deg, duration_s=self.opening_s)]
        if self.straight_hold_s > 0:
            steps.append(Hold(type="hold", duration_s=self.straight_hold_s))
        steps.append(Return(type="return", duration_s=self.closing_s))
        motion = Sequence(type="sequence", steps=tuple(steps))
        return Gait(motions=(motion, motion), duration=motion.duration)

    def own(self, key: str) -> tuple[str, float | None]:
        """See `ActuatedPhase.own`."""
        name = "opening_s" if key == "barbs.steps.0.duration_s" else "closing_s"
        return name, getattr(self, name)
