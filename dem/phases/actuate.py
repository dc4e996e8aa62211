"""Phases that move barbs: by motions of the scene, a shape change, or an internal oscillation."""

import math
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from dem.phases.actuated import BARBS, ActuatedPhase, Gait
from dem.setting.motion import Hold, Motion, Ramp, Return, Sequence, Triangle
from dem.setting.motor import Motor
from dem.setting.part import REFERENCE_ASPECT_RATIO, Duration, HingeAngle, Part
from dem.setting.smarticle import Smarticle

ActiveFraction = Annotated[
    float, Field(ge=1e-6, le=1, description="fraction of the smarticles that move, drawn from the scene's seed [1]")
]
Offsets = Annotated[
    Literal["none", "random"],
    Field(
        description="none: all smarticles move together; random: each begins at a point of the period that is drawn "
        "from the scene's seed"
    ),
]


def _length_of_motions(data: dict[str, Any]) -> float:
    """Return the longest duration of the motions of an `actuate` phase [s]; inf if one has no end.

    `data` are the phase's fields; motions are under `barbs`, `barb_1` and `barb_2`.
    """
    motions = [data[key] for key in ("barbs", "barb_1", "barb_2") if data.get(key) is not None]
    return max((motion.duration for motion in motions), default=math.inf)


class Actuate(Part, ActuatedPhase):
    """Move the barbs: by one motion for both, key `barbs`, or by two motions, `barb_1` and `barb_2`."""

    type: Literal["actuate"]
    barbs: Motion | None = Field(None, description="motion of both barbs")
    barb_1: Motion | None = Field(None, description="motion of barb 1, angle α1")
    barb_2: Motion | None = Field(None, description="motion of barb 2, angle α2")
    duration_s: Duration = Field(
        default_factory=_length_of_motions, description="length of the phase [s]; default: that of the longest motion"
    )
    active_fraction: ActiveFraction = 1.0
    offsets: Offsets = "none"

    @model_validator(mode="after")
    def _one_motion_each(self) -> Self:
        apart = (self.barb_1 is not None) + (self.barb_2 is not None)
        if self.barbs is not None and apart:
            msg = "barbs: one motion for both barbs, but barb_1 or barb_2 is given as well; leave one or the other out"
            raise ValueError(msg)
        if self.barbs is None and apart != BARBS:
            missing = "barbs" if not apart else "barb_1" if self.barb_1 is None else "barb_2"
            msg = f"{missing}: missing; give barbs, or both barb_1 and barb_2 ({{type: hold}} for one that stays)"
            raise ValueError(msg)
        return self

    @model_validator(mode="after")
    def _motions_fill_the_phase(self) -> Self:
        if math.isinf(self.duration_s):
            msg = "duration_s: missing, and the motion has no end of its own; give the phase or the motion one"
            raise ValueError(msg)
        for key, motion in self._named().items():
            if motion.duration < self.duration_s * (1 - 1e-9):
                raise ValueError(
                    f"{key}: the motion ends after {motion.duration:g} s, before duration_s = {self.duration_s:g} s; "
                    "shorten the phase or end the motion with a step that holds"
                )
            if self.offsets == "random" and motion.period is None and not isinstance(motion, Hold):
                raise ValueError(
                    f"offsets: random, but {key} ({motion.type}) has no period; use 'none', a sine, a triangle or a "
                    "sequence with repeat"
                )
        if self.offsets == "random" and all(motion.period is None for motion in self.motions):
            raise ValueError("offsets: random, but both barbs hold; use 'none'")
        return self

    def _named(self) -> dict[str, Motion]:
        named = {"barbs": self.barbs, "barb_1": self.barb_1, "barb_2": self.barb_2}
        return {key: motion for key, motion in named.items() if motion is not None}

    @property
    def keys(self) -> tuple[str, str]:
        """Keys that hold the motions of barb 1 and barb 2."""
        return ("barbs", "barbs") if self.barbs is not None else ("barb_1", "barb_2")

    @property
    def motions(self) -> tuple[Motion, Motion]:
        """Motions of barb 1 and barb 2."""
        named = self._named()
        return named[self.keys[0]], named[self.keys[1]]

    def gait(self, smarticle: Smarticle, motor: Motor) -> Gait:
        return Gait(
            motions=self.motions,
            keys=self.keys,
            duration=self.duration_s,
            active_fraction=self.active_fraction,
            offsets=self.offsets,
        )

    def source_of(self, key: str) -> tuple[str, float | None]:
        # A key of one of the motions, such as barbs.steps.1.amplitude_deg.
        here: Any = self
        for part in key.split("."):
            here = here[int(part)] if part.isdigit() else getattr(here, part)
        return key, here


class ShapeChange(Part, ActuatedPhase):
    """Straighten both barbs, then turn them back to their angles at the beginning of the phase."""

    type: Literal["shape-change"]
    straight_deg: HingeAngle = Field(0.0, description="angle that the barbs are turned to [deg]")
    opening_s: Duration = Field(1.5, description="time in which the barbs turn to this angle [s]")
    straight_hold_s: float = Field(0.0, ge=0, le=1e6, description="time for which they hold this angle [s]")
    closing_s: Duration = Field(1.5, description="time in which they turn back [s]")

    @property
    def duration_s(self) -> float:
        """Length of the phase [s]."""
        return self.opening_s + self.straight_hold_s + self.closing_s

    def gait(self, smarticle: Smarticle, motor: Motor) -> Gait:
        steps: list[Motion] = [Ramp(type="ramp", to_deg=self.straight_deg, duration_s=self.opening_s)]
        if self.straight_hold_s > 0:
            steps.append(Hold(type="hold", duration_s=self.straight_hold_s))
        steps.append(Return(type="return", duration_s=self.closing_s))
        motion = Sequence(type="sequence", steps=tuple(steps))
        return Gait(motions=(motion, motion), duration=motion.duration)

    def source_of(self, key: str) -> tuple[str, float | None]:
        name = "opening_s" if key == "barbs.steps.0.duration_s" else "closing_s"
        return name, getattr(self, name)


class InternalOscillation(Part, ActuatedPhase):
    """Swing both barbs about `smarticle.angles_deg` at the motor's speed limit.

    A swing from one end to the other is θ, or if `scaled` θ · 0.7/(l/w).
    """

    type: Literal["internal-oscillation"]
    theta_deg: float = Field(..., ge=1e-6, le=240, description="θ, full swing, peak to peak [deg]")
    scaled: bool = Field(
        True,
        description="whether to swing by θ · 0.7/(l/w) instead of θ, so that barb tips travel equal arcs at all l/w",
    )
    duration_s: Duration = Field(5.0, description="length of the phase [s]")
    active_fraction: ActiveFraction = 1.0
    offsets: Offsets = "none"

    def gait(self, smarticle: Smarticle, motor: Motor) -> Gait:
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

    def source_of(self, key: str) -> tuple[str, float | None]:
        return "theta_deg", self.theta_deg
