"""Smarticles of l/w = 0.8 are poured into a mould of three tiers, narrower from tier to tier.

After an activity, or none, all walls are removed at once. The study measures which fraction of each tier is filled
before, and which part of it is still filled 1 s after. It compares them with Savoie, Tuazon, Bhamla and Goldman,
"Amorphous Entangled Active Matter", Soft Matter 2023, section "Casting". Procedures are compared seed by seed.
"""

import math
from functools import partial

import numpy as np
import pandas as pd

from dem.body.particle import mean_width
from dem.errors import InputError
from dem.record.run import Run
from postprocess.geometry.outline import BALL
from postprocess.measures.heights import heights
from postprocess.measures.mould import cast, read_tiers
from postprocess.statistics.points import SEED
from postprocess.statistics.seeds import mean_over_seeds
from studies.framework.figures import PROCEDURE_LABELS, Rows, by_procedure
from studies.framework.findings import Effect, Finding, Outcome, above, mean, means_by
from studies.framework.procedures import INTERNAL, PROCEDURE, SHAPE, STATIC, of_procedure
from studies.framework.release import ORDER, Pictures, named_columns, removal, removal_frames
from studies.framework.runs import Key, Row, declare, duration, last_columns
from studies.framework.study import Study

AFTER = 1.0  # s, time between the removal of the walls and the second measurement, as in the paper
# Share of a tier's volume inside the pile from which the tier counts as filled. The share is below 1 since the ball
# reaches between smarticles at the wall: poured piles in a plain cylinder of r = 1.2 w have 0.74 ± 0.02 (three seeds).
FULL = 0.7
LOST = 0.05  # share of the filled volume whose loss counts as falling apart

TIERS = ("lower", "middle", "upper")
FILLED, FILLED_AFTER, KEPT, MATERIAL, MATERIAL_AFTER = (
    {tier: f"{quantity} {tier} [-]" for tier in TIERS}
    for quantity in ("filled", "filled after", "kept", "material", "material after")
)
NECK, WHOLE = "material in the neck [-]", "filled whole [-]"
WHOLE_AFTER, WHOLE_KEPT = "filled whole after [-]", "kept whole [-]"
IN_MOULD, OVERLAP = "material in the mould after [-]", "overlap before and after [-]"
LIKENESS_BEFORE, LIKENESS = "likeness to the mould [-]", "likeness to the mould after [-]"
HEIGHT, CENTRE = "height of 95 % [m]", "com height over that before [-]"

_BY_TIER = (
    (FILLED, "filled {}", "share of the volume of the {} tier inside the pile before"),
    (FILLED_AFTER, "{} after", "share of the volume of the {} tier inside the pile after the walls went"),
    (KEPT, "kept {}", "of what was inside the pile in the {} tier, the share that still is"),
    (MATERIAL, "", "share of the pile's material in the {} tier before"),
    (MATERIAL_AFTER, "", "share of the pile's material in the {} tier after"),
)
QUANTITIES = declare(
    {
        **{
            column: (label.format(tier), ".3f", meaning.format(tier))
            for columns, label, meaning in _BY_TIER
            for tier, column in columns.items()
        },
        NECK: ("in the neck", ".3f", "share of the material above the mould, in the neck it came through, before"),
        WHOLE: ("whole", ".3f", "share of the volume of the whole mould inside the pile before"),
        WHOLE_AFTER: ("whole after", ".3f", "share of the volume of the whole mould inside the pile after"),
        WHOLE_KEPT: ("kept whole", ".3f", "of what was inside the pile in the mould, the share that still is"),
        IN_MOULD: ("", "", "share of the material where the mould was, after"),
        OVERLAP: ("overlap", ".3f", "volume common to the pile before and after over that of both together"),
        LIKENESS_BEFORE: ("likeness", ".3f", "volume common to pile and mould over that of both together, before"),
        LIKENESS: ("likeness after", ".3f", "volume common to pile and mould over that of both together, after"),
        HEIGHT: ("", "", "height below which 95 % of the material lies, before"),
        CENTRE: ("", "", "height of the centre of mass after, over that before"),
    }
)


