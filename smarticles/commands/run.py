"""Command `run` computes a scene; command `resume` continues a run or a sweep."""

from __future__ import annotations

import argparse
import os
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from dem.display import Display, Row
from dem.errors import InputError
from dem.record.names import MANIFEST, SCENE
from dem.run.stop import StopRequest, StopRequestedError, release
from dem.terminal import complain, warn
from smarticles import sweeps
from smarticles.command_line import Commands, add_options, scene_settings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dem.scene.scene import Scene

TO_BE_CONTINUED = 75  #: Exit status after SIGUSR1 stopped a run at a checkpoint; EX_TEMPFAIL of sysexits.h


def add(commands: Commands) -> None:
    """Add `run` to the command line."""
    run = commands.add(
        "run",
        run_scene,
        summary="compute one scene, and record it in a run directory",
        text="""
Computes all phases of the scene. DIR gets the scene with all defaults, versions, a log, frames (VTK;
open DIR/frames.pvd in ParaView) and series (HDF5), and done.json at the end. Ctrl-C stops the run; all
recorded files remain valid, and --resume continues from the last checkpoint. SIGUSR1, which batch
systems send before the time limit, stops the run at its next checkpoint with exit status 75. A
directory that contains other files is rejected and not changed.""",
        examples="""\
  smarticles run scene.yaml --out runs/a
  smarticles run scene.yaml --out runs/b --set seed=2 --set phases.2.duration_s=5
  smarticles run scene.yaml --out runs/c --set fidelity=draft
  smarticles run scene.yaml --out runs/d --engine links
  smarticles run scene.yaml --out runs/e --engine lammps --ranks 2
  smarticles run scene.yaml --out runs/a --resume
""",
    )
    add_options(run, "scene", "--set", "--engine")
    add_options(run, "--out", required=True, help="new run directory")
    resume_help = "continue the unfinished run of this scene in DIR from its last checkpoint"
    run.add_argument("--resume", action="store_true", help=resume_help)
    run.add_argument("--recorded-as", metavar="COMMAND", help=argparse.SUPPRESS)  # for `smarticles.run` in Python
    add_options(
        run,
        "--threads",
        help="threads of engine yade; default: 1 (OMP_NUM_THREADS is ignored), with --resume the number at the start. "
        "Results on several threads differ in the last bits",
    )
    add_options(run, "--ranks")


def add_resume(commands: Commands) -> None:
    """Add `resume` to the command line."""
    resume = commands.add(
        "resume",
        resume_directory,
        summary="continue a run, or compute the missing runs of a sweep",
        text="""
Finished runs are kept. An unfinished run continues from its last checkpoint. A run that failed, or has
no checkpoint, starts anew; its old directory is renamed to NAME.stopped-1. With --submit slurm the runs
that are neither finished nor in the queue become a new job, by default on the cluster and with the
options of the previous job, such as --time. To continue a study, repeat its command `smarticles study`,
which also writes tables and figures.""",
        examples="""\
  smarticles resume friction
  smarticles resume friction --jobs 1
  smarticles resume friction --submit slurm
  smarticles resume friction/runs/mu0.2_seed1
""",
    )
    add_options(resume, "directory", help="directory of a sweep or a run")
    add_options(resume, "--submit", default="local")
    add_options(
        resume,
        "--threads",
        help="threads of a single run; default: the number at its start. Another number changes the last bits",
    )
    add_options(resume, "--jobs")
    sweeps.add_cluster_options(resume)


def run_scene(arguments: argparse.Namespace) -> int:
    """Compute a scene in this process; return 0, or 75 if SIGUSR1 stopped the run at a checkpoint."""
    return _run(arguments.scene, arguments.out, arguments, scene_settings(arguments), resume=arguments.resume)


def resume_directory(arguments: argparse.Namespace) -> int:
    """Continue a run in this process, or a sweep on this machine or a cluster; return the exit status."""
    from templates.sweep.folder import open_folder  # noqa: PLC0415

    directory: Path = arguments.directory
    is_run = (directory / MANIFEST).is_file()
    for_cluster = sweeps.is_for_cluster(arguments, allow_ranks=is_run)
    if is_run:
        if for_cluster:
            msg = f"{directory}: is a single run; give the directory of its sweep to submit it, or leave --submit out"
            raise InputError(msg)
        return _run(directory / SCENE, directory, arguments, resume=True)
    release()  # a sweep does not listen for SIGUSR1
    folder = open_folder(directory)
    if arguments.threads is not None:
        option = f"--threads {arguments.threads}"
        raise InputError(f"{option}: is for a single run; {directory} is a sweep, whose runs have one thread; omit it")
    if for_cluster:
        return sweeps.enqueue(folder, arguments)
    if arguments.submit == "none":
        msg = "--submit none: writes a job script and needs --cluster NAME; see `smarticles resume --help`"
        raise InputError(msg)
    return sweeps.complete_here(folder, arguments)


