"""Write the files of a run while time advances, and let the watchdog check the run."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from operator import index
from typing import Any

import meshio
from numpy.typing import NDArray

from dem.arrays import Array
from dem.body.state import LinkageState, PileState
from dem.engine.interface import Engine
from dem.record.forces import force_mesh
from dem.record.frame import centreline_mesh, motor_fields, segment_mesh, sphere_mesh
from dem.record.frames import FrameWriter
from dem.record.progress import ProgressWriter
from dem.record.series import SeriesWriter
from dem.run.sampler import Sampler
from dem.run.watchdog import Watchdog

# Approximate steps between checks of the watchdog. A check takes as long as one or two steps.
WATCH_STEPS = 500


@dataclass
class Recorder:
    """Record a run: take samples at a fixed interval, and write other files at whole multiples of it."""

    sampler: Sampler
    series: SeriesWriter
    frames: FrameWriter
    watchdog: Watchdog  #: Checks the state: at intervals, at every checkpoint and at the end
    points: Callable[[PileState], Array]  #: Returns (N, P, 3) points of a state that must stay inside the container [m]
    progress: ProgressWriter
    interval: float  #: Time between samples [s]
    frame_every: int  #: Samples between frames; a further frame is at the end of each phase
    watch_every: int | None = None  #: Samples between checks of the watchdog; None: about `WATCH_STEPS` steps
    forces: FrameWriter | None = None  #: Writes the forces at contacts, with each frame
    spheres: FrameWriter | None = None  #: Writes the spheres
    sphere_every: int = 1  #: Samples between files of spheres
    samples: int = 0  #: Number of samples so far
    residual: str | None = None  #: Warning about the energy ledger at the last sample, printed at the end of the run
    deepest: tuple[float, float] = (0.0, 0.0)  #: Deepest overlap at a check so far [m], and the time of that check [s]
    next_step: int = 0  #: Number of the step of the next sample

    def record(self, engine: Engine, phase: int) -> None:
        """Take a sample at the present step, and write frames and check the state if they are due."""
        state = engine.state()
        row = self.sampler.sample(engine, state, phase)
        self.series.add(row)
        if engine.count and self.samples % self.frame_every == 0:
            self._write_frame(engine, state, phase)
        if self.spheres is not None and engine.count and self.samples % self.sphere_every == 0:
            self.spheres.write(sphere_mesh(state, engine.particle), engine.time)
        # After the frame is written: the last frame of a run that fails is worth having.
        if self.samples % (self.watch_every or max(1, round(WATCH_STEPS * engine.time_step / self.interval))) == 0:
            self.watch(engine, state)
        if "energy_residual_J" in row and not math.isnan(row["energy_residual_J"]):
            self.residual = self.watchdog.check_residual(
                row["energy_residual_J"], dissipated=row["dissipated_energy_J"], time=engine.time
            )
        self.progress.update(time=engine.time, phi=row["packing_fraction"], count=engine.count)
        self.samples += 1
        self.schedule(engine)

    def end_phase(self, engine: Engine, phase: int) -> None:
        """Write the frame at the end of a phase, unless the present instant has one."""
        if engine.count and self.frames.times[-1:] != [engine.time]:
            self._write_frame(engine, engine.state(), phase)

    def _write_frame(self, engine: Engine, state: PileState, phase: int) -> None:
        self.frames.write(_mesh(engine, state, phase), engine.time)
        if self.forces is not None:
            found = engine.contact_forces()
            self.forces.write(force_mesh(found, state.positions, time=engine.time, phase=phase), engine.time)
        self.series.keep_up()

    def schedule(self, engine: Engine) -> None:
        """Set `next_step` to the step nearest to the next sample's time; called after each change of dt."""
        self.next_step = engine.steps + max(1, round((self.samples * self.interval - engine.time) / engine.time_step))

    def watch(self, engine: Engine, state: PileState | None = None) -> None:
        """Check state (None: it is queried), overlaps and energy by the watchdog; RunError beyond a limit."""
        state, time, watchdog = state or engine.state(), engine.time, self.watchdog
        floor, raised, extremes = engine.boundaries.floor, engine.boundaries.raised, engine.extremes(state)
        if extremes is not None and watchdog.within_limits(extremes, floor=floor, raised=raised):
            elastic, deepest = extremes.elastic_energy, extremes.deepest
        else:
            hinges = engine.motors.gaps() if engine.motors.articulated else None
            gaps = state.gaps if isinstance(state, LinkageState) else hinges
            watchdog.check(state, floor=floor, time=time, points=self.points(state), raised=raised, gaps=gaps)
            overlaps = engine.overlaps(watchdog.depth)
            watchdog.check_depths(overlaps, time=time)
            elastic, deepest = overlaps.elastic_energy, overlaps.deepest
        self.deepest = max(self.deepest, (deepest, time))
        given = engine.ledger.given + engine.motors.work
        energy = state.kinetic_energy + state.potential_energy(engine.gravity, 0.0) - given
        watchdog.check_energy(state, energy=energy, elastic=elastic, time=time)

    @property
    def memory(self) -> dict[str, Any]:
        """Plain data of the recorder's present state, for `restore`."""
        times = {name: writer.times for name, writer in self._writers()}
        counts = {"samples": self.samples, "next_step": self.next_step, "deepest": list(self.deepest)}
        return {**counts, **times, "series": dict(self.sampler.memory)}

    def _writers(self) -> list[tuple[str, FrameWriter]]:
        named = (("frames", self.frames), ("forces", self.forces), ("spheres", self.spheres))
        return [(name, writer) for name, writer in named if writer is not None]

    def restore(self, memory: Mapping[str, Any], columns: Mapping[str, NDArray[Any]]) -> None:
        """Restore the state that `memory` returned: remove later frames, and write the series `columns`."""
        self.samples, self.next_step = index(memory["samples"]), index(memory["next_step"])
        deepest, time = memory.get("deepest", self.deepest)
        self.deepest = float(deepest), float(time)
        self.truncate(memory)
        self.sampler.memory = dict(memory["series"])
        self.check_files()
        self.series.restore(columns)
        self.series.write()

    def check_files(self) -> None:
        """Raise RunError if a file of frames, forces or spheres that was written is missing."""
        for _, writer in self._writers():
            writer.check()

    def truncate(self, memory: Mapping[str, Any]) -> None:
        """Remove all frames that `memory` does not list; an empty mapping lists none."""
        for name, writer in self._writers():
            writer.truncate(memory.get(name, []))


def _mesh(engine: Engine, state: PileState, phase: int) -> meshio.Mesh:
    """Return the frame of the present state, in a phase given by its index."""
    contacts, time, floor = engine.neighbours(), engine.time, engine.boundaries.floor
    if state.bodies is not None:
        return segment_mesh(state.bodies, contacts=contacts, time=time, floor=floor, phase=phase)
    smarticles, motors = state.smarticles, engine.motors.readings if engine.motors.articulated else None
    at_work = () if motors is None else (motors.torques, motors.work, motors.halted)
    return centreline_mesh(
        smarticles.vertices,
        velocities=smarticles.link_velocities,
        spins=smarticles.link_spins,
        contacts=contacts,
        time=time,
        floor=floor,
        phase=phase,
        extra=motor_fields(smarticles.angles, *at_work) if engine.motors.present else None,
    )
