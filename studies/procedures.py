"""Shape change, external and internal oscillation of smarticles of several l/w and amplitudes θ.

Smarticles are poured into a cylinder and go through one of three activities. Packing fraction, entanglement, energy and
height are compared with the findings of Savoie, Tuazon, Bhamla and Goldman, "Amorphous Entangled Active Matter", Soft
Matter 2023. There are no static runs: static is the state of every run before its activity.

Runs of equal aspect ratio and seed begin with one pile. So procedures are compared pair by pair, and slopes against θ
are fitted within these blocks; errors come from the scatter over seeds and aspect ratios.
"""

import math
from collections.abc import Sequence
from functools import partial

import numpy as np
import pandas as pd

from dem.record.run import Run
from postprocess.measures.motors import APART
from postprocess.measures.packing import DEFINITIONS
from postprocess.statistics.points import ASPECT, SEED, pairs
from postprocess.statistics.seeds import CONFIDENCE, difference, mean_over_seeds, parabola, slope_within
from studies.framework.figures import (
    ASPECT_LABEL,
    CROSSINGS_LABEL,
    PROCEDURE_LABELS,
    THETA_LABEL,
    Histories,
    History,
    Means,
    Series,
    Split,
    by_procedure,
    one_by_one,
)
from studies.framework.findings import Effect, Finding, Outcome, Rows, Verdict, above, decide, mean, means_by, slope
from studies.framework.procedures import (
    ACTIVE,
    AMPLITUDE,
    CROSSINGS,
    ENERGY,
    EXTERNAL,
    HALF,
    HEIGHT,
    INTERNAL,
    LOWEST,
    ORDER,
    PHI,
    PHI_ACTIVE,
    PROCEDURE,
    SAMPLED,
    SHAPE,
    STATIC,
    STRAIGHT,
    THETA,
    activity,
    height_history,
    of_procedure,
    procedure_row,
    samples,
)
from studies.framework.runs import ASPECT_KEY, DEFINITION, THETA_KEY, Key, declare, duration
from studies.framework.study import Study

FLAT = 0.2  # change of ⟨N⟩ from end to end over its mean, below which ⟨N⟩ hardly depends on l/w
NEAR = 0.15  # distance in l/w from 1.0 at which a maximum is near 1.0: one and a half steps of the paper's l/w
EARLY = 0.24  # share of the activity within which half of the compaction is early: twice the paper's 12 %
MARGINAL = 0.5  # gain in φ over that at θ = 10°, below which a gain is marginal
FACTOR = 10.0  # least energy of the shape change over that of the internal oscillation
PEAK = 0.9  # l/w of the local maximum of the energy in the paper

QUANTITIES = declare(
    {
        PHI_ACTIVE: ("φ_f", ".4f", "packing fraction over the last frames of the activity; static: at rest"),
        PHI: ("φ at rest again", ".4f", "packing fraction at rest: after the activity, or of the static state"),
        CROSSINGS: ("⟨N⟩", ".2f", "⟨N⟩ at rest: links of others through a smarticle's plane"),
        ENERGY: ("energy [J]", ".2e", "work of the motors, or of the shaken container, on the smarticles"),
        SAMPLED: ("", "", "work of the motors, summed as torque times change of angle, as the paper's code could"),
        HEIGHT: ("h/h0", ".3f", "height of the centre of mass at rest after the activity, over that before it"),
        STRAIGHT: ("", "", "height of the centre of mass over h0 at the end of the straight state of the shape change"),
        LOWEST: ("", "", "least height over h0, means over 0.1 s, while barbs close in the shape change"),
        HALF: ("", "", "share of the activity after which half of the final compaction is reached; empty without any"),
    },
    axes={
        PHI_ACTIVE: "packing fraction $\\phi_\\mathrm{f}$\nat the end of the activity [-]",
        CROSSINGS: CROSSINGS_LABEL,
        ENERGY: "energy per smarticle,\nevery step [J]",
        SAMPLED: f"energy per smarticle,\nsummed every {APART:g} s [J]",
    },
)


def only(procedure: str, drop: str | None = None) -> Rows:
    """Return a function that selects the rows of a procedure, without rows whose column `drop` is NaN."""
    return lambda table: of_procedure(table, procedure).dropna(subset=[drop] if drop else [])


