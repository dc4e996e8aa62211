"""Smarticles pushed apart without inertia: known ways, sides that are kept, and what is left of overlaps."""

import math
from typing import Any

import numpy as np
import pytest
from scenes import SMALL, changed
from scipy.spatial.transform import Rotation

from dem.body.placement import Poses
from dem.engine.links import apart
from dem.engine.links.apart import DEEP, LEFT, Pushed, pushed_apart
from dem.engine.links.engine import LinksEngine
from dem.errors import InputError
from dem.plan.steps import time_step
from dem.run.build import build_engine
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene

QUARTER = Rotation.from_rotvec([0, 0, math.pi / 2])
HIGH = 0.02  # m, above the floor
T1 = 1.27e-3  # m, thickness along the normal


def scene_of(fidelity: str = "standard", **changes: Any) -> Scene:
    return parse_scene(changed(SMALL, {"engine": "links", "fidelity": fidelity, **changes}), source="scene.yaml")


def two(above: float, turn: Rotation = QUARTER, shift: tuple[float, float] = (0.0, 0.0), height: float = HIGH) -> Poses:
    """Poses of a flat smarticle and of another one, turned and shifted, so much above it [m]."""
    return Poses(np.array([[0.0, 0.0, height], [*shift, height + above]]), (Rotation.identity(), turn))


def push(scene: Scene, poses: Poses) -> Pushed | None:
    return pushed_apart(scene.body, poses, scene.cylinder, scene.hooks.crosses if scene.hooks else ())


def engine_at(scene: Scene, poses: Poses) -> LinksEngine:
    """An engine to which smarticles were just added."""
    engine = build_engine(scene, time_step(scene))
    assert isinstance(engine, LinksEngine)
    engine.add(poses)
    engine.ledger.take_in()
    return engine


def deepest(engine: LinksEngine) -> float:
    """Largest overlap of strands with each other and with boundaries [m]."""
    return float(engine._world.contacts().depths.max()) * engine.particle.diameter


def fastest(engine: LinksEngine, steps: int = 10) -> float:
    """Greatest speed in the first steps [m/s]."""
    found = 0.0
    for _ in range(steps):
        engine.advance(1)
        found = max(found, float(engine.state().speeds.max()))
    return found


def crossings(scene: Scene, poses: Poses) -> dict[tuple[int, int], float]:
    """Distance of the second smarticle above the first where links of both cross in a view from above, by links [m]."""
    lines = [
        turn.apply(scene.body.boxes.vertices) + at for at, turn in zip(poses.positions, poses.rotations, strict=True)
    ]
    found = {}
    for i in range(3):
        for j in range(3):
            a, u = lines[0][i], lines[0][i + 1] - lines[0][i]
            b, v = lines[1][j], lines[1][j + 1] - lines[1][j]
            if abs(u[0] * v[1] - u[1] * v[0]) > 0.1 * np.linalg.norm(u) * np.linalg.norm(v):
                s, t = np.linalg.solve(np.stack([u[:2], -v[:2]], axis=1), (b - a)[:2])
                if 0 < s < 1 and 0 < t < 1:
                    found[i, j] = float((b + t * v - a - s * u)[2])
    return found


@pytest.mark.parametrize("fidelity", ["standard", "reference"])
@pytest.mark.parametrize("above", [0.78e-3, 0.5e-3, 0.2e-3])
def test_crossed_smarticles_part_on_the_side_where_they_are(fidelity: str, above: float) -> None:
    # Outer strands are 0.385 mm off the centre line: below 0.77 mm they are on the wrong side of each other.
    scene = scene_of(fidelity, count=2)
    poses = two(above)
    pushed = push(scene, poses)
    assert pushed is not None
    diameter = scene.sphere_diameter
    # Flat on each other they overlap by what centre lines are nearer than the thickness; the engine's own contacts
    # know nothing of sides, and find less where strands have passed each other.
    assert pushed.deepest == pytest.approx(T1 - above, abs=1e-9) or above > 0.77e-3
    assert pushed.deepest > 10 * DEEP * diameter
    engine = engine_at(scene, pushed.poses)
    assert deepest(engine) <= LEFT * diameter * (1 + 1e-9)
    before, after = crossings(scene, poses), crossings(scene, pushed.poses)
    assert list(after) == list(before)
    assert len(before) == 1
    assert min(after.values()) > above
    # Gravity alone: nothing is thrown.
    assert fastest(engine) < 12 * 9.81 * engine.time_step + 0.02
    # Each moves by no more than both would have to move together.
    assert pushed.distances.max() < T1 - above + 2 * LEFT * diameter


