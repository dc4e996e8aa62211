"""Gravish's Δ of collapsing columns, digitised; see `reference/README.md`. Compared at equal l/w only."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from importlib.resources import files
from types import MappingProxyType

import numpy as np
import pandas as pd

from studies.framework.provenance import Reference, told_gaps

_FILE = files("postprocess") / "reference" / "gravish2012_collapse.csv"

ACCELERATIONS = (1.23, 2.5)
"""Least and greatest Γ at which Gravish et al. saw columns collapse [-]."""

COLLAPSE = Reference(
    statement="Δ of Gravish et al., PRL 108, 208001 (2012), digitised; Γ = 1.23 to 2.5, errors unknown",
    facts=MappingProxyType({"file": _FILE.name, "sha256": hashlib.sha256(_FILE.read_bytes()).hexdigest()}),
)


def read_collapse_reference() -> pd.DataFrame:
    """Gravish's digitised points: columns `l_over_w` [-] and `delta` [-]."""
    with _FILE.open(encoding="utf-8") as file:
        return pd.read_csv(file)


def reference_delta(aspect: float) -> float:
    """Gravish's Δ [-] at exactly this aspect ratio [-], or NaN."""
    reference = read_collapse_reference()
    same = np.isclose(reference["l_over_w"], aspect, rtol=0, atol=1e-6)
    return float(reference.loc[same, "delta"].iloc[0]) if same.any() else math.nan


def told_points(aspects: Sequence[float]) -> str:
    """What Gravish's Δ are, and at which of these l/w [-] there is none, for figures."""
    gaps = told_gaps({"Δ": [aspect for aspect in aspects if math.isnan(reference_delta(aspect))]})
    return f"{COLLAPSE.statement}; {gaps}."
