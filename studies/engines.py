"""Equal seeds on links and YADE: differences against margins that were chosen before the runs.

Both engines pour equal seeds from equal poses. The engines are equivalent in a quantity if the 95 % confidence interval
of the relative difference lies within the margin, different if it lies outside, and not resolved otherwise: that a
difference is not significant does not prove equality. (Two one-sided tests at 5 % would take the 90 % interval, which
is less strict.) The second part refines YADE's chains of spheres to pitches of 1.3, 1.0, 0.5 and 0.25; smooth links are
their limit.
"""

import math
from functools import partial
from typing import NamedTuple

import pandas as pd

from dem.errors import InputError
from dem.record.run import Run
from postprocess.measures import strain
from postprocess.measures.collapse import REMAINING, collapse_of, column_history, vibration
from postprocess.measures.pull import PULL, peak, read_pull, weight_of_one
from postprocess.statistics.points import SEED, mean_columns
from postprocess.statistics.seeds import difference, mean_over_seeds
from studies.framework.figures import Means, Rows, one_by_one
from studies.framework.findings import Finding, Outcome, Verdict, within
from studies.framework.procedures import (
    CROSSINGS,
    ENERGY,
    EXTERNAL,
    HEIGHT,
    INTERNAL,
    PHI,
    PHI_ACTIVE,
    SHAPE,
    STATIC,
    procedure_row,
)
from studies.framework.provenance import Reference
from studies.framework.runs import ENGINE, Key, Quantity, Row, declare, last_columns, run_columns
from studies.framework.study import Study

CASE, VARIANT, PITCH = "case", "variant", "pitch [-]"
LINKS, YADE = "links", "yade"
HOOK, COLLAPSE, CHAIN = "hook", "collapse", "chain"
ACTIVE = (EXTERNAL, SHAPE, INTERNAL)

PHI_0, CROSSINGS_0 = f"{STATIC} {PHI}", f"{STATIC} {CROSSINGS}"
PEAK, TAU, FORCE = "peak force over n W_s [-]", "tau [s]", "peak force [N]"
QUANTITIES = declare(
    {
        PHI_0: ("φ_0", "", "packing fraction at rest after the pour"),
        CROSSINGS_0: ("⟨N⟩_0", "", "⟨N⟩ at rest after the pour"),
        PHI_ACTIVE: ("φ_f", "", "packing fraction at the end of the activity, in motion"),
        PHI: ("", "", "packing fraction at rest after the activity"),
        CROSSINGS: ("⟨N⟩", "", "⟨N⟩ at rest after the activity"),
        HEIGHT: ("h/h0", "", "height of the centre of mass after the activity, over that before"),
        ENERGY: ("", "", "work of the motors, or of the shaken container, on the smarticles"),
        PEAK: ("hook", "", "largest force that raises the hook, over the weight of all"),
        TAU: ("τ [s]", "", "time in which a free column on a shaking floor collapses; empty where it stood"),
        FORCE: ("chain [N]", "", "largest force of the string that pulls the chain"),
    }
)  #: Measured quantities; quantities that a case does not have are NaN


class Compared(NamedTuple):
    """A quantity in which the engines are compared."""

    label: str  #: Name in tables and texts
    #: Cases whose runs have the quantity; several cases that start with one pile give one sample, their mean
    cases: tuple[str, ...]
    column: str  #: Column in the table of runs
    margin: float  #: Accepted difference [% of YADE's mean], chosen before the first run
    why: str  #: Reason for this margin


_PHI_WHY = "half of the 10 % within which the study gravish calls φ near Gravish's"
_CROSSINGS_WHY = "⟨N⟩ of procedures differ by tens of per cent; it is a count of few"
_ENERGY_WHY = "the paper compares energies by factors, and the account closes within 1 %"
_PEAK_WHY = "a largest value, which scatters by a third between seeds; the paper's procedures differ by factors"
_TAU_WHY = "τ = exp(Δ/Γ)/f: at Γ = 2.5, 30 % of τ are 0.66 of Δ, 5 % of Gravish's 15"

