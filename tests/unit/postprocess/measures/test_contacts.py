from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.spatial.transform import Rotation

from dem.body.particle import HINGE_CLEARANCE, INWARDS, Boxes, Particle, SphereChain
from postprocess import contact_pairs
from postprocess.geometry import links
from postprocess.geometry.links import Chain
from postprocess.measures.contacts import chain_of, pairs_of_spheres, segment_distances, without_support


def oracle_distance(p0, p1, q0, q1):
    """Bounded least squares over the two positions along the segments."""
    matrix = np.column_stack([p1 - p0, q0 - q1])
    result = lsq_linear(matrix, q0 - p0, bounds=(0, 1), method="bvls", tol=1e-14)
    return np.linalg.norm(matrix @ result.x - (q0 - p0))


def test_segment_distances_match_least_squares():
    ends = np.random.default_rng(0).uniform(-1, 1, (4, 60, 3))
    expected = [oracle_distance(*segment) for segment in ends.swapaxes(0, 1)]
    np.testing.assert_allclose(segment_distances(*ends), expected, atol=1e-9)


@pytest.mark.parametrize("aspect_ratio", [0.0, 0.7])
def test_pairs_match_brute_force(scene, aspect_ratio):
    vertices = scene(15, 1, box=1.2, aspect_ratio=aspect_ratio)
    limit, expected = 0.2, {}
    for i in range(15):
        for j in range(i + 1, 15):
            gap = min(
                segment_distances(p0[None], p1[None], q0[None], q1[None])[0]
                for p0, p1 in zip(vertices[i, :-1], vertices[i, 1:], strict=True)
                for q0, q1 in zip(vertices[j, :-1], vertices[j, 1:], strict=True)
            )
            if gap <= limit:
                expected[i, j] = gap
    assert 10 < len(expected) < 100
    pairs = contact_pairs(vertices, limit)
    found = dict(zip(zip(pairs.i, pairs.j, strict=True), pairs.distance, strict=True))
    assert found == pytest.approx(expected)


# -- touching nothing ------------------------------------------------------------------------------------------------


def test_a_rattler_touches_neither_others_nor_floor_nor_wall(shape):
    line, d = shape(0.01, 0.7, (0.0, 0.0)), 1e-3
    places = np.array([[0, 0, 0.5 * d], [0, 0, 0.6 * d], [0.0075, 0, 0.01], [0.0077, 0, 0.01], [0, 0, 0.01]])
    pile = line + places[:, None]
    sizes = {"chain": Chain(diameter=d, rows=1, width=d, pitch=0.0), "floor_z": 0.0}
    # A tip is 12 mm from the middle: it touches a wall of 20 mm where the middle is 8 mm, less what facets take, out.
    assert without_support(pile, [0] * 5, wall_radius=0.02, **sizes).tolist() == [False, True, True, True, True]
    assert without_support(pile, [0] * 5, wall_radius=0.0195, **sizes).tolist() == [False, True, False, False, True]
    assert without_support(pile, [0] * 5, wall_radius=None, **sizes).tolist() == [False, True, True, True, True]
    # Lower than the floor it touches it as well; one neighbour is enough.
    assert not without_support(pile - np.array([0, 0, 0.1]), [0] * 5, wall_radius=None, **sizes).any()
    loose = without_support(pile, [0, 1, 0, 2, 0], wall_radius=None, **sizes)
    assert loose.tolist() == [False, False, True, False, True]


def test_a_smarticle_of_two_strands_on_its_edge_is_held_by_the_floor_and_the_wall(shape):
    u, d = shape(0.01, 0.7), 0.5e-3
    chain = Chain(diameter=d, rows=2, width=1.3e-3, pitch=0.0)
    # Its normal is along z: the lower strand touches what the middle of the bar is 0.65 mm away from.
    for height, loose in ((0.65e-3, False), (0.72e-3, True)):
        pile = np.array([u + np.array([0, 0, height])])
        assert without_support(pile, [0], chain=chain, floor_z=0.0, wall_radius=None).tolist() == [loose]
    upright = u[:, [2, 0, 1]] + np.array([0.02 - 0.65e-3, 0, 0.05])  # its normal is along x, towards the wall
    assert not without_support(upright[None], [0], chain=chain, floor_z=0.0, wall_radius=0.0205).any()
    assert without_support(upright[None], [0], chain=chain, floor_z=0.0, wall_radius=0.0212).all()


