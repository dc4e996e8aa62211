"""The phase that shakes the container."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import ClassVar, Literal

from pydantic import Field

from dem.engine.effect import EffectName
from dem.engine.interface import Engine
from dem.errors import RunError
from dem.phases.phase import Memory, Phase, SceneView, Stage
from dem.setting.part import Duration, Part

# Largest amplitude in sphere diameters. The rounding of positions at this height, 2⁻⁵³ of it, is 1e-11 diameters, still
# far below the overlap of a lone smarticle at rest, about 1e-4 diameters.
MOST_AMPLITUDE = 1e5


class Shake(Part, Phase):
    """Shake the container, or its floor alone, vertically: z = A sin(2πft) with A = Γg/(2πf)².

    After a phase that takes the container away the unbounded floor is shaken, with all smarticles on it.
    """

    speed_key: ClassVar[str] = "peak_acceleration_g"
    type: Literal["shake"]
    duration_s: Duration = Field(20.0, description="length of the phase [s]")
    frequency_hz: float = Field(30.0, ge=0.01, le=2000, description="f, frequency [Hz]")
    peak_acceleration_g: float = Field(2.0, ge=0, le=100, description="Γ, peak acceleration in units of gravity [1]")
    moves: Literal["container", "floor"] = Field(
        "container", description="what moves: the whole container, or its floor alone, as in the paper's own code"
    )

    def amplitude(self, gravity: float) -> float:
        """Return the amplitude A = Γg/(2πf)² [m]; gravity g in m/s²."""
        return self.peak_acceleration_g * gravity / (2 * math.pi * self.frequency_hz) ** 2

    def warnings(self, scene: SceneView, index: int) -> Sequence[str]:
        if not 0 < self.peak_acceleration_g < 1:
            return ()
        return (
            f"phases.{index}.peak_acceleration_g: Γ = {self.peak_acceleration_g:g} is below 1, so that the pile moves "
            "with the floor like one body and never leaves it; use more than 1 to loosen the pile",
        )

    def pushing_speed(self, gravity: float) -> float:
        return self.amplitude(gravity) * 2 * math.pi * self.frequency_hz

    def calls(self, scene: SceneView, index: int) -> Mapping[EffectName, str]:
        alone = ", the floor alone" if _freed(scene, index) or self.moves == "floor" else ""
        return {
            EffectName.CONTAINER_MOTION: f"phase {index}: Γ = {self.peak_acceleration_g:g}, f = "
            f"{self.frequency_hz:g} Hz, A = {1e3 * self.amplitude(scene.gravity_m_per_s2):.3g} mm{alone}"
        }

    def check(self, scene: SceneView, index: int) -> Iterator[str]:
        # The floor must not drop below the wall's lower edge.
        amplitude, depth = self.amplitude(scene.gravity_m_per_s2), -scene.cylinder.bottom
        most = MOST_AMPLITUDE * scene.sphere_diameter
        if amplitude > most:
            least = self.frequency_hz * math.sqrt(amplitude / most)
            yield (
                f"phases.{index}.frequency_hz: {self.frequency_hz:g} Hz at Γ = {self.peak_acceleration_g:g} moves the "
                f"container by A = {amplitude:.3g} m up and down, at most {most:.3g} m are computed; use at least "
                f"{1.005 * least:.3g} Hz"
            )
        if self.moves == "floor" and amplitude > depth:
            yield (
                f"phases.{index}.moves: the floor alone would go {amplitude:.3g} m down, and the wall ends "
                f"{depth:.3g} m below the floor; use a lower peak_acceleration_g, a higher frequency_hz, or moves: "
                "container"
            )

    def first_memory(self, scene: SceneView) -> Memory:
        return {"begun": False}

    def proceed(self, stage: Stage, engine: Engine) -> float:
        if stage.memory["begun"]:
            engine.boundaries.stop()
            return 0.0
        if _freed(stage.scene, stage.index) and engine.boundaries.walled:
            edge = engine.boundaries.wall_bottom - engine.boundaries.floor
            side = "above" if edge > 0 else "below"
            raise RunError(
                f"the wall is still around the pile, its lower edge {abs(edge):.3g} m {side} the floor that is to be "
                "shaken: remove-container was too short to lift it over the pile; raise duration_s or speed_m_per_s of "
                "that phase"
            )
        stage.memory["begun"] = True
        engine.motors.weld()
        amplitude = self.amplitude(stage.scene.gravity_m_per_s2)
        engine.boundaries.shake(amplitude=amplitude, frequency=self.frequency_hz, walls=self.moves == "container")
        return self.duration_s


def _freed(scene: SceneView, index: int) -> bool:
    return any(before.frees for before in scene.phases[:index])
