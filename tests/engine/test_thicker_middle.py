"""Robots with bodies of their own thickness in a plane: what of them touches walls, and when; nothing of their own."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import chain_cases
import pytest
from scenes import CHAIN, changed

pytestmark = pytest.mark.engine

Simulate = Callable[..., Any]
BODY, BARB, W, GAP = 0.021, 0.0095, 0.0467, 0.00105  # m
STIFFNESS, PITCH = 7000.0, 0.2  # N/m, diameters


def robots(width: float, **changes: Any) -> dict[str, Any]:
    """Plain data of two robots between walls [m]."""
    return changed(
        CHAIN,
        {
            "count": 2,
            "plane.width_m": width,
            "smarticle.middle_thickness_in_plane_m": BODY,
            "contact.friction_smarticle": 0.3,
            "contact.friction_wall": 0.3,
            "motor.damping_N_m_s_per_rad": 1e-3,
            "fidelity.pitch": PITCH,
            "phases.1": {"type": "strain", "speed_m_per_s": 0.05, "distance_m": 0.1, "tied_at": "axis"},
            **changes,
        },
    )


@pytest.mark.parametrize("body", [BODY, None])
def test_a_body_touches_the_wall_with_the_outer_row_of_its_spheres(simulate: Simulate, body: float | None) -> None:
    data = robots(0.09, **{"smarticle.middle_thickness_in_plane_m": body})
    away = simulate(chain_cases.leaning, data, depth=-1e-6)
    # Free of the wall by a micron nothing touches: not the wall, nor, articulated, a link another of its own.
    assert (away["force"], away["touches"]) == (0, 0)
    assert away["energy"] < 1e-25
    pressed = simulate(chain_cases.leaning, data, depth=1e-6)
    row = 1 + -(-W // (PITCH * BARB))  # spheres from hinge to hinge, no further apart than the pitch
    assert pressed["touches"] == row
    assert pressed["force"] == pytest.approx(row * STIFFNESS * 1e-6, rel=1e-6)


def test_a_chain_meets_its_walls_when_it_has_become_as_wide_as_they_are_apart(simulate: Simulate) -> None:
    width = 0.084
    found = simulate(chain_cases.between_walls, robots(width), strain=0.55)
    widths, forces, _ = zip(*found, strict=True)
    # At the start: two rows of bodies, a barb and a gap between them.
    assert widths[0] == pytest.approx(W + GAP + 1.5 * BODY, abs=2e-5)
    felt = next(k for k, force in enumerate(forces) if force > 0)
    assert max(widths[:felt]) < width
    # From then on bodies lie on the walls: they are pressed in by what the force needs, and no more.
    deepest = max(depth for *_, depth in found)
    assert width <= max(widths) <= width + 2 * deepest
    assert deepest < 0.02 * BARB
    assert max(forces) > 0.2
