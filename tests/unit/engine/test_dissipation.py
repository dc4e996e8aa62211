"""What a contact dissipates, against the kinetic energy that goes missing in small integrations of our own."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dem.engine.yade.ledger import Contacts

KN, KS, MASS = 500.0, 400.0, 1e-4


def contact(
    *,
    before: tuple[float, float, float],
    after: tuple[float, float, float],
    overlap: float,
    viscous: float = 0.0,
    shear: tuple[float, float, float] = (0.0, 0.0, 0.0),
    damping: tuple[float, float] = (0.0, 0.0),
    friction: float = 0.0,
) -> Contacts:
    """One contact; the first body is below the second, velocities are those of the second against the first."""
    return Contacts(
        normals=np.array([[0.0, 0.0, 1.0]]),
        before=np.array([before]),
        after=np.array([after]),
        overlaps=np.array([overlap]),
        viscous=np.array([viscous]),
        shear=np.array([shear]),
        stiffness=np.array([[KN, KS]]),
        damping=np.array([damping]),
        friction=np.array([friction]),
    )


def bounce(damping: float, step: float) -> tuple[float, float]:
    """Kinetic energy lost by a mass that bounces off a fixed sphere, and what the contact says of it."""
    height, speed, said = 1.3e-5, -0.3, 0.0
    for _ in range(100_000):
        overlap = -height
        before = speed
        if overlap > 0:
            viscous = -damping * speed
            speed += max(KN * overlap + viscous, 0.0) / MASS * step
            said += contact(
                before=(0, 0, before),
                after=(0, 0, speed),
                overlap=overlap,
                viscous=viscous,
                damping=(damping, 0.0),
            ).dissipated(step)
        height += speed * step
        if speed > 0 and height > 1e-4:
            return 0.5 * MASS * (0.3**2 - speed**2), said
    raise AssertionError("never came back")


@pytest.mark.parametrize("ratio", [0.05, 0.2, 0.6])
def test_bounce_loses_what_the_contact_dissipates(ratio: float) -> None:
    damping = 2 * ratio * math.sqrt(KN * MASS)
    errors = []
    for step in (2e-5, 1e-5, 2.5e-6):
        lost, said = bounce(damping, step)
        assert lost > 0.1 * 0.5 * MASS * 0.3**2 * ratio
        errors.append(abs(said - lost) / (0.5 * MASS * 0.3**2))
    # What is left is the energy of a contact that begins in the middle of a step, k (v dt)²/2 at most.
    assert max(errors[1:]) < 0.5 * KN * 1e-5**2 / (0.5 * MASS)
    assert errors[2] < 0.002


def test_steady_sliding_dissipates_friction_times_way() -> None:
    overlap, friction, speed, step = 1e-5, 0.4, 0.05, 1e-5
    limit = friction * KN * overlap
    # The second body moves along +x; the force that the law keeps is on the way of the first against the second.
    sliding = contact(
        before=(speed, 0, 0), after=(speed, 0, 0), overlap=overlap, shear=(-limit, 0, 0), friction=friction
    )
    assert sliding.dissipated(step) == pytest.approx(limit * speed * step, rel=1e-9, abs=0)


def test_sticking_spring_stores_and_dashpot_dissipates() -> None:
    overlap, speed, step, dashpot = 1e-5, 1e-4, 1e-5, 0.02
    common = {"before": (speed, 0, 0), "after": (speed, 0, 0), "overlap": overlap, "friction": 0.4}
    shear = (-1e-4, 0.0, 0.0)
    stored = ((1e-4 + KS * speed * step) ** 2 - 1e-4**2) / (2 * KS)
    plain = contact(shear=shear, **common).dissipated(step)
    # Work along the way less what the spring gains: the scheme's half square only.
    assert plain == pytest.approx(1e-4 * speed * step - stored, abs=1e-22)
    assert abs(plain) < 0.01 * stored
    damped = contact(shear=shear, damping=(0.0, dashpot), **common).dissipated(step)
    assert damped - plain == pytest.approx(dashpot * speed**2 * step, rel=1e-6, abs=0)
