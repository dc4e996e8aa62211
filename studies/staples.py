"""Staples with legs at 20° and at 90° to the crown are vibrated and then torn: which bundle is stronger?

Sohn, Pezeshki and Barthelat (arXiv 2510.09933) find that staples of 90° entangle more when they are poured, that
vibration entangles those of 20° faster, and that bundles of 20° then are almost ten times as strong; one to three
chains carry the tension (arXiv 2412.05415). Here a pile is poured onto a grid, vibrated or not, freed of the wall, and
torn by a hook above the grid. In the variant `grips` a column within a smooth wall is torn between two grips, which
hold its bottom and its top.

Piles of both angles are paired by seed. If the hook stops at its force limit ("held fast"), the peak force is a lower
bound. Of a test between grips the moving grip is called the hook, and the one that rests the grid.
"""

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd

from dem.body.forces import NONE
from dem.errors import InputError
from dem.record.forces import RecordedForces, read_forces
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.bars import body_centres
from postprocess.measures.entanglement import polygon_crossings
from postprocess.measures.graph import entanglement_graph
from postprocess.measures.grips import TENSION, read_tension
from postprocess.measures.pull import (
    PULL,
    WINDOW,
    HookPull,
    held_fast,
    moving_mean,
    peak,
    read_pull,
    weight_of_one,
)
from postprocess.statistics.points import SEED, paired_differences
from postprocess.statistics.seeds import SeedMean, mean_over_seeds
from studies.framework.figures import Histories, History, Means, one_by_one
from studies.framework.findings import Effect, Finding, Outcome, means_by
from studies.framework.provenance import Reference
from studies.framework.runs import Key, Row, declare, last_columns, run_columns
from studies.framework.study import COUNT, Study

ANGLE, GAMMA = "crown-leg angle [deg]", "peak acceleration [g]"
NARROW, SQUARE = 20.0, 90.0  #: The two angles that are compared [deg]
PEAK, RAISED, WORK = "peak force over W [-]", "hook raised at the peak [m]", "work over W crown [-]"
ABOVE, STRENGTH = "staples above the hook [-]", "tension from hook to grid over W [-]"
LOG_PEAK = "log10 of the peak force over W [-]"
BEFORE, HELD_FAST, CHAINS = "load before the pull over W [-]", "held fast [-]", "chains at the peak [-]"
POURED, LINKS, HEIGHT = "links per staple poured [-]", "links per staple [-]", "com height [m]"

TIMES = 5.0  #: Ratio of strengths above which "almost ten times" counts as found: half of ten
MOST_CHAINS = 3.0  #: Largest number of chains that the paper states
#: Phases of the two tests, but for a vibration and its rest: between a grid and a hook, and between two grips
TESTS = (("deposit", "relax", "remove-container", PULL), ("deposit", "relax", TENSION))
CUTS = (0.25, 0.5, 0.75)  #: Heights above the grid at which chains are counted, over the distance from grid to hook

QUANTITIES = declare(
    {
        PEAK: ("peak", ".3g", f"largest mean over {WINDOW:g} s of the force on the hook; a bound where it held fast"),
        LOG_PEAK: ("", "", "decimal logarithm of the peak force over W, whose scatter is even to both sides"),
        ABOVE: ("above", ".0f", "number of staples with the centre above the hook before the pull"),
        STRENGTH: (
            "tension",
            ".3g",
            f"largest mean over {WINDOW:g} s of the upward force on the grid, 0 where it is pushed down throughout; a "
            "bound where the hook held fast",
        ),
        RAISED: ("raised at it [mm]", ".1f", "displacement of the hook at the peak"),
        WORK: ("work / W crown", ".3g", "∫ F dz over the whole pull"),
        BEFORE: ("before", ".3g", "force on the hook before the pull, by weight and by bracing of the pile"),
        HELD_FAST: ("held fast", ".2f", "1 where the hook was stopped by its force limit, 0 where it arrived"),
        CHAINS: (
            "chains",
            ".2f",
            "(Σ T)²/Σ T² of the upward pulls T between pairs of staples above and below a level, in the frame nearest "
            "to the peak, mean over three levels between grid and hook",
        ),
        POURED: ("links poured", ".2f", "pairs of staples with one through the polygon of the other, per staple"),
        LINKS: ("links before", ".2f", "the same at rest before the wall went"),
        HEIGHT: ("height [mm]", ".1f", "height of the centre of mass above the floor, without the wall"),
    },
    axes={
        LOG_PEAK: r"peak force $\log_{10}(F_\mathrm{max}/W)$ [-]",
        CHAINS: "chains at the peak [-]",
        LINKS: "links per staple [-]",
        WORK: r"work / ($W$ crown) [-]",
    },
    scales={RAISED: 1e3, HEIGHT: 1e3},
)


