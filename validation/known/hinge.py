"""Known answers for hinges: gaps under load, sag and tilt of barbs, vibrations of barbs.

`access` is the engine, with access to its internals; `dt` is a time step, a sequence `steps` has several [s].
"""

import math
from collections.abc import Sequence

import numpy as np
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

from dem.engine.interface import Engine
from dem.engine.yade.kind import hinge_law
from dem.scene.scene import Scene
from validation.access import EngineAccess
from validation.bench import Array, G, add, drive, scene, shape_change
from validation.cases import FINE, LEAPFROG, Answer, case, ladder

MODE = "eigenfrequency of links, shafts and pins; √(k/I) but for the pins"
NO_PINS = {"links": "hinges have no pins that give way: links are one body with two angles"}
NO_TILT = {"links": "shafts do not tilt: both barbs stay in the plane of the middle link"}

STRONG = 1.0  # torque limit that no motor reaches [N m]
VIBRATION = "the shaft has no damping: what a window over the vibration leaves of it"


def hinged(
    access: EngineAccess,
    *,
    aspect_ratio: float = 0.7,
    fidelity: str = "draft",
    angles: Sequence[float] = (90, 90),
    **motor: float | str,
) -> Scene:
    """Return a scene of one articulated smarticle with springs as shafts.

    `angles` are the angles of the barbs [deg]; `motor` has keys of the scene's mapping `motor`.
    """
    smarticle = {"aspect_ratio": aspect_ratio, "angles_deg": list(angles)}
    return scene(access, shape_change(), fidelity=fidelity, smarticle=smarticle, motor=motor)


def upright(access: EngineAccess, one: Scene, *, gravity: float, dt: float | None = None) -> Engine:
    """Build an engine with the smarticle of a scene in the xz plane, open side down, middle link fixed."""
    engine = access.build_hinged(one, gravity=gravity, dt=dt)
    boxes = one.smarticle.boxes
    turned = Rotation.from_euler("x", -90, degrees=True) * Rotation.from_matrix(boxes.link_rotations[1].T)
    add(engine, np.array([0, 0, 0.05]) - turned.apply(boxes.link_centres[1]), turned)
    engine.motors.articulate()
    access.hold(engine)
    return engine


def _barb(one: Scene) -> tuple[float, float, float]:
    """Return mass [kg], inertia about the normal [kg m²] and centre-to-hinge distance [m] of a barb."""
    boxes = one.smarticle.boxes
    return float(boxes.link_masses[0]), float(boxes.link_inertias[0, 2]), boxes.barb_length / 2


@case(
    "hinge pulled",
    "a straight smarticle is pulled at both ends by a hundred weights",
    "gap F/k of the pin",
    absent=NO_PINS,
)
def pull(
    access: EngineAccess, *, aspect_ratio: float = 0.7, fidelity: str = "standard", largest: float = 0.01
) -> list[Answer]:
    """Pull a straight smarticle at both ends; `largest`: allowed gap of a hinge over sphere diameter [1]."""
    one, duration = hinged(access, aspect_ratio=aspect_ratio, fidelity=fidelity, angles=(0, 0)), 0.02
    engine = access.build_hinged(one, gravity=0.0)
    add(engine, (0, 0, 0.05), Rotation.from_rotvec([0.4, 0.2, -0.7]))
    engine.motors.articulate()
    straight, along = engine.state().smarticles.angles, engine.state().smarticles.link_rotations[0, 1, :, 0]
    force, gaps = 100 * one.smarticle.boxes.mass * G, []
    for time in drive(engine, one, duration, lambda _: straight):
        pulling = min(1.0, 2 * time / duration) * force * along
        for link, sign in ((0, -1), (2, 1)):
            access.force(engine, 0, link, sign * pulling)
        gaps.append(engine.motors.gaps().max())
    theory, mean = force / access.pin_stiffness(one), np.mean(gaps[-20:])
    swings = "the links' masses swing on the pin for a while, by per cents"
    promised = f"at most {100 * largest:g} % of a sphere's diameter, as the fidelity promises"
    return [
        Answer("gap of a hinge, mean [m]", theory, mean, 0.01, swings),
        Answer("gap of a hinge, largest [m]", theory, max(gaps), largest * one.sphere_diameter / theory - 1, promised),
    ]


