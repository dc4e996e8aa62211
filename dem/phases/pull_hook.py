"""The phase that pulls a hook out of the pile."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal, Self

from pydantic import Field, model_validator

from dem.engine.effect import EffectName
from dem.engine.interface import Engine
from dem.phases.phase import CHECK_INTERVAL, Memory, Phase, SceneView, Stage, time_left
from dem.setting.hooks import TOLERANCE, Hooks, with_defaults
from dem.setting.part import Duration, Force, Length, Part, Speed
from dem.setting.smarticle import Smarticle

HELD_SECONDS = 0.1  # that a hook stays where its force limit has stopped it, for the force to be measured


class PullHook(Part, Phase):
    """Raise a hook at constant speed; its reaction force is the outcome. Motors hold: smarticles are welded."""

    type: Literal["pull-hook"]
    which: Literal["upper"] = Field("upper", description="the hook that is raised; the other one stays")
    distance_m: Length = Field(..., description="how far the hook is raised [m]; default: 2w")
    speed_m_per_s: Speed = Field(..., description="speed of the hook [m/s]; default: w per second")
    duration_s: Duration = Field(
        default_factory=lambda data: data["distance_m"] / data["speed_m_per_s"],
        description="length of the phase [s]; default: until the hook has arrived; longer: it then stays where it is",
    )
    force_limit_N: Force | None = Field(
        None,
        description="force on the raised hook, mean over 0.01 s, at which it stops and the phase soon ends [N], as a "
        "testing machine does before it breaks; null: none. A rigid smarticle that holds both hooks takes any force",
    )

    @model_validator(mode="after")
    def _arrives(self) -> Self:
        needed = self.distance_m / self.speed_m_per_s
        if self.duration_s < needed * (1 - TOLERANCE):
            raise ValueError(
                f"duration_s: {self.duration_s:g} s is too short to raise the hook by distance_m = "
                f"{self.distance_m:g} m at speed_m_per_s = {self.speed_m_per_s:g} m/s; use at least {needed:.6g} s"
            )
        return self

    def check(self, scene: SceneView, index: int) -> Iterator[str]:
        if scene.hooks is None:
            yield f"phases.{index}: pull-hook, but the scene has no hooks; add the key hooks (`hooks: {{}}` will do)"

    def warnings(self, scene: SceneView, index: int) -> Sequence[str]:
        hooks = scene.hooks
        return () if hooks is None else (*self._over_the_pile(scene, hooks), *self._held_by_one(scene, hooks))

    def _over_the_pile(self, scene: SceneView, hooks: Hooks) -> Sequence[str]:
        if scene.container.tiers is not None or hooks.upper_height_m - hooks.side_m / 2 < scene.loose_height:
            return ()
        return (
            f"hooks.upper_height_m: {hooks.upper_height_m:g} m is about as high as {scene.count} smarticles pile up, "
            f"{scene.loose_height:.2g} m, so that few or none will lie on the hook that is pulled; lower it or raise "
            "count",
        )

    def _held_by_one(self, scene: SceneView, hooks: Hooks) -> Sequence[str]:
        if self.force_limit_N is not None:
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

    @property
    def pushing_speed(self) -> float:
        return self.speed_m_per_s

    @property
    def raises(self) -> float:
        return self.distance_m

    def calls(self, scene: SceneView, index: int) -> Mapping[EffectName, str]:
        until = "" if self.force_limit_N is None else f", or until it takes {self.force_limit_N:.3g} N"
        return {
            EffectName.HOOKS: f"phase {index} raises the upper one by {1e3 * self.distance_m:.3g} mm at "
            f"{1e3 * self.speed_m_per_s:.3g} mm/s{until}"
        }

    def first_memory(self, scene: SceneView) -> Memory:
        # `force_sum`, `step`: sum of the vertical forces on the hook so far [N], and steps, at the last check.
        return {"arrival": None, "end": None, "raising": False, "force_sum": 0.0, "step": 0}

    def proceed(self, stage: Stage, engine: Engine) -> float:
        memory = stage.memory
        if memory["end"] is None:
            arrival = engine.time + self.distance_m / self.speed_m_per_s
            memory.update(arrival=arrival, end=engine.time + self.duration_s, raising=True, felt=_felt_above(engine))
            engine.motors.weld()
            engine.boundaries.raise_upper(self.speed_m_per_s)
            _note(memory, engine)
        elif memory["raising"]:
            # Whether the mean force on the hook since the last check exceeds its limit.
            before, step = memory["force_sum"], memory["step"]
            _note(memory, engine)
            limit = self.force_limit_N
            if limit is not None and before - memory["force_sum"] > limit * (memory["step"] - step):
                memory.update(arrival=engine.time, end=engine.time + HELD_SECONDS)
        if memory["raising"] and (left := time_left(engine, memory["arrival"])):
            return left if self.force_limit_N is None else min(CHECK_INTERVAL, left)
        if memory["raising"]:
            memory["raising"] = False
            engine.boundaries.stop()
        left = time_left(engine, memory["end"])
        if not left and memory.get("felt") == _felt_above(engine):
            memory["warning"] = (
                "no smarticle touched the upper hook while it was raised, and its force is 0 N throughout; lower "
                "hooks.upper_height_m or raise count"
            )
        return left


def _note(memory: Memory, engine: Engine) -> None:
    memory.update(force_sum=float(engine.boundaries.hook_sums[1, 2]), step=engine.steps)


# Widths w and thicknesses t2 that the keys are by default.
_DEFAULTS = {"distance_m": (2, 0), "speed_m_per_s": (1, 0)}


def with_pull_defaults(phase: Any, smarticle: Smarticle) -> Any:
    """Fill the keys of a pull-hook that follow from the smarticle; return other phases unchanged."""
    pulls = isinstance(phase, Mapping) and phase.get("type") == "pull-hook"
    return with_defaults(phase, _DEFAULTS, smarticle) if pulls else phase


def _felt_above(engine: Engine) -> list[float]:
    """Return the force on the upper hook, summed over steps [N]: unchanged where nothing touches it."""
    felt: list[float] = engine.boundaries.hook_sums[1].tolist()
    return felt