def measure(run: Run) -> Row:
    """Measure how the pile fills the mould before the walls are removed and 1 s after; return the row."""
    tiers = read_tiers(run)
    if len(tiers) != len(TIERS) + 1:
        raise InputError(
            f"{run.path}: container.tiers must have {len(TIERS)} tiers and a neck, not {len(tiers)} entries; give runs "
            "of the study casting"
        )
    tiers = tiers[:-1]  # without the neck
    before, frames = removal_frames(run)
    start = removal(run).start_s or before.time
    after = frames[int(np.argmin(np.abs(frames.times - start - AFTER)))]
    one, other = (frame.vertices - np.array([0.0, 0.0, frame.floor_z]) for frame in (before, after))
    ball = BALL * run.manifest.middle_length_m
    width = mean_width(run.manifest.thickness_normal_m, run.manifest.thickness_in_plane_m)
    found = cast(one, other, tiers, thickness=width, ball=ball)
    volumes = np.array([tier.volume for tier in tiers])
    filled = found.filled_before * volumes
    # A filled volume smaller than the ball that separates inside from outside is not meaningful.
    kept = np.where(filled > 4 / 3 * math.pi * ball**3, found.kept, math.nan)
    row = named_columns(run)
    for k, tier in enumerate(TIERS):
        row |= {
            FILLED[tier]: found.filled_before[k],
            FILLED_AFTER[tier]: found.filled_after[k],
            KEPT[tier]: kept[k],
            MATERIAL[tier]: found.material_before[k],
            MATERIAL_AFTER[tier]: found.material_after[k],
        }
    levels = heights(one), heights(other)
    return row | {
        NECK: 1 - found.material_before.sum(),
        WHOLE: filled.sum() / volumes.sum(),
        WHOLE_AFTER: found.filled_after @ volumes / volumes.sum(),
        WHOLE_KEPT: np.nansum(found.kept * filled) / filled.sum(),
        IN_MOULD: found.material_after.sum(),
        OVERLAP: found.overlap,
        LIKENESS_BEFORE: found.likeness_before,
        LIKENESS: found.likeness,
        HEIGHT: levels[0].top,
        CENTRE: levels[1].mean_com / levels[0].mean_com,
        "time after [s]": after.time - start,
        "time without the wall [s]": duration(removal(run)),
        **last_columns(run),
    }


def _pour_fills(runs: pd.DataFrame) -> Outcome:
    part = of_procedure(runs, STATIC)
    effects = [
        Effect(label=f"filled as poured, {tier},", value=mean_over_seeds(part[column]), threshold=FULL)
        for tier, column in FILLED.items()
    ]
    return Outcome(effects=effects, note=f"in the neck: {means_by(part, NECK, PROCEDURE, '.3f')}")


FINDINGS = (
    Finding(id="pour-fills", says="The mould is filled by pouring (shown in a picture)", outcome=_pour_fills),
    # A denser pile sinks and leaves the upper tier empty, so only the lower tier shows how well the mould is filled.
    above(
        "internal-fills",
        "Internal oscillation fills the mould more completely, like a fluid",
        FILLED["lower"],
        INTERNAL,
        (STATIC, SHAPE),
        shown=(FILLED["lower"], WHOLE),
    ),
    above(
        "shape-change-fills-less",
        "Shape change grows inward and upward rather than outward: it does not fill the mould",
        {FILLED["lower"]: -1, HEIGHT: 1},
        SHAPE,
        (INTERNAL,),
        beside=(STATIC,),
    ),
    mean(
        "internal-falls-apart",
        "Internal oscillation: without the walls the overhangs fall apart",
        lambda runs: 1 - runs[WHOLE_KEPT],
        "lost of what was filled",
        rows=lambda runs: of_procedure(runs, INTERNAL),
        threshold=LOST,
        shown=[*KEPT.values()],
    ),
    above(
        "shape-change-keeps",
        "Shape change keeps its shape better, as a hardened structure",
        OVERLAP,
        SHAPE,
        (INTERNAL,),
        shown=(OVERLAP, WHOLE_KEPT),
    ),
    above(
        "internal-sculpts",
        "Internal oscillation sculpts to the mould more easily than shape change",
        LIKENESS_BEFORE,
        INTERNAL,
        (SHAPE,),
        shown=(LIKENESS_BEFORE, LIKENESS, IN_MOULD),
    ),
)

_LABELS = {name: PROCEDURE_LABELS[name] for name in (STATIC, INTERNAL, SHAPE)}
_TIERS = [*FILLED.values(), WHOLE, *FILLED_AFTER.values(), WHOLE_AFTER, *KEPT.values(), WHOLE_KEPT]
_rows = partial(Rows, row=lambda point: _LABELS[point[PROCEDURE]], split=by_procedure(_LABELS, line=False))

STUDY = Study(
    name="casting",
    title="Casts of smarticles",
    measure=measure,
    keys=(Key(column=PROCEDURE, label="procedure", order=ORDER),),
    quantities=tuple(QUANTITIES.values()),
    findings=FINDINGS,
    figures=(
        _rows(name="tiers", quantities=[QUANTITIES[name] for name in _TIERS], columns=4),
        _rows(
            name="overlap", quantities=[QUANTITIES[name] for name in (LIKENESS_BEFORE, LIKENESS, OVERLAP)], columns=3
        ),
        Pictures(labels=_LABELS, after=AFTER),
    ),
    order=(SEED, PROCEDURE),
    remarks=(
        f"Inside the pile is what a ball of radius {BALL:g} w that rolls around links and floor cannot reach. The "
        "paper gives no sizes of the tiers: radii of 2w, 1.6w and 1.2w, each w high, are assumed.",
    ),
    pictured={"procedure": INTERNAL},
)
