"""Oblique impacts of a ball: sliding throughout, and sticking throughout."""

from __future__ import annotations

import math

from validation.bench import ball_law
from validation.check import Answer
from validation.engines import BALL_MASS, BALL_RADIUS, EngineAccess
from validation.known.impact import CONTACT_TIME, ONSET, RESOLVED, ball_impact

FRICTION = 0.4


def sliding_impact(access: EngineAccess, restitution: float, *, dashpot: float, steps: int = RESOLVED) -> list[Answer]:
    """A ball that slides on the floor as long as it touches it: the tangential impulse is μ times the normal one.

    Not quite, with a tangential dashpot: YADE holds the tangential spring to Coulomb's limit, and adds the dashpot's
    force without limit until the spring has reached it. With s and v the speeds of slip and approach that is at
    t* = μ cn v / (ks s − μ kn v), and the impulse until then exceeds Coulomb's by (cs s − μ cn v/2) t*. A step longer
    than t* never sees it.

    Args:
        access: on the engine.
        restitution: [1].
        dashpot: cs over cn; scenes have 0.9 [1].
        steps: in an elastic contact [1].
    """
    speed, slip, dt = 0.2, 1.5, CONTACT_TIME / steps
    law = ball_law(restitution=restitution, friction=FRICTION, dashpot=dashpot)
    found = ball_impact(access, law, speed=speed, slip=slip, dt=dt)
    inertia = access.ball().boxes.inertia[1]
    cn, kn, ks = law.wall_damping, law.normal_stiffness, law.tangential_stiffness
    winding = FRICTION * cn * speed / (ks * slip - FRICTION * kn * speed)
    excess = (dashpot * cn * slip - FRICTION * cn * speed / 2) * winding if winding > dt else 0.0
    coulomb = FRICTION * BALL_MASS * (1 + restitution) * speed
    impulse = coulomb + excess
    # At the lever from the centre to the floor, which is shorter than the radius by the overlap: by its mean under the
    # normal force, π/4 of the largest in a sine.
    lever = BALL_RADIUS - access.arm_share * math.pi / 4 * found.deepest
    reason, tolerance = "second order", 1e-4
    if restitution < 1:
        reason = f"{ONSET}; and the estimate of the excess takes both speeds as constant while the spring is wound up"
        tolerance = 0.01 + 0.05 * excess / coulomb
    normal = BALL_MASS * (float(found.velocity[2]) + speed)
    over = Answer(
        quantity="tangential impulse over μ times the normal one",
        unit="1",
        theory=1 + excess / coulomb,
        measured=(slip - float(found.velocity[0])) * BALL_MASS / (FRICTION * normal),
        tolerance=tolerance,
        reason=reason,
    )
    if steps < RESOLVED:  # too few for the other answers
        return [over]
    return [
        over,
        Answer(
            quantity="tangential velocity lost",
            unit="m/s",
            theory=impulse / BALL_MASS,
            measured=slip - float(found.velocity[0]),
            tolerance=tolerance,
            reason=reason,
        ),
        Answer(
            quantity="spin gained",
            unit="rad/s",
            theory=impulse * lever / inertia,
            measured=float(found.spin[1]),
            tolerance=tolerance,
            reason=f"{reason}; mean lever",
        ),
    ]


def sticking_impact(access: EngineAccess) -> list[Answer]:
    """A ball that never slides: the tangential spring, tuned to half a vibration per contact, turns the slip around.

    The contact point moves on the mass m/(1 + m r²/I), 2/7 m of a solid ball, so with that share of kn for ks both
    directions vibrate alike; the force stays within Coulomb's cone throughout where slip/speed < μ kn/ks.
    """
    inertia = access.ball().boxes.inertia[1]
    share = 1 / (1 + BALL_MASS * BALL_RADIUS**2 / inertia)
    speed, dt = 0.01, CONTACT_TIME / RESOLVED
    slip = min(1.0, 0.72 * FRICTION / share) * speed
    law = ball_law(friction=FRICTION, tangential=share)
    found = ball_impact(access, law, speed=speed, slip=slip, dt=dt)
    # To both sides of the contact point the mass is felt at the lever, which is shorter than the radius by the overlap.
    reason = "the lever is shorter than the radius by the overlap, 0.7 %, and with it the vibration slower"
    return [
        Answer(
            quantity="slip after, at the contact",
            unit="m/s",
            theory=-slip,
            measured=float(found.velocity[0] - found.spin[1] * BALL_RADIUS),
            tolerance=0.02,
            reason=reason,
        ),
        Answer(
            quantity="tangential velocity after",
            unit="m/s",
            theory=slip - 2 * share * slip,
            measured=float(found.velocity[0]),
            tolerance=0.02,
            reason=reason,
        ),
        Answer(
            quantity="spin after",
            unit="rad/s",
            theory=2 * share * BALL_MASS * slip * BALL_RADIUS / inertia,
            measured=float(found.spin[1]),
            tolerance=0.01,
            reason=reason,
        ),
    ]
