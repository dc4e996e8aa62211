"""Strain test of a chain of two or six robots between two walls, at several distances of the walls.

The study measures force, yield, width and fracture against confinement h/H, the width of the chain at the start over
the distance of the walls. It compares them with Savoie, Tuazon,
Bhamla and Goldman, "Amorphous Entangled Active Matter", Soft Matter 2023, section "Robophysical experiment". The paper
omits friction, servos and strings; variants of the sweep show their influence. In `chain-bodies` robots have bodies 2.1
cm thick. Runs of one seed have equal servos. --quick takes minutes.
"""

from functools import partial

import numpy as np
import pandas as pd

from dem.errors import InputError
from dem.record.run import Run
from postprocess.measures.strain import (
    AT_PEAK,
    BEND,
    CARRIES,
    DROP,
    FRACTURE,
    LOSS,
    PEAK,
    SLIP_WIDENING,
    STIFFNESS,
    STRAIN,
    WALL,
    WIDENING,
    YIELD,
    measured,
    read_strain_test,
)
from postprocess.measures.strain import QUANTITIES as MEANINGS
from postprocess.statistics.points import SEED, SEEDS, averaged
from postprocess.statistics.seeds import SeedMean, mean_over_seeds, slope_within
from studies.framework import figures
from studies.framework.figures import Histories, History, Means, one_by_one
from studies.framework.findings import Effect, Finding, Outcome, Rows, Verdict
from studies.framework.runs import Key, Quantity, Row, declare, last_columns
from studies.framework.study import Study

RANGE = (0.52, 0.65)  # least and greatest h/H in the paper
YIELDS = {2: 0.2, 6: 0.4}  # strains at which the paper's single trials yield, by number of robots
NEAR = 0.1  # accepted deviation from these strains, which a sentence of the paper gives
STRAIGHT = 0.25  # accepted deviation of the second slope from the first, over the first, for a straight line
BASELINE = "baseline"
VARIANT, COUNT, CONFINEMENT, SPEED = "variant", "smarticles [-]", "h/H [-]", "speed [m/s]"
START = "width at the start [m]"

# h of the paper [m]. A chain of robots with links of one thickness has this width by choice of the thickness. A chain
# of robots with thicker bodies is wider: h/H then only gives the distance of the walls, which is that of the paper.
PAPER_WIDTH = 0.062

_SHOWN = {
    PEAK: ("peak force [N]", ".3f"),
    AT_PEAK: ("strain at the peak", ".3f"),
    FRACTURE: ("strain at fracture", ".3f"),
    YIELD: ("strain at the yield drop", ".3f"),
    STIFFNESS: ("stiffness [N]", ".2f"),
    WIDENING: ("widening", ".3f"),
    WALL: ("wall force [N]", ".2f"),
}
QUANTITIES = declare({column: (*_SHOWN.get(column, ("", "")), meaning) for column, meaning in MEANINGS.items()})


def measure(run: Run) -> Row:
    """Measure force, strain and width of the chain; return the run's row."""
    strained = [phase for phase in run.scene["phases"] if phase["type"] == STRAIN]
    if len(strained) != 1:
        raise InputError(
            f"{run.path}: has {len(strained)} phases of type {STRAIN}, not 1; give runs of the study chain"
        )
    pull = read_strain_test(run)
    width = float(pull.widths[0]) if run.manifest.middle_thickness_in_plane_m is None else PAPER_WIDTH
    return {
        VARIANT: run.manifest.name,
        COUNT: run.manifest.count,
        CONFINEMENT: round(width / run.manifest.channel_width_m, 3) if run.manifest.channel_width_m else 0.0,
        SEED: run.manifest.seed,
        SPEED: strained[0]["speed_m_per_s"],
        START: float(pull.widths[0]),
        **measured(pull),
        **last_columns(run),
    }