def read_scene(scene_file: Path, settings: Sequence[str]) -> Scene:
    """Read a scene file, apply `KEY=VALUE` settings, and check the time steps."""
    from dem.plan.steps import time_steps  # noqa: PLC0415
    from dem.scene.reading import load_scene  # noqa: PLC0415

    return load_scene(scene_file, settings, check=time_steps)


def _run(
    scene_file: Path, out: Path, arguments: argparse.Namespace, settings: Sequence[str] = (), *, resume: bool
) -> int:
    stop = StopRequest()
    with stop.listening():
        return _run_until(stop, scene_file, out, arguments, settings, resume=resume)


def _run_until(
    stop: StopRequest,
    scene_file: Path,
    out: Path,
    arguments: argparse.Namespace,
    settings: Sequence[str],
    *,
    resume: bool,
) -> int:
    scene = read_scene(scene_file, settings)
    _set_parallelism(scene, out, resume=resume, threads=arguments.threads, ranks=arguments.ranks)
    quoted_out = shlex.quote(str(out))
    command = getattr(arguments, "recorded_as", None) or arguments.command_line
    try:
        with Display() as display:
            display.update(Row(label="starting"))
            # Imported last: it imports YADE, which takes seconds and needs the variables set above.
            from dem.run import run  # noqa: PLC0415

            outcome = run.run_scene(scene, out, command=command, display=display, resume=resume, stop=stop)
    except StopRequestedError as stopped:
        complain(f"{stopped}; to be continued: smarticles resume {quoted_out}")
        return TO_BE_CONTINUED
    except KeyboardInterrupt:
        commands = f"measure: smarticles measure {quoted_out}; continue: smarticles resume {quoted_out}"
        raise KeyboardInterrupt(f"all recorded files are valid; {commands}") from None
    if outcome is None:
        print(f"{out}: was already done")
    else:
        print(
            f"{out}: done, {outcome.time_s:.2f} s simulated in {outcome.wall_s:.{0 if outcome.wall_s > 10 else 1}f} s"
        )
    print(f"next: smarticles measure {quoted_out}, smarticles render {quoted_out}")
    return 0


def _set_parallelism(scene: Scene, out: Path, *, resume: bool, threads: int | None, ranks: int | None) -> None:
    """Set the environment variables from which the engine takes its number of threads or ranks.

    `threads` and `ranks` are the numbers that the user gave. Without a number it is 1; with `resume`, it is that in the
    manifest of the run in `out`. InputError if the engine cannot use the given number.
    """
    from dem.engine.cores import RANKS, check_ranks, threads_warning  # noqa: PLC0415
    from dem.record.run import Run  # noqa: PLC0415

    uses_ranks = scene.engine == "lammps"
    msg = ""
    if uses_ranks and threads is not None and threads > 1:
        msg = f"--threads {threads}: engine: lammps has processes of one thread; use --ranks {threads}"
    elif not uses_ranks and ranks is not None:
        msg = f"--ranks {ranks}: engine: {scene.engine} is one process; use --threads, or engine: lammps"
    elif scene.engine == "links" and threads is not None and threads > 1:
        msg = f"--threads {threads}: engine: links has one thread; leave it out, and run several seeds at once"
    if msg:
        raise InputError(msg)
    wanted = 1 if scene.engine == "links" else ranks if uses_ranks else threads
    if wanted is None:
        wanted = Run(out).manifest.threads if resume and (out / MANIFEST).is_file() else 1
    if uses_ranks:
        check_ranks(wanted)
        os.environ[RANKS], wanted = str(wanted), 1
    elif (warning := threads_warning(wanted)) is not None:
        warn(warning)
    # Replaces the value of a batch system, which may be all cores of the node.
    os.environ["OMP_NUM_THREADS"] = str(wanted)
