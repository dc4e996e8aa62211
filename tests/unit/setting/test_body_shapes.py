"""Shapes of the key `particle`: exact volume, mass and inertia, limits of arcs, and bodies that are rejected."""

import math
from typing import Any

import numpy as np
import pytest
import yaml
from pydantic import TypeAdapter
from scenes import small

from dem.body.bars import segment_distances
from dem.body.kinds import Kind
from dem.body.particle import Particle
from dem.errors import InputError
from dem.scene.reading import dump_scene, parse_scene, scene_hash
from dem.setting.shapes import AnyShape, Shaped, numbers_of_shapes

T1, T2, RHO = 1.27e-3, 0.5e-3, 7850.0
READ = TypeAdapter(AnyShape)


def shape(name: str, **keys: Any) -> Shaped:
    return READ.validate_python({"shape": name, **keys})


TREE = {
    "points_m": [[0, 0, 0], [0.01, 0, 0], [0, 0.008, 0], [0.01, 0.006, 0], [0.01, 0, 0.007]],
    "pairs": [[0, 1], [0, 2], [1, 3], [1, 4]],
    "normal": [1, 1, 1],
}
ALL = {
    "rod": {"length_m": 0.01},
    "staple": {"crown_m": 0.01, "leg_m": [0.006, 0.004], "angle_deg": [70, 110], "twist_deg": [0, 40]},
    "z": {"middle_m": 0.01, "arm_m": 0.005, "angle_deg": 60},
    "s": {"radius_m": 0.003},
    "hook": {"shank_m": 0.009, "radius_m": 0.002},
    "c": {"radius_m": 0.004},
    "ring": {"radius_m": 0.004},
    "cross": {"arm_m": [0.004, 0.006], "angle_deg": 70},
    "star": {"arm_m": 0.005},
    "segments": TREE,
}


def points_in(one: Shaped) -> tuple[np.ndarray, np.ndarray]:
    """Places and masses that have exactly the second moments of boxes or cylinders, independently of `Bars`."""
    points, normals = one.layout()
    flat = one.diameter_m is None
    places, masses = [], []
    for (start, end), normal in zip(points, normals, strict=True):
        length = np.linalg.norm(end - start)
        u = (end - start) / length
        n = normal - (normal @ u) * u
        n /= np.linalg.norm(n)
        mass = RHO * length * (T1 * T2 if flat else math.pi * one.diameter_m**2 / 4)
        # Points at ± the radius of gyration have the second moment of the whole.
        spread = [length / math.sqrt(12)]
        spread += [T2 / math.sqrt(12), T1 / math.sqrt(12)] if flat else [one.diameter_m / 4] * 2
        for signs in np.ndindex(2, 2, 2):
            offsets = (2 * np.array(signs) - 1) * spread
            places.append((start + end) / 2 + offsets @ np.array([u, np.cross(n, u), n]))
            masses.append(mass / 8)
    return np.array(places), np.array(masses)


@pytest.mark.parametrize("section", [{}, {"diameter_m": 0.6e-3}], ids=["flat", "round"])
@pytest.mark.parametrize("name", ALL)
def test_mass_volume_and_inertia_are_exact(name: str, section: dict[str, float]) -> None:
    one = shape(name, **ALL[name], **section)
    places, masses = points_in(one)
    bars = one.bars()
    assert bars.mass == pytest.approx(masses.sum(), rel=1e-12)
    assert bars.volume == pytest.approx(masses.sum() / RHO, rel=1e-12)
    arms = places - masses @ places / masses.sum()
    second = np.einsum("p,pi,pj->ij", masses, arms, arms)
    tensor = second.trace() * np.eye(3) - second
    np.testing.assert_allclose(np.sort(bars.inertia), np.linalg.eigvalsh(tensor), rtol=1e-12)
    np.testing.assert_allclose(
        bars.rotation @ np.diag(bars.inertia) @ bars.rotation.T, tensor, atol=1e-12 * tensor.trace()
    )
    # The centre of mass of the bars in the body's frame is its origin, and the frame is right-handed.
    middles = bars.ends.mean(axis=1)
    np.testing.assert_allclose(bars.masses @ middles, 0.0, atol=1e-15 * bars.mass)
    assert np.linalg.det(bars.rotation) == pytest.approx(1.0)


