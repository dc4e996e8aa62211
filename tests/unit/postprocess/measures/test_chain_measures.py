"""What is read off a strain test, on curves whose maxima, drops and slopes are known."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest

from postprocess.measures.strain import (
    AT_PEAK,
    BEND,
    DROP,
    FRACTURE,
    IMBALANCE,
    PEAK,
    QUANTITIES,
    SLIP_WIDENING,
    STIFFNESS,
    WALL,
    WIDENING,
    YIELD,
    StrainTest,
    first_drop,
    measured,
)
from postprocess.statistics.columns import SEED
from studies.chain.findings import findings, sensitivity
from studies.chain.measure import CONFINEMENT, COUNT, SPEED, VARIANT


def pull(*, yields: bool, jolt: float = 0.0) -> StrainTest:
    """Force 3 N times strain to 1.2 N at 0.4, a loss of 0.3 N or of all; in the former case on to 1.8 N at 0.7."""
    strains = np.linspace(0, 0.9, 9001)
    forces = 3 * strains
    forces[:100] += jolt * np.sin(np.linspace(0, 20, 100))
    after = strains > 0.4
    forces[after] = 0.9 + 3 * (strains[after] - 0.4) if yields else 0.0
    forces[strains > 0.7] = 0.0
    widths = 0.06 * (1 + 0.01 * strains + np.where(after, 0.3, 0.0))
    return StrainTest(
        times=strains / 0.06,
        strains=strains,
        forces=forces,
        held=forces - 0.02,
        widths=widths,
        walls=np.where(after, 0.5, 0.0),
    )


@pytest.mark.parametrize("jolt", [0.0, 0.05])
def test_a_yield_drop_is_told_from_the_fracture(jolt: float) -> None:
    found = measured(pull(yields=True, jolt=jolt))
    assert found[PEAK] == pytest.approx(1.8, rel=1e-3)
    assert found[AT_PEAK] == found[FRACTURE] == pytest.approx(0.7, rel=1e-3)
    assert found[YIELD] == pytest.approx(0.4, abs=0.005)
    assert found[DROP] == pytest.approx(0.25, abs=0.01)
    assert found[STIFFNESS] == pytest.approx(3.0, rel=0.01)
    assert found[BEND] == pytest.approx(1.0, abs=0.01)
    assert found[WIDENING] == pytest.approx(0.307, abs=1e-3)
    assert found[SLIP_WIDENING] == pytest.approx(0.004, abs=1e-3)
    assert found[WALL] == pytest.approx(0.5)
    assert found[IMBALANCE] == pytest.approx(0.02)


def test_a_chain_that_parts_at_its_first_maximum_has_no_yield_drop() -> None:
    found = measured(pull(yields=False))
    assert math.isnan(found[YIELD])
    assert math.isnan(found[DROP])
    assert found[FRACTURE] == found[AT_PEAK] == pytest.approx(0.4, rel=1e-3)
    assert found[WIDENING] < 0.01


def test_a_first_drop_needs_a_tenth_of_the_force() -> None:
    rise = np.linspace(0, 1, 101)
    assert first_drop(rise) == (100, 0.0)
    assert first_drop(np.concatenate([rise, [0.95], 1 + rise]))[1] == 0.0
    top, loss = first_drop(np.concatenate([rise, [0.8, 0.7], 1 + rise]))
    assert (top, loss) == (100, pytest.approx(0.3))


def runs(rise: float, *, yielded: float = math.nan) -> pd.DataFrame:
    """Trials of two and six whose peak and fracture rise with h/H by `rise`; one variant a tenth stronger."""
    rows: list[dict[str, Any]] = []
    rng = np.random.default_rng(1)
    for variant, counts in (("baseline", (2, 6)), ("other", (2,))):
        for count in counts:
            for ratio in (0.52, 0.65) if variant == "baseline" else (0.65,):
                for seed in (1, 2, 3):
                    level = 1 + 0.1 * count + rise * (ratio - 0.52) + 0.001 * rng.normal()
                    stronger = 1.1 if variant == "other" else 1.0
                    row = dict.fromkeys(QUANTITIES, 1.0) | {PEAK: level * stronger, FRACTURE: 1 - 0.2 * count + level}
                    row |= {YIELD: yielded + 0.001 * rng.normal(), DROP: yielded, WIDENING: 0.2 + 0.001 * rng.normal()}
                    row |= {BEND: 1 + 0.001 * rng.normal(), AT_PEAK: 0.4}
                    place = {VARIANT: variant, COUNT: count, CONFINEMENT: ratio, SEED: seed, SPEED: 0.02}
                    rows.append(row | place)
    return pd.DataFrame(rows)


def verdicts(table: pd.DataFrame) -> list[str]:
    return [found.verdict for found in findings(table)]


def test_findings_are_judged_by_their_effects() -> None:
    # linear, yield n = 2, yield n = 6, widens, peak and fracture in the paper's range, in ours, more robots
    assert verdicts(runs(2.0, yielded=0.2)) == ["found", "found", "not found", *["found"] * 6]
    assert verdicts(runs(-2.0)) == ["found", "not found", "not found", "found", *["not found"] * 4, "found"]
    # Walls that nothing touches change no bit.
    same = runs(0.0)
    same[[PEAK, FRACTURE]] = same.groupby([COUNT, SEED])[[PEAK, FRACTURE]].transform("first")
    assert verdicts(same)[4:6] == ["not found", "not found"]


def test_walls_that_nothing_touches_make_no_more_trials_of_one() -> None:
    # Three trials whose differences scatter as much as they are large, each told at sixteen h/H.
    rng = np.random.default_rng(2)
    once = runs(0.0)
    once = once[(once[VARIANT] == "baseline") & (once[CONFINEMENT] == 0.52)]
    once = once.assign(**{PEAK: 1 + once[COUNT] * 0.01 + 0.02 * rng.normal(size=len(once))})
    often = pd.concat([once.assign(**{CONFINEMENT: ratio}) for ratio in np.linspace(0.52, 0.65, 16)], ignore_index=True)
    *_, told_once = findings(once)
    *_, told_often = findings(often)
    assert told_once.ours == told_often.ours
    assert "(n = 3)" in told_often.ours
    assert told_once.verdict == told_often.verdict == "not resolved"


def test_variants_are_compared_trial_by_trial() -> None:
    table = sensitivity(runs(1.0))
    change = table.set_index(["variant", "quantity"]).loc[("other", PEAK)]
    assert change["change [%]"] == pytest.approx(10, abs=0.5)
    assert change["trials [-]"] == 3
    assert 0 < change["change 95 % [%]"] < 1
