"""Interface of phases, the stage that is a phase while it runs, and the criterion for a settled pile.

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

CHECK_INTERVAL = 0.01  # s between checks whether a layer has come down, a pile has settled, or a force is too large
SETTLE_SECONDS = 0.35  # s, typical time in which a poured pile settles

Memory = dict[str, Any]


@dataclass
class Stage:
    """A phase while it runs."""

    phase: Phase
    scene: SceneView
    index: int  #: Index of the phase in the scene
    memory: Memory  #: Plain data for JSON; its key `warning` is reported at the end of the phase

    @cached_property
    def prepared(self) -> Any:
        """Result of `Phase.prepare`, computed once per process and not saved."""
        return self.phase.prepare(self.scene, self.index)

    def proceed(self, engine: Engine) -> float:
        return self.phase.proceed(self, engine)


class Phase:
    """Base of all kinds of phases, which override what differs from these defaults."""

    actuates: ClassVar[bool] = False  #: Whether motors move or hold the barbs
    begins: ClassVar[bool] = False  #: Whether the phase adds the smarticles; a run begins with one such phase
    of_smarticles: ClassVar[bool] = False  #: Whether the phase has no meaning for other bodies than smarticles
    bends: ClassVar[frozenset[str]] = frozenset()
    """Shapes of bodies that change their shape, of which the phase needs one; none: it needs no such bodies."""
    sources: ClassVar[frozenset[str]] = frozenset()
    """Keys that say where content is found that another key fixes by its hash; the scene's hash omits them."""
    at_rest: ClassVar[bool] = False
    """Whether nothing drives the smarticles; φ_0 and φ_f are measured before and after phases that drive them."""
    pours: ClassVar[bool] = False  #: Whether the phase pours the smarticles
    frees: ClassVar[bool] = False  #: Whether the phase takes the container away
    planar: ClassVar[bool | None] = False
    """Whether the phase is possible in a plane only (True), in a container only (False), or in both (None)."""

    @property
    def kind(self) -> str:
        """The phase's `type` in a scene file."""
        return str(getattr(self, "type"))  # noqa: B009 - a field of the part that this is mixed into

    def check(self, scene: SceneView, index: int) -> Iterator[str]:
        """Yield the errors of this phase, `scene.phases[index]`, one line each: key, value and what to do.

        Only the first error is reported: later checks may assume that earlier ones found none.
        """
        yield from ()

    def ready(self, scene: SceneView) -> None:
        """Raise InputError before a run if the source of the phase's content is missing or has changed."""

    @property
    def origin(self) -> Mapping[str, Any] | None:
        """Data about the run from which smarticles are taken, for the manifest; None without such a run."""
        return None

    def warnings(self, scene: SceneView, index: int) -> Sequence[str]:
        """Return warnings about accepted but suspicious values: one line each with key and what to do."""
        return ()

    @property
    def known_duration(self) -> float | None:
        """Simulated time that the phase takes [s]; None where a criterion ends it."""
        return getattr(self, "duration_s", None)

    def expected_duration(self, count: int) -> float:
        """Return the simulated time of the phase [s]; if a criterion ends it, an estimate from `count`."""
        return self.known_duration or 0.0

    speed_key: ClassVar[str] = "speed_m_per_s"  #: Key that `pushing_speed` is proportional to

    def pushing_speed(self, gravity: float) -> float:
        """Return the greatest speed [m/s] of the boundary that the phase moves; 0 if it moves none.

        Args:
            gravity: acceleration of gravity [m/s²].
        """
        return 0.0

    def peak_speed(self, gravity: float) -> float:
        """Return the greatest speed [m/s] that the phase itself gives to smarticles; falls do not count.

        Args:
            gravity: acceleration of gravity [m/s²].
        """
        return self.pushing_speed(gravity)

    @property
    def raises(self) -> float:
        """Distance by which the phase raises a hook [m]."""
        return 0.0

    @property
    def pulled_by(self) -> tuple[float, float] | None:
        """Stiffness [N/m] and damping [N s/m] of the phase's strings; None without strings."""
        return None

    def calls(self, scene: SceneView, index: int) -> Mapping[EffectName, str]:
        """Return the effects that the phase needs, each with the reason in words."""
        return {}

    def begin(self, scene: SceneView, index: int) -> Stage:
        """Return the stage of the phase at its beginning."""
        return Stage(self, scene, index, self.first_memory(scene))

    def first_memory(self, scene: SceneView) -> Memory:
        """Return the memory of the stage at its beginning."""
        return {}

    def prepare(self, scene: SceneView, index: int) -> Any:
        """Return data that follow from the scene alone, for `Stage.prepared`."""

    def proceed(self, stage: Stage, engine: Engine) -> float:
        """Do what is due; return the simulated time [s] until the next call, or 0 when the phase is over.

        Raises:
            RunError: the phase cannot go on, or its criterion was not met in time; one line with values and limits.
        """
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


def time_left(engine: Engine, end: float) -> float:
    """Return the simulated time [s] that is left until the time `end` [s]; 0 if less than half a step."""
    left = end - engine.time
    return left if left > engine.time_step / 2 else 0.0


class Settle(Part):
    """Criterion for a settled pile: both limits hold at all checks for the time `hold_s`."""

    speed_m_per_s: Speed = Field(0.02, description="largest speed of any smarticle [m/s]")
    unbalanced_force: float = Field(
        0.05, ge=1e-9, le=1e6, description="mean net force on a smarticle over its weight [1]"
    )
    hold_s: float = Field(0.05, ge=0, le=1e6, description="time for which both limits must hold [s]")
    timeout_s: Duration = Field(5.0, description="longest wait [s]; then the run fails with the residuals")


def has_settled(settle: Settle, memory: Memory, engine: Engine) -> bool:
    """Return whether the pile has settled; to be called every `CHECK_INTERVAL`.

    Args:
        memory: memory of the stage, with `waited`, the time since the wait began [s], which the stage adds up, and
            `still`, the time for which both limits have held [s], which this function updates.

    Raises:
        RunError: the pile has not settled within `settle.timeout_s`.
    """
    speed = float(np.linalg.norm(engine.state().velocities, axis=1).max())
    unbalanced = engine.unbalanced_force()
    still = speed < settle.speed_m_per_s and unbalanced < settle.unbalanced_force
    memory["still"] = memory["still"] + CHECK_INTERVAL if still else 0.0
    if memory["still"] > settle.hold_s:
        return True
    if memory["waited"] > settle.timeout_s:
        raise RunError(
            f"the pile has not settled after {settle.timeout_s:g} s: speed {speed:.3g} m/s (limit "
            f"{settle.speed_m_per_s:g} m/s), unbalanced force {unbalanced:.3g} (limit "
            f"{settle.unbalanced_force:g}); raise phases.0.settle.timeout_s or its limits"
        )
    return False
