"""accuracy: what accuracy costs in time, measured on variants of one scene."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from dem.errors import InputError
from smarticles.command_line import Commands, add_scene, add_shared, columns, positive_number, scene_settings
from smarticles.commands.study import compute_and_analyse
from smarticles.sweeps import expected_wall_s, folder_of

if TYPE_CHECKING:
    from studies.accuracy import Ladder


def add(commands: Commands) -> None:
    """Add the command."""
    accuracy = commands.add(
        "accuracy",
        run_accuracy,
        summary="what accuracy costs in time: one scene at several settings of each knob",
        text="""
Makes variants of a scene, each with one knob turned, several seeds each, runs them and prints errors
against wall time. Knobs:

  time-step    time step over the stable one: 0.9, 0.45, 0.225
  stiffness    of contacts: ×1, ×2, ×4; the time step follows. On links 125 to 4000 N/m
  section      spheres that stand for it: pitch 1.3, 1.0, 0.5, and two rows; finer yet for a scene of two rows.
               On links one, two and three strands
  restitution  0.2, 0.5, 0.7, 0.9: a property of the material, so a sensitivity and no accuracy
  control      time between two control updates of the motors: 4e-4, 2e-4, 1e-4 s; scenes that actuate
  hinge        stiffness of the hinges' pins: ×1, ×2, ×4; scenes that actuate, on YADE alone
  fidelity     draft, standard, reference; on links also what is finer yet, converged
  engine       the named fidelities of both engines, against converged on links; only if named in --knobs

The scene itself is a setting of every knob and runs once. The reference of a knob is its finest
setting with finished runs. An error within the scatter between seeds is not resolved, which is not
the same as none: more seeds narrow it, and the same command with more --seeds runs only these.

DIR gets the runs, and results/ with table, figure and advice; its work_precision.csv is what
`smarticles plan --max-error --table` reads. Ctrl-C stops; the same command again goes on.
`smarticles status DIR` shows how far it is.""",
        examples="""\
  smarticles accuracy scene.yaml --out ladder --dry-run
  smarticles accuracy scene.yaml --out ladder
  smarticles accuracy scene.yaml --out ladder --knobs fidelity --seeds 1,2,3,4,5
  smarticles accuracy scene.yaml --out ladder --max-run-hours 1     leave out what takes longer
  smarticles accuracy scene.yaml --out ladder --analyse             what the finished runs say so far
""",
    )
    add_scene(accuracy, "run the whole ladder on this engine instead of what the scene says")
    accuracy.add_argument("--out", type=Path, metavar="DIR", help="directory of the ladder")
    accuracy.add_argument(
        "--seeds", metavar="1,2,…", help="seeds of each setting, also as 1-20; default: 1,2,3, and 1-20 on links"
    )
    accuracy.add_argument("--knobs", metavar="NAME,…", help="knobs to turn; default: all that the scene calls for")
    accuracy.add_argument(
        "--max-run-hours",
        type=positive_number,
        metavar="H",
        help="leave out settings whose run is expected to take longer [h]; default: none",
    )
    accuracy.add_argument(
        "--dry-run", action="store_true", help="show the ladder and its expected hours, write nothing"
    )
    accuracy.add_argument("--analyse", action="store_true", help="start no run, analyse those that are finished")
    add_shared(accuracy, "--jobs")


def run_accuracy(arguments: argparse.Namespace) -> int:
    """Show a ladder; run and analyse it."""
    from dem.scene.reading import load_scene  # noqa: PLC0415
    from studies.accuracy import (  # noqa: PLC0415
        BASE,
        affordable,
        build_ladder,
        default_seeds,
        ladder_sweep,
        parse_knobs,
        parse_seeds,
        study,
    )
    from templates.sweep.expand import expand  # noqa: PLC0415

    seeds = None if arguments.seeds is None else parse_seeds(arguments.seeds)
    knobs = None if arguments.knobs is None else parse_knobs(arguments.knobs)
    scene = load_scene(arguments.scene, scene_settings(arguments))
    ladder = build_ladder(scene, source=str(arguments.scene), knobs=knobs)
    expected_s = {setting: expected_wall_s(one) for setting, one in ladder.scenes.items()}
    if arguments.max_run_hours is not None:
        ladder = affordable(ladder, expected_s, 3600 * arguments.max_run_hours)
    seeds = seeds or default_seeds(scene)
    sweep = ladder_sweep(scene, ladder, seeds)
    points = expand(sweep)
    if not arguments.dry_run and arguments.out is None:
        raise InputError("accuracy: --out DIR is missing; give a directory, or --dry-run to only show the ladder")
    print(_listing(ladder, expected_s, len(seeds), arguments.jobs), flush=True)
    if len(seeds) < 2:
        warning = "one seed has no scatter, so nothing can be resolved; give --seeds 1,2,3"
        print(f"smarticles: warning: {warning}", file=sys.stderr)
    if arguments.dry_run:
        return 0
    folder = folder_of(sweep, points, arguments.out, arguments.command_line, extend=True)
    left_out = f"; left out: {'; '.join(ladder.left_out)}" if ladder.left_out else ""
    return compute_and_analyse(
        folder,
        arguments,
        partial(study, ladder.rungs, {entry.name: entry.expected_s for entry in folder.entries}),
        note=f"knobs {', '.join(ladder.knobs)} of {arguments.scene}{left_out}",
        pictured={"setting": BASE},
    )


def _listing(ladder: Ladder, expected_s: Mapping[str, float], seeds: int, jobs: int | None) -> str:
    """Return the ladder as a table, and the wall time that it is expected to take."""
    from dem.engine.cores import usable_cores  # noqa: PLC0415
    from dem.plan.outlook import plan  # noqa: PLC0415

    references = ladder.references()
    rows = []
    for rung in ladder.rungs:
        planned = plan(ladder.scenes[rung.setting])
        own = "reference" if references[rung.knob] == rung else ""
        section = f"{planned.strands} strands" if planned.strands else f"{planned.spheres_per_smarticle} spheres"
        shape = [planned.time_step_s, section]
        rows.append([rung.knob, rung.label, rung.setting, own, *shape, round(expected_s[rung.setting])])
    header = ["knob", "value", "setting", "", "time step s", "section", "expected wall s"]
    runs = seeds * len(ladder.settings)
    hours = seeds * sum(expected_s[setting] for setting in ladder.settings) / 3600
    slots = min(jobs or usable_cores(), runs)
    return "\n".join(
        [
            columns(header, rows),
            *(f"left out: {line}" for line in ladder.left_out),
            f"{len(ladder.settings)} settings × {seeds} seeds = {runs} runs, about {hours:.2g} h of one core, "
            f"{hours / slots:.2g} h or more with {slots} at once",
        ]
    )
