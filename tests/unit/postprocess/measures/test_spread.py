"""Piles without a wall whose spread, tilt and losses follow from how they were laid."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from postprocess.measures.spread import (
    OUTSIDE,
    centre_of_mass,
    free_pile,
    share_outside,
    spread_radius,
    tilt,
)

W = 0.0117
SIZES = {"container_radius_m": 0.0234, "middle_length_m": W, "thickness_normal_m": 1.2e-3, "bulge_m": 0.0}
RUN = SimpleNamespace(scene={}, manifest=SimpleNamespace(sphere_diameter_m=1.2e-3, engine="links", **SIZES))


def line(start, end):
    """A straight smarticle of three equal links."""
    return np.linspace(start, end, 4)


def column(radius, height, count=4000, seed=1):
    """Upright needles evenly over a cylinder that stands on the floor."""
    rng = np.random.default_rng(seed)
    distance, angle = radius * np.sqrt(rng.random(count)), 2 * math.pi * rng.random(count)
    foot = np.stack([distance * np.cos(angle), distance * np.sin(angle), 0 * angle], axis=1)
    return np.array([line(place, place + np.array([0, 0, height])) for place in foot])


def test_the_radius_of_an_even_disc_holds_its_share():
    """A share s of an even disc lies within R √s: 0.707 R for half, 0.975 R for 95 %."""
    pile = column(0.02, 0.03)
    for share in (0.5, 0.95):
        found = spread_radius(pile, share=share)
        assert found == pytest.approx(0.02 * math.sqrt(share), rel=0.02)


@given(seed=st.integers(0, 1000), angle=st.floats(0, 2 * math.pi), shift=st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
def test_spread_does_not_depend_on_place_or_direction(seed, angle, shift):
    rng = np.random.default_rng(seed)
    pile = rng.normal(0, 0.01, (5, 4, 3))
    moved = Rotation.from_euler("z", angle).apply(pile.reshape(-1, 3)).reshape(pile.shape) + np.array([*shift, 0.0])
    assert spread_radius(moved, share=0.7) == pytest.approx(spread_radius(pile, share=0.7), rel=1e-6)


@pytest.mark.parametrize("degrees", [0.0, 5.0, 30.0, 60.0])
def test_a_column_turned_about_its_foot_has_that_tilt(degrees):
    upright = column(0.01, 0.06)
    upright[:, :, :2] -= centre_of_mass(upright)[:2]
    about = Rotation.from_rotvec(math.radians(degrees) * np.array([0.6, 0.8, 0.0]))
    turned = about.apply(upright.reshape(-1, 3)).reshape(upright.shape) + np.array([0.05, -0.02, 0.3])
    assert math.degrees(tilt(turned, foot=(0.05, -0.02), floor_z=0.3)) == pytest.approx(degrees, abs=1e-6)


def test_a_column_that_fell_over_its_edge_has_toppled_and_one_that_spread_has_not():
    radius, height = 0.01, 0.04
    upright = column(radius, height, count=300)
    upright[:, :, :2] -= centre_of_mass(upright)[:2]
    about_edge = Rotation.from_euler("y", 90, degrees=True)
    fallen = about_edge.apply((upright - np.array([radius, 0, 0])).reshape(-1, 3)).reshape(upright.shape) + np.array(
        [radius, 0, 0]
    )
    lying = free_pile(fallen, RUN)
    # Its centre of mass came to lie (R + h/2, R): beyond the base, at more than 45 degrees.
    assert lying.offset == pytest.approx(radius + height / 2, rel=1e-6)
    assert lying.tilt == pytest.approx(math.degrees(math.atan2(radius + height / 2, radius)), rel=1e-6)
    assert lying.offset > radius
    spread = upright * [3, 3, 0.1]
    assert free_pile(spread, RUN).offset < radius
    assert free_pile(spread, RUN).tilt == pytest.approx(0, abs=1e-6)


def test_what_lies_beyond_the_former_wall_came_off():
    edge = RUN.manifest.container_radius_m + OUTSIDE * W
    inside = [line([x, 0, 0], [x, 0, 0.01]) for x in (0.0, 0.01, edge - 1e-4)]
    outside = [line([0, y, 0], [0, y, 0.01]) for y in (edge + 1e-4,)]
    pile = np.array(inside + outside)
    assert share_outside(pile, edge) == 0.25
    found = free_pile(pile, RUN)
    assert found.sloughed == 0.25
    # A pile that moved as a whole has lost nothing.
    assert free_pile(pile + np.array([0.1, 0.05, 0.0]), RUN).sloughed == 0.25
    assert (found.touching, found.entangled) == (0.25, 0.25)
    assert found.radius_half < found.radius_most


@pytest.mark.parametrize(("rows", "diameter"), [(1, 1.2e-3), (2, 0.5e-3)])
def test_links_that_touch_by_their_strands_are_one_cluster(rows, diameter):
    fidelity = {"rows": rows, "pitch": 1.0}
    run = SimpleNamespace(
        scene={"fidelity": fidelity}, manifest=SimpleNamespace(sphere_diameter_m=diameter, engine="links", **SIZES)
    )
    # Both are U-shapes with their normals along z, one upon the other: bars of 1.2 mm touch, whatever their strands.
    u = np.array([[-W / 2, W / 2, 0], [-W / 2, 0, 0], [W / 2, 0, 0], [W / 2, W / 2, 0]])
    for gap, cluster in ((1.2e-3, 1.0), (1.3e-3, 0.5)):
        assert free_pile(np.array([u, u + np.array([0, 0, gap])]), run).touching == cluster