def measure(run: Run) -> Row:
    """Measure links before and after vibration, hook force, and chains at its peak; return the run's row."""
    phases = run.phases
    types = tuple(phase.type for phase in phases)
    shaken = types[2:4] == ("shake", "relax")
    if types[:2] + types[4 if shaken else 2 :] not in TESTS:
        raise InputError(f"{run.path}: not a pour, a rest, a vibration with a rest or none, and a pull; leave it out")
    parts = [run.frames.in_phase(phase.index) for phase in phases]
    if not all(parts[1:]):
        raise InputError(f"{run.path}: no frame of a phase; run it again")
    pull = pull_of(run)
    highest, weight = peak(pull), weight_of_one(run)
    free, frames = parts[-2][-1], parts[-1]
    since = np.array([frame.time for frame in frames]) - free.time
    torn = frames[int(np.abs(since - highest.time).argmin())]
    grid, hook = free_between(run, free)
    return {
        ANGLE: angle_of(run),
        GAMMA: float(run.scene["phases"][2]["peak_acceleration_g"]) if shaken else 0.0,
        **{name: value for name, value in run_columns(run).items() if name in (SEED, COUNT, "fidelity")},
        POURED: links_per_body(parts[1][-1]),
        LINKS: links_per_body(parts[3 if shaken else 1][-1]),
        HEIGHT: float(body_centres(free)[:, 2].mean()) - free.floor_z,
        PEAK: highest.force / weight,
        LOG_PEAK: math.log10(highest.force / weight) if highest.force > 0 else math.nan,
        ABOVE: int((body_centres(free)[:, 2] >= hook).sum()),
        STRENGTH: float(np.maximum(0.0, peak(replace(pull, force=pull.held)).force)) / weight,
        RAISED: highest.raised,
        WORK: pull.work / weight / run.manifest.middle_length_m,
        BEFORE: pull.before / weight,
        HELD_FAST: float(held_fast(pull.raised, run.scene["phases"][-1])),
        CHAINS: chains_between(torn, grid, hook + highest.raised) if run.forces is not None else math.nan,
        **last_columns(run),
    }


def pull_of(run: Run) -> HookPull:
    """Return the pull that ends a run.

    Of a test between grips the moving one is the upper hook; load before and force on the lower hook are NaN.
    """
    phase = run.phases[-1]
    if phase.type == PULL:
        return read_pull(run, run.series, phase.index)
    test = read_tension(run, run.series, phase.index)
    return HookPull(
        edges=np.arange(len(test.pulls) + 1, dtype=np.float64) * test.interval,
        raised=np.concatenate([[0.0], test.elongations]),
        force=test.pulls,
        held=np.full_like(test.held, math.nan),  # the floor pushes what the resting grip holds
        before=math.nan,
        engine_work=math.nan,
        residual=math.nan,
    )


def free_between(run: Run, free: Frame) -> tuple[float, float]:
    """Return the heights [m] between which a pile is free: grid and hook, or edges of the grips.

    `free`: the last frame before the pull. Grips hold the bodies with their centre beyond these heights.
    """
    if (hooks := run.scene.get("hooks")) is not None:
        return free.floor_z + hooks["lower_height_m"], free.floor_z + hooks["upper_height_m"]
    heights, grip = body_centres(free)[:, 2], run.scene["phases"][-1]["grip_m"]
    return float(heights.min()) + grip, float(heights.max()) - grip


