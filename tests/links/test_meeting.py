"""Two links: nearest points against brute force; forces as derivatives of one smooth energy."""

import math

import builds
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dem.engine.links import vectors
from dem.engine.links.contact import boundaries, meeting
from dem.engine.links.contact.meeting import COLUMNS, ENERGY, POINTS, ROWS
from dem.engine.links.shapes import EITHER_ORDER

D, KN = 1.127e-3, 500.0
EITHER = EITHER_ORDER
between, lines, nearest, nearest_to_circle, meet, meets_elsewhere = (
    builds.callable_from_python(part)
    for part in (
        vectors.between, vectors.lines, vectors.nearest, boundaries.nearest_to_circle, meeting.meet,
        meeting.meets_elsewhere,
    )
)  # fmt: skip


def segment(rng: np.random.Generator, scale: float = 1e-2) -> np.ndarray:
    return np.concatenate([rng.normal(size=3) * scale / 3, rng.normal(size=3) * scale])


def line(axis: np.ndarray) -> np.ndarray:
    """A segment of diameter D as kernels have it; squares are added up in their order."""
    return np.array([*axis[:6], 1 / sum(axis[3:6] ** 2), D / 2])


def distance(p: np.ndarray, q: np.ndarray) -> float:
    both = lines(line(p), line(q))
    return float(np.linalg.norm(between(both, *nearest(both))))


def test_nearest_points_against_brute_force() -> None:
    rng = np.random.default_rng(0)
    grid = np.linspace(0, 1, 201)
    for k in range(300):
        p, q = segment(rng), segment(rng)
        if k % 5 == 0:  # parallel ones too
            q[3:] = p[3:] * rng.uniform(-1, 1)
        one = p[:3] + grid[:, None] * p[3:]
        other = q[:3] + grid[:, None] * q[3:]
        brute = np.linalg.norm(one[:, None] - other[None], axis=-1).min()
        found = distance(p, q)
        assert found <= brute + 1e-12
        assert found == pytest.approx(brute, abs=2e-4)


def test_nearest_point_to_a_circle_against_brute_force() -> None:
    rng = np.random.default_rng(1)
    grid = np.linspace(0, 1, 20001)
    for _ in range(200):
        p = segment(rng)
        points = p[:3] + grid[:, None] * p[3:]
        away = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 5e-3, points[:, 2] - 1e-3)
        s = nearest_to_circle(p, 5e-3, 1e-3)
        x = p[:3] + s * p[3:]
        assert math.hypot(math.hypot(x[0], x[1]) - 5e-3, x[2] - 1e-3) <= away.min() + 1e-8


def look(p: np.ndarray, q: np.ndarray, joints: tuple[int, int]) -> tuple[float, np.ndarray, np.ndarray, int]:
    """Energy, force on the first, torque on the first about the origin, and the number of contacts."""
    out = np.zeros((ROWS, COLUMNS))
    found = meet(line(p), line(q), KN, *joints, out)
    if not found:
        return 0.0, np.zeros(3), np.zeros(3), 0
    force, torque, points = np.zeros(3), np.zeros(3), 0
    for row in out[:POINTS]:
        if row[8] > 0:
            force += row[6] * row[3:6]
            torque += np.cross(row[:3], row[6] * row[3:6])
            points += 1
    for row in out[POINTS : POINTS + found - 1]:
        force += row[3:6]
        torque += np.cross(row[:3], row[3:6])
    return out[ENERGY, 0], force, torque, points


def touching(rng: np.random.Generator, angle: float) -> tuple[np.ndarray, np.ndarray]:
    """Two links at an angle [rad] that overlap by less than a tenth of a diameter."""
    while True:
        lengths = rng.uniform(0.5 * D, 10 * D, size=2)
        gap = D * rng.uniform(0.9, 0.999)
        p = np.array([0.0, 0.0, 0.0, lengths[0], 0.0, 0.0])
        q = np.array(
            [*rng.normal(size=2) * 2 * D, gap, lengths[1] * math.cos(angle), lengths[1] * math.sin(angle), 0.0]
        )
        q[3:] = Rotation.from_rotvec(rng.normal(size=3) * 0.02).apply(q[3:])
        turn = Rotation.random(random_state=rng)
        p, q = (np.concatenate([turn.apply(x[:3]), turn.apply(x[3:])]) for x in (p, q))
        if distance(p, q) < D:
            return p, q


