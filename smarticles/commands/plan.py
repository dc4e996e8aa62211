"""plan: what a run would do and cost."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from dem.errors import InputError
from smarticles.command_line import Commands, add_scene, add_shared, as_json, positive_number, scene_settings
from smarticles.commands.run import read_scene

if TYPE_CHECKING:
    from dem.plan.choice import Choice
    from dem.scene.scene import Scene


def add(commands: Commands) -> None:
    """Add the command."""
    plan = commands.add(
        "plan",
        plan_scene,
        summary="what a run would do and cost; simulates nothing",
        text="""
Shows the phases, what acts in each and why, time step, spheres and the expected wall time.

With --max-error, --max-hours or both, engine and fidelity are chosen instead of the scene's own: the
cheapest whose measured error of the packing fractions φ_0 and φ_f (or of what --of says) is within the
one, or the most exact within the other; with --engine, of that engine. What was measured stands in a
table that `smarticles accuracy SCENE --knobs engine` writes.""",
        examples="""\
  smarticles plan scene.yaml
  smarticles plan scene.yaml --set fidelity=reference
  smarticles plan scene.yaml --engine links
  smarticles plan scene.yaml --json | jq .time_step_s
  smarticles plan scene.yaml --max-error 0.03 --table accuracy/results/work_precision.csv
  smarticles plan scene.yaml --max-hours 4
""",
    )
    add_scene(plan, "plan it on this engine instead of what the scene says")
    plan.add_argument(
        "--max-error",
        type=positive_number,
        metavar="E",
        help="largest relative error against the reference of the table, e.g. 0.03",
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
    add_shared(plan, "--json")


def plan_scene(arguments: argparse.Namespace) -> int:
    """Print the plan of a scene."""
    from dem.plan.outlook import plan  # noqa: PLC0415

    scene = read_scene(arguments.scene, scene_settings(arguments))
    choice = _chosen(scene, arguments)
    planned = plan(scene) if choice is None else choice.planned
    if arguments.json:
        content = asdict(planned) | ({} if choice is None else {"choice": choice.to_dict()})
        print(as_json(content))
        return 0
    if choice is not None:
        print(f"{choice.to_text()}\n")
    print(planned.to_text())
    return 0


def _chosen(scene: Scene, arguments: argparse.Namespace) -> Choice | None:
    """Return the fidelity that --max-error and --max-hours ask for; None without them."""
    from dem.plan.choice import PACKING, QUANTITIES, choose, read_table  # noqa: PLC0415

    if arguments.max_error is None and arguments.max_hours is None:
        for option, value in (("--table", arguments.table), ("--of", arguments.of)):
            if value is not None:
                raise InputError(f"{option} {value}: is for --max-error or --max-hours; give one of them")
        return None
    of = PACKING if arguments.of is None else tuple(word.strip() for word in arguments.of.split(","))
    for word in of:
        if word not in QUANTITIES:
            raise InputError(f"--of {arguments.of}: {word!r} is not measured; known: {', '.join(QUANTITIES)}")
    return choose(
        scene,
        read_table(arguments.table, of=of, engine=arguments.engine),
        max_error=arguments.max_error,
        max_hours=arguments.max_hours,
    )
