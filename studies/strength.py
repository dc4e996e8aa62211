"""Piles prepared by each procedure are torn between a grip on the floor and a hook, without a wall.

In the paper's own test (study `fracture`) one rigid smarticle may hold both hooks, and the hook feels the weight of a
pile that comes along as a whole, rubbing on the wall. Here a grid of bars 2.5 mm above the floor holds the pile, the
wall is gone before the pull, and the hook is farther from the grid than a smarticle is long: what it feels beyond
what it lifts goes through the pile. Force against displacement, peak, work and what tears off, against Savoie et al.
(Soft Matter 2023).

A seed is poured alike for all procedures, and for both heights of the hook nearly so: means over the heights within a
seed are compared, so that seeds alone are counted. A pile that held fast has a peak of at least what it took.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import pandas as pd

from dem.errors import InputError
from dem.record.run import Run
from postprocess.geometry.links import centres_of_mass
from postprocess.measures.heights import heights
from postprocess.measures.pull import PULL, WINDOW, held_at, held_fast, moving_mean, peak, read_pull, weight_of_one
from postprocess.measures.table import summarise_run
from postprocess.statistics.points import ASPECT, SEED, mean_difference
from postprocess.statistics.seeds import SeedMean, slope_within
from studies.framework.figures import Histories, Means, Scatter, by_procedure
from studies.framework.findings import Effect, Finding, Outcome, Verdict, above, blocks, ranked, ranks
from studies.framework.plots import CROSSINGS_LABEL, History
from studies.framework.procedures import (
    ACTIVE,
    AMPLITUDE,
    BY_RANKS,
    CROSSINGS,
    EXTERNAL,
    INTERNAL,
    PROCEDURE,
    SHAPE,
    STATIC,
    THETA,
    of_procedure,
    prepared_by,
)
from studies.framework.quantities import Key, declare
from studies.framework.runs import DEFINITION, Row, duration
from studies.framework.study import Study

UPPER = "hook above the floor [m]"
PEAK, RAISED, WORK = "peak force over n W_s [-]", "hook raised at the peak [m]", "work over n W_s w [-]"
THROUGH = "force through to the grid at the peak over n W_s [-]"
HELD_FAST, LIMIT = "held fast [-]", "force limit over n W_s [-]"
CARRIED, BREAK = "carried off [-]", "lowest points of what is carried off, before [m]"
BEFORE, ABOVE = "load before the pull over n W_s [-]", "smarticles above the hook [-]"
TOP, KEPT = "height of 95 % [m]", "com height without over with the wall [-]"

QUANTITIES = declare(
    {
        PEAK: (
            "peak",
            ".3f",
            f"largest mean over {WINDOW:g} s of the force on the hook; at least, where it held",
        ),
        RAISED: ("raised at it [mm]", ".1f", "how far the hook had been raised then"),
        WORK: ("work / n W_s w", ".3f", "∫ F dz over the whole pull: to fracture, and to carry off what comes along"),
        THROUGH: ("through to the grid", ".3f", "upwards on the grid at the peak less that before the pull"),
        BEFORE: ("before", ".3f", "force on the hook before the pull: what rests on it, and a pile that is braced"),
        HELD_FAST: ("held fast", ".2f", "1 where the hook was stopped by its force limit, 0 where it arrived"),
        CARRIED: ("carried off", ".3f", "share that rose by more than half of the hook's way; empty where held"),
        BREAK: (
            "broke at [mm]",
            ".1f",
            "mean height of the lowest points of those before the pull",
        ),
        ABOVE: ("above the hook", ".2f", "share with the centre of mass above the hook before the pull"),
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
    """Measure the pile before it is torn, the force on the hook, and what came off."""
    procedure = prepared_by(run, "remove-container", PULL)
    pulled = run.phases[-1]
    rest, free = pulled.index - 2, pulled.index - 1
    settings = run.scene["phases"]
    hooks = run.scene.get("hooks")
    table = summarise_run(run, definitions=[DEFINITION], phases={rest}).set_index("phase")
    frames = run.frames
    phases = [frames.in_phase(index) for index in (rest, free, pulled.index)]
    if hooks is None or rest not in table.index or not all(phases):
        msg = f"{run.path}: no hooks, or no frame of the rest, of remove-container or of {PULL}; run it again"
        raise InputError(msg)
    walled, before, torn = (phase[-1] for phase in phases)
    upper = hooks["upper_height_m"]
    pull = read_pull(run, run.series, pulled.index)
    weight, highest, held = run.manifest.count * weight_of_one(run), peak(pull), held_fast(pull, settings[pulled.index])
    limit = settings[pulled.index].get("force_limit_N")
    centres = centres_of_mass(before.vertices)[:, 2]
    level = heights(before.vertices, floor_z=before.floor_z)
    rose = centres_of_mass(torn.vertices)[:, 2] - centres > float(pull.raised[-1]) / 2
    lowest = float(before.vertices[rose, :, 2].min(axis=1).mean()) - before.floor_z if rose.any() else math.nan
    return {
        PROCEDURE: procedure,
        THETA: settings[2]["theta_deg"] if procedure == INTERNAL else math.nan,
        ASPECT: round(run.manifest.aspect_ratio, 6),
        UPPER: upper,
        SEED: run.manifest.seed,
        "smarticles [-]": run.manifest.count,
        "fidelity": run.manifest.fidelity,
        ACTIVE: duration(run.phases[2]) if procedure != STATIC else 0.0,
        CROSSINGS: table.loc[rest]["crossings mean [-]"],
        ABOVE: float((centres - before.floor_z > upper).mean()),
        TOP: level.top,
        KEPT: level.mean_com / heights(walled.vertices, floor_z=walled.floor_z).mean_com,
        PEAK: highest.force / weight,
        RAISED: highest.raised,
        WORK: pull.work / weight / run.manifest.middle_length_m,
        BEFORE: pull.before / weight,
        THROUGH: (held_at(pull, highest.time) - pull.held[0]) / weight,
        HELD_FAST: float(held),
        LIMIT: (float(limit) if isinstance(limit, int | float) else math.inf) / run.manifest.count / weight_of_one(run),
        CARRIED: math.nan if held else float(rose.mean()),
        BREAK: math.nan if held else lowest,
        "time without the wall [s]": duration(run.phases[free]),
        "scene_sha256": run.manifest.scene_sha256,
        "run": run.path.name,
    }


def force_history(run: Run) -> History:
    """Read the force over n W_s against the hook's way [mm]."""
    pull = read_pull(run, run.series, run.phases[-1].index)
    times, force = moving_mean(pull)
    way = 1e3 * np.interp(times, pull.edges, pull.raised)
    return History(times=way, values=force / run.manifest.count / weight_of_one(run), active=0.0)


