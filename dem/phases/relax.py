"""The phase in which a pile rests."""

from typing import ClassVar, Literal

from pydantic import Field

from dem.engine.interface import Engine
from dem.phases.phase import TimedPhase
from dem.setting.part import Duration, Part


class Relax(Part, TimedPhase):
    """Let the pile rest under gravity, with smarticles welded, filaments without active bending, chains as poured."""

    planar: ClassVar[bool | None] = None
    at_rest: ClassVar[bool] = True
    stills: ClassVar[bool] = True
    type: Literal["relax"]
    duration_s: Duration = Field(0.5, description="length of the phase [s]")

    def act(self, engine: Engine) -> None:
        engine.motors.weld()
        if engine.filaments is not None:
            engine.filaments.act(None)
