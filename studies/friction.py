"""Which coefficient of friction, 0.2 to 0.8, gives Gravish's packing fractions, and is it steel's?

U-shapes of three l/w are poured and shaken for 20 s as by Gravish, Franklin, Hu and Goldman, "Entangled granular
media", Phys. Rev. Lett. 108, 208001 (2012). Smarticles and walls have equal friction. φ is interpolated linearly in
friction; Gravish's points are not interpolated. Errors are 95 % by Student's t. The scatter over seeds is taken
relative to the mean and pooled over all points of a stage.
"""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import stdtr, stdtrit

from dem.record.run import Run
from postprocess.statistics.points import ASPECT, SEED, SEEDS, format_with_error, marked, seeds_of
from postprocess.statistics.seeds import CONFIDENCE as LEVEL
from postprocess.statistics.seeds import Scatter, mean_over_seeds, pooled_scatter, slope_within
from studies.framework.figures import POOLED, Means, one_by_one
from studies.framework.findings import Effect, Finding, Outcome, Verdict, decide
from studies.framework.runs import ASPECT_KEY, DEFINITION, Key, Quantity, Row
from studies.framework.shaken import (
    DIGITISING_ERROR,
    FRICTION,
    GRAVISH,
    PHI_TIME,
    SHAKE_TIME,
    STAGES,
    TIMES,
    WHEN,
    WINDOW,
    at_time,
    common_friction,
    gravish_at,
    gravish_note,
    phi,
    timed_row,
)
from studies.framework.study import Study

Array = NDArray[np.float64]

PAPERS = 0.4  # coefficient of friction of Savoie et al.
MARGIN = 5.0  # %, accepted deviation from Gravish's points
SURE = 0.95  # least confidence for a verdict
STEP = 0.001  # of friction, resolution of intervals and of the best friction
ROUNDING = 1e-12  # of φ, for a curve without errors that passes exactly through Gravish's φ

# Published static coefficients of dry steel on steel, lowest and highest. Untreated: 0.12 to 0.60 (Lust, Engineering
# Guide CDA3000, table 7.21), 0.15 to 0.30 (Gieck, Technical Formulae), 0.27 with a thick film of oxide, 0.31 AISI 1032
# on itself (Davis, Concise Metals Data Handbook). Clean: 0.78, 0.74 mild steel (Lawrence Berkeley National Laboratory,
# A. J. DeMello, Coefficient of Friction). Tables can mislead since friction depends on films and loads (Blau, Tribology
# International 34 (2001) 585); the coating of Gravish's staples is unknown.
STEEL = {"dry steel as it comes": (0.12, 0.60), "clean, dry steel": (0.74, 0.78)}

COMPARED = {
    "phi_0": "phi_0",
    "phi 5 s": "phi_f",
    "phi 10 s": "phi_f",
    "phi_f": "phi_f",
    "phi_f relaxed": "phi_f relaxed",
}  #: Gravish's stage that each of our stages is compared with; φ after 5 s and after 10 s is compared with φ_f

# Sets of stages that a finding asks to be near Gravish's at one friction, by their name.
JUDGED: dict[str, Sequence[str]] = {
    "phi_0": ("phi_0",),
    "phi_f": ("phi_f",),
    "phi_f relaxed": ("phi_f relaxed",),
    "phi_0 and phi_f": ("phi_0", "phi_f"),
    "phi_0 and phi_f relaxed": ("phi_0", "phi_f relaxed"),
}

