"""The phase that compresses the pile by a plate."""

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from dem.body.outline import tops_of
from dem.engine.effect import EffectName
from dem.engine.interface import Engine
from dem.phases.phase import CHECK_INTERVAL, Memory, Phase, SceneView, Stage, time_left
from dem.phases.travel import check_from_now
from dem.setting.part import Part, Speed
from dem.setting.vibration import Vibration

OVERSHOT = 1.5  # stress at the end of a loading, over stress_Pa, from which on the phase warns
PER_CHECK = 0.01  # longest way of the plate between two checks of the stress, in sphere diameters
Stress = Annotated[float, Field(ge=1e-6, le=1e12)]


class Compress(Part, Phase):
    """Compress the pile by a plate, to a stress or a strain, once or in cycles, with smarticles welded.

    The plate begins at the pile's highest point, or where an earlier phase has left it. It is horizontal, and has no
    edge and the container's contact law. With the wall this is an oedometer; after remove-container the pile may give
    way to the sides.
    The stress is the vertical force on the plate over π radius_m². The strain is the distance that the plate has come
    down in this phase, over its height above the floor at the beginning.
    """

    needs_links: ClassVar[str] = "a plate"
    type: Literal["compress"]
    stress_Pa: Stress | None = Field(
        None, description="stress at which a loading ends [Pa]; null: each ends at `strain`"
    )
    strain: float = Field(0.3, ge=1e-6, le=0.95, description="largest strain, at which a loading ends in any case [1]")
    speed_m_per_s: Speed = Field(..., description="speed of the plate, downwards and upwards [m/s]")
    cycles: int = Field(0, ge=0, le=10_000, description="number of unloadings, each followed by another loading [1]")
    unload_stress_Pa: float = Field(
        0.0, ge=0, le=1e12, description="stress at which an unloading ends [Pa]; 0: when the plate has left the pile"
    )
    afterwards: Literal["remove", "stay"] = Field(
        "remove", description="whether the plate is removed at the end of the phase, or stays where it is"
    )
    vibration: Vibration | None = Field(None, description="vibration of the container meanwhile; null: none")

    def check(self, scene: SceneView, index: int) -> Iterator[str]:
        if self.stress_Pa is not None and self.unload_stress_Pa >= self.stress_Pa:
            yield (
                f"phases.{index}.unload_stress_Pa: {self.unload_stress_Pa:g} Pa is not below stress_Pa = "
                f"{self.stress_Pa:g} Pa, at which the unloading begins; use less"
            )
        if scene.container.tiers is not None:
            yield (
                f"phases.{index}: the plate of compress has no edge and would run into container.tiers, which get "
                "narrower; give container.radius_m instead"
            )
        if scene.hooks is not None:
            yield f"phases.{index}: the plate of compress would run into the hooks; leave hooks or the phase out"

    @property
    def legs(self) -> int:
        """Number of loadings and unloadings."""
        return 1 + 2 * self.cycles

    def expected_duration(self, scene: SceneView) -> float:
        # At the largest strain; a stress ends a loading earlier.
        return self.legs * self.strain * scene.loose_height / self.speed_m_per_s

    def pushing_speed(self, gravity: float) -> float:
        return self.speed_m_per_s

    def load(self, scene: SceneView) -> float:
        """Return the largest expected force on the plate [N]; 0 where it is unknown."""
        return (self.stress_Pa or 0.0) * _area(scene)

    def calls(self, scene: SceneView, index: int) -> Mapping[EffectName, str]:
        until = f"a strain of {self.strain:g}"
        if self.stress_Pa is not None:
            until = f"{self.stress_Pa:.3g} Pa ({self.load(scene):.3g} N), at most {until}"
        cycles = f", {self.cycles} times unloaded to {self.unload_stress_Pa:.3g} Pa" if self.cycles else ""
        why = f"phase {index} lowers it at {1e3 * self.speed_m_per_s:.3g} mm/s to {until}{cycles}"
        return {EffectName.PLATE: why, **self.vibrating(scene, index)}

    def first_memory(self, scene: SceneView) -> Memory:
        # `start`: height of the plate above the floor at the beginning [m]; `leg`: number of the loading (even) or
        # unloading (odd), `way`: distance of the plate below its start when the leg began [m], `begun` and `arrival`:
        # when it began, and when it ends in any case [s]. At the last check, `force_sum`: force on the plate summed
        # over steps [N]; `step`: number of steps; `due`: time of the next check [s]. `touched`, `short`, and `most`,
        # the largest stress [Pa]: for warnings.
        numbers = dict.fromkeys(("way", "begun", "arrival", "force_sum", "due", "most"), 0.0)
        return {"start": None, "leg": 0, "step": 0, "touched": False, "short": False, **numbers}

    def proceed(self, stage: Stage, engine: Engine) -> float:
        memory, boundaries = stage.memory, engine.boundaries
        if memory["start"] is None:
            engine.motors.weld()
            if boundaries.plate_height is None:
                boundaries.place_plate(float(tops_of(engine.state(), stage.scene.model).max()))
            assert boundaries.plate_height is not None
            memory["start"] = boundaries.plate_height - boundaries.floor
            self._begin_leg(memory, engine)
        else:
            arrived = not time_left(engine, memory["arrival"])
            if (arrived or not time_left(engine, memory["due"])) and not self._turn(stage, engine, arrived=arrived):
                return 0.0
        return min(time_left(engine, memory["due"]), time_left(engine, memory["arrival"])) or engine.time_step

    def _begin_leg(self, memory: Memory, engine: Engine) -> None:
        """Begin a loading or an unloading, and note when the plate arrives at the end of its way."""
        up = bool(memory["leg"] % 2)
        way = memory["way"] if up else self.strain * memory["start"] - memory["way"]
        memory.update(begun=engine.time, arrival=engine.time + way / self.speed_m_per_s)
        engine.boundaries.move_plate(self.speed_m_per_s if up else -self.speed_m_per_s)
        self._check_from_now(memory, engine)

    def _check_from_now(self, memory: Memory, engine: Engine) -> None:
        """Note the sum of the plate's force up to now, and set the time of the next check."""
        interval = min(CHECK_INTERVAL, PER_CHECK * engine.particle.diameter / self.speed_m_per_s)
        interval = max(engine.time_step, self.whole_periods(interval))
        check_from_now(memory, engine, force_sum=float(engine.boundaries.plate_sum[2]), interval=interval)

    def _turn(self, stage: Stage, engine: Engine, *, arrived: bool) -> bool:
        """Check the stress, and begin the next leg if this one has ended; return whether the phase goes on."""
        memory, boundaries = stage.memory, engine.boundaries
        steps = max(1, engine.steps - memory["step"])
        stress = (float(boundaries.plate_sum[2]) - memory["force_sum"]) / steps / _area(stage.scene)
        self._check_from_now(memory, engine)
        memory["touched"] = memory["touched"] or stress > 0
        memory["most"] = max(memory.get("most", 0.0), stress)
        up = memory["leg"] % 2
        if up:
            ended = stress <= self.unload_stress_Pa
        else:
            ended = self.stress_Pa is not None and stress >= self.stress_Pa
            memory["short"] = memory["short"] or (arrived and not ended and self.stress_Pa is not None)
        if not (ended or arrived):
            return True
        memory["way"] += (-1 if up else 1) * self.speed_m_per_s * (engine.time - memory["begun"])
        memory["leg"] += 1
        if memory["leg"] < self.legs:
            self._begin_leg(memory, engine)
            return True
        boundaries.move_plate(0.0)
        if self.afterwards == "remove":
            boundaries.remove_plate()
        if not memory["touched"]:
            memory["warning"] = "the plate touched nothing, and its force is 0 N throughout; raise strain"
        elif memory["short"]:
            memory["warning"] = (
                f"a loading ended at strain {self.strain:g} before stress_Pa = {self.stress_Pa:g} Pa was reached; "
                "raise strain or lower stress_Pa"
            )
        elif self.stress_Pa is not None and memory["most"] > OVERSHOT * self.stress_Pa:
            memory["warning"] = (
                f"the stress rose to {memory['most']:.3g} Pa before the plate stopped at stress_Pa = "
                f"{self.stress_Pa:g} Pa; lower speed_m_per_s, or raise vibration.frequency_hz: stresses are averaged "
                "over whole periods"
            )
        return False


def check_plate_is_gone(scene: SceneView, index: int) -> Iterator[str]:
    """Yield an error about phase `index`, which raises bodies, if a plate is still on the pile."""
    before = [(k, phase) for k, phase in enumerate(scene.phases[:index]) if isinstance(phase, Compress)]
    if before and before[-1][1].afterwards == "stay":
        yield (
            f"phases.{index}: {scene.phases[index].kind} would raise bodies into the plate that phases.{before[-1][0]} "
            "(compress) leaves there; use afterwards: remove"
        )


def _area(scene: SceneView) -> float:
    """Return the area to which the stress refers, that of the container [m²]."""
    return math.pi * scene.container.radius_m**2
