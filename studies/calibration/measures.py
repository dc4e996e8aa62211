"""Check the measures and variables of a calibration's data before any run is computed."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from dem.errors import InputError, nearest
from dem.plan.effects import decide
from dem.record.run import Run
from dem.run.run import manifest
from dem.scene.scene import Scene
from postprocess.measures.table import columns_of
from studies.calibration.problem import CONDITION, Problem
from studies.calibration.simulators import column_and_phase


def check_measures(problem: Problem) -> None:
    """Raise InputError unless the runs of all conditions will have the measures of the data.

    The scenes at both ends of all priors are checked, too.
    """
    # The last wave has all conditions.
    _, points = problem.sweep(problem.content.waves, np.stack(problem.bounds))
    scenes = {point.values[CONDITION]: point.scene for point in points}
    known: dict[tuple[int, int], list[str]] = {}
    for datum in problem.data:
        scene, where = scenes[datum.condition], f"{problem.path.parent / problem.content.data}"
        column, phase = column_and_phase(datum.measure, [one.kind for one in scene.phases], where)
        kind = scene.phases[phase].kind
        if phase and scene.phases[phase].known_duration == 0:
            raise InputError(
                f"{where}: measure {datum.measure!r}: phase {phase}, {kind}, takes no time and has no frame; give the "
                f"phase before, @ {phase - 1}"
            )
        key = datum.condition, phase
        if key not in known:
            known[key] = columns_of_scene(scene, phase)
        if column not in known[key]:
            raise InputError(
                f"{where}: measure {datum.measure!r}: runs will have no column {column!r} in phase {phase}, "
                f"{kind}; {nearest(column, known[key])}"
            )


def columns_of_scene(scene: Scene, phase: int) -> list[str]:
    """Return the columns that `smarticles measure` will have for a phase of a run of a scene."""
    run = Run(Path(scene.name))
    # `Run` reads its parts at the first access and keeps them here; this run has no files yet.
    planned = manifest(scene, run.path, steps=[1.0] * len(scene.phases), command="", made_by=("", ""), threads=1)
    vars(run).update(manifest=planned, forces=() if scene.recording.contact_forces else None)
    recorded: Mapping[str, None] = dict.fromkeys(name for effect in decide(scene) for name in effect.adds.series)
    return columns_of(run, phase, tuple(recorded))
