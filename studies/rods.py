"""Does a pile of rods without a wall keep its height where strong entanglement spans the pile?

Jung, Plumb-Reyes, Lin and Mahadevan (PNAS 2025, arXiv 2310.04903) find that longer rods entangle more, by the local
average crossing number, that regions of strong entanglement percolate as the aspect ratio grows, and that piles become
mechanically stable there. Here the wall is removed; a pile stands if its centre of mass keeps half of its height.

Spanning level: the largest threshold of the local average crossing number at which the region above it still joins
bottom and top of the pile. The paper's threshold was not available, so that one number cannot be tested against it. But
if percolation decides, then one threshold must serve piles of all preparations: the spanning level where piles begin to
stand must be equal in series that differ in number density or in friction.
"""

import math
from functools import partial

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.bars import body_centres
from postprocess.measures.crossing_number import average_crossing_numbers, crossing_field, region_spans
from postprocess.statistics.points import SEED
from postprocess.statistics.seeds import mean_over_seeds, slope_within
from postprocess.statistics.size_law import Profile, alike, profiles
from studies.framework.figures import Means, Scatter, one_by_one
from studies.framework.findings import Effect, Finding, Outcome, decide, means_by
from studies.framework.provenance import Reference
from studies.framework.runs import Key, Quantity, Row, declare, last_columns, run_columns
from studies.framework.study import COUNT, Study

SERIES, SLENDER = "series", "rod length over diameter [-]"
SHAKEN, POURED, SLIPPERY = "shaken", "poured", "slippery"
ORDER = (SHAKEN, POURED, SLIPPERY)
KEPT, HEIGHT = "com height kept [-]", "height over length [-]"
ACN, LEVEL, DENSITY = "crossing number per rod [-]", "spanning level [-]", "rods per cube of the length [-]"
CONTACTS = "contacts per rod [-]"

STANDS = 0.5  #: A pile stands if its centre of mass keeps more than this share of its height
LIKE = math.log(1.25)  #: Two levels count as equal if ln of their ratio is at most this in size
REJECTED = 0.05  #: Greatest p-value at which the hypothesis of equal levels is rejected
INNER = 0.7  #: Half the side of the square in which the field is computed, over the container's radius
PITCH = 0.25  #: Distance of the points of the field, over the length of a rod
BALL = 0.5  #: Radius of the balls of the field, over the length of a rod
STEEL = 0.3  #: Coefficient of friction above which a shaken pile belongs to the series `SHAKEN`
EDGE = 0.1  #: Share of the height that is left out at bottom and top, where balls are half empty

QUANTITIES = declare(
    {
        KEPT: ("kept", ".2f", "height of the centre of mass 1 s after the wall went, over that with the wall"),
        HEIGHT: ("height / L", ".2f", "height below which 95 % of the material lies, over the rods' length"),
        ACN: ("ACN per rod", ".1f", "average crossing number with all other rods"),
        LEVEL: (
            "spanning level",
            ".1f",
            "largest threshold of the local ACN whose region spans the height",
        ),
        DENSITY: ("n L³", ".1f", "number density of the rods times the cube of their length"),
        CONTACTS: ("contacts", ".2f", "rods that a rod touches, with the wall"),
    },
    axes={
        KEPT: "height kept [-]",
        ACN: "crossing number per rod [-]",
        LEVEL: "spanning level [-]",
        DENSITY: r"number density $n L^3$ [-]",
    },
)


def measure(run: Run) -> Row:
    """Measure entanglement with the wall and the height that is kept without it; return the run's row."""
    types = [phase.type for phase in run.phases]
    shaken = types == ["deposit", "shake", "relax", "remove-container"]
    if not shaken and types != ["deposit", "relax", "remove-container"]:
        raise InputError(f"{run.path}: its phases are {', '.join(types)}, not a pour, a rest, a removal; leave it out")
    rest, free = (run.frames.in_phase(run.phases[place].index) for place in (-2, -1))
    if not rest or not free:
        raise InputError(f"{run.path}: no frame of the rest or of the removal; run it again")
    walled, last = rest[-1], free[-1]
    length, radius = length_of(run), run.manifest.container_radius_m
    friction = float(run.scene["contact"]["friction_smarticle"])
    top = float(np.percentile(walled.segments[..., 2], 95)) - walled.floor_z
    height, after = (float(body_centres(frame)[:, 2].mean()) - frame.floor_z for frame in (walled, last))
    return {
        SERIES: (SHAKEN if friction > STEEL else SLIPPERY) if shaken else POURED,
        SLENDER: round(length / run.manifest.sphere_diameter_m, 6),
        **{name: value for name, value in run_columns(run).items() if name in (SEED, COUNT, "fidelity")},
        KEPT: after / height,
        HEIGHT: top / length,
        ACN: average_crossing_numbers(walled.segments, walled.body).mean,
        LEVEL: spanning_level(local_crossings(walled, length=length, radius=radius, top=top)),
        DENSITY: run.manifest.count * length**3 / (math.pi * radius**2 * top),
        CONTACTS: float(walled.contacts.mean()),
        **last_columns(run),
    }


