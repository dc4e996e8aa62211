"""The study of shafts: which runs each finding is judged by, for a made-up table."""

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
import pytest

from postprocess.statistics.points import ASPECT, SEED
from postprocess.statistics.seeds import SeedMean
from studies.framework.findings import Outcome
from studies.framework.procedures import CROSSINGS, ENERGY, HEIGHT, INTERNAL, PROCEDURE, SHAPE, THETA
from studies.shaft import CONTACT, DECADES, SHAFT, STUDY

SLOPE = 0.5  # of ⟨N⟩ after a shape change, per decade of the shaft's stiffness


def table(shafts: Sequence[float] = (3e-3, 0.03, 0.3, 3.0)) -> pd.DataFrame:
    """Rows of runs; those with stiff contacts contradict all findings but the last."""
    generator, rows = np.random.default_rng(5), []
    for shaft, contact in [*((shaft, 500.0) for shaft in shafts), (shafts[-1], 4000.0)]:
        for aspect in (0.4, 0.7, 1.0):
            for seed in range(1, 7):
                away, stiff = 1 + 0.01 * generator.standard_normal(2), contact > 500
                whole = {SHAFT: shaft, CONTACT: contact, ASPECT: aspect, SEED: seed, DECADES: math.log10(shaft)}
                crossings = 0.0 if stiff else 6 + 4 * aspect + SLOPE * math.log10(shaft)
                shape = {CROSSINGS: crossings * away[0], HEIGHT: 0.5 if stiff else 1.2 * away[0]}
                rows += [
                    whole | shape | {PROCEDURE: SHAPE, THETA: math.nan, ENERGY: (3e-5 if stiff else 2e-5) * away[0]},
                    whole | {PROCEDURE: INTERNAL, THETA: 10.0, CROSSINGS: 3 * away[1], HEIGHT: 0.8, ENERGY: 4e-5},
                ]
    return pd.DataFrame(rows)


def verdicts(runs: pd.DataFrame) -> dict[str, str]:
    return {finding.id: str(finding.judge(runs).verdict) for finding in STUDY.findings}


def effect(runs: pd.DataFrame, name: str) -> SeedMean:
    (finding,) = (one for one in STUDY.findings if one.id == name)
    outcome = finding.outcome(finding.rows(runs))
    (only,) = outcome.effects if isinstance(outcome, Outcome) else outcome
    return only.value


def test_findings_are_judged_by_runs_with_soft_contacts() -> None:
    found = verdicts(table())
    assert found == {name: "not found" if name.startswith("shape-costs-more") else "found" for name in found}
    assert effect(table(), "stiffer-entangles-more").value == pytest.approx(SLOPE, abs=0.05)
    for end, shaft in (("soft", 3e-3), ("rigid", 3.0)):
        above = effect(table(), f"shape-entangles-most-{end}")
        assert above.value == pytest.approx(6 + 4 * 0.7 + SLOPE * math.log10(shaft) - 3, abs=0.1)
        assert above.count == 18
        assert effect(table(), f"grows-with-aspect-{end}").value == pytest.approx(4, abs=0.3)
        assert effect(table(), f"stays-up-{end}").value == pytest.approx(0.2, abs=0.01)


def test_the_energy_with_stiff_contacts_is_compared_at_the_stiffest_shaft() -> None:
    cost = effect(table(), "costs-depend-on-contacts")
    assert (10**cost.value, cost.count) == (pytest.approx(1.5, rel=0.02), 18)
    soft = table()[table()[CONTACT] == 500]
    assert verdicts(soft)["costs-depend-on-contacts"] == "no data"
