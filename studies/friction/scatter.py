"""How much φ scatters from seed to seed, relative to its mean: pooled over all points of a stage."""

from __future__ import annotations

import math

import pandas as pd
from scipy.special import stdtrit

from postprocess.statistics.columns import ASPECT
from postprocess.statistics.seeds import CONFIDENCE, Scatter, pooled_scatter
from studies.friction.measure import COMPARED, FRICTION, column


def scatters(runs: pd.DataFrame) -> dict[str, Scatter]:
    """The relative scatter of each stage.

    Args:
        runs: Rows of `measure.friction_run`.

    Returns:
        By stage; without a degree of freedom where no point has two seeds.
    """
    found = {}
    for name in (stage for stage in COMPARED if column(stage) in runs.columns):
        groups = [group[column(name)].dropna() for _, group in runs.groupby([ASPECT, FRICTION])]
        found[name] = pooled_scatter([(group / group.mean()).tolist() for group in groups])
    return found


def half_widths_of(scatter: Scatter) -> float:
    """Half-width of the 95 % interval over its standard error, by Student's t; NaN without a degree of freedom."""
    return float(stdtrit(scatter.freedom, (1 + CONFIDENCE) / 2)) if scatter.freedom else math.nan