STAGE, PHI, REFERENCE, DEVIATION = "stage", "phi [-]", "phi Gravish [-]", "deviation [%]"
CONFIDENCE, LEAST = "confidence [%]", "confidence of the worst point [%]"
LARGEST, MEAN, SIGNED = "largest deviation [%]", "mean absolute deviation [%]", "mean [%]"
VERDICT, WHAT, COUNTED = "within 5 %", "what", "points compared [-]"
LOW, HIGH, FIRST, LAST = "from [-]", "to [-]", "measured from [-]", "measured to [-]"
GROWTHS = tuple(f"growth from {one:g} to {other:g} s [%]" for one, other in itertools.pairwise(TIMES))
_SURELY = f"confidence of {SURE:.0%} that all points are; not found where a point is surely farther off"
PHI_QUANTITY = Quantity(
    column=PHI, label="φ_f", form=".4f", meaning="packing fraction at a stage", axis=r"packing fraction $\phi$ [-]"
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Curve:
    """φ against friction at one l/w and stage, with Gravish's φ."""

    friction: Array  #: (n,) coefficients, ascending [-]
    packing: Array  #: (n,) means of φ [-]
    half_widths: Array  #: (n,) half-widths of the 95 % intervals of the means [-]; NaN where unknown
    reference: float  #: Gravish's φ [-], with the error `DIGITISING_ERROR`
    scatter: Scatter  #: Relative scatter over seeds, pooled over the stage

    def deviation(self, friction: Array) -> Array:
        """Return φ less Gravish's φ (m,) [-] at coefficients of friction (m,), interpolated linearly."""
        return np.asarray(np.interp(friction, self.friction, self.packing) - self.reference, dtype=np.float64)

    def error(self, friction: Array) -> Array:
        """Return the 95 % half-width (m,) [-] of `deviation`, from errors of the means and of Gravish's point."""
        if len(self.friction) == 1:
            return np.asarray(np.hypot(np.full(friction.shape, self.half_widths[0]), DIGITISING_ERROR))
        right = np.clip(np.searchsorted(self.friction, friction), 1, len(self.friction) - 1)
        low, high = self.friction[right - 1], self.friction[right]
        part = (friction - low) / (high - low)
        of_mean = np.hypot((1 - part) * self.half_widths[right - 1], part * self.half_widths[right])
        return np.asarray(np.hypot(of_mean, DIGITISING_ERROR), dtype=np.float64)

    def grid(self) -> Array:
        """Return all measured coefficients of friction, and steps of `STEP` over their range: (m,) [-]."""
        steps = np.arange(self.friction[0], self.friction[-1] + STEP / 2, STEP)
        return np.unique(np.concatenate([np.clip(steps, None, self.friction[-1]), self.friction]))

    def crossing(self) -> tuple[float, float, float, str]:
        """Find the friction at which φ equals Gravish's φ.

        Returns this friction [-], the lower and the upper end of its 95 % interval [-], and where it lies relative to
        the measured friction: "within the range", "above the range" or "below the range". If φ crosses Gravish's φ
        several times because of scatter, the friction is the middle between the first and the last crossing. If φ does
        not cross it, the friction is +inf (above) or −inf (below).

        The interval has all values of friction at which φ differs from Gravish's φ by no more than its error. An end is
        ±inf if it may lie outside the measured range, and NaN if the errors are unknown.
        """
        off = self.packing - self.reference
        left = np.nonzero(off[:-1] * off[1:] < 0)[0]
        between = self.friction[left] + off[left] / (off[left] - off[left + 1]) * np.diff(self.friction)[left]
        found = np.sort([*self.friction[off == 0], *between])
        above = bool(off[0] > 0)
        place = "within the range" if len(found) else "above the range" if above else "below the range"
        value = float(found[0] + found[-1]) / 2 if len(found) else math.inf if above else -math.inf
        grid = np.unique([*self.grid(), *found])
        errors = self.error(grid)
        if not np.isfinite(errors).all():
            return value, math.nan, math.nan, place
        near = grid[np.abs(self.deviation(grid)) <= errors + ROUNDING]
        first, last = float(grid[0]), float(grid[-1])
        if not len(near):  # φ clearly differs at every measured friction
            return (value, last, math.inf, place) if above else (value, -math.inf, first, place)
        low = -math.inf if near[0] == first or place == "below the range" else float(near[0])
        high = math.inf if near[-1] == last or place == "above the range" else float(near[-1])
        return value, low, high, place

    def within(self, margin: float, friction: float) -> float:
        """Return the confidence that φ is within a margin [-] of Gravish's φ; NaN if the errors are unknown."""
        at = np.array([friction])
        deviation, error = float(self.deviation(at)[0]), float(self.error(at)[0]) / _per_error(self.scatter)
        if not math.isfinite(error):
            return math.nan
        upper, lower = (stdtr(self.scatter.freedom, (side * margin - deviation) / error) for side in (1, -1))
        return float(upper - lower)


Curves = Mapping[tuple[str, float], Curve]  #: Curves by stage and l/w, only where Gravish has a point


def measure(run: Run) -> Row:
    """Measure φ before, during, at the end of and after shaking; return the run's row."""
    return timed_row(run, {FRICTION: common_friction(run)})


def _per_error(scatter: Scatter) -> float:
    """Return the ratio of the 95 % half-width to the standard error; NaN without degrees of freedom."""
    return float(stdtrit(scatter.freedom, (1 + LEVEL) / 2)) if scatter.freedom else math.nan


def tabulate(runs: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Make the tables of the study, by name, from the table of runs.

    `points`, `crossings`, `verdicts`, `nearest` and `growth` are made by the functions of these names. The table
    `scatter` has the scatter of φ over seeds, relative to the mean, at each stage.
    """
    scatters = {}
    for name in (stage for stage in COMPARED if phi(stage) in runs):
        groups = [group[phi(name)].dropna() for _, group in runs.groupby([ASPECT, FRICTION])]
        scatters[name] = pooled_scatter([(group / group.mean()).tolist() for group in groups])
    means = points(runs, scatters)
    found = curves(means, scatters)
    rows = [(stage, 100 * one.value, one.freedom) for stage, one in scatters.items()]
    return {
        "points": means,
        "crossings": crossings(found),
        "verdicts": verdicts(found),
        "nearest": nearest(found),
        "growth": growth(runs),
        "scatter": pd.DataFrame(rows, columns=[STAGE, "relative scatter [%]", "degrees of freedom [-]"]),
    }


def points(runs: pd.DataFrame, scatters: Mapping[str, Scatter]) -> pd.DataFrame:
    """Average φ and compute its deviation from Gravish's φ [%]: a row per stage, l/w and friction.

    The error of the deviation includes the error of reading Gravish's points. `scatters` has the relative scatter over
    seeds of each stage.
    """
    rows = []
    for stage, scatter in scatters.items():
        for (aspect, friction), group in runs.groupby([ASPECT, FRICTION]):
            known = group[group[phi(stage)].notna()]
            if known.empty:
                continue
            mean = float(known[phi(stage)].mean())
            half_width = _per_error(scatter) * scatter.value * mean / math.sqrt(len(known))
            value = gravish_at(aspect, COMPARED[stage])
            row = {STAGE: stage, ASPECT: aspect, FRICTION: friction, **seeds_of(known), PHI: mean}
            row |= {marked(PHI, "95 %"): half_width, REFERENCE: value, DEVIATION: 100 * (mean / value - 1)}
            rows.append(row | {marked(DEVIATION, "95 %"): 100 * math.hypot(half_width, DIGITISING_ERROR) / value})
    return pd.DataFrame(rows)


def curves(table: pd.DataFrame, scatters: Mapping[str, Scatter]) -> Curves:
    """Make a curve of φ against friction for each stage and l/w at which Gravish has a point.

    `scatters` has the relative scatter over seeds, by stage.
    """
    found = {}
    for (stage, aspect), group in table[table[REFERENCE].notna()].groupby([STAGE, ASPECT], sort=False):
        rows = group.sort_values(FRICTION)
        found[str(stage), float(aspect)] = Curve(
            friction=rows[FRICTION].to_numpy(),
            packing=rows[PHI].to_numpy(),
            half_widths=rows[marked(PHI, "95 %")].to_numpy(),
            reference=float(rows[REFERENCE].iloc[0]),
            scatter=scatters[str(stage)],
        )
    return found


def crossings(found: Curves) -> pd.DataFrame:
    """Tabulate the friction at which each curve has Gravish's φ, see `Curve.crossing`."""
    columns = [STAGE, ASPECT, REFERENCE, FRICTION, LOW, HIGH, "lies", FIRST, LAST]
    rows = [
        (stage, aspect, curve.reference, *curve.crossing(), curve.friction[0], curve.friction[-1])
        for (stage, aspect), curve in found.items()
    ]
    return pd.DataFrame(rows, columns=columns)


def nearness(found: Curves, friction: float) -> dict[str, float | int | str]:
    """Compare all curves with Gravish's φ at one coefficient of friction; return columns of a table.

    They are the number of curves, mean absolute, mean and largest deviation [%], the name of the curve with the largest
    one, and two confidences [%]: that all curves are within `MARGIN` of Gravish's φ, and that the least certain one is.
    """
    at = np.array([friction])
    deviations = {
        f"{stage} at l/w = {aspect:g}": 100 * float(curve.deviation(at)[0]) / curve.reference
        for (stage, aspect), curve in found.items()
    }
    worst = max(deviations, key=lambda name: abs(deviations[name]))
    sure = [curve.within(MARGIN / 100 * curve.reference, friction) for curve in found.values()]
    values = np.array(list(deviations.values()))
    return {
        COUNTED: len(deviations),
        MEAN: float(np.abs(values).mean()),
        SIGNED: float(values.mean()),
        LARGEST: deviations[worst],
        "largest at": worst,
        CONFIDENCE: 100 * math.prod(sure),
        LEAST: 100 * min(sure, default=math.nan),
    }


def verdict(near: Mapping[str, float | int | str], *, whole: bool) -> str:
    """Judge whether all points are within `MARGIN` of Gravish's: "yes", "no" or "undetermined".

    `near` is a result of `nearness`. Yes: the confidence for all points together, with independent errors, is at least
    `SURE`, and no point is missing (`whole`). No: at least one point is farther off with the confidence `SURE`, by
    Bonferroni's correction for the number of points.
    """
    confidence, least, count = (float(near[name]) for name in (CONFIDENCE, LEAST, COUNTED))
    if confidence >= 100 * SURE and whole:
        return "yes"
    return "no" if least * count <= 100 * (1 - SURE) else "undetermined"


def verdicts(found: Curves) -> pd.DataFrame:
    """Tabulate `nearness` and `verdict` for each set of stages in `JUDGED` at each measured friction."""
    rows = []
    for what, stages in JUDGED.items():
        wanted = {key: curve for key, curve in found.items() if key[0] in stages}
        for friction in sorted({float(friction) for curve in wanted.values() for friction in curve.friction}):
            measured = {key: curve for key, curve in wanted.items() if friction in curve.friction}
            near = nearness(measured, friction)
            row = {WHAT: what, FRICTION: friction, **near, "points wanted [-]": len(wanted)}
            rows.append({**row, VERDICT: verdict(near, whole=len(measured) == len(wanted))})
    return pd.DataFrame(rows)


def nearest(found: Curves) -> pd.DataFrame:
    """Tabulate the friction at which the largest deviation from Gravish's φ is smallest.

    The table has a row per set of stages in `JUDGED`, with the columns of `nearness` and the verdict at this friction.
    """
    rows = []
    for what, stages in JUDGED.items():
        wanted = {key: curve for key, curve in found.items() if key[0] in stages}
        grids = [curve.grid() for curve in wanted.values()]
        if not grids:
            continue
        grid = np.unique(np.concatenate(grids))
        grid = grid[(grid >= max(one[0] for one in grids)) & (grid <= min(one[-1] for one in grids))]
        if not len(grid):
            continue
        worst = np.max([np.abs(curve.deviation(grid)) / curve.reference for curve in wanted.values()], axis=0)
        friction = float(grid[np.argmin(worst)])
        near = nearness(wanted, friction)
        rows.append({WHAT: what, FRICTION: friction, **near, VERDICT: verdict(near, whole=True)})
    return pd.DataFrame(rows)


def growth(runs: pd.DataFrame) -> pd.DataFrame:
    """Tabulate mean φ at `TIMES`, and its mean growth between them [%]: a row per l/w and friction.

    The 95 % half-widths of the growth follow from the scatter over seeds, pooled over all rows.
    """
    names = [phi(at_time(time)) for time in TIMES]
    grown = runs.reindex(columns=[*runs.columns, *(set(names) - set(runs.columns))])
    for name, (one, other) in zip(GROWTHS, itertools.pairwise(names), strict=True):
        grown[name] = 100 * (grown[other] / grown[one] - 1)
    groups = grown.groupby([ASPECT, FRICTION])
    table = groups.size().to_frame(SEEDS)
    # `groups.mean()` would sum in another order and change the last digits.
    means = groups[[*names, *GROWTHS]].agg(lambda column: column.mean())
    table[[f"{at_time(time)} [-]" for time in TIMES]] = means[names]
    for name in GROWTHS:
        scatter = pooled_scatter([group.tolist() for _, group in groups[name]])
        width = _per_error(scatter) * scatter.value
        table[name], table[marked(name, "95 %")] = means[name], width / np.sqrt(groups[name].count())
    return table.reset_index()


def _crossings_note(found: pd.DataFrame) -> str:
    """Format `phi_f at l/w = 0.7: 0.61 (0.52 to 0.74)` for each crossing, with its 95 % interval."""
    return "; ".join(
        f"{row[STAGE]} at l/w = {row[ASPECT]:g}: {row[FRICTION]:.2f} ({row[LOW]:.2f} to {row[HIGH]:.2f})"
        for _, row in found.iterrows()
    )


def _of_stages(table: pd.DataFrame, what: str) -> pd.DataFrame:
    return table[table[WHAT] == what] if len(table) else table


def one_friction(what: str) -> Finding:
    """Make the finding that φ is near Gravish's φ at every l/w with one coefficient of friction.

    `what`, a key of `JUDGED`, is the set of stages at which φ is compared.
    """

    def outcome(tried: pd.DataFrame, best: pd.DataFrame) -> Outcome:
        tried, best = _of_stages(tried, what), _of_stages(best, what)
        if tried.empty or best.empty:
            return Outcome(note="no points of Gravish's at these l/w", verdict=Verdict.NOT_RESOLVED)
        one, verdicts = best.iloc[0], tried[VERDICT]
        note = f"nearest at {one[FRICTION]:.2f} (between measured points): {one[MEAN]:.1f} % on average over "
        note += f"{one[COUNTED]} points, at most {one[LARGEST]:+.1f} %, {one['largest at']}; confidence that all are "
        note += f"within {MARGIN:g} %: {format_with_error(one[CONFIDENCE], '.0f')} %"
        wrong = (verdicts == "no").all() and one[VERDICT] == "no"
        return Outcome(note=note, verdict=decide((verdicts == "yes").any(), wrong))

    return Finding(
        id=f"one-friction-{what.replace(' ', '-').replace('_', '-')}",
        says=f"One friction brings {what} within {MARGIN:g} % of Gravish's at every l/w measured",
        outcome=outcome,
        tables=("verdicts", "nearest"),
        found_if=_SURELY,
    )


def _papers(tried: pd.DataFrame) -> Outcome:
    found = _of_stages(tried, "phi_f")
    found = found[found[FRICTION] == PAPERS] if len(found) else found
    if found.empty:
        return Outcome(note="no runs at it", verdict=Verdict.NOT_RESOLVED)
    row = found.iloc[0]
    note = f"{row[MEAN]:.1f} % off on average over {row[COUNTED]} points, at most {row[LARGEST]:+.1f} %"
    return Outcome(note=note, verdict=decide(row[VERDICT] == "yes", row[VERDICT] == "no"))


def _common(found: pd.DataFrame) -> Outcome:
    found = found[found[STAGE].isin(["phi_0", "phi_f"])]
    known = len(found) > 0 and not found[[LOW, HIGH]].isna().any(axis=None)
    common = known and float(found[LOW].max()) <= float(found[HIGH].min())
    return Outcome(note=_crossings_note(found), verdict=decide(common, known and not common))


def of_steel(surface: str) -> Finding:
    """Make the finding that φ_f equals Gravish's φ_f at the coefficient of friction of steel.

    `surface`, a key of `STEEL`, is the condition of the steel that the coefficients were published for.
    """
    least, most = STEEL[surface]

    def outcome(found: pd.DataFrame) -> Outcome:
        found = found[found[STAGE] == "phi_f"]
        known = len(found) > 0 and found[[LOW, HIGH]].notna().all(axis=None)
        inside = known and ((found[LOW] >= least) & (found[HIGH] <= most)).all()
        beyond = known and ((found[LOW] > most) | (found[HIGH] < least)).any()
        return Outcome(note=_crossings_note(found), verdict=decide(inside, beyond))

    return Finding(
        id=f"{surface.replace(',', '').replace(' ', '-')}",
        says=f"The friction that phi_f asks for is that of {surface} (static, as published: {least:g} to {most:g})",
        outcome=outcome,
        tables=("crossings",),
        found_if="its 95 % intervals lie within what is published; not found where one lies beyond",
    )


def _grows(grown: pd.DataFrame) -> list[Effect]:
    late = grown[GROWTHS[-1]].dropna()
    mean = mean_over_seeds(late.tolist())
    text = f"{format_with_error(mean.value, '+.1f', mean.half_width)} % over {mean.count} points"
    return [Effect(label="growth, ± 95 %,", value=mean, text=text)]


def _grows_more(grown: pd.DataFrame) -> list[Effect]:
    known = grown[grown[GROWTHS[-1]].notna()]
    columns = (known[name].tolist() for name in (FRICTION, GROWTHS[-1], ASPECT))
    slope = slope_within(*columns)
    text = f"{format_with_error(slope.value / 10, '+.2f', slope.half_width / 10)} %"
    return [Effect(label="per 0.1 of friction, ± 95 %,", value=slope, text=text)]


def _growing(name: str, says: str, outcome: Callable[[pd.DataFrame], list[Effect]]) -> Finding:
    return Finding(id=name, says=says, outcome=outcome, tables=("growth",))


_LATE = f"between {TIMES[-2]:g} and {TIMES[-1]:g} s"
FINDINGS = (
    *map(one_friction, JUDGED),
    Finding(
        id="papers-friction",
        says=f"The paper's friction, {PAPERS:g}, brings phi_f within {MARGIN:g} % of Gravish's at every l/w measured",
        outcome=_papers,
        tables=("verdicts",),
        found_if=_SURELY,
    ),
    Finding(
        id="common-friction",
        says="There is a friction that neither phi_0 nor phi_f excludes at 95 % at any l/w",
        outcome=_common,
        tables=("crossings",),
        found_if="the 95 % intervals of all crossings overlap",
    ),
    *map(of_steel, STEEL),
    _growing("still-grows", f"phi still grows {_LATE} of shaking", _grows),
    _growing("grows-more-with-friction", f"phi grows more {_LATE} where friction is stronger", _grows_more),
)


def _crosses(tables: Mapping[str, pd.DataFrame], aspect: float) -> pd.DataFrame:
    """Return the points of a figure at which φ_0 and φ_f equal Gravish's at one l/w.

    The columns are the friction `x`, the ends `low` and `high` of its 95 % interval within the measured range, and φ
    `y` [-].
    """
    found = tables["crossings"]
    found = found[(found[ASPECT] == aspect) & found[STAGE].isin(["phi_0", "phi_f"]) & np.isfinite(found[FRICTION])]
    low, high = (found[name].clip(found[FIRST], found[LAST]) for name in (LOW, HIGH))
    return pd.DataFrame({"x": found[FRICTION], "low": low, "high": high, "y": found[REFERENCE]})


STUDY = Study(
    name="friction",
    title="Friction that packs smarticles as Gravish et al. 2012 found",
    measure=measure,
    keys=(Key(column=STAGE, label="stage"), ASPECT_KEY, Key(column=FRICTION, label="friction", form="g")),
    quantities=(
        PHI_QUANTITY,
        Quantity(column=DEVIATION, label="from Gravish [%]", form="+.1f", meaning="less Gravish's, over it"),
    ),
    findings=FINDINGS,
    figures=(
        Means(
            name="phi_friction",
            quantities=[PHI_QUANTITY],
            x=FRICTION,
            x_label=r"coefficient of friction $\mu$ [-]",
            split=one_by_one(STAGE, str),
            rows=lambda points: points[points[STAGE].isin(STAGES)],
            panels=ASPECT,
            levels=lambda points: {
                f"Gravish, {stage}": gravish_at(points[ASPECT].iloc[0], stage) for stage in ("phi_0", "phi_f")
            },
            share_y=True,
            crosses=_crosses,
            bars=POOLED,
            notes=[
                "Crosses: friction at which φ is Gravish's, with its 95 % interval as far as it was measured.",
                gravish_note((0.4, 0.7, 1.0)),
            ],
        ),
        replace(PHI_TIME, panels=ASPECT),
    ),
    extra=tabulate,
    shown=lambda means: means[means[STAGE] == "phi_f"],
    order=(ASPECT, FRICTION, SEED),
    one_engine=True,
    from_tables=True,
    remarks=(
        f"φ by {DEFINITION}; {WHEN}; in the course of shaking a mean over {WINDOW:g} s. Gravish et al. shook for "
        f"{SHAKE_TIME:g} s. The scatter behind errors is relative to the mean, pooled over all points of a stage.",
    ),
    reference=GRAVISH,
    pictured={"l_over_w": 0.7, "friction": 0.65},
)
