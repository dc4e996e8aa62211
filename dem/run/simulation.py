"""The loop of a run: phases in order, time steps from one sample to the next, and checkpoints."""

import logging
import shutil
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from operator import index
from pathlib import Path
from typing import Any

from dem.engine.interface import Engine, Saved
from dem.errors import RunError
from dem.phases.phase import Stage
from dem.record.checkpoint import Checkpoint, write_checkpoint
from dem.record.document import Phase
from dem.record.names import CHECKPOINT
from dem.record.rundir import Claim
from dem.run.recorder import Recorder
from dem.run.stop import StopRequest, StopRequestedError
from dem.scene.reading import scene_hash
from dem.scene.scene import Scene
from dem.terminal import warn

SMALLEST_CHECKPOINT = 2**20  # bytes; the container alone makes half of it


@dataclass
class Simulation:
    """A run that is being simulated."""

    scene: Scene
    engine: Engine
    recorder: Recorder
    claim: Claim  #: The run directory, locked
    log: logging.Logger
    made_by: tuple[str, str]  #: Name and version of the engine
    time_steps: Sequence[float]  #: Time step of each phase [s]
    stop: StopRequest = field(default_factory=StopRequest)
    checkpointed: float | None = None  #: Simulated time of the newest checkpoint [s]; None: no checkpoint yet
    _phase: int = 0
    _stage: Stage | None = None
    _target: int = 0
    _performed: list[dict[str, Any]] = field(default_factory=list)
    _spent: float = 0.0
    _began: float = field(default_factory=time.monotonic)
    _cpu_spent: float = 0.0
    _cpu_began: float = field(default_factory=time.process_time)

    @property
    def folder(self) -> Path:
        """The run directory."""
        return self.claim.out

    def run(self) -> tuple[Phase, ...]:
        """Run from the present state to the end of the last phase; return the phases with their times."""
        with self.stop.listening():
            if self.stop.came:
                raise StopRequestedError(f"stopped as requested before it went on from t = {self.engine.time:.4f} s")
            if not self.engine.steps:
                self.recorder.record(self.engine, 0)
            while self._phase < len(self.scene.phases):
                self._run_phase()
        if self.checkpointed != self.engine.time:
            # At a checkpoint the state was checked; after it contacts are unknown until the next step.
            self.recorder.watch(self.engine)
        self.recorder.series.write()
        self._check_files()
        recorder = self.recorder
        for warning in (recorder.residual, recorder.watchdog.warn_of_depth(*recorder.deepest)):
            if warning:
                self.warn(warning)
        return tuple(Phase(**entry) for entry in self._performed)

    def _run_phase(self) -> None:
        phase = self.scene.phases[self._phase]
        if self._stage is None:
            self._stage = phase.begin(self.scene, self._phase)
            if self.engine.time_step != self.time_steps[self._phase]:
                self.engine.set_time_step(self.time_steps[self._phase])
                self.recorder.schedule(self.engine)
            begun = {"index": self._phase, "type": phase.type, "at_rest": phase.at_rest, "start_s": self.engine.time}
            self._performed.append({**begun, "wall_s": -self.wall, "cpu_s": -self.cpu})
            self.log.info("phase %d %s begins at t = %.4f s", self._phase, phase.type, self.engine.time)
        entry = self._performed[-1]
        duration = phase.known_duration
        self.recorder.progress.begin(
            phase=phase.type,
            index=self._phase,
            start=entry["start_s"],
            end=entry["start_s"] + duration if duration else None,
        )
        self._advance()
        while wait := self._stage.proceed(self.engine):
            self._target = self.engine.steps + max(1, round(wait / self.engine.time_step))
            self._advance()
        self.recorder.end_phase(self.engine, self._phase)
        entry["end_s"] = self.engine.time
        entry["wall_s"] += self.wall
        entry["cpu_s"] += self.cpu
        text = "phase %d %s ended at t = %.4f s after %.1f s of wall time"
        self.log.info(text, self._phase, phase.type, self.engine.time, entry["wall_s"])
        if warning := self._stage.memory.get("warning"):
            self.warn(f"phases.{self._phase} ({phase.type}): {warning}")
        self._stage = None
        self._phase += 1

    def warn(self, message: str) -> None:
        """Write a warning into the log and to the terminal."""
        self.log.warning("%s", message)
        warn(message)

    def _advance(self) -> None:
        engine, recorder, recording = self.engine, self.recorder, self.scene.recording
        while engine.steps < self._target:
            engine.advance(min(self._target, recorder.next_step) - engine.steps)
            if engine.steps == recorder.next_step:
                every = recording.samples_in(recording.checkpoint_interval_s)
                due = every and recorder.samples % every == 0
                recorder.record(engine, self._phase)
                if due:
                    self._checkpoint()

    def _checkpoint(self) -> None:
        # Only a state without errors becomes a checkpoint.
        self.recorder.watch(self.engine)
        self._check_files()
        self._check_space()
        saved = self.engine.save(self.folder)
        assert self._stage is not None  # a checkpoint is taken while a phase runs
        checkpoint = Checkpoint(
            scene_sha256=scene_hash(self.scene),
            made_by=self.made_by,
            state={
                "engine": saved.memory,
                "recorder": self.recorder.memory,
                "phase": self._phase,
                "stage": self._stage.memory,
                "target": self._target,
                "performed": self._performed,
                "wall_s": self.wall,
                "cpu_s": self.cpu,
            },
            series=self.recorder.series.columns,
            engine=saved.content,
        )
        write_checkpoint(self.folder, checkpoint)
        self._note_checkpoint()
        if self.stop.came:
            raise StopRequestedError(f"stopped as requested at the checkpoint of t = {self.engine.time:.4f} s")

    def _note_checkpoint(self) -> None:
        self.checkpointed = self.engine.time
        self.recorder.progress.checkpointed(self.engine.time)

    def _check_files(self) -> None:
        self.claim.check()
        self.recorder.check_files()

    def _check_space(self) -> None:
        # An engine may not notice a full disk when it saves, and would then load a truncated file.
        newest = self.folder / CHECKPOINT
        needed = 4 * (newest.stat().st_size if newest.exists() else SMALLEST_CHECKPOINT)
        free = shutil.disk_usage(self.folder).free
        if free < needed:
            raise RunError(
                f"{self.folder}: {free / 2**20:.1f} MiB free, a checkpoint needs {needed / 2**20:.1f} MiB; "
                "free space and go on with --resume"
            )

    def restore(self, checkpoint: Checkpoint) -> None:
        """Restore the state of a checkpoint, from which `run` continues."""
        state: Mapping[str, Any] = checkpoint.state
        self.engine.load(Saved(content=checkpoint.engine, memory=state["engine"]), self.folder)
        self._note_checkpoint()
        self.recorder.restore(state["recorder"], checkpoint.series)
        self._phase, self._target = index(state["phase"]), index(state["target"])
        self.engine.set_time_step(self.time_steps[self._phase])
        self._stage = self.scene.phases[self._phase].begin(self.scene, self._phase)
        self._stage.memory = dict(state["stage"])
        self._performed = [dict(entry) for entry in state["performed"]]
        if len(self._performed) != self._phase + 1:
            raise ValueError(f"{len(self._performed)} phases performed in phase {self._phase}")
        for entry in self._performed:  # a wrong type would fail only when the phase ends; times begin below 0
            times = {name: abs(entry[name]) for name in ("start_s", "wall_s", "cpu_s")}
            Phase(**{**entry, **times})
        self._spent, self._began = float(state["wall_s"]), time.monotonic()
        self._cpu_spent, self._cpu_began = float(state["cpu_s"]), time.process_time()

    @property
    def wall(self) -> float:
        """Wall time spent on the run [s], including earlier processes."""
        return self._spent + time.monotonic() - self._began

    @property
    def cpu(self) -> float:
        """Processor time spent on the run [s], including earlier processes and local processes of the engine."""
        return self._cpu_spent + time.process_time() - self._cpu_began + self.engine.cpu_elsewhere