def compared(runs: pd.DataFrame) -> pd.DataFrame:
    """Select the runs of procedures that are compared: of the internal oscillation those of one θ."""
    return pd.concat([of_procedure(runs, name) for name in runs[PROCEDURE].unique()]) if len(runs) else runs


def over_heights(runs: pd.DataFrame) -> pd.DataFrame:
    """Average over the heights of the hook, by procedure, l/w and seed, where there are runs at all heights."""
    columns = [PEAK, RAISED, WORK, THROUGH, CARRIED, ABOVE, CROSSINGS, HELD_FAST]
    grouped = compared(runs).groupby([PROCEDURE, ASPECT, SEED])
    return grouped[columns].mean()[grouped[UPPER].nunique() == runs[UPPER].nunique()].reset_index()


def of(table: pd.DataFrame, procedure: str) -> pd.DataFrame:
    """Select the rows of one procedure."""
    return table[table[PROCEDURE] == procedure]


def less(table: pd.DataFrame, quantity: str, one: str, other: str) -> SeedMean:
    """Subtract one procedure from another, seed by seed."""
    return mean_difference(of(table, one), of(table, other), quantity)


def _ranked(table: pd.DataFrame, quantity: str, names: tuple[str, ...]) -> str:
    return ranked({name: float(of(table, name)[quantity].mean()) for name in names})


