"""What is measured of each run of the study `engines`: a few numbers, by the case that the scene's name tells.

Each case is measured as the study that it is a small scene of measures it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

from dem.errors import InputError
from dem.record.manifest import RunManifest
from dem.record.series import read_series
from postprocess.measures import strain
from postprocess.measures.collapse import REMAINING, collapse_of, column_history, vibration
from postprocess.measures.pull import PULL, peak, read_pull, weight_of_one
from postprocess.statistics.columns import ASPECT, SEED
from studies.framework.activity import ENERGY, HEIGHT, PHI_ACTIVE, procedure_row
from studies.framework.procedures import CROSSINGS, EXTERNAL, INTERNAL, PHI, SHAPE, STATIC
from studies.framework.runs import ENGINE

CASE, VARIANT = "case", "variant"
HOOK, COLLAPSE, CHAIN = "hook", "collapse", "chain"
ACTIVE = (EXTERNAL, SHAPE, INTERNAL)
CASES = (*ACTIVE, HOOK, COLLAPSE, CHAIN)

PHI_0, CROSSINGS_0 = f"{STATIC} {PHI}", f"{STATIC} {CROSSINGS}"
PEAK, TAU, FORCE = "peak force over n W_s [-]", "tau [s]", "peak force [N]"
COLUMNS: Mapping[str, str] = MappingProxyType(
    {
        PHI_0: "packing fraction at rest after the pour",
        CROSSINGS_0: "⟨N⟩ at rest after the pour",
        PHI_ACTIVE: "packing fraction at the end of the activity, in motion",
        PHI: "packing fraction at rest after the activity",
        CROSSINGS: "⟨N⟩ at rest after the activity",
        HEIGHT: "height of the centre of mass at rest after the activity, over that before it",
        ENERGY: "work of the motors, or of the shaken container, on the smarticles",
        PEAK: "largest force that raises the hook, over the weight of all smarticles",
        TAU: "time in which a free column on a shaking floor collapses, by those that remain; empty where it stood",
        FORCE: "largest force of the string that pulls the chain",
    }
)
"""What is measured: columns of the table of runs; those that a case does not have are empty."""


def engines_row(run: RunManifest) -> dict[str, object]:
    """One run's row of the table of runs.

    Raises:
        InputError: It is no run of this study, or cannot be read.
    """
    case, slash, variant = run.name.partition("/")
    if not slash or case not in CASES:
        msg = f"{run.directory}: the scene's name is {run.name!r}, not CASE/VARIANT; give runs of the study engines"
        raise InputError(msg)
    found = dict.fromkeys(COLUMNS, math.nan) | _measured(run, case)
    return {
        CASE: case,
        VARIANT: variant,
        ENGINE: run.engine,
        ASPECT: round(run.aspect_ratio, 6),
        SEED: run.seed,
        "smarticles [-]": run.count,
        "fidelity": run.fidelity,
        **found,
        "processor time [s]": sum(phase.cpu_time or math.nan for phase in run.phases),
        "simulated [s]": run.end_time,
        "scene_sha256": run.scene_sha256,
        "run": run.directory.name,
    }


def _measured(run: RunManifest, case: str) -> dict[str, float]:
    if case == CHAIN:
        return {FORCE: strain.measured(strain.read_strain_test(run))[strain.PEAK]}
    if case == COLLAPSE:
        shaken = vibration(run)
        return {TAU: collapse_of(column_history(run, REMAINING, shaken), REMAINING, shaken).time}
    if case == HOOK:
        pulled = run.phases[-1]
        if pulled.type != PULL:
            msg = f"{run.directory}: ends with {pulled.type}, not {PULL}; give runs of the study engines"
            raise InputError(msg)
        force = peak(read_pull(run, read_series(run.directory), pulled.index)).force
        return {PEAK: force / run.count / weight_of_one(run)}
    row = procedure_row(run)
    names = (PHI_0, CROSSINGS_0, PHI_ACTIVE, PHI, CROSSINGS, HEIGHT, ENERGY)
    return {name: float(str(row[name])) for name in names}
