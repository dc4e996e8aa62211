"""Packing fractions of poured and shaken U-shapes of several l/w, compared with Gravish et al.

Gravish, Franklin, Hu and Goldman, "Entangled granular media", Phys. Rev. Lett. 108, 208001 (2012), shook steel staples
for 20 s. Their points were digitised (`postprocess/reference/README.md`). They are compared at equal l/w and not
interpolated. --quick takes minutes.
"""

import itertools
import math
from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
import pandas as pd

from dem.record.run import Run
from postprocess.measures.packing import DEFINITIONS
from postprocess.report import figures as style
from postprocess.statistics.points import ASPECT, SEED, SEEDS, marked
from postprocess.statistics.seeds import SeedMean, mean_over_seeds
from studies.framework.figures import (
    ASPECT_LABEL,
    CROSSINGS_LABEL,
    Histories,
    Means,
    Series,
    marker,
    one_by_one,
    procedure_marker,
)
from studies.framework.findings import Effect, Finding, Outcome, Verdict, decide
from studies.framework.procedures import EXTERNAL
from studies.framework.runs import ASPECT_KEY, DEFINITION, Key, Row, by_engine, declare
from studies.framework.shaken import (
    AT_REST,
    DIGITISING_ERROR,
    GRAVISH,
    GRAVISH_COLUMNS,
    SHAKE_TIME,
    SHAKEN,
    STAGES,
    WHEN,
    contact_of,
    gravish_at,
    gravish_note,
    measured_row,
    packing_history,
    phi,
    read_gravish,
)
from studies.framework.study import Study

CONTACT = "contact"
PAPER = "friction 0.4 as in the paper"  #: Contact of Savoie et al., in the column `CONTACT`
ACCEPTED = 10.0  # %, accepted mean absolute deviation from Gravish's points
COSTLY = "voronoi"  # definition of φ that takes seconds per frame; not measured at the fidelity draft

_SYMBOLS = {"phi_0": "φ_0", AT_REST: "φ_f at rest", "phi_f": "φ_f while shaken", "phi_f relaxed": ""}
_ENDS = {"phi_0": "φ_0", "phi_f": "φ_f"}
QUANTITIES = declare(
    {
        phi(stage, one): (symbol * (one == DEFINITION), ".4f", f"packing fraction {STAGES[stage]}, by {one}")
        for one in DEFINITIONS
        for stage, symbol in _SYMBOLS.items()
        if one in {AT_REST: (DEFINITION,), "phi_f relaxed": (DEFINITION, "top-percentile")}.get(stage, DEFINITIONS)
    }
    | {
        f"crossings {when} [-]": (f"⟨N⟩ {when}", ".2f", f"links through a smarticle's plane {meaning}")
        for when, meaning in zip(("before", "after", "relaxed"), STAGES.values(), strict=False)
    },
    axes={
        phi("phi_0"): r"$\phi_0$ before shaking [-]",
        phi("phi_f"): r"$\phi_\mathrm{f}$ after shaking, at rest [-]",
        "crossings before [-]": f"{CROSSINGS_LABEL}\nbefore shaking",
        "crossings after [-]": f"{CROSSINGS_LABEL}\nat the end of shaking",
    },
)


def measure(run: Run) -> Row:
    """Measure φ by all definitions and crossings before and after shaking; return the run's row."""
    row = measured_row(run, [name for name in DEFINITIONS if name != COSTLY or run.manifest.fidelity != "draft"])
    missing = dict.fromkeys([name for name in QUANTITIES if name not in row], math.nan)
    return {CONTACT: contact_text(run), **row, **missing, SHAKEN: round(float(str(row[SHAKEN])), 3)}


def contact_text(run: Run) -> str:
    """Return a run's friction and restitution as text, or `PAPER`."""
    contact = contact_of(run)
    between, wall, restitution = (contact[key] for key in ("friction_smarticle", "friction_wall", "restitution"))
    if (between, wall, restitution) == (0.4, 0.4, 0.7):
        return PAPER
    return f"friction {between:.3g}, {wall:.3g} at the container, restitution {restitution:.3g}"


