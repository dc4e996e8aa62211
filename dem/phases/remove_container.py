"""The phase that takes the container away."""

from collections.abc import Iterator, Mapping
from typing import ClassVar, Literal

from pydantic import Field

from dem.body.outline import tops_of
from dem.engine.effect import EffectName
from dem.engine.interface import Engine
from dem.errors import RunError
from dem.phases.phase import CHECK_INTERVAL, Memory, Phase, SceneView, Stage, time_left
from dem.setting.part import Duration, Part, Speed


class RemoveContainer(Part, Phase):
    """Take the container's wall away, with smarticles welded; the pile rests on an unbounded floor.

    Smarticles may then roll away without limit; the series count those outside the container's radius. A later shake
    moves the whole floor.
    """

    frees: ClassVar[bool] = True
    type: Literal["remove-container"]
    duration_s: Duration = Field(1.0, description="length of the phase [s]")
    parts: Literal["wall"] = Field("wall", description="what is taken away: the wall of all tiers")
    speed_m_per_s: Speed | None = Field(
        None,
        description="speed at which the wall is lifted, with friction at the pile, until its lower edge is above the "
        "pile [m/s]; a wall that is still around the pile at the end of the phase stays there; null: gone at once",
    )

    def check(self, scene: SceneView, index: int) -> Iterator[str]:
        for earlier, phase in enumerate(scene.phases[:index]):
            if phase.frees:
                yield f"phases.{index}: remove-container, but phases.{earlier} did so already; leave one of them out"

    def pushing_speed(self, gravity: float) -> float:
        return self.speed_m_per_s or 0.0

    def calls(self, scene: SceneView, index: int) -> Mapping[EffectName, str]:
        speed = self.speed_m_per_s
        how = "at once" if speed is None else f"lifted at {1e3 * speed:.3g} mm/s"
        return {EffectName.WALL_REMOVAL: f"phase {index}: {how}"}

    def first_memory(self, scene: SceneView) -> Memory:
        return {"end": None, "lifting": False}

    def proceed(self, stage: Stage, engine: Engine) -> float:
        memory, speed = stage.memory, self.speed_m_per_s
        if memory["end"] is None:
            memory["end"] = engine.time + self.duration_s
            engine.motors.weld()
            if speed is None:
                engine.boundaries.remove_wall()
            else:
                engine.boundaries.lift_wall(speed)
                memory["lifting"] = True
        left = time_left(engine, memory["end"])
        if memory["lifting"]:
            if engine.boundaries.wall_bottom > tops_of(engine.state(), stage.scene.model).max():
                engine.boundaries.remove_wall()
                memory["lifting"] = False
            elif not left:
                engine.boundaries.stop()
            else:
                return min(CHECK_INTERVAL, left)
        return left


def is_freed(scene: SceneView, index: int) -> bool:
    """Return whether a phase before phase `index` takes the container away."""
    return any(before.frees for before in scene.phases[:index])


def check_wall_is_gone(engine: Engine, floor: str) -> None:
    """Raise RunError if the wall is still around the pile; `floor`: the floor in words."""
    if not engine.boundaries.walled:
        return
    edge = engine.boundaries.wall_bottom - engine.boundaries.floor
    side = "above" if edge > 0 else "below"
    raise RunError(
        f"the wall is still around the pile, its lower edge {abs(edge):.3g} m {side} {floor}: remove-container was too "
        "short to lift it over the pile; raise duration_s or speed_m_per_s of that phase"
    )
