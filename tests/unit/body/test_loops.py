"""Closed curves of bodies, and their linking numbers."""

import math
from typing import Any

import numpy as np
import pytest
from scenes import make_particle, small

from dem.body.bars import segment_distances
from dem.body.loops import Curves, bars_of, linking_number, loops_of
from postprocess.measures.linking import gauss_integral

D = 0.001
ROUND = {"diameter_m": D}
RING = {"shape": "ring", "radius_m": 0.005, **ROUND}
CORNERS = [[0.01 * math.cos(a), 0.01 * math.sin(a), 0.0] for a in np.arange(6) * math.pi / 3]
SQUARE = np.array([[1.0, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])


def frame(points: Any, pairs: Any) -> dict[str, Any]:
    return {"shape": "segments", "points_m": points, "pairs": pairs, **ROUND}


def moved(curve: np.ndarray, *by: float) -> np.ndarray:
    return curve + np.array(by)


def clip(gap: float) -> dict[str, Any]:
    """A bent wire whose last bar runs beside the first one, their axes `gap` apart [m]."""
    path = [[0, 0, 0], [0.01, 0, 0], [0.01, 0.008, 0], [0.002, 0.008, 0], [0.002, gap, 0], [0.006, gap, 0]]
    return frame(path, [[k, k + 1] for k in range(5)])


HEXAGON = [[k, (k + 1) % 6] for k in range(6)]
CHAIN = {"shape": "chain", "links": 4, "link_m": 0.008, "joints": {"law": "free", "poured_deg": 90}, **ROUND}
WORM = {"shape": "filament", "length_m": 0.03, "segments": 12, "young_modulus_Pa": 5e4, "poured_bend_deg": 300, **ROUND}
NUMBERS: dict[str, tuple[Any, int]] = {
    "rod": ({"shape": "rod", "length_m": 0.01, **ROUND}, 0),
    "staple": ({"shape": "staple", "crown_m": 0.0117, "leg_m": 0.008}, 0),
    "star": ({"shape": "star", "arm_m": 0.007, **ROUND}, 0),
    "C": ({"shape": "c", "radius_m": 0.005, "opening_deg": 20, **ROUND}, 0),
    "clip that lets a bar in": (clip(2.1 * D), 0),
    "clip that lets no bar in": (clip(1.4 * D), 1),
    "ring": (RING, 1),
    "theta": (frame([*CORNERS, [0, 0, 0]], [*HEXAGON, [0, 6], [6, 3]]), 2),
    "wheel": (frame([*CORNERS, [0, 0, 0]], [*HEXAGON, *([k, 6] for k in range(6))]), 6),
    "ring with a tail": (frame([*CORNERS, [0.02, 0, 0]], [*HEXAGON, [0, 6]]), 1),
    "chain poured as a square": (CHAIN, 0),
    "filament poured as an arc": (WORM, 0),
}


@pytest.mark.parametrize(("particle", "number"), NUMBERS.values(), ids=NUMBERS)
def test_a_body_has_as_many_loops_as_a_basis_of_its_closed_curves(particle: Any, number: int) -> None:
    scene = small({"engine": "links", "particle": particle, "count": 2})
    loops = loops_of(scene.bodies[0], thinnest=D)
    assert len(loops) == number
    for loop in loops:
        corners, bars = loop.corners(bars_of(scene.bodies[0])), bars_of(scene.bodies[0])
        middles = (corners + np.roll(corners, -1, axis=0)) / 2
        off = [segment_distances(np.broadcast_to(at, bars.shape), bars).min() > 1e-9 for at in middles]
        assert sum(off) == (particle == clip(1.4 * D))  # sides lie on bars, but for a gate
        assert len({tuple(corner) for corner in corners.round(9)}) > 2


def test_smarticles_are_closed_only_if_their_mouth_is_narrower_than_a_bar() -> None:
    assert loops_of(make_particle(0.7), thinnest=1.2e-3) == []
    assert loops_of(make_particle(0.0), thinnest=1.2e-3) == []
    assert loops_of(make_particle(0.94, (120.0, 120.0)), thinnest=1.2e-3)


def test_linking_numbers_of_known_curves() -> None:
    other = moved(SQUARE[:, [0, 2, 1]], 1.0, 0.0, 0.0)
    assert abs(linking_number(SQUARE, other)) == 1
    assert linking_number(SQUARE, other[::-1]) == -linking_number(SQUARE, other)
    assert linking_number(SQUARE, moved(other, 3.0, 0.0, 0.0)) == 0
    assert linking_number(SQUARE, 0.5 * SQUARE) == 0  # one inside of the other, in one plane
    # Curves on a torus that go round each other three times.
    t = np.linspace(0, 2 * math.pi, 40, endpoint=False)
    one, two = (
        np.stack([(2 + np.cos(3 * t + s)) * np.cos(t), (2 + np.cos(3 * t + s)) * np.sin(t), np.sin(3 * t + s)], axis=1)
        for s in (0.0, math.pi)
    )
    assert abs(linking_number(one, two)) == 3


def test_linking_numbers_are_those_of_gauss_and_do_not_depend_on_the_last_bits() -> None:
    rng, numbers = np.random.default_rng(4), []
    for _ in range(60):
        one, two = rng.normal(size=(7, 3)), rng.normal(size=(9, 3))
        closed = [np.concatenate([curve, curve[:1]])[None] for curve in (one, two)]
        number = linking_number(one, two)
        assert number == pytest.approx(float(gauss_integral(*closed)[0]), abs=1e-9)
        assert linking_number(one * (1 + 1e-13 * rng.normal(size=one.shape)), two) == number
        numbers.append(number)
    assert {-1, 0, 1} <= set(numbers)


def test_curves_find_a_link_with_any_of_those_in_place() -> None:
    other = moved(SQUARE[:, [0, 2, 1]], 1.0, 0.0, 0.0)
    present = Curves([moved(SQUARE, 9.0, 0.0, 0.0), SQUARE])
    assert present.linked([moved(other, 0.0, 0.0, 30.0), other])
    assert not present.linked([moved(other, 0.0, 3.0, 0.0)])
    assert not Curves().linked([other])
    assert not present.linked([])