def length_of(run: Run) -> float:
    """Return the length of a run's rods [m]; InputError unless all bodies are rods of one kind."""
    shapes = run.scene.get("particle") or []
    if [shape.get("shape") for shape in shapes] != ["rod"]:
        raise InputError(f"{run.path}: its bodies are not rods of one kind; leave it out")
    return float(shapes[0]["length_m"])


def local_crossings(frame: Frame, *, length: float, radius: float, top: float) -> NDArray[np.float64]:
    """Return the local average crossing number (X, Y, Z) [-] at the points of a grid inside a pile.

    The grid is a box around the container's axis; its size and pitch are `INNER`, `EDGE` and `PITCH`. The length of a
    rod, the radius of the container and the height of the pile's top above the floor are in [m].
    """
    side = 2 * INNER * radius
    across, up = (max(2, round(span / (PITCH * length)) + 1) for span in (side, (1 - 2 * EDGE) * top))
    level = np.linspace(-side / 2, side / 2, across)
    heights = frame.floor_z + np.linspace(EDGE * top, (1 - EDGE) * top, up)
    points = np.stack(np.meshgrid(level, level, heights, indexing="ij"), axis=-1)
    return crossing_field(frame.segments, frame.body, points, radius=BALL * length)


def spanning_level(field: NDArray[np.float64]) -> float:
    """Return the largest threshold at which the region of larger or equal values joins bottom and top.

    `field` is the local average crossing number (X, Y, Z) [-]; the result is 0 if there is no such threshold.
    """
    falling = np.unique(field)[::-1]
    return next((float(value) for value in falling if region_spans(field >= value, 2)), 0.0)


def thresholds(runs: pd.DataFrame, column: str) -> dict[str, Profile]:
    """Compute the profile likelihood of the threshold of ln(`column`) above which piles stand, by series.

    A series is `SHAKEN`, `POURED` or `SLIPPERY`. Runs without a value above 0 in the column are left out.
    """
    own = runs[(runs[column] > 0) & np.isfinite(runs[column])]
    if own.empty:
        return {}
    names = list(dict.fromkeys(own[SERIES]))
    standing = (own[KEPT] > STANDS).to_numpy(dtype=np.float64)
    found = profiles(np.log(own[column].to_numpy(dtype=np.float64)), standing, own[SERIES].map(names.index).to_numpy())
    return {names[number]: one for number, one in found.items()}


def onsets(runs: pd.DataFrame) -> pd.DataFrame:
    """Tabulate the threshold at which half of the piles stand, with its 95 % interval.

    The table has a row per series (`SHAKEN`, `POURED` or `SLIPPERY`) and column (`SLENDER`, `LEVEL` or `DENSITY`).
    """
    rows = []
    for column in (SLENDER, LEVEL, DENSITY):
        for series, one in thresholds(runs, column).items():
            low, high = one.interval
            numbers = (math.exp(value) for value in (one.best, low, high))
            rows.append((series, column, one.runs, one.having, *numbers))
    names = ["runs [-]", "standing [-]", "half of piles stand at [-]", "from [-]", "to [-]"]
    return pd.DataFrame(rows, columns=[SERIES, "against", *names])


def crossing_number_rises(table: pd.DataFrame) -> Outcome:
    """Judge whether the average crossing number per rod rises with the aspect ratio in every series."""
    effects = []
    for series, rows in table.groupby(SERIES, sort=False):
        slope = slope_within(np.log(rows[SLENDER]).tolist(), np.log(rows[ACN]).tolist(), ["all"] * len(rows))
        effects.append(Effect(label=f"{series}: power of the aspect ratio", value=slope))
    shaken = table[table[SERIES] == SHAKEN]
    return Outcome(effects=effects, note=f"shaken, by aspect ratio: {means_by(shaken, ACN, SLENDER, '.3g')}")


def stands_from(table: pd.DataFrame) -> Outcome:
    """Judge whether shaken piles of the thickest rods fall, and of the thinnest rods stand."""
    own = table[table[SERIES] == SHAKEN]
    effects = [
        Effect(
            label=f"height kept at aspect ratio {ratio:g}",
            value=mean_over_seeds(own.loc[own[SLENDER] == ratio, KEPT].tolist()),
            sign=sign,
            threshold=STANDS,
        )
        for ratio, sign in ((own[SLENDER].min(), -1), (own[SLENDER].max(), 1))
    ]
    return Outcome(effects=effects, note=f"by aspect ratio: {means_by(own, KEPT, SLENDER, '.2f')}")


