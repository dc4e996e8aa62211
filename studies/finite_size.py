"""Finite size: packing, entanglement and percolation in piles of 100 to 10 000 smarticles.

The study measures φ and ⟨N⟩ against N^(-1/3), where N is the number of smarticles, and the l/w above which entangled
clusters span piles of each size. A run is a pour, a rest, a shake and a rest.

A pile is spanned if one cluster joins floor and top, and one joins opposite sides of the wall. The height alone is not
enough: a pile of 100 thin smarticles is lower than a single smarticle is long.
"""

import math
from collections.abc import Mapping
from functools import partial

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from dem.errors import InputError
from dem.record.frames import FrameSequence
from dem.record.run import Run
from postprocess.measures.clusters import entanglement_clusters, spans_height, spans_width
from postprocess.measures.contacts import chain_of
from postprocess.measures.entanglement import entanglement
from postprocess.measures.packing import packing_of
from postprocess.measures.spread import escaped
from postprocess.statistics.points import ASPECT, SEED, format_with_error
from postprocess.statistics.seeds import slope_within
from postprocess.statistics.size_law import POWER, POWERS, Profile, SizeLaw, alike, profiles, size_law
from studies.framework.figures import Means, one_by_one
from studies.framework.findings import Effect, Finding, Outcome, Verdict, decide
from studies.framework.provenance import NOTHING
from studies.framework.runs import ASPECT_KEY, DEFINITION, Key, Row, declare, duration, last_columns
from studies.framework.study import Study

COUNT, RADIUS = "smarticles [-]", "container radius over w [-]"
BEFORE, AFTER = "before", "after"
STAGES = {BEFORE: "phi_0", AFTER: "phi_f"}  #: Symbol of φ of the pile at rest, by stage: before and after the shake

DEFINITIONS = (DEFINITION, "top-percentile", "voxel")
"""Definitions of φ: the paper's; one whose height does not depend on single smarticles; one of the pile's inside."""

MOVING = f"phi_f shaken {DEFINITION} [-]"
WINDOW = 1.0  #: Time at the end of the shake over which φ is averaged [s]: 30 periods

PHASES = ("deposit", "relax", "shake", "relax")
PAPER_ASPECT, PAPER_COUNT = 0.7, 270  #: l/w and number of smarticles of the paper's pile whose finite size is judged

LARGEST = 0.2  #: Greatest l/w of the runs that the percolation threshold is fitted to

AT_THRESHOLD = -0.155
"""Power of N with which the largest cluster's share of the pile falls at the percolation threshold in three dimensions.

It is β/(νd) with β = 0.41 and ν = 0.88: Stauffer & Aharony, Introduction to Percolation Theory (1994), table 2."""

_REJECTED = 0.05  # greatest p-value at which a law is rejected
_DISTINCT = (1 / 6, 2 / 3)  # half and twice the power 1/3; an interval within them supports this power


def phi(stage: str, definition: str = DEFINITION) -> str:
    """Return the name of the column of φ at a stage, a key of `STAGES`, by a definition of φ."""
    return f"{STAGES[stage]} {definition} [-]"


def crossings(stage: str) -> str:
    """Return the name of the column of ⟨N⟩ at a stage."""
    return f"crossings {stage} [-]"


def share(stage: str) -> str:
    """Return the name of the column: share of smarticles in the largest entangled cluster at a stage."""
    return f"largest cluster {stage} [-]"


def spans(stage: str, what: str = "pile") -> str:
    """Return the name of the column that is 1 if entangled clusters span a pile at a stage, else 0.

    `what` is spanned: "height" (floor to top), "width" (wall to wall) or "pile" (both).
    """
    return f"spans {what} {stage} [-]"


