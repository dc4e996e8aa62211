"""The container's wall is removed, at once or by lifting it, from piles of each procedure.

The study measures, for 2 s, the largest cluster, height and radius of the pile, the smarticles that come off, and
whether the pile falls over. It compares them with Savoie, Tuazon, Bhamla and Goldman, "Amorphous Entangled Active
Matter", Soft Matter 2023, section "Melting behavior". Runs of one l/w and seed are poured from equal poses and compared
pair by pair.
"""

from functools import partial

import numpy as np
import pandas as pd

from dem.record.run import Run
from postprocess.measures.heights import heights
from postprocess.measures.spread import OUTSIDE, TOUCHING, centre_of_mass, free_pile
from postprocess.statistics.points import ASPECT, SEED, mean_difference, pairs
from postprocess.statistics.seeds import mean_over_seeds
from studies.framework.figures import PROCEDURE_LABELS, Histories, by_procedure
from studies.framework.findings import Effect, Finding, Outcome, Verdict, above, decide, mean, means_by
from studies.framework.procedures import INTERNAL, PROCEDURE, SHAPE, STATIC, of_procedure, paired
from studies.framework.release import ORDER, Pictures, named_columns, removal, removal_frames
from studies.framework.runs import ASPECT_KEY, Key, MeasuredRun, declare, duration, last_columns
from studies.framework.study import Study

WHOLE = 0.95  # least share of the largest cluster in a pile that holds together: at most 2 of 60 smarticles come off
SAME_WIDTH = 0.05  # accepted change of a pile's radius, over the radius; a smarticle is half as long as the radius

LIFT, SINCE = "lift speed [m/s]", "time since the wall began to go [s]"
BASE, TOP, CENTRE = "radius of 95 % before [m]", "height of 95 % before [m]", "com height before [m]"
CONTACT, ENTANGLED = "largest cluster by contact [-]", "largest cluster by crossings [-]"
HEIGHT, TOP_KEPT = "com height over that before [-]", "height of 95 % over that before [-]"
SPREAD, SLOUGHED = "radius of 95 % over that before [-]", "sloughed [-]"
TILT, OFFSET, TOPPLED = "tilt [degree]", "com offset over the base's radius [-]", "toppled [-]"

QUANTITIES = declare(
    {
        BASE: ("radius before [m]", ".4f", "radius about the centre of mass that holds 95 % of it, with the wall"),
        TOP: ("height before [m]", ".4f", "height below which 95 % of the material lies, with the wall"),
        CENTRE: ("", "", "height of the centre of mass, with the wall"),
        CONTACT: ("cluster by contact", ".3f", "share of the smarticles in the largest cluster joined by contact"),
        ENTANGLED: ("by crossings", ".3f", "share in the largest cluster joined by links that pass through planes"),
        HEIGHT: ("h/h0", ".3f", "height of the centre of mass over that with the wall"),
        TOP_KEPT: ("", "", "height below which 95 % of the material lies, over that with the wall"),
        SPREAD: ("radius / before", ".2f", "radius that holds 95 % of the material, over that with the wall"),
        SLOUGHED: ("sloughed", ".3f", "share farther from the middle than the wall was, by w/2 or more"),
        TILT: ("tilt [deg]", ".1f", "angle from the vertical of the line from the foot to the centre of mass"),
        OFFSET: ("", "", "how far the centre of mass moved sideways, over the radius of 95 % before"),
        TOPPLED: ("toppled", ".2f", "1 where the centre of mass ends beyond the radius of 95 % before, 0 otherwise"),
    }
)