def test_without_a_push_they_are_thrown() -> None:
    scene = scene_of(count=2)
    assert fastest(engine_at(scene, two(0.78e-3))) > 1000


def test_one_contact_moves_both_bodies_alike_and_no_further_than_it_asks() -> None:
    scene, overlap = scene_of(count=2), 0.1e-3
    poses = two(T1 - overlap)
    pushed = push(scene, poses)
    assert pushed is not None
    assert pushed.deepest == pytest.approx(overlap, rel=1e-9)
    left = LEFT * scene.sphere_diameter  # a twentieth of the overlap
    (parted,) = crossings(scene, pushed.poses).values()
    assert parted == pytest.approx(T1, abs=2 * left)
    # Equal bodies in mirror-symmetric places: the centre of mass of both stays.
    moved = pushed.poses.positions - poses.positions
    np.testing.assert_allclose(moved[0], -moved[1], atol=1e-12)
    assert 0.1 * overlap < moved[1, 2] < overlap / 2
    assert pushed.distances[0] == pytest.approx(pushed.distances[1], rel=1e-6)


@pytest.mark.parametrize(("share", "moves"), [(0.95 * DEEP, False), (1.05 * DEEP, True)])
def test_contacts_as_in_piles_at_rest_are_left_alone(share: float, moves: bool) -> None:
    scene = scene_of(count=2)
    poses = two(T1 - share * scene.sphere_diameter)
    assert (push(scene, poses) is not None) == moves


def test_nothing_tells_the_side_of_lines_that_cross() -> None:
    scene = scene_of(count=2)
    with pytest.raises(InputError, match=r"centre lines of smarticle 0 and smarticle 1 cross at .* mm, and nothing"):
        push(scene, two(5e-6))


HOOKS = {"lower_height_m": 0.005, "upper_height_m": HIGH, "length_m": 0.02}


@pytest.mark.parametrize(
    ("height", "shift", "changes"),
    [
        (T1 / 2 - 0.3e-3, (0.0, 0.0), {}),  # in the floor
        (HIGH, (0.0234 - 0.0055, 0.0), {}),  # in the wall
        (HIGH + 0.6e-3, (0.0, 0.0), {"hooks": HOOKS}),  # in a hook
    ],
)
def test_boundaries_push_too(height: float, shift: tuple[float, float], changes: Any) -> None:
    scene = scene_of(count=1, **changes)
    poses = Poses(np.array([[*shift, height]]), (Rotation.identity(),))
    assert deepest(engine_at(scene, poses)) > 5 * DEEP * scene.sphere_diameter
    pushed = push(scene, poses)
    assert pushed is not None
    assert deepest(engine_at(scene, pushed.poses)) <= LEFT * scene.sphere_diameter * (1 + 1e-9)


def test_where_there_is_no_room_they_stay_in_no_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(apart, "SWEEPS", 300)
    scene = scene_of(count=1)
    poses = Poses(np.array([[0.0, 0.0, HIGH]]), (Rotation.identity(),))
    narrow = type(scene.cylinder)(radius=0.006, height=0.1, facets=64)
    # Upright it would fit, but nothing turns a flat one.
    with pytest.raises(InputError, match=r"after 300 small displacements smarticle 0 still overlaps a boundary by "):
        pushed_apart(scene.body, poses, narrow)
