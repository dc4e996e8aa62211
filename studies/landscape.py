"""The landscape: φ, ⟨N⟩, linking number and strength of piles over l/w, the amplitude θ and the energy spent.

Which measure goes with strength best, and which procedure buys it cheapest; by the rules of the paper's code. A hook
that was poured over is raised out of the pile, within its wall, and nothing but weight and wall holds the pile down.
What the hook takes at its peak, over the weight n W_s of all smarticles, is so the largest share of its own weight that
the pile bears hanging: the weight that comes along at once, and what friction at the wall adds. A heap without any
cohesion makes the hook lift about what lies above it; strength less that share is tabulated beside it, as what cohesion
adds. The lower hook lies on the floor, where no smarticle gets hold of it (study `fracture`).

Rank correlations: no shape of the law is assumed. Runs of one l/w, procedure, θ and seed are one trajectory, cut off at
several times: errors are by drawing trajectories of each l/w anew. A measure is compared with others in the same draws,
so that what both share does not count. Gains are over the poured pile of the same l/w and seed, which a run began with;
energies over W_s w, the work that lifts a smarticle by its width, so that heavier ones do not count as dearer.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from dem.errors import InputError
from dem.record.run import Run
from postprocess.geometry.links import centres_of_mass
from postprocess.measures.pull import PULL, WINDOW, held_fast, peak, read_pull, weight_of_one
from postprocess.measures.table import summarise_run
from postprocess.report import figures as style
from postprocess.statistics.findings import judge, told
from postprocess.statistics.points import ASPECT, SEED, marked, mean_columns, told_number
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
from studies.framework.figures import Analysis, Drawing, one_by_one
from studies.framework.findings import Finding, Outcome, Verdict
from studies.framework.plots import CROSSINGS_LABEL, draw_means, finished, procedure_marker
from studies.framework.procedures import (
    ACTIVE,
    CROSSINGS,
    EXTERNAL,
    INTERNAL,
    PHI,
    PROCEDURE,
    SHAPE,
    STATIC,
    THETA,
    prepared_by,
)
from studies.framework.provenance import NOTHING
from studies.framework.quantities import Key, Quantity
from studies.framework.runs import DEFINITION, Row, duration
from studies.framework.study import Study

PLANNED = "time planned [s]"
LINKING, CONTACTS = "linking number per smarticle [-]", "contacts per smarticle [-]"
TOUCHING, ENTANGLED = "largest cluster in contact [-]", "largest entangled cluster [-]"
HEIGHT, ABOVE = "com height [m]", "smarticles above the hook [-]"
ENERGY, LIFTS = "energy per smarticle [J]", "energy per smarticle over W_s w [-]"
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
}
"""What may tell strength, all at rest before the pull, and what it is called."""

STRENGTHS = {PEAK: "strength", BEYOND: "strength beyond the weight above the hook"}

QUANTITIES = (
    Quantity(column=PHI, label="φ", form=".4f", meaning="packing fraction"),
    Quantity(column=CROSSINGS, label="⟨N⟩", form=".2f", meaning="⟨N⟩: links of others through a smarticle's plane"),
    Quantity(
        column=LINKING,
        label="linking",
        meaning="Gauss's linking integral with all others, closed barb tip to barb tip, absolute values added up",
    ),
    Quantity(column=CONTACTS, meaning="other smarticles that a smarticle touches"),
    Quantity(column=TOUCHING, meaning="share of the smarticles in the largest cluster of touching ones"),
    Quantity(column=ENTANGLED, meaning="share of the smarticles in the largest cluster of entangled ones"),
    Quantity(column=HEIGHT, meaning="of the centre of mass above the floor"),
    Quantity(
        column=ABOVE,
        label="above the hook",
        form=".2f",
        meaning="share of the smarticles whose centre of mass is above the hook",
    ),
    Quantity(
        column=ENERGY,
        label="energy [J]",
        form=".2e",
        meaning="work of the motors, or of the shaken floor, up to the pull; static: none",
    ),
    Quantity(
        column=PEAK,
        label="strength",
        form=".3f",
        meaning=f"largest mean over {WINDOW:g} s of the force that raises the hook, over n W_s; at least, where the "
        "pile held fast",
    ),
    Quantity(
        column=BEYOND, meaning="strength less the share of the smarticles above the hook, their weight over n W_s"
    ),
    Quantity(column=LIFTS, meaning="the energy over the work that lifts a smarticle by w"),
    Quantity(column=RAISED, meaning="how far the hook had been raised at the peak"),
    Quantity(column=WORK, meaning="∫ F dz over the whole pull, over n W_s w"),
    Quantity(column=HELD_FAST, meaning="1 where the hook was stopped by its force limit on the way, 0 elsewhere"),
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
    """Measure the pile before the pull, the energy spent on it, and its strength."""
    procedure = prepared_by(run, PULL)
    pulled, named = run.phases[-1], _NAMED.fullmatch(run.path.name)
    rest = pulled.index - 1
    settings, series = run.scene["phases"], run.series
    hooks, frames = run.scene.get("hooks"), run.frames.in_phase(rest)
    if named is None:  # the run's own time is rounded to whole swings
        msg = f"{run.path}: not named like a run of this study, such as internal10_2s_lw0.70_seed1"
        raise InputError(msg)
    if hooks is None or not frames or settings[pulled.index]["type"] != PULL:
        msg = f"{run.path}: no hooks or pull in scene.yaml, or no frame of the rest before the pull; run it again"
        raise InputError(msg)
    before = summarise_run(run, definitions=[DEFINITION], phases={rest}).set_index("phase").loc[rest]
    heights = centres_of_mass(frames[-1].vertices)[:, 2] - frames[-1].floor_z
    above = float((heights > hooks["upper_height_m"]).mean())
    weight = weight_of_one(run)
    total, energy = run.manifest.count * weight, _spent(run, procedure, rest) / run.manifest.count
    pull = read_pull(run, series, pulled.index)
    highest = peak(pull)
    return {
        PROCEDURE: procedure,
        THETA: settings[2]["theta_deg"] if procedure == INTERNAL else math.nan,
        ASPECT: round(run.manifest.aspect_ratio, 6),
        SEED: run.manifest.seed,
        "smarticles [-]": run.manifest.count,
        "fidelity": run.manifest.fidelity,
        PLANNED: float(named["time"]),
        ACTIVE: duration(run.phases[2]) if procedure != STATIC else 0.0,
        **{column: before[measured] for column, measured in _MEASURED.items()},
        ABOVE: above,
        ENERGY: energy,
        LIFTS: energy / weight / run.manifest.middle_length_m,
        PEAK: highest.force / total,
        BEYOND: highest.force / total - above,
        RAISED: highest.raised,
        WORK: pull.work / total / run.manifest.middle_length_m,
        HELD_FAST: float(held_fast(pull, settings[pulled.index])),
        "escaped at the end [-]": before["escaped [-]"],
        "frames averaged [-]": int(before["frames averaged"]),
        "scene_sha256": run.manifest.scene_sha256,
        "run": run.path.name,
    }


def _spent(run: Run, procedure: str, rest: int) -> float:
    """Read the work that an activity spent on the smarticles, to the end of the rest after it [J]."""
    if procedure == STATIC:
        return 0.0
    series = run.series
    name = "container_work_J" if procedure == EXTERNAL else "motor_work_J"
    work = series.data.get(name)
    if work is None:
        msg = f"{series.path}: no {name} of {run.path}; run it with recording.energy"
        raise InputError(msg)
    known = np.isfinite(work)
    start, end = (work[known & (series["phase"] <= phase)] for phase in (1, rest))
    return float(end[-1] - (start[-1] if len(start) else 0.0)) if len(end) else math.nan


# Which measure goes with strength

RESAMPLES, DRAW = 1000, 17
STRENGTH, SCOPE, PART, PREDICTOR = "strength", "scope", "runs", "measure"
RHO, LOW, HIGH = "rank correlation [-]", "from [-]", "to [-]"
FIRST, OTHER, VERDICT = "first in resamples [-]", "other", "verdict"
LEAD = "rank correlation of the best less the other's, in size [-]"
ALL, WITHIN = "over all l/w", "within l/w"
EVERY, FREE, SWUNG = "all", "none held fast", "static and internal alone"
"""Of which runs correlations are: all, those whose strength is no lower bound, and those of one procedure."""


def trajectories(runs: pd.DataFrame) -> pd.Series:
    """Number the trajectory of each run: those of one l/w, seed, procedure and θ are alike up to the shortest."""
    return runs.groupby([ASPECT, SEED, PROCEDURE, THETA], dropna=False, sort=False).ngroup()


def predicted(runs: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Correlate each strength with each measure.

    Returns:
        One row per strength, part of the runs, scope and measure, best first: rank correlation and slope with 95 %
        intervals; and one per other measure with the difference from the best.
    """
    each: list[dict[str, object]] = []
    against: list[dict[str, object]] = []
    parts = {
        EVERY: runs,
        FREE: runs[runs[HELD_FAST] == 0],
        SWUNG: runs[runs[PROCEDURE].isin([STATIC, INTERNAL])],
    }
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
    """The rows of one part, scope and strength."""
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
    rho, slopes = values[: len(names)], values[len(names) :]
    sizes = drawn[:, : len(names)] * np.sign(rho)
    # Columns that are the same throughout have no correlation, and none is first.
    order = [int(k) for k in np.argsort(-np.abs(np.where(np.isfinite(rho), rho, 0)), kind="stable")]
    first = np.bincount(np.nanargmax(np.where(np.isfinite(sizes), sizes, -np.inf), axis=1), minlength=len(names))
    unknown = ~np.isfinite(sizes).any()
    spread = (table[names] - table[names].groupby(levels).transform("mean")).to_numpy(dtype=np.float64).std(axis=0)
    found = []
    for k in order:
        ends = interval(float(rho[k]), drawn[:, k].tolist())
        tilt = interval(float(slopes[k]), drawn[:, len(names) + k].tolist())
        found.append(
            {
                PREDICTOR: names[k],
                "runs [-]": len(table),
                "trajectories [-]": len(np.unique(blocks)),
                RHO: ends.value,
                LOW: ends.low,
                HIGH: ends.high,
                "slope per unit of the measure": tilt.value,
                "slope per SD [-]": tilt.value * spread[k],
                "slope from [-]": tilt.low * spread[k],
                "slope to [-]": tilt.high * spread[k],
                FIRST: np.nan if unknown else first[k] / RESAMPLES,
            }
        )
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
    """Select runs that were active, with what they gained over the poured pile of the same l/w and seed."""
    poured = runs[runs[PROCEDURE] == STATIC].groupby([ASPECT, SEED])[PEAK].mean().rename("poured")
    active = runs[runs[PROCEDURE] != STATIC].join(poured, on=[ASPECT, SEED], how="inner").reset_index(drop=True)
    return active.assign(**{GAIN: active[PEAK] - active["poured"]}).drop(columns="poured")


