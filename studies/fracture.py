"""A hook is pulled out of piles that were prepared by each procedure, at several θ and l/w.

The study measures force against time, peak force and work, and their correlation with entanglement, and compares them
with Savoie, Tuazon, Bhamla and Goldman, "Amorphous Entangled Active Matter", Soft Matter 2023, section "Tensile loading
and fracture". Runs of one l/w and seed are poured from equal poses and compared pair by pair. If the hook stops at its
force limit ("held fast"), the peak force is a lower bound.
"""

import math
from functools import partial

import numpy as np
import pandas as pd

from dem.record.run import Run
from postprocess.geometry.links import centres_of_mass
from postprocess.measures.pull import (
    END,
    FREE,
    PULL,
    WINDOW,
    freed,
    held_at,
    held_fast,
    lost_after,
    peak,
    read_pull,
    weight_of_one,
)
from postprocess.measures.table import summarise_run
from postprocess.statistics.points import ASPECT, SEED
from studies.framework.figures import (
    ASPECT_LABEL,
    CROSSINGS_LABEL,
    THETA_LABEL,
    Histories,
    History,
    Means,
    Scatter,
    Series,
    Split,
    by_procedure,
    one_by_one,
    procedure_marker,
)
from studies.framework.findings import Rows
from studies.framework.procedures import (
    ACTIVE,
    AMPLITUDE,
    CROSSINGS,
    INTERNAL,
    ORDER,
    PHI,
    PROCEDURE,
    SHAPE,
    THETA,
    compared,
    of_procedure,
    prepared_by,
)
from studies.framework.runs import ASPECT_KEY, DEFINITION, THETA_KEY, Key, Row, declare, last_columns, require_frames
from studies.framework.study import Study
from studies.strength import (
    ABOVE,
    BEFORE,
    HELD_FAST,
    LIMIT,
    LOST,
    PEAK,
    RAISED,
    RESIDUAL,
    WORK,
    order_findings,
    strongest,
    with_crossings,
)

SHOWN_ASPECT = 0.7  # l/w at which procedures and amplitudes are compared, as in the paper

PEAK_TIME = "time of the peak [s]"
WINDOWS = {
    window: f"peak force over n W_s, window {window:g} s [-]"
    for window in (WINDOW / 4, WINDOW / 2, 2 * WINDOW, 4 * WINDOW)
}
HELD, NET = "lower hook force at the peak over n W_s [-]", "peak force less lower hook's over n W_s [-]"
LEFT = "load at the end over n W_s [-]"
CAME_FREE, FREE_TIME = "came free [-]", "time of coming free [s]"
ACCOUNT = "work less that of the engine's account [-]"

_FORCE = f"largest mean over {WINDOW:g} s of the force that raises the hook; a lower bound where it held fast"
QUANTITIES = declare(
    {
        PEAK: ("peak", ".3f", _FORCE),
        HELD_FAST: ("held fast", ".2f", "1 where the hook was stopped by its force limit, 0 where it arrived"),
        **{column: ("", ".3f", f"largest mean over {window:g} s") for window, column in WINDOWS.items()},
        HELD: ("lower hook at it", ".3f", "upward force on the lower hook at the peak, transmitted from hook to hook"),
        NET: ("peak less lower hook", ".3f", "largest mean of the force on the upper hook less that on the lower"),
        PEAK_TIME: ("", ".3g", "time since the pull began at which the peak is"),
        RAISED: ("raised at it [mm]", ".1f", "displacement of the hook at the peak"),
        LOST: ("lost beyond it", ".2f", "1 − mean force over w/2 of displacement beyond the peak, over the peak force"),
        WORK: ("work / n W_s w", ".3f", "∫ F dz over the whole pull"),
        CAME_FREE: ("came free", ".2f", f"1 where the force came below {FREE:g} of its peak for good, 0 elsewhere"),
        FREE_TIME: ("", ".3g", "time since the pull began at which it came free; empty where it did not"),
        LEFT: ("load at the end", ".3f", f"mean force over the last {END:g} s of the pull"),
        BEFORE: ("", ".3g", f"mean force on the hook over the last {END:g} s before the pull"),
        ABOVE: ("above the hook", ".2f", "share of smarticles with the centre of mass above the hook before the pull"),
        CROSSINGS: ("⟨N⟩", ".2f", "⟨N⟩ at rest before the pull: links of others through a smarticle's plane"),
        PHI: ("", ".3g", "packing fraction at rest before the pull"),
    },
    axes={PEAK: r"peak force $F_\mathrm{max}/(n W_\mathrm{s})$ [-]", CROSSINGS: CROSSINGS_LABEL},
    scales={RAISED: 1e3},
)


