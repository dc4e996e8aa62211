"""What every phase of a scene answers, what a phase is while it runs, and when a pile counts as settled.

A kind of phase has one file: its data, a validated part of the scene; its checks; how long it takes; what it calls for;
and what it does. `dem.phases.kinds` lists the kinds.

`proceed` is called again and again, after the time that it returned; in between, time advances and everything due
is recorded. All that a stage remembers is plain data, so that a run can stop between any two steps and be resumed.
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
SETTLE_SECONDS = 0.35  # that a poured pile takes to settle, about

Memory = dict[str, Any]


@dataclass
class Stage:
    """A phase while it runs; its memory is plain data for JSON, `warning` is reported at its end."""

    phase: Phase
    scene: SceneView
    index: int
    memory: Memory

    @cached_property
    def prepared(self) -> Any:
        """What the phase needs besides the memory."""
        return self.phase.prepare(self.scene, self.index)

    def proceed(self, engine: Engine) -> float:
        return self.phase.proceed(self, engine)


class Phase:
    """One entry of a scene's list; kinds of phases override what differs from these defaults."""

    actuates: ClassVar[bool] = False  #: Whether motors move the barbs in it, or hold them
    begins: ClassVar[bool] = False
    """Whether it brings the smarticles: a run begins with one such phase and has no other."""
    sources: ClassVar[frozenset[str]] = frozenset()
    """Keys that name the source of content which another key pins; a scene's hash omits them."""
    at_rest: ClassVar[bool] = False
    """Whether nothing drives the smarticles in it; all other phases count as activity, around which φ is measured."""
    pours: ClassVar[bool] = False  #: Whether the pile grows from nothing in it
    frees: ClassVar[bool] = False  #: Whether it takes the container away
    planar: ClassVar[bool | None] = False
    """Whether it has a meaning in a plane only (True), outside of one only (False), or in either (None)."""

    @property
    def kind(self) -> str:
        """Its `type` in a scene file."""
        return str(getattr(self, "type"))  # noqa: B009 - a field of the part that this is mixed into

    def check(self, scene: SceneView, index: int) -> Iterator[str]:
        """Yield what is wrong with it in its scene, where it is number `index`: one line with key, value and way out.

        Each item relies on the ones before not to be yielded.
        """
        yield from ()

    def ready(self, scene: SceneView) -> None:
        """Check before a run begins that what it needs is still there.

        Raises:
            InputError: one line with key, value and the way out.
        """

    @property
    def origin(self) -> Mapping[str, Any] | None:
        """The run that its smarticles come from, for the manifest; None: they are its own."""
        return None

    def warnings(self, scene: SceneView, index: int) -> Sequence[str]:
        """Return what is suspicious but accepted: one line each with key, value and the way out."""
        return ()

    @property
    def known_duration(self) -> float | None:
        """Its length in simulated time [s]; None where a criterion ends it."""
        return getattr(self, "duration_s", None)

    def expected_duration(self, count: int) -> float:
        """Return its length [s], estimated where a criterion ends it, for a number of smarticles."""
        return self.known_duration or 0.0

    @property
    def pushing_speed(self) -> float:
        """Speed at which it moves something through the pile or pulls at it [m/s]."""
        return 0.0

    def peak_speed(self, gravity: float) -> float:
        """Return the greatest speed at which it makes smarticles move, except for falls [m/s]; gravity in m/s²."""
        return self.pushing_speed

    @property
    def raises(self) -> float:
        """Distance by which it raises a hook [m]."""
        return 0.0

    @property
    def pulled_by(self) -> tuple[float, float] | None:
        """Stiffness [N/m] and damping [N s/m] of its strings; None: it has none."""
        return None

    def calls(self, scene: SceneView, index: int) -> Mapping[EffectName, str]:
        """Return the effects that it calls for, each with the purpose in words."""
        return {}

    def begin(self, scene: SceneView, index: int) -> Stage:
        """Return its stage, at the beginning."""
        return Stage(self, scene, index, self.first_memory(scene))

    def first_memory(self, scene: SceneView) -> Memory:
        """Return what its stage remembers at the beginning."""
        return {}

    def prepare(self, scene: SceneView, index: int) -> Any:
        """Return what its stage computes only once."""

    def proceed(self, stage: Stage, engine: Engine) -> float:
        """Do what is due now; return the time [s] until the next call, 0 where the phase is over.

        Raises:
            RunError: the phase did not end as it should; the message says by how much.
        """
        raise NotImplementedError


class SceneView(Demand, Protocol):
    """What a phase may know of its scene: all that an engine may know, and more."""

    @property
    def container(self) -> Container: ...

    @property
    def plane(self) -> Plane | None: ...

    @property
    def phases(self) -> Sequence[Phase]: ...

    @property
    def smooth(self) -> bool:
        """Whether the engine takes links as they are, and not as chains of spheres."""

    @property
    def sphere_diameter(self) -> float: ...

    def ample_height(self, hooks_top: float = 0.0) -> float:
        """Return the height [m] of a wall that is enough for the loosest pile."""

    @property
    def loose_height(self) -> float:
        """Approximate height [m] of the poured pile."""

    def seed_for(self, purpose: str) -> int: ...


def time_left(engine: Engine, end: float) -> float:
    """Return the time [s] until `end`; 0 where it is nearer than half a step."""
    left = end - engine.time
    return left if left > engine.time_step / 2 else 0.0


class Settle(Part):
    """When a pile counts as settled: both limits hold at every check over a stretch of time."""

    speed_m_per_s: Speed = Field(0.02, description="largest speed of any smarticle [m/s]")
    unbalanced_force: float = Field(
        0.05, ge=1e-9, le=1e6, description="mean net force on a smarticle over its weight [1]"
    )
    hold_s: float = Field(0.05, ge=0, le=1e6, description="how long both must hold [s]")
    timeout_s: Duration = Field(5.0, description="longest wait [s]; then the run fails with the residuals")


def has_settled(settle: Settle, memory: Memory, engine: Engine) -> bool:
    """Check a pile once, every `CHECK_INTERVAL`.

    Args:
        memory: of the stage: `waited` [s] for the pile so far, which the stage adds up; `still` [s] that it has been.

    Raises:
        RunError: it takes too long.
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