def _peaks(table: pd.DataFrame) -> str:
    held = int((table[HELD_FAST] > 0).sum())
    return f"{_ranked(table, PEAK, ALL)}; held fast: {held} of {len(table)} seeds and procedures"


def _works(table: pd.DataFrame) -> str:
    names = {WORK: "work", THROUGH: "through to the grid at the peak", CARRIED: "carried off", ABOVE: "above the hook"}
    return "; ".join(f"{name} {_ranked(table, quantity, ALL)}" for quantity, name in names.items())


def other_order(table: pd.DataFrame) -> Outcome:
    """Find pairs of procedures that differ clearly both in ⟨N⟩ and in peak force, in one sense or in opposite ones."""
    pairs: dict[bool, list[str]] = {True: [], False: []}
    effects = []
    for one, other in itertools.combinations(THREE, 2):
        bounded = bool(of(table, one)[HELD_FAST].any() or of(table, other)[HELD_FAST].any())
        both = [Effect(label="", value=less(table, quantity, one, other)) for quantity in (CROSSINGS, PEAK)]
        signs = [(one.verdict == "found") - (one.verdict == "not found") for one in both]
        if all(signs) and not bounded:
            pairs[signs[0] == signs[1]].append(f"{one} and {other}")
        effects += both
    verdict = Verdict.NOT_RESOLVED
    if pairs[False]:
        verdict = Verdict.FOUND
    elif any(effect.verdict == Verdict.NO_DATA for effect in effects):
        verdict = Verdict.NO_DATA
    elif len(pairs[True]) == len(THREE):
        verdict = Verdict.NOT_FOUND
    note = f"by ⟨N⟩: {_ranked(table, CROSSINGS, THREE)}; by peak: {_ranked(table, PEAK, THREE)}; clearly apart in the "
    note += f"opposite sense: {', '.join(pairs[False]) or 'none'}, in the same: {', '.join(pairs[True]) or 'none'}"
    return Outcome(note=note, verdict=verdict)


def harder_but_brittle(table: pd.DataFrame) -> list[Effect]:
    """Compare peak force and displacement at the peak after shape change with those after internal oscillation."""
    one, other = (bool(of(table, name)[HELD_FAST].any()) for name in (SHAPE, INTERNAL))
    harder, sooner = (less(table, quantity, SHAPE, INTERNAL) for quantity in (PEAK, RAISED))
    unknown = one or other
    return [
        Effect(label="peak of shape-change less internal", value=harder, may_be_higher=one, may_be_lower=other),
        Effect(
            label="hook raised at the peak",
            value=sooner,
            sign=-1,
            unit=" m",
            may_be_higher=unknown,
            may_be_lower=unknown,
        ),
    ]


def several_amplitudes(runs: pd.DataFrame) -> pd.DataFrame:
    """Select runs of the internal oscillation, where there are several θ."""
    internal = of(runs, INTERNAL)
    return internal[internal.groupby([ASPECT, UPPER])[THETA].transform("nunique") > 1]


def _slopes(table: pd.DataFrame) -> list[Effect]:
    return [
        Effect(
            label=f"{name} against θ",
            value=slope_within(table[THETA], table[quantity], blocks(table, PILE)),
            sign=0,
            unit=" per degree",
        )
        for quantity, name in ((PEAK, "peak"), (CROSSINGS, "⟨N⟩"))
    ]


THREE, ALL = (EXTERNAL, INTERNAL, SHAPE), (EXTERNAL, INTERNAL, SHAPE, STATIC)
PILE = (UPPER, ASPECT, SEED)

