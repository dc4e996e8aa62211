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
from typing import Any, Literal

from dem.errors import InputError
from dem.record.files import write_json, write_text
from dem.scene.reading import dump_scene
from dem.scene.scene import Scene
from templates.sweep.expand import Point
from templates.sweep.files import read_json
from templates.sweep.render import Value
from templates.sweep.sweep_file import SEED, Sweep

FORMAT = 1
MANIFEST = "sweep.json"
RUN = "run.json"  # of each run directory
CHECKPOINT = "checkpoint.zip"

State = Literal["done", "running", "queued", "failed", "interrupted", "stopped", "missing"]
"""`interrupted` closed its files when told to stop; `stopped` was killed and says nothing; `queued` waits for a job."""


@dataclass(frozen=True, kw_only=True)
class RunStatus:
    """How far one run is.

    Args:
        name: name of the run.
        directory: its run directory.
        state: where it stands.
        cause: why it failed, or None.
        phase: type of the phase it is in, or None.
        time_s: simulated time [s], or None.
        wall_s: wall time so far [s], or None.
        job: number of the queue's task that computes it, or did last, or None.
        checkpoint_s: simulated time of its newest checkpoint [s], from which it can go on, or None.
    """

    name: str
    directory: Path
    state: State
    cause: str | None = None
    phase: str | None = None
    time_s: float | None = None
    wall_s: float | None = None
    job: str | None = None
    checkpoint_s: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {**self.__dict__, "directory": str(self.directory)}


def run_status(directory: Path, *, name: str | None = None, active: bool = False) -> RunStatus:
    """State of one run directory, from its files alone.

    Args:
        directory: the run directory; it may be absent.
        name: what to call the run; by default the directory's name.
        active: whether a process may be working in it.
    """
    label = name or directory.name
    done = read_json(directory / "done.json")
    if done is not None:
        return RunStatus(
            name=label,
            directory=directory,
            state="done",
            time_s=done.get("time_s"),
            wall_s=done.get("wall_s"),
        )
    progress = read_json(directory / "progress.json") or {}
    failed = read_json(directory / "failed.json")
    state: State
    if failed is not None:
        state = "interrupted" if failed.get("status") == "interrupted" else "failed"
    elif not _started(directory):
        state = "missing"
    else:
        state = "running" if active else "stopped"
    return RunStatus(
        name=label,
        directory=directory,
        state=state,
        cause=(failed or {}).get("cause"),
        phase=progress.get("phase"),
        time_s=(failed or progress).get("time_s"),
        wall_s=progress.get("wall_s"),
        checkpoint_s=(failed or progress).get("checkpoint_s"),
    )