def thin(name: str, segments: int, **keys: float) -> tuple[float, np.ndarray]:
    """Mass and moments of an arc of a thin wire, its own second moment taken off."""
    one = shape(name, segments=segments, diameter_m=1e-6, **keys)
    return one.bars().mass, np.sort(one.bars().inertia)


@pytest.mark.parametrize("opening", [60.0, 180.0])
def test_arcs_approach_their_limit(opening: float) -> None:
    r, span = 0.05, math.radians(360 - opening)
    mass = RHO * math.pi * 0.25e-12 * r * span
    # Of a thin arc, symmetric about x: ∫cos², ∫sin² over ± span/2, and the centre at r sin(span/2)/(span/2).
    centre = r * math.sin(span / 2) / (span / 2)
    xx = mass * r**2 / 2 * (1 - math.sin(span) / span)
    yy = mass * r**2 / 2 * (1 + math.sin(span) / span) - mass * centre**2
    exact = np.sort([xx, yy, xx + yy])
    found = {k: thin("c", k, radius_m=r, opening_deg=opening) for k in (25, 50, 100, 200)}
    for one, moments in found.values():
        assert one == pytest.approx(mass, rel=1e-12)  # bars are as long as the arc
        assert moments == pytest.approx(exact, rel=2e-3)
    errors = [np.abs(found[k][1] - exact).max() for k in (50, 100, 200)]
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.02)  # second order in the length of the bars
    # Extrapolated, the error of fourth order is left.
    limit = (4 * found[200][1] - found[100][1]) / 3
    np.testing.assert_allclose(limit, exact, rtol=1e-6)


def test_ring_approaches_its_limit() -> None:
    (mass, coarse), (_, fine) = thin("ring", 100, radius_m=0.05), thin("ring", 200, radius_m=0.05)
    limit = (4 * fine - coarse) / 3
    np.testing.assert_allclose(limit, mass * 0.05**2 * np.array([0.5, 0.5, 1.0]), rtol=1e-6)


def test_staple_of_right_angles_is_a_smarticle() -> None:
    straight = small({"engine": "links", "smarticle.aspect_ratio": 0.7})
    body = small({"engine": "links", "particle": {"shape": "staple", "crown_m": 0.0117, "leg_m": 0.7 * 0.0117}})
    one, other = straight.body, body.bodies[0]
    assert isinstance(one, Particle)
    assert isinstance(other, Kind)
    assert other.mass == pytest.approx(one.mass, rel=1e-14)
    np.testing.assert_allclose(other.inertia, one.inertia, rtol=1e-12)
    np.testing.assert_allclose(other.centres, one.centres, atol=1e-17)
    assert other.links.tolist() == one.links.tolist()
    assert other.reach == pytest.approx(one.reach, rel=1e-12)
    assert body.cylinder.height == pytest.approx(straight.cylinder.height, rel=1e-12)


def test_smarticle_by_name_is_the_scene_without_the_key() -> None:
    assert scene_hash(small({"particle": "smarticle"})) == scene_hash(small({}))
    assert "particle" not in dump_scene(small({"particle": None}))


@pytest.mark.parametrize("name", ALL)
def test_scenes_come_back_from_their_dump(name: str) -> None:
    scene = small({"engine": "links", "particle": {"shape": name, **ALL[name]}, "container.radius_m": 0.03})
    text = dump_scene(scene)
    assert "\nsmarticle:" not in text
    again = parse_scene(yaml.safe_load(text), source="dump")
    assert scene_hash(again) == scene_hash(scene)