def tabulate(runs: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Make the tables `points`, means over seeds, and `sensitivity`, changes against the baseline [%]."""
    keys = [VARIANT, COUNT, CONFINEMENT, SPEED]
    points = [
        dict(zip(keys, place, strict=True))
        | {SEEDS: len(group), "yielded [-]": int(group[YIELD].notna().sum()), **averaged(group, QUANTITIES)}
        for place, group in runs.groupby(keys)
    ]
    trial = [COUNT, CONFINEMENT, SEED]
    base = runs[runs[VARIANT] == BASELINE].set_index(trial)
    rows = []
    for variant, group in runs[runs[VARIANT] != BASELINE].groupby(VARIANT, sort=False):
        for quantity in (PEAK, FRACTURE, AT_PEAK, STIFFNESS):
            own = group.set_index(trial)[quantity]
            change = mean_over_seeds((100 * (own / base[quantity] - 1)).dropna().tolist())
            rows.append([variant, quantity, own.mean(), change.value, change.half_width, change.count])
    columns = [VARIANT, "quantity", "value", "change [%]", "change 95 % [%]", "trials [-]"]
    return {"points": pd.DataFrame(points), "sensitivity": pd.DataFrame(rows, columns=columns)}


def baseline(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the variant `baseline`."""
    return runs[runs[VARIANT] == BASELINE]


def in_range(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the variant `baseline` whose confinement h/H is in the paper's range, `RANGE`."""
    return baseline(runs)[baseline(runs)[CONFINEMENT].between(*RANGE)]


def by_trial(part: pd.DataFrame, quantity: str) -> SeedMean:
    """Average a quantity over the confinements h/H for each seed, then over seeds.

    Runs with equal servos are identical until the chain touches a wall, so values at several h/H are not independent.
    """
    return mean_over_seeds(part.groupby(SEED)[quantity].mean().tolist())


def _within(label: str, value: SeedMean, centre: float, margin: float) -> list[Effect]:
    return [
        Effect(label=label, value=value, threshold=centre - margin),
        Effect(
            label=f"which is to be within {margin:g} of",
            value=value,
            sign=-1,
            threshold=centre + margin,
            text=f"{centre:g}",
        ),
    ]


def _straight(base: pd.DataFrame) -> list[Effect]:
    effects = []
    for count in YIELDS:
        own = base[base[COUNT] == count]
        ratio = by_trial(own.assign(**{BEND: own[BEND] - 1}), BEND)
        effects += _within(f"n = {count}: second over first slope, less 1,", ratio, 0, STRAIGHT)
        effects.append(Effect(label="slope", value=by_trial(own, STIFFNESS), sign=0, unit=" N"))
    return effects


def yields(count: int) -> Finding:
    """Make the finding that a chain of `count` robots has a yield drop near the paper's strain."""
    expected = YIELDS[count]

    def outcome(base: pd.DataFrame) -> Outcome:
        part = base[base[COUNT] == count]
        yielded = part[part[YIELD].notna()]
        slip = Effect(label="others part at", value=by_trial(part[part[YIELD].isna()], AT_PEAK), sign=0)
        note = f"{len(yielded)} of {len(part)} runs have one; {slip}"
        strain = by_trial(yielded, YIELD)
        if strain.count < 2:
            return Outcome(note=note, verdict=Verdict.NO_DATA if part.empty else Verdict.NOT_FOUND)
        loss = Effect(label="loss, of the force,", value=by_trial(yielded, DROP), sign=0)
        return Outcome(effects=[*_within("yield drop at", strain, expected, NEAR), loss], note=note)

    return Finding(
        id=f"yields-{count}",
        says=f"A yield drop near a strain of {expected:g}, n = {count}",
        outcome=outcome,
        rows=baseline,
        found_if=f"mean strain of the yield drop within {NEAR:g} of it; not found without drops",
    )


def _widens(base: pd.DataFrame) -> list[Effect]:
    effects = []
    for count in YIELDS:
        own = base[base[COUNT] == count]
        effects.append(Effect(label=f"n = {count}: widening before the fracture", value=by_trial(own, WIDENING)))
        effects.append(Effect(label="up to the first maximum", value=by_trial(own, SLIP_WIDENING), sign=0))
    return effects


def rises(name: str, says: str, quantity: str, rows: Rows) -> Finding:
    """Make the finding that a quantity rises with confinement h/H; `says` is its statement."""

    def outcome(part: pd.DataFrame) -> Outcome:
        effects, untouched = [], False
        for count in YIELDS:
            own = part[part[COUNT] == count]
            slope = slope_within(own[CONFINEMENT].tolist(), own[quantity].tolist(), own[SEED].tolist())
            walls = f" per unit of h/H, force on the walls up to {own[WALL].max():.2g} N"
            effects.append(Effect(label=f"n = {count}: slope", value=slope, note=walls))
            # If the chain never touches a wall, runs at all h/H are identical: the slope is 0 without scatter.
            untouched |= slope.count > 1 and slope.value <= 0 and not slope.half_width > 0
        return Outcome(effects=effects, verdict=Verdict.NOT_FOUND if untouched else None)

    return Finding(id=name, says=says, outcome=outcome, rows=rows)


def _more(base: pd.DataFrame) -> list[Effect]:
    effects = []
    for name, quantity, sign in (("force", PEAK, 1), ("strain at fracture", FRACTURE, -1)):
        table = base.pivot_table(index=[CONFINEMENT, SEED], columns=COUNT, values=quantity).reindex(columns=[2, 6])
        value = by_trial((table[6] - table[2]).dropna().rename(quantity).reset_index(), quantity)
        effects.append(Effect(label=f"{name} of n = 6 less n = 2", value=value, sign=sign))
    return effects


_INSIDE = f"rises about linearly with confinement, h/H {RANGE[0]:g} to {RANGE[1]:g} as in the paper"
_OVER = "rises with confinement, linearly or not, over our range"
FINDINGS = (
    Finding(
        id="force-linear",
        says="Force starts linear in strain",
        outcome=_straight,
        rows=baseline,
        found_if=f"the slopes of the lower and the upper half of the first rise differ by less than {STRAIGHT:.0%}",
    ),
    *map(yields, YIELDS),
    Finding(id="widens", says="The chain widens while strained (auxetic)", outcome=_widens, rows=baseline),
    rises("peak-rises-in-range", f"Peak force {_INSIDE}", PEAK, in_range),
    rises("fracture-rises-in-range", f"Strain at fracture {_INSIDE}", FRACTURE, in_range),
    rises("peak-rises", f"Peak force {_OVER}", PEAK, baseline),
    rises("fracture-rises", f"Strain at fracture {_OVER}", FRACTURE, baseline),
    Finding(
        id="more-robots", says="As n increases, force increases but elongation decreases", outcome=_more, rows=baseline
    ),
)


def history(run: Run, *, width: bool = False) -> History:
    """Read the force of the pulled string [N] against strain [-], up to the fracture.

    With `width` read the width of the chain over its width at the start [-] instead.
    """
    pull = read_strain_test(run)
    end = pull.fracture + 1
    values = pull.widths / pull.widths[0] if width else pull.forces
    return History(times=np.maximum.accumulate(pull.strains[:end]), values=values[:end])


_HISTORIES = (
    ("force_strain", history, "force of the pulled string [N]"),
    ("width_strain", partial(history, width=True), "width over that at the start [-]"),
)

STUDY = Study(
    name="chain",
    title="The strain test of a chain of robots against the findings of Savoie et al.",
    measure=measure,
    keys=(
        Key(column=VARIANT, label="variant"),
        Key(column=COUNT, label="n", form="g"),
        Key(column=CONFINEMENT, label="h/H", form="g"),
        Key(column=SPEED, label="mm/s", form="g", scale=1e3),
    ),
    quantities=tuple(QUANTITIES.values()),
    findings=FINDINGS,
    figures=(
        *(
            Histories(
                name=name,
                history=read,
                rows=baseline,
                split=one_by_one(CONFINEMENT, "h/H = {:g}".format),
                panels=COUNT,
                panel="n = {:g}",
                width=0.005,
                unit="of strain",
                x_label="strain [-]",
                quantities={"": label},
                notes=["Up to the first fracture."],
            )
            for name, read, label in _HISTORIES
        ),
        Means(
            name="confinement",
            quantities=[QUANTITIES[PEAK], QUANTITIES[FRACTURE]],
            x=CONFINEMENT,
            x_label="confinement h/H [-]",
            rows=baseline,
            split=one_by_one(COUNT, "n = {:g}".format),
            marks=RANGE,
            notes=["Means over trials, each with a seed of its own. Broken lines: the paper's range."],
        ),
        figures.Rows(
            name="sensitivity",
            table="sensitivity",
            quantities=[Quantity(column="change [%]", axis="change against the baseline [%]")],
            row=VARIANT,
            rows=lambda table: table[table["quantity"].isin([PEAK, FRACTURE])],
            split=one_by_one("quantity", str),
            levels={"change [%]": 0.0},
            notes=["Means over pairs of runs with the same servos, n = 2."],
        ),
    ),
    extra=tabulate,
    same_count=(COUNT,),
    order=(VARIANT, COUNT, CONFINEMENT, SEED),
    one_engine=True,
    remarks=(
        "Force: of the pulled string, means over 1 ms. Strain: of the distance along x between the strings' ties. A "
        f"chain holds while it carries {CARRIES:.0%} of its peak force. A yield drop loses {LOSS:.0%} of the force or "
        "more. Trials differ in the strength of their servos, ±10 %. h is that of the chain; of robots with bodies of "
        f"their own it is the paper's {1e3 * PAPER_WIDTH:g} mm, so that walls are where the paper's are.",
    ),
    pictured={"variant": BASELINE, "count": 2},
)
