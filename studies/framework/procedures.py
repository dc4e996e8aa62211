"""Procedures (static, external and internal oscillation, shape change) and measures of one activity.

A run of one activity has four phases: pour, rest, activity, rest. Measures are averaged over the frames of both rests:
the first rest is the static state of an aspect ratio and a seed, the second rest is the state after the activity. φ_f
is measured at the end of the activity, as in the paper's own code, and again at rest, since a shaken pile bounces and
is looser in motion.
"""

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dem.errors import InputError
from dem.record.document import Phase
from dem.record.run import Run
from postprocess.measures.motors import APART, SAMPLED_WORK
from postprocess.measures.pull import averaged, interval_of
from postprocess.measures.table import summarise_run
from postprocess.statistics.points import ASPECT, SEED, mean_difference
from postprocess.statistics.seeds import SeedMean
from studies.framework.runs import DEFINITION, duration, last_columns, require_frames, run_columns

STATIC, EXTERNAL, SHAPE, INTERNAL = "static", "external", "shape-change", "internal"
ORDER = (STATIC, EXTERNAL, SHAPE, INTERNAL)
PROCEDURES: Mapping[str, str] = MappingProxyType(
    {"shake": EXTERNAL, "shape-change": SHAPE, "internal-oscillation": INTERNAL}
)  #: Procedure by the type of the phase that is its activity

AMPLITUDE = 10.0  #: Amplitude θ at which the internal oscillation is compared with others, as in the paper [deg]

PROCEDURE, THETA, ACTIVE = "procedure", "theta [deg]", "time active [s]"
PHI, CROSSINGS = f"phi {DEFINITION} [-]", "crossings [-]"
PHI_ACTIVE = f"phi {DEFINITION} at the end of the activity [-]"
ENERGY = "energy per smarticle [J]"
SAMPLED = f"energy per smarticle sampled every {APART:g} s [J]"
HEIGHT, STRAIGHT, HALF = "com height over h0 [-]", "com height straight over h0 [-]", "half of compaction at [-]"
LOWEST = "lowest com height over h0 while closing [-]"

BY_RANKS = "mean over seeds of the rank correlation of peak force and ⟨N⟩ > 0; what held fast is above all that did not"
"""Criterion for the finding that peak force rises with entanglement."""

_WORK = {EXTERNAL: "container_work_J", SHAPE: "motor_work_J", INTERNAL: "motor_work_J"}
_REST = "at rest"
_WINDOW = 0.1  # s, of moving means of heights: longer than a swing at θ = 10° and than three periods at 30 Hz


def prepared_by(run: Run, *then: str) -> dict[str, object]:
    """Return procedure, θ [deg], cells of `run_columns` and duration of the activity [s], by column.

    A run without an activity has the procedure `static`, θ NaN and the duration 0. The phases must be a pour and a
    rest, then one activity and another rest or nothing, then phases of the types `then`; otherwise InputError.
    """
    types = [phase.type for phase in run.phases]
    active = [kind for kind in types if kind in PROCEDURES]
    steps = [_REST if phase.at_rest and phase.index else phase.type for phase in run.phases]
    if steps != ["deposit", _REST, *([active[0], _REST] if active else []), *then]:
        raise InputError(
            f"{run.path}: its phases are {', '.join(types)}, not a pour, a rest, one activity "
            f"({', '.join(PROCEDURES)}) with a rest or none, {' and '.join(then)}; leave it out"
        )
    procedure = PROCEDURES[active[0]] if active else STATIC
    theta = run.scene["phases"][2]["theta_deg"] if procedure == INTERNAL else math.nan
    pile = run_columns(run)
    return {PROCEDURE: procedure, THETA: theta, **pile, ACTIVE: duration(run.phases[2]) if active else 0.0}


def of_procedure(table: pd.DataFrame, procedure: str) -> pd.DataFrame:
    """Return the rows of a procedure; for the internal oscillation only rows with θ = `AMPLITUDE`."""
    chosen = table[table[PROCEDURE] == procedure]
    return chosen[np.isclose(chosen[THETA], AMPLITUDE)] if procedure == INTERNAL and THETA in chosen else chosen


