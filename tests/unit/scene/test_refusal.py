"""The unit that a key spells."""

from __future__ import annotations

import pytest

from dem.refusal import unit_of


@pytest.mark.parametrize(
    ("key", "unit"),
    [
        ("phases.2.speed_m_per_s", "m/s"),
        ("gravity_m_per_s2", "m/s²"),
        ("smarticle.density_kg_per_m3", "kg/m³"),
        ("motor.stiffness_N_m_per_rad", "N m/rad"),
        ("phases.0.per_layer", ""),
        ("seed", ""),
        ("s", ""),
    ],
)
def test_unit_that_a_key_spells(key: str, unit: str) -> None:
    assert unit_of(key) == unit