def force_history(run: Run) -> History:
    """Read the force on the hook over the weight of one staple [-] against its displacement [mm]."""
    pull = pull_of(run)
    times, force = moving_mean(pull)
    return History(times=1e3 * np.interp(times, pull.edges, pull.raised), values=force / weight_of_one(run))


def angle_of(run: Run) -> float:
    """Return the angle between crown and legs of a run's staples [deg]; 90 of smarticles.

    InputError if bodies are of another shape, of several kinds, or have unlike legs.
    """
    shapes = run.scene.get("particle") or []
    angles = set(np.ravel([shape.get("angle_deg") for shape in shapes if shape.get("shape") == "staple"]).tolist())
    if len(shapes) > 1 or (shapes and len(angles) != 1):
        raise InputError(f"{run.path}: its bodies are not staples of one kind with legs alike; leave it out")
    return float(angles.pop()) if shapes else SQUARE


def links_per_body(frame: Frame) -> float:
    """Return the number of linked pairs over the number of bodies [-].

    A pair is linked if one body passes through the polygon that the other spans.
    """
    graph = entanglement_graph(polygon_crossings(frame.segments, frame.body), least=1)
    return len(graph.i) / frame.count


def chains_between(frame: Frame, low: float, high: float, forces: RecordedForces | None = None) -> float:
    """Return the mean number of tensile force chains [-] through levels `CUTS` between two heights [m].

    NaN if no level carries tension. The recorded forces of the frame are read from its run directory if not given.
    """
    forces = read_forces(frame) if forces is None else forces
    found = [chains_through(frame, forces, low + part * (high - low)) for part in CUTS]
    known = [one for one in found if not math.isnan(one)]
    return float(np.mean(known)) if known else math.nan


def chains_through(frame: Frame, forces: RecordedForces, level: float) -> float:
    """Return the number of chains [-] that carry tension through a level [m]: (Σ T)² / Σ T².

    T is the upward pull of a body whose centre is above the level on one whose centre is below it, summed over their
    contacts; pushes are left out. The number is n if n pairs carry equal pulls; NaN if there is no pull.
    """
    contacts = forces.contacts
    between = contacts.boundaries == NONE
    pair, pulled = contacts.smarticles[between], contacts.forces[between, 2]
    above = body_centres(frame)[:, 2] > level
    first, second = above[pair].T
    across = first != second
    # Recorded is the force on the first body.
    upward = np.where(first, -pulled, pulled)[across]
    _, number = np.unique(pair[across], axis=0, return_inverse=True)
    tension = np.bincount(number.ravel(), upward)
    tension = tension[tension > 0]
    return float(tension.sum() ** 2 / (tension**2).sum()) if len(tension) else math.nan


def ratio(table: pd.DataFrame, gamma: float, *, times: float) -> Effect:
    """Compare the peak forces at 20° and at 90° after vibration at Γ = `gamma`, as an effect to be judged.

    Its value is the mean over seeds of ln(peak force at 20° / peak force at 90°), its threshold is ln `times`.
    """
    own = table[table[GAMMA] == gamma]
    mean = narrow_less_square(own.assign(log=np.log(own[PEAK])), "log")
    low, middle, high = (math.exp(mean.value + half) for half in (-mean.half_width, 0.0, mean.half_width))
    return Effect(
        label=f"Γ = {gamma:g}: peak force at 20° over that at 90°",
        value=mean,
        threshold=math.log(times),
        text=f"{middle:.3g} ({low:.3g} to {high:.3g} at 95 %; n = {mean.count})" if mean.count else "no data",
        may_be_higher=bool(own.loc[own[ANGLE] == NARROW, HELD_FAST].any()),
        may_be_lower=bool(own.loc[own[ANGLE] == SQUARE, HELD_FAST].any()),
    )