def common_aspects(runs: pd.DataFrame) -> list[float]:
    """List the aspect ratios with most combinations of procedure, θ and planned time: all of them, where it is done."""
    counts = runs.drop_duplicates([ASPECT, *_POINT]).groupby(ASPECT).size()
    return [float(ratio) for ratio in counts.index[counts == counts.max()]]


def costs(runs: pd.DataFrame) -> pd.DataFrame:
    """Average gain and energy over pairs by procedure, θ and planned time, over the common l/w and at each l/w.

    Returns:
        Means with their errors, the gain per energy with its 95 % interval, and whether no other point of the scope
        gains as much for less energy.
    """
    gained = gains(runs)
    scopes = {COMMON: gained[gained[ASPECT].isin(common_aspects(runs))]}
    scopes |= {f"l/w = {ratio:g}": part for ratio, part in gained.groupby(ASPECT)}
    tables = []
    for scope, part in scopes.items():
        rows = []
        for point, group in part.groupby(_POINT, dropna=False):
            ratio = _drawn_ratio(group[[GAIN, LIFTS]].to_numpy(dtype=np.float64))
            rows.append(
                {
                    SCOPE: scope,
                    **dict(zip(_POINT, point, strict=True)),
                    PAIRS: len(group),
                    **{key: cell for name in (GAIN, ENERGY, LIFTS) for key, cell in _mean(group, name).items()},
                    YIELD: ratio.value,
                    LOW: ratio.low,
                    HIGH: ratio.high,
                }
            )
        table = pd.DataFrame(rows)
        if len(table):
            best = [
                float(row[GAIN] > 0 and not (table.loc[table[LIFTS] < row[LIFTS], GAIN] >= row[GAIN]).any())
                for _, row in table.iterrows()
            ]
            tables.append(table.assign(**{FRONTIER: best}))
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()


