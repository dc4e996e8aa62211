"""The study of contacts: effects that were put into a factorial, and verdicts for data that deserve them."""

from collections.abc import Mapping
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from synthetic import SyntheticRun, write_run

from dem.record.run import open_run
from postprocess.statistics.points import ASPECT, SEED, SEEDS
from studies.contacts import (
    CALLED,
    CROSSED,
    DEVIATION,
    EFFECT,
    EVERYWHERE,
    FACTOR,
    FACTORS,
    PHI_0,
    PHI_F,
    PHI_RELAXED,
    QUANTITY,
    RESTITUTION,
    RISEN,
    STUDY,
    TOGETHER,
    WALL,
    by_seed,
    effects,
    lowest_rise,
    points,
)
from studies.framework.shaken import FRICTION, gravish_at

RATIOS = (0.4, 0.7, 1.0)
NOISE = 0.003
SEED_NOISE = 0.004  # of what all combinations of a seed share: their poses
LEVELS = {PHI_0: 0.11, PHI_F: 0.15, PHI_RELAXED: 0.16, CROSSED: 6.0, RISEN: -0.1}


def runs_of(
    put_in: Mapping[str, Mapping[str, float]] | None = None, *, together: float = 0.0, noise: float = NOISE
) -> pd.DataFrame:
    """A full factorial of eight seeds; `put_in` says by how much each factor's second level changes a quantity."""
    generator, rows = np.random.default_rng(3), []
    shared = {(ratio, seed): SEED_NOISE * generator.standard_normal() for ratio in RATIOS for seed in range(1, 9)}
    for *levels, ratio, seed in product(*FACTORS.values(), RATIOS, range(1, 9)):
        row: dict[str, float] = {**dict(zip(FACTORS, levels, strict=True)), ASPECT: ratio, SEED: seed}
        changed = {name: row[name] == FACTORS[name][1] for name in FACTORS}
        for quantity, level in LEVELS.items():
            value = level - 0.02 * ratio + shared[ratio, int(seed)] + noise * generator.standard_normal()
            value += sum(change * changed[factor] for factor, change in (put_in or {}).get(quantity, {}).items())
            row[quantity] = value + together * (changed[FRICTION] and changed[WALL]) * (quantity == PHI_F)
        rows.append(row)
    return pd.DataFrame(rows)


def verdicts(runs: pd.DataFrame) -> dict[str, str]:
    tables = {"runs": runs, "points": points(runs)}
    return {one.finding.id: str(one.verdict) for one in STUDY.judge(tables)}


def gravish(runs: pd.DataFrame) -> pd.Series:
    return runs[ASPECT].map({ratio: gravish_at(ratio, "phi_f") for ratio in RATIOS})


def test_effects_are_those_put_in_and_what_a_seed_shares_is_no_scatter() -> None:
    found = effects(runs_of({PHI_F: {FRICTION: -0.02, WALL: -0.005}})).set_index([QUANTITY, FACTOR, ASPECT])
    sizes = {CALLED[FRICTION]: -0.02, CALLED[WALL]: -0.005, CALLED[RESTITUTION]: 0.0, TOGETHER: 0.0}
    for factor, size in sizes.items():
        row = found.loc[("phi_f", factor, EVERYWHERE)]
        # A seed's effect is a mean of four differences (two for the interaction, of differences twice as wide): the
        # error is that of the noise alone, by √24 seeds.
        error = NOISE * np.sqrt(2 / 4) * (2 if factor == TOGETHER else 1) / np.sqrt(24)
        assert row[SEEDS] == 24
        assert row[EFFECT] == pytest.approx(size, abs=4 * error)
        assert 0.6 * error < row[EFFECT.replace(" [", " SE [")] < 1.5 * error
    interaction = runs_of(together=-0.01, noise=0.0)
    assert by_seed(interaction, PHI_F, FRICTION, WALL)[PHI_F].to_numpy() == pytest.approx(-0.01)
    # It is half in either effect, which is a mean over the other factor.
    assert by_seed(interaction, PHI_F, WALL)[PHI_F].to_numpy() == pytest.approx(-0.005)


def test_what_is_missing_takes_its_pairs_with_it_and_is_not_accepted() -> None:
    runs = runs_of(noise=1e-4)
    right = (runs[FRICTION] == 0.8) & (runs[WALL] == 0.4) & (runs[RESTITUTION] == 0.7)
    runs[PHI_F] = gravish(runs) * np.where(right, 1.0, 1.2)
    assert verdicts(runs)["near-gravish"] == "found"
    assert verdicts(runs[~(right & (runs[ASPECT] == 0.4))])["near-gravish"] == "not resolved"
    gone = (runs[FRICTION] == 0.8) & (runs[SEED] == 3) & (runs[ASPECT] == 0.7)
    assert len(by_seed(runs[~gone], PHI_F, FRICTION)) == 23
    assert by_seed(runs[runs[FRICTION] == 0.4], PHI_F, FRICTION).empty
    row = points(runs).iloc[0]
    own = row[PHI_F.replace(" [", " 95 % [")]
    known = gravish_at(row[ASPECT], "phi_f")
    assert row[DEVIATION.replace(" [", " 95 % [")] == pytest.approx(100 * np.hypot(own, 0.003) / known)


def test_the_lowest_tenth_rises_by_what_the_piles_height_makes_it(tmp_path: Path) -> None:
    run = SyntheticRun(packing=(0.100, 0.105, 0.090, 0.100), floor_z=0.003)
    manifest = open_run(write_run(tmp_path / "run", run))
    # Heights are shares of that of the pile; of twelve smarticles one is a tenth. Frames scatter by 0.2 % of φ.
    before = np.mean([run.height(0.105 * (1 + shift)) for shift in (0.002, -0.002)])
    after = run.height(0.090 * (1 - 0.002))
    assert lowest_rise(manifest) == pytest.approx(
        run.shares()[0] * (after - before) / manifest.manifest.middle_length_m, rel=1e-5
    )
