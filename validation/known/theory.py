"""Answers without closed form, integrated by SciPy independently of the engines."""

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
    """Integrate m x'' = −k x − c x' − m g from first touch until the contact force is zero.

    k [N/m], c [N s/m], m [kg], g [m/s²]; downward speed [m/s] and overlap [m] at first touch. Returns the contact time
    [s], and height above first touch [m] and upward speed [m/s] at the end of the contact.
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
    """Impact of a body on a spring and a dashpot that never pull."""

    restitution: float  #: Speed after over speed before [1]
    duration: float  #: Contact time, from first touch until the force is zero [s]


def dashpot_impact(*, stiffness: float, damping: float, mass: float) -> Impact:
    """Integrate an impact without gravity; restitution and duration do not depend on the speed.

    Stiffness [N/m], damping [N s/m] and effective mass [kg]. Source: Schwager and Pöschel, Granular Matter 9, 465
    (2007), integrated numerically.
    """
    duration, _, velocity = _impact(stiffness=stiffness, damping=damping, mass=mass, gravity=0.0, speed=1.0)
    return Impact(velocity, duration)


def bounced(*, gap: float, speed: float, time: float, gravity: float, **springs: float) -> float:
    """Return the height above first touch [m] of a body that has bounced once on a spring and a dashpot.

    At t = 0 the body is at a height `gap` above first touch [m] and has a downward speed [m/s]. `time` [s] lies after
    the bounce. `springs` are stiffness [N/m], damping [N s/m] and mass [kg].
    """
    touch = (math.sqrt(speed**2 + 2 * gravity * gap) - speed) / gravity
    # Starts just below first touch, so that the end of the contact is not found at its beginning.
    contact, height, velocity = _impact(**springs, gravity=gravity, speed=speed + gravity * touch, depth=1e-12)
    flight = time - touch - contact
    return height + velocity * flight - gravity * flight**2 / 2


def free_rotation(*, inertia: Array, start: Rotation, spin: Array, times: Array) -> tuple[Rotation, Array]:
    """Integrate Euler's equations of a free rigid body with principal moments of inertia (3,) [kg m²].

    At t = 0 `start` is the rotation from body frame to laboratory frame, `spin` the angular velocity in the laboratory
    frame, (3,) [rad/s]. Returns the rotations at n times [s], and angular velocities in the body frame, (n, 3) [rad/s].
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
    """Integrate the impact of a horizontal rigid body on springs and dashpots, for small tilts.

    Contacts are at x and y relative to the centre of mass, (n, 2) [m]; stiffness [N/m] and damping [N s/m] are those of
    one. Mass [kg], moments of inertia about x and y (2,) [kg m²], downward speed at first touch [m/s]. Returns upward
    velocity [m/s] and angular velocities about x and y [rad/s] after the impact, (3,), and the time until the last
    contact ends [s].
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

    # Long enough for the slowest tilt; small steps, since the force jumps at first touch.
    solution = solve_ivp(slope, (0, 12 / omega), [0, 0, 0, -speed, 0, 0], max_step=0.005 / omega, rtol=1e-8, atol=1e-14)
    pressed = [bool(forces(y).any()) for y in solution.y.T]
    return solution.y[3:, -1], float(solution.t[max(k for k, on in enumerate(pressed) if on)])
