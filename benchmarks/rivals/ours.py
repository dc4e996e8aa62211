"""Our own engines, links and YADE, step by step through the interface that a run uses."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from benchmarks.rivals.given import ACTIVITY, REST, Array, Given, Knobs, Outcome, simulated
from dem.engine.interface import Engine
from dem.engine.kinds import engine_kind
from dem.phases.phase import Stage
from dem.plan.steps import time_steps
from dem.scene.scene import Scene

RESIDUAL = "energy residual [% of dissipated]"


def simulate(given: Given, knobs: Knobs) -> Outcome:
    """Simulate; knobs are those of the scene already."""
    simulation = OnEngine(given.scene)
    keep = partial(residual, simulation.engine) if given.scene.recording.dissipation_interval_s else None
    return simulated(given, simulation, keep)


def residual(engine: Engine) -> Mapping[str, float]:
    """What the energy ledger misses, over all that was dissipated; adds as `dem.run.sampler` does."""
    state, account = engine.state(), engine.ledger
    gravity = state.kinetic_energy + state.potential_energy(engine.gravity, 0.0)
    given = account.added + account.container_work + engine.motors.work
    return {RESIDUAL: 100 * (given - gravity - sum(account.elastic()) - account.dissipated) / account.dissipated}


class OnEngine:
    """A scene on the engine that it names; the pile that is taken over has settled."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._steps = time_steps(scene)
        kind = engine_kind(scene.engine)
        self.engine = kind.build(scene, self._steps[ACTIVITY])
        self.version = f"{scene.engine} {kind.version()}"
        self._due = 0
        self._stage: Stage
        self._enter(0)
        while wait := self._stage.proceed(self.engine):
            self.engine.advance(max(1, round(wait / self.engine.time_step)))
        self._enter(REST)

    @property
    def time_step(self) -> float:
        """See `Stepped`."""
        return self.engine.time_step

    def begin(self) -> None:
        """See `Stepped.begin`."""
        self._enter(ACTIVITY)

    def _enter(self, index: int) -> None:
        self._stage = self._scene.phases[index].begin(self._scene, index)
        self.engine.set_time_step(self._steps[index])
        self._due = self.engine.steps

    def advance(self, seconds: float) -> None:
        """See `Stepped.advance`."""
        until = self.engine.steps + round(seconds / self.engine.time_step)
        while self.engine.steps < until:
            if self.engine.steps >= self._due:
                wait = self._stage.proceed(self.engine)
                if not wait:
                    self._due = until
                else:
                    self._due = self.engine.steps + max(1, round(wait / self.engine.time_step))
            self.engine.advance(min(until, self._due) - self.engine.steps)

    def links(self) -> tuple[Array, Array]:
        """See `Stepped.links`."""
        state = self.engine.state()
        return state.link_positions - np.array([0.0, 0.0, self.engine.boundaries.floor]), state.link_rotations
