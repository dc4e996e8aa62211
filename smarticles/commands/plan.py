"""Command `plan`: print what a run would compute and cost."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from typing import TYPE_CHECKING

from dem.errors import InputError
from dem.terminal import say
from smarticles.command_line import Commands, add_options, as_json, names, positive_number, scene_settings
from smarticles.commands.run import read_scene

if TYPE_CHECKING:
    from dem.plan.choice import Choice
    from dem.scene.scene import Scene


def add(commands: Commands) -> None:
    """Add `plan` to the command line."""
    plan = commands.add(
        "plan",
        plan_scene,
        summary="print what a run would compute and cost; nothing is simulated",
        text="""
Prints the phases, the effects of each phase with their reasons, the time step, the number of spheres
and the expected wall time.

--max-error and --max-hours choose engine and fidelity. With --max-error, the cheapest choice is taken
whose measured error of the packing fractions φ_0 and φ_f (or of the quantities of --of) is below the
limit; with --max-hours alone, the most accurate choice within the wall time. --engine restricts the
choice to one engine. Errors are read from a table of `smarticles accuracy SCENE --parameters engine`.""",
        examples="""\
  smarticles plan scene.yaml
  smarticles plan scene.yaml --set fidelity=reference
  smarticles plan scene.yaml --engine links
  smarticles plan scene.yaml --json | jq .time_step_s
  smarticles plan scene.yaml --max-error 0.03 --table accuracy/results/work_precision.csv
  smarticles plan scene.yaml --max-hours 4
""",
    )
    add_options(plan, "scene", "--set", "--engine")
    plan.add_argument(
        "--max-error",
        type=positive_number,
        metavar="E",
        help="largest relative error against the reference of the table, e.g. 0.03",
    )
    plan.add_argument(
        "--of",
        type=names,
        metavar="NAME,…",
        help="quantities that --max-error limits: phi_0, phi_f, crossings (⟨N⟩); default: phi_0,phi_f",
    )
    plan.add_argument(
        "--max-hours", type=positive_number, metavar="H", help="largest wall time of the run on one core [h]"
    )
    add_options(plan, "--table", help="table of measured errors; default: the table that ships")
    add_options(plan, "--json")


def plan_scene(arguments: argparse.Namespace) -> int:
    """Print the plan of a scene; return the exit status."""
    from dem.plan.outlook import plan  # noqa: PLC0415

    scene = read_scene(arguments.scene, scene_settings(arguments))
    choice = _chosen(scene, arguments)
    planned = plan(scene) if choice is None else choice.planned
    if arguments.json:
        content = asdict(planned) | ({} if choice is None else {"choice": choice.to_dict()})
        print(as_json(content))
        return 0
    if choice is not None:
        say(f"{choice.to_text()}\n")
    say(planned.to_text())
    return 0


def _chosen(scene: Scene, arguments: argparse.Namespace) -> Choice | None:
    """Return the engine and fidelity that satisfy --max-error and --max-hours; None without these options."""
    from dem.plan.choice import PACKING, QUANTITIES, activity_of, choose, read_table  # noqa: PLC0415

    if arguments.max_error is None and arguments.max_hours is None:
        for option, value in (("--table", arguments.table), ("--of", arguments.of)):
            if value is not None:
                text = ",".join(value) if option == "--of" else value
                raise InputError(f"{option} {text}: needs --max-error or --max-hours; add one of them")
        return None
    of = PACKING if arguments.of is None else arguments.of
    for name in of:
        if name not in QUANTITIES:
            raise InputError(f"--of {','.join(of)}: {name!r} is not measured; known: {', '.join(QUANTITIES)}")
    return choose(
        scene,
        read_table(arguments.table, of=of, engine=arguments.engine, activity=activity_of(scene)),
        max_error=arguments.max_error,
        max_hours=arguments.max_hours,
    )
