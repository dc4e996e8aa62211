"""The stable time step: modes that it knows are stable just below it, and blow up above; piles come to rest at it."""

from dataclasses import replace
from typing import Any

import builds
import numpy as np
import pytest
from scenes import small

from dem.engine.links.stable_step import SHAPES, WIDEST, links_stable_time_step
from dem.plan.steps import stable_step, time_steps
from dem.run.build import build_engine
from dem.scene.scene import Scene


def test_it_goes_with_the_root_of_the_stiffness_and_shrinks_with_damping() -> None:
    p = builds.particle()
    soft = links_stable_time_step(p, builds.ELASTIC)
    hard = links_stable_time_step(p, replace(builds.ELASTIC, normal_stiffness=2000.0, tangential_stiffness=1640.0))
    assert soft / hard == pytest.approx(2.0)
    assert links_stable_time_step(p, replace(builds.ELASTIC, normal_damping=0.2, wall_damping=0.2)) < soft
    # Free barbs are lighter at their tips than the same shapes while they are welded.
    welded = [builds.particle(angles=(angle, angle)) for angle in np.linspace(0.0, WIDEST, SHAPES)]
    least = min(links_stable_time_step(each, builds.ELASTIC) for each in welded)
    assert links_stable_time_step(p, builds.ELASTIC, articulated=True) < 0.95 * least
    assert links_stable_time_step(p, builds.ELASTIC, strings=[(1e6, 0.0)]) < soft


def test_a_bar_on_the_floor_is_stable_below_its_own_limit_and_not_above() -> None:
    # Two springs on the whole mass: ω² = 2k/m, stable while ω dt < 2; a nudge grows beyond.
    p = builds.particle(aspect=0.0)
    limit = 2 / np.sqrt(2 * 500.0 / p.boxes.mass)
    assert links_stable_time_step(p, builds.ELASTIC) < limit
    kinetic = []
    for share in (0.98, 1.02):
        made = builds.engine(law=builds.ELASTIC, gravity=9.81, dt=share * limit, made_of=p)
        made.add(builds.at([0, 0, builds.DIAMETER / 2 - p.boxes.mass * 9.81 / 1000.0 * 1.01]))
        made.advance(400)
        kinetic.append(made.state().kinetic_energy)
    assert kinetic[1] > 100 * kinetic[0]


THIN, THICK = ({"shape": "rod", "length_m": 0.015, "diameter_m": diameter} for diameter in (0.6e-3, 3e-3))
FREE = {"law": "free", "axes": 3}
MIXTURES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "rods": (THIN | {"count": 30}, THICK | {"count": 10}),
    "staples and rods": (
        {"shape": "staple", "crown_m": 0.0117, "leg_m": 0.008, "count": 8},
        {"shape": "rod", "length_m": 0.02, "diameter_m": 3e-3, "count": 8},
    ),
    "light and heavy": tuple(
        {"shape": "star", "arm_m": 0.006, "diameter_m": 1e-3, "density_kg_per_m3": density, "count": 5}
        for density in (500.0, 10000.0)
    ),
    "chains": (
        {"shape": "chain", "links": 2, "link_m": 0.012, "diameter_m": 3e-3, "joints": FREE, "count": 4},
        {"shape": "chain", "links": 3, "link_m": 0.008, "diameter_m": 0.8e-3, "joints": FREE, "count": 4},
    ),
    "filaments": tuple(
        {"shape": "filament", "length_m": length, "diameter_m": diameter, "segments": 6, "young_modulus_Pa": 1e6}
        | {"bending_time_s": 1e-4, "stretching_time_s": 1e-5, "count": 4}
        for length, diameter in ((0.02, 0.8e-3), (0.03, 3e-3))
    ),
}


def mixed(*particle: dict[str, Any], **changes: Any) -> Scene:
    count = sum(each["count"] for each in particle)
    return small(
        {"engine": "links", "count": count, "particle": list(particle), "phases": [{"type": "deposit"}]} | changes
    )


@pytest.mark.parametrize("name", MIXTURES)
def test_the_step_of_a_mixture_is_that_of_its_quickest_kind_in_any_order(name: str) -> None:
    one, other = MIXTURES[name]
    step = stable_step(mixed(one, other))
    assert stable_step(mixed(other, one)) == pytest.approx(step, rel=1e-12)
    # Heavier neighbours add nothing: two light bodies against each other are stiffer.
    fidelity = {"base": "draft", "stiffness_N_per_m": mixed(one, other).fidelity.stiffness_N_per_m}
    alone = (mixed(each, fidelity=fidelity) for each in (one, other))
    assert step == pytest.approx(min(map(stable_step, alone)), rel=1e-9)


def unbalanced_after_pour(scene: Scene, factor: float) -> float:
    """Mean net force over the weight [1], the largest in 20 ms, 0.1 s after a pour at `factor` times the usual step."""
    step = factor * time_steps(scene)[0]
    engine, stage, poured = build_engine(scene, step), scene.phases[0].begin(scene, 0), 0.0
    while (wait := stage.proceed(engine)) and not (poured and engine.time > poured + 0.8):
        engine.advance(max(1, round(wait / step)))
        poured = poured or (0.0 if stage.memory["left"] else engine.time)
    engine.advance(round(0.1 / step))
    found = []
    for _ in range(5):
        engine.advance(round(4e-3 / step))
        found.append(engine.unbalanced_force())
    return max(found)


@pytest.mark.parametrize("name", MIXTURES)
def test_a_pile_of_unequal_bodies_that_nothing_drives_comes_to_rest(name: str) -> None:
    # Bodies that roll or swing on keep a few hundredths at most; chatter is 0.07 and more.
    assert unbalanced_after_pour(mixed(*MIXTURES[name]), 1.0) < 0.04


@pytest.mark.parametrize("name", ["rods", "staples and rods", "chains"])
def test_such_a_pile_chatters_at_steps_that_are_too_long(name: str) -> None:
    # At twice the step some seeds rest still; at 2.5 times it, three of three chatter at 0.09 and more.
    assert unbalanced_after_pour(mixed(*MIXTURES[name]), 2.5) > 0.07


def test_strongly_damped_rods_of_unequal_thickness_come_to_rest() -> None:
    scene = mixed(THIN | {"count": 12}, THICK | {"count": 4}, **{"contact.restitution": 0.2})
    assert unbalanced_after_pour(scene, 1.0) < 0.04


WIDE = {"shape": "rod", "length_m": 0.0146, "density_kg_per_m3": 2400, "count": 24}
WIDE |= {"thickness_normal_m": 2.2e-3, "thickness_in_plane_m": 0.34e-3}


@pytest.mark.parametrize(("factor", "chatters"), [(1.0, False), (1.8, True)])
def test_wide_bars_that_lie_on_each_other_with_all_strands_come_to_rest(factor: float, chatters: bool) -> None:
    scene = mixed(WIDE, fidelity="standard", seed=1, **{"container.radius_m": 0.017})
    assert (unbalanced_after_pour(scene, factor) > 0.07) == chatters