def test_mixtures_have_their_shares_and_lengths() -> None:
    rod = {"shape": "rod", "length_m": 0.01, "share": 2, "spread": 0.2}
    changes = {"engine": "links", "count": 300, "particle": [rod, {"shape": "ring", "radius_m": 0.004}]}
    scene = small(changes)
    mixture = scene.mixture
    assert mixture is not None
    names = np.array([kind.name for kind in mixture.kinds])[mixture.of]
    assert (names == "rod").sum() == 200
    factors = scene.particle[0].factors  # type: ignore[index]
    assert factors.mean() == pytest.approx(1.0, abs=1e-12)
    assert factors.std() == pytest.approx(0.2, rel=1e-12)
    lengths = np.array([kind.size for kind in mixture.kinds])[mixture.of][names == "rod"]
    assert lengths.std() / lengths.mean() == pytest.approx(0.2, rel=0.2)  # 200 drawn ones: the scatter is 5 %
    # Kinds are mixed, not one after the other: runs of one name are as long as chance makes them.
    assert 90 < np.count_nonzero(names[1:] != names[:-1]) < 170
    again = small(changes)
    assert again.mixture is not None
    np.testing.assert_array_equal(mixture.of, again.mixture.of)
    assert not np.array_equal(mixture.of, small({**changes, "seed": 2}).mixture.of)  # type: ignore[union-attr]


def test_numbers_of_shapes_add_up() -> None:
    shapes = [shape("rod", length_m=0.01, share=share) for share in (1, 1, 1)]
    assert numbers_of_shapes(shapes, 100) == [34, 33, 33]
    counted = [shape("rod", length_m=0.01, count=count) for count in (3, 4)]
    assert numbers_of_shapes(counted, 7) == [3, 4]


@pytest.mark.parametrize("none", [{"share": 0}, {"count": 0}])
def test_a_shape_of_no_body_is_as_if_it_were_not_there(none: dict[str, int]) -> None:
    rod, ring = {"shape": "rod", "length_m": 0.02}, {"shape": "ring", "radius_m": 0.004}
    some = {"share": 1} if "share" in none else {"count": 10}
    mixed, alone = (small({"particle": shapes}) for shapes in ([{**rod, **none}, {**ring, **some}], ring))
    assert mixed.mixture is not None
    assert alone.mixture is not None
    assert [kind.name for kind in mixed.mixture.kinds] == ["ring"]
    assert mixed.mixture.of.tolist() == alone.mixture.of.tolist() == [0] * 10
    assert mixed.cylinder == alone.cylinder
    assert mixed.phases == alone.phases


def test_some_shape_has_a_body() -> None:
    shapes = [{"shape": "rod", "length_m": 0.02, "share": 0}] * 2
    with pytest.raises(InputError, match=r"particle: all shares are 0, .* give one of them a share above 0"):
        small({"particle": shapes})