@pytest.mark.parametrize("angle", [0.0, 0.01, 0.05, 0.2, 1.0, math.pi / 2, 3.1])
@pytest.mark.parametrize("joints", [(0, 0), (1, 0), (1, 1), (2, 3), (EITHER, EITHER), (2 | EITHER, 3 | EITHER)])
def test_forces_are_derivatives_of_the_energy(angle: float, joints: tuple[int, int]) -> None:
    rng = np.random.default_rng(int(100 * angle))
    step, scale = 1e-10, KN * 0.1 * D
    wrong = 0
    for _ in range(60):
        p, q = touching(rng, angle)
        _, force, torque, _ = look(p, q, joints)
        slopes, turns = np.zeros(3), np.zeros(3)
        for d in range(3):
            shift = np.zeros(6)
            shift[d] = step
            slopes[d] = -(look(p + shift, q, joints)[0] - look(p - shift, q, joints)[0]) / (2 * step)
            spin = Rotation.from_rotvec(np.eye(3)[d] * 1e-8)
            turned = np.concatenate([spin.apply(p[:3]), spin.apply(p[3:])])
            back = np.concatenate([spin.inv().apply(p[:3]), spin.inv().apply(p[3:])])
            turns[d] = -(look(turned, q, joints)[0] - look(back, q, joints)[0]) / 2e-8
        # Where a link's end has its nearest point at the other's end the energy has a corner of second order.
        good = np.allclose(force, slopes, atol=2e-4 * scale) and np.allclose(torque, turns, atol=2e-4 * scale * 10 * D)
        wrong += not good
    assert wrong <= 1


def test_a_rod_turned_over_another_feels_no_jump_and_gains_no_energy() -> None:
    p = np.array([-5 * D, 0.0, 0.0, 10 * D, 0.0, 0.0])
    gap, angles, centre = 0.97 * D, np.linspace(-0.4, 0.4, 4001), np.array([0.3 * D, 0.1 * D, 0.0])
    energies, torques, counts = [], [], []
    for angle in angles:
        turned = np.array([math.cos(angle), math.sin(angle), 0.0]) * 8 * D
        rod = np.concatenate([centre + np.array([0, 0, gap]) - turned / 2, turned])
        energy, force, torque, count = look(p, rod, (0, 0))
        energies.append(energy)
        torques.append((torque - np.cross(centre, force))[2])
        counts.append(count)
    energies, torques = np.array(energies), np.array(torques)
    assert counts[0] == 1
    assert counts[2000] == 2
    assert max(counts) == 3
    # Parallel: two contacts; crossing: one.
    assert energies.max() == pytest.approx(KN * (D - math.hypot(gap, 0.1 * D)) ** 2, rel=1e-6)
    assert energies[0] == pytest.approx(0.5 * KN * (D - gap) ** 2, rel=1e-3)
    assert np.abs(np.diff(energies)).max() < 0.02 * energies.max()
    # A closed turn, there and back, by the trapezium rule on the torque.
    work = np.concatenate([[0.0], np.cumsum((torques[1:] + torques[:-1]) / 2 * np.diff(angles))])
    assert np.abs(work - (energies - energies[0])).max() < 2e-3 * energies.max()


def test_bars_on_each_other_have_two_contacts_and_resist_tilting() -> None:
    p = np.array([0.0, 0.0, 0.0, 8 * D, 0.0, 0.0])
    q = np.array([1 * D, 0.0, 0.98 * D, 4 * D, 0.0, 0.0])
    energy, force, _, _ = look(p, q, (0, 0))
    assert force[2] == pytest.approx(-2 * KN * 0.02 * D)
    assert energy == pytest.approx(KN * (0.02 * D) ** 2)
    for tilt in (-1e-3, 1e-3):
        tilted = q + np.array([0, 0, tilt * -2 * D, 0, 0, tilt * 4 * D])
        assert look(p, tilted, (0, 0))[0] > energy


