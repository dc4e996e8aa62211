"""The study of finite size: what is measured of a pile, and answers to laws and thresholds that were put in."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from synthetic import SyntheticRun, write_run
from synthetic.shapes import RADIUS, W

from dem.record.run import Run, open_run
from postprocess.measures.table import summarise_run
from postprocess.statistics.points import ASPECT, SEED
from studies.finite_size import (
    AFTER,
    BEFORE,
    COUNT,
    MOVING,
    QUANTITIES,
    STAGES,
    STUDY,
    crossings,
    growth,
    measure,
    phi,
    share,
    spans,
    thresholds,
)
from studies.finite_size import (
    RADIUS as RADIUS_OVER_W,
)
from studies.framework.findings import Judged

COUNTS = np.repeat([100, 300, 1000, 3000, 10_000], [9, 9, 6, 3, 3]).astype(float)
RATIOS = (0.09, 0.10, 0.11, 0.12, 0.13)


def table(
    *,
    slope: float = -0.12,
    power: float = 1 / 3,
    places: Callable[[int], float] = lambda _: 0.11,
    clusters: Callable[[float, int], float] = lambda ratio, size: size**-0.8 if ratio < 0.105 else 0.9,
) -> pd.DataFrame:
    """A row per run: laws at l/w = 0.7, and about the threshold piles that span by a logistic function."""
    random = np.random.default_rng(3)
    names = list(QUANTITIES)
    noise = 0.03 * random.normal(size=(len(names), len(COUNTS))) * COUNTS**-0.5
    laws = dict(zip(names, 0.15 + slope * COUNTS**-power + noise, strict=True))
    rows: list[dict[str, Any]] = []
    for k, count in enumerate(COUNTS):
        row: dict[str, Any] = {ASPECT: 0.7, COUNT: int(count), SEED: k, **{name: laws[name][k] for name in names}}
        rows.append(row | {name(stage): 1.0 for stage in STAGES for name in (share, spans)})
    for size in (100, 300, 1000, 3000):
        for ratio in RATIOS:
            for number in range(9):
                row = dict.fromkeys(names, 0.2 + 0.001 * random.normal())
                row |= {ASPECT: ratio, COUNT: size, SEED: number}
                for stage in STAGES:
                    chance = 1 / (1 + math.exp(-(ratio - places(size)) / 0.003))
                    row[spans(stage)] = float(random.random() < chance)
                    row[crossings(stage)] = 20 * (ratio - 0.06) + 0.02 * random.normal()
                    row[share(stage)] = clusters(ratio, size) * math.exp(0.1 * random.normal())
                rows.append(row)
    return pd.DataFrame(rows)


def judged(runs: pd.DataFrame, finding: str) -> Judged:
    tables = {"runs": runs, "thresholds": thresholds(runs), "growth": growth(runs)}
    return next(one.judge(runs, tables) for one in STUDY.findings if one.id == finding)


@pytest.mark.parametrize(("slope", "verdict"), [(-0.12, "found"), (0.12, "not found"), (0.0, "not resolved")])
def test_the_bias_of_the_papers_pile_has_its_sign_or_none(slope: float, verdict: str) -> None:
    found = judged(table(slope=slope), "phi-f-below-bulk")
    assert found.verdict == verdict, found.ours
    if slope < 0:
        # Of 0.15: 0.12 · 270^(-1/3) = 0.0186, 12.4 %.
        assert "by -12." in found.ours


def test_the_place_of_a_threshold_comes_out_again() -> None:
    found = thresholds(table())
    rows = found[(found["stage"] == AFTER) & (found["against"] == "l/w")]
    assert rows[COUNT].tolist() == [100, 300, 1000, 3000]
    assert (rows["from [-]"] <= 0.11).all()
    assert (rows["to [-]"] >= 0.11).all()
    assert (rows["to [-]"] - rows["from [-]"] < 0.01).all()
    # Against ⟨N⟩ = 20 (l/w - 0.06).
    rows = found[(found["stage"] == AFTER) & (found["against"] == "⟨N⟩")]
    assert rows["half of piles span at [-]"].to_numpy() == pytest.approx(1.0, abs=0.12)


def test_places_that_move_with_the_size_are_found_and_others_are_not() -> None:
    assert judged(table(), "threshold-moves-aspect-after").verdict == "not resolved"
    moved = table(places=lambda size: 0.118 - 0.008 * math.log10(size / 100))
    assert judged(moved, "threshold-moves-aspect-after").verdict == "found"


def test_the_largest_cluster_falls_or_does_not() -> None:
    found = judged(table(), "cluster-falls-after")
    assert found.verdict == "found"
    assert re.search(r"l/w = 0\.09: -0\.(79|80|81) ±", found.ours)
    assert "surely falling at 0.09, 0.1;" in found.ours
    # At l/w = 0.7 it is all of the pile at every size: neither falling nor growing.
    assert judged(table(clusters=lambda _, size: 0.1 * size**0.2), "cluster-falls-after").verdict == "not resolved"


def write(folder: Path, *, ratio: float = 0.7, count: int = 12, seed: int = 1, **more: Any) -> Path:
    run = SyntheticRun(aspect_ratio=ratio, count=count, seed=seed, packing=(0.10, 0.11, 0.15, 0.14), **more)
    return write_run(folder / f"lw{ratio:.2f}_n{count}_seed{seed}", run)


def test_measures_are_those_put_in(tmp_path: Path) -> None:
    directory = write(tmp_path, count=60, frames_per_phase=40)
    row: dict[str, Any] = dict(measure(open_run(directory)))  # type: ignore[arg-type]
    # The last frame of a phase is 0.2 % beside its φ, to one side or the other.
    assert row[phi(BEFORE)] == pytest.approx(0.11, rel=0.003)
    assert row[phi(AFTER)] == pytest.approx(0.14, rel=0.003)
    assert row[MOVING] == pytest.approx(0.15, rel=0.003)
    assert row[RADIUS_OVER_W] == pytest.approx(RADIUS / W)
    assert row["escaped at the end [-]"] == 0
    every = summarise_run(Run(directory), last=1, definitions=["voxel"], phases={1, 3}).set_index("phase")
    for stage, phase in ((BEFORE, 1), (AFTER, 3)):
        there = every.loc[phase]
        assert row[crossings(stage)] == there["crossings mean [-]"] > 0
        assert row[share(stage)] == there["crossing graph largest share [-]"] > 1 / 60
        assert row[spans(stage, "height")] == there["crossing graph spans height [-]"]
        assert row[spans(stage)] == min(row[spans(stage, what)] for what in ("height", "width"))
        assert row[phi(stage, "voxel")] == there["phi voxel [-]"]