def vibrated(table: pd.DataFrame) -> list[float]:
    """Return the distinct peak accelerations [g] of the runs with vibration, ascending."""
    return sorted(float(gamma) for gamma in table[GAMMA].unique() if gamma > 0)


def stronger(table: pd.DataFrame, *, times: float) -> Outcome:
    """Judge whether bundles of 20° are more than `times` as strong as bundles of 90° after each vibration."""
    held = table.groupby([ANGLE, GAMMA])[HELD_FAST].agg(["sum", "size"])
    cells = ", ".join(
        f"{angle:g}° Γ = {gamma:g}: {int(row['sum'])} of {int(row['size'])}"
        for (angle, gamma), row in held.iterrows()
        if row["sum"]
    )
    after = table[table[GAMMA] > 0]
    note = f"tension by angle [W]: {means_by(after, STRENGTH, ANGLE, '.3g')}; "
    note += f"peak by angle [W]: {means_by(after, PEAK, ANGLE, '.3g')}; held fast (bounds): {cells or 'none'}"
    return Outcome(effects=[ratio(table, gamma, times=times) for gamma in vibrated(table)], note=note)


def narrow_less_square(table: pd.DataFrame, column: str) -> SeedMean:
    """Return the mean over seeds of a column's value at 20° less its value at 90°, for one vibration."""
    return mean_over_seeds(paired_differences(table, column, ANGLE, (SQUARE, NARROW), [SEED])[column])


def poured_more(table: pd.DataFrame) -> Outcome:
    """Judge whether poured staples of 90° have more links than poured staples of 20°."""
    note = f"by angle: {means_by(table, POURED, ANGLE, '.2f')}"
    gamma = 0.0 if (table[GAMMA] == 0).any() else float(table[GAMMA].min())
    value = narrow_less_square(table[table[GAMMA] == gamma], POURED)
    return Outcome(effects=[Effect(label="links per staple, 20° less 90°", value=value, sign=-1)], note=note)


def entangles_faster(table: pd.DataFrame, *, relative: bool) -> Outcome:
    """Judge whether vibration adds more links per staple at 20° than at 90°.

    `relative`: the links added are divided by the links after pouring.
    """
    gain = table[LINKS] / table[POURED] - 1 if relative else table[LINKS] - table[POURED]
    what = "links gained over those poured" if relative else "links gained per staple"
    effects, parts = [], []
    for gamma in vibrated(table):
        own = table.assign(gain=gain)[table[GAMMA] == gamma]
        value = narrow_less_square(own, "gain")
        effects.append(Effect(label=f"Γ = {gamma:g}: {what}, 20° less 90°", value=value))
        parts.append(f"Γ = {gamma:g} by angle: {means_by(own, 'gain', ANGLE, '.2f')}")
    return Outcome(effects=effects, note="; ".join(parts))


def grows(table: pd.DataFrame, *, angle: float) -> Outcome:
    """Judge whether vibration makes bundles of one angle stronger, paired by seed."""
    own = table[table[ANGLE] == angle]
    held = set(own.loc[own[HELD_FAST] > 0, GAMMA])
    effects = [
        Effect(
            label=f"Γ = {gamma:g}: log10 of the peak force, vibrated less poured",
            value=mean_over_seeds(paired_differences(own, LOG_PEAK, GAMMA, (0.0, gamma), [SEED])[LOG_PEAK]),
            may_be_higher=gamma in held,
            may_be_lower=0.0 in held,
        )
        for gamma in vibrated(own)
    ]
    return Outcome(effects=effects, note=f"peak force by Γ [W]: {means_by(own, PEAK, GAMMA, '.3g')}")


def few_chains(table: pd.DataFrame, *, angle: float) -> Outcome:
    """Judge whether at most three chains carry the tension of vibrated bundles of one angle."""
    own = table[(table[ANGLE] == angle) & (table[GAMMA] > 0)]
    effects = [
        Effect(
            label=f"Γ = {gamma:g}: chains",
            value=mean_over_seeds(own.loc[own[GAMMA] == gamma, CHAINS].tolist()),
            sign=-1,
            threshold=MOST_CHAINS,
        )
        for gamma in vibrated(own)
    ]
    return Outcome(effects=effects)


