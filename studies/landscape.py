"""Landscape: φ, ⟨N⟩, linking number and strength over l/w, the amplitude θ and the energy spent.

Which measure is correlated best with strength, and which procedure gains strength with the least energy? All runs use
the protocol `code`. A hook that lies in the pile is raised out of it, inside the wall; only its weight and the wall
hold the pile down. Strength is the peak force on the hook over the weight n W_s of all smarticles: the share of its
weight that the pile bears when it hangs from the hook, and friction at the wall. In a pile without cohesion the hook
lifts about the smarticles above it, so that strength less the share of these smarticles is tabulated as the effect of
cohesion. The lower hook lies on the floor, where no smarticle can hold it (study `fracture`).

Correlations are rank correlations, which assume no form of a law. Runs of one l/w, procedure, θ and seed are one
trajectory, cut off at several times, so errors come from resampling whole trajectories within each l/w. Measures are
compared within each resample, where their common errors cancel. Gains are differences to the poured pile of equal l/w
and seed. Energies are divided by W_s w, the work that lifts a smarticle by its width, so that shapes of different
weight can be compared.
"""

import math
import re
from functools import partial

import numpy as np
import pandas as pd

from dem.errors import InputError
from dem.record.run import Run
from postprocess.geometry.links import centres_of_mass
from postprocess.measures.pull import PULL, WINDOW, held_fast, peak, read_pull, weight_of_one
from postprocess.measures.table import summarise_run
from postprocess.report import figures as style
from postprocess.statistics.points import ASPECT, SEED, averaged, format_with_error
from postprocess.statistics.ranks import (
    Floats,
    Interval,
    Whole,
    common_slopes,
    few_blocks,
    interval,
    rank_correlations,
    resampled,
)
from postprocess.statistics.seeds import mean_over_seeds
from studies.framework.figures import Heatmap, Means, Rows, Scatter, Series, marker, one_by_one, procedure_marker
from studies.framework.findings import Finding, Outcome, Verdict, decide, effect_text, judge
from studies.framework.procedures import (
    ACTIVE,
    CROSSINGS,
    ENERGY,
    EXTERNAL,
    INTERNAL,
    PHI,
    PROCEDURE,
    SHAPE,
    STATIC,
    THETA,
    gained,
    prepared_by,
)
from studies.framework.provenance import NOTHING
from studies.framework.runs import ASPECT_KEY, DEFINITION, THETA_KEY, Key, Quantity, Row, declare, last_columns
from studies.framework.study import Study

PLANNED = "time planned [s]"
LINKING, CONTACTS = "linking number per smarticle [-]", "contacts per smarticle [-]"
TOUCHING, ENTANGLED = "largest cluster in contact [-]", "largest entangled cluster [-]"
HEIGHT, ABOVE = "com height [m]", "smarticles above the hook [-]"
LIFTS = "energy per smarticle over W_s w [-]"
PEAK, BEYOND = "strength over n W_s [-]", "strength beyond the weight above over n W_s [-]"
RAISED, WORK, HELD_FAST = "hook raised at the peak [m]", "work over n W_s w [-]", "held fast [-]"

PREDICTORS = {
    PHI: "φ",
    CROSSINGS: "⟨N⟩",
    LINKING: "linking number",
    CONTACTS: "contacts",
    TOUCHING: "largest cluster in contact",
    ENTANGLED: "largest entangled cluster",
    HEIGHT: "height of the centre of mass",
    ABOVE: "share above the hook",
    ENERGY: "energy spent",
}  #: Measures of the pile at rest before the pull that may predict strength: names in texts by column

STRENGTHS = {PEAK: "strength", BEYOND: "strength beyond the weight above the hook"}