COMPARED: tuple[Compared, ...] = (
    Compared("φ_0", ACTIVE, PHI_0, 5.0, _PHI_WHY),
    Compared("⟨N⟩ as poured", ACTIVE, CROSSINGS_0, 10.0, _CROSSINGS_WHY),
    *(
        Compared(f"{label}, {case}", (case,), column, margin, why)
        for case in ACTIVE
        for label, column, margin, why in (
            ("φ_f in motion", PHI_ACTIVE, 5.0, _PHI_WHY),
            ("φ_f at rest", PHI, 5.0, _PHI_WHY),
            ("⟨N⟩", CROSSINGS, 10.0, _CROSSINGS_WHY),
            ("h/h0", HEIGHT, 5.0, "as for φ, which goes as 1/h"),
            ("energy", ENERGY, 10.0, _ENERGY_WHY),
        )
    ),
    Compared("hook force", (HOOK,), PEAK, 20.0, _PEAK_WHY),
    Compared("collapse time", (COLLAPSE,), TAU, 30.0, _TAU_WHY),
    Compared("chain force", (CHAIN,), FORCE, 10.0, "the servos of a chain differ from each other by 10 %"),
)  #: Compared quantities in the order of tables and figures

REFINED = tuple(
    one
    for one in COMPARED
    if one.cases == ACTIVE or (one.cases == (EXTERNAL,) and one.column in (PHI_ACTIVE, PHI, CROSSINGS))
)  #: Quantities that are compared at every pitch of YADE's chains

_WORDS = {Verdict.FOUND: "equivalent", Verdict.NOT_FOUND: "different"}


def measure(run: Run) -> Row:
    """Measure a run of a case, such as `hook` or `shape-change`, and return its row.

    The name of the scene is CASE/VARIANT. Quantities that belong to other cases are NaN.
    """
    case, slash, variant = run.manifest.name.partition("/")
    if not slash or case not in (*ACTIVE, HOOK, COLLAPSE, CHAIN):
        msg = f"{run.path}: the scene's name is {run.manifest.name!r}, not CASE/VARIANT; give runs of the study engines"
        raise InputError(msg)
    return {
        CASE: case,
        VARIANT: variant,
        ENGINE: run.manifest.engine,
        **run_columns(run),
        **dict.fromkeys(QUANTITIES, math.nan),
        **_measured(run, case),
        "processor time [s]": sum(phase.cpu_s or math.nan for phase in run.phases),
        "simulated [s]": run.status.time_s,
        **last_columns(run),
    }


def _measured(run: Run, case: str) -> dict[str, float]:
    if case == CHAIN:
        return {FORCE: strain.measured(strain.read_strain_test(run))[strain.PEAK]}
    if case == COLLAPSE:
        shaken = vibration(run)
        return {TAU: collapse_of(column_history(run, REMAINING, shaken), REMAINING, shaken).time}
    if case == HOOK:
        pulled = run.phases[-1]
        if pulled.type != PULL:
            raise InputError(f"{run.path}: ends with {pulled.type}, not {PULL}; give runs of the study engines")
        force = peak(read_pull(run, run.series, pulled.index)).force
        return {PEAK: force / run.manifest.count / weight_of_one(run)}
    row = procedure_row(run)
    return {name: float(str(row[name])) for name in (PHI_0, CROSSINGS_0, PHI_ACTIVE, PHI, CROSSINGS, HEIGHT, ENERGY)}


def by_seed(runs: pd.DataFrame, one: Compared, variant: str) -> pd.Series:
    """Return the values of a quantity in a variant by seed, each a mean over the cases of the quantity.

    Seeds without a value are left out. The cases are listed in `one`; those that start with one pile count as one
    value.
    """
    chosen = runs[(runs[VARIANT] == variant) & runs[CASE].isin(one.cases)]
    means: pd.Series = chosen.groupby(SEED)[one.column].mean().dropna()
    return means


def equivalence(runs: pd.DataFrame) -> pd.DataFrame:
    """Compare the engines, paired by seed: a row for each quantity that one or both have measured."""
    rows = []
    for one in COMPARED:
        links, yade = (by_seed(runs, one, variant) for variant in (LINKS, YADE))
        if links.empty and yade.empty:
            continue
        seeds = links.index.intersection(yade.index)
        links, yade = links[seeds], yade[seeds]
        effect = mean_over_seeds((links - yade).to_numpy())
        base = float(yade.mean()) if len(seeds) else math.nan
        scale = 100 / abs(base) if base else math.nan
        apart = difference(mean_over_seeds(links.to_numpy()), mean_over_seeds(yade.to_numpy()))
        verdict = within(scale * effect.value, scale * effect.half_width, one.margin)
        rows.append(
            {
                "quantity": one.label,
                "pairs [-]": len(seeds),
                "links": float(links.mean()) if len(seeds) else math.nan,
                "yade": base,
                "difference [%]": scale * effect.value,
                "difference 95 % [%]": scale * effect.half_width,
                "difference 95 % unpaired [%]": scale * apart.half_width,
                "margin [%]": one.margin,
                "verdict": _WORDS.get(verdict, str(verdict)),
                "why this margin": one.why,
            }
        )
    return pd.DataFrame(rows)


