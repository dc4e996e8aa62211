"""Benchmarks run for minutes; that their scenes are valid is known at once."""

from __future__ import annotations

from typing import Any

import pandas as pd
import pytest

from benchmarks import effects, scaling
from dem.plan.effects import EFFECTS, decide
from dem.plan.steps import time_step
from dem.scene.reading import parse_scene

PAIRS = effects.pairs(0.4, 2e-5)


@pytest.mark.parametrize("pair", PAIRS, ids=[f"{k} {pair.effect}" for k, pair in enumerate(PAIRS)])
def test_pairs_of_runs_are_valid_and_differ_by_their_effect(pair: effects.Pair) -> None:
    scenes = [
        parse_scene(effects.scene_data(changes, count=60, seed=1), source="benchmarks")
        for changes in (pair.without, pair.with_)
    ]
    assert all(time_step(scene) > 0 for scene in scenes)
    assert (scenes[0] == scenes[1]) == (pair.effect == "none")
    assert [scene.phases[0].type for scene in scenes] == ["deposit", "deposit"]
    durations = [scene.phases[effects.MEASURED].model_dump()["duration_s"] for scene in scenes]
    assert durations == [0.4, 0.4]


def test_every_effect_that_costs_anything_is_measured_in_a_pair() -> None:
    switched: set[str] = set()
    for pair in PAIRS:
        on = [
            {one.name for one in decide(parse_scene(effects.scene_data(data, count=60, seed=1), source="b")) if one.on}
            for data in (pair.without, pair.with_)
        ]
        switched |= on[1] - on[0]
    named = {name for pair in PAIRS for name in (pair.effect, *pair.effect.split(" and "))}
    # Numbers of the contact law cost the same whatever they are; a pile without its wall is another pile, and a chain
    # in a plane no pile at all.
    left_out = {"contact", "gravity", "friction", "restitution", "wall removal", "container", "plane", "strings"}
    assert {effect.name for effect in EFFECTS} - left_out <= named
    assert {"hooks", "energies", "energy account", "sphere glyphs", "checkpoints", "motors"} <= switched


@pytest.mark.parametrize("count", scaling.COUNTS)
def test_piles_of_any_number_are_as_high(count: int) -> None:
    scene = parse_scene(scaling.scene_of(count), source="benchmarks")
    assert time_step(scene) > 0
    area = scene.container.radius_m**2
    assert count / area == pytest.approx(scaling.PAPER_COUNT / scaling.PAPER_RADIUS**2)


def test_the_table_of_scaling_takes_the_least_time_of_every_stretch_and_says_growth_and_gain() -> None:
    def told(wall: list[float], processor: list[float]) -> dict[str, Any]:
        return {"wall": wall, "processor": processor, "touches": 2.0, "memory": 100.0, "height": 0.01}

    each = 1e6 / (scaling.LENGTH * scaling.STRETCHES)
    rows = [
        scaling.row_of(100, 1, [told([1.0, 3.0], [1.0, 2.0]), told([2.0, 1.0], [2.0, 1.0])]),
        scaling.row_of(100, 2, [told([0.5, 0.5], [1.0, 1.0])]),
        scaling.row_of(200, 1, [told([5.0, 1.0], [4.0, 2.0])]),
    ]
    assert rows[0][scaling.WALL] == pytest.approx(2.0 * each / 100)
    table = scaling.with_ratios(pd.DataFrame(rows))
    assert table["faster than one thread [1]"].tolist() == pytest.approx([1.0, 2.0, 1.0])
    assert table["growth against N = 100 [1]"].tolist()[::2] == pytest.approx([1.0, 1.5])
