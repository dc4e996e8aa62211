"""Piles of each procedure are torn apart between a grid on the floor and a hook, without a wall.

In the paper's own test (study `fracture`) a single smarticle may hold both hooks, or the hook lifts the whole pile,
which rubs on the wall. Here a grid of bars 2.5 mm above the floor holds the pile, the wall is removed before the pull,
and the hook is farther from the grid than a smarticle is long. So the force beyond the lifted weight is transmitted
through the pile. The study measures force against displacement, peak force, work and the share of the pile that is torn
off. It compares them with the findings of Savoie et al. (Soft Matter 2023).

All procedures start from equal poses at each seed, and both heights of the hook from nearly equal ones. Procedures are
compared by means over both heights, seed by seed, so that the number of samples is that of the seeds. If the hook
stops at its force limit ("held fast"), the peak force is a lower bound.

The paper calls piles after a shape change harder but more brittle and gives no measure of either. Here harder is a
higher peak force. More brittle is a larger share of the peak force that is lost beyond the peak, as in the strength of
rock and soil (relative drop from peak to residual strength), averaged over the next w/2 of the hook's displacement (w:
middle length):

- A share, not a force: of two curves of one shape, the higher one is harder and not more brittle.
- An average over a displacement, ∫ F dz, not the slope of the curve: single contacts open and close, and a slope would
  be that of their noise.
- w/2: entanglements are undone when bars slip past each other over lengths of order w. A pile of which many links
  give way at once loses its force over less; one whose links give way one after another keeps it. The pull of 2w leaves
  w/2 beyond most peaks.

The weight of what the hook has lifted is not lost, and makes the share smaller, most so for piles that have much above
the hook. A hook that was held fast has no displacement beyond the peak: the share is unknown.
"""

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from dem.errors import InputError
from dem.record.run import Run
from postprocess.geometry.links import centres_of_mass
from postprocess.measures.heights import heights
from postprocess.measures.pull import (
    PULL,
    WINDOW,
    held_at,
    held_fast,
    lost_after,
    moving_mean,
    peak,
    read_pull,
    weight_of_one,
)
from postprocess.measures.table import summarise_run
from postprocess.statistics.points import ASPECT, SEED
from studies.framework.figures import CROSSINGS_LABEL, Histories, History, Means, Scatter, by_procedure
from studies.framework.findings import Effect, Finding, Outcome, Rows, above, decide, means_by, ranks, symbol
from studies.framework.procedures import (
    ACTIVE,
    BY_RANKS,
    CROSSINGS,
    EXTERNAL,
    INTERNAL,
    PROCEDURE,
    SHAPE,
    STATIC,
    THETA,
    compared,
    of_procedure,
    paired,
    prepared_by,
)
from studies.framework.runs import ASPECT_KEY, DEFINITION, THETA_KEY, Key, Row, declare, duration, last_columns
from studies.framework.study import Study

UPPER = "hook above the floor [m]"
PEAK, RAISED, WORK = "peak force over n W_s [-]", "hook raised at the peak [m]", "work over n W_s w [-]"
THROUGH = "force through to the grid at the peak over n W_s [-]"
LOST = "peak force lost over w/2 beyond the peak [-]"
HELD_FAST, LIMIT = "held fast [-]", "force limit over n W_s [-]"
CARRIED, BREAK = "carried off [-]", "lowest points of what is carried off, before [m]"
BEFORE, ABOVE = "load before the pull over n W_s [-]", "smarticles above the hook [-]"
RESIDUAL = "energy residual over dissipated in the pull [-]"
TOP, KEPT = "height of 95 % [m]", "com height without over with the wall [-]"

