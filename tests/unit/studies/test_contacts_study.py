"""The factorial of contacts: effects are those put in, nothing is said of noise, errors are those of seeds."""

from __future__ import annotations

import re
from collections.abc import Mapping
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from synthetic import SyntheticRun, write_run

from dem.errors import InputError
from dem.record.manifest import read_run
from postprocess.statistics.columns import ASPECT, SEED, SEEDS
from studies.base.questions import Question
from studies.base.report import Report
from studies.framework.provenance import read_reference, reference_at
from studies.friction.contact_effects import (
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
    TOGETHER,
    WALL,
    answers,
    by_seed,
    effects,
    points,
    risen,
)
from studies.friction.contacts import Contacts
from studies.friction.measure import FRICTION
from studies.registry import study_file
from templates.sweep.expand import expand
from templates.sweep.sweep_file import load_sweep

RATIOS = (0.4, 0.7, 1.0)
NOISE = 0.003
SEED_NOISE = 0.004  # of what all combinations of a seed share: their poses
LEVELS = {PHI_0: 0.11, PHI_F: 0.15, PHI_RELAXED: 0.16, CROSSED: 6.0, RISEN: -0.1}


def runs(
    put_in: Mapping[str, Mapping[str, float]] | None = None, *, together: float = 0.0, noise: float = NOISE
) -> pd.DataFrame:
    """A full factorial of eight seeds; `put_in` says by how much each factor's second level changes a quantity."""
    generator, rows = np.random.default_rng(3), []
    shared = {(ratio, seed): SEED_NOISE * generator.standard_normal() for ratio in RATIOS for seed in range(1, 9)}
    for *levels, ratio, seed in product(*FACTORS.values(), RATIOS, range(1, 9)):
        row: dict[str, float] = {**dict(zip(FACTORS, levels, strict=True)), ASPECT: ratio, SEED: seed}
        for quantity, level in LEVELS.items():
            value = level - 0.02 * ratio + shared[ratio, int(seed)] + noise * generator.standard_normal()
            changed = {name: row[name] == FACTORS[name][1] for name in FACTORS}
            value += sum(change * changed[factor] for factor, change in (put_in or {}).get(quantity, {}).items())
            value += together * (changed[FRICTION] and changed[WALL]) * (quantity == PHI_F)
            row[quantity] = value
        rows.append(row)
    return pd.DataFrame(rows)


def answered(table: pd.DataFrame) -> dict[str, str]:
    return {one.question: one.answer for one in answers(table, points(table))}


def asked(found: dict[str, str], *words: str) -> str:
    (answer,) = [answer for question, answer in found.items() if all(word in question for word in words)]
    return answer


def test_effects_are_those_put_in_and_what_a_seed_shares_is_no_scatter() -> None:
    table = runs({PHI_F: {FRICTION: -0.02, WALL: -0.005}})
    found = effects(table).set_index([QUANTITY, FACTOR, ASPECT])
    for factor, size in (
        (CALLED[FRICTION], -0.02),
        (CALLED[WALL], -0.005),
        (CALLED[RESTITUTION], 0.0),
        (TOGETHER, 0.0),
    ):
        row = found.loc[("phi_f", factor, EVERYWHERE)]
        # A seed's effect is a mean of four differences (two for the interaction, of differences twice as wide): the
        # error is that of the noise alone, by √24 seeds.
        error = NOISE * np.sqrt(2 / 4) * (2 if factor == TOGETHER else 1) / np.sqrt(24)
        assert row[SEEDS] == 24
        assert row[EFFECT] == pytest.approx(size, abs=4 * error)
        standard = EFFECT.replace(" [", " SE [")
        assert 0.6 * error < row[standard] < 1.5 * error
    assert found.loc[("phi_f", CALLED[FRICTION], "0.7")][SEEDS] == 8


def test_an_interaction_is_the_difference_of_effects() -> None:
    table = runs(together=-0.01, noise=0.0)
    assert by_seed(table, PHI_F, FRICTION, WALL)[PHI_F].to_numpy() == pytest.approx(-0.01)
    # It is half in either effect, which is a mean over the other factor.
    assert by_seed(table, PHI_F, WALL)[PHI_F].to_numpy() == pytest.approx(-0.005)


