"""Closed bodies are not linked when they are poured, in whatever order and mixture, and go on unlinked."""

from typing import Any

import numpy as np
import pytest
import yaml
from scenes import small

from dem.body.loops import Curves, loops_of
from dem.body.placement import place_layer
from dem.body.state import bars_by_body
from dem.phases.deposit import Deposit
from dem.plan.steps import time_step
from dem.run.build import build_engine
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene
from postprocess.measures.linking import gauss_integral
from smarticles.starters import starter

D = 0.0008
RING = {"shape": "ring", "radius_m": 0.007, "segments": 9, "diameter_m": D}
LADDER = {
    "shape": "segments",
    "points_m": [[x, y, 0] for y in (-0.005, 0.005) for x in (-0.012, 0, 0.012)],
    "pairs": [[0, 1], [1, 2], [3, 4], [4, 5], [0, 3], [1, 4], [2, 5]],
    "diameter_m": D,
}
CLIP = {
    "shape": "segments",
    "points_m": [[0, 0, 0], [0.01, 0, 0], [0.01, 0.01, 0], [0.002, 0.01, 0], [0.002, 0.001, 0], [0.006, 0.001, 0]],
    "pairs": [[k, k + 1] for k in range(5)],
    "diameter_m": D,
}


def linked(scene: Scene) -> tuple[int, int]:
    """How many bodies are poured, and how many pairs of them are linked at any time while that goes on."""
    engine = build_engine(scene, time_step(scene))
    stage, found, seen = scene.phases[0].begin(scene, 0), set(), 0
    while stage.memory["left"]:
        engine.advance(max(1, round(stage.proceed(engine) / engine.time_step)))
        if engine.count == seen:
            continue
        seen, bars = engine.count, bars_by_body(engine.state())
        kinds = engine.state().bodies.kind  # type: ignore[union-attr]
        loops = [loops_of(body, thinnest=D) for body in scene.bodies]
        curves = [[loop.corners(bars[k]) for loop in loops[kinds[k]]] for k in range(seen)]
        for j in range(seen):
            for i in range(j):
                closed = [(one, other) for one in curves[i] for other in curves[j]]
                found |= {(i, j)} if any(_number(*pair) for pair in closed) else set()
    return seen, len(found)


def _number(one: np.ndarray, other: np.ndarray) -> int:
    """The linking number by another formula than the one under test."""
    return round(float(gauss_integral(*(np.concatenate([curve, curve[:1]])[None] for curve in (one, other)))[0]))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_rings_of_the_example_scene_are_unlinked(seed: int) -> None:
    scene = parse_scene({**yaml.safe_load(starter("ring")), "seed": seed, "count": 24}, source="ring")
    assert linked(scene) == (24, 0)


@pytest.mark.parametrize("every_s", [None, 0.003])
def test_mixed_closed_bodies_are_unlinked_also_with_layers_that_still_fall(every_s: float | None) -> None:
    scene = small(
        {
            "engine": "links",
            "particle": [RING, LADDER, CLIP],
            "count": 24,
            "container": {"radius_m": 0.03, "height_m": 0.1},
            "phases": [{"type": "deposit", "per_layer": 6, "every_s": every_s}],
        }
    )
    assert linked(scene) == (24, 0)


def test_a_ring_is_not_put_around_a_hook_that_ends_at_the_wall() -> None:
    hooks = {"side_m": 0.0008, "lower_height_m": 0.004, "upper_height_m": 0.008, "length_m": 0.0385}
    scene = small(
        {
            "engine": "links",
            "particle": RING,
            "count": 12,
            "container": {"radius_m": 0.0196, "height_m": 0.1},
            "hooks": hooks | {"lower_length_m": 0.0385},
            "phases": [{"type": "deposit", "per_layer": 12}, {"type": "pull-hook", "distance_m": 0.01}],
        }
    )
    engine = build_engine(scene, time_step(scene))
    phase = scene.phases[0]
    assert isinstance(phase, Deposit)
    phase.begin(scene, 0).proceed(engine)
    (loop,) = loops_of(scene.bodies[0])
    rings = [loop.corners(bars) for bars in bars_by_body(engine.state())]
    assert scene.hooks is not None
    assert len(rings) == 12
    for bar in [(cross.height, bar) for cross in scene.hooks.crosses for bar in cross.bars]:
        height, (middle, half) = bar
        along = np.array([1.0, 0.0, 0.0] if half[0] > half[1] else [0.0, 1.0, 0.0])
        line = np.array([*middle, height]) + np.array([-1.0, 1.0])[:, None] * along
        around = np.array([*line, line[1] - [0.0, 0.0, 1.0], line[0] - [0.0, 0.0, 1.0]])
        assert [_number(ring, around) for ring in rings] == [0] * 12


def test_poses_without_links_keep_their_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    ring = small({"engine": "links", "particle": RING}).bodies[0]
    layer: dict[str, Any] = {"count": 3, "radius": 0.03, "bottom": 0.0, "height": 0.01, "obstacles": np.empty((0, 3))}

    def placed() -> np.ndarray:
        each = [place_layer(ring, rng=np.random.default_rng(seed), **layer) for seed in range(40)]
        return np.array([poses.positions for poses in each])

    now = placed()
    monkeypatch.setattr(Curves, "linked", lambda *_: False)
    same = (now == placed()).all(axis=(1, 2))
    assert 0 < (~same).sum() < 10