def _mean(group: pd.DataFrame, name: str) -> Mapping[str, float]:
    return mean_columns(name, mean_over_seeds(group[name]))


def _drawn_ratio(values: Floats) -> Interval:
    """Divide means of pairs, gain over energy, and where there are four columns that by the same of the others.

    With the 95 % interval by drawing pairs anew; NaN ends below three pairs.
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
    """Select of each procedure the point of the common l/w that gains most per energy, of those that surely gain."""
    known = table[(table[SCOPE] == COMMON) & (table[LOW] > 0)] if len(table) else table
    if known.empty:
        return known
    return known.sort_values(YIELD, ascending=False).groupby(PROCEDURE, sort=False).head(1).reset_index(drop=True)


def _at_point(gained: pd.DataFrame, point: pd.Series) -> pd.DataFrame:
    """Pairs of one procedure, θ and planned time, by l/w and seed."""
    same = (gained[PROCEDURE] == point[PROCEDURE]) & np.isclose(gained[PLANNED], point[PLANNED])
    same &= np.isclose(gained[THETA], point[THETA], equal_nan=True)
    return gained[same].set_index([ASPECT, SEED])


# Findings


def _interval(value: float, low: float, high: float, form: str = "+.2f") -> str:
    """`+0.71 (+0.60 to +0.79)`, with the 95 % interval as far as there is one."""
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
    """`internal θ = 10° for 2 s`."""
    theta = "" if math.isnan(row[THETA]) else f" θ = {row[THETA]:g}°"
    return f"{row[PROCEDURE]}{theta} for {row[PLANNED]:g} s"


def _best(predictors: pd.DataFrame, comparisons: pd.DataFrame, strength: str, scope: str) -> Outcome:
    found, against = (_at(table, strength, EVERY, scope) for table in (predictors, comparisons))
    if found.empty or not np.isfinite(found[RHO].iloc[0]):
        return Outcome(verdict=Verdict.NO_DATA)
    first = found.iloc[0]
    rivals = against[against[VERDICT] == "not resolved"]
    surely = rivals.empty and len(against) > 0 and math.isfinite(first[LOW])
    listed = ", ".join(f"{PREDICTORS[row[PREDICTOR]]} {_rho(row)}" for _, row in found.iloc[:4].iterrows())
    open_ = f"; not resolved against {', '.join(PREDICTORS[name] for name in rivals[OTHER])}" if len(rivals) else ""
    share = told_number(100 * first[FIRST], ".0f")
    return Outcome(
        note=f"{PREDICTORS[first[PREDICTOR]]}, first in {share} % of resamples; rank correlations {listed}{open_}",
        verdict=Verdict.FOUND if surely else Verdict.NOT_RESOLVED,
    )


def _sign(predictors: pd.DataFrame, measure: str, part: str) -> Outcome:
    rows = _at(predictors, PEAK, part, WITHIN)
    rows = rows[rows[PREDICTOR] == measure] if len(rows) else rows
    if rows.empty:
        return Outcome(verdict=Verdict.NO_DATA)
    row = rows.iloc[0]
    verdict = Verdict.FOUND if row[LOW] > 0 else Verdict.NOT_FOUND if row[HIGH] < 0 else Verdict.NOT_RESOLVED
    return Outcome(note=f"rank correlation {_rho(row)}", verdict=verdict)


def _cheapest(runs: pd.DataFrame, table: pd.DataFrame) -> Outcome:
    best = best_points(table)
    if best.empty:
        return Outcome(note="no procedure surely gains strength", verdict=Verdict.NOT_RESOLVED)
    gained = gains(runs)
    gained = gained[gained[ASPECT].isin(common_aspects(runs))]
    ratios = {}
    for _, row in best.iloc[1:].iterrows():
        # Over the l/w and seeds that both have, drawn together.
        pair = [_at_point(gained, point)[[GAIN, LIFTS]] for point in (best.iloc[0], row)]
        both = pd.concat(pair, axis=1, join="inner").to_numpy(dtype=np.float64)
        ratios[row[PROCEDURE]] = _drawn_ratio(both)
    listed = "; ".join(
        f"{_named(row)} {_interval(row[YIELD], row[LOW], row[HIGH], '.3g')}" for _, row in best.iterrows()
    )
    times = ", ".join(f"{_interval(one.value, one.low, one.high, '.3g')} times {name}" for name, one in ratios.items())
    without = sorted(set(map(str, table[PROCEDURE])) - set(best[PROCEDURE]))
    note = f"n W_s gained per W_s w of energy and smarticle: {listed}" + (f"; the first {times}" if times else "")
    surely = bool(ratios) and all(ratio.low > 1 for ratio in ratios.values())
    return Outcome(
        note=note + (f"; no sure gain: {', '.join(without)}" if without else ""),
        verdict=Verdict.FOUND if surely else Verdict.NOT_RESOLVED,
    )


def _as_strong(runs: pd.DataFrame, costs: pd.DataFrame) -> Outcome:
    table = costs[costs[SCOPE] == COMMON] if len(costs) else costs
    shape, swung = (table[table[PROCEDURE] == name] if len(table) else table for name in (SHAPE, INTERNAL))
    if shape.empty or swung.empty:
        return Outcome(verdict=Verdict.NO_DATA)
    gained = gains(runs)
    gained = gained[gained[ASPECT].isin(common_aspects(runs))]
    by_shape = _at_point(gained, shape.iloc[0])[GAIN]
    lacks = {
        _named(row): mean_over_seeds((by_shape - _at_point(gained, row)[GAIN]).dropna().tolist())
        for _, row in swung.iterrows()
    }
    nearest = min(lacks, key=lambda name: math.inf if math.isnan(lacks[name].value) else lacks[name].value)
    verdict = Verdict.NOT_RESOLVED
    if judge(lacks[nearest]) == "not found":
        verdict = Verdict.FOUND
    elif all(judge(effect) == "found" for effect in lacks.values()):
        verdict = Verdict.NOT_FOUND
    return Outcome(
        note=f"shape change less the strongest, {nearest}: {told(lacks[nearest], 3)} n W_s over l/w and seeds; it "
        f"spends {shape.iloc[0][LIFTS]:.3g} W_s w per smarticle",
        verdict=verdict,
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

_STRENGTH = r"strength $F/(n W_\mathrm{s})$ [-]"
_ENERGY = "energy per smarticle [J]"
_MAPPED = {
    PHI: r"$\phi$ [-]",
    CROSSINGS: r"$\langle N\rangle$ [-]",
    LINKING: "linking\nnumber [-]",
    PEAK: "strength [-]",
}
_NAMES = {STATIC: "poured", SHAPE: "shape change", EXTERNAL: "shaken", INTERNAL: "oscillation"}
_PAGE = 2 * style.COLUMN_WIDTH
_CELL = 2.0**0.5  # cells of the maps reach by this factor of energy to either side, where no other one is nearer
_by_theta = one_by_one(THETA, lambda theta: rf"oscillation, $\theta$ = {theta:g}°")


def _draw_maps(path: Path, analysis: Analysis) -> list[Path]:
    """Draw a row of maps for each quantity, a column for each θ; a strip on the left for piles as poured."""
    points = analysis.points
    swung = points[(points[PROCEDURE] == INTERNAL) & (points[ENERGY] > 0)]
    poured = points[points[PROCEDURE] == STATIC]
    thetas, ratios = sorted(swung[THETA].unique()), sorted(pd.concat([swung, poured])[ASPECT].unique())
    if not thetas:
        return []
    half = min(np.diff(ratios), default=0.1) / 2
    left, right = float(swung[ENERGY].min()) / _CELL, float(swung[ENERGY].max()) * _CELL
    figure = style.blank_figure(_PAGE, 1.35 * len(_MAPPED) + 0.5)
    grid = figure.subplots(len(_MAPPED), len(thetas), sharex=True, sharey=True, squeeze=False)
    for panels, (quantity, label) in zip(grid, _MAPPED.items(), strict=True):
        shown = pd.concat([swung, poured])[quantity]
        norm = Normalize(float(shown.min()), float(shown.max()))
        for axes, theta in zip(panels, thetas, strict=True):
            for aspect, row in swung[swung[THETA] == theta].groupby(ASPECT):
                cells = row.sort_values(ENERGY)
                energies = cells[ENERGY].to_numpy(dtype=np.float64)
                edges = [energies[0] / _CELL, *np.sqrt(energies[:-1] * energies[1:]), energies[-1] * _CELL]
                at_rest = poured.loc[poured[ASPECT] == aspect, quantity]
                strips = [(edges, cells[quantity]), *(([left / 4, left / 2], [value]) for value in at_rest)]
                for along, values in strips:
                    axes.pcolormesh(
                        along, [aspect - half, aspect + half], np.array([values]), norm=norm, cmap="viridis"
                    )
            axes.set_xscale("log")
            axes.set_xlim(left / 5, right * 1.05)
            axes.grid(visible=False)
            axes.set_yticks(ratios)
            axes.axvline(left / 1.4, color=style.GREY, linewidth=0.6, linestyle=(0, (4, 3)))
        figure.colorbar(ScalarMappable(norm, "viridis"), ax=list(panels), pad=0.01, aspect=12).set_label(label)
        panels[0].set_ylabel(r"$l/w$ [-]")
    for axes, theta in zip(grid[0], thetas, strict=True):
        axes.set_title(rf"$\theta$ = {theta:g}°", fontsize=8)
    grid[-1][len(thetas) // 2].set_xlabel(_ENERGY)
    told = "Left of the broken line: poured, no energy spent. Each cell is a point, a mean over its seeds."
    return finished(figure, path, [told], analysis.footer)


def _draw_bought(axes: Any, table: pd.DataFrame, x: str, y: str) -> None:
    """Draw what each procedure buys for its energy: a line for each θ of the oscillation, markers for the others."""
    bought = table[table[x] > 0].sort_values(x)
    for series in _by_theta(bought[bought[PROCEDURE] == INTERNAL]):
        rows = series.rows
        draw_means(axes, rows[x], rows[y], rows[marked(y, "95 %")], look=series.look, label=series.label)
    for name in (EXTERNAL, SHAPE):
        rows = bought[bought[PROCEDURE] == name]
        if len(rows):
            look = {**procedure_marker(name), "linestyle": "none"}
            draw_means(axes, rows[x], rows[y], rows[marked(y, "95 %")], look=look, label=_NAMES[name])
    axes.set_xscale("log")


def _draw_energies(path: Path, analysis: Analysis) -> list[Path]:
    """Draw strength against energy, a panel for each l/w; the poured pile as a level."""
    groups = list(analysis.points.groupby(ASPECT))
    columns = min(len(groups), 4)
    lines = -(-len(groups) // columns)
    figure = style.blank_figure(_PAGE, 1.75 * lines + 0.5)
    grid = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    for axes in grid.flat[len(groups) :]:
        axes.set_visible(False)
    for axes, (ratio, here) in zip(grid.flat, groups, strict=False):
        _draw_bought(axes, here, ENERGY, PEAK)
        for level in here.loc[here[PROCEDURE] == STATIC, PEAK]:
            axes.axhline(level, color=style.GREY, linewidth=0.8, linestyle=(0, (4, 3)), label="poured")
        axes.set_ylim(bottom=0)
        axes.set_title(f"l/w = {ratio:g}", fontsize=8)
    for axes in grid[:, 0]:
        axes.set_ylabel(_STRENGTH)
    for axes in grid[-1]:
        axes.set_xlabel(_ENERGY)
    fullest = max(grid.flat, key=lambda axes: len(axes.get_legend_handles_labels()[1]))
    figure.legend(*fullest.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return finished(figure, path, [], analysis.footer)


def _draw_measures(path: Path, analysis: Analysis) -> list[Path]:
    """Draw the strength of every run against each measure, coloured by l/w."""
    runs = analysis.runs
    figure = style.blank_figure(_PAGE, 6.0)
    grid = figure.subplots(3, 3, sharey=True)
    norm = Normalize(float(runs[ASPECT].min()), float(runs[ASPECT].max()))
    for axes, name in zip(grid.flat, PREDICTORS, strict=True):
        known = runs[runs[name] > 0] if name == ENERGY else runs
        for procedure, mark in ((INTERNAL, "o"), (STATIC, "^"), (EXTERNAL, "D"), (SHAPE, "s")):
            part = known[known[PROCEDURE] == procedure]
            look = {"norm": norm, "cmap": "viridis", "linewidths": 0.3, "edgecolors": style.BLACK}
            if len(part):
                axes.scatter(part[name], part[PEAK], s=9, c=part[ASPECT], marker=mark, label=_NAMES[procedure], **look)
        axes.set_xscale("log" if name == ENERGY else "linear")
        axes.set_xlabel(CROSSINGS_LABEL if name == CROSSINGS else name)
        axes.set_ylim(bottom=0)
    for axes in grid[:, 0]:
        axes.set_ylabel(_STRENGTH)
    figure.colorbar(ScalarMappable(norm, "viridis"), ax=grid, label=r"$l/w$ [-]", pad=0.01, aspect=40)
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return finished(figure, path, ["Every run; energy: without piles as poured."], analysis.footer)


def _draw_correlations(path: Path, analysis: Analysis) -> list[Path]:
    """Draw rank correlations of strength with each measure, over all l/w and within l/w, with their intervals."""
    predictors = analysis.tables["predictors"]
    if predictors.empty:
        return []
    figure, axes = style.new_figure(width=1.5 * style.COLUMN_WIDTH, height=2.9)
    names = _at(predictors, PEAK, EVERY, WITHIN)[PREDICTOR].tolist()[::-1]
    for scope, mark, colour, beside in ((WITHIN, "o", style.ORANGE, 0.14), (ALL, "D", style.BLUE, -0.14)):
        rows = _at(predictors, PEAK, EVERY, scope).set_index(PREDICTOR).loc[names]
        places = np.arange(len(names)) + beside
        axes.hlines(places, rows[LOW], rows[HIGH], color=colour, linewidth=1.0)
        axes.plot(rows[RHO], places, mark, color=colour, markersize=4, label=scope)
    axes.axvline(0, color=style.GREY, linewidth=0.6)
    axes.set_xlim(-1, 1)
    axes.set_yticks(range(len(names)), [PREDICTORS[name] for name in names])
    axes.set_xlabel("rank correlation with strength [-]")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    told = "Lines: 95 % by resampling whole trajectories within each l/w. Within l/w: of ranks among runs of one l/w."
    return finished(figure, path, [told], analysis.footer)


def _draw_costs(path: Path, analysis: Analysis) -> list[Path]:
    """Draw strength gained against energy, means over the l/w where everything was run."""
    table = analysis.tables["cost"]
    if table.empty:
        return []
    figure, axes = style.new_figure(width=1.3 * style.COLUMN_WIDTH, height=2.9)
    _draw_bought(axes, table[table[SCOPE] == COMMON], LIFTS, GAIN)
    axes.axhline(0, color=style.GREY, linewidth=0.6)
    axes.set_xlabel(r"energy per smarticle over $W_\mathrm{s} w$ [-]")
    axes.set_ylabel(r"strength gained, over $n W_\mathrm{s}$ [-]")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    told = "Means over pairs of one l/w and seed, at the l/w at which everything was run; error bars count pairs."
    return finished(figure, path, [told], analysis.footer)


def _extra(runs: pd.DataFrame) -> Mapping[str, pd.DataFrame]:
    predictors, comparisons = predicted(runs)
    return {"predictors": predictors, "comparisons": comparisons, "cost": costs(runs)}


def _shown(points: pd.DataFrame) -> pd.DataFrame:
    """Select at each l/w the poured pile, those after a shape change, and the strongest oscillation."""
    swung = points[points[PROCEDURE] == INTERNAL]
    strongest: Sequence[Any] = swung.loc[swung[PEAK].notna()].groupby(ASPECT)[PEAK].idxmax()
    return points[points[PROCEDURE].isin([STATIC, SHAPE]) | points.index.isin(strongest)]


STUDY = Study(
    name="landscape",
    title="Packing, entanglement, linking and strength over l/w, θ and the energy spent",
    measure=measure,
    keys=(
        Key(column=ASPECT, label="l/w", form="g"),
        Key(column=PROCEDURE, label="procedure"),
        Key(column=THETA, label="θ", form="g", unit="°"),
        Key(column=PLANNED, label="for", form="g", unit=" s"),
    ),
    quantities=QUANTITIES,
    findings=FINDINGS,
    figures=(
        Drawing(name="maps", of=_draw_maps),
        Drawing(name="strength_energy", of=_draw_energies),
        Drawing(name="strength_measures", of=_draw_measures),
        Drawing(name="correlations", of=_draw_correlations),
        Drawing(name="cost", of=_draw_costs),
    ),
    extra=_extra,
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