def measure(run: Run) -> MeasuredRun:
    """Measure the pile with the wall and in every frame after; return the run's row and history."""
    before, after = removal_frames(run)
    phase = removal(run)
    settings = run.scene["phases"][phase.index]
    lift = 0.0 if settings.get("speed_m_per_s") is None else settings["speed_m_per_s"]
    centre = centre_of_mass(before.vertices)
    foot = (float(centre[0]), float(centre[1]))
    levels = heights(before.vertices, floor_z=before.floor_z)
    base = free_pile(before.vertices, run, floor_z=before.floor_z, foot=foot).radius_most
    rows = []
    for frame in (before, *after):
        pile = free_pile(frame.vertices, run, floor_z=frame.floor_z, foot=foot)
        level = heights(frame.vertices, floor_z=frame.floor_z)
        rows.append(
            {
                CONTACT: pile.touching,
                ENTANGLED: pile.entangled,
                HEIGHT: level.mean_com / levels.mean_com,
                TOP_KEPT: level.top / levels.top,
                SPREAD: pile.radius_most / base,
                SLOUGHED: pile.sloughed,
                TILT: pile.tilt,
                OFFSET: pile.offset / base,
            }
        )
    start = before.time if phase.start_s is None else phase.start_s
    row: dict[str, object] = {
        **named_columns(run),
        LIFT: lift,
        "time without the wall [s]": duration(phase),
        BASE: base,
        TOP: levels.top,
        CENTRE: levels.mean_com,
        **rows[-1],
        TOPPLED: float(rows[-1][OFFSET] * base > base),
        **last_columns(run),
    }
    history = {SINCE: np.array([start, *(frame.time for frame in after)]) - start}
    return MeasuredRun(
        run=run, rows=[row], history=history | {name: np.array([one[name] for one in rows]) for name in rows[0]}
    )