QUANTITIES = declare(
    {
        phi(stage, one): (f"φ_{end}" * (one == DEFINITION), "", f"φ {stage} the shake, at rest, by {one}")
        for stage, end in zip(STAGES, "0f", strict=True)
        for one in DEFINITIONS
    }
    | {MOVING: ("", "", f"φ over the last {WINDOW:g} s of the shake")}
    | {crossings(stage): (f"⟨N⟩ {stage}", "", f"⟨N⟩ {stage} the shake, at rest") for stage in STAGES}
    | {share(stage): (f"cluster {stage}", "", f"share of the largest entangled cluster {stage}") for stage in STAGES}
    | {spans(stage, "height"): ("", "", f"1 where a cluster joins floor and top {stage}") for stage in STAGES}
    | {spans(stage, "width"): ("", "", f"1 where a cluster joins wall and wall {stage}") for stage in STAGES}
    | {spans(stage): (f"spanned {stage}", "", f"1 where clusters span height and width {stage}") for stage in STAGES},
    axes={phi(stage): rf"$\phi_{end}$ {stage} the shake [-]" for stage, end in zip(STAGES, "0f", strict=True)}
    | {phi(stage, "voxel"): rf"$\phi$ of the inside {stage} [-]" for stage in STAGES}
    | {crossings(stage): rf"$\langle N\rangle$ {stage} the shake [-]" for stage in STAGES}
    | {share(stage): f"largest cluster {stage} [-]" for stage in STAGES}
    | {spans(stage): f"share of piles spanned {stage} [-]" for stage in STAGES},
)
SCALED = (
    *(phi(stage, one) for stage in STAGES for one in DEFINITIONS),
    MOVING,
    *(crossings(stage) for stage in STAGES),
)  #: Columns that the law q_∞ + a N^(-1/3) is fitted to

ASKED = {
    phi(BEFORE): ("φ_0", ".4f", "phi-0"),
    phi(AFTER): ("φ_f", ".4f", "phi-f"),
    phi(AFTER, "voxel"): ("φ_f by voxels of the inside", ".4f", "phi-f-inside"),
    crossings(BEFORE): ("⟨N⟩_0", ".3f", "crossings-0"),
    crossings(AFTER): ("⟨N⟩_f", ".3f", "crossings-f"),
}  #: Judged quantities by column: symbol, format, and name in the ids of findings


def measure(run: Run) -> Row:
    """Measure the pile at rest before and after the shake, and φ at its end; return the run's row."""
    types = tuple(phase.type for phase in run.phases)
    if types != PHASES:
        raise InputError(f"{run.path}: its phases are {', '.join(types)}, not {', '.join(PHASES)}; leave it out")
    frames = run.frames
    row: dict[str, object] = {
        ASPECT: round(run.manifest.aspect_ratio, 6),
        COUNT: run.manifest.count,
        SEED: run.manifest.seed,
        RADIUS: run.manifest.container_radius_m / run.manifest.middle_length_m,
        "fidelity": run.manifest.fidelity,
        "time shaken [s]": duration(run.phases[2]),
    }
    for stage, phase in zip(STAGES, (1, 3), strict=True):
        row |= _at_rest(run, frames, stage, phase)
    late = run.at_intervals(frames.in_phase(2)).after((run.phases[2].end_s or 0.0) - WINDOW - 1e-6)
    row[MOVING] = float(np.mean([packing_of(frame, run, definition=DEFINITION) for frame in late])) if late else np.nan
    return row | {
        "escaped at the end [-]": escaped(frames[-1], run),
        "frames averaged [-]": len(late),
        **last_columns(run),
    }


def _at_rest(run: Run, frames: FrameSequence, stage: str, phase: int) -> dict[str, object]:
    """Measure the last frame of a rest, the phase with the index `phase`; return cells of the run's row."""
    part = frames.in_phase(phase)
    if not part:
        raise InputError(f"{run.path}: no frame of phase {phase} (relax); run it again")
    frame = part[-1]
    vertices, chain = frame.vertices, chain_of(run)
    clusters = entanglement_clusters(vertices)
    height = spans_height(clusters, vertices, chain=chain, floor_z=frame.floor_z)
    width = spans_width(clusters, vertices, chain=chain, wall_radius=run.manifest.container_radius_m)
    return {
        **{phi(stage, one): packing_of(frame, run, definition=one) for one in DEFINITIONS},
        crossings(stage): entanglement(vertices).mean,
        share(stage): clusters.largest,
        spans(stage, "height"): float(height),
        spans(stage, "width"): float(width),
        spans(stage): float(height and width),
    }


def fitted(runs: pd.DataFrame, aspect: float, quantity: str) -> SizeLaw | None:
    """Fit the law q_∞ + a N^(-1/3) to a quantity at one l/w; None if there are fewer than two sizes."""
    part = runs[(runs[ASPECT] == aspect) & np.isfinite(runs[quantity])]
    if part[COUNT].nunique() < 2:
        return None
    return size_law(part[COUNT].to_numpy(dtype=np.float64), part[quantity].to_numpy(dtype=np.float64))


