"""Scenes, contact laws, engines and watchdogs for validation cases. All quantities are in SI units."""

import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from dem.body.placement import Poses
from dem.body.state import State
from dem.engine.interface import Engine
from dem.engine.kinds import engine_kind
from dem.errors import RunError
from dem.physics.contact import ContactLaw, contact_law, damping_ratio
from dem.plan.steps import time_step
from dem.record.progress import ProgressWriter
from dem.run.build import build_recorder
from dem.run.recorder import Recorder
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene
from validation.access import BALL_MASS, STIFFNESS, EngineAccess

Array = NDArray[np.float64]

G = 9.81  # m/s²
FLAT = Rotation.identity()
TILTED = Rotation.from_rotvec([0.4, 0.2, -0.7])
UPRIGHT = Rotation.from_euler("y", -90, degrees=True)  # turns the body's x axis to the vertical

RELAX = {"type": "relax", "duration_s": 0.05}
REST = {"type": "relax", "duration_s": 0.3}  # long enough for a pile to come to rest after motion

Targets = Callable[[float], ArrayLike]  # time [s] -> angles of all barbs [rad]


# -- scenes ------------------------------------------------------------------------------------------------------------


def scene_of(data: Mapping[str, Any]) -> Scene:
    """Check a scene given as a dictionary, and return it."""
    return parse_scene(data, source="case")


ONE_STRAND = {"base": "standard", "rows": 1, "stiffness_N_per_m": 500.0}  #: Fidelity with round links on both engines


def scene_data(access: EngineAccess, *phases: Mapping[str, Any], per_layer: int = 6, **keys: Any) -> dict[str, Any]:
    """Return a scene as a dictionary: a deposit of smarticles, then the given phases.

    Smarticles are deposited in layers of `per_layer`. There are six smarticles at the fidelity draft, with a contact
    stiffness of 250 N/m on all engines. `keys` are keys of the scene that are added or replace these values.
    """
    fidelity = {"base": "draft", "stiffness_N_per_m": 250.0}
    given = {"schema_version": 1, "engine": access.name, "name": "hard", "seed": 1, "count": 6, "fidelity": fidelity}
    return {**given, "phases": [{"type": "deposit", "per_layer": per_layer}, *phases], **keys}


def scene(access: EngineAccess, *phases: Mapping[str, Any], **keys: Any) -> Scene:
    """Return a scene of one smarticle: a deposit, then the given phases; if none are given, a relax phase.

    `keys` are further keys of the scene.
    """
    return scene_of(scene_data(access, *(phases or (RELAX,)), count=1, **keys))


def shape_change(seconds: float = 1.5, hold: float = 0.0) -> dict[str, Any]:
    """Return a phase that straightens the barbs in `seconds` [s], waits `hold` [s], and bends them back."""
    return {"type": "shape-change", "opening_s": seconds, "straight_hold_s": hold, "closing_s": seconds}


def turn(degrees: float, seconds: float) -> dict[str, Any]:
    """Return a phase that turns both barbs to an angle `degrees` [deg] within `seconds` [s]."""
    return {"type": "actuate", "barbs": {"type": "ramp", "to_deg": degrees, "duration_s": seconds}}


def swing(seconds: float) -> dict[str, Any]:
    """Return a phase that swings both barbs between 70° and 90° for `seconds` [s]."""
    barbs = {"type": "triangle", "centre_deg": 80, "amplitude_deg": 10, "speed_rad_per_s": 5}
    return {"type": "actuate", "barbs": barbs, "duration_s": seconds}


def law_of(scene: Scene) -> ContactLaw:
    """Return the contact law of a scene."""
    return contact_law(scene.particle, scene.contact, scene.fidelity.stiffness_N_per_m)


def ball_law(
    *, restitution: float = 1.0, friction: float = 0.0, tangential: float = 0.82, dashpot: float = 0.9
) -> ContactLaw:
    """Return a contact law for the ball, with dashpots that give the restitution [1] for the ball's mass.

    `tangential` is the tangential over the normal stiffness, `dashpot` the tangential over the normal damping [1].
    """
    critical = 2 * damping_ratio(restitution) * math.sqrt(STIFFNESS * BALL_MASS)
    return ContactLaw(
        normal_stiffness=STIFFNESS,
        tangential_stiffness=tangential * STIFFNESS,
        normal_damping=critical / math.sqrt(2),
        wall_damping=critical,
        tangential_damping=dashpot,
        friction=friction,
        wall_friction=friction,
    )


# -- engines -----------------------------------------------------------------------------------------------------------


def add(engine: Engine, position: ArrayLike, rotation: Rotation = FLAT) -> None:
    """Add a body at rest at a position (3,) [m], with a rotation from body frame to laboratory frame."""
    engine.add(Poses(np.array([position], dtype=float), (rotation,)))


def body_rotations(state: State) -> Array:
    """Return the rotations of welded smarticles from body frame to laboratory frame, (N, 3, 3)."""
    rotations: Array = state.link_rotations[:, 1] @ state.boxes.link_rotations[1].T
    return rotations


def advance_watched(engine: Engine, steps: int, each: Callable[[], None]) -> None:
    """Advance by a number of steps, and call `each` after every step."""
    for _ in range(steps):
        engine.advance(1)
        each()


def drive(
    engine: Engine,
    scene: Scene,
    duration: float,
    targets: Targets,
    *,
    each: Callable[[], None] | None = None,
    interval: float | None = None,
) -> Iterator[float]:
    """Actuate the motors for a duration [s], and yield after each control period.

    Yields the time since the start [s]. `targets` gets this time, and returns the angles of all barbs [rad], two per
    smarticle. `each` is called after every step. The control period [s] is that of the scene unless `interval` is
    given.
    """
    interval = interval or scene.fidelity.control_interval_s
    steps = round(interval / engine.time_step)
    for update in range(1, round(duration / interval) + 1):
        engine.motors.actuate(np.array(targets(update * interval), dtype=float).reshape(1, -1, 2), interval)
        if each is None:
            engine.advance(steps)
        else:
            advance_watched(engine, steps, each)
        yield update * interval


def watched(data: dict[str, Any], out: Path | str, *, dt: float | None = None) -> tuple[Scene, Engine, Recorder]:
    """Build scene, engine and recorder with watchdog as a run does, from a scene as a dictionary.

    The time step `dt` [s] may exceed the stable step; by default it is the scene's time step.
    """
    scene = scene_of(data)
    Path(out).mkdir(parents=True, exist_ok=True)
    engine = engine_kind(scene.engine).build(scene, time_step(scene) if dt is None else dt)
    progress = ProgressWriter(Path(out), scene.count)
    return scene, engine, build_recorder(scene, Path(out), progress)


def watchdog_error(engine: Engine, recorder: Recorder) -> str | None:
    """Let the recorder check the engine, contacts included; return the message of the error, or None."""
    recorder.watch_every = 1
    try:
        recorder.record(engine, 0)
    except RunError as error:
        return str(error)
    return None


def energy(engine: Engine) -> float:
    """Return the sum of kinetic, potential and elastic contact energy [J]."""
    state = engine.state().smarticles
    return state.kinetic_energy + state.potential_energy(engine.gravity, 0.0) + engine.ledger.elastic()[0]


def fastest(engine: Engine) -> float:
    """Return the largest speed of a link [m/s]."""
    return float(np.linalg.norm(engine.state().smarticles.link_velocities, axis=-1).max())


def lying(scene: Scene) -> float:
    """Return the height of the centre of mass of a smarticle lying flat on the floor [m]."""
    return float(scene.particle.radius - scene.particle.centres[:, 2].min())
