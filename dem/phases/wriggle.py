"""The phase in which filaments bend actively."""

import math
from collections.abc import Iterator, Sequence
from typing import ClassVar, Literal

from pydantic import Field

from dem.body.filament import Activity
from dem.engine.interface import Engine
from dem.errors import rounded_down, rounded_up
from dem.phases.phase import SceneView, TimedPhase, spans_of_wave
from dem.setting.part import Duration, Length, Part
from dem.setting.span import Span
from dem.strict import SAME

TIGHTEST = 0.5  # of a filament's curvature times its diameter: a bend in which it would touch itself


class Wriggle(Part, TimedPhase):
    """Let filaments bend actively: in each, a wave of preferred curvature turns about the axis.

    Waves begin at random phases, and go on in later phases until the next `wriggle` or `relax`.
    """

    bends: ClassVar[frozenset[str]] = frozenset({"filament"})
    needs_links: ClassVar[str] = "active bending"
    type: Literal["wriggle"]
    duration_s: Duration = Field(..., description="length of the phase [s]")
    curvature_per_m: float = Field(..., ge=0, le=1e5, description="amplitude of the preferred curvature [1/m]")
    frequency_hz: float = Field(
        1.0, ge=0, le=1e4, description="turns of the wave per second; 0: filaments hold the bends that they have [Hz]"
    )
    wavelength_m: Length | None = Field(
        None, description="wavelength along the filament [m]; default: equal along it, so that it bends into an arc"
    )
    turns_between_reversals: float | None = Field(
        None,
        ge=1e-3,
        le=1e6,
        description="γ = α/2πλ, mean number of turns between two reversals, which come at random times [1]; default: "
        "no reversals",
    )
    ramp_s: float = Field(0.2, ge=0, le=1e6, description="time in which the curvature grows from 0 [s]")

    def check(self, scene: SceneView, index: int) -> Iterator[str]:
        wave, kinds = self.wavelength_m, () if scene.mixture is None else scene.mixture.kinds
        longest = max((kind.filament.segment_length for kind in kinds if kind.filament is not None), default=0.0)
        # Nodes would sample a shorter wave as a longer one.
        if wave is not None and wave < 2 * longest * (1 - SAME):
            yield (
                f"phases.{index}.wavelength_m: {wave:g} m is less than two segments, of {longest:.3g} m each; use at "
                f"least {rounded_up(2 * longest)} m, or more segments"
            )

    def warnings(self, scene: SceneView, index: int) -> Sequence[str]:
        most = TIGHTEST / scene.sphere_diameter
        if self.curvature_per_m <= most:
            return ()
        return (
            f"phases.{index}.curvature_per_m: {self.curvature_per_m:g} bends a filament of {scene.sphere_diameter:g} m "
            f"into itself; use at most {rounded_down(most)}",
        )

    def spans(self) -> Iterator[Span]:
        if self.curvature_per_m:
            yield from spans_of_wave(self.frequency_hz, self.ramp_s)

    @property
    def activity(self) -> Activity:
        """Wave of preferred curvature that the filaments follow."""
        turns = self.turns_between_reversals
        return Activity(
            curvature=self.curvature_per_m,
            wavelength=math.inf if self.wavelength_m is None else self.wavelength_m,
            rate=2 * math.pi * self.frequency_hz,
            reversal_rate=0.0 if turns is None else self.frequency_hz / turns,
        )

    def act(self, engine: Engine) -> None:
        assert engine.filaments is not None  # the scene was checked
        engine.filaments.act(self.activity, ramp=self.ramp_s)