def _started(directory: Path) -> bool:
    return directory.is_dir() and any(directory.iterdir())


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One run of a sweep, as its manifest lists it.

    Args:
        name: name of the run, its scene and its directory.
        scene_sha256: hash of its scene.
        expected_s: expected wall time [s]; only its proportion to the others' matters.
        values: the sweep's variables.
        again: whether it is another run once more, with other constants.
    """

    name: str
    scene_sha256: str
    expected_s: float
    values: Mapping[str, Value]
    again: bool = False


@dataclass(frozen=True, kw_only=True)
class Folder:
    """A sweep's directory.

    Args:
        path: the directory.
        name: the sweep's name.
        command: the command that made it.
        entries: its runs.
        seed_by_seed: whether the runs with the first seed start before all others.
    """

    path: Path
    name: str
    command: str
    entries: tuple[Entry, ...]
    seed_by_seed: bool = False

    def in_order_of_start(self, entries: Sequence[Entry]) -> list[Entry]:
        """Runs in the order in which to start them: the longest first, seed by seed where the sweep says so.

        Those that come once more, such as on a slower engine, come after all others.
        """
        seeds = list(dict.fromkeys(entry.values.get(SEED) for entry in self.entries)) if self.seed_by_seed else []
        ranks = {seed: rank for rank, seed in enumerate(seeds)}
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
        return read_json(self.run(entry) / "done.json") is not None and self._is_of_scene(entry)

    def can_resume(self, entry: Entry) -> bool:
        """Whether the run was stopped, did not fail, and left a checkpoint to go on from."""
        directory = self.run(entry)
        stopped = run_status(directory).state in ("interrupted", "stopped")
        return stopped and (directory / CHECKPOINT).is_file() and self._is_of_scene(entry)

    def _is_of_scene(self, entry: Entry) -> bool:
        manifest = read_json(self.run(entry) / RUN) or {}
        return manifest.get("scene_sha256") == entry.scene_sha256

    def status(self) -> list[RunStatus]:
        """State of every run."""
        active = self.is_active()
        return [run_status(self.run(entry), name=entry.name, active=active) for entry in self.entries]

    def set_aside(self, entry: Entry) -> Path | None:
        """Rename what an unfinished run left, so that the run can start anew; nothing is deleted.

        Returns:
            Where it went, or None if there was nothing.
        """
        directory = self.run(entry)
        if not _started(directory):
            return None
        number = 1
        while (aside := directory.with_name(f"{entry.name}.stopped-{number}")).exists():
            number += 1
        return directory.rename(aside)

    def is_active(self) -> bool:
        """Whether runs of this sweep are being computed on this machine."""
        try:
            with self.lock():
                return False
        except InputError:
            return True

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
    manifest = _manifest(sweep, points, command, versions, expected_s)
    if (path / MANIFEST).exists():
        folder = open_folder(path)
        if extend and _is_part(folder, points):
            with folder.lock():
                write_json(path / MANIFEST, manifest)
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
        write_json(path / MANIFEST, manifest)
        folder = open_folder(path)
    (path / "scenes").mkdir(exist_ok=True)
    for point in points:
        file = folder.path / "scenes" / f"{point.name}.yaml"
        if not file.exists():
            write_text(file, dump_scene(point.scene, file.parent))
    return folder


def _manifest(
    sweep: Sweep,
    points: Sequence[Point],
    command: str,
    versions: Mapping[str, str],
    expected_s: Callable[[Scene], float],
) -> dict[str, Any]:
    # By the names that they have seen from the sweep file, wherever that lies on this machine.
    files = {sweep.path.name: sweep.text, sweep.content.template: sweep.template_text}
    if sweep.content.points.table is not None and sweep.table_text is not None:
        files[sweep.content.points.table.file] = sweep.table_text
    return {
        "format": FORMAT,
        "name": sweep.content.name,
        "command": command,
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "versions": dict(versions),
        "files": files,
        "seed_by_seed": sweep.content.repeats is not None and sweep.content.repeats.seed_by_seed,
        "points": [
            {
                "name": point.name,
                "scene_sha256": point.scene_sha256,
                "expected_s": round(expected_s(point.scene), 1),
                "values": dict(point.values),
                **({"again": True} if point.again else {}),
            }
            for point in points
        ],
    }


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
    file = path / MANIFEST
    if not file.is_file():
        msg = f"{path}: {_instead(path)}"
        raise InputError(msg)
    content = read_json(file)
    try:
        if content is None or content["format"] != FORMAT:
            raise ValueError
        return Folder(
            path=path,
            name=str(content["name"]),
            command=str(content["command"]),
            # Manifests of before this was known lack it.
            seed_by_seed=bool(content.get("seed_by_seed", False)),
            entries=tuple(
                Entry(
                    name=str(point["name"]),
                    scene_sha256=str(point["scene_sha256"]),
                    expected_s=float(point["expected_s"]),
                    values=dict(point["values"]),
                    again=point.get("again") is True,
                )
                for point in content["points"]
            ),
        )
    except (KeyError, TypeError, ValueError) as error:
        msg = f"{file}: not a sweep manifest of format {FORMAT}; write the sweep to a new directory"
        raise InputError(msg) from error


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
