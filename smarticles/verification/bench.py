"""The bench that all cases are built on: bodies, engines, hands that push and hold, and looks as a run has them.

The only module here that reaches behind the engine's interface: a run never sets a velocity or holds a link. SI
throughout. Velocities of YADE belong to the half step before the positions (leapfrog): a body that is to have v at
t = 0 under an acceleration a is pushed to v − a dt/2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from dem.body.particle import Boxes, Particle, SphereChain
from dem.body.placement import Poses
from dem.body.state import State
from dem.engine.yade.engine import YadeEngine
from dem.engine.yade.kind import YadeKind, contact_law_of, hinge_law, motor_law
from dem.errors import RunError
from dem.physics.contact import ContactLaw, damping_ratio
from dem.plan.steps import time_step
from dem.record.progress import ProgressWriter
from dem.run.build import build_recorder
from dem.run.recorder import Recorder
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene
from dem.setting.container import Cylinder

Array = NDArray[np.float64]

G = 9.81  # m/s²
FLAT = Rotation.identity()
TILTED = Rotation.from_rotvec([0.4, 0.2, -0.7])
UPRIGHT = Rotation.from_euler("y", -90, degrees=True)  # turns the body's x axis to the vertical
# Steel, and the stiffness of the fidelities `standard` and `reference`.
BALL_RADIUS, BALL_MASS = 2e-3, 2.6e-4  # m, kg
STIFFNESS = 500.0  # N/m

Targets = Callable[[float], ArrayLike]


@dataclass(frozen=True)
class Ball(Particle):
    """A particle of one sphere."""

    def __post_init__(self) -> None:
        """Nothing to refuse: there is no link that the sphere must fit."""

    @cached_property
    def _layout(self) -> tuple[Array, NDArray[np.int64]]:
        return np.zeros((1, 3)), np.ones(1, dtype=np.int64)


def ball(radius: float = BALL_RADIUS, mass: float = BALL_MASS) -> Ball:
    """A solid ball, I = 2/5 m r², for the engine that knows boxes: so has a cube of side r √(12/5)."""
    side = radius * math.sqrt(12 / 5)
    cube = Boxes(
        middle_length=side, barb_length=0.0, thickness_normal=side, thickness_in_plane=side, density=mass / side**3
    )
    return Ball(cube, SphereChain(rows=1, diameter=2 * radius, pitch=2 * radius))


def scene_of(data: Mapping[str, Any]) -> Scene:
    """A scene from plain data."""
    return parse_scene(data, source="case")


def scene(*, fidelity: Any = "draft", phases: Iterable[str] = ("relax",), **parts: Any) -> Scene:
    """One smarticle; `parts` are those of a scene file, such as `smarticle={"aspect_ratio": 0}`."""
    listed = [{"type": "deposit"}, *({"type": kind} for kind in phases)]
    return scene_of(
        {"schema_version": 1, "seed": 1, "count": 1, "fidelity": fidelity, "phases": listed, **parts},
    )


def ball_law(
    *, restitution: float = 1.0, friction: float = 0.0, tangential: float = 0.82, dashpot: float = 0.9
) -> ContactLaw:
    """The contact law that a scene would have, its dashpots sized for the ball's own mass.

    Args:
        restitution: of a ball against the floor, and of two balls [1].
        friction: Coulomb coefficient [1].
        tangential: ks over kn [1].
        dashpot: cs over cn [1].
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


def build(particle: Particle, law: ContactLaw, *, dt: float, gravity: float = 0.0) -> YadeEngine:
    """An engine with a floor at z = 0 and a wall far away."""
    return YadeEngine(
        particle=particle,
        cylinder=Cylinder(radius=0.5, height=0.2, facets=16),
        law=law,
        gravity=gravity,
        time_step=dt,
        shaken=False,
    )


def build_hinged(scene: Scene, *, gravity: float, dt: float | None = None) -> YadeEngine:
    """An engine for smarticles that are articulated."""
    return YadeEngine(
        particle=scene.particle,
        cylinder=Cylinder(radius=0.5, height=scene.cylinder.height, facets=16),
        law=contact_law_of(scene),
        gravity=gravity,
        time_step=dt or time_step(scene),
        shaken=False,
        hinges=(hinge_law(scene), motor_law(scene)),
    )


def add(engine: YadeEngine, position: ArrayLike, rotation: Rotation = FLAT) -> None:
    """Add a body at rest."""
    engine.add(Poses(np.array([position], dtype=float), (rotation,)))