def amplitudes(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the internal oscillation at all θ."""
    return table[table[PROCEDURE] == INTERNAL]


def pairs_of(table: pd.DataFrame, quantity: str, one: str, other: str) -> pd.DataFrame:
    """Return values of two procedures at equal aspect ratio and seed: columns `one` and `other`."""
    return pairs(of_procedure(table, one), of_procedure(table, other), quantity)


def gains(procedure: str) -> Rows:
    """Return a function that computes a procedure's gain of φ_f over the static state, per l/w and seed."""

    def rows(table: pd.DataFrame) -> pd.DataFrame:
        both = pairs_of(table, PHI_ACTIVE, procedure, STATIC)
        return both.assign(**{PHI_ACTIVE: both["one"] - both["other"]})

    return rows


def with_aspect(name: str, says: str, rows: Rows, quantity: str, sign: int = 1) -> Finding:
    """Make the finding that a quantity of the selected samples rises (sign +1) or falls (−1) with l/w."""
    return slope(name, says, quantity, ASPECT, sign=sign, rows=rows)


def with_amplitude(name: str, says: str, quantity: str, sign: int = 1, rows: Rows = amplitudes) -> Finding:
    """Make the finding that a quantity rises (sign +1) or falls (−1) with θ at equal l/w and seed."""
    return slope(name, says, quantity, THETA, sign=sign, within=(ASPECT, SEED), rows=rows)


def _compacts_early(table: pd.DataFrame) -> Outcome:
    drop = Effect(label="h comes down by, of h0,", value=mean_over_seeds(1 - table[HEIGHT]))
    half = Effect(
        label="half is reached after, of the activity,", value=mean_over_seeds(table[HALF]), sign=-1, threshold=EARLY
    )
    # The time of half of the compaction is meaningless unless the pile compacts.
    return Outcome(effects=[half, drop], verdict=drop.verdict if drop.verdict != Verdict.FOUND else half.verdict)


def _largest_gains_little(table: pd.DataFrame) -> list[Effect]:
    gain = table.merge(table[table[PROCEDURE] == STATIC], on=[ASPECT, SEED], suffixes=("", " static"))
    gain = gain[gain[PROCEDURE] == INTERNAL].assign(gain=lambda row: row[PHI_ACTIVE] - row[f"{PHI_ACTIVE} static"])
    wide = gain.pivot_table(index=[ASPECT, SEED], columns=THETA, values="gain").reindex(columns=[AMPLITUDE, 30.0])
    share = mean_over_seeds((wide[30.0] / wide[AMPLITUDE]).dropna())
    return [Effect(label=f"Δφ at 30° over that at {AMPLITUDE:g}°", value=share, sign=-1, threshold=MARGINAL)]


def _logarithms(table: pd.DataFrame, one: str, other: str) -> pd.Series:
    """Return log10(energy of procedure `one` / energy of `other`) of each pair of runs, indexed by l/w.

    Pairs with an energy of 0 or less are left out.
    """
    both = pairs_of(table, ENERGY, one, other)
    both = both[(both["one"] > 0) & (both["other"] > 0)].set_index(ASPECT)
    return np.log10(both["one"] / both["other"])


def _shape_change_costs(table: pd.DataFrame) -> Outcome:
    ratio = _logarithms(table, SHAPE, INTERNAL)
    value = mean_over_seeds(ratio)
    error = f"×/÷ {10**value.standard_error:.3g}" if value.count > 1 else "without an error"
    text = f"{10**value.value:.3g} {error} (n = {value.count})" if value.count else ""
    by = ", ".join(f"{aspect:g}: {10**one:.3g}" for aspect, one in ratio.groupby(level=0).mean().items())
    effect = Effect(label="ratio, geometric mean,", value=value, threshold=math.log10(FACTOR), text=text)
    return Outcome(effects=[effect], note=f"by l/w {by}" if by else "")


def _costs_by_samples(table: pd.DataFrame) -> Outcome:
    both = pairs_of(table, SAMPLED, SHAPE, INTERNAL)
    means = both.groupby(ASPECT)[["one", "other"]].mean()
    by = ", ".join(f"{aspect:g}: {row['one']:.3g} and {row['other']:.3g}" for aspect, row in means.iterrows())
    value = mean_over_seeds(both["one"] - FACTOR * both["other"])
    return Outcome(
        effects=[Effect(label="shape-change less 10 times internal", value=value, unit=" J")],
        note=f"the two by l/w {by} J" if by else "",
    )


def _little_less(table: pd.DataFrame) -> list[Effect]:
    value = mean_over_seeds(_logarithms(table, INTERNAL, EXTERNAL) * math.log(10))
    text = f"{math.exp(value.value):.3g} ×/÷ {math.exp(value.half_width):.3g} (n = {value.count})"
    return [
        Effect(
            label="internal over external, geometric mean and 95 %:",
            value=value,
            sign=-1,
            text=text if value.count > 1 else "no data",
        ),
        Effect(label="it is also", value=value, threshold=-math.log(2), text="above 1/2"),
    ]


def _local_maximum(table: pd.DataFrame, quantity: str) -> list[Effect]:
    wide = table.pivot_table(index=SEED, columns=ASPECT, values=quantity)
    around = [aspect for aspect in wide.columns if 0.05 < abs(aspect - PEAK) < 0.15] if PEAK in wide else []
    return [
        Effect(label=f"at {PEAK:g} less at {aspect:g}", value=mean_over_seeds(wide[PEAK] - wide[aspect]), unit=" J")
        for aspect in around
        if len(around) == 2
    ]


def _static_flat(table: pd.DataFrame) -> Outcome:
    line = slope_within(table[ASPECT], table[CROSSINGS], ["all"] * len(table))
    average = float(table[CROSSINGS].mean())
    scale = float(np.ptp(table[ASPECT])) / average if len(table) and average else math.nan
    change, half_width = abs(scale * line.value), abs(scale) * line.half_width
    known = not math.isnan(change)
    ends = f", from end to end {100 * scale * line.value:+.0f} % of the mean" if known else ""
    return Outcome(
        effects=[Effect(label="⟨N⟩ against l/w", value=line, sign=0, note=ends)],
        note=f"by l/w {means_by(table, CROSSINGS, ASPECT, '.2f')}",
        verdict=decide(change + half_width <= FLAT, change - half_width > FLAT, data=known),
    )


def _near_one(table: pd.DataFrame) -> Outcome:
    """Judge whether ⟨N⟩ is greatest near l/w = 1.0: by a parabola if it fits, otherwise by the means."""
    before, after = (parabola(table[ASPECT], table[CROSSINGS], at=place) for place in (1 - NEAR, 1 + NEAR))
    by = f"by l/w {means_by(table, CROSSINGS, ASPECT, '.2f')}"
    beyond = bool((table[ASPECT] > 1.0).any())
    if beyond and not before.fits < 1 - CONFIDENCE:
        top = f", highest at {before.top:.2f}" if before.bend.value < 0 else ""
        return Outcome(
            effects=[
                Effect(label=f"slope of ⟨N⟩ at l/w = {1 - NEAR:g}", value=before.slope),
                Effect(label=f"at {1 + NEAR:g}", value=after.slope, sign=-1, note=top),
            ],
            note=by,
        )
    note = by if beyond else f"{by}; nothing beyond 1 was run, so a fall there is not tested"
    means = {float(aspect): mean_over_seeds(group[CROSSINGS]) for aspect, group in table.groupby(ASPECT)}
    near = min(means, key=lambda aspect: abs(aspect - 1), default=math.nan)
    if len(means) < 2 or abs(near - 1) > 0.1:
        return Outcome(note=note, verdict=Verdict.NO_DATA)
    part = table[table[ASPECT] <= near]
    rise = Effect(
        label=f"⟨N⟩ against l/w up to {near:g}", value=slope_within(part[ASPECT], part[CROSSINGS], ["all"] * len(part))
    )
    others = [difference(mean, means[near]) for aspect, mean in means.items() if aspect != near]
    verdict = rise.verdict
    if any(other.value > other.half_width for other in others):
        verdict = Verdict.NOT_FOUND
    elif verdict == Verdict.FOUND and any(other.value > 0 for other in others):
        verdict = Verdict.NOT_RESOLVED
    return Outcome(effects=[rise], note=note, verdict=verdict)


def _peaks_with_amplitude(table: pd.DataFrame) -> list[Effect]:
    part = table[(table[PROCEDURE] == INTERNAL) & (table[ASPECT] > 0.51)]
    bands = pd.cut(part[THETA], [0, 6, 9, 16, 90], right=False, labels=["low", "between", "peak", "high"])
    means = part.groupby([part[ASPECT], part[SEED], bands], observed=False)[CROSSINGS].mean()
    wide = means.unstack().reindex(columns=["low", "peak", "high"])
    return [
        Effect(label="⟨N⟩ at 10° to 15° less that at 5°", value=mean_over_seeds(wide["peak"] - wide["low"])),
        Effect(label="less that at 20° to 30°", value=mean_over_seeds(wide["peak"] - wide["high"])),
    ]


def _energies(suffix: str, how: str, quantity: str) -> tuple[Finding, Finding, Finding]:
    """Make three findings on the energy of the internal oscillation, which is the column `quantity`.

    `suffix` ends the ids of the findings, `how` ends their statements.
    """
    part, says = only(INTERNAL), "Internal oscillation: "
    return (
        with_amplitude(f"energy-grows-with-theta{suffix}", f"{says}energy grows with θ{how}", quantity),
        with_aspect(f"energy-grows-with-aspect{suffix}", f"{says}energy grows with l/w{how}", part, quantity),
        Finding(
            id=f"energy-maximum{suffix}",
            says=f"{says}the energy has a local maximum at l/w = {PEAK:g}{how}",
            outcome=partial(_local_maximum, quantity=quantity),
            rows=part,
        ),
    )


BY_SAMPLES = f", summed every {APART:g} s"

_of_shape = partial(mean, rows=only(SHAPE), by=ASPECT)
PACKING = (
    with_aspect("poured-falls", "φ_0 of the poured pile falls with l/w", only(STATIC), PHI, -1),
    with_aspect("shaken-falls", "External oscillation: φ_f falls with l/w", only(EXTERNAL), PHI_ACTIVE, -1),
    Finding(
        id="shaken-bends",
        says="External oscillation: φ changes with l/w faster than linearly",
        outcome=lambda table: [
            Effect(
                label="bend of φ_f against l/w, of the parabola through all runs,",
                value=parabola(table[ASPECT], table[PHI_ACTIVE], at=1.0).bend,
            )
        ],
        rows=only(EXTERNAL, PHI_ACTIVE),
    ),
    mean(
        "shaken-compacts",
        "External oscillation makes the pile denser",
        lambda table: table[PHI_ACTIVE],
        "φ_f − φ_0",
        rows=gains(EXTERNAL),
    ),
    _of_shape(
        "straight-rises",
        "Shape change: the centre of mass rises when the smarticles straighten",
        lambda table: table[STRAIGHT] - 1,
        "h/h0 − 1 while straight",
        shown=[STRAIGHT],
    ),
    _of_shape(
        "sinks-while-closing",
        "Shape change: the pile sinks at first when the barbs close",
        lambda table: table[STRAIGHT] - table[LOWEST],
        "h/h0 while straight less the lowest while closing",
    ),
    _of_shape(
        "stays-up",
        "Shape change: the centre of mass does not come back to h0",
        lambda table: table[HEIGHT] - 1,
        "h/h0 − 1 at rest again",
        shown=[HEIGHT],
    ),
    _of_shape(
        "rises-after-the-drop",
        "Shape change: after that drop the pile grows upwards again",
        lambda table: table[HEIGHT] - table[LOWEST],
        "h/h0 at rest again less the lowest while closing",
    ),
    with_aspect("shape-change-falls", "Shape change: φ_f falls with l/w", only(SHAPE), PHI_ACTIVE, -1),
    mean(
        "internal-sinks",
        "Internal oscillation: the pile becomes lower than it was poured",
        lambda table: 1 - table[HEIGHT],
        "1 − h/h0 at rest again",
        rows=only(INTERNAL),
    ),
    Finding(
        id="compacts-early",
        says="Internal oscillation: half of the compaction is reached after about 12 % of the activity",
        outcome=_compacts_early,
        rows=only(INTERNAL),
        found_if=f"the centre of mass comes down, by half of it within {EARLY:g} of the activity, twice the paper's "
        "0.12 (a steady descent would take 0.5)",
    ),
    with_aspect("internal-falls", "Internal oscillation: φ_f falls with l/w", only(INTERNAL), PHI_ACTIVE, -1),
    slope(
        "internal-gains-more",
        "Internal oscillation: Δφ = φ_f − φ_0 grows with l/w",
        PHI_ACTIVE,
        ASPECT,
        rows=gains(INTERNAL),
        label="Δφ",
    ),
    with_amplitude("tighter-at-low-theta", "Internal oscillation: lower θ packs tighter", PHI_ACTIVE, -1),
    Finding(
        id="largest-theta-gains-little",
        says="Internal oscillation: the largest amplitude packs only marginally denser than static",
        outcome=_largest_gains_little,
    ),
    above(
        "internal-densest",
        "Internal oscillation packs densest",
        PHI_ACTIVE,
        INTERNAL,
        (STATIC, EXTERNAL, SHAPE),
        beside=(EXTERNAL,),
        beside_quantity=PHI,
    ),
    above(
        "shape-change-loosest",
        "Of the three activities shape change packs least densely",
        PHI_ACTIVE,
        SHAPE,
        (EXTERNAL, INTERNAL),
        sign=-1,
        beside=(STATIC,),
    ),
)

ENERGIES = (
    above(
        "shape-change-costs-most", "Shape change needs the most energy, at any l/w", ENERGY, SHAPE, (EXTERNAL, INTERNAL)
    ),
    Finding(
        id="shape-change-costs-ten-times",
        says="Shape change costs more than 10 times the energy of internal oscillation",
        outcome=_shape_change_costs,
    ),
    Finding(
        id="shape-change-costs-ten-times-sampled",
        says=f"Shape change costs more than 10 times the energy of internal oscillation{BY_SAMPLES}",
        outcome=_costs_by_samples,
    ),
    above(
        "internal-costs-least",
        "Internal oscillation needs the least energy",
        ENERGY,
        INTERNAL,
        (EXTERNAL, SHAPE),
        sign=-1,
    ),
    *(
        one
        for both in zip(_energies("", "", ENERGY), _energies("-sampled", BY_SAMPLES, SAMPLED), strict=True)
        for one in both
    ),
    Finding(
        id="internal-costs-a-little-less",
        says="External and internal oscillation need similar energies, internal slightly less",
        outcome=_little_less,
    ),
)

ENTANGLEMENT = (
    above(
        "static-least-entangled", "⟨N⟩ is lowest for static", CROSSINGS, STATIC, (EXTERNAL, INTERNAL, SHAPE), sign=-1
    ),
    Finding(
        id="static-flat",
        says="⟨N⟩ of static hardly depends on l/w",
        outcome=_static_flat,
        rows=only(STATIC),
        found_if=f"the straight line through all runs changes by less than {FLAT:.0%} of the mean, at 95 %",
    ),
    above(
        "shape-change-most-entangled", "⟨N⟩ is highest for shape change", CROSSINGS, SHAPE, (STATIC, EXTERNAL, INTERNAL)
    ),
    with_aspect("shape-change-rises", "⟨N⟩ of shape change rises with l/w", only(SHAPE), CROSSINGS),
    *(
        Finding(
            id=f"{procedure}-near-one",
            says=f"⟨N⟩ of {procedure} oscillation is greatest near l/w = 1.0",
            outcome=_near_one,
            rows=only(procedure, CROSSINGS),
            found_if=f"the parabola through all runs still rises at l/w = {1 - NEAR:g} and falls at {1 + NEAR:g}, so "
            "that of the paper's l/w 0.9, 1.0 or 1.1 is the nearest to its maximum; where none describes the means at "
            "95 %, or nothing beyond 1.0 was run: slope of ⟨N⟩ up to l/w = 1.0 > 0, and no other mean above that at "
            "1.0",
        )
        for procedure in (EXTERNAL, INTERNAL)
    ),
    with_amplitude(
        "crossings-fall-with-theta",
        "Internal oscillation: ⟨N⟩ falls with θ at l/w = 0.4 to 0.5",
        CROSSINGS,
        -1,
        rows=lambda table: table[(table[PROCEDURE] == INTERNAL) & (table[ASPECT] < 0.51)],
    ),
    Finding(
        id="crossings-peak-with-theta",
        says="Internal oscillation: ⟨N⟩ peaks at θ = 10° to 15° at larger l/w",
        outcome=_peaks_with_amplitude,
    ),
)


def heights(run: Run) -> History:
    """Read the height of the centre of mass, over that in the rest before the activity [-], against time."""
    values, times = height_history(run)
    return History(times=times, values=values, active=duration(activity(run)))


def _energy_series(points: pd.DataFrame) -> list[Series]:
    """Split points into series of a figure: each procedure (internal: θ = `AMPLITUDE`), and each other θ."""
    internal = amplitudes(points)
    others = one_by_one(THETA, lambda theta: rf"internal, $\theta$ = {theta:g}°")
    return by_procedure(apart=0.004)(points) + others(internal[internal[THETA] != AMPLITUDE])


def _aspect_series(points: pd.DataFrame) -> list[Series]:
    """Split points of the internal oscillation into a series per l/w; without l/w that have one θ only."""
    internal = amplitudes(points).sort_values(THETA)
    several = internal[internal.groupby(ASPECT)[THETA].transform("nunique") > 1]
    return one_by_one(ASPECT, lambda aspect: rf"$l/w$ = {aspect:g}")(several)


def _means(name: str, columns: Sequence[str], x: str, split: Split, *, mark: bool = False) -> Means:
    return Means(
        name=name,
        quantities=[QUANTITIES[column] for column in columns],
        x=x,
        x_label=ASPECT_LABEL if x == ASPECT else THETA_LABEL,
        split=split,
        log=ENERGY in columns and not mark,
        marks=[PEAK] if mark else [],
        share_y=len(columns) > 1,
        notes=[f"Broken line: l/w = {PEAK:g}, where the paper's energies have a local maximum."] if mark else [],
    )


_PROCEDURES = by_procedure(apart=0.004)
_READINGS = by_procedure({name: PROCEDURE_LABELS[name] for name in (SHAPE, INTERNAL)})

STUDY = Study(
    name="procedures",
    title="Procedures of smarticles against the findings of Savoie et al.",
    measure=procedure_row,
    keys=(Key(column=PROCEDURE, label="procedure", order=ORDER), THETA_KEY, ASPECT_KEY),
    quantities=tuple(QUANTITIES.values()),
    findings=(*PACKING, *ENERGIES, *ENTANGLEMENT),
    figures=(
        Histories(
            name="height_time",
            history=heights,
            rows=lambda runs: runs[runs[ASPECT] == min(runs[ASPECT].unique(), key=lambda aspect: abs(aspect - 0.7))],
            split=by_procedure(),
            x_label="time since the activity began [s]",
            quantities={"": r"height of the centre of mass $h/h_0$ [-]"},
            level=1.0,
            notes=["l/w = 0.7, or the nearest one. Each activity begins and ends at the broken lines."],
        ),
        _means("phi_aspect", [PHI_ACTIVE], ASPECT, _PROCEDURES),
        _means("crossings_aspect", [CROSSINGS], ASPECT, _PROCEDURES),
        _means("energy_aspect", [ENERGY], ASPECT, _energy_series),
        _means("phi_theta", [PHI_ACTIVE], THETA, _aspect_series),
        _means("crossings_theta", [CROSSINGS], THETA, _aspect_series),
        _means("energy_theta", [ENERGY], THETA, _aspect_series),
        _means("energy_readings", [ENERGY, SAMPLED], ASPECT, _READINGS, mark=True),
    ),
    samples=samples,
    order=(PROCEDURE, THETA, ASPECT, SEED),
    constant={ACTIVE: (PROCEDURE,)},
    count_values=True,
    from_tables=True,
    remarks=(
        f"φ by {DEFINITION} ({DEFINITIONS[DEFINITION]}): φ_f is the mean over the last 20 frames of the activity, as "
        "in the paper. ⟨N⟩: links of others through a smarticle's plane, mean over the frames of the relaxation after "
        "the activity; static: of that before it, h0 its mean height of the centre of mass. Energy: work of the "
        "motors, or of the shaken container without its own weight. Procedures are compared at "
        f"θ = {AMPLITUDE:g}°.",
        "Of θ only what the hinge reaches is run: a barb swings to 90° + θ/2 · 0.7/(l/w), 105° at most, so θ is at "
        "most 30° (l/w)/0.7.",
    ),
    pictured={"procedure": SHAPE, "l_over_w": 0.7},
)
