"""Finite size: packing, entanglement and its percolation in piles of one shape and 100 to 10 000 smarticles.

φ and ⟨N⟩ against N^(-1/3), and at which l/w entangled clusters begin to reach through piles of each size. A run is a
pour, a rest, a shake and a rest.

A pile of 100 thin smarticles is lower than one of them is long, so that one that stands up spans its height alone. A
pile counts as spanned where a cluster joins floor and top, and one wall and wall.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from dem.errors import InputError
from dem.record.frames import FrameSequence
from dem.record.run import Run
from postprocess.measures.clusters import entanglement_clusters, spans_height, spans_width
from postprocess.measures.entanglement import entanglement
from postprocess.measures.packing import packing_of
from postprocess.measures.spread import escaped
from postprocess.report import figures as style
from postprocess.statistics.findings import judge, negative
from postprocess.statistics.points import ASPECT, SEED, told_number
from postprocess.statistics.seeds import slope_within
from postprocess.statistics.size_law import POWER, POWERS, Profile, SizeLaw, alike, profiles, size_law
from studies.framework.figures import Analysis, Drawing, one_by_one
from studies.framework.findings import Effect, Finding, Outcome, Verdict
from studies.framework.plots import CROSSINGS_LABEL, draw_means, finished, marker
from studies.framework.provenance import NOTHING
from studies.framework.quantities import Key, Quantity
from studies.framework.runs import DEFINITION, Row, duration
from studies.framework.study import Study

COUNT, RADIUS = "smarticles [-]", "container radius over w [-]"
BEFORE, AFTER = "before", "after"
STAGES = {BEFORE: "phi_0", AFTER: "phi_f"}
"""When a pile is at rest, before and after the shake, and what its φ is called."""

DEFINITIONS = (DEFINITION, "top-percentile", "voxel")
"""Of φ: the paper's, one whose height no single smarticle decides, and one that leaves walls and top out."""

MOVING = f"phi_f shaken {DEFINITION} [-]"
WINDOW = 1.0
"""Over how long φ is averaged at the end of the shake [s]: 30 periods."""

PHASES = ("deposit", "relax", "shake", "relax")
PAPER_ASPECT, PAPER_COUNT = 0.7, 270
"""The paper's pile that is asked about: its l/w, and its number of smarticles there."""

LARGEST = 0.2
"""l/w up to which piles are taken as near the threshold."""

AT_THRESHOLD = -0.155
"""Power of N with which the largest cluster's share falls just at the threshold of percolation in three dimensions,
β/(νd) with β = 0.41 and ν = 0.88: Stauffer & Aharony, Introduction to Percolation Theory (1994), table 2."""

_REFUSED = 0.05
_TOLD_APART = (1 / 6, 2 / 3)  # within half of 1/3 and twice it the law is told from others


def phi(stage: str, definition: str = DEFINITION) -> str:
    """Column of φ of a pile at rest."""
    return f"{STAGES[stage]} {definition} [-]"


def crossings(stage: str) -> str:
    """Column of ⟨N⟩."""
    return f"crossings {stage} [-]"


def share(stage: str) -> str:
    """Column of the share of the smarticles in the largest entangled cluster."""
    return f"largest cluster {stage} [-]"


def spans(stage: str, what: str = "pile") -> str:
    """Column of whether a cluster spans the height, the width or, both of them, the pile."""
    return f"spans {what} {stage} [-]"


def _quantities() -> dict[str, tuple[str, str]]:
    """Meaning and label of every column that is averaged; labels are those of the short table."""
    rows: dict[str, tuple[str, str]] = {}
    for stage, end in zip(STAGES, "0f", strict=True):
        for one in DEFINITIONS:
            rows[phi(stage, one)] = (f"φ {stage} the shake, at rest, by {one}", f"φ_{end}" * (one == DEFINITION))
    rows[MOVING] = (f"φ over the last {WINDOW:g} s of the shake", "")
    rows |= {crossings(stage): (f"⟨N⟩ {stage} the shake, at rest", f"⟨N⟩ {stage}") for stage in STAGES}
    rows |= {share(stage): (f"share of the largest entangled cluster {stage}", f"cluster {stage}") for stage in STAGES}
    rows |= {spans(stage, "height"): (f"1 where a cluster joins floor and top {stage}", "") for stage in STAGES}
    rows |= {spans(stage, "width"): (f"1 where one joins wall and wall {stage}", "") for stage in STAGES}
    return rows | {spans(stage): (f"1 where both is so {stage}", f"spanned {stage}") for stage in STAGES}


