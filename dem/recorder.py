"""Everything a run writes while time passes: series, frames, progress; and the watchdog that sees the same state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from dem.engine import Engine
from dem.frames import FrameWriter, frame_mesh, sphere_mesh
from dem.progress import Progress
from dem.series import SeriesWriter
from dem.state import State
from dem.watchdog import Watchdog


@dataclass
class Recorder:
    """Records at fixed intervals, counted in steps.

    Args:
        series: writes the series.
        frames: writes the frames.
        watchdog: looks at the state now and then, at every checkpoint and at the end.
        progress: told at every sample.
        series_steps: steps between samples.
        frame_steps: steps between frames; a whole multiple of `series_steps`.
        watch_steps: steps between the watchdog's looks; a whole multiple of `series_steps`.
        spheres: writes the spheres as points; None: nobody does.
        sphere_steps: steps between these; a whole multiple of `series_steps`.
    """

    series: SeriesWriter
    frames: FrameWriter
    watchdog: Watchdog
    progress: Progress
    series_steps: int
    frame_steps: int
    watch_steps: int
    spheres: FrameWriter | None = None
    sphere_steps: int = 0
    next_step: int = 0

    def record(self, engine: Engine, phase: int) -> None:
        """Take what is due at this step; the state is read once for all.

        Raises:
            RunError: the watchdog stopped the run, or a file cannot be written.
        """
        state = engine.state()
        phi = self.series.sample(engine, state, phase)
        if engine.count and engine.steps % self.frame_steps == 0:
            mesh = frame_mesh(
                state,
                contacts=engine.contacts(),
                time=engine.time,
                floor=engine.floor,
                phase=phase,
                hinged=engine.hinged,
                motors=engine.motors if engine.articulated else None,
            )
            self.frames.write(mesh, engine.time)
            self.series.write()
        if self.spheres is not None and engine.count and engine.steps % self.sphere_steps == 0:
            self.spheres.write(sphere_mesh(state, engine.particle), engine.time)
        # After the frame is written: the last picture of a run that fails is worth having.
        if engine.steps % self.watch_steps == 0:
            self.watch(engine, state)
        self.progress.update(time=engine.time, phi=phi, count=engine.count)
        self.next_step = engine.steps + self.series_steps

    def watch(self, engine: Engine, state: State | None = None) -> None:
        """Let the watchdog look at everything.

        Raises:
            RunError: it stopped the run.
        """
        state, time, watchdog = state or engine.state(), engine.time, self.watchdog
        watchdog.check(
            state,
            floor=engine.floor,
            time=time,
            spheres=state.spheres(engine.particle),
            raised=engine.fixtures.raised,
            gaps=engine.joint_gaps() if engine.articulated else None,
        )
        strain = engine.strain(watchdog.depth)
        watchdog.check_depths(strain, time=time)
        given = engine.account.given + engine.motor_work
        energy = state.kinetic_energy + state.potential_energy(engine.gravity, 0.0) - given
        watchdog.check_energy(state, energy=energy, elastic=strain.elastic_energy, time=time)

    @property
    def memory(self) -> dict[str, Any]:
        """Plain data that `restore` needs besides the columns of the series."""
        spheres = {} if self.spheres is None else {"spheres": self.spheres.times}
        return {"next_step": self.next_step, "frames": self.frames.times, **spheres, "series": self.series.memory}

    def restore(self, memory: Mapping[str, Any], columns: Mapping[str, NDArray[Any]]) -> None:
        """Go on from where `memory` was taken; frames written since are removed, the series is cut back."""
        self.next_step = memory["next_step"]
        self.truncate(memory)
        self.series.restore(memory["series"], columns)
        self.series.write()

    def truncate(self, memory: Mapping[str, Any]) -> None:
        """Keep the frames of `memory` only; of an empty one none."""
        self.frames.truncate(memory.get("frames", []))
        if self.spheres is not None:
            self.spheres.truncate(memory.get("spheres", []))
