"""The phase in which a pile rests."""

from typing import ClassVar, Literal

from pydantic import Field

from dem.engine.interface import Engine
from dem.phases.phase import Memory, Phase, SceneView, Stage
from dem.setting.part import Duration, Part


class Relax(Part, Phase):
    """Let the pile rest under gravity, with smarticles welded, filaments without active bending, chains as poured."""

    planar: ClassVar[bool | None] = None
    at_rest: ClassVar[bool] = True
    type: Literal["relax"]
    duration_s: Duration = Field(0.5, description="length of the phase [s]")

    def first_memory(self, scene: SceneView) -> Memory:
        return {"begun": False}

    def proceed(self, stage: Stage, engine: Engine) -> float:
        if stage.memory["begun"]:
            return 0.0
        stage.memory["begun"] = True
        engine.motors.weld()
        if engine.filaments is not None:
            engine.filaments.act(None)
        return self.duration_s