def phi_by_aspect(runs: pd.DataFrame, stage: str) -> Mapping[float, SeedMean]:
    """Return the mean φ over seeds at a stage by l/w, in ascending order; empty if it was not measured."""
    if phi(stage) not in runs:  # tables of earlier versions
        return {}
    found = {float(aspect): mean_over_seeds(part[phi(stage)]) for aspect, part in runs.groupby(ASPECT)}
    return {aspect: mean for aspect, mean in found.items() if mean.count}


def compared(runs: pd.DataFrame, end: str) -> str:
    """Return the stage whose φ is compared with Gravish's φ_0 or φ_f (`end` is "phi_0" or "phi_f").

    It is `end`, but for φ_f `AT_REST` if the runs were measured at rest after shaking.
    """
    return AT_REST if end == "phi_f" and phi_by_aspect(runs, AT_REST) else end


def deviations(runs: pd.DataFrame) -> pd.DataFrame:
    """Tabulate the deviation of φ from Gravish's points: a row per stage and l/w with a point."""
    rows = []
    for stage in STAGES:
        for aspect, mean in phi_by_aspect(runs, stage).items():
            known = gravish_at(aspect, stage)
            if math.isnan(known):
                continue
            row = {"stage": stage, "definition": DEFINITION, ASPECT: aspect, SEEDS: mean.count}
            row |= {"phi [-]": mean.value, "phi 95 % [-]": mean.half_width, "phi Gravish [-]": known}
            row |= {"digitising error [-]": DIGITISING_ERROR, "deviation [-]": mean.value - known}
            row["deviation [%]"] = 100 * (mean.value / known - 1)
            rows.append(row | {"deviation 95 % [%]": 100 * mean.half_width / known})
    return pd.DataFrame(rows)


def steps(runs: pd.DataFrame) -> pd.DataFrame:
    """Tabulate the difference of φ between neighbouring l/w: a row per stage and pair.

    The 95 % half-width of the difference is the root of the sum of the squared half-widths of both means.
    """
    rows = []
    for stage in STAGES:
        for (low, one), (high, other) in itertools.pairwise(phi_by_aspect(runs, stage).items()):
            difference, half_width = other.value - one.value, math.hypot(one.half_width, other.half_width)
            way = "falls" if difference < 0 else "rises"
            if not abs(difference) > half_width:
                way = "no error bar" if math.isnan(half_width) else "within error bars"
            rows.append((stage, DEFINITION, low, high, difference, half_width, way))
    ends = ["from aspect ratio [-]", "to aspect ratio [-]"]
    return pd.DataFrame(rows, columns=["stage", "definition", *ends, "difference [-]", "combined 95 % [-]", "phi"])


def falls(end: str) -> Finding:
    """Make the finding that φ_0 (`end` is "phi_0") or φ_f ("phi_f") falls monotonically with l/w."""

    def outcome(every: pd.DataFrame) -> Outcome:
        runs = _of_contact(every)
        stage = compared(runs, end)
        means = list(phi_by_aspect(runs, stage).items())
        if len(means) < 2:
            return Outcome(note="fewer than two aspect ratios", verdict=Verdict.NOT_RESOLVED)
        found = steps(runs)
        ways = found.loc[found["stage"] == stage, "phi"].value_counts()
        (low, first), (high, last) = means[0], means[-1]
        half_width = math.hypot(first.half_width, last.half_width)
        total = SeedMean(value=last.value - first.value, standard_error=math.nan, half_width=half_width, count=2)
        text = f"{total.value:+.4f} ± {half_width:.4f} (95 %)"
        effect = Effect(label=f"change from l/w = {low:g} to {high:g}", value=total, sign=-1, text=text)
        note = f"{STAGES[stage]}; steps: {', '.join(f'{count} {way}' for way, count in ways.items())}"
        return Outcome(effects=[effect], note=note, verdict=decide(set(ways.index) == {"falls"}, "rises" in ways))

    return Finding(
        id=f"{end.replace('_', '-')}-falls",
        says=f"{_ENDS[end]} falls monotonically with l/w",
        outcome=outcome,
        found_if="every step between neighbouring l/w falls by more than its 95 % half-width; not found if one rises "
        "by more",
    )


