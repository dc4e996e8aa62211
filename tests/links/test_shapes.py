"""Rigid bodies of any shape on the links engine, and several kinds in one pile."""

import math
from dataclasses import replace

import builds
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dem.body.bars import Bars
from dem.engine.links.arrays import ORIGIN, SPIN
from dem.engine.links.shapes import Shape, rigid_shape
from dem.engine.links.world import World

L = 6e-3


def bars(points: list[list[list[float]]], normals: list[list[float]]) -> Bars:
    return Bars(
        points=L * np.array(points), normals=np.array(normals), thickness_normal=builds.T1,
        thickness_in_plane=builds.T2, density=builds.DENSITY,
    )  # fmt: skip


def staple() -> Bars:
    """The smarticle of `builds`, as three bars."""
    half, barb = builds.W / 2 / L, 0.7 * builds.W / L
    corners = [[-half, barb, 0], [-half, 0, 0], [half, 0, 0], [half, barb, 0]]
    joined = [[corners[1], corners[0]], [corners[1], corners[2]], [corners[2], corners[3]]]
    return bars(joined, [[0, 0, 1]] * 3)


CROSS = bars([[[0, 0, 0], end] for end in ([1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0])], [[0, 0, 1]] * 4)
RING = bars(
    [
        [[math.cos(k * math.pi / 3), math.sin(k * math.pi / 3), 0] for k in (k, k + 1)] for k in range(6)
    ],
    [[0, 0, 1]] * 6,
)  # fmt: skip
TRIPOD = bars([[[0, 0, 0], end] for end in ([1, 0, 0], [0, 1, 0], [0, 0, 1])], [[0, 1, 1], [1, 0, 1], [1, 1, 0]])


def world(*shapes: Shape, radius: float = 1.0, gravity: float = 0.0, rows: int = 1) -> World:
    made = builds.engine(radius=radius, gravity=gravity, made_of=builds.particle(rows=rows))._world
    found = World(made.particle, made.contact, made.ground, gravity, False, True, more=shapes)
    found.set_time_step(2e-5)
    return found


