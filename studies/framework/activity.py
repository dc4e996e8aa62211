"""What is measured of a run of one activity between two rests: studies `procedures` and `engines`; means over seeds.

A run is poured, rests, goes through one activity, and rests again. Both rests are averaged over their
frames: the first one is the static state of its aspect ratio and seed, the last one what the activity left.
φ_f is taken at the end of the activity, as the paper's own code does, and at rest again beside it: a shaken pile
bounces, and is looser while it does.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dem.errors import InputError
from dem.record.document import Phase
from dem.record.run import Run
from dem.record.series import Series
from postprocess.measures.motors import APART, SAMPLED_WORK
from postprocess.measures.table import PASSIVE_PHASES, summarise_run
from postprocess.statistics.points import ASPECT, SEED
from studies.framework.procedures import (
    ACTIVE,
    CROSSINGS,
    EXTERNAL,
    INTERNAL,
    PHI,
    PROCEDURE,
    PROCEDURES,
    SHAPE,
    STATIC,
    THETA,
)
from studies.framework.runs import DEFINITION, duration

PHI_ACTIVE = f"phi {DEFINITION} at the end of the activity [-]"
ENERGY = "energy per smarticle [J]"
SAMPLED = f"energy per smarticle sampled every {APART:g} s [J]"
HEIGHT, STRAIGHT, HALF = "com height over h0 [-]", "com height straight over h0 [-]", "half of compaction at [-]"
LOWEST = "lowest com height over h0 while closing [-]"
QUANTITIES: Mapping[str, str] = MappingProxyType(
    {
        PHI_ACTIVE: "packing fraction over the last frames of the activity, as the paper's φ_f; static: at rest",
        PHI: "packing fraction at rest: after the activity, or of the static state",
        CROSSINGS: "⟨N⟩ at rest: links of others through a smarticle's plane",
        ENERGY: "work of the motors, or of the shaken container, on the smarticles; static: none",
        SAMPLED: "of the motors, summed as torque times angle over moments so far apart, as the paper's code could",
        HEIGHT: "height of the centre of mass at rest after the activity, over that before it",
        STRAIGHT: "the same at the end of the straight state of the shape change",
        LOWEST: "the least of it, as a mean over 0.1 s, while barbs close in the shape change",
        HALF: "share of the activity after which half of the final compaction is reached; empty without any",
    }
)
"""What is averaged over seeds: columns of `samples`."""

_WORK = {EXTERNAL: "container_work_J", SHAPE: "motor_work_J", INTERNAL: "motor_work_J"}
_WINDOW = 0.1  # s: over which heights are averaged; more than a period of θ = 10° and three of shaking at 30 Hz


def activity(run: Run) -> Phase:
    """The one activity of a run.

    Raises:
        InputError: There is not exactly one of a known kind between two rests.
    """
    active = [phase for phase in run.phases if phase.type not in PASSIVE_PHASES]
    around = run.phases[active[0].index - 1 : active[0].index + 2] if active else ()
    if len(active) != 1 or active[0].type not in PROCEDURES or len(around) != 3 or around[2].type != "relax":
        types = ", ".join(phase.type for phase in run.phases)
        known = ", ".join(PROCEDURES)
        msg = f"{run.path}: not one activity ({known}) between two rests: its phases are {types}"
        raise InputError(msg)
    return active[0]


def procedure_row(run: Run) -> dict[str, object]:
    """One run's row of the table of runs.

    Args:
        run: A finished run.

    Raises:
        InputError: It is not one activity between two rests, or cannot be read.
    """
    active = activity(run)
    settings = run.scene["phases"][active.index]
    if settings["type"] != active.type:
        msg = f"{run.path}: phase {active.index} is {active.type} in run.json, {settings['type']} in scene.yaml"
        raise InputError(msg)
    procedure = PROCEDURES[active.type]
    wanted = range(active.index - 1, active.index + 2)
    table = summarise_run(run, definitions=[DEFINITION], phases=set(wanted))
    if len(table) != len(wanted):
        msg = f"{run.path}: no frame of its activity or of the rest before or after it; run it again"
        raise InputError(msg)
    before, during, after = (table.set_index("phase").loc[phase] for phase in wanted)
    row: dict[str, object] = {
        PROCEDURE: procedure,
        THETA: settings["theta_deg"] if procedure == INTERNAL else math.nan,
        ASPECT: round(run.manifest.aspect_ratio, 6),
        SEED: run.manifest.seed,
        "smarticles [-]": run.manifest.count,
        "fidelity": run.manifest.fidelity,
        ACTIVE: duration(active),
    }
    for name, rest in ((f"{STATIC} ", before), ("", after)):
        row[f"{name}{PHI}"] = rest[PHI]
        row[f"{name}{CROSSINGS}"] = rest["crossings mean [-]"]
    row[f"{STATIC} {PHI_ACTIVE}"] = before[PHI]
    row[PHI_ACTIVE] = during[PHI]
    row[f"phi {DEFINITION} SE in run [-]"] = after[f"phi {DEFINITION} SE [-]"]
    row["h0 [m]"] = before["com height [m]"]
    row[HEIGHT] = after["com height [m]"] / before["com height [m]"]
    straight_until = settings["opening_s"] + settings["straight_hold_s"] if procedure == SHAPE else None
    row |= _of_series(run, active, straight_until)
    row[SAMPLED] = during.get(SAMPLED_WORK, math.nan) / run.manifest.count
    row["escaped at the end [-]"] = after["escaped [-]"]
    row["frames averaged [-]"] = int(table["frames averaged"].min())
    row["scene_sha256"] = run.manifest.scene_sha256
    row["run"] = run.path.name
    return row


def height_history(run: Run) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """h/h0 of a run's centre of mass, (n,) [-], and its times since the activity began, (n,) [s].

    h0 is the mean over the rest before the activity, with which the history begins.

    Raises:
        InputError: There is no series of it.
    """
    return _heights(run.series, activity(run))


def _heights(series: Series, active: Phase) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    height = np.asarray(series["com_height_m"], dtype=np.float64)
    shown = (series["phase"] >= active.index - 1) & np.isfinite(height)
    before = shown & (series["phase"] == active.index - 1)
    if active.start_s is None or not before.any():
        msg = f"{series.path}: no height of the centre of mass in the rest before the activity; run it again"
        raise InputError(msg)
    return height[shown] / height[before].mean(), series.time[shown] - active.start_s


def _of_series(run: Run, active: Phase, straight_until: float | None) -> dict[str, float]:
    """What the series tells; NaN where it was not recorded.

    Args:
        run: The run.
        active: Its activity.
        straight_until: When barbs start to close again, after the beginning of the activity [s].
    """
    found = {STRAIGHT: math.nan, LOWEST: math.nan, HALF: math.nan, ENERGY: math.nan}
    if not (run.path / "series.h5").exists():
        return found
    series = run.series
    work = _WORK[PROCEDURES[active.type]]
    if work in series.data:
        found[ENERGY] = _gained(series[work], series["phase"] < active.index) / run.manifest.count
    if "com_height_m" in series.data:
        height, time = _heights(series, active)
        if straight_until is not None:
            last = (time > straight_until - _WINDOW) & (time <= straight_until)
            found[STRAIGHT] = float(height[last].mean()) if last.any() else math.nan
            found[LOWEST] = _lowest(time, height, straight_until, duration(active))
        elif active.type == "internal-oscillation":
            found[HALF] = half_compaction(time, height, duration(active))
    return found


def _lowest(time: NDArray[np.float64], height: NDArray[np.float64], start: float, end: float) -> float:
    """The least mean over a window between two times [s]; NaN if there is less than a window of them."""
    shown = (time > start) & (time <= end)
    if shown.sum() < 2:
        return math.nan
    samples = max(round(_WINDOW / float(np.median(np.diff(time[shown])))), 1)
    smooth = np.convolve(height[shown], np.full(samples, 1 / samples), mode="valid") if shown.sum() >= samples else ()
    return float(min(smooth, default=math.nan))


def _gained(work: NDArray[np.float64], before: NDArray[np.bool_]) -> float:
    """What a cumulative work gained since before the activity, to the end of the run [J]."""
    known = np.isfinite(work)
    if not known.any():
        return math.nan
    start = work[known & before]
    return float(work[known][-1] - (start[-1] if len(start) else 0.0))


def half_compaction(time: NDArray[np.float64], height: NDArray[np.float64], duration: float) -> float:
    """Share of the activity after which the centre of mass has come down by half of what it does in the end.

    Args:
        time: (n,) since the activity began, with the rests before and after [s].
        height: (n,) over that before the activity [-].
        duration: Of the activity [s].

    Returns:
        The share [-]; NaN if the centre of mass is not lower in the end.
    """
    final = height[time > duration]
    moving = (time >= 0) & (time <= duration)
    if not len(final) or moving.sum() < 2 or not final.mean() < 1:
        return math.nan
    level = (1 + final.mean()) / 2
    time = time[moving]
    samples = min(max(round(_WINDOW / float(np.median(np.diff(time)))), 1), len(time))
    smooth = np.convolve(height[moving], np.full(samples, 1 / samples), mode="valid")
    # The mean over a window stands at its middle; before the first middle the height is that of the rest.
    centres = np.concatenate([[0.0], np.convolve(time, np.full(samples, 1 / samples), mode="valid")])
    smooth = np.concatenate([[1.0], smooth])
    below = np.nonzero(smooth <= level)[0]
    if not len(below):
        return 1.0
    k = int(below[0])
    share = (smooth[k - 1] - level) / (smooth[k - 1] - smooth[k])
    return float((centres[k - 1] + share * (centres[k] - centres[k - 1])) / duration)


def samples(runs: pd.DataFrame) -> pd.DataFrame:
    """One row per procedure, aspect ratio, θ and seed, the static state among the procedures.

    The static state of an aspect ratio and a seed is the mean over the runs that began with it: they are
    poured alike, so they count as one sample.

    Args:
        runs: Table of runs, see `procedure_row`.

    Returns:
        The table; what a procedure does not have is NaN. "runs [-]" says how many a row stands for.
    """
    columns = {f"{STATIC} {quantity}": quantity for quantity in (PHI_ACTIVE, PHI, CROSSINGS)}
    static = runs.groupby([ASPECT, SEED], as_index=False)[list(columns)].mean().rename(columns=columns)
    static["runs [-]"] = runs.groupby([ASPECT, SEED]).size().to_numpy()
    static = static.assign(**{PROCEDURE: STATIC, THETA: math.nan})
    active = runs[[PROCEDURE, THETA, ASPECT, SEED, *QUANTITIES]].assign(**{"runs [-]": 1})
    table = pd.concat([static.reindex(columns=active.columns), active], ignore_index=True)
    return table.sort_values([PROCEDURE, ASPECT, THETA, SEED], ignore_index=True)
