"""How much φ scatters from seed to seed, relative to its mean: pooled over all points of a stage."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import pandas as pd
from scipy.special import stdtrit

from postprocess.statistics.columns import ASPECT
from postprocess.statistics.seeds import CONFIDENCE, Scatter, pooled_scatter
from studies.friction.measure import COMPARED, FRICTION, column

AT_THE_PAPERS: Mapping[str, Scatter] = MappingProxyType(
    {
        "phi_0": Scatter(value=0.0423, freedom=16),
        "phi_f": Scatter(value=0.0307, freedom=16),
        "phi_f relaxed": Scatter(value=0.0370, freedom=16),
    }
)
"""Relative standard deviation of the 24 runs of `results/gravish-links/runs.csv`, three seeds at each of eight aspect
ratios: the same scenes at μ = 0.4, run before. Few seeds of our own are judged with them together."""


def scatters(runs: pd.DataFrame, known: Mapping[str, Scatter]) -> dict[str, Scatter]:
    """The relative scatter of each stage, that which is known beforehand pooled with that of the runs.

    Args:
        runs: Rows of `measure.friction_row`.
        known: By stage; φ in the course of shaking is taken to scatter as at its end.

    Returns:
        By stage; without a degree of freedom where no point has two seeds and nothing is known.
    """
    found = {}
    for stage, ended in COMPARED.items():
        name = column(stage)
        if name not in runs.columns:
            continue
        groups = [group[name].dropna() for _, group in runs.groupby([ASPECT, FRICTION])]
        own = pooled_scatter([(group / group.mean()).tolist() for group in groups])
        found[stage] = _joined(own, known.get(ended, Scatter(value=math.nan, freedom=0)))
    return found


def _joined(one: Scatter, other: Scatter) -> Scatter:
    """Two estimates of the same scatter as one."""
    freedom = one.freedom + other.freedom
    squares = sum(part.freedom * part.value**2 for part in (one, other) if part.freedom)
    return Scatter(value=math.sqrt(squares / freedom) if freedom else math.nan, freedom=freedom)


def half_widths_of(scatter: Scatter) -> float:
    """Half-width of the 95 % interval over its standard error, by Student's t; NaN without a degree of freedom."""
    return float(stdtrit(scatter.freedom, (1 + CONFIDENCE) / 2)) if scatter.freedom else math.nan
