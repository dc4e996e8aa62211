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

    @property
    def known_duration(self) -> float:
        """See `Phase.known_duration`."""
        return self.duration_s

    def begin(self, scene: SceneView, index: int) -> Stage:
        """See `Phase.begin`."""
        return Resting(self.duration_s)


class Resting:
    """Nothing acts but gravity.

    Args:
        duration: length of the phase [s].
    """

    def __init__(self, duration: float) -> None:
        self._duration = duration
        self.memory: Memory = {"begun": False}

    def proceed(self, engine: Engine) -> float:
        """See `Stage.proceed`."""
        if self.memory["begun"]:
            return 0.0
        self.memory["begun"] = True
        engine.motors.weld()
        return self._duration