def laws(runs: pd.DataFrame) -> pd.DataFrame:
    """Tabulate the fits at every l/w and quantity: parameters of the law, p-value, and best power of N."""
    return pd.DataFrame(
        {
            ASPECT: aspect,
            "quantity": quantity,
            "sizes [-]": law.sizes,
            "runs [-]": law.runs,
            "bulk [-]": law.bulk,
            "bulk 95 % [-]": law.error(1, 0),
            "a [-]": law.slope,
            "a 95 % [-]": law.error(0, 1),
            "left over scatter [-]": law.excess,
            "p of the law [-]": law.p_value,
            **dict(zip(("power [-]", "power from [-]", "power to [-]"), law.powers, strict=True)),
            "scatter falls as N to the [-]": law.scatter.fall,
        }
        for aspect in sorted(runs[ASPECT].unique())
        for quantity in SCALED
        if (law := fitted(runs, aspect, quantity)) is not None
    )


def _column(stage: str, axis: str) -> str:
    """Return the column of the table of runs for an axis: "l/w", or "⟨N⟩" at a stage of the run."""
    return ASPECT if axis == "l/w" else crossings(stage)


def _profiles(runs: pd.DataFrame, stage: str, axis: str) -> dict[int, Profile]:
    """Fit the threshold in l/w or ⟨N⟩ (`axis`) above which piles are spanned, for each size of pile."""
    column = _column(stage, axis)
    part = runs[(runs[ASPECT] <= LARGEST) & np.isfinite(runs[column])]
    if part.empty:
        return {}
    x, spanned = (part[name].to_numpy(dtype=np.float64) for name in (column, spans(stage)))
    return profiles(x, spanned, part[COUNT].to_numpy(dtype=np.int64))


def thresholds(runs: pd.DataFrame) -> pd.DataFrame:
    """Tabulate the l/w and the ⟨N⟩ at which half of the piles are spanned.

    The table has one row per stage (`before` or `after` the shake), quantity (l/w or ⟨N⟩) and number of smarticles.
    """
    return pd.DataFrame(
        {
            "stage": stage,
            "against": axis,
            COUNT: size,
            "runs [-]": one.runs,
            "spanned [-]": one.having,
            "half of piles span at [-]": one.best,
            "from [-]": one.interval[0],
            "to [-]": one.interval[1],
            "width [-]": one.width,
        }
        for stage in STAGES
        for axis in ("l/w", "⟨N⟩")
        for size, one in _profiles(runs, stage, axis).items()
    )


def growth(runs: pd.DataFrame) -> pd.DataFrame:
    """Fit the largest cluster's share of the pile as a power of N: a row per stage and l/w."""
    rows = []
    for stage in STAGES:
        for aspect, part in runs.groupby(ASPECT):
            size, cluster = (np.log(part[name].to_numpy(dtype=np.float64)).tolist() for name in (COUNT, share(stage)))
            slope = slope_within(size, cluster, [0] * len(part))
            falls = Effect(label="", value=slope, sign=-1).verdict
            rows.append((stage, aspect, slope.count, slope.value, slope.half_width, str(falls)))
    powers = ["power of N [-]", "power of N 95 % [-]"]
    return pd.DataFrame(rows, columns=["stage", ASPECT, "runs [-]", *powers, "falls as piles grow"])


def _bias(runs: pd.DataFrame, quantity: str) -> Outcome:
    law, form = fitted(runs, PAPER_ASPECT, quantity), ASKED[quantity][1]
    if law is None:
        return Outcome(verdict=Verdict.NO_DATA)
    bias = law.bias(PAPER_COUNT)
    part, error = 100 * bias.value / law.bulk, 100 * bias.half_width / abs(law.bulk)
    text = (
        f"by {format_with_error(part, '+.1f', error)} % at 95 %: {law.at(PAPER_COUNT):{form}} of "
        f"{format_with_error(law.bulk, form, law.error(1, 0))}, {law.runs} runs of {law.sizes} sizes"
    )
    return Outcome(effects=[Effect(label="differs", value=bias, sign=-1, text=text)])


