"""The catalogue of known answers: what can be asked of it without YADE."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dem.physics.contact import damping_ratio, restitution_of
from validation.check import Answer
from validation.known.theory import bounced, dashpot_impact, falling_on_springs, free_rotation


@pytest.mark.parametrize(("measured", "ok"), [(1.009, True), (1.011, False), (0.0, False), (math.nan, False)])
def test_a_check_passes_within_its_tolerance_only(measured: float, ok: bool) -> None:
    check = Answer("q [m]", 1.0, measured, 0.01)
    assert check.good is ok


def test_an_error_is_relative_to_the_scale_where_theory_is_zero() -> None:
    check = Answer("q [m]", 0.0, 0.02, 0.01, scale=2.0)
    assert check.error == 0.01


# -- the theory itself -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("restitution", [0.1, 0.5, 0.9, 1.0])
def test_integrated_impact_is_schwagers_and_poeschels(restitution: float) -> None:
    zeta = damping_ratio(restitution)
    impact = dashpot_impact(stiffness=500.0, damping=2 * zeta * math.sqrt(500.0 * 2e-4), mass=2e-4)
    assert impact.restitution == pytest.approx(restitution_of(zeta), rel=1e-6)
    if restitution == 1:
        assert impact.duration == pytest.approx(math.pi * math.sqrt(2e-4 / 500), rel=1e-6)


def test_bounce_keeps_energy_where_nothing_damps() -> None:
    way = {"gap": 1e-4, "speed": 0.2, "stiffness": 500.0, "damping": 0.0, "mass": 2.6e-4, "gravity": 9.81}
    top = 1e-4 + 0.2**2 / (2 * 9.81)
    heights = [bounced(time=time, **way) for time in np.linspace(0.02, 0.03, 400)]
    assert max(heights) == pytest.approx(top, rel=1e-5)


def test_free_rotation_about_a_principal_axis_is_uniform() -> None:
    rotations, spins = free_rotation(
        inertia=np.array([1.0, 2.0, 3.0]),
        start=Rotation.identity(),
        spin=np.array([0, 0, 2.0]),
        times=np.array([0.5, 1.0]),
    )
    assert rotations.as_rotvec() == pytest.approx(np.array([[0, 0, 1.0], [0, 0, 2.0]]), abs=1e-9)
    assert spins == pytest.approx(np.tile([0, 0, 2.0], (2, 1)))


def test_springs_about_the_centre_are_one_spring_of_their_sum() -> None:
    points = np.array([[1e-3, 0], [-1e-3, 0], [0, 2e-3], [0, -2e-3]])
    after, lasts = falling_on_springs(
        points, stiffness=100.0, damping=0.02, mass=1e-4, inertia=np.array([1e-10, 1e-10]), speed=0.1
    )
    one = dashpot_impact(stiffness=400.0, damping=0.08, mass=1e-4)
    assert after == pytest.approx([0.1 * one.restitution, 0, 0], rel=2e-3, abs=1e-9)
    assert lasts == pytest.approx(one.duration, rel=0.01)