def test_each_answer_is_given_to_data_that_deserve_it() -> None:
    one = answered(runs({PHI_F: {FRICTION: -0.02, WALL: 0.01}, RISEN: {WALL: 0.1}}))
    assert asked(one, "phi_f fall", "between smarticles") == "yes"
    assert asked(one, "phi_f fall", "at the container") == "no"
    assert asked(one, "phi_f fall", "restitution") == "undetermined"
    assert asked(one, "phi_0 fall", "between smarticles") == "undetermined"
    assert asked(one, "more than friction at the container") == "yes"
    assert asked(one, "lowest") == "yes"
    other = answered(runs({PHI_F: {WALL: -0.02}}, together=-0.01))
    assert asked(other, "more than friction at the container") == "no"
    assert asked(other, "more where that between") == "yes"


@pytest.mark.parametrize(
    ("off", "noise", "answer"), [(0.0, 1e-4, "yes"), (0.09, 1e-4, "no"), (0.04, 3e-3, "undetermined")]
)
def test_gravish_is_met_or_missed_only_beyond_all_errors(off: float, noise: float, answer: str) -> None:
    table = runs(noise=noise)
    reference, generator = read_reference(), np.random.default_rng(5)
    at = table[ASPECT].map({ratio: reference_at(reference, ratio, "phi_f") for ratio in RATIOS})
    # The error of reading alone is ± 0.003, up to 2.9 % of φ_f.
    table[PHI_F] = at * (1 + off) + noise * generator.standard_normal(len(table))
    assert asked(answered(table), "within 5 %") == answer


def test_a_combination_that_lacks_an_aspect_ratio_is_not_accepted() -> None:
    table = runs(noise=1e-4)
    reference = read_reference()
    at = table[ASPECT].map({ratio: reference_at(reference, ratio, "phi_f") for ratio in RATIOS})
    right = (table[FRICTION] == 0.8) & (table[WALL] == 0.4) & (table[RESTITUTION] == 0.7)
    table[PHI_F] = at * np.where(right, 1.0, 1.2)
    assert asked(answered(table), "within 5 %") == "yes"
    assert asked(answered(table[~(right & (table[ASPECT] == 0.4))]), "within 5 %") == "undetermined"


def test_deviations_have_the_error_of_reading_in_them() -> None:
    table = points(runs(noise=1e-6))
    row = table[table[ASPECT] == 0.7].iloc[0]
    own = row[PHI_F.replace(" [", " 95 % [")]
    assert row["deviation of phi_f from Gravish 95 % [%]"] == pytest.approx(100 * np.hypot(own, 0.003) / 0.130)
    assert row[DEVIATION] == pytest.approx(100 * (row[PHI_F] / 0.130 - 1))


def test_runs_that_are_missing_take_their_pairs_with_them() -> None:
    table = runs({PHI_F: {FRICTION: -0.02}}, noise=0.0)
    gone = (table[FRICTION] == 0.8) & (table[SEED] == 3) & (table[ASPECT] == 0.7)
    left = by_seed(table[~gone], PHI_F, FRICTION)
    assert len(left) == 23
    assert left[PHI_F].to_numpy() == pytest.approx(-0.02)
    assert by_seed(table[table[FRICTION] == 0.4], PHI_F, FRICTION).empty


def test_a_factor_that_was_not_varied_everywhere_leaves_a_gap() -> None:
    table = runs()
    left = table[(table[ASPECT] == 0.7) | (table[RESTITUTION] == 0.7)]
    analysis: Any = SimpleNamespace(tables={"effects": effects(left)})
    header, rows = Contacts().table(analysis)
    assert header[2:] == ["l/w 0.4", "l/w 0.7", "l/w 1", "all", "of the mean [%]"]
    assert {len(row) for row in rows} == {len(header)}
    (gap,) = [row for row in rows if row[:2] == ["phi_f", CALLED[RESTITUTION]]]
    assert (gap[2], gap[4]) == ("–", "–")
    assert gap[3] == gap[5]


