"""Phases that grip parts of filaments, raise them, and let them go."""

import math
from typing import ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from dem.engine.interface import Engine, Filaments
from dem.phases.phase import Memory, Phase, SceneView, Stage, time_left
from dem.setting.hooks import TOLERANCE
from dem.setting.part import Duration, Length, Part, Speed


class Lift(Part, Phase):
    """Grip parts of filaments, raise them at constant speed, and hold them until a `release`.

    Activity goes on. The end piece itself touches nothing: it is where nodes are gripped.
    """

    bends: ClassVar[frozenset[str]] = frozenset({"filament", "chain"})
    type: Literal["lift"]
    grips: Literal["near", "tails"] = Field(
        "near",
        description="what is gripped: near, all nodes near the container's axis, as by an end piece; tails, the last "
        "node of each filament, as at the surface of a liquid",
    )
    radius_m: Length | None = Field(
        None, description="largest distance of gripped nodes from the container's axis [m]; default: any"
    )
    above_m: float | None = Field(
        None,
        ge=0,
        le=1.0,
        description="least height of gripped nodes above the floor [m]; default: near, the mean height of the centres "
        "of mass; tails, 0",
    )
    distance_m: Length = Field(..., description="how far they are raised [m]")
    speed_m_per_s: Speed = Field(..., description="speed [m/s]")
    duration_s: Duration = Field(
        default_factory=lambda data: data["distance_m"] / data["speed_m_per_s"],
        description="length of the phase [s]; default: until they have arrived; in a longer phase they are then held",
    )

    @model_validator(mode="after")
    def _arrives(self) -> Self:
        needed = self.distance_m / self.speed_m_per_s
        if self.duration_s < needed * (1 - TOLERANCE):
            raise ValueError(
                f"duration_s: {self.duration_s:g} s is too short to raise by distance_m = {self.distance_m:g} m at "
                f"speed_m_per_s = {self.speed_m_per_s:g} m/s; use at least {needed:.6g} s"
            )
        return self

    def pushing_speed(self, gravity: float) -> float:
        return self.speed_m_per_s

    @property
    def raises(self) -> float:
        return self.distance_m

    def first_memory(self, scene: SceneView) -> Memory:
        return {"grip": None, "arrival": None, "end": None}

    def proceed(self, stage: Stage, engine: Engine) -> float:
        memory, filaments = stage.memory, engine.filaments
        assert filaments is not None  # the scene was checked
        if memory["end"] is None:
            held = self._held(engine, filaments)
            if not held:
                memory["warning"] = (
                    f"nothing was gripped: no filament has a node that phases.{stage.index} grips; raise radius_m or "
                    "lower above_m"
                )
            grip = filaments.grip(held)
            arrival = engine.time + self.distance_m / self.speed_m_per_s
            memory.update(grip=grip, arrival=arrival, end=engine.time + self.duration_s)
            filaments.move(grip, (0.0, 0.0, self.speed_m_per_s))
        if memory["arrival"] is not None:
            if left := time_left(engine, memory["arrival"]):
                return left
            memory["arrival"] = None
            filaments.move(memory["grip"], (0.0, 0.0, 0.0))
        return time_left(engine, memory["end"])

    def _held(self, engine: Engine, filaments: Filaments) -> dict[int, list[int]]:
        """Return the numbers of the nodes that are gripped, for each filament that has any."""
        floor, state = engine.boundaries.floor, engine.state()
        least = self.above_m
        if least is None:
            least = 0.0 if self.grips == "tails" else float(state.positions[:, 2].mean()) - floor
        radius = math.inf if self.radius_m is None else self.radius_m
        found = {}
        for k in range(engine.count):
            nodes = filaments.points(k)
            near = (np.hypot(nodes[:, 0], nodes[:, 1]) <= radius) & (nodes[:, 2] - floor >= least)
            if self.grips == "tails":
                near[:-1] = False
            if near.any():
                found[k] = np.flatnonzero(near).tolist()
        return found


class Release(Part, Phase):
    """Let go of everything that earlier phases grip; takes no time."""

    bends: ClassVar[frozenset[str]] = frozenset({"filament", "chain"})
    type: Literal["release"]

    @property
    def known_duration(self) -> float:
        return 0.0

    def proceed(self, stage: Stage, engine: Engine) -> float:
        assert engine.filaments is not None  # the scene was checked
        engine.filaments.release()
        return 0.0
