"""resume: go on with a run, or with what a sweep is missing."""

from __future__ import annotations

import argparse
from pathlib import Path

from dem.errors import InputError
from smarticles import queueing
from smarticles.parsing import Commands, add_slots, positive_int
from smarticles.scenes import run_here
from smarticles.sweeps import complete_and_tell


def add(commands: Commands) -> None:
    """Add the command."""
    resume = commands.add(
        "resume",
        resume_sweep,
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
        help="threads of one run; default: what it began with. Another number is told and goes on with other last bits",
    )
    add_slots(resume)
    queueing.add_options(resume)


def resume_sweep(arguments: argparse.Namespace) -> int:
    """`smarticles resume`."""
    from templates.slurm.queue import require_sbatch  # noqa: PLC0415
    from templates.sweep.folder import open_folder  # noqa: PLC0415

    directory: Path = arguments.directory
    one_run = (directory / "run.json").is_file()
    queue = queueing.wants_queue(arguments, one_run=one_run)
    if one_run:
        if queue:
            msg = f"{directory}: is one run; give the directory of its sweep to submit it, or leave --submit out"
            raise InputError(msg)
        return run_here(
            directory / "scene.yaml",
            directory,
            arguments,
            resume=True,
            threads=arguments.threads,
            ranks=arguments.ranks,
        )
    folder = open_folder(directory)
    if arguments.threads is not None:
        given = f"--threads {arguments.threads}"
        msg = f"{given}: is for one run, and {directory} is a sweep, of runs of one thread; leave it out"
        raise InputError(msg)
    if queue:
        if arguments.submit == "slurm":
            require_sbatch()
        return queueing.enqueue(folder, arguments)
    if arguments.submit == "none":
        msg = "--submit none: needs --cluster NAME, for which the script is written; see `smarticles resume --help`"
        raise InputError(msg)
    return complete_and_tell(folder, arguments)
