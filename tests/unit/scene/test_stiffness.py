"""Stiffness from loads and speeds: raised where a name leaves it open, rejected where it is given too soft."""

import math
import re
from typing import Any

import pytest
from scenes import small

from dem.errors import InputError
from dem.plan.steps import time_step
from dem.scene.scene import Scene
from dem.scene.stiffness import LIMIT, WANTED, expected_overlaps, stiffness_for

THROWN = {"type": "deposit", "thrown_at_m_per_s": 3.0}


def links(**changes: Any) -> Scene:
    return small({"engine": "links", "fidelity": "draft", **changes})


def deepest(scene: Scene) -> float:
    return max(overlap.widths for overlap in expected_overlaps(scene))


@pytest.mark.parametrize(("base", "stiffness"), [("draft", 500.0), ("standard", 1000.0), ("reference", 2000.0)])
def test_ordinary_scenes_keep_the_stiffness_of_their_name(base: str, stiffness: float) -> None:
    for ratio in (0.0, 0.4, 1.1):
        scene = links(fidelity=base, smarticle={"aspect_ratio": ratio})
        assert scene.fidelity.stiffness_N_per_m == stiffness
        assert deepest(scene) < WANTED[base]


@pytest.mark.parametrize("base", WANTED)
@pytest.mark.parametrize("changes", [{"phases": [THROWN]}, {"gravity_m_per_s2": 100.0}])
def test_hard_scenes_get_what_they_need(changes: dict[str, Any], base: str) -> None:
    scene = links(fidelity=base, **changes)
    assert scene.fidelity.stiffness_N_per_m > 1000.0
    assert 0.9 * WANTED[base] < deepest(scene) <= WANTED[base]
    assert scene.fidelity.base == base
    # A resolved scene says its stiffness, and stays as it is when it is read again.
    again = Scene.model_validate(scene.model_dump(mode="json"))
    assert again.fidelity == scene.fidelity


def test_a_layer_that_falls_from_a_high_slab_needs_as_much_as_its_fall() -> None:
    speeds = []
    for height in (0.5, 1.0, 4.0):
        impact, _ = expected_overlaps(links(phases=[{"type": "deposit", "layer_height_w": height}]))
        speeds.append(float(re.findall(r"[\d.]+", impact.cause)[0]))
    assert speeds == [0.48, 0.48, 0.96]  # √(2 g w), and twice that


def test_a_given_stiffness_is_kept_or_rejected_with_the_number_that_is_needed() -> None:
    needed = links(phases=[THROWN]).fidelity.stiffness_N_per_m
    softer = links(phases=[THROWN], fidelity={"base": "draft", "stiffness_N_per_m": needed / 2})
    assert softer.fidelity.stiffness_N_per_m == needed / 2
    time_step(softer)
    with pytest.raises(InputError, match=re.escape(f"use about {needed:.2g} N/m, or leave it out")):
        time_step(links(phases=[THROWN], fidelity={"base": "draft", "stiffness_N_per_m": 100.0}))
    assert deepest(softer) < LIMIT


def test_overlaps_fall_with_the_root_of_the_stiffness_in_impacts_and_with_itself_under_weight() -> None:
    soft, stiff = (links(fidelity={"base": "draft", "stiffness_N_per_m": kn}) for kn in (250.0, 1000.0))
    (impact, weight), (less, lighter) = (expected_overlaps(scene) for scene in (soft, stiff))
    assert impact.widths == pytest.approx(2 * less.widths)
    assert weight.widths == pytest.approx(4 * lighter.widths)
    assert less.stiffness == pytest.approx(impact.stiffness)
    assert math.isclose(stiffness_for(soft), stiffness_for(stiff))


def test_other_engines_keep_theirs() -> None:
    assert small({"fidelity": "draft", "phases": [THROWN]}).fidelity.stiffness_N_per_m == 250.0
