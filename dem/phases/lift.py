"""The phases that grip and raise nodes of filaments, links of chains or rigid bodies, and release them."""

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from dem.arrays import Array, Flags
from dem.engine.effect import EffectName
from dem.engine.interface import Engine, Filaments, Grips
from dem.phases.compress import Compress, check_plate_is_gone
from dem.phases.phase import Memory, Phase, SceneView, Stage, time_left
from dem.phases.travel import reject_early_end, span_of_travel, travel_time, travel_to_text
from dem.setting.part import LONGEST_LENGTH, BodyNumbers, Duration, Length, Part, Speed, reject_wrong_unit
from dem.setting.span import Span


class Lift(Part, Phase):
    """Grip nodes of filaments, links of chains, or rigid bodies, raise them at constant speed, hold them.

    They are held until a `release`. Filaments and chains continue their active bending. Rigid bodies are chosen by
    their centre of mass, gripped as a whole, and do not turn; smarticles are welded. The end piece that grips is not
    simulated as a body, so that nothing touches it.
    """

    needs_links: ClassVar[str] = "a grip"
    type: Literal["lift"]
    grips: Literal["near", "tails"] = Field(
        "near",
        description="what is gripped: near, all nodes or bodies near the container's axis, as by an end piece; tails, "
        "the last node of each filament, as at the surface of a liquid",
    )
    radius_m: Length | None = Field(
        None, description="largest distance of gripped nodes or bodies from the container's axis [m]; default: any"
    )
    above_m: float | None = Field(
        None,
        ge=0,
        le=1.0,
        description="least height of gripped nodes or bodies above the floor [m]; default: near, the mean height of "
        "the centres of mass; tails, or with bodies or nodes, 0",
    )
    bodies: BodyNumbers | None = Field(
        None,
        description="numbers, from 0, of the bodies that may be gripped, in the order in which they were added; "
        "default: all",
    )
    nodes: Annotated[tuple[Annotated[int, Field(ge=-201, le=200)], ...], Field(min_length=1)] | None = Field(
        None,
        description="numbers of the nodes of filaments, or links of chains, that may be gripped: from 0, or from -1 "
        "backwards; default: all",
    )
    distance_m: Annotated[
        float, Field(ge=0, json_schema_extra={"maximum": LONGEST_LENGTH}), AfterValidator(reject_wrong_unit)
    ] = Field(..., description="how far they are raised [m]; 0: they are held where they are")
    speed_m_per_s: Speed = Field(..., description="speed of the grip [m/s]")
    duration_s: Duration = Field(
        default_factory=travel_time,
        description="length of the phase [s]; default: until they have arrived; in a longer phase they are then held",
    )

    @model_validator(mode="after")
    def _arrives(self) -> Self:
        reject_early_end("raise", duration=self.duration_s, distance=self.distance_m, speed=self.speed_m_per_s)
        return self

    def check(self, scene: SceneView, index: int) -> Iterator[str]:
        yield from check_plate_is_gone(scene, index)
        if self.grips == "tails" and not _bends(scene):
            yield f"phases.{index}.grips: tails are those of filaments; use near for rigid bodies"
        if self.bodies is not None and max(self.bodies) >= scene.count:
            yield f"phases.{index}.bodies: there is no body {max(self.bodies)}; use 0 to {scene.count - 1}"
        if self.nodes is not None:
            yield from self._check_nodes(scene, f"phases.{index}.nodes")
        for later, phase in enumerate(scene.phases[index:], index):
            if phase.lets_go:
                return
            if isinstance(phase, Compress):
                yield (
                    f"phases.{later}: the plate of compress would run into what phases.{index} (lift) still grips; add "
                    "release before"
                )
            if phase.actuates:
                yield (
                    f"phases.{later}: {phase.kind} moves barbs of smarticles that phases.{index} (lift) still grips; "
                    "add release before"
                )

    def _check_nodes(self, scene: SceneView, key: str) -> Iterator[str]:
        if scene.mixture is None or not scene.mixture.bends:
            yield f"{key}: rigid bodies are gripped as a whole; leave nodes out, or choose bodies"
            return
        if self.grips == "tails":
            yield f"{key}: tails are the last nodes; leave nodes or grips out"
        least = min(len(kind.bars.points) + (kind.filament is not None) for kind in scene.mixture.kinds)
        if wrong := [number for number in self.nodes or () if not -least <= number < least]:
            yield f"{key}: there is no {wrong[0]} in a body of {least}; use 0 to {least - 1}, or -1 to {-least}"

    def calls(self, scene: SceneView, index: int) -> Mapping[EffectName, str]:
        if _bends(scene):
            return {}
        why = f"phase {index} raises one {travel_to_text(self.distance_m, self.speed_m_per_s)}"
        return {EffectName.GRIPS: why}

    def spans(self) -> Iterator[Span]:
        yield from super().spans()
        yield from span_of_travel(self.distance_m, self.speed_m_per_s)

    def pushing_speed(self, gravity: float) -> float:
        return self.speed_m_per_s

    @property
    def raises(self) -> float:
        return self.distance_m

    def first_memory(self, scene: SceneView) -> Memory:
        return {"grip": None, "arrival": None, "end": None}

    def proceed(self, stage: Stage, engine: Engine) -> float:
        memory = stage.memory
        if memory["end"] is None:
            self._grip(memory, stage.index, engine)
            arrival = engine.time + self.distance_m / self.speed_m_per_s
            memory.update(arrival=arrival, end=engine.time + self.duration_s)
            _movers(engine).move(memory["grip"], (0.0, 0.0, self.speed_m_per_s))
        if memory["arrival"] is not None:
            if left := time_left(engine, memory["arrival"]):
                return left
            memory["arrival"] = None
            _movers(engine).move(memory["grip"], (0.0, 0.0, 0.0))
        return time_left(engine, memory["end"])

    def _grip(self, memory: Memory, index: int, engine: Engine) -> None:
        """Grip the nodes, links or bodies that are near; note a warning if there are none."""
        if engine.filaments is not None:
            nodes, what = self._nodes(engine, engine.filaments), "body has a node or link that"
            memory["grip"], empty = engine.filaments.grip(nodes), not nodes
        else:
            assert engine.grips is not None  # the scene calls for them
            engine.motors.weld()
            near = self._near(engine, engine.state().positions) & self._chosen(engine.count)
            bodies, what = np.flatnonzero(near).tolist(), "body has its centre of mass where"
            memory["grip"], empty = engine.grips.hold(bodies), not bodies
        if empty:
            memory["warning"] = f"nothing was gripped: no {what} phases.{index} grips; raise radius_m or lower above_m"

    def _near(self, engine: Engine, places: Array) -> Flags:
        """Return (n,) whether places (n, 3) [m] are within `radius_m` of the axis and high enough."""
        floor, state = engine.boundaries.floor, engine.state()
        least, anywhere = self.above_m, self.grips == "tails" or self.bodies is not None or self.nodes is not None
        if least is None:
            least = 0.0 if anywhere else float(state.positions[:, 2].mean()) - floor
        radius = math.inf if self.radius_m is None else self.radius_m
        return (np.hypot(places[:, 0], places[:, 1]) <= radius) & (places[:, 2] - floor >= least)

    def _chosen(self, count: int) -> Flags:
        """Return (N,) whether each body may be gripped."""
        return np.ones(count, np.bool_) if self.bodies is None else np.isin(np.arange(count), self.bodies)

    def _nodes(self, engine: Engine, filaments: Filaments) -> dict[int, list[int]]:
        """Return the numbers of the nodes or links to grip, by the number of their filament or chain."""
        found = {}
        for k in np.flatnonzero(self._chosen(engine.count)).tolist():
            near = self._near(engine, filaments.points(k))
            wanted = (-1,) if self.grips == "tails" else self.nodes
            if wanted is not None:
                near &= np.isin(np.arange(len(near)), np.arange(len(near))[list(wanted)])
            if near.any():
                found[k] = np.flatnonzero(near).tolist()
        return found


class Release(Part, Phase):
    """Release all that earlier phases grip; this takes no simulated time."""

    lets_go: ClassVar[bool] = True
    type: Literal["release"]

    def check(self, scene: SceneView, index: int) -> Iterator[str]:
        if not _bends(scene) and not any(isinstance(phase, Lift) for phase in scene.phases[:index]):
            yield f"phases.{index}: release, but no phase before grips anything; add lift before, or leave it out"

    @property
    def known_duration(self) -> float:
        return 0.0

    def proceed(self, stage: Stage, engine: Engine) -> float:
        _movers(engine).release()
        return 0.0


def _bends(scene: SceneView) -> bool:
    """Return whether the bodies are filaments or chains."""
    return scene.mixture is not None and scene.mixture.bends


def _movers(engine: Engine) -> Filaments | Grips:
    """Return the part of the engine that has the grips: of filaments and chains, or of rigid bodies."""
    found = engine.filaments or engine.grips
    assert found is not None  # the scene was checked
    return found