QUANTITIES = declare(
    {
        PEAK: ("peak", ".3f", f"largest mean over {WINDOW:g} s of the force on the hook; a bound where it held fast"),
        RAISED: ("raised at it [mm]", ".1f", "displacement of the hook at the peak"),
        LOST: ("lost beyond it", ".2f", "1 − mean force over w/2 of displacement beyond the peak, over the peak force"),
        WORK: ("work / n W_s w", ".3f", "∫ F dz over the whole pull, which tears the pile and lifts the part torn off"),
        THROUGH: ("through to the grid", ".3f", "upward force on the grid at the peak, less that before the pull"),
        BEFORE: ("before", ".3f", "force on the hook before the pull, by weight and by bracing of the pile"),
        HELD_FAST: ("held fast", ".2f", "1 where the hook was stopped by its force limit, 0 where it arrived"),
        CARRIED: (
            "carried off",
            ".3f",
            "share that rose by more than half of the hook's displacement; empty where held",
        ),
        BREAK: ("broke at [mm]", ".1f", "mean height, before the pull, of the lowest points of the part carried off"),
        ABOVE: ("above the hook", ".2f", "share of smarticles with the centre of mass above the hook before the pull"),
        TOP: ("height [mm]", ".1f", "height below which 95 % of the material lies before the pull"),
        KEPT: ("kept without wall", ".3f", "height of the centre of mass before the pull over that with the wall"),
        CROSSINGS: ("⟨N⟩", ".2f", "links of others through a smarticle's plane at rest before the wall went"),
    },
    axes={
        PEAK: r"peak force $F_\mathrm{max}/(n W_\mathrm{s})$ [-]",
        RAISED: "hook raised at the peak [mm]",
        WORK: r"work $W/(n W_\mathrm{s} w)$ [-]",
        CARRIED: "fraction carried off [-]",
        CROSSINGS: CROSSINGS_LABEL,
    },
    scales={RAISED: 1e3, BREAK: 1e3, TOP: 1e3},
)


def measure(run: Run) -> Row:
    """Measure the pile before the pull, the force on the hook, and the share torn off; return the row."""
    pile, pulled = prepared_by(run, "remove-container", PULL), run.phases[-1]
    rest, free = pulled.index - 2, pulled.index - 1
    settings, hooks = run.scene["phases"][pulled.index], run.scene.get("hooks")
    table = summarise_run(run, definitions=[DEFINITION], phases={rest}).set_index("phase")
    phases = [run.frames.in_phase(index) for index in (rest, free, pulled.index)]
    if hooks is None or not all(phases):
        msg = f"{run.path}: no hooks, or no frame of the rest, of remove-container or of {PULL}; run it again"
        raise InputError(msg)
    walled, before, torn = (phase[-1] for phase in phases)
    upper = hooks["upper_height_m"]
    pull = read_pull(run, run.series, pulled.index)
    weight, highest, held = run.manifest.count * weight_of_one(run), peak(pull), held_fast(pull.raised, settings)
    limit = settings.get("force_limit_N")
    centres = centres_of_mass(before.vertices)[:, 2]
    level = heights(before.vertices, floor_z=before.floor_z)
    rose = centres_of_mass(torn.vertices)[:, 2] - centres > float(pull.raised[-1]) / 2
    lowest = float(before.vertices[rose, :, 2].min(axis=1).mean()) - before.floor_z if rose.any() else math.nan
    return {
        **{name: pile[name] for name in (PROCEDURE, THETA, ASPECT)},
        UPPER: upper,
        **pile,
        CROSSINGS: table.loc[rest]["crossings mean [-]"],
        ABOVE: float((centres - before.floor_z > upper).mean()),
        TOP: level.top,
        RESIDUAL: pull.residual,
        KEPT: level.mean_com / heights(walled.vertices, floor_z=walled.floor_z).mean_com,
        PEAK: highest.force / weight,
        RAISED: highest.raised,
        LOST: lost_after(pull, highest, run.manifest.middle_length_m / 2),
        WORK: pull.work / weight / run.manifest.middle_length_m,
        BEFORE: pull.before / weight,
        THROUGH: (held_at(pull, highest.time) - pull.held[0]) / weight,
        HELD_FAST: float(held),
        LIMIT: math.inf if limit is None else float(limit) / run.manifest.count / weight_of_one(run),
        CARRIED: math.nan if held else float(rose.mean()),
        BREAK: math.nan if held else lowest,
        "time without the wall [s]": duration(run.phases[free]),
        **last_columns(run),
    }


