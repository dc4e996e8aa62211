"""Create and read the directory of a sweep.

DIR/sweep.json          manifest: texts of the sweep's files, points with scene hashes, versions
DIR/scenes/NAME.yaml    the resolved scene of each run
DIR/runs/NAME/          the run directories
DIR/logs/NAME.txt       output of the run's process
DIR/jobs/               submissions to a queue, see `templates.slurm.submission`
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, ClassVar, Literal, Self

from dem.errors import InputError
from dem.record.document import Document
from dem.record.files import write_text
from dem.record.names import MANIFEST as RUN
from dem.record.names import OF_SWEEP as MANIFEST
from dem.record.run import Run, Status, runs_within
from dem.record.rundir import acquired
from dem.scene.reading import dump_scene
from templates.sweep.expand import Point
from templates.sweep.sweep_file import SEED, Sweep


@dataclass(frozen=True, kw_only=True)
class RunStatus(Status):
    """Status of one run of a sweep."""

    name: str
    directory: Path
    job: str | None = None  #: Number of the latest task of a queue that computes the run, such as `12_3`

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        keys = ("name", "directory", "state", "cause", "phase", "time_s", "wall_s", "job", "checkpoint_s")
        return {key: getattr(self, key) for key in keys} | {"directory": str(self.directory)}


def run_status(directory: Path) -> RunStatus:
    """Return the status of a run from the files in its directory, which may not exist."""
    return RunStatus(name=directory.name, directory=directory, **vars(Run(directory).status))


class Entry(Document):
    """One run of a sweep in its manifest."""

    name: str  #: Name of the run, its scene and its directory
    scene_sha256: str  #: Hash of the scene
    expected_s: float  #: Expected wall time [s]
    values: Mapping[str, Any]  #: Values of the sweep's variables
    again: bool = False  #: Whether the run repeats another run with other constants


class SweepManifest(Document):
    """Manifest of a sweep, `sweep.json`; `files` are the texts of sweep file, template and table by name."""

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
    """The directory of a sweep and its manifest."""

    path: Path
    manifest: SweepManifest

    @property
    def name(self) -> str:
        """Name of the sweep."""
        return self.manifest.name

    @property
    def entries(self) -> tuple[Entry, ...]:
        """All runs of the sweep, in the order of its file."""
        return self.manifest.points

    def only(self, entries: Sequence[Entry]) -> Self:
        """Return a folder that lists only the given runs."""
        return replace(self, manifest=self.manifest.model_copy(update={"points": tuple(entries)}))

    def in_order_of_start(self, entries: Sequence[Entry]) -> list[Entry]:
        """Return runs in the order in which to start them, those with the longest expected time first.

        If the sweep is computed seed by seed, all runs with its first seed come before all runs with the second. Runs
        that repeat another run with other constants (`again`) come last.
        """
        seeds = list(dict.fromkeys(entry.values.get(SEED) for entry in self.entries))
        ranks = {seed: rank for rank, seed in enumerate(seeds) if self.manifest.seed_by_seed}
        return sorted(entries, key=lambda entry: (entry.again, ranks.get(entry.values.get(SEED), 0), -entry.expected_s))

    def scene(self, entry: Entry) -> Path:
        """Return the path of the scene of a run."""
        return self.path / "scenes" / f"{entry.name}.yaml"

    def run(self, entry: Entry) -> Path:
        """Return the directory of a run."""
        return self.path / "runs" / entry.name

    def runs(self) -> list[Run]:
        """Return all runs in the order of the sweep, including runs whose directory does not exist yet."""
        return [Run(self.run(entry)) for entry in self.entries]

    def log(self, entry: Entry) -> Path:
        """Return the path of the text file with the output of a run's process."""
        return self.path / "logs" / f"{entry.name}.txt"

    def is_done(self, entry: Entry) -> bool:
        """Return whether an entry's run has ended well and has this entry's scene (by its hash)."""
        return Run(self.run(entry)).status.state == "done" and self._is_of_scene(entry)

    def can_resume(self, entry: Entry) -> bool:
        """Return whether an entry's run has a checkpoint from which it can continue with this entry's scene."""
        return Run(self.run(entry)).can_resume and self._is_of_scene(entry)

    def _is_of_scene(self, entry: Entry) -> bool:
        try:
            return Run(self.run(entry)).manifest.scene_sha256 == entry.scene_sha256
        except InputError:
            return False

    def status(self) -> list[RunStatus]:
        """Return the status of all runs."""
        return [run_status(self.run(entry)) for entry in self.entries]

    def set_aside(self, entry: Entry) -> None:
        """Rename the directory of an unfinished run, so that the run can start from its beginning."""
        directory = self.run(entry)
        if directory.is_dir() and any(directory.iterdir()):
            number = 1
            while (aside := directory.with_name(f"{entry.name}.stopped-{number}")).exists():
                number += 1
            directory.rename(aside)

    @contextmanager
    def lock(self) -> Iterator[int]:
        """Lock the sweep, and yield the file descriptor that the processes of its runs must inherit.

        The lock lasts until the last process with this descriptor ends, so that runs which outlive a killed parent
        process keep the sweep locked. InputError if another process holds the lock, if the directory cannot be written,
        or if its file system has no locks.
        """
        try:
            lock = (self.path / ".lock").open("a")
        except OSError as error:
            raise InputError(
                f"{self.path}: cannot be written ({error.strerror}); allow it, or copy the sweep"
            ) from None
        with lock as file:
            if not acquired(file, str(self.path)):
                raise InputError(
                    f"{self.path}: runs of this sweep are being computed already; wait for them "
                    f"(smarticles status {self.path}) or stop that process"
                )
            yield file.fileno()


