"""Answers that have no closed form, integrated by SciPy independently of the engine."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from validation.bench import Array


def _impact(
    *, stiffness: float, damping: float, mass: float, gravity: float, speed: float, depth: float = 0.0
) -> tuple[float, float, float]:
    """Integrate m x'' = −k x − c x' − m g from first touch until the force would pull.

    Returns:
        Time in contact [s], height over first touch [m] and speed upwards [m/s] at its end.
    """

    def push(y: Array) -> float:
        return float(-stiffness * y[0] - damping * y[1])

    def parts(_: float, y: Array) -> float:
        return push(y)

    parts.terminal, parts.direction = True, -1  # type: ignore[attr-defined]
    solution = solve_ivp(
        lambda _, y: [y[1], push(y) / mass - gravity],
        (0, 10 * math.sqrt(mass / stiffness)),
        [-depth, -speed],
        method="DOP853",
        events=parts,
        rtol=1e-12,
        atol=1e-15,
    )
    height, velocity = solution.y_events[0][0]
    return float(solution.t_events[0][0]), float(height), float(velocity)


class Impact(NamedTuple):
    """A body on a spring and dashpot that never pulls, thrown at them."""

    restitution: float  #: Speed after over speed before [1]
    duration: float  #: From first touch until the force is zero [s]


def dashpot_impact(*, stiffness: float, damping: float, mass: float) -> Impact:
    """Integrate an impact without gravity, whose answer depends on no speed.

    Source: Schwager and Pöschel, Granular Matter 9, 465 (2007); integrated here.
    """
    duration, _, velocity = _impact(stiffness=stiffness, damping=damping, mass=mass, gravity=0.0, speed=1.0)
    return Impact(velocity, duration)


def bounced(*, gap: float, speed: float, time: float, gravity: float, **springs: float) -> float:
    """Return the height of a body that bounced once on a spring and dashpot that never pulls, over first touch [m].

    At t = 0 it has a gap below [m] and falls at a speed [m/s]; at the time [s] it has bounced once. Springs: stiffness
    [N/m], damping [N s/m] and mass [kg].
    """
    met = (math.sqrt(speed**2 + 2 * gravity * gap) - speed) / gravity
    # A little below first touch, so that an elastic contact does not end where it begins.
    contact, height, velocity = _impact(**springs, gravity=gravity, speed=speed + gravity * met, depth=1e-12)
    flight = time - met - contact
    return height + velocity * flight - gravity * flight**2 / 2


def free_rotation(*, inertia: Array, start: Rotation, spin: Array, times: Array) -> tuple[Rotation, Array]:
    """Integrate Euler's equations of a rigid body of principal moments (3,) [kg m²] without torque.

    At t = 0 it has a rotation, body frame to laboratory frame, and a spin (3,) in the laboratory frame [rad/s]. Returns
    rotations at rising times (n,) above 0 [s], and angular velocities in the body frame (n, 3) [rad/s].
    """

    def slope(_: float, y: Array) -> Array:
        vector, scalar, omega = y[:3], y[3], y[4:]
        rate = 0.5 * np.array([*(scalar * omega + np.cross(vector, omega)), -vector @ omega])
        return np.array([*rate, *(np.cross(inertia * omega, omega) / inertia)])

    first = [*start.as_quat(), *start.inv().apply(spin)]
    solution = solve_ivp(slope, (0, times[-1]), first, t_eval=times, method="DOP853", rtol=1e-12, atol=1e-12)
    return Rotation.from_quat(solution.y[:4].T), solution.y[4:].T


def falling_on_springs(
    points: Array, *, stiffness: float, damping: float, mass: float, inertia: NDArray[np.float64], speed: float
) -> tuple[Array, float]:
    """Integrate the fall of a flat rigid body, lying flat, on springs and dashpots under its points; small tilts.

    Points (n, 2) are x and y of the contacts from the centre of mass [m], stiffness [N/m] and damping [N s/m] those of
    one contact, the inertia (2,) that about x and y [kg m²]; the speed is downwards, at first touch [m/s]. Returns
    velocity
    upwards and spins about x and y afterwards (3,) [m/s, rad/s], and the time from the first touch to the end of the
    last
    contact [s].
    """
    lift = np.stack([np.ones(len(points)), points[:, 1], -points[:, 0]], axis=1)  # heights of the points
    masses = np.array([mass, *inertia])
    omega = math.sqrt(len(points) * stiffness / mass)

    def forces(y: Array) -> Array:
        gap, rate = lift @ y[:3], lift @ y[3:]
        found: Array = np.where(gap < 0, np.maximum(-stiffness * gap - damping * rate, 0.0), 0.0)
        return found

    def slope(_: float, y: Array) -> Array:
        return np.concatenate([y[3:], lift.T @ forces(y) / masses])

    # Long enough for the slowest tilt; steps short against the contact, whose force jumps at first touch.
    solution = solve_ivp(slope, (0, 12 / omega), [0, 0, 0, -speed, 0, 0], max_step=0.005 / omega, rtol=1e-8, atol=1e-14)
    pressed = [bool(forces(y).any()) for y in solution.y.T]
    return solution.y[3:, -1], float(solution.t[max(k for k, on in enumerate(pressed) if on)])
