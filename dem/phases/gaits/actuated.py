"""What all phases have in common in which motors are at work, and their stage."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

from dem.engine.effect import EffectName
from dem.engine.interface import Engine
from dem.phases.gaits.checks import actuation_warnings, check_actuated
from dem.phases.gaits.drive import Drive, Gait, drive
from dem.phases.phase import Memory, Phase, SceneView, Stage
from dem.setting.motor import Motor
from dem.setting.smarticle import Smarticle


class ActuatedPhase(Phase):
    """A phase in which motors move the barbs or hold them."""

    planar: ClassVar[bool | None] = None
    actuates: ClassVar[bool] = True

    def gait(self, smarticle: Smarticle, motor: Motor) -> Gait:
        """What it is short for."""
        raise NotImplementedError

    def own(self, key: str) -> tuple[str, float | None]:
        """The key of this phase that sets `key` of the gait, and its value."""
        raise NotImplementedError

    def check(self, scene: SceneView, index: int) -> None:
        """See `Phase.check`."""
        check_actuated(scene, index)

    def warnings(self, scene: SceneView, index: int) -> Sequence[str]:
        """See `Phase.warnings`."""
        return actuation_warnings(scene)

    def calls(self, scene: SceneView, index: int) -> Mapping[EffectName, str]:
        """See `Phase.calls`."""
        return {EffectName.ARTICULATION: str(index)}

    def begin(self, scene: SceneView, index: int) -> Stage:
        """See `Phase.begin`."""
        return Actuating(drive(scene, index), scene.fidelity.control_interval_s)


class Actuating:
    """The motors follow their schedule, one look per control period; smarticles are articulated meanwhile."""

    def __init__(self, schedule: Drive, interval: float) -> None:
        self._drive = schedule
        self._interval = interval
        self._looks = math.ceil(schedule.duration / interval - 1e-9)
        self.memory: Memory = {"look": 0}

    def proceed(self, engine: Engine) -> float:
        """See `Stage.proceed`."""
        look: int = self.memory["look"]
        if look == 0:
            engine.motors.articulate()
        # The last look only takes note of the work since the one before.
        time = min((look + 1) * self._interval, self._drive.duration)
        engine.motors.actuate(self._drive.targets(time), self._interval)
        self.memory["look"] = look + 1
        return self._interval if look < self._looks else 0.0