def measure(run: Run) -> Row:
    """Measure the pile before the pull, and the forces on the hooks; return the run's row."""
    pile, pulled, series = prepared_by(run, PULL), run.phases[-1], run.series
    rest, asked = pulled.index - 1, run.scene["phases"][pulled.index]
    require_frames(run, [rest])
    table = summarise_run(run, definitions=[DEFINITION], phases={rest, pulled.index}).set_index("phase")
    before = table.loc[rest]
    frame = run.frames.in_phase(rest)[-1]
    hook = float(series["hook_upper_z_m"][series.nearest(frame.time)])
    pull, one = read_pull(run, series, pulled.index), weight_of_one(run)
    total, highest, free = run.manifest.count * one, peak(pull), freed(pull)
    unlimited = asked.get("force_limit_N") is None
    return {
        **pile,
        PHI: before[PHI],
        CROSSINGS: before["crossings mean [-]"],
        ABOVE: int((centres_of_mass(frame.vertices)[:, 2] > hook).sum()) / run.manifest.count,
        PEAK: highest.force / total,
        **{column: peak(pull, window).force / total for window, column in WINDOWS.items()},
        HELD: held_at(pull, highest.time) / total,
        NET: peak(pull.net).force / total,
        PEAK_TIME: highest.time,
        RAISED: highest.raised,
        LOST: lost_after(pull, highest, run.manifest.middle_length_m / 2),
        WORK: pull.work / total / run.manifest.middle_length_m,
        CAME_FREE: float(math.isfinite(free)),
        FREE_TIME: free,
        LEFT: pull.left / total,
        BEFORE: pull.before / total,
        ACCOUNT: pull.work / pull.engine_work - 1 if pull.engine_work else math.nan,
        RESIDUAL: pull.residual,
        HELD_FAST: float(held_fast(pull.raised, asked)),
        LIMIT: math.inf if unlimited else asked["force_limit_N"] / run.manifest.count / one,
        "escaped at the end [-]": table["escaped [-]"].iloc[-1],
        "frames averaged [-]": int(before["frames averaged"]),
        **last_columns(run),
    }


def force_history(run: Run, *, net: bool = False) -> History:
    """Read the force on the upper hook against time, over the weight of all smarticles [-].

    With `net`, the force on the lower hook is subtracted.
    """
    pull = read_pull(run, run.series, run.phases[-1].index)
    force = (pull.net if net else pull).force / run.manifest.count / weight_of_one(run)
    return History(times=pull.times, values=force)


