"""Vibration of the container during a test of the pile: key `vibration` of a phase."""

import math
from collections.abc import Iterator
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from dem.setting.part import Part
from dem.setting.span import Span

ShakingFrequency = Annotated[float, Field(ge=0.01, le=2000)]  # Hz
PeakAcceleration = Annotated[float, Field(ge=0, le=100)]  # g
Moved = Literal["container", "floor"]


def shaking_amplitude(peak_acceleration_g: float, frequency_hz: float, gravity: float) -> float:
    """Return the amplitude A = Γg/(2πf)² [m] of a vertical sine; gravity g in m/s²."""
    return peak_acceleration_g * gravity / (2 * math.pi * frequency_hz) ** 2


class Vibration(Part):
    """Vertical vibration z = A sin(2πft) with A = Γg/(2πf)², during the whole phase or in windows of time.

    With `moves: container` hooks, plate and grips are fixed to the container; their own motion is added.
    """

    frequency_hz: ShakingFrequency = Field(30.0, description="f, frequency [Hz]")
    peak_acceleration_g: PeakAcceleration = Field(..., description="Γ, peak acceleration in units of gravity [1]")
    moves: Moved = Field("container", description="what vibrates: the container with all that is fixed to it, or floor")
    windows_s: tuple[tuple[float, float], ...] | None = Field(
        None,
        min_length=1,
        description="times [[on, off], …] since the phase began between which it vibrates [s]; null: always",
    )

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        last = 0.0
        for number, (on, off) in enumerate(self.windows_s or ()):
            if not last <= on < off < math.inf or (number and on == last):
                raise ValueError(
                    f"windows_s.{number}: [{on:g}, {off:g}] s does not follow {last:g} s; each window is [on, off], on "
                    "before off, begins after the one before has ended, and the first one at 0 s or later"
                )
            last = off
        return self

    def amplitude(self, gravity: float) -> float:
        """Return the amplitude A [m]; gravity in m/s²."""
        return shaking_amplitude(self.peak_acceleration_g, self.frequency_hz, gravity)

    def peak_speed(self, gravity: float) -> float:
        """Return the greatest speed [m/s]; gravity in m/s²."""
        return self.amplitude(gravity) * 2 * math.pi * self.frequency_hz

    def spans(self, prefix: str) -> Iterator[Span]:
        """Yield its period, its windows and the times between them; `prefix` is put before their keys."""
        if self.peak_acceleration_g:
            frequency = self.frequency_hz
            yield Span(key=f"{prefix}frequency_hz", value=f"{frequency:g} Hz", seconds=1 / frequency)
        last = 0.0
        for number, (on, off) in enumerate(self.windows_s or ()):
            for seconds in (on - last, off - on):
                if seconds > 0:
                    yield Span(key=f"{prefix}windows_s.{number}", value=f"[{on:g}, {off:g}] s", seconds=seconds)
            last = off

    def next_switch(self, elapsed: float) -> tuple[bool, float]:
        """Return whether it vibrates at a time of the phase [s], and the time of the next change [s]."""
        for on, off in self.windows_s or ((0.0, math.inf),):
            if elapsed < on:
                return False, on
            if elapsed < off:
                return True, off
        return False, math.inf

    def to_text(self, gravity: float) -> str:
        """Return the vibration in words; gravity in m/s²."""
        when = "" if self.windows_s is None else ", " + ", ".join(f"{a:g} to {b:g} s" for a, b in self.windows_s)
        amplitude = f"A = {1e3 * self.amplitude(gravity):.3g} mm, the {self.moves}"
        return f"Γ = {self.peak_acceleration_g:g}, f = {self.frequency_hz:g} Hz, {amplitude}{when}"
