"""The factorial of the paper's two sets of rules: main effects are those put in, the figure has every combination."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from postprocess.statistics.columns import ASPECT, SEED
from studies.base.activity import ENERGY, HEIGHT, PHI_ACTIVE
from studies.base.procedures import CROSSINGS
from studies.procedures.factors import FACTORS, FRICTION, LAW, QUANTITIES, RADIUS, Factors, effects

SCATTER = {CROSSINGS: 0.1, HEIGHT: 0.01, PHI_ACTIVE: 0.001, ENERGY: 1e-6}


def runs(**put_in: dict[str, float]) -> pd.DataFrame:
    """A full factorial of eight seeds; `put_in` says by how much each of the code's rules changes a quantity."""
    generator, rows = np.random.default_rng(0), []
    for law, friction, radius, aspect, seed in product(*FACTORS.values(), (0.7, 1.0), range(1, 9)):
        row = {LAW: law, FRICTION: friction, RADIUS: radius, ASPECT: aspect, SEED: seed}
        for quantity, size in SCATTER.items():
            value = {CROSSINGS: 5.0, HEIGHT: 1.0, PHI_ACTIVE: 0.12, ENERGY: 1e-4}[quantity] + aspect * size
            for factor, change in put_in.get(quantity, {}).items():
                value += change * (row[factor] == FACTORS[factor][1])
            row[quantity] = value + size * generator.standard_normal()
        rows.append(row)
    return pd.DataFrame(rows)


def test_an_effect_is_that_put_in_and_others_stay_out_of_it() -> None:
    table = runs(**{CROSSINGS: {LAW: 2.0, FRICTION: 1.0}})
    for factor, size in ((LAW, 2.0), (FRICTION, 1.0), (RADIUS, 0.0)):
        differences = effects(table, CROSSINGS, factor)[CROSSINGS]
        assert len(differences) == 64
        # Four standard errors of a mean of 64 differences of two.
        assert differences.mean() == pytest.approx(size, abs=4 * 0.1 * np.sqrt(2 / 64))


def test_verdicts_follow_the_effects() -> None:
    table = runs(**{CROSSINGS: {LAW: 2.0}, HEIGHT: {LAW: 0.3, FRICTION: -0.2}, PHI_ACTIVE: {FRICTION: -0.02}})
    found = {finding.paper: finding for finding in Factors().judge({"runs": table})}
    assert len(found) == len(QUANTITIES) * len(FACTORS)

    def verdict(start: str) -> str:
        (one,) = [finding.verdict for paper, finding in found.items() if paper.startswith(start)]
        return one

    assert verdict("(ours) ⟨N⟩ after a shape change is raised by the motor's law") == "found"
    assert verdict("(ours) ⟨N⟩ after a shape change is raised by friction") == "not resolved"
    assert verdict("(ours) h/h0 after a shape change is raised by the motor's law") == "found"
    assert verdict("(ours) h/h0 after a shape change is raised by friction") == "not found"
    assert verdict("(ours) φ_f after a shape change is lowered by friction") == "found"
    assert verdict("(ours) energy per smarticle [J] after a shape change is raised by the wall's") == "not resolved"


def test_rules_that_were_not_run_have_no_effect() -> None:
    table = runs()
    found = Factors().judge({"runs": table[table[LAW] == "ease"]})
    assert {finding.verdict for finding in found if "motor's law" in finding.paper} == {"no data"}


def test_the_figure_names_every_combination(tmp_path: Path) -> None:
    table = runs(**{CROSSINGS: {LAW: 2.0}})
    rows = []
    for key, group in table.groupby([*FACTORS, ASPECT]):
        row = dict(zip((*FACTORS, ASPECT), key, strict=True))
        for quantity in QUANTITIES:
            head, unit = quantity.rsplit(" [", 1)
            row |= {quantity: group[quantity].mean(), f"{head} 95 % [{unit}": 2 * group[quantity].sem()}
        rows.append(row)
    analysis: Any = SimpleNamespace(tables={"points": pd.DataFrame(rows)})
    files = Factors().draw(tmp_path, analysis, ["Footer."])
    svg = next(path for path in files if path.suffix == ".svg").read_text(encoding="utf-8")
    for law, friction, radius in product(*FACTORS.values()):
        assert f"{law}, μ = {friction:g}, r = {1e3 * radius:.1f} mm" in svg
    with Image.open(next(path for path in files if path.suffix == ".png")) as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    assert (np.ptp(pixels, axis=2) > 60).mean() > 0.001
