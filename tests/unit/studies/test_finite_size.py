"""The study of finite size: known laws and thresholds come out again, and of noise nothing is said."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from synthetic import SyntheticRun, write_manifest, write_run
from synthetic.shapes import RADIUS, W

import studies
from dem.errors import InputError
from dem.phases.deposit import Deposit
from dem.phases.shake import Shake
from dem.record.manifest import read_run
from postprocess.measures.table import summarise_run
from postprocess.statistics.columns import ASPECT, SEED
from studies.base.questions import Question
from studies.finite_size import measure, percolation, scaling
from studies.finite_size.findings import answers
from studies.finite_size.measure import (
    AFTER,
    BEFORE,
    COUNT,
    MOVING,
    QUANTITIES,
    STAGES,
    crossings,
    phi,
    share,
    size_row,
    spans,
)
from studies.finite_size.percolation import growths, profiles, shifted, thresholds
from studies.finite_size.scaling import Floats, scalings
from studies.finite_size.study import FiniteSize
from studies.registry import study_file
from templates.sweep.expand import Point, expand
from templates.sweep.sweep_file import load_sweep

ORIGIN: dict[str, Any] = {"note": "the full study as shipped", "command": "smarticles study finite-size --out finite"}
SEEDS = {100: 9, 300: 9, 1000: 6, 3000: 3, 10_000: 3}
COUNTS = np.repeat(list(SEEDS), list(SEEDS.values())).astype(float)
RATIOS = (0.09, 0.10, 0.11, 0.12, 0.13)


# -- laws in the size -------------------------------------------------------------------------------------------------


def piles(bulk: float, slope: float, *, power: float = 1 / 3, noise: float = 0.03, seed: int = 1) -> Floats:
    """A quantity of every run, whose scatter falls as √N."""
    random = np.random.default_rng(seed)
    return bulk + slope * COUNTS**-power + noise * random.normal(size=len(COUNTS)) * COUNTS**-0.5


def test_the_law_that_made_the_runs_comes_out_again() -> None:
    law = scaling.scaling(COUNTS, piles(0.15, -0.12, seed=3))
    assert law.bulk == pytest.approx(0.15, abs=law.error(1, 0))
    assert law.slope == pytest.approx(-0.12, abs=law.error(0, 1))
    # An error that says something: far below what is to be told.
    assert law.error(1, 0) < 0.002
    assert law.error(0, 1) < 0.02
    assert law.refused > 0.05
    best, low, high = law.powers
    assert low < 1 / 3 < high
    assert low < best < high
    assert (law.sizes, law.runs) == (5, 30)
    assert law.scatter.fall == pytest.approx(1.0, abs=0.3)
    bias = law.bias(270)
    assert bias.value == pytest.approx(-0.12 * 270 ** (-1 / 3), abs=bias.half_width)


def test_intervals_hold_what_they_are_to_hold() -> None:
    """95 % of them: in 400 trials within four standard deviations of that, 0.907 to 0.993."""
    laws = [scaling.scaling(COUNTS, piles(0.15, -0.12, seed=seed)) for seed in range(400)]
    held = [abs(law.bulk - 0.15) <= law.error(1, 0) for law in laws]
    assert 0.907 < np.mean(held) < 0.993
    # As many laws are refused as chance has it, no more.
    assert 0.007 < np.mean([law.refused < 0.05 for law in laws]) < 0.093


@pytest.mark.parametrize("power", [0.1, 1.0])
def test_another_law_is_refused(power: float) -> None:
    law = scaling.scaling(COUNTS, piles(0.15, -0.12 * 5 ** (3 * power - 1), power=power))
    assert law.refused < 0.05
    assert law.excess > 3
    assert not law.powers[1] < 1 / 3 < law.powers[2]
    assert law.powers[1] <= power <= law.powers[2]
    # What is refused is told with larger errors than the same scatter about the law itself has.
    values = piles(0.15, -0.12 * 5 ** (3 * power - 1), power=power)
    means = pd.Series(values).groupby(COUNTS).transform("mean").to_numpy()
    along = scaling.scaling(COUNTS, values - means + 0.15 - 0.12 * COUNTS ** (-1 / 3))
    assert law.scatter.variance == pytest.approx(along.scatter.variance)
    assert law.error(1, 0) == pytest.approx(math.sqrt(law.excess) * along.error(1, 0))


def test_scatter_knows_nothing_of_the_law() -> None:
    level = scaling.scatter_of(COUNTS, piles(0.15, 0.0))
    steep = scaling.scatter_of(COUNTS, piles(0.15, -5.0))
    assert level.variance == pytest.approx(steep.variance)
    assert level.variance == pytest.approx(0.03**2, rel=3)
    assert level.freedom == 25


def test_one_seed_of_each_size_has_no_error() -> None:
    counts = np.array([100.0, 300, 1000])
    law = scaling.scaling(counts, 0.15 - 0.12 * counts ** (-1 / 3))
    assert law.bulk == pytest.approx(0.15)
    assert math.isnan(law.error(1, 0))
    assert math.isnan(law.refused)


# -- tables -----------------------------------------------------------------------------------------------------------


def table(
    *,
    slope: float = -0.12,
    power: float = 1 / 3,
    places: Callable[[int], float] = lambda _: 0.11,
    clusters: Callable[[float, int], float] = lambda ratio, size: size**-0.8 if ratio < 0.105 else 0.9,
    seed: int = 3,
) -> pd.DataFrame:
    """A row per run: laws at l/w = 0.7, and about the threshold piles that span by a logistic function."""
    random = np.random.default_rng(seed)
    rows: list[dict[str, Any]] = []
    quantities = {name: piles(0.15, slope, power=power, seed=seed + 10 * k) for k, name in enumerate(QUANTITIES)}
    for k, count in enumerate(COUNTS):
        row: dict[str, Any] = {ASPECT: 0.7, COUNT: int(count), SEED: k}
        row |= {name: values[k] for name, values in quantities.items()}
        rows.append(row | {name(stage): 1.0 for stage in STAGES for name in (share, spans)})
    for size in (100, 300, 1000, 3000):
        for ratio in RATIOS:
            for number in range(9):
                row = dict.fromkeys(QUANTITIES, 0.2 + 0.001 * random.normal())
                row |= {ASPECT: ratio, COUNT: size, SEED: number}
                for stage in STAGES:
                    chance = 1 / (1 + math.exp(-(ratio - places(size)) / 0.003))
                    row[spans(stage)] = float(random.random() < chance)
                    row[crossings(stage)] = 20 * (ratio - 0.06) + 0.02 * random.normal()
                    row[share(stage)] = clusters(ratio, size) * math.exp(0.1 * random.normal())
                rows.append(row)
    return pd.DataFrame(rows)


def answered(runs: pd.DataFrame) -> dict[str, Question]:
    return {one.question: one for one in answers(runs, thresholds(runs), growths(runs))}


BIAS = "Is φ_f of 270 smarticles of l/w = 0.7 below that of a pile without end of the same shape?"
LAW = "Does φ_f come to that as N^(-1/3), surface over volume?"
SHIFT = "Does the l/w at which clusters span half of the piles after the shake go with the piles' size?"
FALLS = "Is there an l/w at which the largest entangled cluster is ever less of larger piles after the shake?"
WHOLE = "Do entangled clusters reach through all piles of l/w = 0.7, whatever their size?"


@pytest.mark.parametrize(("slope", "answer"), [(-0.12, "yes"), (0.12, "no"), (0.0, "undetermined")])
def test_the_bias_of_the_papers_pile_has_its_sign_or_none(slope: float, answer: str) -> None:
    found = answered(table(slope=slope))[BIAS]
    assert found.answer == answer, found.evidence
    assert ("times as many runs" in found.evidence) == (answer == "undetermined")
    if answer == "yes":
        # Of 0.15: 0.12 · 270^(-1/3) = 0.0186, 12.4 %.
        assert found.evidence.startswith("by -12.")


@pytest.mark.parametrize(
    ("power", "slope", "answer"), [(1 / 3, -0.3, "yes"), (1.0, -3.0, "no"), (1 / 3, 0, "undetermined")]
)
def test_the_law_is_told_from_others_refused_or_left_open(power: float, slope: float, answer: str) -> None:
    found = answered(table(power=power, slope=slope))[LAW]
    assert found.answer == answer, found.evidence


def test_laws_are_tabulated_by_ratio_and_quantity() -> None:
    laws = scalings(table())
    assert set(laws[ASPECT]) == {0.7, *RATIOS}
    row = laws[(laws[ASPECT] == 0.7) & (laws[scaling.QUANTITY] == phi(AFTER))].iloc[0]
    assert row[scaling.BULK] == pytest.approx(0.15, abs=row[scaling.BULK_BAR])
    assert row[scaling.SIZES] == 5


def test_a_pile_that_is_open_is_told() -> None:
    runs = table()
    assert answered(runs)[WHOLE].answer == "yes"
    runs.loc[(runs[ASPECT] == 0.7).idxmax(), spans(BEFORE)] = 0.0
    found = answered(runs)[WHOLE]
    assert found.answer == "no"
    assert found.evidence.startswith("29 of 30 runs")


# -- thresholds -------------------------------------------------------------------------------------------------------


def test_the_place_of_a_threshold_comes_out_again() -> None:
    rows = thresholds(table())
    rows = rows[(rows[percolation.STAGE] == AFTER) & (rows[percolation.AXIS] == "l/w")]
    assert rows[COUNT].tolist() == [100, 300, 1000, 3000]
    for _, row in rows.iterrows():
        assert row[percolation.LOW] <= 0.11 <= row[percolation.HIGH]
        assert row[percolation.HIGH] - row[percolation.LOW] < 0.01
        assert row[percolation.LOW] < row[percolation.PLACE] < row[percolation.HIGH]
    # The same against ⟨N⟩ = 20 (l/w - 0.06).
    rows = thresholds(table())
    rows = rows[(rows[percolation.STAGE] == AFTER) & (rows[percolation.AXIS] == "⟨N⟩")]
    assert rows[percolation.PLACE].to_numpy() == pytest.approx(1.0, abs=0.12)


def test_intervals_of_places_hold_them() -> None:
    """95 % or so, of so few runs: at least nine in ten, and none so wide as to hold everything."""
    random, held, wide = np.random.default_rng(2), [], []
    x = np.repeat(RATIOS, 6)
    sizes = np.full(len(x), 1000)
    for _ in range(80):
        spanned = (random.random(len(x)) < 1 / (1 + np.exp(-(x - 0.113) / 0.004))).astype(float)
        one = profiles(x, spanned, sizes)[1000]
        low, high = one.interval
        held.append(low <= 0.113 <= high)
        wide.append(high - low)
    assert np.mean(held) >= 0.9
    assert np.median(wide) < 0.02


def test_a_gap_is_the_interval_where_nothing_lies_within() -> None:
    x = np.repeat([0.10, 0.11, 0.12], 9)
    one = profiles(x, (x > 0.105).astype(float), np.full(len(x), 300))[300]
    assert one.best == pytest.approx(0.105, abs=1e-3)
    low, high = one.interval
    assert 0.098 < low <= 0.1005
    assert 0.1095 <= high < 0.112


@pytest.mark.parametrize("level", [0.0, 1.0])
def test_where_all_piles_are_alike_no_place_is_told(level: float) -> None:
    x = np.repeat(RATIOS, 3)
    one = profiles(x, np.full(len(x), level), np.full(len(x), 300))[300]
    assert not one.known
    assert math.isnan(one.best)
    assert math.isinf(one.interval[1] if level == 0 else one.interval[0])
    assert math.isnan(shifted({300: one, 1000: one}))


def test_places_that_move_with_the_size_are_told_and_others_are_not() -> None:
    still, moved = answered(table())[SHIFT], answered(table(places=lambda size: 0.118 - 0.008 * math.log10(size / 100)))
    assert still.answer == "undetermined", still.evidence
    assert moved[SHIFT].answer == "yes", moved[SHIFT].evidence


def test_chance_moves_places_no_more_often_than_it_says() -> None:
    """p below 0.05 in one of twenty, by a law of large numbers that so few runs do not quite reach."""
    random, x = np.random.default_rng(4), np.tile(np.repeat(RATIOS, 6), 3)
    sizes = np.repeat([300, 1000, 3000], len(x) // 3)
    chances = []
    for _ in range(80):
        spanned = (random.random(len(x)) < 1 / (1 + np.exp(-(x - 0.11) / 0.005))).astype(float)
        chances.append(shifted(profiles(x, spanned, sizes)))
    assert np.mean(np.array(chances) < 0.05) < 0.12


def test_the_largest_cluster_falls_or_does_not() -> None:
    found = answered(table())[FALLS]
    assert found.answer == "yes"
    assert re.search(r"l/w = 0\.09: -0\.(79|80|81) ±", found.evidence)
    assert "surely falling up to l/w = 0.1, not from 0.11 on" in found.evidence
    grown = answered(table(clusters=lambda _, size: 0.1 * size**0.2))[FALLS]
    # At l/w = 0.7 it is all of the pile at every size: neither falling nor growing.
    assert grown.answer == "undetermined"


# -- runs -------------------------------------------------------------------------------------------------------------


def write(folder: Path, *, ratio: float = 0.7, count: int = 12, seed: int = 1, **more: Any) -> Path:
    run = SyntheticRun(aspect_ratio=ratio, count=count, seed=seed, packing=(0.10, 0.11, 0.15, 0.14), **more)
    return write_run(folder / f"lw{ratio:.2f}_n{count}_seed{seed}", run)


def test_measures_are_those_put_in(tmp_path: Path) -> None:
    row = size_row(read_run(write(tmp_path, frames_per_phase=40)))
    # The last frame of a phase is 0.2 % beside its φ, to one side or the other.
    assert row[phi(BEFORE)] == pytest.approx(0.11, rel=0.003)
    assert row[phi(AFTER)] == pytest.approx(0.14, rel=0.003)
    assert row[MOVING] == pytest.approx(0.15, rel=0.003)
    assert row[measure.RADIUS] == pytest.approx(RADIUS / W)
    assert (row[COUNT], row[ASPECT], row["escaped at the end [-]"]) == (12, 0.7, 0)
    assert row[spans(AFTER)] == min(float(str(row[spans(AFTER, what)])) for what in ("height", "width"))
    assert 1 / 12 <= float(str(row[share(AFTER)])) <= 1


def test_measures_are_those_of_the_table_of_all_measures(tmp_path: Path) -> None:
    directory = write(tmp_path, count=60)
    row: dict[str, Any] = size_row(read_run(directory))
    every = summarise_run(directory, last=1, definitions=["voxel"], phases={1, 3}).set_index("phase")
    for stage, phase in ((BEFORE, 1), (AFTER, 3)):
        there = every.loc[phase]
        assert row[crossings(stage)] == there["crossings mean [-]"] > 0
        assert row[share(stage)] == there["crossing graph largest share [-]"] > 1 / 60
        assert row[spans(stage, "height")] == there["crossing graph spans height [-]"]
        assert row[spans(stage, "width")] == there["crossing graph spans width [-]"]
        assert row[phi(stage, "voxel")] == there["phi voxel [-]"]


def test_runs_of_other_studies_are_none_of_this_one(tmp_path: Path) -> None:
    other = write_run(tmp_path / "other", SyntheticRun(phases=("deposit", "shake", "relax")))
    with pytest.raises(InputError, match="its phases are deposit, shake, relax, not deposit, relax, shake, relax"):
        size_row(read_run(other))


def test_piles_in_other_containers_are_refused(tmp_path: Path, undrawn: None) -> None:
    first, second = write(tmp_path, seed=1), write(tmp_path, seed=2)
    write_manifest(second, SyntheticRun(seed=2), container_radius=1.5 * RADIUS)
    with pytest.raises(InputError, match="runs of different radius must not be averaged"):
        FiniteSize().analyse([first, second], tmp_path / "out", **ORIGIN)
    with pytest.raises(InputError, match="given twice"):
        FiniteSize().analyse([first, write(tmp_path / "again", seed=1)], tmp_path / "out", **ORIGIN)


def test_the_study_writes_its_tables_and_figures(tmp_path: Path) -> None:
    runs = [
        write(tmp_path, ratio=ratio, count=count, seed=seed)
        for ratio in (0.7, 0.1, 0.12)
        for count in (12, 20, 30)
        for seed in (1, 2, 3)
    ]
    report = FiniteSize().analyse([*runs, tmp_path / "never"], tmp_path / "out", **ORIGIN)
    names = {"laws.csv", "thresholds.csv", "growth.csv", "answers.csv", "points.csv", "finite-size.md"}
    assert {"scaling.png", "percolation.png", *names} <= set(report.files)
    assert len(report.rows) == 9
    assert len(report.missing) == 1


# -- what is shipped --------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def shipped() -> list[Point]:
    return expand(load_sweep(study_file("finite-size")))


def test_piles_of_one_ratio_have_one_shape(shipped: list[Point]) -> None:
    with (Path(studies.__file__).parent / "gravish" / "savoie_counts.csv").open(encoding="utf-8") as file:
        paper = {float(row["l_over_w"]): (int(row["n"]), int(row["per_layer"])) for row in csv.DictReader(file)}
    for point in shipped:
        ratio, scene = point.scene.smarticle.aspect_ratio, point.scene
        deposit, _, shake, _ = scene.phases
        assert isinstance(deposit, Deposit)
        assert isinstance(shake, Shake)
        assert (shake.duration_s, shake.frequency_hz, shake.peak_acceleration_g) == (5.0, 30, 2)
        assert (scene.engine, scene.protocol, scene.fidelity.base) == ("links", "text", "standard")
        # Volume of the pile over the cube of its radius, whatever the size.
        n0, poured = (float(str(point.values[name])) for name in ("n0", "poured"))
        assert scene.count / scene.container.radius_m**3 == pytest.approx(n0 / 0.0234**3, rel=1e-3)
        assert deposit.per_layer == round(poured * (scene.count / n0) ** (2 / 3))
        if ratio == 0.7:
            assert (n0, poured) == paper[0.7]
        # Height over radius by Gravish's φ_f, interpolated between l/w = 0, 0.1 and 0.2.
        packing = 0.130 if ratio == 0.7 else float(np.interp(ratio, [0, 0.1, 0.2], [0.270, 0.235, 0.208]))
        height = n0 * scene.smarticle.boxes.volume / packing / (math.pi * 0.0234**2)
        assert height == pytest.approx(0.02153, rel=2e-3)


def test_seeds_are_more_where_piles_are_cheap_and_any_first_part_has_all_points(shipped: list[Point]) -> None:
    seeds: dict[tuple[float, int], list[int]] = {}
    for point in shipped:
        seeds.setdefault((point.scene.smarticle.aspect_ratio, point.scene.count), []).append(point.scene.seed)
    assert len(shipped) == 159
    assert sorted(seeds) == sorted([(0.7, size) for size in SEEDS] + [(r, n) for r in RATIOS for n in list(SEEDS)[:4]])
    for (ratio, count), own in seeds.items():
        few = count == 1000 and ratio in (0.09, 0.13)
        assert sorted(own) == list(range(1, (3 if few else SEEDS[count]) + 1))
    assert {(p.values["l_over_w"], p.values["count"]) for p in shipped[: len(seeds)]} == set(seeds)
