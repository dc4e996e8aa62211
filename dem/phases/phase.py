"""Interface of phases and of their stages, which are phases that run; criterion for a settled pile.

`proceed` is called again whenever the time that it returned has passed; in between, the simulation advances and the
recorder writes. The memory of a stage is plain data, so that a run can stop between any two steps and be resumed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Protocol

import numpy as np
from pydantic import Field

from dem.engine.demand import Demand
from dem.engine.effect import EffectName
from dem.engine.interface import Engine
from dem.errors import RunError
from dem.setting.container import Container
from dem.setting.part import Duration, Part, Speed
from dem.setting.plane import Plane
from dem.setting.span import Span
from dem.setting.vibration import Vibration

CHECK_INTERVAL = 0.01  # s between checks whether a layer has come down, a pile has settled, or a force is too large
SETTLE_SECONDS = 0.35  # s, typical time in which a poured pile settles
CALMER = 0.9  # a pile comes to rest while its kinetic energy falls below this part of itself in half a longest wait

Memory = dict[str, Any]


@dataclass
class Stage:
    """A phase while it runs."""

    phase: Phase
    scene: SceneView
    index: int  #: Index of the phase in the scene
    memory: Memory  #: Plain data for JSON; the text under its key `warning` is reported at the end of the phase

    @cached_property
    def prepared(self) -> Any:
        """Result of `Phase.prepare`, computed once per process and not saved."""
        return self.phase.prepare(self.scene, self.index)

    def proceed(self, engine: Engine) -> float:
        """Do what is due in the phase and its vibration; return the time until the next call [s], 0 at the end."""
        wait = self.phase.proceed(self, engine)
        vibration = self.phase.vibrated_by
        return wait if vibration is None else self._vibrate(vibration, engine, wait)

    def _vibrate(self, vibration: Vibration, engine: Engine, wait: float) -> float:
        """Switch the vibration as is due; return the time until the next call [s], `wait` at most."""
        begun = float(self.memory.setdefault("vibration_begun", engine.time))
        # Half a step early, as all that is due at a time.
        on, until = vibration.next_switch(engine.time - begun + engine.time_step / 2)
        on = on and wait > 0
        if on != self.memory.get("vibrates", False):
            self.memory["vibrates"] = on
            if on:
                amplitude = vibration.amplitude(self.scene.gravity_m_per_s2)
                engine.boundaries.shake(
                    amplitude=amplitude, frequency=vibration.frequency_hz, walls=vibration.moves == "container"
                )
            else:
                engine.boundaries.stop_shaking()
        return min(wait, max(engine.time_step, begun + until - engine.time))


class Phase:
    """Base of all kinds of phases, with defaults that kinds override."""

    actuates: ClassVar[bool] = False  #: Whether motors move or hold the barbs
    begins: ClassVar[bool] = False  #: Whether the phase adds the bodies, which only the first phase of a run does
    of_smarticles: ClassVar[bool] = False  #: Whether the phase needs smarticles
    bends: ClassVar[frozenset[str]] = frozenset()
    """Shapes of bodies that change their shape, of which the phase needs at least one; empty: it needs none."""
    sources: ClassVar[frozenset[str]] = frozenset()
    """Keys that locate content, such as `run`; the scene's hash has the content's hash in their place."""
    at_rest: ClassVar[bool] = False
    """Whether nothing drives the smarticles; φ_0 and φ_f are measured before and after phases that drive them."""
    pours: ClassVar[bool] = False  #: Whether the phase pours bodies
    frees: ClassVar[bool] = False  #: Whether the phase takes the container away
    lets_go: ClassVar[bool] = False  #: Whether the phase releases all that earlier phases grip
    overlap: ClassVar[float] = 0.0
    """Largest overlap of bodies that the phase puts at given poses, in diameters, from which contacts throw them."""
    needs_links: ClassVar[str] = ""  #: What of the phase only the engine links computes, in words; "": nothing
    stills: ClassVar[bool] = False  #: Whether the phase ends the active bending of earlier phases
    planar: ClassVar[bool | None] = False
    """Whether the phase is possible in a plane only (True), in a container only (False), or in both (None)."""

    @property
    def kind(self) -> str:
        """The phase's `type` in a scene file."""
        return str(getattr(self, "type"))  # noqa: B009 - a field of the part that this is mixed into

    @property
    def vibrated_by(self) -> Vibration | None:
        """Vibration of the container while the phase does something else; None without it."""
        return getattr(self, "vibration", None)

    def check(self, scene: SceneView, index: int) -> Iterator[str]:
        """Yield the errors of this phase, `scene.phases[index]`, one line each: key, value and what to do.

        Only the first error is reported: later checks may assume that earlier ones found none.
        """
        yield from ()

    def ready(self, scene: SceneView) -> None:
        """Raise InputError before a run if a source of the phase, such as another run, is missing or changed."""

    @property
    def attached(self) -> tuple[str, bytes] | None:
        """Name and content of the file that the phase reads, of which the run directory keeps a copy; None: no file.

        InputError if it is missing or changed.
        """
        return None

    def origin(self, scene: SceneView) -> Mapping[str, Any] | None:
        """Return data about the other run from which smarticles are taken, for the manifest; None if none are."""
        return None

    def warnings(self, scene: SceneView, index: int) -> Sequence[str]:
        """Return warnings about suspicious values that are accepted: one line each with key and advice."""
        return ()

    @property
    def known_duration(self) -> float | None:
        """Simulated time that the phase takes [s]; None where a criterion ends it."""
        return getattr(self, "duration_s", None)

    def expected_duration(self, scene: SceneView) -> float:
        """Return the simulated time of the phase [s]; an estimate if a criterion ends the phase."""
        return self.known_duration or 0.0

    @property
    def peak_acceleration(self) -> float:
        """Greatest peak acceleration Γ of the container, in units of gravity [1]; 0 at rest."""
        return 0.0 if self.vibrated_by is None else self.vibrated_by.peak_acceleration_g

    @property
    def speed_key(self) -> str:
        """Key of the phase to which `pushing_speed` is proportional."""
        return "speed_m_per_s"

    def pushing_speed(self, gravity: float) -> float:
        """Return the greatest speed [m/s] of the boundary that the phase moves; 0 for none; gravity [m/s²]."""
        return 0.0

    def peak_speed(self, gravity: float) -> float:
        """Return the greatest speed [m/s] that the phase gives to smarticles, but for falls; gravity [m/s²]."""
        shaken = 0.0 if self.vibrated_by is None else self.vibrated_by.peak_speed(gravity)
        return self.pushing_speed(gravity) + shaken

    def spans(self) -> Iterator[Span]:
        """Yield the times within which what the phase drives changes, except motions that control updates sample."""
        if self.vibrated_by is not None:
            yield from self.vibrated_by.spans("vibration.")

    @property
    def raises(self) -> float:
        """Distance by which the phase raises a hook or a grip [m]; 0 if it raises none."""
        return 0.0

    @property
    def pulled_by(self) -> tuple[float, float] | None:
        """Stiffness [N/m] and damping [N s/m] of the phase's strings; None without strings."""
        return None

    def calls(self, scene: SceneView, index: int) -> Mapping[EffectName, str]:
        """Return the effects that the phase needs: the reason in words, by the name of the effect."""
        return {}

    def vibrating(self, scene: SceneView, index: int) -> Mapping[EffectName, str]:
        """Return the effect of the vibration with its reason, for `calls`; nothing without vibration."""
        if self.vibrated_by is None:
            return {}
        return {EffectName.CONTAINER_MOTION: f"phase {index}: {self.vibrated_by.to_text(scene.gravity_m_per_s2)}"}

    def whole_periods(self, interval: float) -> float:
        """Return an interval [s], with vibration rounded to whole periods, over which inertia has no mean force."""
        if self.vibrated_by is None:
            return interval
        frequency = self.vibrated_by.frequency_hz
        return max(1, round(interval * frequency)) / frequency

    def begin(self, scene: SceneView, index: int) -> Stage:
        """Return the stage of the phase at its beginning."""
        return Stage(self, scene, index, self.first_memory(scene))

    def first_memory(self, scene: SceneView) -> Memory:
        """Return `Stage.memory`, the data from which a run is resumed, at the beginning of the phase."""
        return {}

    def prepare(self, scene: SceneView, index: int) -> Any:
        """Return data that follow from the scene alone, for `Stage.prepared`."""

    def proceed(self, stage: Stage, engine: Engine) -> float:
        """Do what is due now; return the simulated time [s] until the next call, 0 at the end of the phase.

        RunError, with values and limits, if the phase cannot go on, or its criterion was not met in time.
        """
        raise NotImplementedError


