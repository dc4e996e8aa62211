"""The surfaces of bodies on links: tops are those of their strands; a plate begins there, and kicks nothing."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from scenes import small
from scipy.spatial.transform import Rotation

from dem.body.outline import tops_of
from dem.body.placement import Poses
from dem.engine.links.engine import LinksEngine
from dem.engine.links.shapes import RADIUS
from dem.phases.compress import Compress
from dem.plan.steps import time_steps
from dem.run.build import build_engine
from dem.scene.scene import Scene

Array = np.ndarray
EDGE = {"thickness_normal_m": 3e-3, "thickness_in_plane_m": 0.5e-3}  # a flat bar, which may stand on its edge
STAPLE = {"shape": "staple", "crown_m": 0.0117, "leg_m": 0.006, **EDGE}
BODIES: dict[str, dict[str, Any]] = {
    "one strand": {"fidelity": "draft"},
    "two strands": {"fidelity": "standard"},
    "three strands": {"fidelity": "reference"},
    "without barbs": {"fidelity": "standard", "smarticle.aspect_ratio": 0.0},
    "flat": {"fidelity": "standard", "particle": [STAPLE]},
    "flat and twisted": {"fidelity": "reference", "particle": [{**STAPLE, "twist_deg": 70}]},
    "of two thicknesses": {
        "fidelity": "standard",
        "particle": [{"shape": "rod", "length_m": 0.012, "diameter_m": d} for d in (0.6e-3, 3e-3)],
    },
    "filaments": {
        "particle": [
            {"shape": "filament", "length_m": 0.02, "diameter_m": 1e-3, "segments": 8, "young_modulus_Pa": 1e5}
        ]
    },
    "chains": {
        "particle": [
            {"shape": "chain", "links": 4, "link_m": 0.005, "diameter_m": 1e-3, "joints": {"law": "free", "axes": 3}}
        ]
    },
}
OFFSET = {"two strands", "three strands", "without barbs", "flat", "flat and twisted"}
COMPRESS = {"type": "compress", "speed_m_per_s": 0.02, "strain": 0.2}


def scene_with(name: str, **changes: Any) -> Scene:
    phases = [{"type": "deposit", "per_layer": 6}, COMPRESS]
    return small({"engine": "links", "count": 12, "phases": phases, **BODIES[name], **changes})


def apart(scene: Scene, turns: Sequence[Rotation] | None = None) -> LinksEngine:
    """An engine with the scene's bodies one above the other, turned at random unless given."""
    engine = build_engine(scene, min(time_steps(scene)))
    assert isinstance(engine, LinksEngine)
    places = np.column_stack([np.zeros((scene.count, 2)), 0.03 * np.arange(1, 1 + scene.count)])
    turned = tuple(turns or Rotation.random(scene.count, random_state=1))
    engine.add(Poses(places, turned, None if scene.mixture is None else scene.mixture.of))
    return engine


def tops_of_strands(engine: LinksEngine) -> Array:
    """(N,) heights of the highest points of the swept spheres that contacts meet."""
    lines, found = engine._world.segments.line, np.full(engine.count, -np.inf)
    highest = np.maximum(lines[:, 2], lines[:, 2] + lines[:, 5]) + lines[:, RADIUS]
    np.maximum.at(found, engine._world.segments.body, highest)
    return found


@pytest.mark.parametrize("name", BODIES)
def test_no_strand_is_higher_than_the_tops_of_bodies(name: str) -> None:
    scene = scene_with(name)
    engine = apart(scene)
    state, expected = engine.state(), tops_of_strands(engine)
    above = tops_of(state, scene.model) - expected
    assert above.min() > -1e-12
    # A tip counts as if it were round about its end.
    assert above.max() < scene.model.radius + 1e-12
    # An axis and a radius, here the largest one, are not enough where strands lie beside the axis.
    short = (expected - state.tops).max() - scene.model.radius
    assert (short > 1e-4) == (name in OFFSET)


@pytest.mark.parametrize("name", BODIES)
def test_a_plate_begins_where_it_touches_bars_on_their_edge(name: str) -> None:
    scene = scene_with(name)
    engine = apart(scene, [Rotation.from_rotvec([0.0, 0.0, angle]) for angle in range(scene.count)])
    scene.phases[1].begin(scene, 1).proceed(engine)
    # Legs that are twisted rise, and end in tips.
    slack = scene.model.radius if "twisted" in name else 0.0
    assert engine.boundaries.plate_height is not None
    above = engine.boundaries.plate_height - tops_of_strands(engine).max()
    assert -1e-12 < above <= slack + 1e-12


@pytest.mark.parametrize(("name", "seed"), [("two strands", 2), ("flat", 2)])
def test_a_plate_kicks_nothing_when_it_begins(name: str, seed: int) -> None:
    """A kick at the start: 7 m/s of smarticles, and blown up staples, where the plate began at axis and radius."""
    scene = scene_with(name, seed=seed, **{"container.radius_m": 0.012})
    engine, steps = build_engine(scene, min(time_steps(scene))), time_steps(scene)
    for index, phase in enumerate(scene.phases):
        engine.set_time_step(steps[index])
        stage = phase.begin(scene, index)
        while (wait := stage.proceed(engine)) and not isinstance(phase, Compress):
            engine.advance(max(1, round(wait / engine.time_step)))
    assert engine.state().speeds.max() < 0.005
    before, given, fastest = engine.boundaries.plate_sum[2], engine.ledger.container_work, 0.0
    engine.advance(1)
    # The plate has come down by half a step: under two contacts, less than a hundredth of the weight of a body.
    weight = scene.model.mass * scene.gravity_m_per_s2
    assert engine.boundaries.plate_sum[2] - before < weight
    for _ in range(100):
        engine.advance(1)
        fastest = max(fastest, float(engine.state().speeds.max()))
    # The longest lever that the plate can press is a body over the thickness of one that it lies on.
    assert fastest < 0.02 * scene.model.size / scene.model.thicknesses[1]
    # It does not pay for what overlaps at once.
    assert 0 <= engine.ledger.container_work - given < weight * scene.model.size


@pytest.mark.parametrize("name", ["two strands", "flat", "flat and twisted"])
def test_no_strand_of_a_poured_layer_begins_in_floor_wall_or_another_body(name: str) -> None:
    for seed in range(8):  # with spheres alone, which leave out strands at twisted joints, four begin in the wall
        scene = scene_with(name, seed=seed, **{"container.radius_m": 0.0095})
        engine = build_engine(scene, min(time_steps(scene)))
        scene.phases[0].begin(scene, 0).proceed(engine)
        assert engine.count == 6
        assert engine.overlaps(1e-9).deepest == 0
