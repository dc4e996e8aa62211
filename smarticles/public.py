"""What `import smarticles` offers beside names that live elsewhere: run a scene, read a run, compute a sweep."""

from __future__ import annotations

import shlex
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from dem.errors import InputError, RunError
from dem.scene.reading import dump_scene
from dem.scene.scene import Scene
from postprocess import FrameSequence, RunManifest, Series, read_frames, read_run, read_series
from smarticles.main import BAD_INPUT
from smarticles.sweeps import complete, make_folder
from templates.local.runner import environment, smarticles_command


@dataclass(frozen=True)
class RunDirectory:
    """What is in a run directory; each part is read when it is asked for, once.

    Args:
        path: the directory.
    """

    path: Path

    @cached_property
    def manifest(self) -> RunManifest:
        """What made the run, and how it ended."""
        return read_run(self.path)

    @cached_property
    def frames(self) -> FrameSequence:
        """The recorded frames, each read when it is asked for."""
        return read_frames(self.path)

    @cached_property
    def series(self) -> Series:
        """The recorded time series."""
        return read_series(self.path)


def run(scene: Scene | Path | str, out: Path | str, *, threads: int = 1, resume: bool = False) -> RunDirectory:
    """Run a scene into a run directory, as `smarticles run` does, in a process of its own.

    Of its own, because YADE and what draws never meet in one.

    Args:
        scene: a scene, or the file of one.
        out: the run directory; must not exist or be empty, or with `resume` hold an unfinished run of this scene.
        threads: of the engine; only one gives the same bits again.
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
        done = subprocess.run(
            words, env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False
        )
    if done.returncode:
        said = done.stderr.strip().splitlines() or [f"exit status {done.returncode}, without a word"]
        text = said[-1].removeprefix("smarticles: ").removeprefix("error: ")
        raise InputError(text) if done.returncode == BAD_INPUT else RunError(text)
    return RunDirectory(Path(out))


def read(directory: Path | str) -> RunDirectory:
    """A run directory, finished or not.

    Raises:
        InputError: it is none.
    """
    found = RunDirectory(Path(directory))
    _ = found.manifest  # what is no run directory is refused here, not at the first use
    return found


def sweep(file: Path | str, out: Path | str, *, jobs: int | None = None) -> Sequence[RunDirectory]:
    """Expand a sweep file into its directory and run what is missing, on this machine.

    Args:
        file: the sweep file.
        out: the sweep's directory; taken up where it holds this sweep already.
        jobs: runs at once; by default one per core.

    Returns:
        The runs, in the sweep's order.

    Raises:
        InputError: the sweep is not valid, or the directory holds something else.
        RunError: a run failed.
    """
    again = shlex.join(["smarticles", "sweep", str(file), "--out", str(out), "--submit", "local"])
    folder = make_folder(Path(file), Path(out), again)
    complete(folder, jobs=jobs, command=again)
    return [RunDirectory(folder.run(entry)) for entry in folder.entries]
