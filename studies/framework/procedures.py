"""Procedures: what a pile goes through, the points of studies that compare them, and how they are compared."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import pandas as pd

from dem.errors import InputError
from dem.record.run import Run
from postprocess.statistics.points import mean_difference
from postprocess.statistics.seeds import SeedMean
from studies.framework.runs import DEFINITION

STATIC, EXTERNAL, SHAPE, INTERNAL = "static", "external", "shape-change", "internal"
PROCEDURES: Mapping[str, str] = MappingProxyType(
    {"shake": EXTERNAL, "shape-change": SHAPE, "internal-oscillation": INTERNAL}
)
"""Procedure of each type of activity."""

AMPLITUDE = 10.0
"""θ of the internal oscillation where procedures are compared, as in the paper [deg]."""

PROCEDURE, THETA, ACTIVE = "procedure", "theta [deg]", "time active [s]"
PHI, CROSSINGS = f"phi {DEFINITION} [-]", "crossings [-]"

BY_RANKS = "mean over seeds of the rank correlation of peak force and ⟨N⟩ > 0; what held fast is above all that did not"
"""Criterion by which the force that tears a pile goes with its entanglement."""


def prepared_by(run: Run, *then: str) -> str:
    """The procedure of a run: a pour, a rest, one activity with a rest of its own or none, and then some phases.

    Args:
        run: A run.
        then: Types of the phases that follow.

    Raises:
        InputError: The phases are others.
    """
    types = [phase.type for phase in run.phases]
    active = [kind for kind in types if kind in PROCEDURES]
    if types != ["deposit", "relax", *([active[0], "relax"] if active else []), *then]:
        msg = (
            f"{run.path}: its phases are {', '.join(types)}, not a pour, a rest, one activity "
            f"({', '.join(PROCEDURES)}) with a rest or none, {' and '.join(then)}"
        )
        raise InputError(msg)
    return PROCEDURES[active[0]] if active else STATIC


def of_procedure(table: pd.DataFrame, procedure: str) -> pd.DataFrame:
    """Samples of one procedure; of the internal oscillation those that procedures are compared at."""
    chosen = table[table[PROCEDURE] == procedure]
    return chosen[np.isclose(chosen[THETA], AMPLITUDE)] if procedure == INTERNAL and THETA in chosen else chosen


def paired(table: pd.DataFrame, quantity: str, one: str, other: str) -> SeedMean:
    """One procedure less another, mean over pairs of the same aspect ratio and seed."""
    return mean_difference(of_procedure(table, one), of_procedure(table, other), quantity)
