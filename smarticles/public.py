"""What `import smarticles` offers beside names that live elsewhere: run a scene, read a run, compute a sweep."""

from __future__ import annotations

import shlex
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, overload

import pandas as pd

from dem.errors import InputError, RunError
from dem.record.run import Run, open_run
from dem.scene.reading import dump_scene
from dem.scene.scene import Scene
from smarticles.main import BAD_INPUT
from smarticles.measuring import grouped, measured
from smarticles.scene_sweep import write_sweep
from smarticles.sweeps import complete, make_folder
from templates.local.runner import environment, smarticles_command
from templates.sweep.folder import Folder, open_folder


@dataclass(frozen=True)
class SweepDirectory(Sequence[Run]):
    """The runs of a sweep in its order, and tables of all of them.

    Args:
        folder: the sweep's directory.
    """

    folder: Folder

    @property
    def path(self) -> Path:
        """The sweep's directory."""
        return self.folder.path

    @cached_property
    def values(self) -> pd.DataFrame:
        """What the sweep varies: one row per run, by the runs' names."""
        entries = self.folder.entries
        return pd.DataFrame([dict(entry.values) for entry in entries], index=[entry.name for entry in entries])

    def __len__(self) -> int:
        return len(self.folder.entries)

    @overload
    def __getitem__(self, index: int) -> Run: ...

    @overload
    def __getitem__(self, index: slice) -> list[Run]: ...

    def __getitem__(self, index: int | slice) -> Run | list[Run]:
        entries = self.folder.entries[index]
        if isinstance(entries, tuple):
            return [Run(self.folder.run(entry)) for entry in entries]
        return Run(self.folder.run(entries))

    def table(self, *, by: str | Sequence[str] | None = None, frames: bool = False) -> pd.DataFrame:
        """All measures of the runs that have begun, with what the sweep varies as columns.

        Args:
            by: columns, such as variables of the sweep, whose values make a group: then one row per group and phase,
                means over its runs with "… SE […]", the standard error from run to run.
            frames: one row per frame; else one per run and phase.

        Raises:
            InputError: no run has frames yet, there is no such column, or groups of frames are asked for.
        """
        if by is not None and frames:
            msg = "by: averages over phases of runs; leave frames out"
            raise InputError(msg)
        table = measured([self.path], frames=frames)
        return table if by is None else grouped(table, [by] if isinstance(by, str) else list(by))


def run(
    scene: Scene | Path | str, out: Path | str, *, threads: int = 1, ranks: int | None = None, resume: bool = False
) -> Run:
    """Run a scene into a run directory, as `smarticles run` does, in a process of its own.

    Of its own, because YADE and what draws never meet in one.

    Args:
        scene: a scene, or the file of one.
        out: the run directory; must not exist or be empty, or with `resume` hold an unfinished run of this scene.
        threads: of the engine; only one gives the same bits again.
        ranks: processes of the engine lammps; default: one.
        resume: go on from the last checkpoint.

    Raises:
        InputError: the scene is not valid, or `out` holds something else.
        RunError: the run failed or was stopped.
    """
    with tempfile.TemporaryDirectory(prefix="smarticles-") as scratch:
        file = Path(scratch, "scene.yaml") if isinstance(scene, Scene) else Path(scene)
        if isinstance(scene, Scene):
            file.write_text(dump_scene(scene), encoding="utf-8")
        words = [*smarticles_command(file, Path(out), resume), "--threads", str(threads)]
        words += [] if ranks is None else ["--ranks", str(ranks)]
        done = subprocess.run(
            words, env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False
        )
    if done.returncode:
        said = done.stderr.strip().splitlines() or [f"exit status {done.returncode}, without a word"]
        text = said[-1].removeprefix("smarticles: ").removeprefix("error: ")
        raise InputError(text) if done.returncode == BAD_INPUT else RunError(text)
    return Run(Path(out))


def read(directory: Path | str) -> Run:
    """Open a run directory, finished or not.

    Raises:
        InputError: it is none.
    """
    return open_run(directory)


def measure(run: Run | Path | str, *, frames: bool = False) -> pd.DataFrame:
    """All measures of a run as a table, units in its column names, as `smarticles measure` gives them.

    Args:
        run: a run, or its directory.
        frames: one row per frame; else one per phase, means over its last frames with their standard errors.

    Raises:
        InputError: it is no run, or has no frames yet.
    """
    return measured([run.path if isinstance(run, Run) else Path(run)], frames=frames)


def read_sweep(directory: Path | str) -> SweepDirectory:
    """A sweep's or a study's directory, its runs done or not.

    Raises:
        InputError: it is none.
    """
    return SweepDirectory(open_folder(Path(directory)))


def sweep(
    what: Scene | Path | str,
    out: Path | str,
    *,
    vary: Mapping[str, Sequence[Any]] | None = None,
    jobs: int | None = None,
) -> SweepDirectory:
    """Run many scenes into one directory on this machine, or what is missing of them.

    Args:
        what: a sweep file; or, with `vary`, a scene or the file of one.
        out: the sweep's directory; taken up where it holds this sweep already.
        vary: keys of the scene, dots for nesting, and the values that each takes: every combination is run. The last
            word of a key is the variable's name: {"smarticle.aspect_ratio": [0.4, 0.7], "seed": [1, 2, 3]} gives
            columns `aspect_ratio` and `seed`.
        jobs: runs at once; by default one per core.

    Returns:
        The runs, in the sweep's order.

    Raises:
        InputError: a scene or the sweep is not valid, or the directory holds something else.
        RunError: a run failed.
    """
    with tempfile.TemporaryDirectory(prefix="smarticles-") as scratch:
        if vary is None and isinstance(what, Scene):
            msg = "vary: is missing; give the keys of the scene that change, e.g. vary={'seed': [1, 2, 3]}"
            raise InputError(msg)
        file = write_sweep(what, vary, Path(scratch)) if vary is not None else Path(str(what))
        # The scenes of a sweep without a file are in its directory, and `resume` needs no more.
        words = ["sweep", str(file), "--out", str(out), "--submit", "local"] if vary is None else ["resume", str(out)]
        again = shlex.join(["smarticles", *words])
        folder = make_folder(file, Path(out), again)
    complete(folder, jobs=jobs, command=again)
    return SweepDirectory(folder)
