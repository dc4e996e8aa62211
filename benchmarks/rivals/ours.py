"""The engines links and YADE, through the interface that runs use."""

import numpy as np

from benchmarks.rivals.task import ACTIVITY, REST, Array, Knobs, Outcome, Task, World, simulated
from dem.engine.kinds import engine_kind
from dem.phases.phase import Stage
from dem.plan.steps import time_steps


def simulate(task: Task, knobs: Knobs) -> Outcome:
    """Simulate a task; `knobs` are empty, since the scene has all parameters."""
    return simulated(task, OnEngine(task))


class OnEngine(World):
    """Simulation on the engine of the scene, after the pile has been taken over."""

    def __init__(self, task: Task) -> None:
        self._steps = time_steps(task.scene)
        kind = engine_kind(task.scene.engine)
        self.engine = kind.build(task.scene, self._steps[ACTIVITY])
        super().__init__(task, self.engine.time_step, f"{task.scene.engine} {kind.version()}")
        self._due = 0
        self._stage: Stage
        self._enter(0)
        while wait := self._stage.proceed(self.engine):
            self.engine.advance(max(1, round(wait / self.engine.time_step)))
        self._enter(REST)

    def begin(self) -> None:
        self._enter(ACTIVITY)

    def _enter(self, index: int) -> None:
        """Begin the phase of the scene that has the given index, and use the time step of this phase."""
        self._stage = self.task.scene.phases[index].begin(self.task.scene, index)
        self.engine.set_time_step(self._steps[index])
        self.time_step = self.engine.time_step
        self._due = self.engine.steps

    def advance(self, seconds: float) -> None:
        """Advance by a time [s]; the phase acts on the engine whenever its next update is due."""
        until = self.engine.steps + round(seconds / self.time_step)
        while self.engine.steps < until:
            if self.engine.steps >= self._due:
                wait = self._stage.proceed(self.engine)
                self._due = self.engine.steps + max(1, round(wait / self.time_step)) if wait else until
            self.engine.advance(min(until, self._due) - self.engine.steps)

    def links(self) -> tuple[Array, Array]:
        state = self.engine.state().smarticles
        return state.link_positions - np.array([0.0, 0.0, self.engine.boundaries.floor]), state.link_rotations
