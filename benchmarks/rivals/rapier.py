"""Rapier: rigid boxes in single precision; lengths a hundred times as large; in the container's frame."""

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
    """Simulate with `time_step` [s], solver `iterations`, and `frequency` [Hz] and `damping` of contacts."""
    return simulated(given, InRapier(given, **knobs))


class InRapier:
    """A world of bodies with three colliders each."""

    def __init__(self, given: Given, *, time_step: float, iterations: int, frequency: float, damping: float) -> None:
        self._given, self._rapier = given, importlib.import_module("rapier3d")
        self.version = f"rapier3d {importlib.import_module('importlib.metadata').version('rapier3d')}"
        self.time_step = time_step
        self._world = self._rapier.PhysicsWorld(gravity=(0.0, 0.0, -SCALE * given.scene.gravity_m_per_s2))
        self._world.set_num_threads(1)
        chosen = self._world.integration_parameters
        chosen.dt, chosen.num_solver_iterations = time_step, iterations
        # Shipped: 30 Hz and 5 (60 Hz against what is fixed), which lets smarticles sink through each other.
        chosen.contact_softness = self._rapier.SpringCoefficients(frequency, damping)
        chosen.static_contact_softness = self._rapier.SpringCoefficients(2 * frequency, damping)
        self._around()
        self._handles = self._smarticles()
        self._since: float | None = None

    def _surfaced(self, builder: Any) -> Any:
        # Two that touch: the mean of their friction.
        return builder.friction(self._given.scene.contact.friction_smarticle).restitution(0.0)

    def _pose(self, position: Array, turn: Rotation) -> Any:
        rapier = self._rapier
        return rapier.Isometry3(
            rapier.Vec3(*position.tolist()), rapier.Rotation3.from_scaled_axis(turn.as_rotvec().tolist())
        )

    def _around(self) -> None:
        cuboid, (points, inwards) = self._rapier.Collider.cuboid, self._given.walls()
        radius, height = (SCALE * length for length in (self._given.scene.cylinder.radius, 0.2))
        floor = cuboid(3 * radius, 3 * radius, THICK / 2).translation((0.0, 0.0, -THICK / 2))
        self._world.add_collider(self._surfaced(floor))
        for point, inward in zip(SCALE * points, inwards, strict=True):
            centre = point - inward * THICK / 2 + np.array([0.0, 0.0, height / 2])
            turn = Rotation.from_euler("z", math.atan2(inward[1], inward[0]))
            wall = cuboid(THICK / 2, 1.3 * math.pi * radius / FACETS, height / 2 + THICK)
            self._world.add_collider(self._surfaced(wall.position(self._pose(centre, turn))))

    def _smarticles(self) -> list[Any]:
        rapier, boxes, given = self._rapier, self._given.boxes, self._given
        links = list(zip(halves_of(boxes), boxes.link_centres, boxes.link_rotations, strict=True))
        inertia = (SCALE**5 * boxes.inertia).tolist()
        properties = rapier.MassProperties((0.0, 0.0, 0.0), SCALE**3 * boxes.mass, inertia)
        handles = []
        for position, turn in zip(SCALE * given.state.positions, given.turns, strict=True):
            body = rapier.RigidBody.dynamic().position(self._pose(position, Rotation.from_matrix(turn)))
            body = body.can_sleep(False).additional_mass_properties(properties)
            parts = []
            for halves, centre, frame in links:
                part = self._surfaced(rapier.Collider.cuboid(*(SCALE * halves).tolist())).density(0.0)
                parts.append(part.position(self._pose(SCALE * centre, Rotation.from_matrix(frame))))
            handles.append(self._world.add_body(body, parts))
        return handles

    def begin(self) -> None:
        """See `Stepped.begin`."""
        self._since = 0.0
        for handle in self._handles:
            body = self._world.rigid_bodies[handle]
            velocity = body.linvel
            body.linvel = (velocity.x, velocity.y, velocity.z - SCALE * self._given.kick)

    def advance(self, seconds: float) -> None:
        """See `Stepped.advance`."""
        for _ in range(round(seconds / self.time_step)):
            if self._since is not None:
                self._since += self.time_step
                self._world.gravity = (0.0, 0.0, -SCALE * self._given.pull(self._since - self.time_step / 2))
            self._world.step()

    def links(self) -> tuple[Array, Array]:
        """See `Stepped.links`."""
        bodies = [self._world.rigid_bodies[handle] for handle in self._handles]
        places = np.array([[body.translation.x, body.translation.y, body.translation.z] for body in bodies])
        turns = np.array([_quaternion(body.rotation) for body in bodies])
        return rigid_links(self._given.boxes, places / SCALE, Rotation.from_quat(turns).as_matrix())


def _quaternion(rotation: Any) -> list[float]:
    """As (x, y, z, w)."""
    return [rotation.i, rotation.j, rotation.k, rotation.w]