def at_once(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of runs whose wall is removed at once, not lifted."""
    return runs[runs[LIFT] == 0]


def _low_and_wide(runs: pd.DataFrame) -> list[Effect]:
    both = pairs(of_procedure(runs, INTERNAL), of_procedure(runs, STATIC), BASE)
    width = mean_over_seeds(both["one"] / both["other"] - 1)
    return [
        Effect(label="com height less static", value=paired(runs, CENTRE, INTERNAL, STATIC), sign=-1, unit=" m"),
        Effect(label="radius of 95 % over that of static, less 1,", value=width, threshold=-SAME_WIDTH),
        Effect(label="which is also below", value=width, sign=-1, threshold=SAME_WIDTH),
    ]


def _topples(runs: pd.DataFrame) -> Outcome:
    part = of_procedure(runs, SHAPE)
    fallen, total = int(part[TOPPLED].sum()), len(part)
    if not total:
        return Outcome(note="no runs", verdict=Verdict.NO_DATA)
    # One-sided 95 % bound: with this probability of falling over, no pile out of n falls in 5 % of cases.
    most = "" if fallen else f", so at most {1 - 0.05 ** (1 / total):.0%} of such piles do, at 95 %"
    offsets = means_by(runs, OFFSET, PROCEDURE, ".3f")
    return Outcome(
        note=f"{fallen} of {total} fell over{most}; com offset over the base's radius {offsets}",
        verdict=decide(fallen > 0),
    )


def _lifted(runs: pd.DataFrame) -> Outcome:
    effects = [
        Effect(
            label=f"{name} {label}, lifted less at once,",
            value=mean_difference(part[part[LIFT] > 0], part[part[LIFT] == 0], quantity),
        )
        for name in (INTERNAL, SHAPE)
        for part in [of_procedure(runs, name)]
        for quantity, label in ((HEIGHT, "com height kept"), (SLOUGHED, "sloughed"))
    ]
    # The statement asks for a difference of either sign.
    clear = any(effect.verdict in (Verdict.FOUND, Verdict.NOT_FOUND) for effect in effects)
    return Outcome(effects=effects, verdict=Verdict.FOUND if clear else None)


_mean, _above = partial(mean, rows=at_once), partial(above, rows=at_once)
FINDINGS = (
    _mean(
        "holds-together",
        "Shape change: the pile does not break apart",
        lambda runs: of_procedure(runs, SHAPE)[CONTACT],
        "largest cluster by contact in the end, after shape change,",
        threshold=WHOLE,
        shown=[CONTACT],
    ),
    _above(
        "entangled",
        "Shape change holds together by entanglement, more than internal oscillation",
        ENTANGLED,
        SHAPE,
        (INTERNAL, STATIC),
        shown=[ENTANGLED],
    ),
    _above(
        "keeps-its-edge",
        "Shape change: smarticles at the edge do not come off, unlike after internal oscillation",
        SLOUGHED,
        SHAPE,
        (INTERNAL,),
        sign=-1,
        shown=[SLOUGHED],
    ),
    _above(
        "narrow-and-high", "Shape change narrows the base and raises the pile", {BASE: -1, TOP: 1}, SHAPE, (STATIC,)
    ),
    Finding(
        id="topples",
        says="Shape change: the pile may fall onto its side (one example is shown)",
        outcome=_topples,
        rows=at_once,
        found_if="the centre of mass of at least one pile ends beyond its base",
    ),
    _mean(
        "sloughs",
        "Internal oscillation: some smarticles slough off the outer edge",
        lambda runs: of_procedure(runs, INTERNAL)[SLOUGHED],
        "sloughed share",
    ),
    Finding(
        id="low-and-wide",
        says="Internal oscillation lowers the pile and keeps its width",
        outcome=_low_and_wide,
        rows=at_once,
        found_if=f"com height below that of static, radius within {SAME_WIDTH:.0%} of it, paired by l/w and seed",
    ),
    _above(
        "more-stable",
        "Internal oscillation makes the pile more stable than it was as poured",
        HEIGHT,
        INTERNAL,
        (STATIC,),
        shown=[HEIGHT],
    ),
    Finding(
        id="lifting-differs",
        says="(ours, not the paper's) lifting the wall differs from taking it away at once",
        outcome=_lifted,
        found_if="a difference in height kept or in the sloughed share, of either procedure, paired by l/w and seed",
    ),
)


def _against_time(aspect: float, lift: float) -> Histories:
    return Histories(
        name=f"time_lw{aspect:.2f}" + ("_lifted" if lift else ""),
        quantities={
            CONTACT: "largest cluster\nby contact [-]",
            ENTANGLED: "largest cluster\nby crossings [-]",
            HEIGHT: "height of the centre\nof mass $h/h_0$ [-]",
            SPREAD: "radius of 95 %\nover that before [-]",
            SLOUGHED: "sloughed\nshare [-]",
            TILT: "tilt [degree]",
        },
        x=SINCE,
        x_label="time since the wall went [s]",
        rows=lambda runs: runs[(runs[ASPECT] == aspect) & (runs[LIFT] == lift)],
        split=by_procedure(),
        notes=[f"l/w = {aspect:g}, wall {f'lifted at {lift:g} m/s' if lift else 'gone at once'}."],
    )


STUDY = Study(
    name="melting",
    title="Piles whose wall is taken away",
    measure=measure,
    keys=(
        Key(column=LIFT, label="lift [m/s]", form="g"),
        ASPECT_KEY,
        Key(column=PROCEDURE, label="procedure", order=ORDER),
    ),
    quantities=tuple(QUANTITIES.values()),
    findings=FINDINGS,
    figures=(
        *(_against_time(*point) for point in ((0.7, 0.0), (0.7, 0.1), (0.4, 0.0), (1.0, 0.0))),
        Pictures(labels=PROCEDURE_LABELS, select=(LIFT,)),
    ),
    order=(LIFT, ASPECT, SEED, PROCEDURE),
    remarks=(
        f"Clusters: strands within {TOUCHING:g} diameters, or links through planes. Sloughed: farther from "
        f"the pile's middle (median) than the wall was, by {OUTSIDE:g} w. Numbers are those at the end of the run.",
    ),
    pictured={"procedure": SHAPE, "lift_m_per_s": 0, "l_over_w": 0.7},
)
