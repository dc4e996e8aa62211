"""Bullet (PyBullet) with rigid boxes; lengths are multiplied by 100 to suit its tolerances."""

import importlib
import math
from importlib.metadata import version
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.rivals.overlap import halves_of
from benchmarks.rivals.task import Array, Knobs, Outcome, Task, World, rigid_links, simulated

# Factor of all lengths. Times and densities are unchanged, so that gravity grows by the factor, masses by its cube.
SCALE = 100.0


def simulate(task: Task, knobs: Knobs) -> Outcome:
    """Simulate a task.

    `knobs` are parameters of the engine: `time_step` [s], solver `iterations`, and `recovery`, the share of the overlap
    that a step undoes.
    """
    return simulated(task, InBullet(task, **knobs))


class InBullet(World):
    """Simulation of rigid bodies of three boxes each."""

    def __init__(self, task: Task, *, time_step: float, iterations: int, recovery: float) -> None:
        super().__init__(task, time_step, f"pybullet {version('pybullet')}")
        # Each simulation needs its own client; otherwise calls address the first simulation of the process.
        library, clients = (importlib.import_module(name) for name in ("pybullet", "pybullet_utils.bullet_client"))
        bullet = self._bullet = clients.BulletClient(connection_mode=library.DIRECT)
        bullet.setPhysicsEngineParameter(
            fixedTimeStep=time_step,
            numSolverIterations=iterations,
            numSubSteps=0,
            contactERP=recovery,
            contactBreakingThreshold=0.02,
            deterministicOverlappingPairs=1,
        )
        # Bullet multiplies the friction coefficients of two touching bodies.
        surface = {"lateralFriction": math.sqrt(task.scene.contact.friction_smarticle), "restitution": 0.0}
        for centre, turn, halves in task.slabs(SCALE):
            slab = bullet.createCollisionShape(bullet.GEOM_BOX, halfExtents=halves.tolist())
            self._add(0.0, slab, centre, turn, **surface)
        boxes = task.boxes
        shape = bullet.createCollisionShapeArray(
            shapeTypes=[bullet.GEOM_BOX] * 3,
            halfExtents=(SCALE * halves_of(boxes)).tolist(),
            collisionFramePositions=(SCALE * boxes.link_centres).tolist(),
            collisionFrameOrientations=Rotation.from_matrix(boxes.link_rotations).as_quat().tolist(),
        )
        free = {
            "linearDamping": 0.0,
            "angularDamping": 0.0,
            "activationState": bullet.ACTIVATION_STATE_DISABLE_SLEEPING,
        }
        free["localInertiaDiagonal"] = (SCALE**5 * boxes.inertia).tolist()
        self._bodies = [
            self._add(SCALE**3 * boxes.mass, shape, SCALE * position, turn, **surface, **free)
            for position, turn in zip(task.state.positions, Rotation.from_matrix(task.turns), strict=True)
        ]

    def _add(self, mass: float, shape: int, position: Array, turn: Rotation, **dynamics: Any) -> int:
        place = {"basePosition": position.tolist(), "baseOrientation": turn.as_quat().tolist()}
        body: int = self._bullet.createMultiBody(mass, shape, **place)
        self._bullet.changeDynamics(body, -1, **dynamics)
        return body

    def kick(self, speed: float) -> None:
        for body in self._bodies:
            velocity, spin = self._bullet.getBaseVelocity(body)
            self._bullet.resetBaseVelocity(body, [*velocity[:2], velocity[2] + SCALE * speed], spin)

    def step(self, gravity: float, time_s: float) -> None:
        self._bullet.setGravity(0.0, 0.0, -SCALE * gravity)
        self._bullet.stepSimulation()

    def links(self) -> tuple[Array, Array]:
        poses: list[Any] = [self._bullet.getBasePositionAndOrientation(body) for body in self._bodies]
        turns = Rotation.from_quat([turn for _, turn in poses]).as_matrix()
        return rigid_links(self.task.boxes, np.array([position for position, _ in poses]) / SCALE, turns)
