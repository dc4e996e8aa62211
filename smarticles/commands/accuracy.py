"""Command `accuracy`: measure error against wall time for variants of one scene."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING

from dem.errors import InputError
from dem.terminal import say, warn
from smarticles.command_line import Commands, add_options, columns, positive_number, scene_settings
from smarticles.commands.study import compute_and_analyse
from smarticles.sweeps import expected_wall_s, folder_of

if TYPE_CHECKING:
    from studies.accuracy import Ladder


def add(commands: Commands) -> None:
    """Add `accuracy` to the command line."""
    accuracy = commands.add(
        "accuracy",
        run_accuracy,
        summary="measure error against wall time: one scene at several values of each parameter",
        text="""
Runs variants of a scene, the *ladder*. Each variant changes one numerical parameter, and is run with
several seeds. The output compares errors with wall times. Parameters:

  time-step    time step over the stable time step: 0.9, 0.45, 0.225
  stiffness    contact stiffness: ×1, ×2, ×4, with the time step that it requires; on links 125 to 4000 N/m
  section      spheres that represent the section of a link: pitch 1.3, 1.0, 0.5, and two rows; on links one,
               two and three strands
  restitution  0.2, 0.5, 0.7, 0.9; a property of the material, so this is a sensitivity, not an error
  control      time between two control updates of the motors: 4e-4, 2e-4, 1e-4 s; scenes that actuate
  hinge        stiffness of the hinges' pins: ×1, ×2, ×4; scenes that actuate, on YADE alone
  fidelity     draft, standard, reference; on links also converged, which is finer
  engine       the named fidelities of links and YADE against converged on links; only if named in --parameters

The unchanged scene is one setting of every parameter and is run once. The reference of a parameter is its finest
setting with finished runs. An error smaller than the scatter between seeds is reported as not resolved;
more seeds reduce the scatter. If the command is repeated with more --seeds, only the new runs start.

DIR gets the runs, and DIR/results a table, a figure and advice. `smarticles plan --max-error --table`
reads the table work_precision.csv. Ctrl-C stops; repeat the command to continue. `smarticles status DIR`
prints the progress.""",
        examples="""\
  smarticles accuracy scene.yaml --out ladder --dry-run
  smarticles accuracy scene.yaml --out ladder
  smarticles accuracy scene.yaml --out ladder --parameters fidelity --seeds 1,2,3,4,5
  smarticles accuracy scene.yaml --out ladder --max-run-hours 1     omit slower settings
  smarticles accuracy scene.yaml --out ladder --analyse             analyse the finished runs
""",
    )
    add_options(accuracy, "scene", "--set", "--engine")
    add_options(accuracy, "--out", help="directory of the ladder")
    accuracy.add_argument(
        "--seeds", metavar="1,2,…", help="seeds of each setting, e.g. 1,2,5 or 1-20; default: 1,2,3, on links 1-20"
    )
    accuracy.add_argument(
        "--parameters",
        "--knobs",  # the name of earlier versions, in commands of published results
        dest="knobs",
        metavar="NAME,…",
        help="parameters to change; default: all that affect the scene",
    )
    accuracy.add_argument(
        "--max-run-hours",
        type=positive_number,
        metavar="H",
        help="omit settings with a longer expected wall time of one run [h]; default: no limit",
    )
    add_options(accuracy, "--dry-run", help="print the ladder and its expected wall time; write nothing")
    add_options(accuracy, "--analyse", "--jobs")


def run_accuracy(arguments: argparse.Namespace) -> int:
    """Print the variants of a scene, compute missing runs, analyse all runs; return the exit status."""
    from dem.scene.reading import load_scene  # noqa: PLC0415
    from studies import accuracy  # noqa: PLC0415
    from templates.sweep.expand import expand  # noqa: PLC0415

    seeds = None if arguments.seeds is None else accuracy.parse_seeds(arguments.seeds)
    knobs = None if arguments.knobs is None else accuracy.parse_knobs(arguments.knobs)
    # Before the ladder, which can take seconds.
    if not arguments.dry_run and arguments.out is None:
        raise InputError("accuracy: --out DIR is missing; give a directory, or --dry-run to only show the ladder")
    scene = load_scene(arguments.scene, scene_settings(arguments))
    ladder = accuracy.build_ladder(scene, source=str(arguments.scene), knobs=knobs)
    expected_s = {setting: expected_wall_s(variant) for setting, variant in ladder.scenes.items()}
    if arguments.max_run_hours is not None:
        ladder = accuracy.affordable(ladder, expected_s, 3600 * arguments.max_run_hours)
    seeds = seeds or accuracy.default_seeds(scene)
    sweep = accuracy.ladder_sweep(scene, ladder, seeds)
    points = expand(sweep)
    say(_listing(ladder, expected_s, len(seeds), arguments.jobs))
    if len(seeds) < 2:
        warn("the scatter is unknown with one seed, so that no error can be resolved; give --seeds 1,2,3")
    if arguments.dry_run:
        return 0
    folder = folder_of(sweep, points, arguments.out, arguments.command_line, extend=True)
    left_out = f"; left out: {'; '.join(ladder.left_out)}" if ladder.left_out else ""
    return compute_and_analyse(
        folder,
        arguments,
        partial(accuracy.study, ladder.rungs, {entry.name: entry.expected_s for entry in folder.entries}),
        note=f"parameters {', '.join(ladder.knobs)} of {arguments.scene}{left_out}",
        pictured={"setting": accuracy.BASE},
    )


def _listing(ladder: Ladder, expected_s: Mapping[str, float], seeds: int, jobs: int | None) -> str:
    """Return a table of the variants, with the expected wall time of one run [s] and of all runs [h]."""
    from dem.engine.cores import usable_cores  # noqa: PLC0415
    from dem.plan.outlook import plan  # noqa: PLC0415

    references = ladder.references()
    rows = []
    for rung in ladder.rungs:
        planned = plan(ladder.scenes[rung.setting])
        note = "reference" if references[rung.knob] == rung else ""
        section = f"{planned.most_strands} strands" if planned.strands else f"{planned.spheres_per_smarticle} spheres"
        shape = [planned.time_step_s, section]
        rows.append([rung.knob, rung.label, rung.setting, note, *shape, round(expected_s[rung.setting])])
    header = ["parameter", "value", "setting", "", "time step s", "section", "expected wall s"]
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