class TimedPhase(Phase):
    """Base of phases that act once, at their beginning, and then last for `known_duration`."""

    def first_memory(self, scene: SceneView) -> Memory:
        return {"begun": False}

    def proceed(self, stage: Stage, engine: Engine) -> float:
        if stage.memory["begun"]:
            return 0.0
        stage.memory["begun"] = True
        self.act(engine)
        return self.known_duration or 0.0

    def act(self, engine: Engine) -> None:
        """Do what the phase does, at its beginning."""
        raise NotImplementedError


class SceneView(Demand, Protocol):
    """The members of a scene that phases use, described in `dem.scene.scene.Scene`."""

    @property
    def container(self) -> Container: ...
    @property
    def plane(self) -> Plane | None: ...
    @property
    def protocol(self) -> str | None: ...
    @property
    def phases(self) -> Sequence[Phase]: ...
    @property
    def smooth(self) -> bool: ...
    @property
    def sphere_diameter(self) -> float: ...
    def ample_height(self, hooks_top: float = 0.0) -> float: ...
    @property
    def loose_height(self) -> float: ...
    def seed_for(self, purpose: str) -> int: ...


def spans_of_wave(frequency_hz: float, ramp_s: float) -> Iterator[Span]:
    """Yield the period of active bending, which is 0 Hz where it rests, and the time in which it grows."""
    if frequency_hz:
        yield Span(key="frequency_hz", value=f"{frequency_hz:g} Hz", seconds=1 / frequency_hz)
    if ramp_s:
        yield Span(key="ramp_s", value=f"{ramp_s:g} s", seconds=ramp_s)


