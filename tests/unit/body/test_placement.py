"""Poses of a layer: apart from each other, from what is there and from the wall; and truly random."""

import numpy as np
import pytest
from scenes import make_particle
from scipy.spatial import cKDTree
from scipy.stats import chi2, kstest

from dem.body.particle import Particle
from dem.body.placement import Poses, place_layer
from dem.errors import RunError
from dem.setting.container import Cylinder

RADIUS, BOTTOM, HEIGHT = 0.0234, 0.01, 0.0117
NOTHING = np.empty((0, 3))


def place(particle: Particle, *, count: int, seed: int = 1, obstacles: np.ndarray = NOTHING, **changes: float) -> Poses:
    limits = {"radius": RADIUS, "bottom": BOTTOM, "height": HEIGHT, **changes}
    return place_layer(particle, count=count, obstacles=obstacles, rng=np.random.default_rng(seed), **limits)


def spheres(particle: Particle, poses: Poses) -> np.ndarray:
    """(k, S, 3) sphere centres."""
    return np.array([r.apply(particle.centres) + p for p, r in zip(poses.positions, poses.rotations, strict=True)])


@pytest.mark.parametrize(("ratio", "count"), [(0.0, 40), (0.7, 25), (2.0, 8)])
def test_no_two_smarticles_overlap_nor_the_wall(ratio: float, count: int) -> None:
    particle = make_particle(ratio)
    poses = place(particle, count=count)
    placed = spheres(particle, poses)
    assert placed.shape == (count, len(particle.centres), 3)
    distances = np.linalg.norm(placed[:, None, :, None] - placed[None, :, None], axis=-1).min(axis=(2, 3))
    assert distances[~np.eye(count, dtype=bool)].min() > particle.chain.diameter
    assert np.hypot(placed[..., 0], placed[..., 1]).max() + particle.radius < RADIUS
    assert placed[..., 2].min() - particle.radius >= BOTTOM * (1 - 1e-9)


def test_a_layer_of_many_takes_time_in_proportion(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes: list[int] = []

    def counted(points: np.ndarray) -> cKDTree:
        sizes.append(len(points))
        return cKDTree(points)

    monkeypatch.setattr("dem.body.placement.cKDTree", counted)
    particle, count = make_particle(), 256
    poses = place(particle, count=count, radius=0.2, obstacles=np.full((10_000, 3), -1.0))
    assert len(poses.positions) == count
    # Each doubling sorts a sphere in once more, and obstacles are sorted once; trees of all would sort 65 times more.
    assert sum(sizes) <= 10_000 + 9 * count * len(particle.centres)


def test_layers_keep_off_obstacles() -> None:
    particle = make_particle()
    # A grid that fills the lower half of the slab but for gaps, so that unhindered poses would hit it.
    grid = np.stack(np.meshgrid(*[np.arange(-0.02, 0.0201, 0.005)] * 2, [BOTTOM + 0.003]), -1).reshape(-1, 3)
    free = spheres(particle, place(particle, count=15)).reshape(-1, 3)
    placed = spheres(particle, place(particle, count=15, obstacles=grid)).reshape(-1, 3)
    nearest = [np.linalg.norm(cloud[:, None] - grid, axis=-1).min() for cloud in (free, placed)]
    assert nearest[0] < particle.chain.diameter < nearest[1]


def test_orientations_are_uniform_over_rotations() -> None:
    # One smarticle in a wide, high cylinder: nothing rejects a pose. 400 poses; bounds at p = 1e-4, fixed seeds.
    particle = make_particle()
    poses = [place(particle, count=1, seed=seed, radius=1.0) for seed in range(400)]
    matrices = np.array([pose.rotations[0].as_matrix() for pose in poses])
    for column in range(3):  # each body axis is uniform over the sphere: z uniform over [-1, 1], azimuth uniform
        assert kstest((matrices[:, 2, column] + 1) / 2, "uniform").pvalue > 1e-4
        azimuth = np.arctan2(matrices[:, 1, column], matrices[:, 0, column])
        assert kstest((azimuth + np.pi) / (2 * np.pi), "uniform").pvalue > 1e-4
    # The turn about an axis too: the angle of a uniform rotation has density (1 - cos θ)/π.
    angle = np.array([pose.rotations[0].magnitude() for pose in poses])
    edges = np.linspace(0, np.pi, 9)
    expected = 400 * np.diff(edges - np.sin(edges)) / np.pi
    observed = np.histogram(angle, edges)[0]
    assert ((observed - expected) ** 2 / expected).sum() < chi2.ppf(1 - 1e-4, 7)
    # A constant answer must fail these bounds.
    assert kstest(np.full(400, 0.5), "uniform").pvalue < 1e-4


def test_impossible_layer_fails_with_the_way_out() -> None:
    particle = make_particle()
    with pytest.raises(RunError) as caught:
        place(particle, count=3, radius=0.3 * particle.reach)
    assert str(caught.value) == (
        f"only 0 of 3 bodies of a layer found room in a container of radius {0.3 * particle.reach:g} m; "
        "lower phases.0.per_layer or widen container.radius_m"
    )


def test_layers_keep_off_the_steps_of_a_mould() -> None:
    one, cylinder = make_particle(0.8), Cylinder(radius=0.0234, height=0.1, facets=64, upper=((0.012, 0.016),))
    for seed in range(10):
        poses = place_layer(
            one,
            count=8,
            radius=cylinder.inner_radius,
            bottom=0.001,
            height=0.015,
            obstacles=np.empty((0, 3)),
            rng=np.random.default_rng(seed),
            narrower=cylinder.inner_radii,
        )
        for position, rotation in zip(poses.positions, poses.rotations, strict=True):
            spheres = rotation.apply(one.centres) + position
            off_axis = np.hypot(spheres[:, 0], spheres[:, 1])
            tops = spheres[:, 2] + one.radius
            assert (off_axis + one.radius < cylinder.inner_radii(tops)).all()