def test_a_bend_is_as_stiff_as_a_bar() -> None:
    hinge, depth = np.zeros(3), 0.02 * D
    middle = np.array([-10 * D, 0, 0, 10 * D, 0, 0])
    barb = np.array([*hinge, 0, 7 * D, 0])
    for along in np.linspace(-0.5, 0.5, 41) * D:
        # A rod across the corner, over the end of the middle link, the hinge and the start of the barb.
        rod = np.array([-5 * D * 0.7 + along, 5 * D * 0.7 + along, D - depth, 10 * D * 0.7, -10 * D * 0.7, 0])
        total = look(middle, rod, (0, 0))[0] + look(barb, rod, (1, 0))[0]
        assert total <= 0.5 * KN * depth**2 * 2.0001
        assert total >= 0.5 * KN * depth**2 * 0.9999 or abs(along) > 0.2 * D
    corner = np.array([-7 * D, 7 * D, D - depth, 14 * D, -14 * D, 0])
    total = look(middle, corner, (0, 0))[0] + look(barb, corner, (1, 0))[0]
    assert total == pytest.approx(0.5 * KN * depth**2)


def test_what_is_left_out_of_a_lone_contact_is_nothing() -> None:
    rng, out, kinds = np.random.default_rng(7), np.zeros((ROWS, COLUMNS)), {True: 0, False: 0}
    for k in range(4000):
        p, q = segment(rng, 5e-3), segment(rng, 5e-3)
        if k % 2:  # along each other
            q[3:] = p[3:] * rng.choice([-1, 1]) + 0.1 * D * rng.normal(size=3)
        # At a hinge, at an end, anywhere; so near that they touch.
        s, t = rng.choice([0.0, 1.0, rng.uniform()]), rng.choice([0.0, 1.0, rng.uniform()])
        q[:3] = p[:3] + s * p[3:] - t * q[3:] + 0.4 * D * rng.normal(size=3)
        joints = int(rng.integers(2)) | EITHER * (k % 3 == 0), int(rng.integers(2)) | EITHER * (k % 3 == 0)
        rows = meet(line(p), line(q), KN, *joints, out)
        if not rows:
            continue
        both = lines(line(p), line(q))
        alone = meets_elsewhere(both, D * D, *joints) == 0
        assert alone == (rows == 1 and not out[1:POINTS, 8].any()), (k, joints)
        kinds[alone] += 1
    assert min(kinds.values()) > 500


@pytest.mark.parametrize("joints", [(0, 0), (1, 2), (3, 3)])
@pytest.mark.parametrize("angle", [0.0, 0.1, 0.3, 1.0])
def test_energy_and_forces_do_not_depend_on_the_order_of_the_segments(angle: float, joints: tuple[int, int]) -> None:
    rng, scale, differ = np.random.default_rng(int(10 * angle)), KN * D, 0
    first, second = (each | EITHER for each in joints)
    for _ in range(300):
        lengths = rng.uniform(0.5 * D, 4 * D, size=2)
        q = np.array([*rng.normal(size=2) * D, D * rng.uniform(0.4, 1.0), *lengths[1] * np.array([1, angle, 0.1])])
        p = np.array([0.0, 0.0, 0.0, lengths[0], 0.0, 0.0])
        energy, force, torque, count = look(p, q, (first, second))
        back = look(q, p, (second, first))
        assert back[0] == pytest.approx(energy, abs=1e-12 * scale * D)
        np.testing.assert_allclose(back[1], -force, rtol=0, atol=1e-9 * scale)
        np.testing.assert_allclose(back[2], -torque, rtol=0, atol=1e-9 * scale * D)
        assert back[3] >= min(count, 1)
        # The mean is that of the energies of both orders, which differ.
        orders = look(p, q, joints)[0], look(q, p, joints[::-1])[0]
        assert energy == pytest.approx(sum(orders) / 2, abs=1e-12 * scale * D)
        differ += not math.isclose(*orders, rel_tol=1e-6, abs_tol=1e-12 * scale * D)
    assert differ > 20