def near(end: str, *, calibrated: bool = False) -> Finding:
    """Make the finding that φ_0 (`end` is "phi_0") or φ_f ("phi_f") is near Gravish's points.

    It is judged by the runs with the contact of Savoie et al., or if `calibrated` by all others.
    """

    def outcome(every: pd.DataFrame) -> Outcome:
        runs = _of_contact(every, paper=not calibrated)
        found, stage = deviations(runs), compared(runs, end)
        found = found[found["stage"] == stage] if len(found) else found
        if found.empty:
            return Outcome(note="Gravish has no point at these l/w", verdict=Verdict.NOT_RESOLVED)
        percent = found["deviation [%]"]
        half_width = float(np.hypot.reduce(found["deviation 95 % [%]"])) / len(found)
        worst = found.loc[percent.abs().idxmax()]
        mean = percent.abs().mean()
        error = f"± {half_width:.1f} % (95 %)" if math.isfinite(half_width) else "without an error bar"
        note = f"{STAGES[stage]}: mean absolute deviation {mean:.1f} % {error}; the largest "
        note += f"{worst['deviation [%]']:+.1f} % "
        note += f"at l/w = {worst[ASPECT]:g}; reading Gravish's points is uncertain by about "
        note += f"{100 * DIGITISING_ERROR / found['phi Gravish [-]'].mean():.1f} %"
        # A NaN, from one seed, is on neither side.
        return Outcome(note=note, verdict=decide(mean + half_width <= ACCEPTED, mean - half_width > ACCEPTED))

    return Finding(
        id=f"{end.replace('_', '-')}-near{'-calibrated' if calibrated else ''}",
        says=f"The mean absolute deviation of {_ENDS[end]} from Gravish is at most {ACCEPTED:g} %"
        + (", with the calibrated contact" if calibrated else ""),
        outcome=outcome,
        found_if="mean over the l/w at which Gravish has a point, with its whole 95 % interval",
    )


def _compacts(every: pd.DataFrame) -> Outcome:
    runs = _of_contact(every)
    gain = runs[phi(compared(runs, "phi_f"))] - runs[phi("phi_0")]
    means = [mean_over_seeds(part) for _, part in gain.groupby(runs[ASPECT])]
    clear = sum(mean.value > mean.half_width for mean in means)
    note = f"gain paired by seed: above 0 by more than its 95 % half-width at {clear} of {len(means)} l/w"
    falls = any(mean.value <= 0 for mean in means)
    return Outcome(note=note, verdict=decide(clear == len(means) and not falls, falls))


def _complete(runs: pd.DataFrame) -> pd.DataFrame:
    """Add a column of NaN to the table of runs for each of `QUANTITIES` that it lacks, and return it.

    Tables of earlier versions of the study lack φ_f at rest, and the column `CONTACT`: their contact is `PAPER`.
    """
    runs = runs.reindex(columns=[*runs.columns, *(name for name in QUANTITIES if name not in runs)])
    return runs.assign(**{CONTACT: runs[CONTACT].fillna(PAPER) if CONTACT in runs else PAPER})


def _of_contact(runs: pd.DataFrame, *, paper: bool = True) -> pd.DataFrame:
    """Return the runs with the contact of Savoie et al., or unless `paper` all others."""
    runs = _complete(runs)
    return runs[(runs[CONTACT] == PAPER) == paper]


def _fully_shaken(points: pd.DataFrame) -> pd.DataFrame:
    """Return points or runs, with NaN for φ_f and ⟨N⟩ after shaking unless the time of shaking is the longest."""
    ends = [name for name in points if str(name).startswith(("phi_f", "crossings after", "crossings relaxed"))]
    return points.assign(**points[ends].where(points[SHAKEN] == points[SHAKEN].max()))


