"""One row per run of the study `friction`: φ before, in the course of, at the end of and after shaking."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dem.errors import InputError
from dem.record.manifest import RunManifest
from postprocess.scene_file import Settings, read_scene
from postprocess.statistics.columns import ASPECT
from studies.framework.plots import History
from studies.framework.provenance import SHAKE_TIME
from studies.framework.runs import DEFINITION, Collected, MeasuredRun, told_seeds
from studies.framework.shaken import measured_row, packing_history, told_shaken

FRICTION = "friction [-]"

TIMES = (5.0, 10.0, 20.0)
"""When φ is taken in the course of shaking [s]."""

_TIME, _PHI, _SHAKEN = "time [s]", "phi [-]", "shaken [s]"

WINDOW = 1.0
"""Over how long before those times it is averaged [s]: 30 periods of shaking."""

COMPARED: Mapping[str, str] = MappingProxyType(
    {
        "phi_0": "phi_0",
        "phi 5 s": "phi_f",
        "phi 10 s": "phi_f",
        "phi_f": "phi_f",
        "phi_f relaxed": "phi_f relaxed",
    }
)
"""What is set against Gravish, and as which of their stages: φ after 5 and 10 s as if they had shaken no longer."""


def column(stage: str) -> str:
    """Column of φ at a stage."""
    return f"{stage} {DEFINITION} [-]"


def at_time(time: float) -> str:
    """What φ after some time of shaking [s] is called."""
    return f"phi {time:g} s"


def friction_run(run: RunManifest) -> MeasuredRun:
    """φ by stage, and its history.

    Raises:
        InputError: It was not shaken after another phase, its walls have another friction than its smarticles, or it
            cannot be read.
    """
    return shaken_run(run, {FRICTION: _friction(run)})


def shaken_run(run: RunManifest, known: Mapping[str, object]) -> MeasuredRun:
    """φ by stage and in the course of shaking, and its history.

    Args:
        run: A finished run.
        known: Further columns of its row.

    Raises:
        InputError: It was not shaken after another phase, or cannot be read.
    """
    history = packing_history(run)
    row = {**known, **measured_row(run, [DEFINITION])}
    for time in TIMES:
        if time <= history.active + 1e-6:
            row[column(at_time(time))] = _around(history, time)
    return MeasuredRun(manifest=run, rows=[{ASPECT: row.pop(ASPECT), **row}], history=_told(history))


def _told(history: History) -> dict[str, NDArray[np.float64]]:
    """A history as the arrays of a measured run."""
    return {_TIME: history.times, _PHI: history.values, _SHAKEN: np.array([history.active])}


def history_of(run: MeasuredRun) -> History:
    """φ of a measured run since shaking began."""
    told = run.history
    return History(times=told[_TIME], values=told[_PHI], active=float(told[_SHAKEN][0]))


def while_shaken(run: MeasuredRun) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times since shaking began [s] and φ [-] of a measured run, as long as it was shaken."""
    history = history_of(run)
    shaken = (history.times > 0) & (history.times <= history.active)
    return history.times[shaken], history.values[shaken]


def refuse_repeats(found: Collected) -> None:
    """Refuses other numbers of smarticles at one l/w, and a point's runs with the same seed.

    Raises:
        InputError: There are such.
    """
    found.refuse_mixed_counts()
    found.refuse_repeats("point", lambda run: f"l/w {run.manifest.aspect_ratio:g} friction {run.row[FRICTION]:g}")


def told_piles(runs: pd.DataFrame, varied: Sequence[str], point: str) -> str:
    """Which aspect ratios, seeds and times of shaking runs have, for footers.

    Args:
        runs: The table of runs.
        varied: Columns that tell points of one aspect ratio apart.
        point: What a point is called.
    """
    counts = runs.groupby([ASPECT, *varied]).size()
    ratios = " ".join(f"{value:g}" for value in sorted(runs[ASPECT].unique()))
    seeds = told_seeds(runs, counts, point)
    return f"l/w {ratios}, {seeds}; shaken for {told_shaken(runs)} (Gravish: {SHAKE_TIME:g} s)"


def contact_of(run: RunManifest, study: str) -> Settings:
    """What the scene of a run says of its contacts.

    Args:
        run: The run.
        study: Whose runs say it.

    Raises:
        InputError: It says nothing.
    """
    contact = read_scene(run.directory).part("contact")
    if contact is None:
        msg = f"{run.directory}: scene.yaml tells no contact; give runs of the study {study}"
        raise InputError(msg)
    return contact


def _friction(run: RunManifest) -> float:
    """The one coefficient of friction of a run [-]."""
    contact = contact_of(run, "friction")
    between, wall = contact.number("friction_smarticle"), contact.number("friction_wall")
    if between != wall:
        msg = (
            f"{run.directory}: friction is {between:g} between smarticles and {wall:g} at walls; "
            "the study friction has one for both"
        )
        raise InputError(msg)
    return between


def _around(history: History, time: float) -> float:
    """Mean over `WINDOW` up to a time [s] of shaking; NaN where nothing was recorded."""
    shown = (history.times > time - WINDOW) & (history.times <= time + 1e-6)
    return float(np.mean(history.values[shown])) if shown.any() else float("nan")
