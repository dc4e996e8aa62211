"""What the studies of sensitivity measure of a run, and what each variant changes against the first one."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import pandas as pd

from dem.record.manifest import RunManifest
from postprocess.statistics.points import marked, seeds_of
from postprocess.statistics.seeds import mean_over_seeds, relative_difference
from studies.base.shaken import measured_row
from studies.base.variants import VARIANT, variant_of
from studies.framework.runs import DEFINITION, Row

COMPARED: Mapping[str, str] = MappingProxyType(
    {
        "phi_0": f"phi_0 {DEFINITION}",
        "phi_f": f"phi_f {DEFINITION}",
        "crossings after": "crossings after",
    }
)
"""What is compared with the baseline: its name here, and its column in the table of runs less the unit."""


def sensitivity_row(run: RunManifest) -> Row:
    """One run's row of the table of runs.

    Args:
        run: A finished run, named `VARIANT_seedN`.

    Raises:
        InputError: It is named otherwise, was not shaken after another phase, or cannot be read.
    """
    return {VARIANT: variant_of(run), **measured_row(run, [DEFINITION])}


def summarise_variants(runs: pd.DataFrame, variants: Sequence[str]) -> pd.DataFrame:
    """One row per variant: means over seeds, and changes against the first variant.

    Args:
        runs: Rows of `sensitivity_row`.
        variants: In the order wanted; one without runs has NaN.

    Returns:
        The table; `… 95 % [-]` are half-widths, `… change [%]` and its half-width `… change 95 %
        [%]` are relative to the baseline's mean, `… clear` says whether the change is beyond it.
    """
    groups = {variant: runs[runs[VARIANT] == variant] for variant in variants}
    rows = []
    for variant, group in groups.items():
        row: dict[str, object] = {VARIANT: variant, **seeds_of(group)}
        for name, quantity in COMPARED.items():
            column = f"{quantity} [-]"
            mean, baseline = mean_over_seeds(group[column]), mean_over_seeds(groups[variants[0]][column])
            row[column] = mean.value
            row[marked(column, "95 %")] = mean.half_width
            change = None if variant == variants[0] else relative_difference(mean, baseline)
            row[f"{name} change [%]"] = change.value if change else math.nan
            row[f"{name} change 95 % [%]"] = change.half_width if change else math.nan
            row[f"{name} clear"] = bool(change and change.clear)
        rows.append(row)
    return pd.DataFrame(rows)