def _at_rest(points: pd.DataFrame) -> pd.DataFrame:
    """Return points in which φ_f is that of piles at rest; φ_f is NaN unless the time of shaking is the longest.

    For tables of earlier versions, without φ of the last frame, it is the mean over the relaxation after shaking.
    """
    points = _fully_shaken(points)
    rest, settling = ([phi(stage), marked(phi(stage), "95 %")] for stage in (AT_REST, "phi_f relaxed"))
    shown = [phi("phi_f"), marked(phi("phi_f"), "95 %")]
    return points.assign(
        **{name: points[one].fillna(points[other]) for name, one, other in zip(shown, rest, settling, strict=True)}
    )


def _by_contact(table: pd.DataFrame) -> list[Series]:
    """Return a series for each contact, that of Savoie et al. first; labels leave the restitution out."""
    contacts = sorted(table[CONTACT].unique(), key=lambda one: (one != PAPER, one))
    other = marker("s", style.BLACK, style.BLACK)
    return [
        Series(
            rows=table[table[CONTACT] == one],
            label=str(one).split(", restitution")[0],
            properties=procedure_marker(EXTERNAL) if one == PAPER else other,
        )
        for one in contacts
    ]


def _each_contact(runs: pd.DataFrame, made: Callable[[pd.DataFrame], pd.DataFrame]) -> pd.DataFrame:
    """Apply the function `made` to the runs of each contact, and concatenate the tables with the column `CONTACT`."""
    return pd.concat([made(part).assign(**{CONTACT: name}) for name, part in runs.groupby(CONTACT)], ignore_index=True)


_PUBLISHED = read_gravish()

STUDY = Study(
    name="gravish",
    title="Packing of shaken smarticles against Gravish et al. 2012",
    measure=measure,
    keys=(Key(column=CONTACT, label="contact"), ASPECT_KEY, Key(column=SHAKEN, label="shaken [s]", form="g")),
    quantities=tuple(QUANTITIES.values()),
    samples=_complete,
    findings=(
        *map(falls, _ENDS),
        Finding(
            id="compacts",
            says="φ_f is above φ_0 at every l/w",
            outcome=_compacts,
            found_if="gain paired by seed beyond its 95 % half-width at every l/w",
        ),
        *map(near, _ENDS),
        *(near(end, calibrated=True) for end in _ENDS),
    ),
    figures=(
        Means(
            name="phi",
            quantities=[QUANTITIES[phi(stage)] for stage in ("phi_0", "phi_f")],
            x=ASPECT,
            x_label=ASPECT_LABEL,
            rows=_at_rest,
            split=_by_contact,
            share_y=True,
            published="experiment",
            reference={
                phi(stage): (_PUBLISHED["l_over_w"], _PUBLISHED[GRAVISH_COLUMNS[stage]]) for stage in ("phi_0", "phi_f")
            },
            notes=[gravish_note(sorted(_PUBLISHED["l_over_w"]))],
        ),
        Means(
            name="crossings",
            quantities=[QUANTITIES[f"crossings {when} [-]"] for when in ("before", "after")],
            x=ASPECT,
            x_label=ASPECT_LABEL,
            rows=_fully_shaken,
            split=_by_contact,
            share_y=True,
        ),
        Histories(
            name="phi_time",
            history=packing_history,
            split=one_by_one(ASPECT, "l/w = {:g}".format, last=0.9),
            x_label="time since shaking began [s]",
            quantities={"": r"packing fraction $\phi$ [-]"},
        ),
    ),
    extra=lambda runs: {
        name: by_engine(_fully_shaken(_complete(runs)), partial(_each_contact, made=made))
        for name, made in (("deviations", deviations), ("steps", steps))
    },
    order=(ASPECT, SEED),
    from_tables=True,
    remarks=(
        f"φ by {DEFINITION} unless named otherwise; {WHEN} (voxel and voronoi: the last frame, voronoi not of drafts). "
        f"φ_f at rest: the last frame after shaking, which is compared with Gravish et al., who shook for "
        f"{SHAKE_TIME:g} s and measured piles at rest. "
        "Figures and deviations leave out φ_f of piles that were shaken for less time than others.",
    ),
    reference=GRAVISH,
    pictured={"l_over_w": 0.7},
)
