"""Is a quiet blob of worms lifted as a whole, and an active one left behind?

Savoie, Tuazon, Tiwari, Bhamla and Goldman, "Amorphous entangled active matter", Soft Matter 2023, lift blobs of living
blackworms by 15 mm on a serrated end piece: in water rich in oxygen, where worms are quiet, the blob comes along; in
water poor in oxygen, where they are active, it is left behind. Here worms are flexible filaments that tangle by turning
helical bends, and then hold these bends or go on to wriggle.

The model assumes what worms do: quiet worms hold the bends in which they tangled, active ones turn and reverse them.
It has no muscles that tire, no oxygen, no sense of touch, no slime, and an end piece that touches nothing: it grips all
nodes within a distance of the dish's axis above the blob's mean height.
"""

import numpy as np
import pandas as pd

from dem.record.run import Run
from postprocess.geometry.bars import body_centres
from postprocess.measures.crossing_number import average_crossing_numbers
from postprocess.report import figures as style
from postprocess.statistics.points import ASPECT, SEED, paired_differences
from postprocess.statistics.seeds import mean_over_seeds
from studies.framework.figures import Histories, History, Means, Series, marker, one_by_one
from studies.framework.findings import Effect, Finding, mean, slope, unit_of
from studies.framework.runs import Key, Row, declare, last_columns, phase_of, run_columns
from studies.framework.study import Study

ACTIVE = "active [Hz]"  #: Column: frequency of the worms' turns after tangling; 0 if they hold their bends
RISE, SHARE, OTHERS = "rise of the centre of mass [m]", "lifted [-]", "lifted of those not gripped [-]"
GRIPPED, HELD, CROSSINGS = "gripped [-]", "load over weight [-]", "crossing number before [-]"
HEIGHT = "height of the centre of mass [m]"
LIFTED = 0.5  #: Least rise of a lifted worm's centre of mass, over the distance of the lift [-]
EXACT = 1e-7  #: Largest deviation of a gripped node from the path of the end piece [m]
WHOLE = 0.9  #: Least fraction of worms lifted if the blob is lifted as a whole [-]
LEFT = 0.5  #: Greatest fraction lifted of the worms that are not gripped, if the blob is left behind [-]

QUANTITIES = declare(
    {
        RISE: ("rise [mm]", ".2f", "rise of the blob's centre of mass from the beginning of the lift to the end"),
        SHARE: ("lifted", ".2f", f"share of worms whose centre of mass rose by {LIFTED:.0%} of the lift at least"),
        OTHERS: ("lifted, not gripped", ".2f", "this share among the worms that the end piece does not grip"),
        GRIPPED: ("gripped", ".1f", "number of worms that the end piece grips"),
        HELD: ("load over weight", ".2f", "mean force on the end piece in the last second over all worms' weight"),
        CROSSINGS: ("⟨ACN⟩", ".1f", "mean average crossing number of a worm with all others before the lift"),
    },
    scales={RISE: 1e3},
    axes={
        RISE: "rise of the centre of mass [mm]",
        SHARE: "share of worms lifted [-]",
        OTHERS: "share lifted of those not gripped [-]",
    },
)


def _lift(run: Run) -> tuple[int, float, float]:
    """Return index, first recorded time [s] and distance [m] of the phase that lifts the end piece."""
    place = phase_of(run, "lift")
    times = run.series.time[run.series["phase"] == place]
    return place, float(times[0]), float(run.scene["phases"][place]["distance_m"])


def measure(run: Run) -> Row:
    """Measure how far a blob rose, and how many worms came along."""
    place, begin, distance = _lift(run)
    series, phase = run.series, run.series["phase"]
    before = [frame for frame in run.frames if frame.time <= begin][-1]
    after = run.frames[-1]
    rise = body_centres(after)[:, 2] - body_centres(before)[:, 2]
    held = gripped(run)
    lifted = rise >= LIFTED * distance
    heights = series["com_height_m"][phase == place]
    last = series["time_s"] > series["time_s"][-1] - 1.0
    immersed = 1 - run.scene["liquid"]["density_kg_per_m3"] / run.scene["particle"][0]["density_kg_per_m3"]
    weight = run.manifest.count * run.manifest.smarticle_mass_kg * run.scene["gravity_m_per_s2"] * immersed
    return {
        **{name: cell for name, cell in run_columns(run).items() if name != ASPECT},
        ACTIVE: float(run.scene["phases"][place - 1]["frequency_hz"]),
        RISE: float(heights[-1] - heights[0]),
        SHARE: float(lifted.mean()),
        OTHERS: float(lifted[~held].mean()),
        GRIPPED: float(series["gripped_count"][-1]),
        HELD: float(series["grip_force_N"][last, 2].mean() / weight),
        CROSSINGS: average_crossing_numbers(before.segments, before.body).mean,
        **last_columns(run),
    }


