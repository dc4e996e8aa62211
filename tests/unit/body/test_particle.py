"""Volume, mass and inertia of the boxes against independent ways to get them; the layout of the spheres."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import RHO, T1, T2, U, W, make_boxes, make_particle

from dem.body.particle import Boxes, Particle, mean_width

SHAPES = [(0.0, U), (0.05, U), (0.4, U), (0.7, U), (1.0, U), (2.0, U)]
BENT = [(0.7, (0.0, 0.0)), (0.7, (90.0, 0.0)), (0.4, (30.0, 105.0)), (1.0, (-15.0, 60.0)), (2.0, (10.0, 95.0))]


def own_vertices(ratio: float, angles: tuple[float, float]) -> np.ndarray:
    """Tip, hinge, hinge, tip by trigonometry of our own: barbs bend to +y, angle 0 is straight on."""
    a1, a2 = np.radians(angles)
    left, right = np.array([-W / 2, 0.0]), np.array([W / 2, 0.0])
    l = ratio * W  # noqa: E741
    return np.array(
        [
            left + l * np.array([-np.cos(a1), np.sin(a1)]),
            left,
            right,
            right + np.array([l * np.cos(a2), l * np.sin(a2)]),
        ]
    )


def in_body_frame(boxes: Boxes, ratio: float, angles: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """The rigid motion (R, t), x -> R x + t in the plane, that brings our vertices onto those of the boxes."""
    mine, theirs = own_vertices(ratio, angles), boxes.vertices[:, :2]
    a, b = mine[2] - mine[1], theirs[2] - theirs[1]
    turn = math.atan2(b[1], b[0]) - math.atan2(a[1], a[0])
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    shift = theirs[1] - rotation @ mine[1]
    assert mine @ rotation.T + shift == pytest.approx(theirs, abs=1e-15)
    return rotation, shift


def quadrature(ratio: float, angles: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) and masses (n,) of the three boxes by two-point Gauss rules: exact up to third moments."""
    vertices = own_vertices(ratio, angles)
    points, masses = [], []
    for start, end in itertools.pairwise(vertices):
        length = np.hypot(*(end - start))
        if length == 0:
            continue
        along = (end - start) / length
        across = np.array([-along[1], along[0]])
        for i, j, k in itertools.product((-1, 1), repeat=3):
            step = np.array([i, j, k]) / math.sqrt(3) / 2
            flat = (start + end) / 2 + step[0] * length * along + step[1] * T2 * across
            points.append([*flat, step[2] * T1])
            masses.append(RHO * length * T1 * T2 / 8)
    return np.array(points), np.array(masses)


def tensor(points: np.ndarray, masses: np.ndarray) -> np.ndarray:
    squares = (points**2).sum(axis=1)
    return (masses * squares).sum() * np.eye(3) - np.einsum("n,ni,nj->ij", masses, points, points)


@pytest.mark.parametrize(("ratio", "angles"), SHAPES + BENT)
def test_mass_centre_and_inertia_equal_exact_quadrature(ratio: float, angles: tuple[float, float]) -> None:
    boxes = make_boxes(ratio, angles)
    rotation, shift = in_body_frame(boxes, ratio, angles)
    points, masses = quadrature(ratio, angles)
    points[:, :2] = points[:, :2] @ rotation.T + shift
    assert boxes.mass == pytest.approx(masses.sum(), rel=1e-13)
    assert boxes.volume == pytest.approx(T1 * T2 * W * (1 + 2 * ratio), rel=1e-13)
    # The origin of the body frame is the centre of mass, its axes are principal: both to rounding.
    assert masses @ points / masses.sum() == pytest.approx(np.zeros(3), abs=1e-13 * W)
    expected = tensor(points, masses)
    assert np.diag(boxes.inertia) == pytest.approx(expected, abs=1e-13 * expected.max())


@given(ratio=st.floats(0.01, 2), a1=st.floats(-15, 105), a2=st.floats(-15, 105))
def test_body_frame_is_a_rigid_motion_of_the_shape(ratio: float, a1: float, a2: float) -> None:
    boxes, mine = make_boxes(ratio, (a1, a2)), own_vertices(ratio, (a1, a2))
    theirs = boxes.vertices
    assert theirs[:, 2] == pytest.approx(np.zeros(4), abs=0)
    for i, j in itertools.combinations(range(4), 2):
        assert np.hypot(*(theirs[i] - theirs[j])[:2]) == pytest.approx(np.hypot(*(mine[i] - mine[j])), abs=1e-15)
    # The mirror image has the same moments and is not the same shape turned over: z stays the normal.
    assert make_boxes(ratio, (a2, a1)).inertia == pytest.approx(boxes.inertia, rel=1e-9)
    turn = theirs[2] - theirs[1]
    assert turn[0] > 0  # the smallest rotation, never the one by a half turn


