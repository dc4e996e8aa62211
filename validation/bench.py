"""The bench that all cases are built on: scenes of one smarticle, looks as a run has them, what all engines share.

What a run never does is done by access (`validation.access`): only they reach behind the engine's interface.
SI throughout. Velocities belong to the half step before the positions (leapfrog): a body that is to have v at t = 0
under an acceleration a is pushed to v − a dt/2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
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
from validation.engines import BALL_MASS, BALL_RADIUS, STIFFNESS, EngineAccess

__all__ = ["BALL_MASS", "BALL_RADIUS", "STIFFNESS"]

Array = NDArray[np.float64]

G = 9.81  # m/s²
FLAT = Rotation.identity()
TILTED = Rotation.from_rotvec([0.4, 0.2, -0.7])
UPRIGHT = Rotation.from_euler("y", -90, degrees=True)  # turns the body's x axis to the vertical

Targets = Callable[[float], ArrayLike]


def scene_of(data: Mapping[str, Any]) -> Scene:
    """A scene from plain data."""
    return parse_scene(data, source="case")


def scene(access: EngineAccess, *, fidelity: Any = "draft", phases: Iterable[str] = ("relax",), **parts: Any) -> Scene:
    """One smarticle; `parts` are those of a scene file, such as `smarticle={"aspect_ratio": 0}`."""
    listed = [{"type": "deposit"}, *({"type": kind} for kind in phases)]
    given = {"schema_version": 1, "engine": access.name, "seed": 1, "count": 1}
    return scene_of({**given, "fidelity": fidelity, "phases": listed, **parts})


def law_of(scene: Scene) -> ContactLaw:
    """The contact law of a scene, the same on all engines."""
    return contact_law(scene.particle, scene.contact, scene.fidelity.stiffness_N_per_m)


def ball_law(
    *, restitution: float = 1.0, friction: float = 0.0, tangential: float = 0.82, dashpot: float = 0.9
) -> ContactLaw:
    """The contact law that a scene would have, its dashpots sized for the ball's own mass."""
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


def add(engine: Engine, position: ArrayLike, rotation: Rotation = FLAT) -> None:
    """Add a body at rest."""
    engine.add(Poses(np.array([position], dtype=float), (rotation,)))


def body_rotations(state: State) -> Array:
    """(N, 3, 3) body frame to laboratory frame of welded smarticles."""
    rotations: Array = state.link_rotations[:, 1] @ state.boxes.link_rotations[1].T
    return rotations


def advance_watched(engine: Engine, steps: int, look: Callable[[], None]) -> None:
    """Advance, and call `look` after each step."""
    for _ in range(steps):
        engine.advance(1)
        look()


def drive(
    engine: Engine,
    scene: Scene,
    duration: float,
    targets: Targets,
    *,
    each: Callable[[], None] | None = None,
    interval: float | None = None,
) -> Iterator[float]:
    """Let the motors follow `targets(t)` [rad] from now on; gives the time since then after each control period.

    `each` is called after each step.
    """
    interval = interval or scene.fidelity.control_interval_s
    steps = round(interval / engine.time_step)
    for look in range(1, round(duration / interval) + 1):
        engine.motors.actuate(np.array(targets(look * interval), dtype=float).reshape(1, -1, 2), interval)
        if each is None:
            engine.advance(steps)
        else:
            advance_watched(engine, steps, each)
        yield look * interval


# -- as a run has it ---------------------------------------------------------------------------------------------------


def watched(data: dict[str, Any], out: Path | str, *, dt: float | None = None) -> tuple[Scene, Engine, Recorder]:
    """Engine and recorder, watchdog included, as a run builds them; `dt` [s] by hand is not refused."""
    scene = scene_of(data)
    Path(out).mkdir(parents=True, exist_ok=True)
    engine = engine_kind(scene.engine).build(scene, time_step(scene) if dt is None else dt)
    progress = ProgressWriter(Path(out), scene.count, show=False)
    return scene, engine, build_recorder(scene, Path(out), progress)


def look(engine: Engine, recorder: Recorder) -> str | None:
    """What the recorder's next look says, contacts included; None: nothing."""
    recorder.watch_every = 1
    try:
        recorder.record(engine, 0)
    except RunError as error:
        return str(error)
    return None


def energy(engine: Engine) -> float:
    """Kinetic, potential, and that of the springs of all contacts [J]."""
    state = engine.state()
    return state.kinetic_energy + state.potential_energy(engine.gravity, 0.0) + engine.ledger.elastic()[0]


def fastest(engine: Engine) -> float:
    """Speed of the fastest link [m/s]."""
    return float(np.linalg.norm(engine.state().link_velocities, axis=-1).max())


def lying(scene: Scene) -> float:
    """Height [m] of the centre of mass of a smarticle that lies flat on the floor."""
    return float(scene.particle.radius - scene.particle.centres[:, 2].min())
