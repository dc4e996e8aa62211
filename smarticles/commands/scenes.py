"""run, plan, schema, doctor: one scene, and what it needs."""

from __future__ import annotations

import argparse
import json
import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from dem.errors import InputError
from smarticles.parsing import Commands, Parser, add_json, positive_int, positive_number
from smarticles.stopping import TO_BE_CONTINUED

if TYPE_CHECKING:
    from dem.plan.choice import Choice
    from dem.scene.scene import Scene


def add(commands: Commands) -> None:
    """Add the commands."""
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
  smarticles run scene.yaml --out runs/a --resume
""",
    )
    add_scene(run)
    run.add_argument("--out", type=Path, required=True, metavar="DIR", help="new run directory")
    run.add_argument(
        "--resume",
        action="store_true",
        help="go on in DIR, which holds an unfinished run of this scene, from its last checkpoint",
    )
    run.add_argument(
        "--threads",
        type=positive_int,
        default=1,
        metavar="N",
        help="threads of YADE; default 1, whatever OMP_NUM_THREADS says: with more, two runs differ in their last "
        "bits, and threads that find no free core make a run many times slower",
    )

    plan = commands.add(
        "plan",
        plan_scene,
        summary="what a run would do and cost; simulates nothing",
        text="""
Shows the phases, what acts in each and why, time step, spheres and the expected wall time.

With --max-error, --max-hours or both, the fidelity is chosen instead of the scene's own: the cheapest
whose measured error of the packing fractions φ_0 and φ_f (or of what --of says) is within the one, or
the finest within the other. What was measured stands in a table that `smarticles accuracy` writes.""",
        examples="""\
  smarticles plan scene.yaml
  smarticles plan scene.yaml --set fidelity=reference
  smarticles plan scene.yaml --json | jq .time_step_s
  smarticles plan scene.yaml --max-error 0.03 --table accuracy/results/work_precision.csv
  smarticles plan scene.yaml --max-hours 4
""",
    )
    add_scene(plan)
    plan.add_argument(
        "--max-error",
        type=positive_number,
        metavar="E",
        help="largest relative error against the reference fidelity, e.g. 0.03",
    )
    plan.add_argument(
        "--of",
        metavar="NAME,…",
        help="what --max-error is of: phi_0, phi_f, crossings (⟨N⟩); default: phi_0,phi_f",
    )
    plan.add_argument("--max-hours", type=positive_number, metavar="H", help="wall time of the run on one core [h]")
    plan.add_argument(
        "--table", type=Path, metavar="FILE.csv", help="measured errors; default: those that ship, if any do"
    )
    add_json(plan)

    commands.add(
        "schema",
        print_schema,
        summary="print the JSON schema of scene files",
        text="""
Every key with its unit, default and meaning. Editors use it to complete and check scenes: put
`# yaml-language-server: $schema=scene.schema.json` on the first line of a scene.""",
        examples="""\
  smarticles schema > scene.schema.json
""",
    )

    doctor = commands.add(
        "doctor",
        examine,
        summary="what of YADE, PyVista, Slurm … is installed and works",
        text="""
Tries each part instead of only looking for it. Exit status 1 if something that a run needs fails,
with the way out.""",
        examples="""\
  smarticles doctor
  smarticles doctor --json
""",
    )
    add_json(doctor)


def add_scene(parser: Parser) -> None:
    """Add the scene and --set."""
    parser.add_argument("scene", type=Path, metavar="SCENE.yaml", help="scene file")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change one key of the scene, e.g. phases.1.duration_s=2; may be repeated",
    )


def run_scene(arguments: argparse.Namespace) -> int:
    """`smarticles run`."""
    return compute(
        arguments.scene,
        arguments.out,
        arguments,
        settings=arguments.set,
        resume=arguments.resume,
        threads=arguments.threads,
    )


def compute(
    scene_file: Path,
    out: Path,
    arguments: argparse.Namespace,
    *,
    settings: Sequence[str] = (),
    resume: bool,
    threads: int = 1,
) -> int:
    """Run a scene in this process.

    Args:
        scene_file: the scene.
        out: the run directory.
        arguments: of the command, for the manifest.
        settings: keys that differ from the file, `KEY=VALUE`.
        resume: go on in a run directory that holds an unfinished run.
        threads: of the engine; only one gives the same bits again.

    Returns:
        Exit status: 0, or 75 where SIGUSR1 stopped the run at a checkpoint.

    Raises:
        InputError: the scene is not valid, or the directory holds something else.
        RunError: the run failed.
        KeyboardInterrupt: it was stopped; the message says how to go on.
    """
    scene = _load(scene_file, settings)
    # YADE reads it when it is loaded, and a batch system may have set it to all cores of the node.
    os.environ["OMP_NUM_THREADS"] = str(threads)
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


def _load(scene_file: Path, settings: Sequence[str]) -> Scene:
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


def plan_scene(arguments: argparse.Namespace) -> int:
    """`smarticles plan`."""
    from dem.plan.outlook import plan  # noqa: PLC0415

    scene = _load(arguments.scene, arguments.set)
    choice = _chosen(scene, arguments)
    planned = plan(scene) if choice is None else choice.planned
    if arguments.json:
        content = planned.to_dict() | ({} if choice is None else {"choice": choice.to_dict()})
        print(json.dumps(content, indent=2, ensure_ascii=False))
        return 0
    if choice is not None:
        print(f"{choice.to_text()}\n")
    print(planned.to_text())
    return 0


def _chosen(scene: Scene, arguments: argparse.Namespace) -> Choice | None:
    """The fidelity that --max-error and --max-hours ask for; None without them."""
    from dem.plan.choice import PACKING, QUANTITIES, choose, read_table  # noqa: PLC0415

    if arguments.max_error is None and arguments.max_hours is None:
        for option, value in (("--table", arguments.table), ("--of", arguments.of)):
            if value is not None:
                msg = f"{option} {value}: is for --max-error or --max-hours; give one of them"
                raise InputError(msg)
        return None
    of = PACKING if arguments.of is None else tuple(word.strip() for word in arguments.of.split(","))
    for word in of:
        if word not in QUANTITIES:
            msg = f"--of {arguments.of}: {word!r} is not measured; known: {', '.join(QUANTITIES)}"
            raise InputError(msg)
    return choose(
        scene, read_table(arguments.table, of=of), max_error=arguments.max_error, max_hours=arguments.max_hours
    )


def print_schema(_: argparse.Namespace) -> int:
    """`smarticles schema`."""
    from dem.scene.reading import json_schema  # noqa: PLC0415

    print(json.dumps(json_schema(), indent=2, ensure_ascii=False))
    return 0


def examine(arguments: argparse.Namespace) -> int:
    """`smarticles doctor`."""
    from smarticles.doctor import doctor  # noqa: PLC0415

    return doctor(arguments.json)
