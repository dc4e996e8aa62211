"""Whether the engines agree: margins chosen beforehand, differences with their errors, verdicts.

Two engines are equivalent in a quantity where the 95 % confidence interval of the relative difference lies within the
margin, different where it lies beyond it, and otherwise not resolved: a difference that is not significant proves
nothing. (Two one-sided tests at 5 % would take the 90 % interval; ours is the stricter.)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import pandas as pd

from postprocess.statistics.columns import SEED
from postprocess.statistics.points import mean_columns
from postprocess.statistics.seeds import difference, mean_over_seeds
from studies.engines.measure import (
    ACTIVE,
    CASE,
    CHAIN,
    COLLAPSE,
    CROSSINGS_0,
    FORCE,
    HOOK,
    PEAK,
    PHI_0,
    TAU,
    VARIANT,
)
from studies.framework.activity import ENERGY, HEIGHT, PHI_ACTIVE
from studies.framework.procedures import CROSSINGS, EXTERNAL, INTERNAL, PHI, SHAPE

LINKS, YADE = "links", "yade"
Verdict = Literal["equivalent", "different", "not resolved", "no data"]

CRITERION = (
    "Equivalent: the 95 % interval (Student's t, paired by seed) of the difference lies within the margin, which was "
    "chosen before the first run; different: it lies beyond the margin; else not resolved"
)
"""How verdicts come about, for footers."""

_PHI_WHY = "half of the 10 % within which the study gravish calls φ near Gravish's"
_CROSSINGS_WHY = "⟨N⟩ of procedures differ by tens of per cent; it is a count of few"
_ENERGY_WHY = "the paper compares energies by factors, and the account closes within 1 %"


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A quantity that both engines give.

    Attributes:
        told: What it is called.
        cases: The cases whose runs tell it; several where all begin with the same pile: a seed's mean counts once.
        column: Of the table of runs.
        margin: By how much the engines may differ, in per cent of YADE's mean; chosen beforehand.
        why: Why that much.
    """

    told: str
    cases: tuple[str, ...]
    column: str
    margin: float
    why: str


def _of_procedures() -> list[Quantity]:
    rows = []
    for case in (EXTERNAL, SHAPE, INTERNAL):
        for told, column, margin, why in (
            ("φ_f in motion", PHI_ACTIVE, 5.0, _PHI_WHY),
            ("φ_f at rest", PHI, 5.0, _PHI_WHY),
            ("⟨N⟩", CROSSINGS, 10.0, _CROSSINGS_WHY),
            ("h/h0", HEIGHT, 5.0, "as for φ, which goes as 1/h"),
            ("energy", ENERGY, 10.0, _ENERGY_WHY),
        ):
            rows.append(Quantity(told=f"{told}, {case}", cases=(case,), column=column, margin=margin, why=why))
    return rows


QUANTITIES: tuple[Quantity, ...] = (
    Quantity(told="φ_0", cases=ACTIVE, column=PHI_0, margin=5.0, why=_PHI_WHY),
    Quantity(told="⟨N⟩ as poured", cases=ACTIVE, column=CROSSINGS_0, margin=10.0, why=_CROSSINGS_WHY),
    *_of_procedures(),
    Quantity(
        told="hook force",
        cases=(HOOK,),
        column=PEAK,
        margin=20.0,
        why="a largest value, which scatters by a third between seeds; the paper's procedures differ by factors",
    ),
    Quantity(
        told="collapse time",
        cases=(COLLAPSE,),
        column=TAU,
        margin=30.0,
        why="τ = exp(Δ/Γ)/f: at Γ = 2.5, 30 % of τ are 0.66 of Δ, 5 % of Gravish's 15",
    ),
    Quantity(
        told="chain force",
        cases=(CHAIN,),
        column=FORCE,
        margin=10.0,
        why="the servos of a chain differ from each other by 10 %",
    ),
)
"""What is compared, in the order of tables and figures."""


@dataclass(frozen=True, kw_only=True)
class Equivalence:
    """One quantity, judged.

    Attributes:
        quantity: What.
        pairs: Seeds that both engines have.
        links: Mean of links over them.
        yade: Mean of YADE.
        percent: Links less YADE, in per cent of YADE's mean.
        half_width: Of its 95 % interval, paired by seed [%].
        unpaired: The same if the two were independent, by Welch [%].
        verdict: By `CRITERION`.
    """

    quantity: Quantity
    pairs: int
    links: float
    yade: float
    percent: float
    half_width: float
    unpaired: float
    verdict: Verdict

    @property
    def told(self) -> str:
        """`φ_0: +1.2 ± 2.0 % …`: one line."""
        if not self.pairs:
            return f"{self.quantity.told}: no pair of runs"
        error = f" ± {self.half_width:.1f}" if math.isfinite(self.half_width) else ""
        numbers = f"{self.percent:+.1f}{error} % ({self.pairs} pairs, margin {self.quantity.margin:g} %)"
        clear = abs(self.percent) > self.half_width and self.verdict != "different"
        return f"{self.quantity.told}: {numbers}{', clear of 0' if clear else ''}"