QUANTITIES = tuple(
    Quantity(column=column, meaning=meaning, label=label) for column, (meaning, label) in _quantities().items()
)
SCALED = (
    *(phi(stage, one) for stage in STAGES for one in DEFINITIONS),
    MOVING,
    *(crossings(stage) for stage in STAGES),
)
"""Quantities that the law is fitted to."""

ASKED = {
    phi(BEFORE): ("φ_0", ".4f", "phi-0"),
    phi(AFTER): ("φ_f", ".4f", "phi-f"),
    phi(AFTER, "voxel"): ("φ_f by voxels of the inside", ".4f", "phi-f-inside"),
    crossings(BEFORE): ("⟨N⟩_0", ".3f", "crossings-0"),
    crossings(AFTER): ("⟨N⟩_f", ".3f", "crossings-f"),
}
"""Quantities that are asked about: what they are called, how they are shown, and in ids."""


def measure(run: Run) -> Row:
    """Measure the pile at rest before and after the shake."""
    types = tuple(phase.type for phase in run.phases)
    if types != PHASES:
        msg = f"{run.path}: its phases are {', '.join(types)}, not {', '.join(PHASES)}"
        raise InputError(msg)
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
    late = frames.in_phase(2).after((run.phases[2].end_s or 0.0) - WINDOW - 1e-6)
    row[MOVING] = float(np.mean([packing_of(frame, run, definition=DEFINITION) for frame in late])) if late else np.nan
    return row | {
        "escaped at the end [-]": escaped(frames[-1], run),
        "frames averaged [-]": len(late),
        "scene_sha256": run.manifest.scene_sha256,
        "run": run.path.name,
    }


def _at_rest(run: Run, frames: FrameSequence, stage: str, phase: int) -> dict[str, object]:
    """Measure the last frame of a rest."""
    part = frames.in_phase(phase)
    if not part:
        msg = f"{run.path}: no frame of phase {phase} (relax); run it again"
        raise InputError(msg)
    frame = part[-1]
    vertices, diameter = frame.vertices, run.manifest.sphere_diameter_m
    clusters = entanglement_clusters(vertices)
    height = spans_height(clusters, vertices, diameter=diameter, floor_z=frame.floor_z)
    width = spans_width(clusters, vertices, diameter=diameter, wall_radius=run.manifest.container_radius_m)
    return {
        **{phi(stage, one): packing_of(frame, run, definition=one) for one in DEFINITIONS},
        crossings(stage): entanglement(vertices).mean,
        share(stage): clusters.largest,
        spans(stage, "height"): float(height),
        spans(stage, "width"): float(width),
        spans(stage): float(height and width),
    }


def fitted(runs: pd.DataFrame, aspect: float, quantity: str) -> SizeLaw | None:
    """Fit the law of one quantity at one l/w; nothing below two sizes."""
    part = runs[(runs[ASPECT] == aspect) & np.isfinite(runs[quantity])]
    if part[COUNT].nunique() < 2:
        return None
    return size_law(part[COUNT].to_numpy(dtype=np.float64), part[quantity].to_numpy(dtype=np.float64))


def laws(runs: pd.DataFrame) -> pd.DataFrame:
    """Fit the law of every quantity at every l/w, whether it holds, and which power does."""
    rows = []
    for aspect in sorted(runs[ASPECT].unique()):
        for quantity in SCALED:
            law = fitted(runs, aspect, quantity)
            if law is None:
                continue
            rows.append(
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
                    "p of the law [-]": law.refused,
                    **dict(zip(("power [-]", "power from [-]", "power to [-]"), law.powers, strict=True)),
                    "scatter falls as N to the [-]": law.scatter.fall,
                }
            )
    return pd.DataFrame(rows)