BAD = {
    "legs in radians": (
        {"shape": "staple", "crown_m": 0.01, "leg_m": 0.004, "angle_deg": [90, 1.57]},
        ["shape", "1.57 rad are 89.95 deg"],
    ),
    "legs that cross": (
        {"shape": "staple", "crown_m": 0.01, "leg_m": 0.02, "angle_deg": 30},
        ["shape", "bars 0 and 2"],
    ),
    "legs on each other": ({"shape": "z", "middle_m": 0.01, "arm_m": 0.005, "angle_deg": 2}, ["cross or touch"]),
    "open ring that touches": ({"shape": "c", "radius_m": 0.004, "opening_deg": 1}, ["shape", "cross or touch"]),
    "bars shorter than thick": ({"shape": "ring", "radius_m": 0.004, "segments": 100}, ["longer than its thickness"]),
    "no length": ({"shape": "rod", "length_m": 0.0}, ["length_m", "use at least"]),
    "millimetres": ({"shape": "rod", "length_m": 10}, ["length_m", "write 0.01"]),
    "no such point": ({"shape": "segments", **TREE, "pairs": [[0, 7]]}, ["pairs.0", "use 0 to 4"]),
    "in two pieces": ({"shape": "segments", **TREE, "pairs": [[0, 1], [2, 3]]}, ["pairs", "one piece"]),
    "a point too far for a float": (
        {"shape": "segments", **TREE, "points_m": [[0, 0, 10**400], *TREE["points_m"][1:]]},
        ["points_m.0.2", "is not a number"],
    ),
    "a bar of no length": ({"shape": "segments", **TREE, "pairs": [[1, 1]]}, ["pairs.0", "different points"]),
    "normal along a bar": ({"shape": "segments", **TREE, "normal": [1, 0, 0]}, ["normals", "across"]),
    "two sections": (
        {"shape": "rod", "length_m": 0.01, "diameter_m": 1e-3, "thickness_normal_m": 1e-3},
        ["diameter_m"],
    ),
    "wider than the container": ({"shape": "rod", "length_m": 0.05}, ["container.radius_m", "use at least"]),
    "unknown shape": ({"shape": "stapel", "crown_m": 0.01}, ["particle.shape", "did you mean 'staple'?"]),
    "no shape": ({"length_m": 0.01}, ["particle.shape", "missing"]),
    "only a name": ("ring", ["particle", "{shape: ring, …}"]),
    "unknown key": ({"shape": "rod", "lenght_m": 0.01}, ["'lenght_m'", "did you mean 'length_m'?"]),
    "counts": ([{"shape": "rod", "length_m": 0.01, "count": 5}], ["count", "add up to 5"]),
    "density": ({"shape": "rod", "length_m": 0.01, "density_kg_per_m3": 7.85}, ["density_kg_per_m3", "7850"]),
}


@pytest.mark.parametrize("case", BAD)
def test_bodies_that_cannot_be_are_rejected_at_reading(case: str) -> None:
    particle, said = BAD[case]
    with pytest.raises(InputError) as error:
        small({"engine": "links", "particle": particle, "container.radius_m": 0.02})
    text = str(error.value)
    assert "\n" not in text
    assert "particle" in text or "container" in text or "count" in text
    for part in said:
        assert part in text


ROD = {"shape": "rod", "length_m": 0.01}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"phases.1": {"type": "internal-oscillation", "theta_deg": 10}}, ["phases.1", "needs smarticles"]),
        ({"smarticle.aspect_ratio": 0.3}, ["smarticle", "leave smarticle or particle out"]),
        ({"motor": {"law": "stall"}}, ["motor", "no hinges"]),
        ({"plane": {}}, ["plane"]),
    ],
)
def test_what_needs_smarticles_is_rejected(changes: dict[str, Any], said: list[str]) -> None:
    with pytest.raises(InputError) as error:
        small({"engine": "links", "particle": ROD, **changes})
    for part in said:
        assert part in str(error.value)


def test_distances_of_segments() -> None:
    rng = np.random.default_rng(1)
    one, other = rng.normal(size=(2, 300, 2, 3))
    other[:100, 1] = other[:100, 0] + 2.0 * (one[:100, 1] - one[:100, 0])  # parallel ones
    s = np.linspace(0, 1, 401)
    points = [each[:, :1] + s[:, None] * (each[:, 1:] - each[:, :1]) for each in (one, other)]
    coarse = np.array([np.linalg.norm(a[:, None] - b, axis=-1).min() for a, b in zip(*points, strict=True)])
    found = segment_distances(one, other)
    assert (found <= coarse + 1e-12).all()
    assert (found >= coarse - 0.02).all()  # the grid's points are up to 0.01 from the nearest ones
    assert segment_distances(np.zeros((1, 2, 3)), np.ones((1, 2, 3)))[0] == pytest.approx(math.sqrt(3))
