"""Bullet (PyBullet): rigid boxes, lengths a hundred times as large, for its tolerances; in the container's frame."""

from __future__ import annotations

import importlib
import math
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.rivals.given import FACETS, Array, Given, Knobs, Outcome, rigid_links, simulated
from benchmarks.rivals.overlap import halves_of

# Lengths there over lengths here. Times and densities stay, so that gravity grows as lengths do, and masses as volumes.
SCALE = 100.0
THICK = 2.0  # of walls and floor, in lengths there


def simulate(given: Given, knobs: Knobs) -> Outcome:
    """Simulate with `time_step` [s], solver `iterations`, and `recovery`, the share of overlap undone per step."""
    return simulated(given, InBullet(given, **knobs))


class InBullet:
    """A world of compounds of three boxes each."""

    def __init__(self, given: Given, *, time_step: float, iterations: int, recovery: float) -> None:
        # A client of its own: without one, calls go to the first world of the process.
        library, clients = (importlib.import_module(name) for name in ("pybullet", "pybullet_utils.bullet_client"))
        self._given, self._bullet = given, clients.BulletClient(connection_mode=library.DIRECT)
        bullet = self._bullet
        self.version = f"pybullet {importlib.import_module('importlib.metadata').version('pybullet')}"
        self.time_step = time_step
        bullet.setPhysicsEngineParameter(
            fixedTimeStep=time_step,
            numSolverIterations=iterations,
            numSubSteps=0,
            contactERP=recovery,
            contactBreakingThreshold=0.02,
            deterministicOverlappingPairs=1,
        )
        # Bullet multiplies the friction of both that touch.
        self._surface = {"lateralFriction": math.sqrt(given.scene.contact.friction_smarticle), "restitution": 0.0}
        self._around()
        self._bodies = self._smarticles()
        self._since: float | None = None

    def _around(self) -> None:
        bullet, points, inwards = self._bullet, *self._given.walls()
        radius, height = (SCALE * length for length in (self._given.scene.cylinder.radius, 0.2))
        boxes = [((0.0, 0.0, -THICK / 2), (0.0, 0.0, 0.0, 1.0), (3 * radius, 3 * radius, THICK / 2))]
        for point, inward in zip(SCALE * points, inwards, strict=True):
            centre = point - inward * THICK / 2 + np.array([0.0, 0.0, height / 2])
            turn = Rotation.from_euler("z", math.atan2(inward[1], inward[0])).as_quat()
            boxes.append((tuple(centre), tuple(turn), (THICK / 2, 1.3 * math.pi * radius / FACETS, height / 2 + THICK)))
        for position, turn, halves in boxes:
            shape = bullet.createCollisionShape(bullet.GEOM_BOX, halfExtents=list(halves))
            body = bullet.createMultiBody(0.0, shape, basePosition=list(position), baseOrientation=list(turn))
            bullet.changeDynamics(body, -1, **self._surface)

    def _smarticles(self) -> list[int]:
        bullet, boxes, state = self._bullet, self._given.boxes, self._given.state
        quaternions = Rotation.from_matrix(boxes.link_rotations).as_quat()
        shape = bullet.createCollisionShapeArray(
            shapeTypes=[bullet.GEOM_BOX] * 3,
            halfExtents=(SCALE * halves_of(boxes)).tolist(),
            collisionFramePositions=(SCALE * boxes.link_centres).tolist(),
            collisionFrameOrientations=quaternions.tolist(),
        )
        bodies, mass = [], SCALE**3 * boxes.mass
        turns = Rotation.from_matrix(self._given.turns).as_quat()
        for position, turn in zip(SCALE * state.positions, turns, strict=True):
            body = bullet.createMultiBody(mass, shape, basePosition=list(position), baseOrientation=list(turn))
            inertia = (SCALE**5 * boxes.inertia).tolist()
            bullet.changeDynamics(
                body,
                -1,
                **self._surface,
                localInertiaDiagonal=inertia,
                linearDamping=0.0,
                angularDamping=0.0,
                activationState=bullet.ACTIVATION_STATE_DISABLE_SLEEPING,
            )
            bodies.append(body)
        return bodies

    def begin(self) -> None:
        """See `Stepped.begin`."""
        self._since = 0.0
        for body in self._bodies:
            velocity, spin = self._bullet.getBaseVelocity(body)
            lowered = [velocity[0], velocity[1], velocity[2] - SCALE * self._given.kick]
            self._bullet.resetBaseVelocity(body, lowered, spin)

    def advance(self, seconds: float) -> None:
        """See `Stepped.advance`."""
        gravity = self._given.scene.gravity_m_per_s2
        for _ in range(round(seconds / self.time_step)):
            if self._since is not None:
                self._since += self.time_step
                gravity = self._given.pull(self._since - self.time_step / 2)
            self._bullet.setGravity(0.0, 0.0, -SCALE * gravity)
            self._bullet.stepSimulation()

    def links(self) -> tuple[Array, Array]:
        """See `Stepped.links`."""
        poses: list[Any] = [self._bullet.getBasePositionAndOrientation(body) for body in self._bodies]
        turns = Rotation.from_quat([turn for _, turn in poses]).as_matrix()
        return rigid_links(self._given.boxes, np.array([position for position, _ in poses]) / SCALE, turns)