def _axes(stage: str) -> Mapping[str, str]:
    """What spanning is set against: names and columns."""
    return {"l/w": ASPECT, "⟨N⟩": crossings(stage)}


def _profiles(runs: pd.DataFrame, stage: str, axis: str) -> dict[int, Profile]:
    """Where piles near the threshold begin to be spanned, by size."""
    column = _axes(stage)[axis]
    part = runs[(runs[ASPECT] <= LARGEST) & np.isfinite(runs[column])]
    if part.empty:
        return {}
    x, spanned = (part[name].to_numpy(dtype=np.float64) for name in (column, spans(stage)))
    return profiles(x, spanned, part[COUNT].to_numpy(dtype=np.int64))


def thresholds(runs: pd.DataFrame) -> pd.DataFrame:
    """Fit where half of the piles are spanned, by stage, axis and size."""
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
        for axis in _axes(stage)
        for size, one in _profiles(runs, stage, axis).items()
    )


def growth(runs: pd.DataFrame) -> pd.DataFrame:
    """Fit the power of N with which the largest cluster's share goes, by stage and l/w."""
    rows = []
    for stage in STAGES:
        for aspect, part in runs.groupby(ASPECT):
            size, cluster = (np.log(part[name].to_numpy(dtype=np.float64)).tolist() for name in (COUNT, share(stage)))
            slope = slope_within(size, cluster, [0] * len(part))
            rows.append(
                {
                    "stage": stage,
                    ASPECT: aspect,
                    "runs [-]": slope.count,
                    "power of N [-]": slope.value,
                    "power of N 95 % [-]": slope.half_width,
                    "falls as piles grow": str(judge(negative(slope))),
                }
            )
    return pd.DataFrame(rows)


def _bias(runs: pd.DataFrame, quantity: str) -> Outcome:
    law, form = fitted(runs, PAPER_ASPECT, quantity), ASKED[quantity][1]
    if law is None:
        return Outcome(verdict=Verdict.NO_DATA)
    bias = law.bias(PAPER_COUNT)
    part, error = 100 * bias.value / law.bulk, 100 * bias.half_width / abs(law.bulk)
    text = (
        f"by {told_number(part, '+.1f', error)} % at 95 %: {law.at(PAPER_COUNT):{form}} of "
        f"{told_number(law.bulk, form, law.error(1, 0))}, {law.runs} runs of {law.sizes} sizes"
    )
    return Outcome(effects=[Effect(label="differs", value=bias, sign=-1, text=text)])


def _law(runs: pd.DataFrame, quantity: str) -> Outcome:
    law = fitted(runs, PAPER_ASPECT, quantity)
    if law is None or math.isnan(law.refused):
        return Outcome(verdict=Verdict.NO_DATA)
    best, low, high = law.powers
    verdict = Verdict.NOT_RESOLVED
    if law.refused < _REFUSED:
        verdict = Verdict.NOT_FOUND
    elif low >= _TOLD_APART[0] and high <= _TOLD_APART[1]:
        verdict = Verdict.FOUND
    note = f"it leaves {law.excess:.2g} times what scatter explains, p = {law.refused:.2g}; power {best:.2f} "
    ends = "" if POWERS[0] < low and high < POWERS[-1] else ", the end of what is tried"
    return Outcome(note=f"{note}({low:.2f} to {high:.2f}{ends})", verdict=verdict)


def _whole(runs: pd.DataFrame) -> Outcome:
    part = runs[runs[ASPECT] == PAPER_ASPECT]
    if part.empty:
        return Outcome(verdict=Verdict.NO_DATA)
    spanned = (part[[spans(stage) for stage in STAGES]] == 1).all(axis=1)
    shares = part.groupby(COUNT)[[share(stage) for stage in STAGES]].mean()
    listed = ", ".join(f"{size} {before:.3f} and {after:.3f}" for size, before, after in shares.itertuples())
    return Outcome(
        note=f"{spanned.sum()} of {len(part)} runs before and after; share of the largest one: {listed}",
        verdict=Verdict.FOUND if spanned.all() else Verdict.NOT_FOUND,
    )