def force_history(run: Run) -> History:
    """Read the force on the hook over the weight of the pile [-] against its displacement [mm]."""
    pull = read_pull(run, run.series, run.phases[-1].index)
    times, force = moving_mean(pull)
    displacement = 1e3 * np.interp(times, pull.edges, pull.raised)
    return History(times=displacement, values=force / run.manifest.count / weight_of_one(run))


def over_heights(runs: pd.DataFrame) -> pd.DataFrame:
    """Average runs over the heights of the hook: a row per procedure, l/w and seed.

    A row is left out if it lacks a run at any height.
    """
    columns = [PEAK, RAISED, LOST, WORK, THROUGH, CARRIED, ABOVE, CROSSINGS, HELD_FAST]
    grouped = compared(runs).groupby([PROCEDURE, ASPECT, SEED])
    return grouped[columns].mean()[grouped[UPPER].nunique() == runs[UPPER].nunique()].reset_index()


def order_findings(rows: Rows) -> tuple[Finding, Finding]:
    """Make two findings: peak force and ⟨N⟩ rank procedures differently; shape change makes brittle piles."""
    return (
        Finding(
            id="other-order-than-crossings",
            says="Over the three procedures, peak force and ⟨N⟩ do not keep the same order",
            outcome=other_order,
            rows=rows,
            found_if="two procedures differ clearly in both, in opposite senses; not found if all three pairs differ "
            "clearly in the same sense",
        ),
        above(
            "harder-but-brittle",
            "Like a metal cooled fast, a pile after shape change is harder but more brittle than after internal "
            "oscillation",
            {PEAK: 1, LOST: 1},
            SHAPE,
            (INTERNAL,),
            bounds=HELD_FAST,
            rows=rows,
            shown=(RAISED,),
            found_if="peak force above, and a larger share of it lost over w/2 beyond the peak, seed by seed; the "
            "paper says that its fracture tests support this, not by which measure (ours: studies/strength.py)",
        ),
    )


def other_order(table: pd.DataFrame) -> Outcome:
    """Judge whether two procedures differ clearly in both ⟨N⟩ and peak force, with opposite signs."""
    pairs: dict[bool, list[str]] = {True: [], False: []}
    known = True
    for one, other in itertools.combinations(THREE, 2):
        bounded = any(of_procedure(table, name)[HELD_FAST].any() for name in (one, other))
        both = [Effect(label="", value=paired(table, quantity, one, other)).verdict for quantity in (CROSSINGS, PEAK)]
        known &= "no data" not in both
        if not bounded and set(both) <= {"found", "not found"}:
            pairs[both[0] == both[1]].append(f"{one} and {other}")
    note = f"⟨N⟩: {means_by(table, CROSSINGS, PROCEDURE, '.3g')}; peak: {means_by(table, PEAK, PROCEDURE, '.3g')}; "
    note += f"clearly apart in opposite senses: {', '.join(pairs[False]) or 'none'}, in one: {', '.join(pairs[True])}"
    found, same = bool(pairs[False]), len(pairs[True]) == len(THREE)
    return Outcome(note=note, verdict=decide(found, same, data=known or found))


def strongest(rows: Rows, suffix: str = "") -> tuple[Finding, Finding]:
    """Make the findings that peak force is greatest after shape change, least after internal oscillation.

    `rows` selects rows of the table of samples; `suffix` says in the statements which rows these are.
    """
    keys: dict[str, Any] = {"beside": (STATIC,), "bounds": HELD_FAST, "rows": rows}
    most, least = (f"has the {one} peak force of the three procedures{suffix}" for one in ("highest", "least"))
    return (
        above(
            "shape-change-strongest", f"Shape change {most}", PEAK, SHAPE, (EXTERNAL, INTERNAL), shown=[PEAK], **keys
        ),
        above("internal-weakest", f"Internal oscillation {least}", PEAK, INTERNAL, (EXTERNAL, SHAPE), sign=-1, **keys),
    )