def gripped(run: Run) -> np.ndarray:
    """Return which worms the end piece holds, (N,) bool: worms with a node that follows the end piece."""
    place, begin, distance = _lift(run)
    speed = run.scene["phases"][place]["speed_m_per_s"]
    moving = [frame for frame in run.frames if begin < frame.time < begin + distance / speed]
    one, other = moving[0], moving[-1]
    raised = other.segments - one.segments - [0.0, 0.0, speed * (other.time - one.time)]
    with_it = (np.abs(raised).max(axis=2) < EXACT).any(axis=1)
    return np.bincount(one.body[with_it], minlength=one.count) > 0


def _above(table: pd.DataFrame) -> list[Effect]:
    labels = {
        RISE: "rise of the quiet blob less that of the most active one",
        SHARE: "share lifted",
        OTHERS: "of those not gripped",
    }
    most, quiet = table[ACTIVE].max(), table[ACTIVE].min()
    others = table if most > quiet else table.iloc[:0]
    return [
        Effect(
            label=label,
            value=mean_over_seeds(paired_differences(others, name, ACTIVE, (most, quiet), [SEED])[name]),
            unit=unit_of(name),
        )
        for name, label in labels.items()
    ]


def height_around(run: Run, begin: float) -> History:
    """Read the height of the centre of mass [mm] from 1 s before `begin` [s] on; time 0 is `begin`."""
    own = run.series.time >= begin - 1.0
    return History(times=run.series.time[own] - begin, values=1e3 * run.series["com_height_m"][own])


def _history(run: Run) -> History:
    _, begin, _ = _lift(run)
    return height_around(run, begin)


STUDY = Study(
    name="blob-lift",
    title="A blob of worms on a stick",
    measure=measure,
    same_count=(),
    keys=(Key(column=ACTIVE, label="active", form="g", unit=" Hz"),),
    order=(ACTIVE, SEED),
    quantities=tuple(QUANTITIES.values()),
    findings=(
        mean(
            "as-a-whole",
            "A quiet blob is entangled tightly enough to be lifted as a whole",
            lambda quiet: quiet[SHARE],
            "share of worms of the quiet blob that are lifted",
            rows=lambda table: table[table[ACTIVE] == 0],
            threshold=WHOLE,
        ),
        Finding(
            id="quiet-above-active",
            says="A quiet blob is lifted farther than an active one, and more of its worms come along",
            outcome=_above,
        ),
        slope("falls", "The more active the blob, the fewer of its worms come along", SHARE, ACTIVE, sign=-1),
        mean(
            "left-behind",
            "An active blob is left behind by the end piece",
            lambda most: most[OTHERS],
            "share lifted of the worms of the most active blob that are not gripped",
            rows=lambda table: table[table[ACTIVE] == table[ACTIVE].max()],
            sign=-1,
            threshold=LEFT,
        ),
    ),
    figures=(
        Histories(
            name="height_time",
            history=_history,
            split=one_by_one(ACTIVE, "{:g} Hz".format),
            x_label="time since the lift began [s]",
            quantities={"": "height of the centre of mass [mm]"},
            marks=(3.0,),
            notes=["The end piece rises by 15 mm in 3 s (broken line), then stands."],
        ),
        Means(
            name="lifted_activity",
            quantities=[QUANTITIES[RISE], QUANTITIES[SHARE], QUANTITIES[OTHERS]],
            x=ACTIVE,
            x_label="frequency of the worms' turns [Hz]",
            split=lambda points: [Series(rows=points, label="", properties=marker("o", style.BLACK, style.BLACK))],
        ),
    ),
    remarks=(
        "Worms are filaments of 30 × 0.8 mm in water that bend into helices (250 1/m, wavelength 60 mm); 0 Hz: they "
        "hold the bends that they have. The paper's blobs have hundreds of living worms.",
    ),
    pictured={"active_hz": 0.0},
)
