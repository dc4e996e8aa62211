"""The directory of a sweep: what belongs to it, what is done, what is missing.

DIR/sweep.json          manifest: files it was made of, points with scene hashes, versions
DIR/scenes/NAME.yaml    the resolved scene of each run
DIR/runs/NAME/          the run directories
DIR/logs/NAME.txt       what the run's process said
DIR/jobs/               what was given to a queue, see `templates.slurm.submission`
"""

from __future__ import annotations

import fcntl
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, ClassVar, Literal

from dem.errors import InputError
from dem.record.document import Document
from dem.record.files import write_text
from dem.record.names import MANIFEST as RUN
from dem.record.names import OF_SWEEP
from dem.record.run import Run, Status
from dem.scene.reading import dump_scene
from dem.scene.scene import Scene
from templates.sweep.expand import Point
from templates.sweep.sweep_file import SEED, Sweep

MANIFEST = OF_SWEEP


@dataclass(frozen=True, kw_only=True)
class RunStatus(Status):
    """How far one run of a sweep is.

    Args:
        name: name of the run.
        directory: its run directory.
        job: number of the queue's task that computes it, or did last, or None.
    """

    name: str
    directory: Path
    job: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        keys = ("name", "directory", "state", "cause", "phase", "time_s", "wall_s", "job", "checkpoint_s")
        return {key: getattr(self, key) for key in keys} | {"directory": str(self.directory)}


def run_status(directory: Path) -> RunStatus:
    """State of one run directory, from its files alone; it may be absent."""
    return RunStatus(name=directory.name, directory=directory, **vars(Run(directory).status))


class Entry(Document):
    """One run of a sweep.

    Attributes:
        name: Name of the run, its scene and its directory.
        expected_s: Expected wall time; only its proportion to the others' matters.
        values: The sweep's variables.
        again: Whether it is another run once more, with other constants.
    """

    name: str
    scene_sha256: str
    expected_s: float
    values: Mapping[str, Any]
    again: bool = False


class SweepManifest(Document):
    """What made a sweep, `sweep.json`; `files` are the texts of the files that it was made of, by name."""

    remedy: ClassVar[str] = "write the sweep to a new directory"
    format: Literal[1] = 1
    name: str
    command: str
    created: str = ""
    versions: Mapping[str, str] = {}
    files: Mapping[str, str] = {}
    seed_by_seed: bool = False
    points: tuple[Entry, ...]


@dataclass(frozen=True)
class Folder:
    """A sweep's directory.

    Args:
        path: the directory.
        manifest: its `sweep.json`.
    """

    path: Path
    manifest: SweepManifest

    @property
    def name(self) -> str:
        """The sweep's name."""
        return self.manifest.name

    @property
    def entries(self) -> tuple[Entry, ...]:
        """Its runs."""
        return self.manifest.points

    def only(self, entries: Sequence[Entry]) -> Folder:
        """This directory with some of its runs alone."""
        return Folder(self.path, self.manifest.model_copy(update={"points": tuple(entries)}))

    def in_order_of_start(self, entries: Sequence[Entry]) -> list[Entry]:
        """Runs in the order in which to start them: the longest first, seed by seed where the sweep says so.

        Those that come once more, such as on a slower engine, come after all others.
        """
        seeds = list(dict.fromkeys(entry.values.get(SEED) for entry in self.entries))
        ranks = {seed: rank for rank, seed in enumerate(seeds) if self.manifest.seed_by_seed}
        return sorted(entries, key=lambda entry: (entry.again, ranks.get(entry.values.get(SEED), 0), -entry.expected_s))

    def scene(self, entry: Entry) -> Path:
        """Scene file of a run."""
        return self.path / "scenes" / f"{entry.name}.yaml"

    def run(self, entry: Entry) -> Path:
        """Run directory of a run."""
        return self.path / "runs" / entry.name

    def log(self, entry: Entry) -> Path:
        """What the run's process said."""
        return self.path / "logs" / f"{entry.name}.txt"

    def is_done(self, entry: Entry) -> bool:
        """Whether the run finished, and with the scene that the manifest lists."""
        return Run(self.run(entry)).status.state == "done" and self._is_of_scene(entry)

    def can_resume(self, entry: Entry) -> bool:
        """Whether the run was stopped, did not fail, and left a checkpoint to go on from."""
        return Run(self.run(entry)).can_resume and self._is_of_scene(entry)

    def _is_of_scene(self, entry: Entry) -> bool:
        try:
            return Run(self.run(entry)).manifest.scene_sha256 == entry.scene_sha256
        except InputError:
            return False

    def status(self) -> list[RunStatus]:
        """State of every run."""
        return [run_status(self.run(entry)) for entry in self.entries]

    def set_aside(self, entry: Entry) -> Path | None:
        """Rename what an unfinished run left, so that the run can start anew; nothing is deleted.

        Returns:
            Where it went, or None if there was nothing.
        """
        directory = self.run(entry)
        if not directory.is_dir() or not any(directory.iterdir()):
            return None
        number = 1
        while (aside := directory.with_name(f"{entry.name}.stopped-{number}")).exists():
            number += 1
        return directory.rename(aside)

    @contextmanager
    def lock(self) -> Iterator[int]:
        """Hold the sweep for one runner; yields the descriptor that its runs inherit.

        The lock lives as long as any process holds the descriptor: also after the runner was
        killed and left runs behind, which still write.

        Raises:
            InputError: another process holds it.
        """
        with (self.path / ".lock").open("a") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                msg = (
                    f"{self.path}: runs of this sweep are being computed already; wait for them "
                    f"(smarticles status {self.path}) or stop that process"
                )
                raise InputError(msg) from error
            yield file.fileno()