def verdict_of(percent: float, half_width: float, margin: float) -> Verdict:
    """The verdict on a difference [%] with its 95 % half-width [%] against a margin [%]."""
    if math.isnan(percent):
        return "no data"
    if math.isnan(half_width):
        return "not resolved"
    if abs(percent) + half_width <= margin:
        return "equivalent"
    return "different" if abs(percent) - half_width > margin else "not resolved"


def by_seed(runs: pd.DataFrame, quantity: Quantity, variant: str) -> pd.Series:
    """Values of a quantity by seed, the mean over cases that begin alike; seeds without one are left out."""
    chosen = runs[(runs[VARIANT] == variant) & runs[CASE].isin(quantity.cases)]
    means: pd.Series = chosen.groupby(SEED)[quantity.column].mean().dropna()
    return means


def judged(runs: pd.DataFrame) -> tuple[Equivalence, ...]:
    """All quantities that a run of either engine tells, judged."""
    found = []
    for quantity in QUANTITIES:
        links, yade = (by_seed(runs, quantity, variant) for variant in (LINKS, YADE))
        if links.empty and yade.empty:
            continue
        found.append(_judge(quantity, links, yade))
    return tuple(found)


def _judge(quantity: Quantity, links: pd.Series, yade: pd.Series) -> Equivalence:
    seeds = links.index.intersection(yade.index)
    links, yade = links[seeds], yade[seeds]
    effect = mean_over_seeds((links - yade).to_numpy())
    base = float(yade.mean()) if len(seeds) else math.nan
    scale = 100 / abs(base) if base else math.nan
    apart = difference(mean_over_seeds(links.to_numpy()), mean_over_seeds(yade.to_numpy()))
    percent, half_width = scale * effect.value, scale * effect.half_width
    return Equivalence(
        quantity=quantity,
        pairs=len(seeds),
        links=float(links.mean()) if len(seeds) else math.nan,
        yade=base,
        percent=percent,
        half_width=half_width,
        unpaired=scale * apart.half_width,
        verdict=verdict_of(percent, half_width, quantity.margin),
    )


def equivalence_table(found: Sequence[Equivalence]) -> pd.DataFrame:
    """One row per quantity."""
    return pd.DataFrame(
        [
            {
                "quantity": one.quantity.told,
                "pairs [-]": one.pairs,
                "links": one.links,
                "yade": one.yade,
                "difference [%]": one.percent,
                "difference 95 % [%]": one.half_width,
                "difference 95 % unpaired [%]": one.unpaired,
                "margin [%]": one.quantity.margin,
                "verdict": one.verdict,
                "why this margin": one.quantity.why,
            }
            for one in found
        ]
    )


PITCH = "pitch [-]"
REFINED: tuple[Quantity, ...] = tuple(
    quantity
    for quantity in QUANTITIES
    if quantity.told in ("φ_0", "⟨N⟩ as poured")
    or (quantity.cases == (EXTERNAL,) and quantity.column in (PHI_ACTIVE, PHI, CROSSINGS))
)
"""What is followed to ever finer chains."""


def pitch_of(variant: str) -> float:
    """The pitch that a variant stands for [-]: links are the limit 0, YADE as it is 1; NaN for what is neither."""
    if variant in (LINKS, YADE):
        return 0.0 if variant == LINKS else 1.0
    return float(variant.removeprefix("pitch-")) if variant.startswith("pitch-") else math.nan


def refinement(runs: pd.DataFrame) -> pd.DataFrame:
    """Means of the shaken pile by pitch of YADE's spheres, links as pitch 0: one row per quantity and pitch.

    Only the shaken runs count, so that every pitch has the same ones. Differences are those to links, paired by seed.
    """
    shaken = runs[runs[CASE] == EXTERNAL]
    rows: list[dict[str, object]] = []
    for quantity in REFINED:
        limit = by_seed(shaken, quantity, LINKS)
        for variant in sorted(set(shaken[VARIANT]), key=pitch_of):
            values = by_seed(shaken, quantity, str(variant))
            less = [] if variant == LINKS else (values - limit).dropna().tolist()
            effect = mean_over_seeds(less)
            base = float(limit.mean()) if len(limit) else math.nan
            scale = 100 / abs(base) if base else math.nan
            rows.append(
                {
                    "quantity": quantity.told,
                    VARIANT: variant,
                    PITCH: pitch_of(str(variant)),
                    "seeds [-]": len(values),
                    **mean_columns("mean [-]", mean_over_seeds(values.to_numpy())),
                    "less links [%]": scale * effect.value,
                    "less links 95 % [%]": scale * effect.half_width,
                }
            )
    return pd.DataFrame(rows)
