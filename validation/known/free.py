"""Known answers without contact: free fall and free rotation.

`access` is the engine, with access to its internals; `dt` is a time step, a sequence `steps` has several [s].
"""

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from validation.access import EngineAccess
from validation.bench import TILTED, Array, G, add, body_rotations, law_of, scene
from validation.cases import COARSE, MIDDLE, Answer, case, ladder
from validation.known.theory import free_rotation

MIDPOINT = "the implicit midpoint rule: second order"
TURNS = "YADE's exactAsphericalRot takes the frame of the step's beginning for its middle: first order"
EULER = "Euler's equations, integrated to 1e-12"

SPIN = np.array([20.0, 35.0, -15.0])  # [rad/s], about no principal axis of the U
ABOUT_MIDDLE = np.array([10.0, 40.0, 5.0])  # [rad/s], body frame; mainly about the axis of the intermediate moment


def fall(access: EngineAccess, dt: float, *, time: float, throw: float, centred: bool) -> tuple[Array, float, float]:
    """Throw a smarticle upwards at the velocity `throw` [m/s] without rotation; simulate for a `time` [s].

    Velocities of the leapfrog scheme belong to half a step before the positions; `centred` corrects the initial
    velocity for this. Returns the displacement of the centre of mass (3,) [m], the upward velocity half a step before
    the end [m/s], and the angle of rotation [rad].
    """
    one = scene(access)
    engine = access.build(one.body, law_of(one), dt=dt, gravity=G)
    add(engine, (0, 0, 0.1), TILTED)
    access.push(engine, 0, velocity=(0, 0, throw + centred * G * dt / 2))
    engine.advance(round(time / dt))
    state = engine.state().smarticles
    turned = (Rotation.from_matrix(body_rotations(state)[0]) * TILTED.inv()).magnitude()
    return state.positions[0] - [0, 0, 0.1], float(state.velocities[0, 2]), float(turned)


@case("free fall", "a tilted smarticle thrown upwards", "z = v₀t − gt²/2; leapfrog is exact")
def free_fall(access: EngineAccess) -> list[Answer]:
    dt, time, throw = 5e-5, 0.1, 0.3
    way, velocity, turned = fall(access, dt, time=time, throw=throw, centred=True)
    rise, across = throw * time - G * time**2 / 2, np.hypot(*way[:2])
    reason = "rounding of 2000 additions: leapfrog is exact under a constant force"
    return [
        Answer("rise after 0.1 s [m]", rise, way[2], 1e-11, reason),
        Answer("velocity half a step before [m/s]", throw - G * (time - dt / 2), velocity, 1e-11, reason),
        Answer("way across [m]", 0.0, across, 1e-11, "nothing acts across", scale=abs(rise)),
        Answer("turn [rad]", 0.0, turned, 1e-11, "nothing turns it", scale=1.0),
    ]


@ladder(
    "let go from rest",
    "a smarticle falls, let go as the pour does it",
    "height after 0.1 s [m]",
    9.81 * 0.096**2 / 2,
    COARSE,
    (1, "bodies are let go with the velocity of half a step before: a shift in time by half a step, no more"),
)
def fall_errors(access: EngineAccess, steps: Sequence[float]) -> list[float]:
    return [abs(fall(access, dt, time=0.096, throw=0.0, centred=False)[0][2] + G * 0.096**2 / 2) for dt in steps]


def spin_rotations(access: EngineAccess, dt: float, *, spin: Array, times: Array) -> tuple[Rotation, Array]:
    """Simulate a freely rotating smarticle with an initial angular velocity (3,) [rad/s].

    Returns the rotations at n times [s], and the mean angular velocities in the step before each, (n, 3) [rad/s].
    """
    one = scene(access)
    engine = access.build(one.body, law_of(one), dt=dt)
    add(engine, (0, 0, 0.1), TILTED)
    access.push(engine, 0, spin=spin)
    rows, spins = [], []
    for time in times:
        engine.advance(round(time / dt) - 1 - engine.steps)
        before = Rotation.from_matrix(body_rotations(engine.state().smarticles)[0])
        engine.advance(1)
        rows.append(Rotation.from_matrix(body_rotations(engine.state().smarticles)[0]))
        spins.append((rows[-1] * before.inv()).as_rotvec() / dt)
    return Rotation.concatenate(rows), np.array(spins)


def _exact(access: EngineAccess, spin: Array, times: Array) -> Rotation:
    inertia = scene(access).smarticle.boxes.inertia
    return free_rotation(inertia=inertia, start=TILTED, spin=spin, times=times)[0]