@case(
    "barb hanging on its motor",
    "a straight smarticle, its middle link held, under gravity",
    "torque M = mgl/2, sag M/k, gap mg/k",
)
def droop(access: EngineAccess, *, aspect_ratio: float = 0.7, fidelity: str = "standard") -> list[Answer]:
    one = hinged(access, aspect_ratio=aspect_ratio, fidelity=fidelity, angles=(0, 0), torque_limit_N_m=STRONG)
    # On links the external force acts before the spring: an error of (ω dt)²/4 of the sag, 2 % at the scene's step.
    dt = None if access.name == "yade" else one.fidelity.control_interval_s / 20
    engine = upright(access, one, gravity=G, dt=dt)
    begun = engine.state().smarticles.angles
    rows = [
        (*access.torques(engine), *engine.motors.gaps()[0], *(engine.state().smarticles.angles - begun)[0])
        for _ in drive(engine, one, 0.2, lambda _: begun)
    ]
    # Barbs vibrate about their equilibrium; a Hann window removes the vibration.
    torque, gap, sag = np.average(rows, axis=0, weights=np.hanning(len(rows))).reshape(3, 2).mean(axis=1)
    mass, _, lever = _barb(one)
    moment, expected = mass * G * lever, mass * G / access.pin_stiffness(one)
    parting, error = (VIBRATION, 0.01) if expected else ("rounding: hinges cannot part", 1e-12)
    return [
        Answer("torque of a motor [N m]", -moment, torque, 0.01, VIBRATION),
        Answer("sag of a barb [rad]", moment / one.motor.stiffness_N_m_per_rad, sag, 0.01, VIBRATION),
        Answer("gap of a hinge [m]", expected, gap, error, parting, scale=expected or lever),
    ]


@case(
    "barb hanging out of plane",
    "a smarticle lies, its middle link held, after the barbs have turned through 105°",
    "tilt M/k of the shaft",
    absent=NO_TILT,
)
def tilt(access: EngineAccess, *, sweeps: int = 1) -> list[Answer]:
    """Turn the barbs of a horizontal smarticle by 105°, `sweeps` times; measure their tilt by gravity.

    The middle link is held. YADE's own bonds accumulate moments step by step and rotate them with half of the twist; if
    hinges were such bonds, the tilt would have an error of 100 % after one sweep.
    """
    one = hinged(access)
    engine = access.build_hinged(one, gravity=G)
    add(engine, (0, 0, 0.05))
    engine.motors.articulate()
    access.hold(engine)
    start, goal, each = engine.state().smarticles.angles[0], math.radians(-15), 0.35
    for _ in drive(engine, one, each * sweeps, lambda t: start + (goal - start) * (1 - abs(t / each % 2 - 1))):
        pass
    readings, tilts = engine.motors.readings, []
    assert readings is not None  # the scene actuates
    last = readings.commands[0].copy()
    for _ in drive(engine, one, 0.05, lambda _: last):
        normals = engine.state().smarticles.link_rotations[0, :, :, 2]
        tilts.append(np.cross(normals[1], normals[[0, 2]]))
    mass, _, lever = _barb(one)
    along = engine.state().smarticles.link_rotations[0, [0, 2], :, 0]
    expected = np.cross(along * lever, [0, 0, -mass * G]) / hinge_law(one).tilt_stiffness
    found = np.average(tilts, axis=0, weights=np.hanning(len(tilts)))
    size, angle = float(np.linalg.norm(expected[0])), engine.state().smarticles.angles[0].mean()
    worst = size + float(np.abs(found - expected).max())
    return [
        Answer("angle that was reached [rad]", goal, angle, 0.03, VIBRATION),
        Answer("tilt out of the plane, worst component [rad]", size, worst, 0.05, VIBRATION),
    ]


# -- swinging ----------------------------------------------------------------------------------------------------------


def crossings(time: Array, value: Array) -> Array:
    """Return the times at which a value (n,) changes sign, interpolated between times (n,) [s]."""
    (before,) = np.nonzero(np.diff(np.sign(value)))
    found: Array = time[before] - value[before] * np.diff(time)[before] / np.diff(value)[before]
    return found


@case("pendulum", "barbs hang from a held middle link, let go at 6°", "2π√(I/mga)(1 + θ²/16)")
def pendulum(access: EngineAccess, *, aspect_ratio: float = 0.7) -> list[Answer]:
    one = hinged(
        access, aspect_ratio=aspect_ratio, angles=(96, 84), stiffness_N_m_per_rad=1e-9, torque_limit_N_m=STRONG
    )
    engine = upright(access, one, gravity=G)
    begun = engine.state().smarticles.angles
    times, angles = [], []
    for time in drive(engine, one, 0.45, lambda _: begun):
        times.append(time)
        angles.append(engine.state().smarticles.angles[0] - math.pi / 2)
    mass, own, lever = _barb(one)
    amplitude = math.radians(6)
    period = 2 * math.pi * math.sqrt((own + mass * lever**2) / (mass * G * lever)) * (1 + amplitude**2 / 16)
    soft = "the shaft's stiffness is a thousandth of the weight's at most; the amplitude is accounted for"
    swing = "the first swing, from where it was let go"
    checks = []
    for barb, sign in ((0, 1), (1, -1)):
        angle = sign * np.array(angles)[:, barb]
        measured = 2 * float(np.diff(crossings(np.array(times), angle)).mean())
        checks += [
            Answer(f"period, barb {barb + 1} [s]", period, measured, 2e-3, soft),
            Answer(f"amplitude, barb {barb + 1} [rad]", amplitude, np.abs(angle).max(), 0.01, swing),
        ]
    return checks