def time_left(engine: Engine, end: float) -> float:
    """Return the simulated time [s] that is left until the time `end` [s]; 0 if less than half a step."""
    left = end - engine.time
    return left if left > engine.time_step / 2 else 0.0


class Settle(Part):
    """Criterion for a settled pile: both limits hold at all checks for the time `hold_s`."""

    speed_m_per_s: Speed = Field(
        0.02,
        description="largest speed of any smarticle [m/s]; the default is that of the paper's smarticle at 9.81 m/s², "
        "0.059 √(g w), and the same for others, with the longest bar of other bodies in place of w",
    )
    unbalanced_force: float = Field(
        0.05, ge=1e-9, le=1e6, description="mean net force on a smarticle over its weight [1]"
    )
    hold_s: float = Field(
        0.05,
        ge=0,
        le=1e6,
        description="time for which both limits must hold [s]; the default is at least 1.18 √(w/g), 10 times as "
        "long as a body that turns back is slower than the default speed, with w as there",
    )
    timeout_s: Duration = Field(
        5.0,
        description="longest wait [s] while the pile loses little energy; then the run fails with the residuals",
    )


def begin_wait(memory: Memory) -> None:
    """Note in the memory of a stage that a wait begins, for `waits_in_vain`."""
    # `waited`: time since the wait began [s], which the stage adds up; `judged`: length of the wait at the last verdict
    # [s]; `energy` and `before`: largest kinetic energies since that verdict, and between it and the one before [J].
    memory.update(waited=0.0, judged=0.0, energy=0.0, before=0.0)


def waits_in_vain(memory: Memory, energy: float, longest: float) -> bool:
    """Return whether a wait is at its end: `longest` [s] have passed, and the pile no longer loses energy.

    Low gravity, bounces with little loss, or friction alone make long waits, but energy then decays all the time.

    The memory is that of the stage, see `begin_wait`; the energy is the kinetic energy of the pile [J].
    """
    if "judged" not in memory:  # a run that an older version has begun
        memory.update(judged=0.0, energy=0.0, before=0.0)
    memory["energy"] = max(memory["energy"], energy)
    if memory["waited"] <= memory["judged"] + longest / 2:
        return False
    calmer = memory["energy"] < CALMER * memory["before"]
    memory.update(judged=memory["judged"] + longest / 2, before=memory["energy"], energy=0.0)
    return bool(memory["judged"] >= longest and not calmer)


def has_settled(settle: Settle, memory: Memory, engine: Engine) -> bool:
    """Return whether the pile has settled; to be called every `CHECK_INTERVAL`.

    Contact forces may fluctuate for ever although nothing moves, e.g. in weak gravity. After `timeout_s`, a pile that
    was slower than its limit v for half of this time, t, counts as settled, with a warning: mean net forces in that
    time were below 2 m v/t, which must be within the limit of the unbalanced force.

    Args:
        memory: memory of the stage, see `begin_wait`. Its `waited` is the time since the wait began [s], which the
            phase updates. This function updates `still` and `slow`, the times for which both limits have held, and for
            which that of the speed has held [s].

    Raises:
        RunError: the pile has not settled within `settle.timeout_s`, and no longer comes nearer to rest.
    """
    state = engine.state()
    speeds = np.linalg.norm(state.velocities, axis=1)
    speed = float(speeds.max())
    unbalanced = engine.unbalanced_force()
    limit = settle.speed_m_per_s
    still = speed < limit and unbalanced < settle.unbalanced_force
    memory["still"] = memory["still"] + CHECK_INTERVAL if still else 0.0
    memory["slow"] = memory.get("slow", 0.0) + CHECK_INTERVAL if speed < limit else 0.0
    if memory["still"] > settle.hold_s:
        return True
    forces = f"unbalanced force {unbalanced:.3g} (limit {settle.unbalanced_force:g})"
    long = settle.timeout_s / 2
    balanced = 2 * limit / (engine.gravity * long) <= settle.unbalanced_force
    if balanced and memory["slow"] >= long and memory["waited"] >= settle.timeout_s:
        memory["warning"] = (
            f"contact forces still fluctuate, {forces}, but for {memory['slow']:.3g} s no smarticle was faster than "
            f"{limit:g} m/s, so that the pile counts as settled"
        )
        return True
    if waits_in_vain(memory, state.kinetic_energy, settle.timeout_s):
        raise RunError(
            f"the pile has not settled after {memory['judged']:g} s: speed {speed:.3g} m/s (limit {limit:g} m/s) of "
            f"smarticle {speeds.argmax()}, {forces}; raise phases.0.settle.timeout_s or its limits (contacts do not "
            "resist rolling, so that a body that hangs or rocks can swing on)"
        )
    return False
