"""The motors of the hinges, as a scene states them."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from dem.setting.part import Part, Turning


class Motor(Part):
    """The motor of each hinge: velocity-controlled, of limited torque."""

    torque_limit_N_m: float | None = Field(
        None,
        ge=1e-15,
        le=1e6,
        description="τ_max [N m]; default: the weight of the smarticle with l/w = 0.7 of this material and section "
        "at the lever w",
    )
    speed_limit_rad_per_s: Turning = Field(6.0, description="ω, greatest speed of a motor [rad/s]")
    law: Literal["halt", "stall", "ease", "slip", "servo"] = Field(
        "halt",
        description="at τ_max or above: halt: the motor stops advancing towards the load and holds; stall: it does not "
        "move in either direction, the paper's rule to the letter; ease: it goes on at half the speed, and stops after "
        "20 findings in a row of both barbs in turn, the rule of the paper's own code; slip: it gives way, a spring "
        "capped at τ_max; servo: as slip, and damped: proportional and derivative gain, the torque as a whole capped "
        "at τ_max",
    )
    stiffness_N_m_per_rad: float = Field(
        3e-3,
        ge=1e-12,
        le=1e6,
        description="twist stiffness of the shaft between motor and barb, a servo's gain [N m/rad]",
    )
    damping_N_m_s_per_rad: float = Field(0.0, ge=0, le=1e6, description="a servo's derivative gain [N m s/rad]")
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
            raise ValueError(
                f"damping_N_m_s_per_rad: {self.damping_N_m_s_per_rad:g} N m s/rad, but law is {self.law}, which has "
                "none; use law: servo"
            )
        return self