def _shift(runs: pd.DataFrame, table: pd.DataFrame, stage: str, axis: str) -> Outcome:
    rows = table[(table["stage"] == stage) & (table["against"] == axis)] if len(table) else table
    if rows.empty:
        return Outcome(verdict=Verdict.NO_DATA)
    chance = alike(_profiles(runs, stage, axis).values())
    seen = runs.loc[runs[ASPECT] <= LARGEST, _axes(stage)[axis]]
    cells = []
    for _, row in rows.iterrows():
        low, place, high = row[["from [-]", "half of piles span at [-]", "to [-]"]]
        ends = [f"{end:.3f}" if math.isfinite(end) else "open" for end in (low, high)]
        known = f"{place:.3f} ({ends[0]} to {ends[1]})"
        cell = f"{row['spanned [-]']} of {row['runs [-]']} spanned" if math.isnan(place) else known
        cells.append(f"{row[COUNT]}: {cell}")
    return Outcome(
        note=f"N = {'; '.join(cells)}; all alike: p = {told_number(chance, '.2g')}; {axis} of {seen.min():.2g} to "
        f"{seen.max():.2g}",
        verdict=Verdict.FOUND if chance < _REFUSED else Verdict.NOT_RESOLVED,
    )


def _falls(table: pd.DataFrame, stage: str) -> Outcome:
    rows = table[(table["stage"] == stage) & table["power of N [-]"].notna()] if len(table) else table
    if rows.empty:
        return Outcome(verdict=Verdict.NO_DATA)
    listed = ", ".join(
        f"{row[ASPECT]:g}: {told_number(row['power of N [-]'], '+.2f', row['power of N 95 % [-]'])}"
        for _, row in rows.iterrows()
    )
    verdicts = rows["falls as piles grow"]
    verdict = Verdict.NOT_RESOLVED
    if (verdicts == "found").any():
        verdict = Verdict.FOUND
    elif (verdicts == "not found").all():
        verdict = Verdict.NOT_FOUND
    surely = ", ".join(f"{ratio:g}" for ratio in rows.loc[verdicts == "found", ASPECT])
    return Outcome(
        note=f"share as N to the power, at l/w = {listed}; surely falling at {surely or 'none'}; percolation in three "
        f"dimensions has {AT_THRESHOLD:g} at its threshold",
        verdict=verdict,
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
        outcome=_whole,
    ),
    *(
        Finding(
            id=f"threshold-moves-{name}-{stage}",
            says=f"(ours) the {axis} at which clusters span half of the piles {stage} the shake goes with their size",
            found_if="one place for all sizes is refused, p < 0.05",
            outcome=partial(_shift, stage=stage, axis=axis),
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
            outcome=partial(_falls, stage=stage),
            tables=["growth"],
        )
        for stage in STAGES
    ),
)

_NAMES = {BEFORE: "poured", AFTER: "shaken"}


def _draw_scaling(path: Path, analysis: Analysis) -> list[Path]:
    """Draw φ by the paper's definition, φ of the inside, and ⟨N⟩ at the paper's l/w, with the law fitted to each."""
    here = analysis.points[analysis.points[ASPECT] == PAPER_ASPECT]
    if here.empty:
        return []
    figure = style.blank_figure(2 * style.COLUMN_WIDTH, 2.7)
    panels = figure.subplots(1, 3)
    labels = (r"packing fraction $\phi$ [-]", r"$\phi$ of the inside, by voxels [-]", CROSSINGS_LABEL)
    columns: list[Callable[[str], str]] = [phi, partial(phi, definition="voxel"), crossings]
    for axes, label, column in zip(panels, labels, columns, strict=True):
        for stage, shape, colour in ((BEFORE, "o", style.BLUE), (AFTER, "s", style.ORANGE)):
            law = fitted(analysis.runs, PAPER_ASPECT, column(stage))
            _draw_law(axes, here, column(stage), law, look=marker(shape, colour, colour), label=_NAMES[stage])
        axes.axvline(PAPER_COUNT**-POWER, color=style.GREY, linewidth=0.6, linestyle=":")
        axes.set_xlim(left=0)
        axes.set_xlabel(r"$N^{-1/3}$ [-]")
        axes.set_ylabel(label)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    told = (
        f"l/w = {PAPER_ASPECT:g}; lines: fits of q_∞ + a N^(-1/3), bands: 95 % of them; 0 is a pile without end; "
        f"dotted: the paper's {PAPER_COUNT} smarticles."
    )
    return finished(figure, path, [told], analysis.footer, pooled=True)


