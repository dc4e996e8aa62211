import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dem.errors import InputError
from postprocess import DEFINITIONS, packing_fraction
from postprocess.geometry.voronoi import local_packing
from postprocess.geometry.voxel import Region, solid_fraction

T1, T2 = 0.11, 0.05
SOLID = T1 * T2 * 2.4
# Links of a U overlap at its two hinges, by a quarter of t2² each.
UNION = SOLID - T1 * T2**2 / 2


def lattice(shape, cell, *, radius, layers, floor_z=0.0, turn=None):
    """Equal smarticles at every point of a rectangular lattice inside a cylinder."""
    a, b, c = cell
    steps = np.arange(-int(radius / min(a, b)) - 1, int(radius / min(a, b)) + 2)
    grid = np.stack(np.meshgrid(steps * a, steps * b, (np.arange(layers) + 0.5) * c), axis=-1)
    places = grid.reshape(-1, 3)
    places = places[np.hypot(places[:, 0], places[:, 1]) < radius]
    form = shape(1.0, 0.7) - shape(1.0, 0.7).mean(axis=0)
    if turn is not None:
        form = form @ turn.T
    return form + places[:, None] + [0.0, 0.0, floor_z]


CELL = (1.2, 0.9, 0.8)
DENSITY = SOLID / math.prod(CELL)
FLOOR = 3.0


@pytest.fixture(scope="module")
def pile(shape):
    """Smarticles of known density, turned oddly, in a cylinder of radius 4."""
    turn = Rotation.from_rotvec([0.4, 0.9, -0.2]).as_matrix()
    return lattice(shape, CELL, radius=4.0, layers=6, floor_z=FLOOR, turn=turn)


def phi(pile, definition, **changes):
    arguments = {
        "radius": 4.0,
        "solid_volume": SOLID,
        "floor_z": FLOOR,
        "thickness_normal": T1,
        "thickness_in_plane": T2,
    }
    return packing_fraction(pile, definition=definition, **(arguments | changes))


def test_every_definition_names_itself_and_finds_the_lattice_density(pile):
    # Loose, since the wall and the surface of so small a lattice are ragged and the cuts of the
    # voxels split its layers; the exact tests of both follow below.
    allowed = {"second-highest-com": 0.15, "top-percentile": 0.15, "voxel": 0.15, "voronoi": 0.04}
    assert set(allowed) == set(DEFINITIONS)
    for definition, tolerance in allowed.items():
        result = phi(pile, definition)
        assert result.definition == definition
        wanted = DENSITY * (UNION / SOLID if definition == "voxel" else 1)
        assert result.value == pytest.approx(wanted, rel=tolerance)
        assert result.height == pytest.approx(6 * 0.8, rel=0.1)


@pytest.mark.parametrize("rotation", [(0, 0, 0), (0.5, 0.1, 1.3)])
def test_voxels_fill_exactly_the_union_of_one_smarticles_boxes(shape, rotation):
    turn = Rotation.from_rotvec(rotation).as_matrix()
    region = Region(radius=2.0, bottom=-2.0, top=2.0)
    value = solid_fraction([shape(1.0, 0.7) @ turn.T], region, thickness_normal=T1, thickness_in_plane=T2, pitch=T2 / 5)
    assert value * region.volume == pytest.approx(UNION, rel=0.01)


def test_voxels_count_overlaps_once(shape):
    region = Region(radius=2.0, bottom=-2.0, top=2.0)
    sizes = {"thickness_normal": T1, "thickness_in_plane": T2}
    once = solid_fraction([shape(1.0)], region, **sizes)
    assert solid_fraction([shape(1.0), shape(1.0)], region, **sizes) == once


def test_voronoi_cells_fill_the_container(scene):
    # Dense enough that images in wall, floor and lid close every cell.
    count, rng = 150, np.random.default_rng(0)
    angle, distance = rng.uniform(0, 2 * np.pi, count), 0.8 * np.sqrt(rng.uniform(0, 1, count))
    places = [distance * np.cos(angle), distance * np.sin(angle), rng.uniform(0.2, 1.8, count)]
    vertices = 0.2 * scene(count, 2, box=0.0) + np.stack(places, axis=1)[:, None]
    container = Region(radius=1.0, bottom=0.0, top=2.0)
    _, volumes = local_packing(vertices, container, container, solid_volume=1.0, spacing=0.05)

    # The wall is a polygon around the circle, so the sum comes out a little high.
    assert volumes.sum() == pytest.approx(container.volume, rel=0.05)
    assert volumes.sum() >= container.volume


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"definition": "guess"}, "unknown definition .* 'guess': .*'voxel'"),
        ({"radius": 0.0}, "radius must be above 0 m: got 0.0 m"),
        ({"solid_volume": float("nan")}, "solid_volume must be above 0 m³"),
        ({"definition": "voxel", "thickness_normal": None}, "needs thickness_normal"),
    ],
)
def test_bad_arguments(pile, changes, message):
    with pytest.raises(InputError, match=message):
        phi(pile, **({"definition": "top-percentile"} | changes))
    region = Region(radius=2.0, bottom=3.0, top=7.0)
    with pytest.raises(InputError, match="pitch"):
        solid_fraction(pile, region, thickness_normal=T1, thickness_in_plane=T2, pitch=1.0)
    with pytest.raises(InputError, match="spacing of the points"):
        local_packing(pile, region, region, solid_volume=SOLID, spacing=-1.0)
