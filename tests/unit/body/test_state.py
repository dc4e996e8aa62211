"""All smarticles at one instant, against clouds of mass points that know nothing of rigid bodies."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import make_boxes
from scipy.spatial.transform import Rotation

from dem.body.particle import Boxes
from dem.body.state import State

ANGLE = st.floats(-15, 105)
SEED = st.integers(0, 2**32 - 1)


def cloud(boxes: Boxes) -> np.ndarray:
    """(3, 8, 3) points in each link's own frame that weigh an eighth of it: Gauss's rule of two points a side.

    It is exact for polynomials of the third degree, and so for mass, centre and inertia.
    """
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
    sides = np.array([[length, boxes.thickness_in_plane, boxes.thickness_normal] for length in boxes.lengths])
    return signs[None] * sides[:, None] / (2 * math.sqrt(3))


def points_of(state: State) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Masses (3,), places (N, 3, 8, 3) and velocities of the points of all links."""
    arms = np.einsum("nkij,kpj->nkpi", state.link_rotations, cloud(state.boxes))
    places = state.link_positions[:, :, None] + arms
    velocities = state.link_velocities[:, :, None] + np.cross(state.link_spins[:, :, None], arms)
    return state.boxes.link_masses / 8, places, velocities


def loose(seed: int, count: int = 3) -> State:
    """Links anywhere, turned and moving anyhow: nothing joins them."""
    rng = np.random.default_rng(seed)
    rotations = Rotation.random(3 * count, random_state=rng).as_matrix().reshape(count, 3, 3, 3)
    positions, velocities = rng.normal(size=(2, count, 3, 3)) * [[[[0.02]]], [[[0.3]]]]
    return State(make_boxes(), positions, rotations, velocities, rng.normal(size=(count, 3, 3)) * 40)


def flying(boxes: Boxes, seed: int, count: int = 3) -> tuple[State, dict[str, np.ndarray]]:
    """Rigid smarticles anywhere, and what they were made of."""
    rng = np.random.default_rng(seed)
    made = {
        "positions": rng.normal(size=(count, 3)) * 0.02,
        "rotations": Rotation.random(count, random_state=rng).as_matrix(),
        "velocities": rng.normal(size=(count, 3)) * 0.3,
        "spins": rng.normal(size=(count, 3)) * 40,
    }
    return State.rigid(boxes, **made), made


@given(SEED)
def test_sums_over_loose_links_are_those_of_their_points(seed: int) -> None:
    state = loose(seed)
    masses, places, velocities = points_of(state)
    weights = masses[None, :, None, None]
    total = state.boxes.mass
    assert state.positions == pytest.approx((weights * places).sum(axis=(1, 2)) / total, rel=1e-12, abs=1e-15)
    assert state.velocities == pytest.approx((weights * velocities).sum(axis=(1, 2)) / total, rel=1e-12, abs=1e-14)
    assert state.momentum == pytest.approx((weights * velocities).sum(axis=(0, 1, 2)), rel=1e-11, abs=1e-17)
    spun = (weights * np.cross(places, velocities)).sum(axis=(0, 1, 2))
    assert state.angular_momentum == pytest.approx(spun, rel=1e-10, abs=1e-18)
    assert state.kinetic_energy == pytest.approx(float((weights * velocities**2).sum() / 2), rel=1e-12)
    lifted = float((weights[..., 0] * (places[..., 2] - 0.004)).sum() * 9.81)
    assert state.potential_energy(9.81, 0.004) == pytest.approx(lifted, rel=1e-10, abs=1e-16)


@given(ANGLE, ANGLE, st.sampled_from([0.4, 0.7, 1.0]), SEED)
def test_rigid_smarticles_move_as_one_body(first: float, second: float, aspect_ratio: float, seed: int) -> None:
    boxes = make_boxes(aspect_ratio, (first, second))
    state, made = flying(boxes, seed)
    turn = made["rotations"]
    assert state.count == 3
    assert state.positions == pytest.approx(made["positions"], abs=1e-15)
    assert state.velocities == pytest.approx(made["velocities"], abs=1e-14)
    assert state.vertices == pytest.approx(
        np.einsum("nij,vj->nvi", turn, boxes.vertices) + made["positions"][:, None], abs=1e-15
    )
    assert np.degrees(state.angles) == pytest.approx(np.tile([first, second], (3, 1)), abs=1e-10)
    # Koenig's theorem, with the inertia of the whole.
    own = np.einsum("nij,j,nkj,nk->ni", turn, boxes.inertia, turn, made["spins"])
    orbital = boxes.mass * np.cross(made["positions"], made["velocities"])
    assert state.angular_momentum == pytest.approx((own + orbital).sum(axis=0), rel=1e-10, abs=1e-19)
    energy = (boxes.mass * made["velocities"] ** 2).sum() / 2 + (own * made["spins"]).sum() / 2
    assert state.kinetic_energy == pytest.approx(float(energy), rel=1e-12)
    assert state.momentum == pytest.approx(boxes.mass * made["velocities"].sum(axis=0), rel=1e-11, abs=1e-18)
    # The points of a rigid body keep their distances: every link's velocity is that of the whole at its place.
    arms = state.link_positions - made["positions"][:, None]
    expected = made["velocities"][:, None] + np.cross(made["spins"][:, None], arms)
    assert state.link_velocities == pytest.approx(expected, abs=1e-14)


@given(ANGLE, ANGLE, SEED)
def test_angles_and_vertices_of_hinged_links(first: float, second: float, seed: int) -> None:
    # Built link by link from what the angles mean: 0 straight on, 90 towards the mouth (y of the middle link).
    boxes, rng = make_boxes(), np.random.default_rng(seed)
    turn, place = Rotation.random(random_state=rng).as_matrix(), rng.normal(size=3) * 0.02
    a1, a2 = math.radians(first), math.radians(second)
    along = np.array([[-math.cos(a1), math.sin(a1), 0], [1, 0, 0], [math.cos(a2), math.sin(a2), 0]])
    frames = np.array([np.stack([u, np.cross([0, 0, 1], u), [0, 0, 1]], axis=1) for u in along])
    hinges = np.array([[-0.0117 / 2, 0, 0], [0.0117 / 2, 0, 0]])
    tips = hinges + boxes.barb_length * along[[0, 2]]
    centres = np.array([(hinges[0] + tips[0]) / 2, [0, 0, 0], (hinges[1] + tips[1]) / 2])
    still = np.zeros((1, 3, 3))
    state = State(boxes, (centres @ turn.T + place)[None], (turn @ frames)[None], still, still)
    assert np.degrees(state.angles) == pytest.approx(np.array([[first, second]]), abs=1e-10)
    chain = np.array([tips[0], hinges[0], hinges[1], tips[1]])
    assert state.vertices[0] == pytest.approx(chain @ turn.T + place, abs=1e-15)
    assert state.kinetic_energy == 0
