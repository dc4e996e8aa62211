"""A run directory as an object, the argument of measures, studies, exports, reports and commands."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, NoReturn

import yaml

from dem.errors import InputError, shown
from dem.notebook import Facts, Shown, bodies_text
from dem.record.checkpoint import has_checkpoint
from dem.record.document import REMEDY, Done, Failed, Manifest, Phase, Progress
from dem.record.files import cannot_read
from dem.record.forces import RecordedForces, has_forces, read_forces
from dem.record.frames import FrameSequence, read_frames
from dem.record.names import (
    DONE,
    FAILED,
    FRAME,
    MANIFEST,
    OF_SWEEP,
    PROGRESS,
    SCENE,
    SERIES,
    VTKHDF,
    collection,
)
from dem.record.rundir import in_use
from dem.record.series import Series, read_series
from dem.yaml_text import load_yaml, read_text

State = Literal["done", "running", "queued", "failed", "interrupted", "stopped", "missing"]
"""`interrupted` closed its files when asked to stop; `stopped` was killed; `queued` waits for a job of a cluster."""

_PARTS = ("smarticle", "container", "plane", "hooks", "contact", "motor", "fidelity", "recording")


@dataclass(frozen=True, kw_only=True)
class Status:
    """State and progress of a run; fields that its files do not hold are None."""

    state: State
    cause: str | None = None  #: Cause of failure or interruption
    phase: str | None = None  #: Type of the current phase
    time_s: float | None = None  #: Simulated time [s]
    steps: int | None = None  #: Number of time steps of a done run
    wall_s: float | None = None  #: Wall time of the run so far [s]
    cpu_s: float | None = None  #: Processor time of a done run [s]
    checkpoint_s: float | None = None  #: Simulated time of the checkpoint from which the run can be resumed [s]


@dataclass(frozen=True)
class Run(Shown):
    """A run directory, of a finished or unfinished run; each part is read once, at the first access.

    Access to a part raises InputError if its file is missing, damaged or of another format.
    """

    path: Path

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", Path(self.path))

    def __str__(self) -> str:
        return str(self.path)

    def _facts(self) -> Facts:
        made, status = self.manifest, self.status
        yield "run", made.name
        yield "directory", str(self.path)
        state: str = status.state
        if status.time_s is not None:
            state += f", {status.time_s:.4g} s simulated"
        if status.wall_s is not None:
            state += f" in {status.wall_s:.3g} s"
        yield "state", state if status.cause is None else f"{state}: {status.cause}"
        numbers: dict[str, int] = {}
        for kind in made.kinds or ():
            numbers[kind.shape] = numbers.get(kind.shape, 0) + kind.bodies
        yield "bodies", bodies_text(made.count, numbers, made.aspect_ratio)
        yield "engine", f"{made.engine}, {made.fidelity}, seed {made.seed}"
        yield "phases", ", ".join(_timed(phase) for phase in self.phases)
        frames = "none yet"
        if self.has_frames:
            times = self.frames.times
            frames = f"{len(times)}, {times[0]:.4g} s to {times[-1]:.4g} s"
        yield "frames", frames
        if self.has_series:
            yield "series", ", ".join(self.series)

    @cached_property
    def manifest(self) -> Manifest:
        """The manifest, `run.json`: how the run was made, and numbers of its scene."""
        if not (self.path / MANIFEST).is_file():
            _reject_place(self.path)
        return Manifest.read(self.path / MANIFEST)

    @cached_property
    def scene(self) -> SceneData:
        """The resolved scene, `scene.yaml`, as a mapping in which all defaults are filled in."""
        path = self.path / SCENE
        try:
            content = load_yaml(read_text(path), yaml.CSafeLoader)
        except (OSError, ValueError, yaml.YAMLError) as error:
            cannot_read("scene", path, error, REMEDY)
        if not isinstance(content, dict):
            cannot_read("scene", path, "it must be a mapping", REMEDY)
        # A file that was cut may have half a word where a part was.
        phases = content.get("phases") or []
        parts = [content.get(key) or {} for key in _PARTS] + (phases if isinstance(phases, list) else [phases])
        for part in parts:
            if not isinstance(part, dict):
                cannot_read("scene", path, f"{shown(part)} stands where a mapping must be", REMEDY)
        return SceneData(path, "", content)

    @cached_property
    def phases(self) -> tuple[Phase, ...]:
        """The phases in order; if the run is done, with their times and cost."""
        planned = self.manifest.phases
        if not (self.path / DONE).exists():
            return planned
        done = Done.read(self.path / DONE).phases
        if [(phase.index, phase.type) for phase in done] != [(phase.index, phase.type) for phase in planned]:
            cause = f"its phases differ from those of run.json: {[phase.type for phase in done]}"
            cannot_read("manifest", self.path / DONE, cause, REMEDY)
        steps = [phase.time_step_s for phase in planned]
        return tuple(phase.model_copy(update={"time_step_s": step}) for phase, step in zip(done, steps, strict=True))

    @cached_property
    def frames(self) -> FrameSequence:
        """The recorded frames in time order, each read when it is asked for."""
        return read_frames(self.path)

    def at_intervals(self, part: FrameSequence) -> FrameSequence:
        """Return a phase's frames at `recording.frame_interval_s`, for means over time.

        The frame at the end of the phase is left out if it follows at another interval, unless it is the only one.
        """
        step = self.manifest.phases[part[-1].phase].time_step_s if len(part) > 1 else None
        if step is None:  # runs without it are older than frames at the ends of phases
            return part
        try:
            recording = self.scene["recording"]
            sample, interval = (float(recording[f"{name}_interval_s"]) for name in ("series", "frame"))
        except InputError:  # frames can be measured without the scene file
            return part
        interval, last = sample * max(1, round(interval / sample)), float(part.times[-1])
        # A frame at an interval is on the step nearest to its time; times in the list are rounded to nine digits.
        near = abs(last - interval * round(last / interval)) <= 0.5001 * step + 1e-8 * last
        return part if near else part[:-1]

    @property
    def has_frames(self) -> bool:
        """Whether the run has written a frame."""
        return any((self.path / name).is_file() for name in (collection(FRAME), VTKHDF))

    @property
    def has_series(self) -> bool:
        """Whether the run has recorded time series; a run that failed early has none."""
        return (self.path / SERIES).exists()

    @cached_property
    def series(self) -> Series:
        """The recorded time series as arrays."""
        return read_series(self.path)

    @cached_property
    def forces(self) -> ForceSequence | None:
        """The forces at contacts, one item per frame; None where the scene does not record them."""
        return ForceSequence(self.frames) if has_forces(self.path) else None

    @property
    def status(self) -> Status:
        """The present state and progress of the run."""
        if not self.path.is_dir() or not any(self.path.iterdir()):
            return Status(state="missing")
        # A resumed run may have left an older failed.json behind.
        if (self.path / DONE).exists():
            done = Done.read(self.path / DONE)
            return Status(state="done", time_s=done.time_s, steps=done.steps, wall_s=done.wall_s, cpu_s=done.cpu_s)
        progress = self.progress
        known = progress.model_dump(include={"phase", "time_s", "wall_s", "checkpoint_s"})
        status = Status(state="running", **known)
        if not (self.path / FAILED).exists():
            return status if in_use(self.path) else replace(status, state="stopped")
        failed = Failed.read(self.path / FAILED)
        return replace(
            status, state=failed.status, cause=failed.cause, time_s=failed.time_s, checkpoint_s=failed.checkpoint_s
        )

    @property
    def progress(self) -> Progress:
        """Progress of a running run; all fields are None for other runs."""
        try:
            return Progress.read(self.path / PROGRESS)
        except InputError:
            return Progress()  # none yet, or the run has just ended

    @property
    def can_resume(self) -> bool:
        """Whether the run was interrupted or killed, and left a checkpoint."""
        return self.status.state in ("interrupted", "stopped") and has_checkpoint(self.path)

    @property
    def lost_series(self) -> str | None:
        """Warning if the series of a done run is missing; None otherwise."""
        if self.has_series or not (self.path / DONE).exists():
            return None
        return (
            f"{self.path / SERIES}: is gone, although the run is done, so that all that was recorded in it is missing "
            f"from tables; put it back, or run {self.path / SCENE} anew elsewhere"
        )


def _timed(phase: Phase) -> str:
    """Return the type of a phase, and when it ended."""
    return phase.type if phase.end_s is None else f"{phase.type} until {phase.end_s:.4g} s"


class SceneData(dict[str, Any]):
    """A mapping in `scene.yaml`; access to a missing key raises an `InputError` that names the file."""

    def __init__(self, path: Path, place: str, values: dict[str, Any]) -> None:
        super().__init__({key: _within(path, f"{place}{key}.", value) for key, value in values.items()})
        self._path, self._place = path, place

    def __missing__(self, key: str) -> Any:
        cannot_read("scene", self._path, f"{self._place}{key} is missing", REMEDY)


def _within(path: Path, place: str, value: Any) -> Any:
    if isinstance(value, dict):
        return SceneData(path, place, value)
    if isinstance(value, list):
        return [_within(path, f"{place}{index}.", item) for index, item in enumerate(value)]
    return value


@dataclass(frozen=True)
class ForceSequence:
    """The forces at contacts of a run, one item for each frame; each access reads a file."""

    frames: FrameSequence

    def __len__(self) -> int:
        return len(self.frames)

    def __getitem__(self, index: int) -> RecordedForces:
        return read_forces(self.frames[index])


def runs_within(path: Path) -> str:
    """Return advice to give a run that a directory holds, one level below; empty if there is none."""
    found = min((file.parent for file in path.glob(f"*/{MANIFEST}")), default=None)
    return f"give a run that it holds, such as {found}" if found else ""


def _reject_place(path: Path) -> NoReturn:
    """Raise InputError about a path that is no run directory; the message states what the path is."""
    remedy = REMEDY
    if not path.exists():
        cause = "no such directory"
    elif not path.is_dir():
        cause = "it is a file"
    elif (path / OF_SWEEP).is_file():
        cause, remedy = "it is a sweep", f"give one of its runs, {path / 'runs' / 'NAME'}"
    else:
        cause, remedy = f"it holds no {MANIFEST}", runs_within(path) or REMEDY
    cannot_read("run directory", path, cause, remedy)


def open_run(path: Path | str) -> Run:
    """Return a run directory as a `Run`, after reading its manifest; raise InputError if it is none."""
    run = Run(Path(path))
    _ = run.manifest
    return run
