"""Times within which a drive of a phase changes, and the steps that resolve them: one rule for all drives."""

import math
from dataclasses import dataclass

# Steps that resolve a period. Leapfrog moves what is driven by A sin(2πft) by its speed in the middle of each step, so
# that with n steps a period the amplitude is A (π/n)/sin(π/n): 0.4 % too large at 20, 1.7 % at 10.
STEPS = 20
# Cycles that begin and end at steps, with lengths that vary: rounding is half a step at most in taps, and one step in a
# sweep, so that frequencies are right to 0.25 % and 0.5 %.
VARYING_STEPS = 200


@dataclass(frozen=True, kw_only=True)
class Span:
    """A time within which a drive changes: a period, a window, a ramp, a travel."""

    key: str  #: Key of the phase that decides the time, with dots for nesting
    value: str  #: Value of that key with its unit
    seconds: float  #: The time [s]
    steps: int = STEPS  #: Least number of steps in it
    whole: bool = False  #: Whether it must be a whole number of steps

    @property
    def longest_step(self) -> float:
        """Longest step that resolves it [s]."""
        return self.seconds / self.steps

    def divided(self, step: float) -> float:
        """Return the longest step up to `step` [s] of which the time is a multiple."""
        return self.seconds / math.ceil(self.seconds / step * (1 - 1e-9))