# -- what engines see ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rows", "pitch", "aspect_ratio"),
    [
        *((rows, pitch, ratio) for rows, pitch in ((1, 1.3), (1, 0.5)) for ratio in (0.0, 0.03, 0.1, 0.7, 1.1)),
        # A straight bar has no plane that a frame could give.
        *((rows, pitch, ratio) for rows, pitch in ((2, 1.0), (3, 0.7)) for ratio in (0.03, 0.1, 0.7, 1.1)),
    ],
)
def test_spheres_are_where_the_simulator_puts_them(aspect_ratio, rows, pitch):
    w, d, t1 = 0.0117, 0.5e-3, 1.27e-3
    boxes = Boxes(
        middle_length=w, barb_length=aspect_ratio * w, thickness_normal=t1, thickness_in_plane=d, density=7850.0
    )
    assert_spheres_match(boxes, links.Chain(diameter=d, rows=rows, width=t1, pitch=pitch * d))


@pytest.mark.parametrize("angles", [(90.0, 90.0), (30.0, 100.0)])
@pytest.mark.parametrize("pitch", [0.2, 1.0])
def test_spheres_of_robots_whose_bodies_are_thicker_than_their_barbs(angles, pitch):
    t1, barb, body = 0.021, 0.0095, 0.0213
    boxes = Boxes(
        middle_length=0.0467, barb_length=0.042, thickness_normal=t1, thickness_in_plane=barb, density=1250.0,
        angles=tuple(np.radians(angles)), middle_thickness_in_plane=body,
    )  # fmt: skip
    chain = links.Chain(diameter=barb, rows=1, width=t1, pitch=pitch * barb, bulge=(body - barb) / 2)
    assert_spheres_match(boxes, chain)
    assert (links._CLEARANCE, links._INWARDS) == (HINGE_CLEARANCE, INWARDS)


def assert_spheres_match(boxes, chain):
    """Compare spheres of turned vertices with the simulator's, in whatever order."""
    turn, shift = Rotation.from_euler("xyz", [0.3, -1.1, 2.0]).as_matrix(), np.array([0.01, -0.02, 0.03])
    found = links.spheres((boxes.vertices @ turn.T + shift)[None], chain)[0]
    made = Particle(boxes, SphereChain(rows=chain.rows, diameter=chain.diameter, pitch=chain.pitch))
    expected = made.centres @ turn.T + shift
    assert found.shape == expected.shape
    apart = np.linalg.norm(found[:, None] - expected, axis=2)
    assert apart.min(axis=0).max() < 1e-12
    assert apart.min(axis=1).max() < 1e-12


def test_the_chain_of_a_run_follows_its_scene_and_manifest():
    manifest = SimpleNamespace(sphere_diameter_m=2.0, thickness_normal_m=5.0, engine="yade", bulge_m=0.5)
    run = SimpleNamespace(scene={"fidelity": {"rows": 2, "pitch": 1.3}}, manifest=manifest)
    assert chain_of(run) == links.Chain(diameter=2.0, rows=2, width=5.0, pitch=2.6, bulge=0.5)
    manifest.engine = "lammps"
    assert chain_of(run).pitch == 2.6
    manifest.engine = "links"
    assert chain_of(run).pitch == 0.0


def test_beads_rest_in_the_gaps_of_the_other_chain():
    """Two rows of beads a diameter apart, shifted by half of it: they touch at √(3)/2 of a diameter, not at one."""
    beads = np.array([[k, 0.0, 0.0] for k in range(8)])
    for height, touch in ((0.87, False), (0.86, True)):
        pairs = pairs_of_spheres(np.array([beads, beads + np.array([0.5, height, 0.0])]), 1.0)
        assert (len(pairs.i) == 1) is touch
    assert pairs.distance[0] == pytest.approx(np.hypot(0.5, 0.86))
    # Head to head they do so at one, and spheres of one smarticle do not count.
    assert len(pairs_of_spheres(np.array([beads, beads + np.array([0.0, 0.99, 0.0])]), 1.0).i) == 1
    assert len(pairs_of_spheres(0.5 * beads[None], 1.0).i) == 0
