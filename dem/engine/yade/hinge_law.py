"""How stiff YADE's hinges are: bonds that stand for joints."""

from __future__ import annotations

from dataclasses import dataclass

# YADE's rotations are first order and feed energy into the pin's fast vibrations, which undamped grow within a second
# after a hard impact. A damper of a spring and a dashpot in a row takes it away and leaves slow motion alone.
DAMPER_SHARE = 0.25  # of the pin's stiffness
DAMPER_VISCOSITY = 0.15  # N s/m; at the stiffness of the named fidelities it relaxes over a few time steps
DAMPER_TIME = 4e-5  # s; no shorter with stiffer pins, since a step must not relax it twice over


@dataclass(frozen=True, kw_only=True)
class HingeLaw:
    """Stiffness of the hinges.

    Args:
        pin_stiffness: against the links coming apart [N/m].
        tilt_stiffness: against their leaving the common plane [N m/rad].
        shaft_stiffness: twist stiffness of the motor's shaft [N m/rad].
        torque_cap: torque at which a shaft slips [N m]; None: never.
        shaft_damping: what the motors add to the shafts' stiffness [N m s/rad]; for the stable time step only.
        damper_time: the dampers' time of relaxation where they are stiff [s]; at least a time step.
    """

    pin_stiffness: float
    tilt_stiffness: float
    shaft_stiffness: float
    torque_cap: float | None
    shaft_damping: float = 0.0
    damper_time: float = DAMPER_TIME

    @property
    def damper_stiffness(self) -> float:
        """Of the damper's spring, across the axis [N/m]."""
        return DAMPER_SHARE * self.pin_stiffness

    @property
    def damper_viscosity(self) -> float:
        """Of the damper's dashpot [N s/m]."""
        return max(DAMPER_VISCOSITY, self.damper_stiffness * self.damper_time)
