"""A run directory as an object: what measures, studies, exports, reports and commands take."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import yaml

from dem.record.document import Document
from dem.record.files import cannot_read
from dem.record.forces import RecordedForces, has_forces, read_forces
from dem.record.frames import FrameSequence, read_frames
from dem.record.manifest import PhaseRecord, RunManifest, read_run
from dem.record.names import CHECKPOINT, DONE, FAILED, PROGRESS, SCENE, SERIES
from dem.record.rundir import in_use
from dem.record.series import Series, read_series

State = Literal["done", "running", "queued", "failed", "interrupted", "stopped", "missing"]
"""`interrupted` closed its files when asked to stop; `stopped` was killed; `queued` waits for a job of a cluster."""

_REMEDY = "give the directory of a run made by `smarticles run`"


@dataclass(frozen=True, kw_only=True)
class Status:
    """How far a run is; None where its files do not say.

    Attributes:
        state: Where it stands.
        cause: Why it failed or was interrupted.
        phase: Type of the phase that it is in.
        time_s: Simulated time [s].
        steps: Time steps of a done run.
        wall_s: Wall time so far [s].
        cpu_s: Processor time of a done run [s].
        checkpoint_s: Simulated time of the checkpoint from which it can go on [s].
    """

    state: State
    cause: str | None = None
    phase: str | None = None
    time_s: float | None = None
    steps: int | None = None
    wall_s: float | None = None
    cpu_s: float | None = None
    checkpoint_s: float | None = None


@dataclass(frozen=True)
class Run:
    """A run directory, finished or not; each part is read when it is first asked for, once.

    Args:
        path: the directory.
    """

    path: Path

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", Path(self.path))

    def __str__(self) -> str:
        return str(self.path)

    @cached_property
    def manifest(self) -> RunManifest:
        """What made the run.

        Raises:
            InputError: The directory or its `run.json` is missing, damaged or of another format.
        """
        return read_run(self.path)

    @cached_property
    def scene(self) -> SceneData:
        """The resolved scene, every default written out, as the version that ran it wrote it.

        Raises:
            InputError: `scene.yaml` is missing or damaged.
        """
        path = self.path / SCENE
        try:
            content = yaml.load(path.read_text(encoding="utf-8"), yaml.CSafeLoader)
        except (OSError, ValueError, yaml.YAMLError) as error:
            cannot_read("scene", path, error, _REMEDY)
        if not isinstance(content, dict):
            cannot_read("scene", path, "it must be a mapping", _REMEDY)
        return SceneData(path, "", content)

    @cached_property
    def phases(self) -> tuple[PhaseRecord, ...]:
        """The phases in order; times where the run is done."""
        return self.manifest.phases

    @cached_property
    def frames(self) -> FrameSequence:
        """The recorded frames in time order, each read when it is asked for.

        Raises:
            InputError: The run has written none yet, or their list is damaged.
        """
        return read_frames(self.path)

    @property
    def has_series(self) -> bool:
        """Whether it has recorded time series; a run that failed early has not."""
        return (self.path / SERIES).exists()

    @cached_property
    def series(self) -> Series:
        """The recorded time series as arrays.

        Raises:
            InputError: There are none yet, or the file is damaged.
        """
        return read_series(self.path)

    @cached_property
    def forces(self) -> ForceSequence | None:
        """The forces at contacts, one item per frame; None where the scene does not record them."""
        return ForceSequence(self.frames) if has_forces(self.path) else None

    @property
    def status(self) -> Status:
        """How far it is at this moment.

        Raises:
            InputError: A file that says so is damaged.
        """
        if not self.path.is_dir() or not any(self.path.iterdir()):
            return Status(state="missing")
        # A resumed run may have left an older failed.json behind.
        if (done := self._data(DONE)) is not None:
            return Status(
                state="done",
                time_s=done.number("time_s"),
                steps=done.integer("steps"),
                wall_s=done.number("wall_s"),
                cpu_s=done.number("cpu_s") if "cpu_s" in done.data else None,
            )
        failed, progress = self._data(FAILED), self._data(PROGRESS)
        said = {} if progress is None else progress.data
        ended = said if failed is None else failed.data
        state: State = "running" if in_use(self.path) else "stopped"
        if failed is not None:
            state = "interrupted" if failed.text("status") == "interrupted" else "failed"
        return Status(
            state=state,
            cause=None if failed is None else failed.text("cause"),
            phase=said.get("phase"),
            time_s=ended.get("time_s"),
            wall_s=said.get("wall_s"),
            checkpoint_s=ended.get("checkpoint_s"),
        )

    @property
    def can_resume(self) -> bool:
        """Whether it was stopped, did not fail, and left a checkpoint to go on from."""
        return self.status.state in ("interrupted", "stopped") and (self.path / CHECKPOINT).is_file()

    def _data(self, name: str) -> Document | None:
        path = self.path / name
        return Document.read(path) if path.exists() else None


class SceneData(dict[str, Any]):
    """A mapping of `scene.yaml`; a missing key is an `InputError` that names the file."""

    def __init__(self, path: Path, place: str, values: dict[str, Any]) -> None:
        super().__init__({key: _within(path, f"{place}{key}.", value) for key, value in values.items()})
        self._path, self._place = path, place

    def __missing__(self, key: str) -> Any:
        cannot_read("scene", self._path, f"{self._place}{key} is missing", _REMEDY)


def _within(path: Path, place: str, value: Any) -> Any:
    if isinstance(value, dict):
        return SceneData(path, place, value)
    if isinstance(value, list):
        return [_within(path, f"{place}{index}.", item) for index, item in enumerate(value)]
    return value


@dataclass(frozen=True)
class ForceSequence:
    """The forces at contacts of a run's frames, each read when it is asked for.

    Args:
        frames: the frames.
    """

    frames: FrameSequence

    def __len__(self) -> int:
        return len(self.frames)

    def __getitem__(self, index: int) -> RecordedForces:
        return read_forces(self.frames[index])


def open_run(path: Path | str) -> Run:
    """Open a run directory and read its manifest, so that what is none is rejected here.

    Raises:
        InputError: It is no run directory.
    """
    run = Run(Path(path))
    _ = run.manifest
    return run
