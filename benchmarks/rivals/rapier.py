"""Rapier with rigid boxes in single precision; lengths are multiplied by 100."""

import importlib
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

    `knobs` are parameters of the engine: `time_step` [s], solver `iterations`, and `frequency` [Hz] and `damping` of
    contacts.
    """
    return simulated(task, InRapier(task, **knobs))


class InRapier(World):
    """Simulation of rigid bodies with three colliders each."""

    def __init__(self, task: Task, *, time_step: float, iterations: int, frequency: float, damping: float) -> None:
        super().__init__(task, time_step, f"rapier3d {version('rapier3d')}")
        rapier = self._rapier = importlib.import_module("rapier3d")
        self._world = rapier.PhysicsWorld(gravity=(0.0, 0.0, -SCALE * task.scene.gravity_m_per_s2))
        self._world.set_num_threads(1)
        chosen = self._world.integration_parameters
        chosen.dt, chosen.num_solver_iterations = time_step, iterations
        # The defaults, 30 Hz and 5 (60 Hz for fixed bodies), let smarticles sink through each other.
        chosen.contact_softness = rapier.SpringCoefficients(frequency, damping)
        chosen.static_contact_softness = rapier.SpringCoefficients(2 * frequency, damping)
        for slab in task.slabs(SCALE):
            self._world.add_collider(self._collider(*slab))
        boxes = task.boxes
        links = list(zip(boxes.link_centres, boxes.link_rotations, halves_of(boxes), strict=True))
        inertia = (SCALE**5 * boxes.inertia).tolist()
        properties = rapier.MassProperties((0.0, 0.0, 0.0), SCALE**3 * boxes.mass, inertia)
        self._handles = []
        for position, turn in zip(SCALE * task.state.positions, task.turns, strict=True):
            body = rapier.RigidBody.dynamic().position(self._pose(position, Rotation.from_matrix(turn)))
            body = body.can_sleep(False).additional_mass_properties(properties)
            parts = [
                self._collider(SCALE * centre, Rotation.from_matrix(frame), SCALE * halves).density(0.0)
                for centre, frame, halves in links
            ]
            self._handles.append(self._world.add_body(body, parts))

    def _collider(self, centre: Array, turn: Rotation, halves: Array) -> Any:
        box = self._rapier.Collider.cuboid(*halves.tolist()).position(self._pose(centre, turn))
        # Rapier averages the friction coefficients of two touching bodies.
        return box.friction(self.task.scene.contact.friction_smarticle).restitution(0.0)

    def _pose(self, position: Array, turn: Rotation) -> Any:
        place = self._rapier.Vec3(*position.tolist())
        return self._rapier.Isometry3(place, self._rapier.Rotation3.from_scaled_axis(turn.as_rotvec().tolist()))

    def kick(self, speed: float) -> None:
        for handle in self._handles:
            body = self._world.rigid_bodies[handle]
            velocity = body.linvel
            body.linvel = (velocity.x, velocity.y, velocity.z + SCALE * speed)

    def step(self, gravity: float, time_s: float) -> None:
        self._world.gravity = (0.0, 0.0, -SCALE * gravity)
        self._world.step()

    def links(self) -> tuple[Array, Array]:
        bodies = [self._world.rigid_bodies[handle] for handle in self._handles]
        places = np.array([[body.translation.x, body.translation.y, body.translation.z] for body in bodies])
        turns = [[body.rotation.i, body.rotation.j, body.rotation.k, body.rotation.w] for body in bodies]
        return rigid_links(self.task.boxes, places / SCALE, Rotation.from_quat(turns).as_matrix())
