"""Runs that are asked to stop at a time, to be resumed, and the comparison of their frames with those of whole runs."""

import os
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dem.record.run import Run
from dem.run.build import Builders, build_engine
from dem.run.run import run_scene
from dem.run.stop import StopRequestedError
from dem.scene.scene import Scene


class Interrupted:
    """An engine that asks the run to stop once a time [s] has passed."""

    def __init__(self, engine: Any, when: float) -> None:
        self._engine, self._when = engine, when

    def __getattr__(self, name: str) -> Any:
        return getattr(self._engine, name)

    def advance(self, steps: int) -> None:
        self._engine.advance(steps)
        if self._engine.time > self._when:
            os.kill(os.getpid(), signal.SIGUSR1)


def run_until(scene: Scene, out: Path, when: float) -> None:
    """Run a scene until its first checkpoint after a time [s], at which the run must stop."""
    builders = Builders(engine=lambda scene, dt: Interrupted(build_engine(scene, dt), when))  # type: ignore[arg-type, return-value]
    with pytest.raises(StopRequestedError):
        run_scene(scene, out, command="", builders=builders)


def assert_goes_on(scene: Scene, whole: Run, out: Path, when: float) -> None:
    """Stop a run of a scene at a time [s], resume it, and compare frames and series with a whole run, bit by bit."""
    run_until(scene, out, when)
    run_scene(scene, out, command="", resume=True)
    assert_equal_frames(whole, Run(out))
    for name, values in Run(out).series.items():
        np.testing.assert_array_equal(values, whole.series[name], err_msg=name)


def assert_equal_frames(one: Run, other: Run) -> None:
    """Compare places, velocities and kinds in all frames of two runs, more than four each, bit by bit."""
    assert len(one.frames) == len(other.frames) > 4
    for there, here in zip(one.frames, other.frames, strict=True):
        np.testing.assert_array_equal(there.segments, here.segments)
        np.testing.assert_array_equal(there.link_velocity, here.link_velocity)
        np.testing.assert_array_equal(there.kind, here.kind)