def _law(runs: pd.DataFrame, quantity: str) -> Outcome:
    law = fitted(runs, PAPER_ASPECT, quantity)
    if law is None or math.isnan(law.p_value):
        return Outcome(verdict=Verdict.NO_DATA)
    best, low, high = law.powers
    wrong = law.p_value < _REJECTED
    right = low >= _DISTINCT[0] and high <= _DISTINCT[1]
    note = f"it leaves {law.excess:.2g} times what scatter explains, p = {law.p_value:.2g}; power {best:.2f} "
    ends = "" if POWERS[0] < low and high < POWERS[-1] else ", the end of what is tried"
    return Outcome(note=f"{note}({low:.2f} to {high:.2f}{ends})", verdict=decide(right and not wrong, wrong))


def _spanned_at_any_size(runs: pd.DataFrame) -> Outcome:
    part = runs[runs[ASPECT] == PAPER_ASPECT]
    if part.empty:
        return Outcome(verdict=Verdict.NO_DATA)
    spanned = (part[[spans(stage) for stage in STAGES]] == 1).all(axis=1)
    shares = part.groupby(COUNT)[[share(stage) for stage in STAGES]].mean()
    listed = ", ".join(f"{size} {before:.3f} and {after:.3f}" for size, before, after in shares.itertuples())
    return Outcome(
        note=f"{spanned.sum()} of {len(part)} runs before and after; share of the largest one: {listed}",
        verdict=decide(spanned.all(), not spanned.all()),
    )


def _threshold_moves(runs: pd.DataFrame, table: pd.DataFrame, stage: str, axis: str) -> Outcome:
    rows = table[(table["stage"] == stage) & (table["against"] == axis)] if len(table) else table
    if rows.empty:
        return Outcome(verdict=Verdict.NO_DATA)
    chance = alike(_profiles(runs, stage, axis).values())
    seen = runs.loc[runs[ASPECT] <= LARGEST, _column(stage, axis)]
    cells = ", ".join(
        f"{row[COUNT]}: {row['half of piles span at [-]']:.3f} ({row['from [-]']:.3f} to {row['to [-]']:.3f})"
        for _, row in rows.iterrows()
    )
    likelihood = format_with_error(chance, ".2g")
    note = f"N = {cells}; all alike: p = {likelihood}; {axis} of {seen.min():.2g} to {seen.max():.2g}"
    return Outcome(note=note, verdict=decide(chance < _REJECTED))


def _cluster_falls(table: pd.DataFrame, stage: str) -> Outcome:
    rows = table[(table["stage"] == stage) & table["power of N [-]"].notna()] if len(table) else table
    if rows.empty:
        return Outcome(verdict=Verdict.NO_DATA)
    listed = ", ".join(
        f"{row[ASPECT]:g}: {format_with_error(row['power of N [-]'], '+.2f', row['power of N 95 % [-]'])}"
        for _, row in rows.iterrows()
    )
    verdicts = rows["falls as piles grow"]
    surely = ", ".join(f"{ratio:g}" for ratio in rows.loc[verdicts == "found", ASPECT])
    return Outcome(
        note=f"share as N to the power, at l/w = {listed}; surely falling at {surely or 'none'}; percolation in three "
        f"dimensions has {AT_THRESHOLD:g} at its threshold",
        verdict=decide(bool(surely), (verdicts == "not found").all()),
    )


FINDINGS = (
    *(
        Finding(
            id=f"{name}-below-bulk",
            says=f"(ours) {symbol} of {PAPER_COUNT} smarticles of l/w = {PAPER_ASPECT:g} is below that of a pile "
            "without end of the same shape",
            found_if="a N^(-1/3) < 0, by the fit to all sizes",
            outcome=partial(_bias, quantity=quantity),
        )
        for quantity, (symbol, _, name) in ASKED.items()
    ),
    *(
        Finding(
            id=f"{name}-surface-over-volume",
            says=f"(ours) {symbol} comes to that of a pile without end as N^(-1/3), surface over volume",
            found_if="p > 0.05, and the power of N is within 1/6 and 2/3 at 95 %",
            outcome=partial(_law, quantity=quantity),
        )
        for quantity, (symbol, _, name) in ASKED.items()
    ),
    Finding(
        id="spanned-at-any-size",
        says=f"(ours) entangled clusters reach through all piles of l/w = {PAPER_ASPECT:g}, whatever their size",
        found_if="all runs are spanned, before and after the shake",
        outcome=_spanned_at_any_size,
    ),
    *(
        Finding(
            id=f"threshold-moves-{name}-{stage}",
            says=f"(ours) the {axis} at which clusters span half of the piles {stage} the shake goes with their size",
            found_if="one place for all sizes is rejected, p < 0.05",
            outcome=partial(_threshold_moves, stage=stage, axis=axis),
            tables=["runs", "thresholds"],
        )
        for axis, name in (("l/w", "aspect"), ("⟨N⟩", "crossings"))
        for stage in STAGES
    ),
    *(
        Finding(
            id=f"cluster-falls-{stage}",
            says=f"(ours) at some l/w the largest entangled cluster is ever less of larger piles {stage} the shake",
            found_if="power of N < 0 at 95 % at one l/w",
            outcome=partial(_cluster_falls, stage=stage),
            tables=["growth"],
        )
        for stage in STAGES
    ),
)