QUANTITIES = declare(
    {
        PHI: ("φ", ".4f", "packing fraction"),
        CROSSINGS: ("⟨N⟩", ".2f", "⟨N⟩: links of others through a smarticle's plane"),
        LINKING: ("linking", "", "Gauss's linking integral with all others, closed tip to tip, absolute values added"),
        CONTACTS: ("", "", "other smarticles that a smarticle touches"),
        TOUCHING: ("", "", "share of the smarticles in the largest cluster of touching ones"),
        ENTANGLED: ("", "", "share of the smarticles in the largest cluster of entangled ones"),
        HEIGHT: ("", "", "of the centre of mass above the floor"),
        ABOVE: ("above the hook", ".2f", "share of the smarticles whose centre of mass is above the hook"),
        ENERGY: ("energy [J]", ".2e", "work of the motors, or of the shaken floor, up to the pull; static: none"),
        PEAK: ("strength", ".3f", f"largest mean over {WINDOW:g} s of the force on the hook; at least, where it held"),
        BEYOND: ("", "", "strength less the share of the smarticles above the hook, their weight over n W_s"),
        LIFTS: ("", "", "the energy over the work that lifts a smarticle by w"),
        RAISED: ("", "", "how far the hook had been raised at the peak"),
        WORK: ("", "", "∫ F dz over the whole pull, over n W_s w"),
        HELD_FAST: ("", "", "1 where the hook was stopped by its force limit on the way, 0 elsewhere"),
    },
    axes={
        PHI: r"$\phi$ [-]",
        CROSSINGS: r"$\langle N\rangle$ [-]",
        LINKING: "linking number [-]",
        PEAK: r"strength $F/(n W_\mathrm{s})$ [-]",
    },
)

_MEASURED = {
    PHI: PHI,
    CROSSINGS: "crossings mean [-]",
    LINKING: "linking mean [-]",
    CONTACTS: "contacts mean [-]",
    TOUCHING: "contact graph largest share [-]",
    ENTANGLED: "crossing graph largest share [-]",
    HEIGHT: "com height [m]",
}
_NAMED = re.compile(r"[^_]+_(?P<time>\d+(?:\.\d+)?)s_.+")


def measure(run: Run) -> Row:
    """Measure the pile before the pull, the energy spent on it, and its strength; return the run's row."""
    pile = prepared_by(run, PULL)
    active, pulled, named = pile.pop(ACTIVE), run.phases[-1], _NAMED.fullmatch(run.path.name)
    rest = pulled.index - 1
    settings, hooks, frames = run.scene["phases"][pulled.index], run.scene.get("hooks"), run.frames.in_phase(rest)
    if named is None:  # the planned time is only in the name: that of the run is rounded to whole swings
        raise InputError(
            f"{run.path}: not named like a run of this study, such as internal10_2s_lw0.70_seed1; restore its name"
        )
    if hooks is None or not frames or settings["type"] != PULL:
        msg = f"{run.path}: no hooks or pull in scene.yaml, or no frame of the rest before the pull; run it again"
        raise InputError(msg)
    before = summarise_run(run, definitions=[DEFINITION], phases={rest}).set_index("phase").loc[rest]
    heights = centres_of_mass(frames[-1].vertices)[:, 2] - frames[-1].floor_z
    above = float((heights > hooks["upper_height_m"]).mean())
    weight, width = weight_of_one(run), run.manifest.middle_length_m
    total, energy = run.manifest.count * weight, _spent(run, str(pile[PROCEDURE]), rest) / run.manifest.count
    pull = read_pull(run, run.series, pulled.index)
    highest = peak(pull)
    return {
        **pile,
        PLANNED: float(named["time"]),
        ACTIVE: active,
        **{column: before[measured] for column, measured in _MEASURED.items()},
        ABOVE: above,
        ENERGY: energy,
        LIFTS: energy / weight / width,
        PEAK: highest.force / total,
        BEYOND: highest.force / total - above,
        RAISED: highest.raised,
        WORK: pull.work / total / width,
        HELD_FAST: float(held_fast(pull.raised, settings)),
        "escaped at the end [-]": before["escaped [-]"],
        "frames averaged [-]": int(before["frames averaged"]),
        **last_columns(run),
    }


def _spent(run: Run, procedure: str, rest: int) -> float:
    """Return the work of a procedure on all smarticles [J], up to the end of the phase with index `rest`."""
    if procedure == STATIC:
        return 0.0
    series = run.series
    name = "container_work_J" if procedure == EXTERNAL else "motor_work_J"
    if name not in series.data:
        raise InputError(f"{series.path}: no {name} of {run.path}; run it with recording.energy")
    until = series["phase"] <= rest
    return gained(series[name][until], series["phase"][until] <= 1)


# Which measure goes with strength

