"""run and resume: one scene into one run directory; what a run or a sweep is missing."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from dem.errors import InputError
from smarticles import sweeps
from smarticles.command_line import Commands, add_ranks, add_scene, add_shared, positive_int, scene_settings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dem.scene.scene import Scene

TO_BE_CONTINUED = 75  #: Exit status of a run that SIGUSR1 stopped at a checkpoint; EX_TEMPFAIL of sysexits.h


def add(commands: Commands) -> None:
    """Add the command."""
    run = commands.add(
        "run",
        run_scene,
        summary="run one scene into one run directory",
        text="""
Pours, shakes and relaxes as the scene says. DIR gets the resolved scene, versions, a log, VTK
frames (open DIR/frames.pvd in ParaView) and HDF5 series, and done.json at the end. Ctrl-C stops
the run and leaves what was recorded whole; --resume goes on from the last checkpoint. SIGUSR1, as a
batch system sends before its time limit, ends the run at its next checkpoint with exit status 75. A
directory that holds something else is never touched.""",
        examples="""\
  smarticles run scene.yaml --out runs/a
  smarticles run scene.yaml --out runs/b --set seed=2 --set phases.2.duration_s=5
  smarticles run scene.yaml --out runs/c --set fidelity=draft
  smarticles run scene.yaml --out runs/d --engine links
  smarticles run scene.yaml --out runs/e --engine lammps --ranks 2
  smarticles run scene.yaml --out runs/a --resume
""",
    )
    add_scene(run, "what computes it, instead of what the scene says")
    run.add_argument("--out", type=Path, required=True, metavar="DIR", help="new run directory")
    run.add_argument(
        "--resume",
        action="store_true",
        help="go on in DIR, which holds an unfinished run of this scene, from its last checkpoint",
    )
    run.add_argument(
        "--threads",
        type=positive_int,
        metavar="N",
        help="threads of YADE; default 1, whatever OMP_NUM_THREADS says, or what the run to be resumed began with. "
        "Results on several threads differ in the last bits. links has one thread, lammps has --ranks",
    )
    add_ranks(run, "1, or what the run to be resumed began with")


def add_resume(commands: Commands) -> None:
    """Add the command."""
    resume = commands.add(
        "resume",
        resume_directory,
        summary="go on with a run, or with what a sweep is missing",
        text="""
Finished runs are kept. An unfinished one goes on from its last checkpoint; without a checkpoint, or
when it failed, what it left is renamed to NAME.stopped-1, not deleted, and the run starts anew. With --submit slurm
what is missing and not in the queue becomes a new job, on the cluster of the last one unless --cluster says otherwise.
For a study, give the study's command again: it also makes the tables and figures.""",
        examples="""\
  smarticles resume friction
  smarticles resume friction --jobs 1
  smarticles resume friction --submit slurm
  smarticles resume friction/runs/mu0.2_seed1
""",
    )
    resume.add_argument("directory", type=Path, metavar="DIR", help="of a sweep or a run")
    resume.add_argument(
        "--submit",
        choices=("none", "local", "slurm"),
        default="local",
        help="local: run on this machine (default); slurm: submit a job; none: with --cluster, write its script",
    )
    resume.add_argument(
        "--threads",
        type=positive_int,
        metavar="N",
        help="threads of one run; default: what it began with. Another number is logged, and changes the last bits",
    )
    add_shared(resume, "--jobs")
    sweeps.add_cluster_options(resume)


def run_scene(arguments: argparse.Namespace) -> int:
    """Run a scene in this process; return 0, or 75 where SIGUSR1 stopped the run at a checkpoint."""
    return _run(arguments.scene, arguments.out, arguments, scene_settings(arguments), resume=arguments.resume)


def resume_directory(arguments: argparse.Namespace) -> int:
    """Go on with a run in this process, or with a sweep here or on a cluster."""
    from templates.sweep.folder import open_folder  # noqa: PLC0415

    directory: Path = arguments.directory
    one_run = (directory / "run.json").is_file()
    queue = sweeps.wants_queue(arguments, one_run=one_run)
    if one_run:
        if queue:
            msg = f"{directory}: is one run; give the directory of its sweep to submit it, or leave --submit out"
            raise InputError(msg)
        return _run(directory / "scene.yaml", directory, arguments, resume=True)
    folder = open_folder(directory)
    if arguments.threads is not None:
        given = f"--threads {arguments.threads}"
        raise InputError(f"{given}: is for one run, and {directory} is a sweep, of runs of one thread; leave it out")
    if queue:
        return sweeps.enqueue(folder, arguments)
    if arguments.submit == "none":
        msg = "--submit none: needs --cluster NAME, for which the script is written; see `smarticles resume --help`"
        raise InputError(msg)
    return sweeps.complete_here(folder, arguments)


def read_scene(scene_file: Path, settings: Sequence[str]) -> Scene:
    """Read a scene and check its time steps as well; errors name the file."""
    from dem.plan.steps import time_steps  # noqa: PLC0415
    from dem.scene.reading import load_scene  # noqa: PLC0415

    scene = load_scene(scene_file, settings)
    try:
        time_steps(scene)
    except InputError as error:
        raise InputError(f"{scene_file}: {error}") from None
    return scene


def _run(
    scene_file: Path, out: Path, arguments: argparse.Namespace, settings: Sequence[str] = (), *, resume: bool
) -> int:
    scene = read_scene(scene_file, settings)
    _set_workers(scene, out, resume=resume, threads=arguments.threads, ranks=arguments.ranks)
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
    """Set the number of threads, or ranks, by variables that the engine reads when it is loaded."""
    from dem.engine.cores import (  # noqa: PLC0415
        RANKS,
        check_ranks,
        threads_warning,
    )
    from dem.record.names import MANIFEST  # noqa: PLC0415
    from dem.record.run import Run  # noqa: PLC0415

    many = scene.engine == "lammps"
    msg = ""
    if many and threads is not None and threads > 1:
        msg = f"--threads {threads}: engine: lammps has processes of one thread; use --ranks {threads}"
    elif not many and ranks is not None:
        msg = f"--ranks {ranks}: engine: {scene.engine} is one process; use --threads, or engine: lammps"
    elif scene.engine == "links" and threads is not None and threads > 1:
        msg = f"--threads {threads}: engine: links has one thread; leave it out, and run several seeds side by side"
    if msg:
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