def _law_curves(
    tables: Mapping[str, pd.DataFrame], rows: pd.DataFrame, column: str, places: NDArray[np.float64]
) -> dict[str, tuple[ArrayLike, ArrayLike]]:
    """Compute the law q_∞ + a N^(-1/3) of a quantity, fitted at one l/w, as a curve of a figure.

    Places are values of N^(-1/3) (n,). Returns values (n,) and 95 % half-widths (n,) by the label of the curve; empty
    if there are too few sizes to fit.
    """
    law = fitted(tables["runs"], float(rows[ASPECT].iloc[0]), column)
    if law is None:
        return {}
    half_widths = [law.error(1, float(place)) for place in places]
    return {r"fit of $q_\infty + a N^{-1/3}$": (law.bulk + law.slope * places, half_widths)}


_SCALING = [column(stage) for column in (phi, partial(phi, definition="voxel"), crossings) for stage in STAGES]
FIGURES = (
    Means(
        name="scaling",
        quantities=[QUANTITIES[name] for name in _SCALING],
        x=COUNT,
        transform=lambda count: count**-POWER,
        x_label=r"$N^{-1/3}$ [-]",
        rows=lambda points: points[points[ASPECT] == PAPER_ASPECT],
        split=one_by_one(ASPECT, "l/w = {:g}".format),
        marks=[PAPER_COUNT**-POWER],
        fit=_law_curves,
        notes=[
            f"Bands: 95 % of the fit; 0: a pile of infinite size; broken line: the paper's {PAPER_COUNT} smarticles."
        ],
    ),
    Means(
        name="percolation",
        quantities=[QUANTITIES[name(stage)] for name in (spans, share) for stage in STAGES],
        x=ASPECT,
        x_label=r"$l/w$ [-]",
        rows=lambda points: points[points[ASPECT] <= LARGEST],
        split=one_by_one(COUNT, "N = {:g}".format),
        notes=["Spanned: entangled clusters join floor and top, and wall and wall."],
    ),
)

STUDY = Study(
    name="finite-size",
    title="Finite size: 100 to 10 000 smarticles",
    measure=measure,
    keys=(ASPECT_KEY, Key(column=COUNT, label="N", form="g"), Key(column=RADIUS, label="radius / w", form=".2f")),
    quantities=tuple(QUANTITIES.values()),
    findings=FINDINGS,
    figures=FIGURES,
    extra=lambda runs: {"laws": laws(runs), "thresholds": thresholds(runs), "growth": growth(runs)},
    order=(ASPECT, COUNT, SEED),
    same_count=(ASPECT, COUNT),
    constant={RADIUS: (ASPECT, COUNT)},
    from_tables=True,
    remarks=(
        f"φ by {DEFINITION} unless said otherwise; all measures of the last frame of a rest. Clusters: smarticles of "
        "which one passes through the other's plane. Radius 2 w at "
        f"{PAPER_COUNT} smarticles of l/w {PAPER_ASPECT:g}, as the cube root of N.",
        "Laws q_∞ + a N^(-1/3): least squares, weights by a scatter that is a power of N, fitted within sizes; where "
        "the law leaves more than scatter, errors are larger by the square root of the ratio.",
        "Thresholds: logistic function of its own width at each size, profile likelihood, 95 %; one for all sizes "
        "against one for each by the ratio of likelihoods, rejected below p = 0.05.",
    ),
    reference=NOTHING,
    pictured={"l_over_w": 0.7, "count": 1000},
)
