"""What studies are compared with: the text of Savoie et al., and Gravish's packing fractions, digitised.

Gravish, Franklin, Hu and Goldman, "Entangled granular media", Phys. Rev. Lett. 108, 208001 (2012): of staples before
and after shaking; see `reference/README.md`. They are compared at equal l/w only and never interpolated.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from types import MappingProxyType

import numpy as np
import pandas as pd

CITATION = "Gravish et al., PRL 108, 208001 (2012), digitised"

DIGITISING_ERROR = 0.003
"""Taken as the error of each of Gravish's points [-]."""

SHAKE_TIME = 20.0
"""How long Gravish et al. shook [s]."""

REFERENCE = files("postprocess") / "reference" / "gravish2012_phi.csv"
"""Gravish's digitised points."""

COLUMNS: Mapping[str, str] = MappingProxyType(
    {"phi_0": "phi_initial", "phi_f": "phi_final", "phi_f relaxed": "phi_final"}
)
"""The column that each stage is compared with, see `shaken.STAGES`."""


@dataclass(frozen=True, kw_only=True)
class Reference:
    """What a study is compared with.

    Attributes:
        statement: Names it, for footers; without a full stop.
        facts: The same for `provenance.json`.
    """

    statement: str
    facts: Mapping[str, object]


GRAVISH = Reference(
    statement=f"{CITATION}; error of reading taken as ±{DIGITISING_ERROR:g}",
    facts=MappingProxyType(
        {
            "file": REFERENCE.name,
            "sha256": hashlib.sha256(REFERENCE.read_bytes()).hexdigest(),
            "digitising_error": DIGITISING_ERROR,
        }
    ),
)

SAVOIE = Reference(
    statement="statements in the text of Savoie et al., Soft Matter 2023, DOI 10.1039/d2sm01573k; no data of theirs",
    facts=MappingProxyType({"doi": "10.1039/d2sm01573k", "what": "statements in the text"}),
)


NOTHING = Reference(
    statement="none; nobody has published these numbers", facts=MappingProxyType({"what": "our own runs alone"})
)
"""Of a study that there is nothing to compare with."""

_SYMBOLS: Mapping[str, str] = MappingProxyType({"phi_0": "φ_0", "phi_f": "φ_f"})


def read_reference() -> pd.DataFrame:
    """Gravish's digitised points: columns `l_over_w`, `phi_initial`, `phi_final`.

    Returns:
        The table; NaN where there is no point.
    """
    with REFERENCE.open(encoding="utf-8") as file:
        return pd.read_csv(file)


def reference_at(reference: pd.DataFrame, aspect: float, stage: str) -> float:
    """Gravish's value at exactly this aspect ratio, or NaN.

    Args:
        reference: See `read_reference`.
        aspect: l/w [-].
        stage: Key of `COLUMNS`.
    """
    same = np.isclose(reference["l_over_w"], aspect, rtol=0, atol=1e-6)
    return float(reference.loc[same, COLUMNS[stage]].iloc[0]) if same.any() else math.nan


def told_reference(aspects: Sequence[float], stages: Iterable[str]) -> str:
    """What Gravish's points are, and which there are none of, for figures that show them.

    Args:
        aspects: The l/w of a figure [-].
        stages: Keys of `COLUMNS`.
    """
    reference = read_reference()
    lacking = {
        stage: [aspect for aspect in aspects if math.isnan(reference_at(reference, aspect, stage))] for stage in stages
    }
    gaps = told_gaps({_SYMBOLS[stage]: without for stage, without in lacking.items()})
    return f"{CITATION}, read to ±{DIGITISING_ERROR:g}; {gaps}."


def told_gaps(lacking: Mapping[str, Sequence[float]]) -> str:
    """`no φ_0 at l/w = 0.5, 0.8; no φ_f at l/w = 0.85`: which points were never digitised.

    Args:
        lacking: The l/w [-] of each quantity that has no point there.
    """
    known = {name: ", ".join(f"{aspect:g}" for aspect in without) for name, without in lacking.items()}
    return "; ".join(f"no {name} at l/w = {told}" for name, told in known.items() if told) or "at every l/w shown"