def test_a_staple_has_mass_centre_and_inertia_of_a_smarticle() -> None:
    boxes, own = builds.boxes(), staple()
    assert own.mass == pytest.approx(boxes.mass, rel=1e-14)
    np.testing.assert_allclose(own.inertia, boxes.inertia, rtol=1e-12)
    np.testing.assert_allclose(own.rotation, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(own.ends[[0, 1, 1, 2], [1, 0, 1, 1]], boxes.vertices, atol=1e-17)
    assert rigid_shape(own).shared.tolist() == [1, 0, 1]  # as of a smarticle, whose middle link has the hinges


@pytest.mark.parametrize("turn", [[0, 0, 0], [0.4, -0.3, 0.9]])
def test_strands_are_across_their_bars_at_the_edges(turn: list[float]) -> None:
    # Normals of any length, in a frame that is turned against the body's.
    rotation = Rotation.from_rotvec(turn)
    for own in (TRIPOD, CROSS):
        turned = replace(
            own, points=own.points @ rotation.as_matrix().T, normals=3 * own.normals @ rotation.as_matrix().T
        )
        lines = rigid_shape(turned, 2).lines.reshape(-1, 2, 8)
        across = lines[:, 1, :3] - lines[:, 0, :3]
        np.testing.assert_allclose(np.linalg.norm(across, axis=1), builds.T1 - builds.T2, rtol=1e-9)
        np.testing.assert_allclose((across * lines[:, 0, 3:6]).sum(axis=1), 0.0, atol=1e-15)
        np.testing.assert_allclose(np.cross(across, turned.frames[:, :, 2]), 0.0, atol=1e-12)
    # Bars of the cross lie in one plane, so that their strands meet; those of the tripod do not.
    assert rigid_shape(CROSS, 2).shared.tolist() == [0, 0, 1, 1, 1, 1, 1, 1]
    assert rigid_shape(TRIPOD, 2).shared.tolist() == [0] * 6


@pytest.mark.parametrize("own", [CROSS, RING, TRIPOD], ids=["cross", "ring", "tripod"])
def test_inertia_is_that_of_points_that_fill_the_bars(own: Bars) -> None:
    nodes, weights = np.polynomial.legendre.leggauss(2)  # exact for squares
    places, masses = [], []
    for ends, frame, mass, length in zip(own.ends, own.frames, own.masses, own.lengths, strict=True):
        half = np.array([length, own.thickness_in_plane, own.thickness_normal]) / 2
        grid = np.stack(np.meshgrid(nodes, nodes, nodes, indexing="ij"), axis=-1).reshape(-1, 3)
        places.append(ends.mean(axis=0) + (grid * half) @ frame.T)
        masses.append(mass / 8 * np.ones(8))
    points, mass = np.concatenate(places), np.concatenate(masses)
    assert weights.tolist() == pytest.approx([1.0, 1.0])
    second = (mass[:, None, None] * points[:, :, None] * points[:, None, :]).sum(axis=0)
    np.testing.assert_allclose(mass @ points, 0.0, atol=1e-20)
    np.testing.assert_allclose(np.trace(second) * np.eye(3) - second, np.diag(own.inertia), atol=1e-12 * own.inertia[0])


@pytest.mark.parametrize("own", [CROSS, RING, TRIPOD], ids=["cross", "ring", "tripod"])
def test_free_turns_keep_energy_and_momentum(own: Bars) -> None:
    made = world(rigid_shape(own))
    made.set_time_step(1e-4)
    made.add_bodies(1, np.array([[0.0, 0.0, 1.0]]), np.eye(3)[None])
    made.bodies.momentum[0] = own.inertia * [100.0, 30.0, 60.0]
    made.posed()
    energy = made.bodies.momentum[0] @ made.parts.motion[0, SPIN:ORIGIN]
    made.advance(130_000)
    made.posed()
    assert made.bodies.momentum[0] @ made.parts.motion[0, SPIN:ORIGIN] == pytest.approx(energy, rel=1e-9)
    assert made.bodies.momentum[0] == pytest.approx(own.inertia * [100.0, 30.0, 60.0], rel=1e-12)


def heap(seed: int, rows: int) -> World:
    """Crosses, rings and smarticles in a cylinder, in turns."""
    made = world(rigid_shape(CROSS, rows), rigid_shape(RING, rows), radius=0.02, gravity=9.81, rows=rows)
    rng = np.random.default_rng(seed)
    for layer in range(6):
        for k, angle in enumerate(rng.permutation(3)):
            place = 0.009 * np.array([math.cos(2.1 * k), math.sin(2.1 * k), 0]) + [0, 0, 0.012 * (layer + 1)]
            turn = Rotation.from_euler("z", float(rng.uniform(0, 6))).as_matrix()
            made.add_bodies(int(angle), place[None], turn[None])
    return made


@pytest.mark.parametrize("rows", [1, 2])
def test_kinds_in_one_pile_settle_and_repeat_their_bits(rows: int) -> None:
    ends = []
    for _ in range(2):
        made = heap(1, rows)
        made.advance(30_000)
        ends.append(made.bodies.position.copy())
    np.testing.assert_array_equal(*ends)
    assert np.linalg.norm(made.bodies.velocity, axis=1).max() < 0.05
    deepest = made.contacts().depths.max()
    assert 0 < deepest < 0.1
    weight = float(made.shapes.mass[made.bodies.shape].sum()) * 9.81
    assert made.ground.force[:, 2].sum() == pytest.approx(-weight, rel=0.05)


def test_kinds_that_collide_keep_their_momentum() -> None:
    made = world(rigid_shape(CROSS), rigid_shape(RING))
    made.add_bodies(1, np.array([[0.0, 0.0, 0.1]]), np.eye(3)[None])
    made.add_bodies(2, np.array([[1e-3, 2e-3, 0.108]]), Rotation.from_euler("x", 80, degrees=True).as_matrix()[None])
    made.add_bodies(0, np.array([[2e-3, 0.0, 0.09]]), Rotation.from_euler("y", 70, degrees=True).as_matrix()[None])
    made.bodies.velocity[:, 2] = [0.0, -0.5, 0.5]

    def momenta() -> np.ndarray:
        mass, bodies = made.shapes.mass[made.bodies.shape][:, None], made.bodies
        spin = (np.cross(bodies.position, mass * bodies.velocity) + bodies.momentum).sum(axis=0)
        return np.concatenate([(mass * bodies.velocity).sum(axis=0), spin])

    before = momenta()
    made.advance(4000)
    after, scale = momenta(), float(made.shapes.mass.sum()) * 0.5
    assert np.abs(made.bodies.velocity[0]).max() > 0.01  # they have met
    np.testing.assert_allclose(after[:3], before[:3], atol=1e-12 * scale)
    np.testing.assert_allclose(after[3:], before[3:], atol=1e-10 * scale * 0.1)
