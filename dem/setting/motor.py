"""Motor parameters of a scene."""

from typing import Literal, Self

from pydantic import Field, model_validator

from dem.setting.part import Part, Turning


class Motor(Part):
    """The motor of each hinge, velocity-controlled and with a torque limit."""

    torque_limit_N_m: float | None = Field(
        None,
        ge=1e-15,
        le=1e6,
        description="τ_max [N m]; default: w times the weight of a smarticle with this w, section and density, and "
        "with l/w = 0.7",
    )
    speed_limit_rad_per_s: Turning = Field(6.0, description="ω, greatest speed of a motor [rad/s]")
    law: Literal["halt", "stall", "ease", "slip", "servo"] = Field(
        "halt",
        description="what a motor does at τ_max or above: halt: it stops advancing against the load and holds; stall: "
        "it moves in neither direction, the literal rule of the paper's text; ease: it goes on at half the speed, and "
        "stops after 20 control updates in a row at τ_max, barb 1 and barb 2 counted in turn, the rule of the paper's "
        "own code; slip: it gives way like a spring whose torque is capped at τ_max; servo: proportional and "
        "derivative gain, with the total torque capped at τ_max",
    )
    stiffness_N_m_per_rad: float = Field(
        3e-3,
        ge=1e-12,
        le=1e6,
        description="twist stiffness of the shaft between motor and barb, a servo's gain [N m/rad]; the default is "
        "that of the paper's smarticle at 9.81 m/s², and in proportion to the default of torque_limit_N_m for others "
        "(without gravity, to that at 9.81 m/s²), so that all shafts twist equally",
    )
    damping_N_m_s_per_rad: float = Field(
        0.0,
        ge=0,
        le=1e6,
        description="a servo's derivative gain; halt, stall and ease, on links: damping of the shaft's twist, for "
        "shafts so stiff that barbs would ring on them [N m s/rad]",
    )
    strength_spread: float = Field(
        0.0,
        ge=0,
        lt=1,
        description="half-width s of the motors' scatter [1]: τ_max and stiffness of each motor are multiplied by a "
        "factor from the scene's seed, uniform within 1 ± s",
    )

    @model_validator(mode="after")
    def _slips_without_damping(self) -> Self:
        if self.damping_N_m_s_per_rad and self.law == "slip":
            raise ValueError(
                f"damping_N_m_s_per_rad: {self.damping_N_m_s_per_rad:g} N m s/rad, but law is slip, which has no "
                "damping; use law: servo"
            )
        return self