def with_crossings(
    rows: Rows, within: Sequence[str], theta: Rows, within_theta: Sequence[str]
) -> tuple[Finding, Finding]:
    """Make the findings that peak force rises with ⟨N⟩: over all procedures, and over the amplitudes θ.

    `rows` selects the runs of the first finding, `theta` those of the second. Only runs of one block are compared: runs
    that agree in the columns `within` (first finding) or `within_theta` (second).
    """
    keys: dict[str, Any] = {"bounds": HELD_FAST, "unit": "n W_s per link"}
    where, where_theta = (", ".join(map(symbol, columns)) for columns in (within, within_theta))
    return (
        ranks(
            "strength-with-crossings",
            "Tensile strength and number of entanglements are connected",
            CROSSINGS,
            PEAK,
            within=within,
            rows=rows,
            found_if=f"over all procedures, within runs of equal {where}: {BY_RANKS}",
            **keys,
        ),
        ranks(
            "strength-with-crossings-over-theta",
            "Internal oscillation: over θ, the peak force goes with ⟨N⟩",
            CROSSINGS,
            PEAK,
            within=within_theta,
            rows=theta,
            found_if=f"over θ, within runs of equal {where_theta}: {BY_RANKS}",
            **keys,
        ),
    )


def several_amplitudes(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the runs of internal oscillation, at those l/w and hook heights for which several θ were run."""
    internal = runs[runs[PROCEDURE] == INTERNAL]
    return internal[internal.groupby([ASPECT, UPPER])[THETA].transform("nunique") > 1]


THREE = (EXTERNAL, INTERNAL, SHAPE)
PILE = (UPPER, ASPECT, SEED)

FINDINGS = (
    *strongest(over_heights),
    *order_findings(over_heights),
    above(
        "tougher",
        "(ours, not the paper's) shape change takes the most work to tear",
        WORK,
        SHAPE,
        (EXTERNAL, INTERNAL),
        bounds=HELD_FAST,
        rows=over_heights,
        shown=(WORK, THROUGH, CARRIED, ABOVE),
    ),
    *with_crossings(compared, PILE, several_amplitudes, PILE),
)

FIGURES = (
    Histories(
        name="force_raised",
        history=force_history,
        rows=compared,
        split=by_procedure(),
        panels=UPPER,
        panel="hook {:g} mm above the floor",
        panel_scale=1e3,
        width=0.5,  # the side of the hook's bars
        unit="mm",
        x_label="hook raised by [mm]",
        quantities={"": r"force on the hook $F/(n W_\mathrm{s})$ [-]"},
    ),
    Means(
        name="strength",
        quantities=[QUANTITIES[name] for name in (PEAK, RAISED, WORK, CARRIED)],
        x=UPPER,
        transform=lambda x: 1e3 * x,
        x_label="hook above the floor [mm]",
        split=by_procedure(apart=0.3, line=False),
    ),
    Scatter(
        name="peak_crossings",
        xs=[QUANTITIES[CROSSINGS]],
        y=QUANTITIES[PEAK],
        split=by_procedure(line=False),
        bounds=HELD_FAST,
    ),
)

STUDY = Study(
    name="strength",
    title="Piles torn between a grip on the floor and a hook, against the findings of Savoie et al.",
    measure=measure,
    keys=(
        ASPECT_KEY,
        Key(column=UPPER, label="hook [mm]", form="g", scale=1e3),
        Key(column=PROCEDURE, label="procedure", order=(STATIC, EXTERNAL, INTERNAL, SHAPE)),
        THETA_KEY,
    ),
    quantities=tuple(QUANTITIES.values()),
    findings=FINDINGS,
    figures=FIGURES,
    order=(ASPECT, UPPER, SEED, PROCEDURE, THETA),
    constant={ACTIVE: (PROCEDURE,)},
    bounds=(HELD_FAST, "held fast"),
    remarks=(
        "This is not the paper's test, which has two hooks alike and a wall (study `fracture`): there one smarticle "
        "may hold both hooks, and the pile is lifted as a whole.",
    ),
    pictured={"procedure": SHAPE, "upper_m": 0.013},
)