def shaft_mode(one: Scene, pin: float, *, held: bool) -> tuple[float, Array]:
    """Compute the vibration mode of a U whose barbs turn on their shafts, both in the same sense.

    The five coordinates are the displacement of the middle link along its axis, its rotation, the rotation of the
    barbs, and the gap of hinge 1 along and across the middle link (hinge 2: equal along, opposite across). Rigid
    motions and vibrations of the pins are other modes.

    `pin` is the stiffness of a pin [N/m]; if it is inf, there are no gaps. The middle link is fixed if `held`. Returns
    the angular frequency [rad/s], and the coordinates (5,) [m or rad] at which barbs are turned by 1 rad against the
    middle link.
    """
    boxes, (mass, own, lever) = one.smarticle.boxes, _barb(one)
    along = np.array([1.0, 0.0, -lever, 1.0, 0.0])
    across = np.array([0.0, boxes.middle_length / 2, 0.0, 0.0, -1.0])
    masses = np.diag([float(boxes.link_masses[1]), float(boxes.link_inertias[1, 2]), 2 * own, 0.0, 0.0])
    masses += 2 * mass * (np.outer(along, along) + np.outer(across, across))
    twist, parts = np.array([0.0, -1.0, 1.0, 0.0, 0.0]), pin < math.inf
    stiffness = 2 * one.motor.stiffness_N_m_per_rad * np.outer(twist, twist)
    stiffness += np.diag([0, 0, 0, 2 * pin, 2 * pin] if parts else np.zeros(5))
    pins = [] if not parts else [3] if held else [3, 4]
    free = [2, *pins] if held else [0, 1, 2, *pins]
    squares, shapes = eigh(stiffness[np.ix_(free, free)], masses[np.ix_(free, free)])
    place, shape = len(free) - 1 - len(pins), np.zeros(5)
    shape[free] = shapes[:, place]
    return math.sqrt(squares[place]), shape / (shape[2] - shape[1])


def floating(access: EngineAccess, one: Scene, *, held: bool, dt: float | None = None) -> Engine:
    """Build an engine without gravity for one smarticle whose barbs vibrate by 0.01 rad, see `shaft_mode`.

    The middle link is fixed if `held`.
    """
    engine = access.build_hinged(one, gravity=0.0, dt=dt)
    add(engine, (0, 0, 0.05))
    engine.motors.articulate()
    frequency, shape = shaft_mode(one, access.pin_stiffness(one), held=held)
    if held:
        access.hold(engine)
    middle, spin, turn, off, off_across = 0.01 * frequency * shape
    along = middle - _barb(one)[2] * turn + off
    across = one.smarticle.middle_length_m / 2 * spin - off_across
    access.swing(engine, ((along, -across, turn), (middle, 0.0, spin), (along, across, turn)))
    return engine


@case("barbs on their shafts, middle link held", "a U in space, barbs turning the same way", MODE, held=True)
@case("barbs on their shafts, middle link free", "a U in space, barbs turning the same way", MODE, held=False)
def shaft_vibration(access: EngineAccess, *, held: bool) -> list[Answer]:
    one = hinged(access, fidelity="standard", torque_limit_N_m=STRONG)
    engine = floating(access, one, held=held)
    begun = engine.state().smarticles.angles
    log: list[Array] = []
    for _ in drive(engine, one, 0.04, lambda _: begun, each=lambda: log.append(engine.state().smarticles.angles[0])):
        pass
    turned = np.array(log)[:, 0] - begun[0, 0]
    time: Array = engine.time_step * np.arange(1, len(turned) + 1, dtype=np.float64)
    frequency = shaft_mode(one, access.pin_stiffness(one), held=held)[0] / (2 * math.pi)
    measured = 0.5 / float(np.diff(crossings(time, turned)).mean())
    damper = "the damper beside the pin, which theory leaves out, is a quarter as stiff"
    pins = "the pins' own vibration, which is set going a little"
    return [
        Answer("frequency [Hz]", frequency, measured, 3e-3, damper),
        Answer("amplitude [rad]", 0.01, np.abs(turned).max(), 0.02, pins),
    ]


@ladder(
    "barbs on their shafts",
    "an articulated smarticle in space, control period 0.2 ms",
    "angle of a barb over 10 ms [rad]",
    0.01,
    FINE,
    {
        "yade": (2, f"{LEAPFROG}, in the plane"),
        "links": (2, "the spring's force is the mean over the half steps before and after: second order"),
    },
)
def vibration_errors(access: EngineAccess, steps: Sequence[float]) -> list[float]:
    """Return the root-mean-square error [rad] of a vibrating barb's angle over 10 ms for each time step."""
    one = hinged(access, torque_limit_N_m=STRONG)

    def path(dt: float) -> Array:
        engine = floating(access, one, held=False, dt=dt)
        begun = engine.state().smarticles.angles
        return np.array([engine.state().smarticles.angles[0, 0] for _ in drive(engine, one, 0.01, lambda _: begun)])

    reference = path(min(steps) / 8)
    return [float(np.sqrt(np.mean((path(dt) - reference) ** 2))) for dt in steps]
