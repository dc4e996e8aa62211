"""The closed formulas of three hinged links against sums over the links themselves."""

import math

import builds
import numpy as np
import pytest

from dem.engine.links.arrays import PLANE
from dem.engine.links.motion import planar
from dem.engine.links.motion.planar import lay_out
from dem.engine.links.shapes import planar_of

ANGLES = [(math.pi / 2, math.pi / 2), (0.3, 1.2), (-0.2, 0.1), (1.7, 0.0)]
lagrange_force, momenta, rates, spin_of = (
    builds.callable_from_python(part) for part in (planar.lagrange_force, planar.momenta, planar.rates, planar.spin_of)
)
SHAPE = planar_of(builds.particle())


def row_of(alpha1: float, alpha2: float) -> np.ndarray:
    row = np.zeros(PLANE)
    lay_out(SHAPE, alpha1, alpha2, row)
    return row


def links_of(alpha1: float, alpha2: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Centres in the middle link's axes about the centre of mass, frames, and masses, from `Boxes`."""
    b = builds.boxes(angles=(alpha1, alpha2))
    vertices = b._plain_vertices
    centres = (vertices[:3] + vertices[1:]) / 2 - b.plain_centre_of_mass
    frames = np.array([np.stack([u, np.cross([0, 0, 1.0], u), [0, 0, 1.0]], axis=1) for u in b.directions])
    return centres, frames, b.link_masses


def kinetic(alpha: np.ndarray, rate: np.ndarray, spin: np.ndarray) -> tuple[float, np.ndarray]:
    """Kinetic energy and angular momentum about the centre of mass at rest, by sums over links."""
    step = 1e-6
    centres, frames, masses = links_of(*alpha)
    later, before = links_of(*(alpha + step * rate))[0], links_of(*(alpha - step * rate))[0]
    relative = (later - before) / (2 * step)
    energy, momentum = 0.0, np.zeros(3)
    for k in range(3):
        own = spin + np.array([0, 0, {0: -rate[0], 1: 0.0, 2: rate[1]}[k]])
        v = relative[k] + np.cross(spin, centres[k])
        inertia = frames[k] @ np.diag(builds.boxes().link_inertias[k]) @ frames[k].T
        energy += 0.5 * masses[k] * v @ v + 0.5 * own @ inertia @ own
        momentum += masses[k] * np.cross(centres[k], v) + inertia @ own
    return energy, momentum


@pytest.mark.parametrize("angles", ANGLES)
def test_momentum_is_that_of_the_links(angles: tuple[float, float]) -> None:
    rng = np.random.default_rng(0)
    row = row_of(*angles)
    for _ in range(5):
        spin, rate = rng.normal(size=3) * 20, rng.normal(size=2) * 6
        _, momentum = kinetic(np.array(angles), rate, spin)
        found = spin_of(row, *momentum, row[18] * rate[0] + row[19] * rate[1])
        assert np.allclose(found, spin, rtol=1e-7)


@pytest.mark.parametrize("angles", ANGLES)
def test_momenta_of_the_angles_are_derivatives_of_the_energy(angles: tuple[float, float]) -> None:
    rng = np.random.default_rng(1)
    alpha, row = np.array(angles), row_of(*angles)
    spin, rate, step = rng.normal(size=3) * 20, rng.normal(size=2) * 6, 1e-3
    normal = row[16] * spin[2] + row[18] * rate[0] + row[19] * rate[1]
    p = momenta(row, normal, *rate)
    for k in range(2):
        shift = step * np.eye(2)[k]
        slope = (kinetic(alpha, rate + shift, spin)[0] - kinetic(alpha, rate - shift, spin)[0]) / (2 * step)
        assert p[k] == pytest.approx(slope, rel=1e-6)
        shift = 1e-5 * np.eye(2)[k]
        slope = (kinetic(alpha + shift, rate, spin)[0] - kinetic(alpha - shift, rate, spin)[0]) / 2e-5
        assert lagrange_force(SHAPE, row, k, *spin, *rate) == pytest.approx(slope, rel=1e-5)
    assert np.allclose(rates(row, normal, *p), rate, rtol=1e-12)