LAYOUTS = [
    {"rows": 1, "diameter": 1.34e-3, "pitch": 1.3},
    {"rows": 1, "diameter": 1.237e-3, "pitch": 1.0},
    {"rows": 2, "diameter": 0.5e-3, "pitch": 1.0},
    {"rows": 3, "diameter": 0.5e-3, "pitch": 0.7},
]


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize(("ratio", "angles"), SHAPES + BENT)
def test_spheres_lie_on_the_centrelines_in_symmetric_rows(
    ratio: float, angles: tuple[float, float], layout: dict[str, float]
) -> None:
    particle = make_particle(ratio, angles, **layout)
    centres, links, vertices = particle.centres, particle.links, particle.boxes.vertices
    d, rows = layout["diameter"], layout["rows"]
    assert len(centres) == len(links)
    assert (links == 1).sum() >= 2 * rows
    heights = np.unique(centres[:, 2].round(12))
    assert len(heights) == rows
    assert heights == pytest.approx(-heights[::-1], abs=1e-12)
    if rows > 1:
        assert heights[-1] + d / 2 == pytest.approx(T1 / 2, rel=1e-9)
        assert heights[0] - d / 2 == pytest.approx(-T1 / 2, rel=1e-9)
    # No part of any barb is lost: all rows are the same chain.
    per_row = [np.sort(centres[np.isclose(centres[:, 2], z, atol=1e-9)][:, :2], axis=0) for z in heights]
    assert all(row == pytest.approx(per_row[0], abs=1e-12) for row in per_row)
    for link in range(3):
        mine = centres[(links == link) & np.isclose(centres[:, 2], heights[0], atol=1e-9)][:, :2]
        start, end = vertices[link, :2], vertices[link + 1, :2]
        length = np.hypot(*(end - start))
        if len(mine) == 0:
            # Only a barb shorter than the sphere at its hinge may have none; that sphere covers it.
            assert link != 1
            assert length <= d / 2
            continue
        along = (end - start) / length
        stations = np.sort((mine - start) @ along)
        assert np.abs((mine - start) @ [-along[1], along[0]]).max() < 1e-12
        assert stations[0] >= -1e-12
        assert stations[-1] <= length + 1e-12
        assert np.diff(stations).max(initial=0) <= layout["pitch"] * d * (1 + 1e-9)
        assert len(np.unique(stations.round(12))) == len(stations)


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("ratio", [0.2, 0.4, 0.7, 1.0, 2.0])
def test_tips_and_hinges_are_where_the_geometry_says(ratio: float, layout: dict[str, float]) -> None:
    particle = make_particle(ratio, **layout)
    centres, links, vertices = particle.centres, particle.links, particle.boxes.vertices
    d = layout["diameter"]

    def nearest(point: np.ndarray, link: int) -> float:
        return float(np.hypot(*(centres[links == link][:, :2] - point[:2]).T).min())

    for tip, hinge, barb in ((0, 1, 0), (3, 2, 2)):
        assert nearest(vertices[hinge], 1) == pytest.approx(0, abs=1e-12)  # on the hinge axis, in the middle link
        assert nearest(vertices[tip], barb) == pytest.approx(d / 2, rel=1e-9)  # the last surface is the tip
        if particle.boxes.barb_length >= 1.51 * d:
            # Free of the hinge's sphere by as much as a loaded hinge may give way.
            assert nearest(vertices[hinge], barb) == pytest.approx(1.01 * d, rel=1e-9)


def smallest_gap(particle: Particle, first: int, second: int) -> float:
    """Least distance of the centres of two links over the sphere diameter."""
    a, b = particle.centres[particle.links == first], particle.centres[particle.links == second]
    return float(np.linalg.norm(a[:, None] - b[None], axis=-1).min() / particle.chain.diameter)


@given(ratio=st.floats(0.2, 2), a1=st.floats(-15, 105), a2=st.floats(-15, 105), layout=st.sampled_from(LAYOUTS[:3]))
def test_barbs_never_overlap_the_middle_link_while_they_turn(
    ratio: float, a1: float, a2: float, layout: dict[str, float]
) -> None:
    # Holds for a pitch from about half a diameter: at 105° a denser chain comes as near as sin 75° = 0.97 diameters.
    particle = make_particle(ratio, (a1, a2), **layout)
    assert smallest_gap(particle, 0, 1) >= 1 - 1e-9
    assert smallest_gap(particle, 2, 1) >= 1 - 1e-9


@pytest.mark.parametrize(("ratio", "angles"), [(0.0, U), (0.05, U), (0.4, U), (0.7, (90.0, 0.0)), (2.0, U)])
def test_smallest_effective_mass_against_random_pushes(ratio: float, angles: tuple[float, float]) -> None:
    particle = make_particle(ratio, angles, rows=2, diameter=0.5e-3)
    rng = np.random.default_rng(0)
    pushes = rng.normal(size=(5000, 3))
    pushes /= np.linalg.norm(pushes, axis=1)[:, None]
    lightest = math.inf
    for centre in particle.centres:
        arms = np.cross(centre, pushes)
        mobility = 1 / particle.boxes.mass + (arms**2 / particle.boxes.inertia).sum(axis=1)
        lightest = min(lightest, 1 / mobility.max())
    # A search can only come near the minimum from above; 5 000 directions come within 0.2 %.
    assert particle.smallest_effective_mass <= lightest * (1 + 1e-12)
    assert particle.smallest_effective_mass == pytest.approx(lightest, rel=2e-3)
    assert particle.smallest_effective_mass < 0.3 * particle.boxes.mass  # a tip is several times lighter than the body


def test_mean_width_of_a_section_by_random_directions() -> None:
    turn = np.random.default_rng(1).random(200_000) * np.pi
    width = np.abs(T1 * np.cos(turn)) + np.abs(T2 * np.sin(turn))
    assert mean_width(T1, T2) == pytest.approx(width.mean(), rel=3e-3)  # standard error 0.1 %
    assert mean_width(T1, T2) != pytest.approx((T1 + T2) / 2, rel=0.05)
