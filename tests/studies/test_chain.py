"""The study of the chain: runs with a known force, strain and width, and its findings on trials made to order."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from synthetic.strained import WIDTH, write_strained_run

from postprocess.measures.strain import AT_PEAK, BEND, DROP, FRACTURE, PEAK, QUANTITIES, STIFFNESS, WIDENING, YIELD
from postprocess.statistics.points import SEED, marked
from studies.chain import CONFINEMENT, COUNT, SPEED, STUDY, VARIANT

ORIGIN = {"note": "the full study as shipped", "command": "smarticles study chain --out chain"}


def write_pull(directory: Path, *, variant: str, ratio: float, stiffness: float, **run: Any) -> Path:
    """A chain whose force rises by `stiffness` [N] times the strain, to 0.4, and is gone."""
    made: dict[str, Any] = {"channel": WIDTH / ratio, "name": variant, "frames_per_phase": 1, **run}
    return write_strained_run(directory, lambda strains: np.where(strains <= 0.4, stiffness * strains, 0.0), **made)


def test_means_over_trials_and_changes_are_those_put_in(tmp_path: Path) -> None:
    """Two and six robots, six a tenth stiffer; friction adds a fifth; seeds scatter by 1 %."""
    runs = []
    for seed, factor in ((1, 0.99), (2, 1.01)):
        for count, ratio in ((2, 0.52), (2, 0.65), (6, 0.52), (6, 0.65)):
            place: dict[str, Any] = {"count": count, "ratio": ratio, "seed": seed, "variant": "baseline"}
            stiffness = factor * (3.3 if count == 6 else 3.0)
            runs.append(write_pull(tmp_path / f"b{count}_{ratio}_{seed}", stiffness=stiffness, **place))
        rubbed: dict[str, Any] = {"count": 2, "ratio": 0.65, "seed": seed, "variant": "friction"}
        runs.append(write_pull(tmp_path / f"f_{seed}", stiffness=1.2 * factor * 3.0, **rubbed))
    report = STUDY.analyse([*runs, tmp_path / "absent"], tmp_path / "out", **ORIGIN)
    point = report.tables["points"].set_index([VARIANT, COUNT, CONFINEMENT]).loc[("baseline", 2, 0.52)]
    assert (point["seeds [-]"], point["yielded [-]"]) == (2, 0)
    assert point[PEAK] == pytest.approx(1.2, rel=1e-3)
    assert point[STIFFNESS] == pytest.approx(3.0, rel=1e-3)
    assert point[marked(STIFFNESS, "95 %")] == pytest.approx(0.03 * 12.7062, rel=1e-3)
    assert point[FRACTURE] == pytest.approx(0.4)
    cells = dict(zip(report.header, report.rows[0], strict=True))
    assert (cells["mm/s"], cells["peak force [N]"], cells["strain at the yield drop"]) == ("20", "1.200 ± 0.012", "-")
    changes = report.tables["sensitivity"].set_index("quantity")["change [%]"]
    assert changes.to_dict() == pytest.approx({PEAK: 20, FRACTURE: 0, AT_PEAK: 0, STIFFNESS: 20}, abs=0.01)
    assert {f"{figure.name}.png" for figure in STUDY.figures} <= set(report.files)
    assert report.missing[0].directory.endswith("absent")


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
                    place: dict[str, Any] = {
                        VARIANT: variant,
                        COUNT: count,
                        CONFINEMENT: ratio,
                        SEED: seed,
                        SPEED: 0.02,
                    }
                    rows.append(row | place)
    return pd.DataFrame(rows)


def verdicts(table: pd.DataFrame) -> list[str]:
    return [str(found.judge(table).verdict) for found in STUDY.findings]


def test_findings_are_judged_by_their_effects() -> None:
    # linear, yield n = 2, yield n = 6, widens, peak and fracture in the paper's range, in ours, more robots
    assert verdicts(runs(2.0, yielded=0.2)) == ["found", "found", "not found", *["found"] * 6]
    assert verdicts(runs(-2.0)) == ["found", "not found", "not found", "found", *["not found"] * 4, "found"]
    # Walls that nothing touches change no bit.
    same = runs(0.0)
    same[[PEAK, FRACTURE]] = same.groupby([COUNT, SEED])[[PEAK, FRACTURE]].transform("first")
    assert verdicts(same)[4:6] == ["not found", "not found"]


def test_walls_that_nothing_touches_make_no_more_trials_of_one() -> None:
    # Three trials whose differences scatter as much as they are large, each repeated at sixteen h/H.
    rng = np.random.default_rng(2)
    once = runs(0.0)
    once = once[(once[VARIANT] == "baseline") & (once[CONFINEMENT] == 0.52)]
    once = once.assign(**{PEAK: 1 + once[COUNT] * 0.01 + 0.02 * rng.normal(size=len(once))})
    often = pd.concat([once.assign(**{CONFINEMENT: ratio}) for ratio in np.linspace(0.52, 0.65, 16)], ignore_index=True)
    told_once, told_often = (STUDY.findings[-1].judge(table) for table in (once, often))
    assert told_once.ours == told_often.ours
    assert "(n = 3)" in told_often.ours
    assert told_once.verdict == told_often.verdict == "not resolved"
