"""The phase that shakes the container."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal, Self

from pydantic import Field, model_validator

from dem.engine.effect import EffectName
from dem.engine.interface import Engine
from dem.errors import rounded_up
from dem.phases.phase import Memory, Phase, SceneView, Stage, time_left
from dem.phases.remove_container import check_wall_is_gone, is_freed
from dem.setting.hooks import TOLERANCE
from dem.setting.part import Duration, Part
from dem.setting.span import STEPS, VARYING_STEPS, Span
from dem.setting.vibration import Moved, PeakAcceleration, ShakingFrequency, Vibration, shaking_amplitude

# Largest amplitude in sphere diameters. The rounding of positions at this height, 2⁻⁵³ of it, is 1e-11 diameters, still
# far below the overlap of a lone smarticle at rest, about 1e-4 diameters.
MOST_AMPLITUDE = 1e5
PLACES = 100  # number of places of a sweep at which its largest amplitude and speed are searched


class Shake(Part, Phase):
    """Shake the container, or its floor alone, vertically: z = A sin(2πft) with A = Γg/(2πf)².

    A sweep changes Γ and f from cycle to cycle, towards their values at the end. With `taps` the container makes single
    cycles from its lowest point, z = A (1 - cos(2πft)), with a rest after each. After a phase that takes the container
    away the unbounded floor is shaken, with all smarticles on it.
    """

    type: Literal["shake"]
    duration_s: Duration = Field(20.0, description="length of the phase [s]; default with taps: until the last rest")
    frequency_hz: ShakingFrequency = Field(30.0, description="f, frequency [Hz]; of a sweep: at the start")
    peak_acceleration_g: PeakAcceleration = Field(
        2.0, description="Γ, peak acceleration in units of gravity [1]; of a sweep: at the start"
    )
    moves: Moved = Field(
        "container", description="what moves: the whole container, or its floor alone, as in the paper's own code"
    )
    frequency_end_hz: ShakingFrequency | None = Field(
        None, description="f at the end of a sweep, or of the last tap [Hz]; null: as at the start"
    )
    peak_acceleration_end_g: PeakAcceleration | None = Field(
        None, description="Γ at the end of a sweep, or of the last tap [1]; null: as at the start"
    )
    ramp: Literal["linear", "log"] = Field(
        "linear", description="how f and Γ go from start to end: linear, or log, by equal ratios in equal times"
    )
    taps: int | None = Field(None, ge=1, le=1_000_000, description="number of taps; null: continuous shaking [1]")
    rest_s: float = Field(0.5, ge=0, le=1e6, description="rest after each tap [s]")

    @model_validator(mode="before")
    @classmethod
    def _until_the_last_rest(cls, data: Any) -> Any:
        """Fill in the default of `duration_s` of taps, if the other keys are valid."""
        if not isinstance(data, Mapping) or data.get("taps") is None or "duration_s" in data:
            return data
        try:
            given = cls.model_validate({**data, "duration_s": 1e6})
        except ValueError:
            return data  # pydantic reports what is wrong
        return {**data, "duration_s": given.tapping_s}

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if self.taps is None and self.rest_s != Shake.model_fields["rest_s"].default:
            raise ValueError(f"rest_s: {self.rest_s:g} s is the rest after a tap; give taps, or leave rest_s out")
        if not self.sweeps and self.ramp == "log":
            raise ValueError(
                f"ramp: {self.ramp} has no end to go to; give frequency_end_hz or peak_acceleration_end_g, or leave "
                "ramp out"
            )
        if self.ramp == "log" and 0.0 in (self.peak_acceleration_g, self.peak_acceleration_end_g):
            raise ValueError("ramp: log has equal ratios, and Γ = 0 has none; use linear, or a small Γ")
        if self.taps is not None and self.duration_s < self.tapping_s * (1 - TOLERANCE):
            raise ValueError(
                f"duration_s: {self.duration_s:g} s is too short for {self.taps} taps and their rests of "
                f"{self.rest_s:g} s; use at least {rounded_up(self.tapping_s, 6)} s, or leave it out"
            )
        return self

    @property
    def sweeps(self) -> bool:
        """Whether f or Γ changes."""
        return self.frequency_end_hz is not None or self.peak_acceleration_end_g is not None

    @property
    def tapping_s(self) -> float:
        """Time that all taps and rests take [s]."""
        count = self.taps or 0
        return math.fsum(1 / self.at(self._place(k))[0] + self.rest_s for k in range(count))

    def _place(self, tap: int) -> float:
        """Return the place of a tap in the ramp, from 0 for the first tap to 1 for the last one."""
        return tap / max(1, (self.taps or 1) - 1)

    def at(self, place: float) -> tuple[float, float]:
        """Return f [Hz] and Γ [1] at a place of the ramp, from 0 at its start to 1 at its end."""
        ends = (self.frequency_hz, self.frequency_end_hz), (self.peak_acceleration_g, self.peak_acceleration_end_g)
        frequency, acceleration = (self._between(start, end, place) for start, end in ends)
        return frequency, acceleration

    def _between(self, start: float, end: float | None, place: float) -> float:
        if end is None:
            return start
        if place == 1:
            return end  # without rounding
        return start + (end - start) * place if self.ramp == "linear" else start * (end / start) ** place

    def cycle_start(self, number: int) -> float:
        """Return the time since the start of a sweep when cycle `number` begins, ∫ f dt = `number` [s]; inf: never."""
        begin, end, duration = self.frequency_hz, self.frequency_end_hz, self.duration_s
        if end is None or end == begin:
            return number / begin
        if self.ramp == "linear":
            square = begin**2 + 2 * (end - begin) / duration * number
            return 2 * number / (begin + math.sqrt(square)) if square >= 0 else math.inf
        growth = math.log(end / begin) / duration
        inside = 1 + number * growth / begin
        return math.log(inside) / growth if inside > 0 else math.inf

    def amplitude(self, gravity: float) -> float:
        """Return the amplitude A = Γg/(2πf)² [m], of a sweep the largest one; gravity g in m/s²."""
        return max(shaking_amplitude(acceleration, frequency, gravity) for frequency, acceleration in self._course)

    @property
    def _course(self) -> list[tuple[float, float]]:
        """Pairs of f [Hz] and Γ [1] along the ramp; a single pair without a sweep."""
        return [self.at(k / PLACES) for k in range(PLACES + 1)] if self.sweeps else [self.at(0.0)]

    @property
    def peak_acceleration(self) -> float:
        return max(acceleration for _, acceleration in self._course)

    @property
    def fastest(self) -> tuple[float, float]:
        """Frequency [Hz] and Γ [1] where the peak speed is greatest."""
        return max(self._course, key=lambda one: one[1] / one[0])

    @property
    def speed_key(self) -> str:
        end = self.fastest[1] == self.peak_acceleration_end_g != self.peak_acceleration_g
        return "peak_acceleration_end_g" if end else "peak_acceleration_g"

    def frequency_key(self, frequency: float) -> str:
        """Return the key of the scene to change for another frequency than this [Hz], of those along the ramp."""
        end = frequency == self.frequency_end_hz != self.frequency_hz
        return "frequency_end_hz" if end else "frequency_hz"

    def spans(self) -> Iterator[Span]:
        if not self.peak_acceleration:
            return
        highest = max(self.frequency_hz, self.frequency_end_hz or 0.0)
        varies = self.frequency_end_hz not in (None, self.frequency_hz)
        yield Span(
            key=self.frequency_key(highest),
            value=f"{highest:g} Hz",
            seconds=1 / highest,
            steps=VARYING_STEPS if varies else STEPS,
            # Cycles of varying lengths have no common step.
            whole=not varies and (self.taps is not None or self.sweeps),
        )

    def warnings(self, scene: SceneView, index: int) -> Sequence[str]:
        if not 0 < self.peak_acceleration < 1:
            return ()
        return (
            f"phases.{index}.peak_acceleration_g: Γ = {self.peak_acceleration:g} is below 1, so that the pile moves "
            "with the floor like one body and never leaves it; use more than 1 to loosen the pile",
        )

    def pushing_speed(self, gravity: float) -> float:
        # As A times 2πf, and no shorter: the last bits of old results depend on it.
        return max(shaking_amplitude(g, f, gravity) * 2 * math.pi * f for f, g in self._course)

    def calls(self, scene: SceneView, index: int) -> Mapping[EffectName, str]:
        alone = ", the floor alone" if is_freed(scene, index) or self.moves == "floor" else ""
        gravity, (end_f, end_g) = scene.gravity_m_per_s2, self.at(1.0)
        ends = (self.peak_acceleration_g, end_g), (self.frequency_hz, end_f)
        acceleration, frequency = (f"{a:g}" if a == b else f"{a:g} to {b:g}" for a, b in ends)
        most = "up to " if self.sweeps else ""
        why = f"phase {index}: Γ = {acceleration}, f = {frequency} Hz, A = {most}{1e3 * self.amplitude(gravity):.3g} mm"
        taps = "" if self.taps is None else f", {self.taps} taps, {self.rest_s:g} s between them"
        ramp = f", {self.ramp} ramp" if self.sweeps else ""
        return {EffectName.CONTAINER_MOTION: f"{why}{alone}{taps}{ramp}"}

    def check(self, scene: SceneView, index: int) -> Iterator[str]:
        gravity = scene.gravity_m_per_s2
        frequency, acceleration = max(self._course, key=lambda one: shaking_amplitude(one[1], one[0], gravity))
        # Taps go up from where the floor rests.
        alone = self.moves == "floor" and self.taps is None
        key = f"phases.{index}.{self.frequency_key(frequency)}"
        yield from _of_amplitude(scene, key, frequency, acceleration, floor_alone=alone)

    def first_memory(self, scene: SceneView) -> Memory:
        return {"begun": False}

    def proceed(self, stage: Stage, engine: Engine) -> float:
        memory, gravity = stage.memory, stage.scene.gravity_m_per_s2
        begins = not memory["begun"]
        if begins:
            if is_freed(stage.scene, stage.index):
                check_wall_is_gone(engine, "the floor that is to be shaken")
            engine.motors.weld()
            # `begin`: time at the beginning of the phase [s]; `cycle`: number of cycles, or taps, that have begun;
            # `moves`: whether a tap is not over.
            memory.update(begun=True, begin=engine.time, cycle=0, moves=False)
        if self.taps is not None:
            return self._tap(memory, engine, gravity)
        if self.sweeps:
            return self._sweep(memory, engine, gravity)
        if not begins:
            engine.boundaries.stop()
            return 0.0
        self._move(engine, self.frequency_hz, self.peak_acceleration_g, gravity)
        return self.duration_s

    def _sweep(self, memory: Memory, engine: Engine, gravity: float) -> float:
        """Begin the next cycle of a sweep; return its length [s], 0 at the end of the phase."""
        wait = time_left(engine, memory["begin"] + self.duration_s)
        if not wait:
            engine.boundaries.stop()
            return 0.0
        first, last = (self.cycle_start(memory["cycle"] + k) for k in (0, 1))
        memory["cycle"] += 1
        place = (first + min(last, self.duration_s)) / (2 * self.duration_s)
        frequency, acceleration = self.at(min(1.0, place))
        if last < self.duration_s * (1 + TOLERANCE):
            wait = self._whole(memory["begin"] + last - engine.time, engine)
            frequency = 1 / wait
        self._move(engine, frequency, acceleration, gravity)
        return wait

    def _tap(self, memory: Memory, engine: Engine, gravity: float) -> float:
        """Begin the next tap or rest; return its length [s], 0 at the end of the phase."""
        if memory["moves"]:
            memory["moves"] = False
            engine.boundaries.stop()
            if memory["cycle"] == self.taps:
                return time_left(engine, memory["begin"] + self.duration_s)
            if self.rest_s:
                return self.rest_s
        if memory["cycle"] == self.taps:
            return 0.0
        frequency, acceleration = self.at(self._place(memory["cycle"]))
        memory.update(cycle=memory["cycle"] + 1, moves=True)
        length = self._whole(1 / frequency, engine)
        self._move(engine, 1 / length, acceleration, gravity)
        return length

    @staticmethod
    def _whole(wait: float, engine: Engine) -> float:
        """Return a time [s], rounded to whole steps, so that cycles end where they began."""
        return max(1, round(wait / engine.time_step)) * engine.time_step

    def _move(self, engine: Engine, frequency: float, acceleration: float, gravity: float) -> None:
        engine.boundaries.shake(
            amplitude=shaking_amplitude(acceleration, frequency, gravity),
            frequency=frequency,
            walls=self.moves == "container",
            from_rest=self.taps is not None,
        )


def check_shaking(scene: SceneView, where: str, vibration: Vibration) -> Iterator[str]:
    """Yield errors about a vibration, which is at the key `where`."""
    alone = vibration.moves == "floor"
    key, frequency = f"{where}.frequency_hz", vibration.frequency_hz
    yield from _of_amplitude(scene, key, frequency, vibration.peak_acceleration_g, floor_alone=alone)


def _of_amplitude(
    scene: SceneView, key: str, frequency: float, acceleration: float, *, floor_alone: bool
) -> Iterator[str]:
    if acceleration and not scene.gravity_m_per_s2:
        yield (
            f"{key.rpartition('.')[0]}.peak_acceleration_g: Γ = {acceleration:g} is in units of gravity, and "
            "gravity_m_per_s2 is 0, so that nothing would move; give a gravity, or leave the motion out"
        )
    # The floor must not drop below the wall's lower edge.
    amplitude, depth = shaking_amplitude(acceleration, frequency, scene.gravity_m_per_s2), -scene.cylinder.bottom
    most = MOST_AMPLITUDE * scene.sphere_diameter
    if amplitude > most:
        least = frequency * math.sqrt(amplitude / most)
        yield (
            f"{key}: {frequency:g} Hz at Γ = {acceleration:g} moves the container by A = "
            f"{amplitude:.3g} m up and down, at most {most:.3g} m are computed; use at least {1.005 * least:.3g} Hz"
        )
    if floor_alone and amplitude > depth:
        yield (
            f"{key.rpartition('.')[0]}.moves: the floor alone would go {amplitude:.3g} m down, and the wall ends "
            f"{depth:.3g} m below the floor; use a lower peak_acceleration_g, a higher frequency_hz or moves: container"
        )
