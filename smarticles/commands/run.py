"""run: one scene into one run directory."""

from __future__ import annotations

import argparse
from pathlib import Path

from smarticles.parsing import Commands, add_engine, add_ranks, add_scene, engine_settings, positive_int
from smarticles.scenes import run_here


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
    add_scene(run)
    add_engine(run, "what computes it, instead of what the scene says")
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


def run_scene(arguments: argparse.Namespace) -> int:
    """`smarticles run`."""
    return run_here(
        arguments.scene,
        arguments.out,
        arguments,
        settings=engine_settings(arguments),
        resume=arguments.resume,
        threads=arguments.threads,
        ranks=arguments.ranks,
    )