def entry_of(point: Point, expected_s: float) -> Entry:
    """Return the entry of the manifest for a point with an expected wall time [s]."""
    return Entry(
        name=point.name,
        scene_sha256=point.scene_sha256,
        expected_s=round(expected_s, 1),
        values=dict(point.values),
        again=point.again,
    )


def create_folder(
    path: Path,
    sweep: Sweep,
    points: Sequence[Point],
    *,
    command: str,
    versions: Mapping[str, str],
    expected_s: Sequence[float],
    extend: bool = False,
) -> Folder:
    """Create the directory of a sweep, or open a directory that already holds this sweep.

    The directory is absent, empty, or holds this sweep; with `extend` it may hold some of these runs and no others, and
    the missing ones are added. Command and versions are for the record; the wall times of the points are expected ones
    [s].

    InputError if it holds something else, or its runs are being computed while it is to be extended.
    """
    # Names relative to the sweep file, which do not depend on this machine.
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
        points=tuple(entry_of(point, wall) for point, wall in zip(points, expected_s, strict=True)),
    )
    if (path / MANIFEST).exists():
        wanted = {entry.name: entry.scene_sha256 for entry in manifest.points}
        present = {entry.name: entry.scene_sha256 for entry in open_folder(path).entries}
        if extend and present.items() < wanted.items():
            with open_folder(path).lock():
                manifest.write(path / MANIFEST)
        elif present != wanted:
            others = [name for name, scene in present.items() if wanted.get(name, scene) != scene]
            parts = [
                _some("only in the file: ", [name for name in wanted if name not in present]),
                _some("only in the directory: ", [name for name in present if name not in wanted]),
                _some("of another scene: ", others),
            ]
            raise InputError(
                f"{path}: holds another sweep ({open_folder(path).name!r}): runs {'; '.join(filter(None, parts))}; "
                f"give {sweep.path} a directory of its own"
            )
    else:
        wrong = "is a file" if path.exists() and not path.is_dir() else ""
        if path.is_dir() and any(path.iterdir()):
            wrong = "holds other files"
        if wrong:
            raise InputError(f"{path}: {wrong}; give a directory that is new or holds this sweep")
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"--out {path}: cannot be made ({error.strerror}); choose another directory") from error
        manifest.write(path / MANIFEST)
    folder = open_folder(path)
    (path / "scenes").mkdir(exist_ok=True)
    for entry, point in zip(manifest.points, points, strict=True):
        file = folder.scene(entry)
        if not file.exists():
            write_text(file, dump_scene(point.scene, file.parent))
    return folder


def _some(what: str, names: Sequence[str]) -> str:
    """Return `what` and the first eight names as text; an empty text if there is no name."""
    more = f" and {len(names) - 8} more" if len(names) > 8 else ""
    return f"{what}{', '.join(names[:8])}{more}" if names else ""


def open_folder(path: Path) -> Folder:
    """Open the directory of a sweep; raise InputError if it has no manifest, or a damaged one."""
    if (path / MANIFEST).is_file():
        return Folder(path, SweepManifest.read(path / MANIFEST))
    if (path / RUN).is_file():
        raise InputError(f"{path}: is one run; give the directory that a sweep or study made")
    what = f"holds neither a run ({RUN}) nor a sweep ({MANIFEST})" if path.is_dir() else "is a file"
    if not path.exists():
        what = "there is no such directory"
    raise InputError(f"{path}: {what}; {runs_within(path) or 'give the directory of a run, a sweep or a study'}")