AFTER_EACH = "after vibration, the mean over seeds of ln(peak force at 20° / at 90°) is above ln {}"

FINDINGS = (
    Finding(
        id="narrow-stronger",
        says="After vibration bundles of 20° are stronger than bundles of 90°",
        outcome=partial(stronger, times=1.0),
        found_if=AFTER_EACH.format("1"),
    ),
    Finding(
        id="almost-ten-times",
        says="They are almost ten times as strong",
        outcome=partial(stronger, times=TIMES),
        found_if=AFTER_EACH.format(f"{TIMES:g}, half of ten times"),
    ),
    Finding(id="poured-less", says="Before vibration staples of 90° are more entangled", outcome=poured_more),
    Finding(
        id="entangles-faster",
        says="Vibration entangles staples of 20° faster than staples of 90°",
        outcome=partial(entangles_faster, relative=False),
    ),
    Finding(
        id="entangles-faster-relative",
        says="(ours) relative to the links of the poured pile, it entangles staples of 20° faster",
        outcome=partial(entangles_faster, relative=True),
    ),
    Finding(
        id="vibration-strengthens-20",
        says="Bundles of 20° become stronger by vibration",
        outcome=partial(grows, angle=NARROW),
    ),
    Finding(
        id="few-chains-20",
        says="One to three chains carry the tension, at 20°",
        outcome=partial(few_chains, angle=NARROW),
    ),
    Finding(
        id="few-chains-90",
        says="One to three chains carry the tension, at 90°",
        outcome=partial(few_chains, angle=SQUARE),
    ),
)

_BY_ANGLE = one_by_one(ANGLE, "{:g}°".format, last=0.6)

FIGURES = (
    Histories(
        name="force_raised",
        history=force_history,
        split=_BY_ANGLE,
        panels=GAMMA,
        panel="Γ = {:g}",
        width=0.5,  # the side of the hook's bars
        unit="mm",
        x_label="hook raised by [mm]",
        quantities={"": r"force on the hook $F/W$ [-]"},
        notes=["A line ends where the force limit stopped the first of its runs."],
    ),
    Means(
        name="strength",
        quantities=[QUANTITIES[name] for name in (LOG_PEAK, LINKS, WORK, CHAINS)],
        x=GAMMA,
        x_label=r"peak acceleration $\Gamma$ of the vibration [-]",
        split=_BY_ANGLE,
        notes=["Peak forces of runs that the limit stopped are lower bounds."],
    ),
)

STUDY = Study(
    name="staples",
    title="Staples of 20° and 90°, vibrated and torn, against the findings of Sohn, Pezeshki and Barthelat",
    measure=measure,
    keys=(Key(column=ANGLE, label="angle", form="g", unit="°"), Key(column=GAMMA, label="Γ", form="g")),
    quantities=tuple(QUANTITIES.values()),
    findings=FINDINGS,
    figures=FIGURES,
    same_count=(ANGLE,),
    order=(ANGLE, GAMMA, SEED),
    bounds=(HELD_FAST, "held fast"),
    one_engine=True,
    remarks=(
        "W: weight of one staple. The peak force lifts staples, too; the tension from hook to grid goes through the "
        "whole pile. A link: two staples, one of which passes through the polygon of the "
        "other, which is closed straight between its tips. Staples are rigid: a chain of them between grid and hook "
        "gives way at its contacts alone, so that the limit of the force ends the pull.",
    ),
    reference=Reference(
        statement="abstracts of Sohn, Pezeshki and Barthelat, arXiv 2510.09933 and 2412.05415; no data of theirs",
        facts={"arxiv": "2510.09933, 2412.05415", "what": "statements in the abstracts"},
    ),
    pictured={"angle_deg": 20, "gamma": 6},
)