def pitch_of(variant: str) -> float:
    """Return the pitch of YADE's chains in a variant: distance of spheres over their diameter [-].

    It is 0 for links, the limit of fine chains, 1 for `yade`, and NaN for other variants that do not name a pitch.
    """
    if variant in (LINKS, YADE):
        return 0.0 if variant == LINKS else 1.0
    return float(variant.removeprefix("pitch-")) if variant.startswith("pitch-") else math.nan


def refinement(runs: pd.DataFrame) -> pd.DataFrame:
    """Compare the shaken piles on YADE, at each pitch of its spheres, with those on links.

    The table has a row per quantity and variant. Differences are paired by seed; links is listed with the pitch 0. Only
    shaken piles were run at every pitch.
    """
    shaken = runs[runs[CASE] == EXTERNAL]
    rows: list[dict[str, object]] = []
    for one in REFINED:
        limit = by_seed(shaken, one, LINKS)
        scale = 100 / abs(float(limit.mean())) if len(limit) and limit.mean() else math.nan
        for variant in sorted(set(shaken[VARIANT]), key=pitch_of):
            values = by_seed(shaken, one, str(variant))
            effect = mean_over_seeds([] if variant == LINKS else (values - limit).dropna().tolist())
            row = {"quantity": one.label, VARIANT: variant, PITCH: pitch_of(str(variant)), "seeds [-]": len(values)}
            row |= mean_columns("mean [-]", mean_over_seeds(values.to_numpy()))
            rows.append(
                row | {"less links [%]": scale * effect.value, "less links 95 % [%]": scale * effect.half_width}
            )
    return pd.DataFrame(rows)


def _outcome(table: pd.DataFrame, one: Compared) -> Outcome:
    row = table[table["quantity"] == one.label] if len(table) else table
    if row.empty:
        return Outcome(verdict=Verdict.NO_DATA)
    percent, half_width, pairs = row[["difference [%]", "difference 95 % [%]", "pairs [-]"]].iloc[0]
    note = f"links less YADE {percent:+.1f} ± {half_width:.1f} % at 95 % ({pairs:.0f} pairs)"
    return Outcome(note=note, verdict=within(percent, half_width, one.margin))


def _finding(one: Compared) -> Finding:
    return Finding(
        id=one.label.replace(" ", "-").replace(",", ""),
        says=f"(ours) {one.label} is alike on both engines",
        found_if=f"95 % interval of the difference, paired by seed, within ±{one.margin:g} %: {one.why}",
        outcome=partial(_outcome, one=one),
        tables=["equivalence"],
    )


STUDY: Study = Study(
    name="engines",
    title="Two engines, the same seeds",
    measure=measure,
    keys=(Key(column=CASE, label="case", order=(*ACTIVE, HOOK, COLLAPSE, CHAIN)), Key(column=VARIANT, label="variant")),
    quantities=tuple(QUANTITIES.values()),
    findings=tuple(map(_finding, COMPARED)),
    figures=(
        Rows(
            name="differences",
            table="equivalence",
            quantities=[Quantity(column="difference [%]", axis="links less YADE over YADE [%]")],
            row="quantity",
            rows=lambda table: table[table["pairs [-]"] > 0],
            margin="margin [%]",
            notes=["Bands: margins, chosen beforehand."],
        ),
        Means(
            name="pitch",
            table="pitch",
            quantities=[Quantity(column="less links [%]", axis="less that of links, over it [%]")],
            x=PITCH,
            x_label="pitch over sphere diameter [-]",
            split=one_by_one("quantity", str),
        ),
    ),
    extra=lambda runs: {"points": STUDY.points(runs), "equivalence": equivalence(runs), "pitch": refinement(runs)},
    order=(CASE, VARIANT, SEED),
    same_count=(CASE,),
    remarks=(
        "Alike where the 95 % interval (Student's t, paired by seed) of the difference lies within the margin, which "
        "was chosen before the first run; not alike where it lies beyond the margin; else not resolved. One true "
        "difference in twenty lies outside its interval by chance.",
    ),
    reference=Reference(statement="chains of spheres on YADE, the same seeds", facts={"what": "engine yade"}),
    pictured={"case": "external", "variant": "links"},
)