FINDINGS = (
    above(
        "shape-change-strongest",
        "Shape change has the highest peak force of the three procedures",
        PEAK,
        SHAPE,
        (EXTERNAL, INTERNAL),
        of=of,
        beside=(STATIC,),
        bounds=HELD_FAST,
        rows=over_heights,
        label="peak",
        note=_peaks,
        found_if="peak force above those of external and of internal oscillation, seed by seed, mean over the heights",
    ),
    above(
        "internal-weakest",
        "Internal oscillation has the least peak force of the three procedures",
        PEAK,
        INTERNAL,
        (EXTERNAL, SHAPE),
        of=of,
        sign=-1,
        beside=(STATIC,),
        bounds=HELD_FAST,
        rows=over_heights,
        label="peak",
        found_if="peak force below those of external oscillation and of shape change, seed by seed, mean "
        "over the heights",
    ),
    Finding(
        id="other-order-than-crossings",
        says="Over the three procedures, peak force and ⟨N⟩ do not keep the same order",
        outcome=other_order,
        rows=over_heights,
        found_if="two procedures differ clearly in both, in opposite senses; not found if all three pairs differ "
        "clearly in the same sense",
    ),
    Finding(
        id="harder-but-brittle",
        says="Like a metal cooled fast, a pile after shape change is harder but more brittle than after internal "
        "oscillation",
        outcome=harder_but_brittle,
        rows=over_heights,
        found_if="peak force above, and reached at a smaller displacement of the hook, seed by seed; the paper says "
        "that its fracture tests support this, not by which measure",
    ),
    above(
        "tougher",
        "(ours, not the paper's) shape change takes the most work to tear",
        WORK,
        SHAPE,
        (EXTERNAL, INTERNAL),
        of=of,
        bounds=HELD_FAST,
        rows=over_heights,
        label="work",
        note=_works,
        found_if="∫ F dz over the whole pull above those of external and of internal oscillation, seed by seed, mean "
        "over the heights",
    ),
    ranks(
        "strength-with-crossings",
        "Tensile strength and number of entanglements are connected",
        CROSSINGS,
        PEAK,
        within=PILE,
        bounds=HELD_FAST,
        rows=compared,
        unit="n W_s per link",
        found_if=f"over all procedures, within runs of one height and seed: {BY_RANKS}",
    ),
    ranks(
        "strength-with-crossings-over-theta",
        "Internal oscillation: over θ, the peak force goes with ⟨N⟩",
        CROSSINGS,
        PEAK,
        within=PILE,
        bounds=HELD_FAST,
        rows=several_amplitudes,
        unit="n W_s per link",
        beside=_slopes,
        found_if=f"over θ, within runs of one height and seed: {BY_RANKS}",
    ),
)

_LABELS = {
    STATIC: "static",
    EXTERNAL: "external",
    INTERNAL: rf"internal, $\theta$ = {AMPLITUDE:g}°",
    SHAPE: "shape change",
}

FIGURES = (
    Histories(
        name="force_raised",
        history=force_history,
        rows=compared,
        split=by_procedure(_LABELS),
        panels=UPPER,
        panel="hook {:g} mm above the floor",
        panel_scale=1e3,
        width=0.5,  # the side of the hook's bars
        unit="mm",
        x_label="hook raised by [mm]",
        y_label=r"force on the hook $F/(n W_\mathrm{s})$ [-]",
    ),
    Means(
        name="strength",
        quantities=[QUANTITIES[name] for name in (PEAK, RAISED, WORK, CARRIED)],
        x=UPPER,
        x_scale=1e3,
        x_label="hook above the floor [mm]",
        ticks=True,
        split=by_procedure(_LABELS, apart=0.3, line=False),
    ),
    Scatter(
        name="peak_crossings",
        x=QUANTITIES[CROSSINGS],
        y=QUANTITIES[PEAK],
        split=by_procedure(_LABELS, line=False),
        bounds=HELD_FAST,
    ),
)

STUDY = Study(
    name="strength",
    title="Piles torn between a grip on the floor and a hook, against the findings of Savoie et al.",
    measure=measure,
    keys=(
        Key(column=ASPECT, label="l/w", form="g"),
        Key(column=UPPER, label="hook [mm]", form="g", scale=1e3),
        Key(column=PROCEDURE, label="procedure", order=(STATIC, EXTERNAL, INTERNAL, SHAPE)),
        Key(column=THETA, label="θ", form="g", unit="°"),
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