def test_the_figure_names_every_combination(tmp_path: Path) -> None:
    table = runs()
    analysis: Any = SimpleNamespace(tables={"points": points(table)})
    files = Contacts().draw(tmp_path, analysis, ["Footer."])
    svg = next(path for path in files if path.suffix == ".svg").read_text(encoding="utf-8")
    for between, wall, restitution in product(*FACTORS.values()):
        assert f"μ = {between:g}, container {wall:g}, e = {restitution:g}" in svg


def test_the_sweep_has_every_combination_once_per_seed_and_ratio() -> None:
    for quick, count in ((False, 192), (True, 16)):
        found = expand(load_sweep(study_file("contacts", quick=quick)))
        assert len(found) == count
        contacts = {
            (p.scene.contact.friction_smarticle, p.scene.contact.friction_wall, p.scene.contact.restitution)
            for p in found
        }
        assert contacts == set(product(*FACTORS.values()))


def test_the_lowest_tenth_rises_by_what_the_piles_height_makes_it(tmp_path: Path) -> None:
    run = SyntheticRun(packing=(0.100, 0.105, 0.090, 0.100), floor_z=0.003)
    manifest = read_run(write_run(tmp_path / "run", run))
    # Heights are shares of that of the pile; of twelve smarticles one is a tenth. Frames scatter by 0.2 % of φ.
    before = np.mean([run.height(0.105 * (1 + shift)) for shift in (0.002, -0.002)])
    after = run.height(0.090 * (1 - 0.002))
    assert risen(manifest) == pytest.approx(run.shares()[0] * (after - before) / manifest.middle_length, rel=1e-5)


def test_a_run_that_tells_no_contact_is_refused(tmp_path: Path) -> None:
    manifest = read_run(write_run(tmp_path / "run", SyntheticRun()))
    with pytest.raises(InputError, match=re.escape("give runs of the study contacts")):
        Contacts().measure(manifest)


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Report[Question]]:
    """Every combination at one l/w, two seeds: friction between smarticles takes a tenth of φ, the container's none."""
    root = tmp_path_factory.mktemp("contacts")
    directories = []
    for (between, wall, restitution), seed in product(product(*FACTORS.values()), (1, 2)):
        share = (0.9 if between > 0.5 else 1.0) * (1 + 0.001 * seed * (1 + wall))
        packing = tuple(share * value for value in (0.100, 0.105, 0.130, 0.132))
        run = SyntheticRun(seed=seed, packing=packing, friction=between, friction_wall=wall, restitution=restitution)
        directories.append(write_run(root / f"mu{between}_wall{wall}_e{restitution}_seed{seed}", run))
    return root, Contacts().analyse(
        directories, root / "out", note="the full study", command="smarticles study contacts"
    )


def test_from_runs_to_answers(study: tuple[Path, Report[Question]]) -> None:
    root, report = study
    found = {one.question: one for one in report.judged}
    assert asked({name: one.answer for name, one in found.items()}, "phi_f fall", "between smarticles") == "yes"
    table = report.tables["effects"].set_index([QUANTITY, FACTOR, ASPECT])
    effect = table.loc[("phi_f", CALLED[FRICTION], EVERYWHERE)]
    # A tenth of 0.130, and of what seeds add to it.
    assert effect[EFFECT] == pytest.approx(-0.0130, rel=5e-3)
    assert abs(table.loc[("phi_f", CALLED[RESTITUTION], EVERYWHERE)][EFFECT]) < 1e-9
    text = (root / "out" / "contacts.md").read_text(encoding="utf-8")
    assert "| phi_f | friction between smarticles | -0.0130 ±" in text
    assert {"runs.csv", "points.csv", "effects.csv", "answers.csv", "contacts.png"} <= set(report.files)


@pytest.mark.usefixtures("undrawn")
def test_a_combination_twice_is_refused(study: tuple[Path, Report[Question]], tmp_path: Path) -> None:
    root = study[0]
    twin = SyntheticRun(friction=0.4, friction_wall=0.4, restitution=0.7)
    with pytest.raises(InputError, match=r"combination = .* with seed 1 is given twice"):
        Contacts().analyse(
            [root / "mu0.4_wall0.4_e0.7_seed1", write_run(tmp_path / "twin", twin)],
            tmp_path / "out",
            note="",
            command="",
        )