def compared(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of all procedures; for the internal oscillation only rows with θ = `AMPLITUDE`."""
    return pd.concat([of_procedure(table, name) for name in table[PROCEDURE].unique()]) if len(table) else table


def paired(table: pd.DataFrame, quantity: str, one: str, other: str) -> SeedMean:
    """Return the mean difference of a quantity between procedures, `one` less `other`.

    Runs are paired by aspect ratio and seed.
    """
    return mean_difference(of_procedure(table, one), of_procedure(table, other), quantity)


def activity(run: Run) -> Phase:
    """Return the activity of a run; InputError unless it has exactly one, between two rests."""
    active = [phase for phase in run.phases if not phase.at_rest]
    around = run.phases[active[0].index - 1 : active[0].index + 2] if active else ()
    if len(active) != 1 or active[0].type not in PROCEDURES or len(around) != 3 or not around[2].at_rest:
        types = ", ".join(phase.type for phase in run.phases)
        wanted = f"one activity ({', '.join(PROCEDURES)}) between two rests"
        msg = f"{run.path}: its phases are {types}, not {wanted}; leave it out"
        raise InputError(msg)
    return active[0]


def procedure_row(run: Run) -> dict[str, object]:
    """Measure a run of one activity between two rests and return its row; InputError for other runs."""
    active = activity(run)
    settings = run.scene["phases"][active.index]
    if settings["type"] != active.type:
        scene = f"{settings['type']} in scene.yaml"
        msg = f"{run.path}: phase {active.index} is {active.type} in run.json, {scene}; run it again"
        raise InputError(msg)
    procedure = PROCEDURES[active.type]
    wanted = range(active.index - 1, active.index + 2)
    require_frames(run, wanted)
    table = summarise_run(run, definitions=[DEFINITION], phases=set(wanted))
    before, during, after = (table.set_index("phase").loc[phase] for phase in wanted)
    theta = settings["theta_deg"] if procedure == INTERNAL else math.nan
    row: dict[str, object] = {PROCEDURE: procedure, THETA: theta, **run_columns(run), ACTIVE: duration(active)}
    for name, rest in ((f"{STATIC} ", before), ("", after)):
        row |= {f"{name}{PHI}": rest[PHI], f"{name}{CROSSINGS}": rest["crossings mean [-]"]}
    row |= {f"{STATIC} {PHI_ACTIVE}": before[PHI], PHI_ACTIVE: during[PHI]}
    row[f"phi {DEFINITION} SE in run [-]"] = after[f"phi {DEFINITION} SE [-]"]
    row["h0 [m]"] = before["com height [m]"]
    row[HEIGHT] = after["com height [m]"] / before["com height [m]"]
    straight_until = settings["opening_s"] + settings["straight_hold_s"] if procedure == SHAPE else None
    row |= _of_series(run, active, straight_until)
    row[SAMPLED] = during.get(SAMPLED_WORK, math.nan) / run.manifest.count
    row["escaped at the end [-]"] = after["escaped [-]"]
    row["frames averaged [-]"] = int(table["frames averaged"].min())
    return row | last_columns(run)


def height_history(run: Run) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the height of the centre of mass over h0 (n,) [-], and the times of its samples (n,) [s].

    h0 is the mean height in the rest before the activity, with which the samples begin; the time is 0 at the beginning
    of the activity. Samples without a height are left out. InputError if the phases are not one activity between two
    rests, or no sample of the first rest has a height.
    """
    series, active = run.series, activity(run)
    height = np.asarray(series["com_height_m"], dtype=np.float64)
    shown = (series["phase"] >= active.index - 1) & np.isfinite(height)
    before = shown & (series["phase"] == active.index - 1)
    if active.start_s is None or not before.any():
        msg = f"{series.path}: no height of the centre of mass in the rest before the activity; run it again"
        raise InputError(msg)
    return height[shown] / height[before].mean(), series.time[shown] - active.start_s


def _of_series(run: Run, active: Phase, straight_until: float | None) -> dict[str, float]:
    """Measure heights [-] and energy per smarticle [J] from the series, by column; NaN if not recorded.

    In a shape change barbs, straight until `straight_until`, then start to close again: time [s] since it began.
    """
    found = {STRAIGHT: math.nan, LOWEST: math.nan, HALF: math.nan, ENERGY: math.nan}
    if not (run.path / "series.h5").exists():
        return found
    series = run.series
    work = _WORK[PROCEDURES[active.type]]
    if work in series.data:
        found[ENERGY] = gained(series[work], series["phase"] < active.index) / run.manifest.count
    if "com_height_m" in series.data:
        height, time = height_history(run)
        if straight_until is not None:
            last = (time > straight_until - _WINDOW) & (time <= straight_until)
            found[STRAIGHT] = float(height[last].mean()) if last.any() else math.nan
            closing = (time > straight_until) & (time <= duration(active))
            found[LOWEST] = float(min(_smooth(height, time, closing), default=math.nan))
        elif active.type == "internal-oscillation":
            found[HALF] = half_compaction(time, height, duration(active))
    return found


def _smooth(values: NDArray[np.float64], time: NDArray[np.float64], chosen: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the moving mean over `_WINDOW` of the values (n,) that are chosen (n,); times (n,) in [s].

    The result is empty if the chosen values span a time shorter than `_WINDOW`.
    """
    if chosen.sum() < 2:
        return np.empty(0)
    interval = interval_of(time[chosen])
    if chosen.sum() < round(_WINDOW / interval):
        return np.empty(0)
    return averaged(values[chosen], interval, _WINDOW)


def gained(work: NDArray[np.float64], before: NDArray[np.bool_]) -> float:
    """Return the increase [J] of a cumulative work (n,) [J] since the last sample marked in `before` (n,).

    NaN if the work was not recorded.
    """
    known = np.isfinite(work)
    if not known.any():
        return math.nan
    start = work[known & before]
    return float(work[known][-1] - (start[-1] if len(start) else 0.0))


def half_compaction(time: NDArray[np.float64], height: NDArray[np.float64], duration: float) -> float:
    """Return the time at which half of the compaction is reached, over the duration of the activity [-].

    Times (n,) count from the start of the activity [s]; heights (n,) are divided by the height in the rest before [-].
    Both include the rests before and after the activity. The result is 1 if half is not reached during the activity,
    NaN if the centre of mass is not lower in the rest after the activity.
    """
    final = height[time > duration]
    moving = (time >= 0) & (time <= duration)
    if not len(final) or moving.sum() < 2 or not final.mean() < 1:
        return math.nan
    level = (1 + final.mean()) / 2
    time = time[moving]
    interval = interval_of(time)
    # A moving mean belongs to the middle of its window; at time 0 the height is that of the rest before.
    centres, smooth = (
        np.concatenate([[start], averaged(values, interval, _WINDOW)])
        for start, values in ((0.0, time), (1.0, height[moving]))
    )
    reached = np.nonzero(smooth <= level)[0]
    if not len(reached):
        return 1.0
    k = int(reached[0])
    share = (smooth[k - 1] - level) / (smooth[k - 1] - smooth[k])
    return float((centres[k - 1] + share * (centres[k] - centres[k - 1])) / duration)


def samples(runs: pd.DataFrame) -> pd.DataFrame:
    """Make the table of samples: a row per procedure (static included), aspect ratio, θ and seed.

    The static state has one row per aspect ratio and seed (θ is NaN): the mean over all runs with this aspect ratio and
    seed, since they are poured from equal poses. "runs [-]" is the number of runs of a row. Quantities that a procedure
    lacks are NaN.
    """
    columns = {f"{STATIC} {quantity}": quantity for quantity in (PHI_ACTIVE, PHI, CROSSINGS)}
    static = runs.groupby([ASPECT, SEED], as_index=False)[list(columns)].mean().rename(columns=columns)
    static["runs [-]"] = runs.groupby([ASPECT, SEED]).size().to_numpy()
    static = static.assign(**{PROCEDURE: STATIC, THETA: math.nan})
    measured = [PHI_ACTIVE, PHI, CROSSINGS, ENERGY, SAMPLED, HEIGHT, STRAIGHT, LOWEST, HALF]
    active = runs[[PROCEDURE, THETA, ASPECT, SEED, *measured]].assign(**{"runs [-]": 1})
    table = pd.concat([static.reindex(columns=active.columns), active], ignore_index=True)
    return table.sort_values([PROCEDURE, ASPECT, THETA, SEED], ignore_index=True)
