"""The study of Gravish's packing: each finding from tables that deserve each verdict, and runs of known packing."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
import pytest

from postprocess.statistics.points import ASPECT, SEED
from studies.framework.shaken import phi, read_gravish
from studies.gravish import STUDY, deviations, steps

SPREAD = {1: -0.002, 2: 0.0, 3: 0.002}


def runs_of(levels: Mapping[float, tuple[float, float]], spread: Mapping[int, float] = SPREAD) -> pd.DataFrame:
    """Make a table of runs: φ_0 and φ_f of each aspect ratio, shifted by a spread over seeds."""
    rows = [
        {ASPECT: aspect, SEED: seed, phi("phi_0"): before + shift, phi("phi_f"): after + shift / 10}
        for aspect, (before, after) in levels.items()
        for seed, shift in spread.items()
    ]
    return pd.DataFrame(rows).assign(**{phi("phi_f relaxed"): np.nan})


def verdict(name: str, levels: Mapping[float, tuple[float, float]], spread: Mapping[int, float] = SPREAD) -> str:
    return str(next(one for one in STUDY.findings if one.id == name).judge(runs_of(levels, spread)).verdict)


def test_gravish_is_never_interpolated() -> None:
    reference = read_gravish().set_index("l_over_w")
    assert reference.loc[0.7].tolist() == [0.105, 0.130]
    found = deviations(runs_of({0.5: (0.125, 0.15), 0.65: (0.11, 0.13), 0.7: (0.1155, 0.117)}))
    assert found[["stage", ASPECT]].to_numpy().tolist() == [["phi_0", 0.7], ["phi_f", 0.5], ["phi_f", 0.7]]
    assert found["deviation [%]"].tolist() == pytest.approx([10.0, 100 * (0.15 / 0.148 - 1), -10.0])


def test_a_fall_is_monotone_unless_a_step_clearly_rises() -> None:
    clear = {0.4: (0.14, 0.16), 0.5: (0.12, 0.14), 0.6: (0.10, 0.12)}
    assert verdict("phi-0-falls", clear) == "found"
    assert steps(runs_of(clear)).query("stage == 'phi_0'")["phi"].tolist() == ["falls", "falls"]
    assert verdict("phi-0-falls", {**clear, 0.6: (0.122, 0.12)}) == "found"  # rises within the error bars
    assert verdict("phi-0-falls", {**clear, 0.5: (0.10, 0.14), 0.6: (0.12, 0.12)}) == "not found"
    assert verdict("phi-0-falls", {0.4: (0.14, 0.16), 0.5: (0.139, 0.14)}) == "not resolved"  # flat
    assert verdict("phi-0-falls", clear, {1: 0.0}) == "not resolved"  # one seed