def push(engine: YadeEngine, k: int, velocity: ArrayLike = (0, 0, 0), spin: ArrayLike = (0, 0, 0)) -> None:
    """Give a welded body a velocity and a spin."""
    bodies_, vector = engine._omega.bodies, engine._yade.vector
    clump, (v, w) = bodies_[engine._assembly.bodies[k]].state, (np.asarray(velocity, float), np.asarray(spin, float))
    rotation = body_rotations(engine.state())[k]
    clump.vel, clump.angVel = vector(*v), vector(*w)
    # What YADE integrates.
    clump.angMom = vector(*(rotation @ np.diag(engine.particle.boxes.inertia) @ rotation.T @ w))
    # What contact laws read in the first step.
    for sphere in engine._assembly._spheres[k]:
        member = bodies_[sphere].state
        member.vel = vector(*(v + np.cross(w, np.array(member.pos) - np.array(clump.pos))))
        member.angVel = clump.angVel


def body_rotations(state: State) -> Array:
    """(N, 3, 3) body frame to laboratory frame of welded smarticles."""
    rotations: Array = state.link_rotations[:, 1] @ state.boxes.link_rotations[1].T
    return rotations


def advance_watched(engine: YadeEngine, steps: int, look: Callable[[], None]) -> None:
    """Advance, and call `look` after each step."""
    for _ in range(steps):
        engine.advance(1)
        look()


def bodies(engine: YadeEngine) -> list[Any]:
    """States of YADE's rigid bodies: one per smarticle, or three."""
    return [engine._omega.bodies[body].state for body in engine._assembly.bodies]


def hold(engine: YadeEngine, links: Iterable[int], *, still: bool = True) -> None:
    """Hold links of smarticle 0 where they are, or let go of them."""
    for link in links:
        body, zero = bodies(engine)[link], engine._yade.vector(0, 0, 0)
        body.blockedDOFs = "xyzXYZ" if still else ""
        body.vel, body.angVel, body.angMom = zero, zero, zero


def drive(
    engine: YadeEngine,
    scene: Scene,
    duration: float,
    targets: Targets,
    *,
    log: tuple[list[Any], list[Any]] | None = None,
    interval: float | None = None,
) -> Iterator[float]:
    """Let the motors follow `targets(t)` [rad] from now on; gives the time since then after each control period.

    `log` takes torques and angles of smarticle 0 after each step, as YADE has them.
    """
    interval = interval or scene.fidelity.control_interval_s
    steps = round(interval / engine.time_step)
    for look in range(1, round(duration / interval) + 1):
        engine.motors.actuate(np.array(targets(look * interval), dtype=float).reshape(-1, 2), interval)
        if log is None:
            engine.advance(steps)
        else:
            for _ in range(steps):
                engine.advance(1)
                log[0].append(engine.motors._hinges.torques()[0])
                log[1].append(engine.motors._hinges.angles()[0])
        yield look * interval


# -- as a run has it ---------------------------------------------------------------------------------------------------


def watched(data: dict[str, Any], out: Path | str, *, dt: float | None = None) -> tuple[Scene, YadeEngine, Recorder]:
    """Engine and recorder, watchdog included, as a run builds them; `dt` [s] by hand is not refused."""
    scene = scene_of(data)
    Path(out).mkdir(parents=True, exist_ok=True)
    engine = YadeKind().build(scene, time_step(scene) if dt is None else dt)
    progress = ProgressWriter(Path(out), scene.count, show=False)
    return scene, engine, build_recorder(scene, Path(out), progress)


def look(engine: YadeEngine, recorder: Recorder) -> str | None:
    """What the recorder's next look says, contacts included; None: nothing."""
    recorder.watch_every = 1
    try:
        recorder.record(engine, 0)
    except RunError as error:
        return str(error)
    return None


def energy(engine: YadeEngine) -> float:
    """Kinetic, potential, and that of the springs of all contacts [J]."""
    state = engine.state()
    return state.kinetic_energy + state.potential_energy(engine.gravity, 0.0) + engine.account.elastic()[0]


def fastest(engine: YadeEngine) -> float:
    """Speed of the fastest link [m/s]."""
    return float(np.linalg.norm(engine.state().link_velocities, axis=-1).max())


def lying(scene: Scene) -> float:
    """Height [m] of the centre of mass of a smarticle that lies flat on the floor."""
    return float(scene.particle.radius - scene.particle.centres[:, 2].min())
