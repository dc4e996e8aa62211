"""One scene as commands take it: read and checked, or run in this process."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from dem.errors import InputError
from smarticles.stopping import TO_BE_CONTINUED

if TYPE_CHECKING:
    from dem.scene.scene import Scene


def read_scene(scene_file: Path, settings: Sequence[str]) -> Scene:
    """A scene whose time steps are known to be good as well; errors name the file."""
    from dem.plan.steps import time_steps  # noqa: PLC0415
    from dem.scene.reading import load_scene  # noqa: PLC0415

    scene = load_scene(scene_file, settings)
    try:
        time_steps(scene)
    except InputError as error:
        msg = f"{scene_file}: {error}"
        raise InputError(msg) from None
    return scene


def run_here(
    scene_file: Path,
    out: Path,
    arguments: argparse.Namespace,
    *,
    settings: Sequence[str] = (),
    resume: bool,
    threads: int | None = None,
    ranks: int | None = None,
) -> int:
    """Run a scene in this process.

    Args:
        scene_file: the scene.
        out: the run directory.
        arguments: of the command, for the manifest.
        settings: keys that differ from the file, `KEY=VALUE`.
        resume: go on in a run directory that holds an unfinished run.
        threads: of the engine; by default one, or as many as the run that is resumed began with.
        ranks: likewise, on the engine lammps.

    Returns:
        Exit status: 0, or 75 where SIGUSR1 stopped the run at a checkpoint.

    Raises:
        InputError: the scene is not valid, or the directory holds something else.
        RunError: the run failed.
        KeyboardInterrupt: it was stopped; the message says how to go on.
    """
    scene = read_scene(scene_file, settings)
    _set_workers(scene, out, resume=resume, threads=threads, ranks=ranks)
    # These lead to YADE: not before the scene is known to be good.
    from dem.run import run  # noqa: PLC0415
    from dem.run.simulation import StopRequestedError  # noqa: PLC0415

    place = shlex.quote(str(out))
    try:
        outcome = run.run_scene(scene, out, command=arguments.command_line, progress=sys.stderr.isatty(), resume=resume)
    except StopRequestedError as stop:
        print(f"smarticles: {stop}; to be continued: smarticles resume {place}", file=sys.stderr)
        return TO_BE_CONTINUED
    except KeyboardInterrupt:
        msg = f"what was recorded is whole; measure it: smarticles measure {place}; go on: smarticles resume {place}"
        raise KeyboardInterrupt(msg) from None
    if outcome is None:
        print(f"{out}: was done already")
    else:
        print(f"{out}: done, {outcome.time_s:.2f} s simulated in {outcome.wall_s:.0f} s")
    print(f"next: smarticles measure {place}, smarticles render {place}")
    return 0


def _set_workers(scene: Scene, out: Path, *, resume: bool, threads: int | None, ranks: int | None) -> None:
    """Tell the engine on how many threads, or ranks, it is to run: by variables that it reads when it is loaded.

    Raises:
        InputError: the engine has none of them, or there are not so many cores.
    """
    from dem.engine.cores import RANKS, check_ranks, threads_warning  # noqa: PLC0415
    from dem.record.names import MANIFEST  # noqa: PLC0415
    from dem.record.run import Run  # noqa: PLC0415

    many = scene.engine == "lammps"
    if many and threads is not None and threads > 1:
        msg = f"--threads {threads}: engine: lammps has processes of one thread; use --ranks {threads}"
        raise InputError(msg)
    if not many and ranks is not None:
        msg = f"--ranks {ranks}: engine: {scene.engine} is one process; use --threads, or engine: lammps"
        raise InputError(msg)
    if scene.engine == "links" and threads is not None and threads > 1:
        msg = f"--threads {threads}: engine: links has one thread; leave it out, and run several seeds side by side"
        raise InputError(msg)
    wanted = 1 if scene.engine == "links" else ranks if many else threads
    if wanted is None:
        wanted = Run(out).manifest.threads if resume and (out / MANIFEST).is_file() else 1
    if many:
        check_ranks(wanted)
        os.environ[RANKS], wanted = str(wanted), 1
    elif (warning := threads_warning(wanted)) is not None:
        print(f"smarticles: warning: {warning}", file=sys.stderr)
    # A batch system may have set it to all cores of the node.
    os.environ["OMP_NUM_THREADS"] = str(wanted)
