"""What every phase of a scene answers, and what a phase is while it runs.

A kind of phase is one file: its data, a validated part of the scene; what is checked of it; how long it takes; what it
calls for; and its stage. `dem.phases.kinds` lists the kinds that there are.

A stage is asked again and again when it wants to be asked next; in between, time passes and everything due is recorded.
All that it remembers is plain data, so that a run can be stopped between any two steps and go on as if it had not been.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Protocol

from dem.engine.demand import Demand
from dem.engine.effect import EffectName
from dem.engine.interface import Engine
from dem.setting.container import Container
from dem.setting.plane import Plane

CHECK_INTERVAL = 0.01  # s between looks at whether a layer has come down, a pile has settled, or a force is too much

Memory = dict[str, Any]


class Stage(Protocol):
    """One phase while it runs."""

    memory: Memory
    """All that the stage remembers: plain data, JSON-able without loss; what is to be told of it at its end stands
    under `warning`."""

    def proceed(self, engine: Engine) -> float:
        """Do what is due now.

        Returns:
            Time [s] after which to be asked again; 0: the phase is over.

        Raises:
            RunError: the phase did not end as it should; the message says by how much.
        """


class Phase:
    """One entry of a scene's list. What is said here holds for a kind of phase that does not say otherwise."""

    actuates: ClassVar[bool] = False
    """Whether motors move the barbs in it, or hold them."""
    begins: ClassVar[bool] = False
    """Whether it brings the smarticles: a run begins with one such phase and has no other."""
    sources: ClassVar[frozenset[str]] = frozenset()
    """Keys that say where something comes from whose content another key pins; a scene's hash leaves them out."""
    pours: ClassVar[bool] = False
    """Whether the pile grows from nothing in it."""
    frees: ClassVar[bool] = False
    """Whether it takes the container away."""
    planar: ClassVar[bool | None] = False
    """Whether it has a meaning in a plane only (True), outside of one only (False), or in either (None)."""

    @property
    def kind(self) -> str:
        """Its `type` in a scene file."""
        return str(getattr(self, "type"))  # noqa: B009 - a field of the part that this is mixed into

    def check(self, scene: SceneView, index: int) -> None:
        """Check it against the rest of its scene, where it is number `index`.

        Raises:
            ValueError: one line with key, value and the way out.
        """

    def ready(self, scene: SceneView) -> None:
        """Refuse to begin a run where something that it needs is gone since the scene was read.

        Raises:
            InputError: one line with key, value and the way out.
        """

    @property
    def origin(self) -> Mapping[str, Any] | None:
        """What a run's manifest is to say of the run that its smarticles come from; None: they are its own."""
        return None

    def warnings(self, scene: SceneView, index: int) -> Sequence[str]:
        """What is no reason to refuse it: one line each with key, value and the way out."""
        return ()

    @property
    def known_duration(self) -> float | None:
        """Its length in simulated time [s]; None where a criterion ends it."""
        raise NotImplementedError

    def expected_duration(self, count: int) -> float:
        """Its length [s], estimated where a criterion ends it, for so many smarticles."""
        return self.known_duration or 0.0

    @property
    def duration_key(self) -> str:
        """The key that sets its length, with a dot in front; empty where none does alone."""
        return ".duration_s" if "duration_s" in getattr(type(self), "model_fields", {}) else ""

    @property
    def progress_duration(self) -> float | None:
        """What its progress is measured against [s]; None where that is not time."""
        return self.known_duration

    @property
    def pushing_speed(self) -> float:
        """Speed at which it moves something through the pile or pulls at it [m/s]."""
        return 0.0

    def peak_speed(self, gravity: float) -> float:
        """Greatest speed at which it makes smarticles move, falls apart [m/s]; gravity in m/s²."""
        return self.pushing_speed

    @property
    def raises(self) -> float:
        """How far it raises a hook [m]."""
        return 0.0

    @property
    def pulled_by(self) -> tuple[float, float] | None:
        """Stiffness [N/m] and damping [N s/m] of the strings that it pulls by; None: it has none."""
        return None

    def calls(self, scene: SceneView, index: int) -> Mapping[EffectName, str]:
        """The effects that it calls for, and what for, in words."""
        return {}

    def begin(self, scene: SceneView, index: int) -> Stage:
        """Its stage, at the beginning."""
        raise NotImplementedError


class SceneView(Demand, Protocol):
    """What a phase may know of its scene: what an engine may, and what else there is."""

    @property
    def container(self) -> Container:
        """The container."""

    @property
    def plane(self) -> Plane | None:
        """Motion in a plane."""

    @property
    def phases(self) -> Sequence[Phase]:
        """All phases, in order."""

    @property
    def smooth(self) -> bool:
        """Whether links are taken as they are, and not as chains of spheres."""

    @property
    def sphere_diameter(self) -> float:
        """[m]."""

    def ample_height(self, hooks_top: float = 0.0) -> float:
        """Height [m] of a wall that is enough for the loosest pile."""

    @property
    def loose_height(self) -> float:
        """About the height [m] of the poured pile."""

    def seed_for(self, purpose: str) -> int:
        """A seed for one purpose, from the scene's."""


def time_left(engine: Engine, end: float) -> float:
    """Time [s] until `end`; 0 where it is nearer than half a step, as near as steps come."""
    left = end - engine.time
    return left if left > engine.time_step / 2 else 0.0