def _draw_law(axes: Any, here: pd.DataFrame, column: str, law: SizeLaw | None, **shown: Any) -> None:
    """Draw means over seeds of one quantity at every size, and the law."""
    shown["look"] |= {"linestyle": "none"}
    places = here[COUNT].to_numpy(dtype=np.float64) ** -POWER
    if law is None:
        draw_means(axes, places, here[column], None, **shown)
        return
    errors = [law.scatter.error(count, number) for count, number in here[[COUNT, "seeds [-]"]].to_numpy().tolist()]
    draw_means(axes, places, here[column], errors, **shown)
    along = np.linspace(0, places.max() * 1.05, 60)
    line, band = law.bulk + law.slope * along, np.array([law.error(1, float(one)) for one in along])
    axes.plot(along, line, color=shown["look"]["color"], linewidth=0.9)
    if np.isfinite(band).all():
        axes.fill_between(along, line - band, line + band, color=shown["look"]["color"], alpha=0.15, linewidth=0)


def _draw_percolation(path: Path, analysis: Analysis) -> list[Path]:
    """Draw the share of spanned piles against l/w, and of smarticles in the largest cluster against ⟨N⟩."""
    points, runs = (table[table[ASPECT] <= LARGEST] for table in (analysis.points, analysis.runs))
    if points.empty:
        return []
    figure = style.blank_figure(2 * style.COLUMN_WIDTH, 4.6)
    grid = figure.subplots(2, len(STAGES), sharex="row", sharey="row", squeeze=False)
    split = one_by_one(COUNT, lambda count: f"N = {count}")
    for (upper, lower), stage in zip(grid.T, STAGES, strict=True):
        for series in split(points):
            draw_means(
                upper, series.rows[ASPECT], series.rows[spans(stage)], None, look=series.look, label=series.label
            )
        for series in split(runs):
            look = {name: series.look[name] for name in ("marker", "color")}
            lower.plot(series.rows[crossings(stage)], series.rows[share(stage)], ls="none", markersize=3, **look)
        upper.set_title(_NAMES[stage], fontsize=8)
        upper.set_xlabel(r"$l/w$ [-]")
        lower.set_xlabel(CROSSINGS_LABEL)
    grid[0][0].set_ylabel("share of the piles that are spanned [-]")
    grid[1][0].set_ylabel("share of the largest cluster [-]")
    figure.legend(*grid[0][0].get_legend_handles_labels(), loc="outside upper center", ncols=5)
    told = "Spanned: entangled clusters join floor and top, and wall and wall. Above: shares of seeds; below: each run."
    return finished(figure, path, [told], analysis.footer)


STUDY = Study(
    name="finite-size",
    title="Finite size: 100 to 10 000 smarticles",
    measure=measure,
    keys=(
        Key(column=ASPECT, label="l/w", form="g"),
        Key(column=COUNT, label="N", form="g"),
        Key(column=RADIUS, label="radius / w", form=".2f"),
    ),
    quantities=QUANTITIES,
    findings=FINDINGS,
    figures=(Drawing(name="scaling", of=_draw_scaling), Drawing(name="percolation", of=_draw_percolation)),
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
        "against one for each by the ratio of likelihoods, refused below p = 0.05.",
    ),
    reference=NOTHING,
    pictured={"l_over_w": 0.7, "count": 1000},
)
