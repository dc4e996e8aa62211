"""What all phases have in common in which motors are at work, and their stage."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

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
    """The motors follow their schedule, one look per control period; smarticles are articulated meanwhile.

    Args:
        schedule: the target angles.
        interval: a control period [s].
        halt_every: looks after which time is to stop, so that somebody can look at the pile; None: never.
    """

    def __init__(self, schedule: Drive, interval: float, *, halt_every: int | None = None) -> None:
        self._drive = schedule
        self._interval = interval
        self._looks = math.ceil(schedule.duration / interval - 1e-9)
        self._halt_every = halt_every or self._looks
        self.memory: Memory = {"look": 0}

    def proceed(self, engine: Engine) -> float:
        """See `Stage.proceed`."""
        look: int = self.memory["look"]
        if look == 0:
            engine.motors.articulate()
        # The last look only takes note of the work since the one before.
        stop = min(look + engine.motors.looks_at_once, (look // self._halt_every + 1) * self._halt_every, self._looks)
        looks = range(look, max(look + 1, stop))
        targets = [self._drive.targets(min((k + 1) * self._interval, self._drive.duration)) for k in looks]
        engine.motors.actuate(np.stack(targets), self._interval)
        self.memory["look"] = looks.stop
        period = max(1, round(self._interval / engine.time_step)) * engine.time_step
        return len(looks) * period if look < self._looks else 0.0
