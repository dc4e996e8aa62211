"""The phase that pulls a hook out of the pile."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from dem.engine.effect import EffectName
from dem.engine.interface import Engine
from dem.phases.phase import CHECK_INTERVAL, Memory, Phase, SceneView, Stage, time_left
from dem.phases.travel import (
    check_from_now,
    reject_early_end,
    span_of_travel,
    stop_at_limit,
    travel_left,
    travel_time,
    travel_to_text,
)
from dem.setting.hooks import Hooks, with_defaults
from dem.setting.part import Duration, Force, Length, Part, Speed
from dem.setting.span import Span
from dem.setting.vibration import Vibration


class PullHook(Part, Phase):
    """Raise the upper hook at constant speed, with smarticles welded, to measure the force on the hook."""

    type: Literal["pull-hook"]
    which: Literal["upper"] = Field("upper", description="the hook that is raised; the lower one stays")
    distance_m: Length = Field(..., description="how far the hook is raised [m]; default: 2w")
    speed_m_per_s: Speed = Field(..., description="speed of the hook [m/s]; default: w per second")
    duration_s: Duration = Field(
        default_factory=travel_time,
        description="length of the phase [s]; default: until the hook has arrived; in a longer phase it then rests",
    )
    force_limit_N: Force | None = Field(
        None,
        description="force on the raised hook, averaged over 0.01 s, at which it stops [N]; the phase ends 0.1 s "
        "later; null: no limit. The force is unbounded when a rigid smarticle holds both hooks",
    )

    vibration: Vibration | None = Field(None, description="vibration of the container meanwhile; null: none")

    @model_validator(mode="after")
    def _arrives(self) -> Self:
        reject_early_end("raise the hook", duration=self.duration_s, distance=self.distance_m, speed=self.speed_m_per_s)
        return self

    def check(self, scene: SceneView, index: int) -> Iterator[str]:
        if scene.hooks is None:
            yield f"phases.{index}: pull-hook, but the scene has no hooks; add the key hooks (`hooks: {{}}` will do)"

    def warnings(self, scene: SceneView, index: int) -> Sequence[str]:
        hooks = scene.hooks
        if hooks is None:
            return ()
        return *self._over_the_pile(scene, hooks), *self._held_by_one(scene, hooks), *self._near_the_wall(scene, hooks)

    def _over_the_pile(self, scene: SceneView, hooks: Hooks) -> Sequence[str]:
        if scene.container.tiers is not None or hooks.upper_height_m - hooks.side_m / 2 < scene.loose_height:
            return ()
        return (
            f"hooks.upper_height_m: {hooks.upper_height_m:g} m is about as high as {scene.count} smarticles pile up, "
            f"{scene.loose_height:.2g} m, so that few or none will lie on the hook that is pulled; lower it or raise "
            "count",
        )

    def _held_by_one(self, scene: SceneView, hooks: Hooks) -> Sequence[str]:
        if self.force_limit_N is not None or scene.mixture is not None:
            return ()
        across = hooks.upper_height_m - hooks.lower_height_m + hooks.side_m
        inside = scene.smarticle.middle_length_m - scene.sphere_diameter
        if across >= inside:
            return ()
        return (
            f"hooks.upper_height_m: the hooks are {across:.3g} m from outside to outside, less than a smarticle's "
            f"inner length, {inside:.3g} m: one smarticle can hold both hooks, and then only the contacts give way; "
            f"set them at least {1.005 * (inside - hooks.side_m):.3g} m apart, or give pull-hook a force_limit_N",
        )

    def _near_the_wall(self, scene: SceneView, hooks: Hooks) -> Sequence[str]:
        highest = np.array([hooks.upper_height_m + self.distance_m])
        gap = float(scene.cylinder.inner_radii(highest)[0]) - hooks.crosses[1].reach
        width = max(body.breadth for body in scene.bodies)
        if gap >= width:
            return ()
        return (
            f"hooks.length_m: the bars of the upper hook end {gap:.3g} m before the wall, less than a link's width, "
            f"{width:.3g} m, so that links are wedged there and stop the run; use at most "
            f"{0.995 * (hooks.length_m - 2 * (width - gap)):.3g} m or a wider container",
        )

    def spans(self) -> Iterator[Span]:
        yield from super().spans()
        yield from span_of_travel(self.distance_m, self.speed_m_per_s)

    def pushing_speed(self, gravity: float) -> float:
        return self.speed_m_per_s

    @property
    def raises(self) -> float:
        return self.distance_m

    def calls(self, scene: SceneView, index: int) -> Mapping[EffectName, str]:
        travel = travel_to_text(self.distance_m, self.speed_m_per_s, self.force_limit_N)
        return {EffectName.HOOKS: f"phase {index} raises the upper one {travel}", **self.vibrating(scene, index)}

    def first_memory(self, scene: SceneView) -> Memory:
        # At the last check, `force_sum`: vertical force on the hook, summed over steps [N]; `step`: number of steps;
        # `due`: time of the next check [s].
        return {"arrival": None, "end": None, "raising": False, "force_sum": 0.0, "step": 0, "due": 0.0}

    def proceed(self, stage: Stage, engine: Engine) -> float:
        memory = stage.memory
        if memory["end"] is None:
            arrival = engine.time + self.distance_m / self.speed_m_per_s
            memory.update(arrival=arrival, end=engine.time + self.duration_s, raising=True, felt=_force_sum(engine))
            engine.motors.weld()
            engine.boundaries.raise_upper(self.speed_m_per_s)
            self._check_from_now(memory, engine)
        elif memory["raising"] and (self.vibration is None or not time_left(engine, memory.get("due", 0.0))):
            stop_at_limit(memory, engine, force_sum=_force_sum(engine)[2], limit=self.force_limit_N)
            self._check_from_now(memory, engine)
        if memory["raising"] and (left := travel_left(memory, engine, limit=self.force_limit_N)):
            return left
        if memory["raising"]:
            memory["raising"] = False
            if self.vibration is None:
                engine.boundaries.stop()
            else:
                engine.boundaries.raise_upper(0.0)
        left = time_left(engine, memory["end"])
        if not left and memory.get("felt") == _force_sum(engine):
            memory["warning"] = (
                "no smarticle touched the upper hook while it was raised, and its force is 0 N throughout; lower "
                "hooks.upper_height_m or raise count"
            )
        return left

    def _check_from_now(self, memory: Memory, engine: Engine) -> None:
        interval = self.whole_periods(CHECK_INTERVAL)
        check_from_now(memory, engine, force_sum=_force_sum(engine)[2], interval=interval)


# (a, b): the default is a w + b t2.
_DEFAULTS = {"distance_m": (2, 0), "speed_m_per_s": (1, 0)}


def with_pull_defaults(phase: Any, sizes: tuple[float, float]) -> Any:
    """Return unvalidated data of a phase; in those of a pull-hook, missing keys are filled in.

    The defaults follow from `sizes` [m]: (w, t2) of the smarticle, or (longest bar, smallest thickness) of other
    bodies.
    """
    pulls = isinstance(phase, Mapping) and phase.get("type") == "pull-hook"
    return with_defaults(phase, _DEFAULTS, sizes) if pulls else phase


def _force_sum(engine: Engine) -> list[float]:
    """Return the force (x, y, z) on the upper hook, summed over all time steps so far [N].

    The mean force between two steps is the difference of their sums over the number of steps. The sum does not change
    while nothing touches the hook.
    """
    total: list[float] = engine.boundaries.hook_sums[1].tolist()
    return total
