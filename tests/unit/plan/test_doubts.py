"""Warnings about values that are allowed and probably wrong."""

from pathlib import Path
from typing import Any

import pytest
from scenes import small

from dem.plan.outlook import warnings_of

STAPLE = {"shape": "staple", "crown_m": 0.01, "leg_m": 0.004}
CHAIN = {"shape": "chain", "links": 5, "link_m": 0.01}


def doubts(changes: dict[str, Any]) -> list[str]:
    return [line for line in warnings_of(small(changes)) if " rad write " in line or " become a column " in line]


def swinging(**keys: float) -> dict[str, Any]:
    barbs = {"type": "sine", "centre_deg": 90, "amplitude_deg": 10, "frequency_hz": 1, **keys}
    return {"phases": [{"type": "deposit"}, {"type": "actuate", "barbs": barbs, "duration_s": 1}]}


@pytest.mark.parametrize(("changes", "begin", "end"), [
    ({"smarticle.angles_deg": [90, 1.57]}, "smarticle.angles_deg: 1.57 means 1.57°", "for 1.57 rad write 90"),
    ({"smarticle.angles_deg": [1.2, 90]}, "smarticle.angles_deg: 1.2 means", "for 1.2 rad write 68.8"),
    (swinging(amplitude_deg=1.4), "phases.1.barbs.amplitude_deg: 1.4 means", "write 80"),
    (swinging(centre_deg=1.0472), "phases.1.barbs.centre_deg: 1.0472 means", "write 60"),
    ({"phases": [{"type": "deposit"}, {"type": "internal-oscillation", "theta_deg": 1.4}]},
     "phases.1.theta_deg: 1.4 means", "write 80"),
    ({"engine": "links", "particle": {"shape": "c", "radius_m": 0.004, "opening_deg": 3.14, "diameter_m": 1e-4}},
     "particle.0.opening_deg: 3.14 means", "write 180"),
])  # fmt: skip
def test_angles_that_are_radians_are_doubted(changes: dict[str, Any], begin: str, end: str) -> None:
    lines = doubts(changes)
    assert len(lines) == 1
    assert lines[0].startswith(begin)
    assert lines[0].endswith(end)


@pytest.mark.parametrize("changes", [
    {"smarticle.angles_deg": [0, 0]},
    {"smarticle.angles_deg": [10, 90]},
    swinging(amplitude_deg=5),
    swinging(centre_deg=2),
    {"engine": "links", "particle": {"shape": "c", "radius_m": 0.004, "opening_deg": 20}},
    {"engine": "links", "particle": {**CHAIN, "links": 3, "joints": {"law": "elastic", "stiffness_N_m_per_rad": 1e-4,
                                                         "rest_angle_deg": 2}}},
])  # fmt: skip
def test_angles_in_degrees_are_not(changes: dict[str, Any]) -> None:
    assert doubts(changes) == []


def test_bodies_that_are_placed_are_no_column(tmp_path: Path) -> None:
    (tmp_path / "rod.csv").write_text("body,x,y,z\n0,0,0,0.005\n0,0,0,0.205\n")
    place = {"type": "place", "file": str(tmp_path / "rod.csv"), "unit": "m"}
    rod = {"engine": "links", "particle": {"shape": "rod", "length_m": 0.2, "diameter_m": 1e-3}}
    assert doubts({**rod, "count": 1, "container.radius_m": 0.003, "phases": [place]}) == []


def test_a_pile_like_a_column_is_doubted_unless_the_wall_is_given() -> None:
    many = {"count": 5000, "container.radius_m": 0.03}
    lines = doubts(many)
    assert len(lines) == 1
    assert lines[0].startswith("count: 5000 bodies in container.radius_m = 0.03 m become a column of about 0.")
    scene = small(many)
    assert f"in a wall of {scene.cylinder.height:.3g} m" in lines[0]
    assert doubts({**many, "container.height_m": scene.cylinder.height}) == []
    assert doubts({"count": 1000, "container.radius_m": 0.03}) == []
    # What it advises is a pile as high as wide.
    radius = float(lines[0].partition("use a radius of ")[2].partition(" ")[0])
    advised = small({**many, "container.radius_m": radius})
    assert advised.loose_height / (2 * radius) == pytest.approx(1, rel=0.1)


@pytest.mark.parametrize(("restitution", "warned"), [(0.01, True), (0.29, True), (0.3, False), (0.7, False)])
def test_friction_at_low_restitution_is_doubted(restitution: float, warned: bool) -> None:
    lines = [line for line in warnings_of(small({"contact.restitution": restitution})) if "Coulomb" in line]
    assert len(lines) == warned
    assert all(line.startswith(f"contact.restitution: at {restitution:g} ") for line in lines)