def at_shown_aspect(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows at the aspect ratio `SHOWN_ASPECT`."""
    return table[np.isclose(table[ASPECT], SHOWN_ASPECT)]


def at_one_theta(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows at `SHOWN_ASPECT`; for the internal oscillation only rows with θ = `AMPLITUDE`."""
    return compared(at_shown_aspect(table))


def amplitudes(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the internal oscillation at `SHOWN_ASPECT`, or none if all have the same θ."""
    part = at_shown_aspect(table[table[PROCEDURE] == INTERNAL])
    return part if part[THETA].nunique() > 1 else part.iloc[:0]


def aspects(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the internal oscillation at θ = `AMPLITUDE`, or none if all have the same l/w."""
    part = of_procedure(table, INTERNAL)
    return part if part[ASPECT].nunique() > 1 else part.iloc[:0]


FIRST, LAST = strongest(at_one_theta, f", l/w = {SHOWN_ASPECT:g}"), order_findings(at_one_theta)
CONNECTED, OVER_THETA = with_crossings(
    lambda table: table, (ASPECT, SEED), lambda table: at_shown_aspect(table[table[PROCEDURE] == INTERNAL]), (SEED,)
)
FINDINGS = (*FIRST, LAST[0], OVER_THETA, CONNECTED, LAST[1])

_BY_THETA = one_by_one(THETA, lambda theta: rf"$\theta$ = {theta:g}°")
_BY_ASPECT = one_by_one(ASPECT, lambda aspect: rf"$l/w$ = {aspect:g}")


def _line(rows: Rows) -> Split:
    """Return a function that makes one series of the rows of the internal oscillation that `rows` selects."""
    properties = {**procedure_marker(INTERNAL), "linestyle": (0, (2, 1.5))}
    return lambda points: [Series(rows=rows(points), label="internal oscillation", properties=properties)]


def _all_points(table: pd.DataFrame) -> list[Series]:
    """Return one series per procedure, and one per other θ and other l/w of the internal oscillation."""
    others = amplitudes(table), aspects(table)
    return [
        *by_procedure(line=False)(at_shown_aspect(table)),
        *_BY_THETA(others[0][others[0][THETA] != AMPLITUDE]),
        *_BY_ASPECT(others[1][others[1][ASPECT] != SHOWN_ASPECT]),
    ]


def _forces(name: str, rows: Rows, split: Split, note: str, *, net: bool = False) -> Histories:
    return Histories(
        name=name,
        history=partial(force_history, net=net),
        rows=rows,
        split=split,
        width=WINDOW,
        level=1.0,
        x_label="time since the hook began to rise [s]",
        quantities={"": rf"{'upper less lower' if net else 'force on the'} hook, $F/(n W_\mathrm{{s}})$ [-]"},
        notes=[f"{note} Level: weight of all smarticles."],
    )


def _peaks(name: str, x: str, x_label: str, split: Split, note: str) -> Means:
    return Means(name=name, quantities=[QUANTITIES[PEAK]], x=x, x_label=x_label, split=split, notes=[note])


_AT_ASPECT, _AT_THETA = f"l/w = {SHOWN_ASPECT:g}.", f"θ = {AMPLITUDE:g}°."
FIGURES = (
    _forces("force_time", at_shown_aspect, by_procedure(), _AT_ASPECT),
    _forces("net_time", at_shown_aspect, by_procedure(), _AT_ASPECT, net=True),
    _forces("force_time_theta", amplitudes, _BY_THETA, f"Internal oscillation, {_AT_ASPECT}"),
    _peaks("peak_theta", THETA, THETA_LABEL, _line(amplitudes), _AT_ASPECT),
    _forces("force_time_aspect", aspects, _BY_ASPECT, f"Internal oscillation, {_AT_THETA}"),
    _peaks("peak_aspect", ASPECT, ASPECT_LABEL, _line(aspects), _AT_THETA),
    Scatter(name="peak_crossings", xs=[QUANTITIES[CROSSINGS]], y=QUANTITIES[PEAK], split=_all_points, bounds=HELD_FAST),
)

STUDY = Study(
    name="fracture",
    title="A hook pulled out of a pile, against the findings of Savoie et al.",
    measure=measure,
    keys=(Key(column=PROCEDURE, label="procedure", order=ORDER), THETA_KEY, ASPECT_KEY),
    quantities=tuple(QUANTITIES.values()),
    findings=FINDINGS,
    figures=FIGURES,
    order=(PROCEDURE, ASPECT, THETA, SEED),
    constant={ACTIVE: (PROCEDURE,)},
    bounds=(HELD_FAST, "held fast"),
    count_values=True,
    remarks=(
        "Of how the force depends on θ or on l/w by itself the paper's text says nothing; it has figures.",
        "What goes from hook to hook shows on the lower one, where a smarticle may be hooked into both; the peak less "
        "that is what pile and container take.",
        f"`{ACCOUNT}` of `runs.csv`: ∫ F dz from the series over the work that the engine added up, less 1.",
    ),
    pictured={"procedure": SHAPE, "l_over_w": SHOWN_ASPECT},
)