@case("torque-free spin", "a U about no axis in particular; its three moments differ", EULER)
def torque_free_spin(access: EngineAccess) -> list[Answer]:
    inertia = scene(access).smarticle.boxes.inertia
    times, coarse = np.linspace(0.02, 0.2, 10), 2e-5
    exact = _exact(access, SPIN, times)
    momentum = TILTED.apply(inertia * TILTED.inv().apply(SPIN))
    energy, turned = momentum @ SPIN / 2, float(np.linalg.norm(SPIN)) * times[-1]
    misfits, energies, momenta = [], [], []
    for dt in (coarse, coarse / 2):
        rotations, spins = spin_rotations(access, dt, spin=SPIN, times=times)
        misfits.append((rotations * exact.inv()).as_rotvec())
        # Angular velocities belong to the middle of a step, so the body frame of that time is used.
        middle = Rotation.from_rotvec(-spins * dt / 2) * rotations
        body = middle.inv().apply(spins)
        energies.append(float((inertia * body[-1] ** 2).sum() / 2))
        momenta.append(middle.apply(inertia * body)[-1])
    extrapolated, at_coarse = (np.linalg.norm(m, axis=1).max() for m in (2 * misfits[1] - misfits[0], misfits[0]))
    grown = 0.25 * float(SPIN @ SPIN) * coarse * times[-1]
    change, size = (float(np.linalg.norm(m)) for m in (2 * momenta[1] - momenta[0] - momentum, momentum))
    limit = "what is left of second order after extrapolation from 20 and 10 µs; the step's own error is of first order"
    first = "YADE's rotation is of first order: some ω dt of the angle turned"
    grows = "grows by some 0.2 ω² dt per second: first order; contacts dissipate half of it a hundred times a second"
    return [
        Answer("orientation after 1.4 turns, dt → 0 [rad]", 0.0, extrapolated, 2e-5, limit, scale=turned),
        Answer("orientation after 1.4 turns, dt = 20 µs [rad]", 0.0, at_coarse, 2e-3, first, scale=turned),
        Answer("kinetic energy, dt → 0 [J]", energy, 2 * energies[1] - energies[0], 1e-5, limit),
        Answer("kinetic energy after 0.2 s, dt = 20 µs [J]", energy, energies[0], grown, grows),
        Answer("angular momentum, change of the vector, dt → 0 [kg m²/s]", 0.0, change, 1e-5, limit, scale=size),
    ]


PRINCIPAL = TILTED.apply([0.0, 0.0, 43.0])  # rad/s, about the normal of the plane
IN_PLANE = {"yade": (2, "about a principal axis the frame does not matter: second order"), "links": (2, MIDPOINT)}
ANY_AXIS = {"yade": (1, TURNS), "links": (2, MIDPOINT)}


@ladder(
    "spin",
    "a smarticle spins about no axis in particular",
    "orientation after 1.4 turns [rad]",
    8.6,
    COARSE,
    ANY_AXIS,
    spin=SPIN,
    time=0.2,
)
@ladder(
    "spin in the plane",
    "a smarticle spins about the normal of its plane",
    "orientation after 1.3 turns [rad]",
    8.3,
    (3.2e-4, 1.6e-4, 8e-5, 4e-5),
    IN_PLANE,
    spin=PRINCIPAL,
    time=0.192,
)
def spin_errors(access: EngineAccess, steps: Sequence[float], *, spin: Array, time: float) -> list[float]:
    times = np.array([time])
    exact = _exact(access, spin, times).inv()
    return [float((spin_rotations(access, dt, spin=spin, times=times)[0] * exact).magnitude()[0]) for dt in steps]


FLIPS = np.linspace(2e-3, 0.5, 250)  # times of output for `flips` [s]


def _between_flips(access: EngineAccess, rotations: Rotation) -> float:
    """Return the time between the first two flips, from rotations at the times FLIPS [s]."""
    # The angular momentum is constant; its component along the body's y axis changes sign at each flip.
    momentum = TILTED.apply(scene(access).smarticle.boxes.inertia * ABOUT_MIDDLE)
    roots = CubicSpline(FLIPS, rotations.inv().apply(momentum)[:, 1]).roots(extrapolate=False)
    return float(roots[1] - roots[0])


def _flip_times(access: EngineAccess, steps: Sequence[float]) -> tuple[list[float], float]:
    """Return the times between the first two flips for several time steps, and by theory [s]."""
    spin = TILTED.apply(ABOUT_MIDDLE)
    found = [_between_flips(access, spin_rotations(access, dt, spin=spin, times=FLIPS)[0]) for dt in steps]
    return found, _between_flips(access, _exact(access, spin, FLIPS))


@case("middle axis", "a U about the axis of its middle moment flips over and over", EULER)
def flips(access: EngineAccess) -> list[Answer]:
    (coarse, fine), exact = _flip_times(access, (2e-5, 1e-5))
    limit = "what is left of second order after extrapolation from 20 and 10 µs, off by 2.7 and 1.4 %"
    grows = (
        "first order: energy grows by 0.2 ω² dt per second, and the time goes with the logarithm of what little energy "
        "parts this motion from one that never flips"
    )
    return [
        Answer("time between two flips, dt → 0 [s]", exact, 2 * fine - coarse, 3e-3, limit),
        Answer("time between two flips, dt = 20 µs [s]", exact, coarse, 0.05, grows),
    ]


@ladder(
    "flips", "a smarticle about the axis of its middle moment", "time between two flips [s]", 0.208, MIDDLE, ANY_AXIS
)
def flip_errors(access: EngineAccess, steps: Sequence[float]) -> list[float]:
    found, exact = _flip_times(access, steps)
    return [abs(time - exact) for time in found]