def ratio_of(runs: pd.DataFrame, column: str, one: str, other: str) -> tuple[float, float, float]:
    """Compare the thresholds of the series `one` and `other` in a column, see `thresholds`.

    Returns ln(threshold of `one` / threshold of `other`), its 95 % half-width, and the p-value of equal thresholds. The
    half-width is the root of the sum of the squared half-widths of both. All are NaN if one threshold is unknown.
    """
    found = thresholds(runs, column)
    if not {one, other} <= set(found) or not (found[one].known and found[other].known):
        return math.nan, math.nan, math.nan
    halves = [max(part.best - part.interval[0], part.interval[1] - part.best) for part in (found[one], found[other])]
    return found[one].best - found[other].best, math.hypot(*halves), alike([found[one], found[other]])


def one_level(runs: pd.DataFrame, *, other: str) -> Outcome:
    """Judge whether piles of another series begin to stand at the same spanning level as shaken piles.

    `other` is `POURED` or `SLIPPERY`.
    """
    ratios = {column: ratio_of(runs, column, other, SHAKEN) for column in (LEVEL, SLENDER, DENSITY)}
    cells = []
    for column, (value, half, chance) in ratios.items():
        low, middle, high = (math.exp(value + part) for part in (-half, 0.0, half))
        name = column.partition(" [")[0]
        cells.append(f"{name}: {middle:.3g} ({low:.3g} to {high:.3g} at 95 %; alike: p = {chance:.2g})")
    value, half, chance = ratios[LEVEL]
    levels = ", ".join(f"{series} {math.exp(one.best):.3g}" for series, one in thresholds(runs, LEVEL).items())
    note = f"at the onset, {other} over {SHAKEN}: {'; '.join(cells)}; spanning levels: {levels}"
    verdict = decide(abs(value) + half <= LIKE, chance < REJECTED, data=not math.isnan(value))
    return Outcome(note=note, verdict=verdict)


SAME_LEVEL = (
    f"the ratio of the spanning levels above which half of the piles stand is within a factor of {math.exp(LIKE):.3g} "
    f"at 95 %; not found if one level for both series is rejected, p < {REJECTED:g}"
)

FINDINGS = (
    Finding(
        id="crossing-number-rises",
        says="Entanglement grows with the aspect ratio",
        outcome=crossing_number_rises,
        found_if="the average crossing number per rod rises with the aspect ratio in every series",
    ),
    Finding(
        id="stands-from",
        says="Piles become mechanically stable as the aspect ratio grows",
        outcome=stands_from,
        found_if=f"without the wall the thickest rods keep less than {STANDS:g} of the height, the thinnest more",
    ),
    Finding(
        id="one-level-poured",
        says="The mechanical onset coincides with the percolation of strong entanglement: poured and shaken piles, of "
        "other number densities, begin to stand at one spanning level",
        outcome=partial(one_level, other=POURED),
        found_if=SAME_LEVEL,
    ),
    Finding(
        id="one-level-slippery",
        says="(ours) Piles of half the friction begin to stand at the same spanning level",
        outcome=partial(one_level, other=SLIPPERY),
        found_if=SAME_LEVEL,
    ),
)

_BY_SERIES = one_by_one(SERIES, str, last=0.75)

FIGURES = (
    Means(
        name="onset",
        quantities=[QUANTITIES[name] for name in (KEPT, ACN, LEVEL, DENSITY)],
        x=SLENDER,
        x_label="aspect ratio of the rods [-]",
        split=_BY_SERIES,
    ),
    Scatter(
        name="kept",
        xs=[QUANTITIES[LEVEL], QUANTITIES[DENSITY], Quantity(column=SLENDER, axis="aspect ratio of the rods [-]")],
        y=QUANTITIES[KEPT],
        split=_BY_SERIES,
        means=False,
    ),
)

STUDY = Study(
    name="rods",
    title="Rods without a wall, against the findings of Jung, Plumb-Reyes, Lin and Mahadevan",
    measure=measure,
    keys=(
        Key(column=SERIES, label="series", order=ORDER),
        Key(column=SLENDER, label="L/d", form="g"),
    ),
    quantities=tuple(QUANTITIES.values()),
    findings=FINDINGS,
    figures=FIGURES,
    extra=lambda runs: {"onsets": onsets(runs)},
    same_count=(SLENDER,),
    order=(SERIES, SLENDER, SEED),
    one_engine=True,
    remarks=(
        f"Local average crossing number: of all parts of rods in a ball of radius {BALL:g} L, prefactor 1/4π, at "
        f"points {PITCH:g} L apart in the inside of the pile with the wall. Onset: half of the piles keep more than "
        f"{STANDS:g} of the height; logistic fits in the logarithm, intervals by profile likelihood.",
    ),
    reference=Reference(
        statement="abstract of Jung, Plumb-Reyes, Lin and Mahadevan, PNAS 2025, arXiv 2310.04903; no data of theirs",
        facts={"doi": "10.1073/pnas.2401868122", "arxiv": "2310.04903", "what": "statements in the abstract"},
    ),
    pictured={"series": "shaken", "aspect": 32},
)