RESAMPLES, DRAW = 1000, 17  # number of resamples, and seed of their random numbers
STRENGTH, SCOPE, PART, PREDICTOR = "strength", "scope", "runs", "measure"
RHO, LOW, HIGH = "rank correlation [-]", "from [-]", "to [-]"
FIRST, OTHER, VERDICT = "first in resamples [-]", "other", "verdict"
LEAD = "rank correlation of the best less the other's, in size [-]"
ALL, WITHIN = "over all l/w", "within l/w"
EVERY, FREE, SWUNG = "all", "none held fast", "static and internal alone"
"""Parts of the runs: all; those whose strength is no lower bound; the static state and the internal oscillation."""


def trajectories(runs: pd.DataFrame) -> pd.Series:
    """Number the trajectories (n,): runs of equal l/w, seed, procedure and θ share a trajectory."""
    return runs.groupby([ASPECT, SEED, PROCEDURE, THETA], dropna=False, sort=False).ngroup()


def predicted(runs: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Correlate both strengths (`STRENGTHS`) with all measures of the pile (`PREDICTORS`).

    Returns two tables. The first has rank correlation and slope with 95 % intervals: a row per strength, part of the
    runs (`EVERY`, `FREE` or `SWUNG`), scope (over all l/w, within l/w, or one l/w) and measure; the measure with the
    strongest correlation comes first. The second has the absolute rank correlation of this measure less that of each
    other measure.
    """
    each: list[dict[str, object]] = []
    against: list[dict[str, object]] = []
    internal = runs[runs[PROCEDURE].isin([STATIC, INTERNAL])]
    parts = {EVERY: runs, FREE: runs[runs[HELD_FAST] == 0], SWUNG: internal}
    for strength in STRENGTHS:
        for name, part in parts.items():
            if name != EVERY and len(part) == len(runs):
                continue
            chosen = part[np.isfinite(part[[*PREDICTORS, strength]]).all(axis=1)]
            scopes = {ALL: chosen, WITHIN: chosen}
            if name == EVERY:
                scopes |= {f"l/w = {ratio:g}": group for ratio, group in chosen.groupby(ASPECT)}
            for scope, table in scopes.items():
                if len(table) < 4:
                    continue
                labels = {STRENGTH: strength, PART: name, SCOPE: scope}
                found, compared = _correlated(table, strength, within=scope != ALL)
                each += [{**labels, **row} for row in found]
                against += [{**labels, **row} for row in compared]
    return pd.DataFrame(each), pd.DataFrame(against)


def _correlated(
    table: pd.DataFrame, strength: str, *, within: bool
) -> tuple[list[dict[str, object]], list[dict[str, object]]]:
    """Correlate one strength with all measures of the pile; return rows of both tables of `predicted`.

    `strength` is the column. With `within`, the correlation is within each l/w, otherwise over all.
    """
    names = list(PREDICTORS)
    x, y = table[names].to_numpy(dtype=np.float64), table[strength].to_numpy(dtype=np.float64)
    strata = pd.factorize(table[ASPECT])[0].astype(np.int64)
    levels = strata if within else np.zeros_like(strata)
    blocks = trajectories(table).to_numpy(dtype=np.int64)

    def measures(rows: Whole) -> Floats:
        at = x[rows], y[rows], levels[rows]
        return np.concatenate([rank_correlations(*at), common_slopes(*at)])

    values = measures(np.arange(len(table)))
    drawn = resampled(measures, blocks, strata, count=RESAMPLES, seed=DRAW)
    if few_blocks(blocks, strata):
        drawn[:] = np.nan
    rho = values[: len(names)]
    ends = [interval(float(value), column.tolist()) for value, column in zip(values, drawn.T, strict=True)]
    sizes = drawn[:, : len(names)] * np.sign(rho)
    # A constant column has no correlation (NaN) and cannot be the best.
    order = [int(k) for k in np.argsort(-np.abs(np.where(np.isfinite(rho), rho, 0)), kind="stable")]
    first = np.bincount(np.nanargmax(np.where(np.isfinite(sizes), sizes, -np.inf), axis=1), minlength=len(names))
    unknown = ~np.isfinite(sizes).any()
    spread = (table[names] - table[names].groupby(levels).transform("mean")).to_numpy(dtype=np.float64).std(axis=0)
    found = [
        {
            PREDICTOR: names[k],
            "runs [-]": len(table),
            "trajectories [-]": len(np.unique(blocks)),
            **dict(zip((RHO, LOW, HIGH), (own.value, own.low, own.high), strict=True)),
            "slope per unit of the measure": tilt.value,
            "slope per SD [-]": tilt.value * spread[k],
            "slope from [-]": tilt.low * spread[k],
            "slope to [-]": tilt.high * spread[k],
            FIRST: np.nan if unknown else first[k] / RESAMPLES,
        }
        for k in order
        for own, tilt in [(ends[k], ends[len(names) + k])]
    ]
    best, *others = order
    compared = []
    for k in others:
        lead = interval(abs(float(rho[best])) - abs(float(rho[k])), (sizes[:, best] - sizes[:, k]).tolist())
        verdict = "no data" if np.isnan(lead.value) else "better" if lead.low > 0 else "not resolved"
        row = {"best": names[best], OTHER: names[k], LEAD: lead.value, LOW: lead.low, HIGH: lead.high}
        compared.append({**row, VERDICT: verdict})
    return found, compared


# What strength costs

PAIRS, GAIN = "pairs [-]", "strength gained over n W_s [-]"
YIELD, FRONTIER = "strength gained per energy over W_s w [-]", "nothing gains as much for less [-]"
COMMON = "l/w where all was run"
_POINT = [PROCEDURE, THETA, PLANNED]


def gains(runs: pd.DataFrame) -> pd.DataFrame:
    """Add the gain of strength, column `GAIN`, to the runs with an activity, and return these runs.

    The gain is the strength less that of the poured pile (procedure static) of equal l/w and seed. Runs without such a
    pile are left out.
    """
    poured = runs[runs[PROCEDURE] == STATIC].groupby([ASPECT, SEED])[PEAK].mean().rename("poured")
    active = runs[runs[PROCEDURE] != STATIC].join(poured, on=[ASPECT, SEED], how="inner").reset_index(drop=True)
    return active.assign(**{GAIN: active[PEAK] - active["poured"]}).drop(columns="poured")


def common_aspects(runs: pd.DataFrame) -> list[float]:
    """Return the l/w at which the most combinations of procedure, θ and planned time were run."""
    counts = runs.drop_duplicates([ASPECT, *_POINT]).groupby(ASPECT).size()
    return [float(ratio) for ratio in counts.index[counts == counts.max()]]


def costs(runs: pd.DataFrame) -> pd.DataFrame:
    """Average gain and energy over l/w and seeds: over all l/w in `common_aspects`, and at each l/w.

    The table has a row per scope (all l/w, or one), procedure, θ and planned time: means with errors, and the gain per
    energy with its 95 % interval. `FRONTIER` is 1 if the gain is above 0 and no other row of the scope gains as much
    for less energy.
    """
    gained = gains(runs)
    scopes = {COMMON: gained[gained[ASPECT].isin(common_aspects(runs))]}
    scopes |= {f"l/w = {ratio:g}": part for ratio, part in gained.groupby(ASPECT)}
    tables = []
    for scope, part in scopes.items():
        rows = []
        for point, group in part.groupby(_POINT, dropna=False):
            ratio = _drawn_ratio(group[[GAIN, LIFTS]].to_numpy(dtype=np.float64))
            row = {SCOPE: scope, **dict(zip(_POINT, point, strict=True)), PAIRS: len(group)}
            row |= averaged(group, (GAIN, ENERGY, LIFTS))
            rows.append(row | {YIELD: ratio.value, LOW: ratio.low, HIGH: ratio.high})
        table = pd.DataFrame(rows)
        if len(table):
            best = [
                float(row[GAIN] > 0 and not (table.loc[table[LIFTS] < row[LIFTS], GAIN] >= row[GAIN]).any())
                for _, row in table.iterrows()
            ]
            tables.append(table.assign(**{FRONTIER: best}))
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()


def _drawn_ratio(values: Floats) -> Interval:
    """Return the mean gain over the mean energy, with its 95 % interval by resampling the rows.

    `values` (n, 2) are gains and energies. For two procedures they are (n, 4), and the result is the first procedure's
    gain per energy over the second's. With fewer than 3 rows the ends of the interval are NaN, and so is the result for
    two procedures.
    """

    def ratio(rows: Whole) -> Floats:
        means = values[rows].mean(axis=0)
        per = [gain / energy if energy > 0 else math.nan for gain, energy in means.reshape(-1, 2)]
        return np.array([per[0] / per[1] if len(per) == 2 else per[0]])

    every = np.arange(len(values))
    if len(values) < 3:
        value = float(ratio(every)[0]) if len(values) and values.shape[1] == 2 else math.nan
        return Interval(value=value, low=math.nan, high=math.nan)
    drawn = resampled(ratio, every, np.zeros_like(every), count=RESAMPLES, seed=DRAW)
    return interval(float(ratio(every)[0]), drawn[:, 0].tolist())


def best_points(table: pd.DataFrame) -> pd.DataFrame:
    """Return for each procedure the row of `costs` with the greatest gain per energy, at the common l/w.

    Rows whose 95 % interval of the gain per energy is unknown or reaches 0 are left out.
    """
    known = table[(table[SCOPE] == COMMON) & (table[LOW] > 0)] if len(table) else table
    if known.empty:
        return known
    return known.sort_values(YIELD, ascending=False).groupby(PROCEDURE, sort=False).head(1).reset_index(drop=True)


def _at_point(gained: pd.DataFrame, point: pd.Series) -> pd.DataFrame:
    """Return the runs of a point (procedure, θ, planned time) as a table indexed by l/w and seed."""
    same = (gained[PROCEDURE] == point[PROCEDURE]) & np.isclose(gained[PLANNED], point[PLANNED])
    same &= np.isclose(gained[THETA], point[THETA], equal_nan=True)
    return gained[same].set_index([ASPECT, SEED])


# Findings


def _interval(value: float, low: float, high: float, form: str = "+.2f") -> str:
    """Format a value with its 95 % interval, if known: `+0.71 (+0.60 to +0.79)`."""
    if math.isnan(value):
        return "-"
    return f"{value:{form}}" + (f" ({low:{form}} to {high:{form}})" if math.isfinite(low) else " (no error)")


def _rho(row: pd.Series) -> str:
    return _interval(row[RHO], row[LOW], row[HIGH])


def _at(table: pd.DataFrame, strength: str, part: str, scope: str) -> pd.DataFrame:
    if table.empty:
        return table
    return table[(table[STRENGTH] == strength) & (table[PART] == part) & (table[SCOPE] == scope)]


def _named(row: pd.Series) -> str:
    """Format procedure, θ and time of a row: `internal θ = 10° for 2 s`."""
    theta = "" if math.isnan(row[THETA]) else f" θ = {row[THETA]:g}°"
    return f"{row[PROCEDURE]}{theta} for {row[PLANNED]:g} s"


def _best(predictors: pd.DataFrame, comparisons: pd.DataFrame, strength: str, scope: str) -> Outcome:
    found, against = (_at(table, strength, EVERY, scope) for table in (predictors, comparisons))
    if found.empty or not np.isfinite(found[RHO].iloc[0]):
        return Outcome(verdict=Verdict.NO_DATA)
    first = found.iloc[0]
    rivals = against[against[VERDICT] == "not resolved"]
    listed = ", ".join(f"{PREDICTORS[row[PREDICTOR]]} {_rho(row)}" for _, row in found.iloc[:4].iterrows())
    open_ = f"; not resolved against {', '.join(PREDICTORS[name] for name in rivals[OTHER])}" if len(rivals) else ""
    share = format_with_error(100 * first[FIRST], ".0f")
    return Outcome(
        note=f"{PREDICTORS[first[PREDICTOR]]}, first in {share} % of resamples; rank correlations {listed}{open_}",
        verdict=decide(rivals.empty and len(against) > 0 and math.isfinite(first[LOW])),
    )


def _sign(predictors: pd.DataFrame, measure: str, part: str) -> Outcome:
    rows = _at(predictors, PEAK, part, WITHIN)
    rows = rows[rows[PREDICTOR] == measure] if len(rows) else rows
    if rows.empty:
        return Outcome(verdict=Verdict.NO_DATA)
    row = rows.iloc[0]
    return Outcome(note=f"rank correlation {_rho(row)}", verdict=decide(row[LOW] > 0, row[HIGH] < 0))


def _cheapest(runs: pd.DataFrame, table: pd.DataFrame) -> Outcome:
    best = best_points(table)
    if best.empty:
        return Outcome(note="no procedure surely gains strength", verdict=Verdict.NOT_RESOLVED)
    bought = gains(runs)
    bought = bought[bought[ASPECT].isin(common_aspects(runs))]
    ratios = {}
    for _, row in best.iloc[1:].iterrows():
        # Over the l/w and seeds that both have, since both ratios must be resampled together.
        pair = [_at_point(bought, point)[[GAIN, LIFTS]] for point in (best.iloc[0], row)]
        both = pd.concat(pair, axis=1, join="inner").to_numpy(dtype=np.float64)
        ratios[row[PROCEDURE]] = _drawn_ratio(both)
    listed = "; ".join(
        f"{_named(row)} {_interval(row[YIELD], row[LOW], row[HIGH], '.3g')}" for _, row in best.iterrows()
    )
    times = ", ".join(f"{_interval(one.value, one.low, one.high, '.3g')} times {name}" for name, one in ratios.items())
    return Outcome(
        note=f"n W_s gained per W_s w of energy and smarticle: {listed}; the first {times or 'alone'}",
        verdict=decide(bool(ratios) and all(ratio.low > 1 for ratio in ratios.values())),
    )


def _as_strong(runs: pd.DataFrame, costs: pd.DataFrame) -> Outcome:
    table = costs[costs[SCOPE] == COMMON] if len(costs) else costs
    shape, swung = (table[table[PROCEDURE] == name] if len(table) else table for name in (SHAPE, INTERNAL))
    if shape.empty or swung.empty:
        return Outcome(verdict=Verdict.NO_DATA)
    bought = gains(runs)
    bought = bought[bought[ASPECT].isin(common_aspects(runs))]
    by_shape = _at_point(bought, shape.iloc[0])[GAIN]
    lacks = {
        _named(row): mean_over_seeds((by_shape - _at_point(bought, row)[GAIN]).dropna().tolist())
        for _, row in swung.iterrows()
    }
    nearest = min(lacks, key=lambda name: math.inf if math.isnan(lacks[name].value) else lacks[name].value)
    stronger = all(judge(effect) == Verdict.FOUND for effect in lacks.values())
    return Outcome(
        note=f"shape change less the strongest, {nearest}: {effect_text(lacks[nearest])} n W_s over l/w and seeds; "
        f"it spends {shape.iloc[0][LIFTS]:.3g} W_s w per smarticle",
        verdict=decide(judge(lacks[nearest]) == Verdict.NOT_FOUND, stronger),
    )


_WHERE = {ALL: "over runs of all l/w", WITHIN: "within runs of one l/w"}
FINDINGS = (
    *(
        Finding(
            id=f"best-{short}-{scope.split(maxsplit=1)[0]}",
            says=f"(ours) one measure surely tells {STRENGTHS[strength]} best, {_WHERE[scope]}",
            found_if="its rank correlation is larger in size than every other's, at 95 %",
            outcome=partial(_best, strength=strength, scope=scope),
            tables=["predictors", "comparisons"],
        )
        for strength, short in ((PEAK, "strength"), (BEYOND, "cohesion"))
        for scope in (ALL, WITHIN)
    ),
    *(
        Finding(
            id=f"stronger-{short}",
            says=f"(ours) within runs of one l/w a pile is the stronger the {says}",
            found_if="rank correlation > 0 at 95 %",
            outcome=partial(_sign, measure=column, part=part),
            tables=["predictors"],
        )
        for short, column, part, says in (
            ("crossings", CROSSINGS, EVERY, "larger ⟨N⟩ is"),
            ("linking", LINKING, EVERY, "larger the linking number is"),
            ("phi", PHI, EVERY, "larger the packing fraction is"),
            ("energy", ENERGY, SWUNG, "more energy an internal oscillation has spent on it"),
        )
    ),
    Finding(
        id="cheapest",
        says="(ours) one procedure is surely the cheapest per unit of strength, each at its best",
        found_if="it gains more per energy than each other procedure, at 95 %",
        outcome=_cheapest,
        tables=["runs", "cost"],
    ),
    Finding(
        id="as-strong-as-shape-change",
        says="(ours) some internal oscillation makes a pile as strong as a shape change does",
        found_if="shape change less the strongest oscillation < 0 at 95 %",
        outcome=_as_strong,
        tables=["runs", "cost"],
    ),
)

# Figures

_by_aspect = one_by_one(ASPECT, "l/w = {:g}".format)


def _bought(table: pd.DataFrame) -> list[Series]:
    """Split a table into series of a figure: each θ of the internal oscillation, and each other activity."""
    others = [
        Series(
            rows=table[table[PROCEDURE] == name], label=name, properties={**procedure_marker(name), "linestyle": "none"}
        )
        for name in (EXTERNAL, SHAPE)
    ]
    swung = table[(table[PROCEDURE] == INTERNAL) & (table[ENERGY] > 0)].sort_values(ENERGY)
    return [*one_by_one(THETA, "internal, θ = {:g}°".format)(swung), *others]


def _scopes(table: pd.DataFrame) -> list[Series]:
    styles = {WITHIN: marker("o", style.ORANGE, style.ORANGE), ALL: marker("D", style.BLUE, style.BLUE)}
    return [
        Series(rows=table[table[SCOPE] == scope], label=scope, properties=properties)
        for scope, properties in styles.items()
    ]


FIGURES = (
    Heatmap(
        name="maps",
        quantities=[QUANTITIES[name] for name in (PHI, CROSSINGS, LINKING, PEAK)],
        x=Quantity(column=ENERGY, axis="energy per smarticle [J]"),
        y=Quantity(column=ASPECT, axis=r"$l/w$ [-]"),
        panels=THETA,
        panel="θ = {:g}°",
        notes=[
            "Left of the broken line: poured, no energy spent. A cell is a mean over seeds; l/w and θ beyond what the "
            "hinge reaches are empty."
        ],
    ),
    Means(
        name="strength_energy",
        x=ENERGY,
        x_label="energy per\nsmarticle [J]",
        log_x=True,
        share_y=True,
        quantities=[QUANTITIES[PEAK]],
        split=_bought,
        panels=ASPECT,
        levels=lambda points: {"poured": float(points.loc[points[PROCEDURE] == STATIC, PEAK].mean())},
    ),
    Scatter(
        name="strength_measures",
        xs=[QUANTITIES[name] for name in PREDICTORS],
        y=QUANTITIES[PEAK],
        split=_by_aspect,
        bounds=HELD_FAST,
        means=False,
    ),
    Rows(
        name="correlations",
        table="predictors",
        quantities=[Quantity(column=RHO, axis="rank correlation with strength [-]")],
        rows=lambda table: pd.concat([_at(table, PEAK, EVERY, scope) for scope in (WITHIN, ALL)]),
        row=lambda row: PREDICTORS[row[PREDICTOR]],
        split=_scopes,
        ends=(LOW, HIGH),
        bars="Error bars: 95 % confidence by resampling whole trajectories within each l/w",
    ),
    Means(
        name="cost",
        table="cost",
        quantities=[Quantity(column=GAIN)],
        x=LIFTS,
        x_label=LIFTS,
        log_x=True,
        rows=lambda table: table[table[SCOPE] == COMMON],
        split=_bought,
        notes=["Pairs of one l/w and seed, at the l/w at which everything was run; error bars count pairs."],
    ),
)


def _shown(points: pd.DataFrame) -> pd.DataFrame:
    """Select the points of the short table: static, shape change, strongest internal oscillation per l/w."""
    swung = points[points[PROCEDURE] == INTERNAL]
    strongest = swung.loc[swung[PEAK].notna()].groupby(ASPECT)[PEAK].idxmax()
    return points[points[PROCEDURE].isin([STATIC, SHAPE]) | points.index.isin(strongest)]


STUDY = Study(
    name="landscape",
    title="Packing, entanglement, linking and strength over l/w, θ and the energy spent",
    measure=measure,
    keys=(
        ASPECT_KEY,
        Key(column=PROCEDURE, label="procedure"),
        THETA_KEY,
        Key(column=PLANNED, label="for", form="g", unit=" s"),
    ),
    quantities=tuple(QUANTITIES.values()),
    findings=FINDINGS,
    figures=FIGURES,
    extra=lambda runs: dict(zip(("predictors", "comparisons"), predicted(runs), strict=True)) | {"cost": costs(runs)},
    shown=_shown,
    order=(ASPECT, PROCEDURE, THETA, PLANNED, SEED),
    bounds=(HELD_FAST, "held fast"),
    from_tables=True,
    remarks=(
        f"Strength: largest mean over {WINDOW:g} s of the force that raises a hook out of the pile, over the weight "
        f"n W_s of all smarticles. φ by {DEFINITION}; all measures at rest before the pull. Energy: work of the "
        "motors, or of the shaken floor, per smarticle.",
        f"Intervals: 95 % by {RESAMPLES} resamples of whole trajectories (one l/w, procedure, θ and seed) within each "
        "l/w, percentiles; of gains per energy, of pairs of one l/w and seed.",
    ),
    reference=NOTHING,
    pictured={"procedure": INTERNAL, "l_over_w": 0.7, "theta_deg": 10},
)
