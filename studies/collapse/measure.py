"""What is measured of each run of the study `collapse`: the collapse time by each definition of the column's height."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import pandas as pd

from dem.record.manifest import RunManifest
from postprocess.statistics.columns import ASPECT, SEED
from studies.base.collapse.collapse_time import CollapseTime
from studies.base.collapse.column import (
    COM,
    DEFINITIONS,
    REMAINING,
    collapse_of,
    column_history,
    height_with_the_wall,
    vibration,
)
from studies.framework.runs import duration

GAMMA, FREQUENCY, WATCHED = "peak acceleration [g]", "frequency [Hz]", "time vibrated [s]"
RADIUS, HEIGHT_BEFORE = "container radius [m]", "com height before vibration [m]"
HEIGHT_WITH, STANDS = "com height with the wall [m]", "within the radius before vibration [-]"
DEFINITION, OUTCOME, TIME, TIME_ERROR, BOUND = "definition", "outcome", "tau [s]", "tau SE in run [s]", "tau above [s]"
LOG, DELTA = "ln(f tau) [-]", "Delta of the run [-]"

COLUMNS: Mapping[str, str] = MappingProxyType(
    {
        OUTCOME: "collapsed: τ was seen; collapsing or standing: it is beyond the time watched, a bound",
        TIME: "collapse time of the fit; empty where it was not seen",
        TIME_ERROR: "standard error of the fit",
        BOUND: "what τ is not below, where it was not seen",
        "beta [-]": "exponent of the stretched exponential",
        "start [-]": "height that the fit starts from, over that before vibration",
        "end [-]": "height that it goes to",
        "fall [-]": "share of the height that the fit loses while it is watched",
        LOG: "of τ, or of the bound",
        DELTA: "Γ ln(fτ), or a bound",
    }
)
"""What is known of the collapse of a run by one definition."""


def collapse_rows(run: RunManifest) -> list[dict[str, object]]:
    """The rows of one run, one for each definition of the height.

    Args:
        run: A finished run.

    Raises:
        InputError: It is not a column that was shaken after its wall was taken away, or cannot be read.
    """
    shaken = vibration(run)
    histories = {name: column_history(run, name, shaken) for name in DEFINITIONS}
    what: dict[str, object] = {
        ASPECT: round(run.aspect_ratio, 6),
        GAMMA: shaken.acceleration,
        SEED: run.seed,
        FREQUENCY: shaken.frequency,
        WATCHED: duration(shaken.phase),
        "smarticles [-]": run.count,
        RADIUS: run.container_radius,
        HEIGHT_WITH: height_with_the_wall(run),
        HEIGHT_BEFORE: histories[COM].before,
        STANDS: histories[REMAINING].before,
        "fidelity": run.fidelity,
    }
    ending = {"scene_sha256": run.scene_sha256, "run": run.directory.name}
    rows = []
    for name, history in histories.items():
        found = collapse_of(history, name, shaken)
        rows.append(what | {DEFINITION: name} | _told(found, shaken.acceleration, shaken.frequency) | ending)
    return rows


def _told(found: CollapseTime, acceleration: float, frequency: float) -> dict[str, object]:
    known = found.time if math.isfinite(found.time) else found.bound
    # A time below a period has a negative logarithm, which is as good as any.
    logarithm = math.log(frequency * known)
    values = (
        found.outcome,
        found.time,
        found.error,
        found.bound,
        found.exponent,
        found.start,
        found.end,
        found.fall,
        logarithm,
        acceleration * logarithm,
    )
    return dict(zip(COLUMNS, values, strict=True))


def is_seen(rows: pd.DataFrame) -> pd.Series:
    """Whether the collapse time of each row was seen, and is no bound."""
    seen: pd.Series = np.isfinite(rows[TIME])
    return seen
