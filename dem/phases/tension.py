"""The phase that pulls the pile apart between two grips."""

from collections.abc import Iterator, Mapping
from typing import ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from dem.engine.effect import EffectName
from dem.engine.interface import Engine, Grips
from dem.errors import RunError, rounded_down
from dem.phases.compress import check_plate_is_gone
from dem.phases.phase import CHECK_INTERVAL, Memory, Phase, SceneView, Stage, time_left
from dem.phases.remove_container import check_wall_is_gone, is_freed
from dem.phases.travel import (
    check_from_now,
    reject_early_end,
    span_of_travel,
    stop_at_limit,
    travel_left,
    travel_time,
    travel_to_text,
)
from dem.setting.part import BodyNumbers, Duration, Force, Length, Part, Speed
from dem.setting.span import Span
from dem.setting.vibration import Vibration

MOVED = 1  # number of the grip that moves; the grip at rest is 0, since all others are released before


class Tension(Part, Phase):
    """Hold both ends of the pile by grips, and move one away at constant speed, with smarticles welded.

    A grip holds the bodies whose centre of mass is within `grip_m` of the outermost one at its end, or those of its
    list in `bodies`. They move with the grip and do not turn. The grip at the bottom, or at lower x or y, or of the
    first list, rests. At the end of the phase both are released.
    """

    lets_go: ClassVar[bool] = True
    needs_links: ClassVar[str] = "grips of rigid bodies"
    type: Literal["tension"]
    axis: Literal["x", "y", "z"] = Field("z", description="direction of the pull")
    grip_m: Length | None = Field(
        None,
        description="distance along the axis from the outermost centre of mass within which bodies are held [m]; "
        "needed unless bodies are given",
    )
    bodies: tuple[BodyNumbers, BodyNumbers] | None = Field(
        None,
        description="numbers, from 0, of the bodies that the grip at rest holds, and of those that the moving grip "
        "holds; default: by grip_m",
    )
    distance_m: Length = Field(..., description="how far the grip moves [m]")
    speed_m_per_s: Speed = Field(..., description="speed of the grip [m/s]")
    duration_s: Duration = Field(
        default_factory=travel_time,
        description="length of the phase [s]; default: until the grip has arrived; in a longer phase it then rests",
    )
    force_limit_N: Force | None = Field(
        None,
        description="pull on the moving grip, averaged over 0.01 s, at which it stops [N]; the phase ends 0.1 s later; "
        "null: no limit. The pull is unbounded when a chain of rigid bodies holds both grips",
    )
    vibration: Vibration | None = Field(None, description="vibration of the container meanwhile; null: none")

    @model_validator(mode="after")
    def _holds(self) -> Self:
        if (self.grip_m is None) == (self.bodies is None):
            raise ValueError("grip_m: give it, or bodies, but not both; they say what is held at either end")
        if self.bodies is not None and (twice := set(self.bodies[0]) & set(self.bodies[1])):
            raise ValueError(f"bodies: {min(twice)} is in both grips; give each body to one of them")
        return self

    @model_validator(mode="after")
    def _arrives(self) -> Self:
        reject_early_end("move the grip", duration=self.duration_s, distance=self.distance_m, speed=self.speed_m_per_s)
        return self

    def check(self, scene: SceneView, index: int) -> Iterator[str]:
        if scene.mixture is not None and scene.mixture.bends:
            yield f"phases.{index}: tension holds rigid bodies, but particle bends; use lift: it grips nodes or links"
        if self.axis != "z" and not is_freed(scene, index):
            yield (
                f"phases.{index}.axis: a pull along {self.axis} would end at the wall; take it away by "
                "remove-container before, or use axis: z"
            )
        if self.axis == "z":
            yield from check_plate_is_gone(scene, index)
        if self.bodies is not None and (most := max(map(max, self.bodies))) >= scene.count:
            yield f"phases.{index}.bodies: there is no body {most}; use 0 to {scene.count - 1}"
        if scene.count < 2:
            yield f"count: {scene.count} smarticle, but phases.{index} (tension) holds one at each end; use at least 2"

    def spans(self) -> Iterator[Span]:
        yield from super().spans()
        yield from span_of_travel(self.distance_m, self.speed_m_per_s)

    def pushing_speed(self, gravity: float) -> float:
        return self.speed_m_per_s

    @property
    def raises(self) -> float:
        return self.distance_m if self.axis == "z" else 0.0

    def calls(self, scene: SceneView, index: int) -> Mapping[EffectName, str]:
        travel = travel_to_text(self.distance_m, self.speed_m_per_s, self.force_limit_N)
        what = "chosen bodies" if self.grip_m is None else f"{1e3 * self.grip_m:.3g} mm of the pile"
        why = f"phase {index} moves one along {self.axis} {travel}; each holds {what}"
        return {EffectName.GRIPS: why, **self.vibrating(scene, index)}

    def first_memory(self, scene: SceneView) -> Memory:
        # At the last check, `force_sum`: force of the pile on the moving grip along the axis, summed over steps [N];
        # `step`: number of steps; `due`: time of the next check [s].
        return {"arrival": None, "end": None, "moving": False, "due": 0.0, "force_sum": 0.0, "step": 0}

    def proceed(self, stage: Stage, engine: Engine) -> float:
        memory, grips, limit = stage.memory, engine.grips, self.force_limit_N
        assert grips is not None  # the scene calls for them
        if memory["end"] is None:
            if self.axis != "z":
                check_wall_is_gone(engine, "the floor")
            engine.motors.weld()
            grips.release()  # what a lift still holds
            for bodies in self._ends(stage, engine):
                grips.hold(bodies)
            self._move(grips, self.speed_m_per_s)
            arrival = engine.time + self.distance_m / self.speed_m_per_s
            memory.update(arrival=arrival, end=engine.time + self.duration_s, moving=True)
            self._check_from_now(memory, engine, grips)
        elif memory["moving"] and not time_left(engine, memory["due"]):
            stop_at_limit(memory, engine, force_sum=self._force_sum(grips), limit=limit)
            self._check_from_now(memory, engine, grips)
        if memory["moving"] and (left := travel_left(memory, engine, limit=limit)):
            return left
        if memory["moving"]:
            memory["moving"] = False
            self._move(grips, 0.0)
        left = time_left(engine, memory["end"])
        if not left:
            grips.release()
        return left

    @property
    def _along(self) -> int:
        return "xyz".index(self.axis)

    def _move(self, grips: Grips, speed: float) -> None:
        velocity = [0.0, 0.0, 0.0]
        velocity[self._along] = speed
        grips.move(MOVED, (velocity[0], velocity[1], velocity[2]))

    def _check_from_now(self, memory: Memory, engine: Engine, grips: Grips) -> None:
        interval = self.whole_periods(CHECK_INTERVAL)
        check_from_now(memory, engine, force_sum=self._force_sum(grips), interval=interval)

    def _force_sum(self, grips: Grips) -> float:
        """Return the force of contacts on what the moving grip holds, along the axis, summed over all steps [N]."""
        return float(grips.pushed[MOVED, self._along])

    def _ends(self, stage: Stage, engine: Engine) -> tuple[list[int], list[int]]:
        """Return the numbers of the bodies at the end that rests and at the end that moves."""
        if self.grip_m is None:
            assert self.bodies is not None  # the phase was checked
            return list(self.bodies[0]), list(self.bodies[1])
        places = engine.state().positions[:, self._along]
        low, high = float(places.min()), float(places.max())
        if high - low <= 2 * self.grip_m:
            less = f"use less than {rounded_down((high - low) / 2)} m" if high > low else "use bodies instead"
            raise RunError(
                f"phases.{stage.index}.grip_m: grips of {self.grip_m:g} m at both ends hold the whole pile, whose "
                f"centres are within {high - low:.3g} m along {self.axis}; {less}"
            )
        ends = places <= low + self.grip_m, places >= high - self.grip_m
        return np.flatnonzero(ends[0]).tolist(), np.flatnonzero(ends[1]).tolist()