def create_folder(
    path: Path,
    sweep: Sweep,
    points: Sequence[Point],
    *,
    command: str,
    versions: Mapping[str, str],
    expected_s: Callable[[Scene], float],
    extend: bool = False,
) -> Folder:
    """Make a sweep's directory, or take up the one that holds the same sweep.

    Args:
        path: the directory; absent, empty, or made by the same sweep.
        sweep: the sweep.
        points: its points.
        command: the command line, for the manifest.
        versions: versions of what made it, for the manifest.
        expected_s: expected wall time [s] of a scene.
        extend: whether a directory that holds some of these runs, and no others, takes up the rest.

    Raises:
        InputError: the directory holds something else, or is to be extended while its runs are being computed.
    """
    if path.exists() and not path.is_dir():
        msg = f"{path}: is a file; give a directory that is new or holds this sweep"
        raise InputError(msg)
    # By the names that they have seen from the sweep file, wherever that lies on this machine.
    files = {sweep.path.name: sweep.text, sweep.content.template: sweep.template_text}
    if sweep.content.points.table is not None and sweep.table_text is not None:
        files[sweep.content.points.table.file] = sweep.table_text
    manifest = SweepManifest(
        name=sweep.content.name,
        command=command,
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        versions=versions,
        files=files,
        seed_by_seed=sweep.content.repeats is not None and sweep.content.repeats.seed_by_seed,
        points=tuple(
            Entry(
                name=point.name,
                scene_sha256=point.scene_sha256,
                expected_s=round(expected_s(point.scene), 1),
                values=dict(point.values),
                again=point.again,
            )
            for point in points
        ),
    )
    if (path / MANIFEST).exists():
        folder = open_folder(path)
        if extend and _is_part(folder, points):
            with folder.lock():
                manifest.write(path / MANIFEST)
            folder = open_folder(path)
        _refuse_other_sweep(folder, sweep, points)
    else:
        if path.is_dir() and any(path.iterdir()):
            msg = f"{path}: holds other files; give a directory that is new or holds this sweep"
            raise InputError(msg)
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            msg = f"--out {path}: cannot be made ({error.strerror}); choose another directory"
            raise InputError(msg) from error
        manifest.write(path / MANIFEST)
        folder = open_folder(path)
    (path / "scenes").mkdir(exist_ok=True)
    for point in points:
        file = folder.path / "scenes" / f"{point.name}.yaml"
        if not file.exists():
            write_text(file, dump_scene(point.scene, file.parent))
    return folder


def _is_part(folder: Folder, points: Sequence[Point]) -> bool:
    """Whether the directory holds some of the runs wanted, and no others."""
    wanted = {(point.name, point.scene_sha256) for point in points}
    return {(entry.name, entry.scene_sha256) for entry in folder.entries} < wanted


def _refuse_other_sweep(folder: Folder, sweep: Sweep, points: Sequence[Point]) -> None:
    present = {entry.name: entry.scene_sha256 for entry in folder.entries}
    wanted = {point.name: point.scene_sha256 for point in points}
    if present == wanted:
        return
    parts = [
        _some("only in the file: ", [name for name in wanted if name not in present]),
        _some("only in the directory: ", [name for name in present if name not in wanted]),
        _some("of another scene: ", [name for name in wanted if present.get(name, wanted[name]) != wanted[name]]),
    ]
    msg = (
        f"{folder.path}: holds another sweep ({folder.name!r}): runs {'; '.join(filter(None, parts))}; "
        f"give {sweep.path} a directory of its own"
    )
    raise InputError(msg)


def _some(what: str, names: Sequence[str], most: int = 8) -> str:
    """`what` and the first few names; nothing where there are none."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return f"{what}{', '.join(names[:most])}{more}" if names else ""


def open_folder(path: Path) -> Folder:
    """The directory of a sweep that exists.

    Raises:
        InputError: it is not the directory of a sweep, or its manifest is damaged.
    """
    if not (path / MANIFEST).is_file():
        msg = f"{path}: {_instead(path)}"
        raise InputError(msg)
    return Folder(path, SweepManifest.read(path / MANIFEST))


def _instead(path: Path) -> str:
    """What a path is that is not the directory of a sweep, and what to give."""
    if (path / RUN).is_file():
        return "is one run; give the directory that a sweep or study made"
    if not path.exists():
        what = "there is no such directory"
    elif not path.is_dir():
        what = "is a file"
    else:
        what = f"holds neither a run ({RUN}) nor a sweep ({MANIFEST})"
    return f"{what}; give the directory of a run, a sweep or a study"


def count_states(runs: Sequence[RunStatus]) -> dict[str, int]:
    """How many runs are in each state; states that no run is in are absent."""
    return dict(Counter(run.state for run in runs))
