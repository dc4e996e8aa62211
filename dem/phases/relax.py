"""The phase in which a pile rests."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from dem.engine.interface import Engine
from dem.phases.phase import Memory, Phase, SceneView, Stage
from dem.setting.part import Duration, Part


class Relax(Part, Phase):
    """Let the pile rest; nothing acts but gravity."""

    planar: ClassVar[bool | None] = None
    type: Literal["relax"]
    duration_s: Duration = Field(0.5, description="length of the phase [s]")

    def begin(self, scene: SceneView, index: int) -> Stage:
        return Resting(self.duration_s)


class Resting:
    """Waits for a time [s]; nothing acts but gravity."""

    def __init__(self, duration: float) -> None:
        self._duration = duration
        self.memory: Memory = {"begun": False}

    def proceed(self, engine: Engine) -> float:
        if self.memory["begun"]:
            return 0.0
        self.memory["begun"] = True
        engine.motors.weld()
        return self._duration
