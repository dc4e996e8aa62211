"""The paper's findings on its procedures, each judged by our own runs.

A finding is a difference, a slope or a ratio with a 95 % confidence interval by Student's t. Runs of the same
aspect ratio and seed begin with the same pile, so they are compared pair by pair, and slopes against θ are
taken within them; the scatter over seeds and aspect ratios is what makes the error.
"""

from __future__ import annotations

import pandas as pd

from postprocess.statistics.findings import Finding
from studies.procedures import energies, entanglement, packing


def findings(table: pd.DataFrame) -> tuple[Finding, ...]:
    """All findings in the paper's order, judged.

    Args:
        table: See `activity.samples`.
    """
    return tuple(judge(table) for judge in (*packing.JUDGES, *energies.JUDGES, *entanglement.JUDGES))
