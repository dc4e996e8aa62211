"""Test access to YADE, through its bodies."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from dem.body.particle import Boxes, Particle, SphereChain
from dem.engine.demand import contact_law_of, motor_law_of
from dem.engine.interface import Engine
from dem.engine.yade.assembly import SMARTICLE_MATERIAL
from dem.engine.yade.container import WALL_MATERIAL
from dem.engine.yade.engine import YadeEngine
from dem.engine.yade.kind import hinge_law
from dem.physics.contact import ContactLaw
from dem.plan.steps import time_step
from dem.scene.scene import Scene
from dem.setting.container import Cylinder
from validation.engines import BALL_MASS, BALL_RADIUS

Array = NDArray[np.float64]


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


class YadeAccess:
    """See `validation.engines.EngineAccess`."""

    name = "yade"
    ball_turn = Rotation.identity()
    arm_share = 1.0

    def ball(self) -> Particle:
        return ball()

    def roller(self) -> Particle:
        return ball()

    def ends(self, particle: Particle) -> Array:
        return particle.centres

    def swept(self, particle: Particle) -> Array:
        return particle.centres

    def pin_stiffness(self, scene: Scene) -> float:
        return hinge_law(scene).pin_stiffness

    def spring_shafts(self) -> dict[str, Any]:
        return {}

    def build(self, particle: Particle, law: ContactLaw, *, dt: float, gravity: float = 0.0) -> YadeEngine:
        return YadeEngine(
            particle=particle,
            cylinder=Cylinder(radius=0.5, height=0.2, facets=16),
            law=law,
            gravity=gravity,
            time_step=dt,
            shaken=False,
        )

    def build_hinged(self, scene: Scene, *, gravity: float, dt: float | None = None) -> YadeEngine:
        return YadeEngine(
            particle=scene.particle,
            cylinder=Cylinder(radius=0.5, height=scene.cylinder.height, facets=16),
            law=contact_law_of(scene),
            gravity=gravity,
            time_step=dt or time_step(scene),
            shaken=False,
            hinges=(hinge_law(scene), motor_law_of(scene)),
        )

    def push(self, engine: Engine, k: int, velocity: ArrayLike = (0, 0, 0), spin: ArrayLike = (0, 0, 0)) -> None:
        own = _own(engine)
        bodies, vector = own._omega.bodies, own._yade.vector
        clump, (v, w) = bodies[own._assembly.bodies[k]].state, (np.asarray(velocity, float), np.asarray(spin, float))
        state = own.state()
        rotation = state.link_rotations[k, 1] @ state.boxes.link_rotations[1].T
        clump.vel, clump.angVel = vector(*v), vector(*w)
        # What YADE integrates.
        clump.angMom = vector(*(rotation @ np.diag(own.particle.boxes.inertia) @ rotation.T @ w))
        # What contact laws read in the first step.
        for sphere in own._assembly._spheres[k]:
            member = bodies[sphere].state
            member.vel = vector(*(v + np.cross(w, np.array(member.pos) - np.array(clump.pos))))
            member.angVel = clump.angVel

    def force(self, engine: Engine, k: int, link: int, force: ArrayLike) -> None:
        own = _own(engine)
        own._omega.forces.setPermF(own._assembly.bodies[3 * k + link], own._yade.vector(*np.asarray(force, float)))

    def hold(self, engine: Engine) -> None:
        body, zero = bodies_of(engine)[1], _own(engine)._yade.vector(0, 0, 0)
        body.blockedDOFs = "xyzXYZ"
        body.vel, body.angVel, body.angMom = zero, zero, zero

    def swing(self, engine: Engine, links: Iterable[tuple[float, float, float]]) -> None:
        own = _own(engine)
        vector, inertias = own._yade.vector, own.particle.boxes.link_inertias[:, 2]
        for body, (along, across, spin), inertia in zip(bodies_of(engine), links, inertias, strict=True):
            body.vel, body.angVel = vector(float(along), float(across), 0.0), vector(0, 0, float(spin))
            body.angMom = vector(0, 0, float(spin * inertia))

    def burden(self, engine: Engine, k: int, ratio: float, *, rise: float) -> None:
        heavy = bodies_of(engine)[k]
        heavy.mass, heavy.inertia = ratio * heavy.mass, ratio * heavy.inertia

    def floor_force(self, engine: Engine) -> Array:
        return _own(engine).container_force()

    def torques(self, engine: Engine) -> Array:
        found: Array = _own(engine).motors._hinges.torques()[0]
        return found

    def spoil(self, engine: Engine, what: str) -> None:
        own = _own(engine)
        links = len(own._assembly.bodies) // 3
        body = bodies_of(engine)[2 * links - 1]
        vector, (x, y, z), reach, radius = own._yade.vector, body.pos, own.particle.reach, own.particle.radius
        if what == "velocity":
            body.vel = vector(0, math.nan, 0)
        elif what == "spin":
            body.angVel = body.angMom = vector(math.nan, 0, 0)
        elif what == "speed":
            body.vel = vector(0, 0, 1e3)
        else:
            places = {
                "position": (x, y, math.nan),
                "over the wall": (x, y, own.cylinder.height + reach),
                "through the wall": (own.cylinder.radius + reach, y, z),
                "under the floor": (x, y, -reach),
                "hinge": (x, y, z + radius),
                "overlap": (x, y, z - 2.5 * radius),
            }
            body.pos = vector(*places[what])

    def heat(self, engine: Engine, share: float) -> None:
        omega = _own(engine)._omega
        for material in (omega.materials[label] for label in (SMARTICLE_MATERIAL, WALL_MATERIAL)):
            material.cn, material.cs = -share * material.cn, 0.0
        for contact in omega.interactions:
            contact.phys.cn, contact.phys.cs = -share * contact.phys.cn, 0.0


def _own(engine: Engine) -> YadeEngine:
    assert isinstance(engine, YadeEngine)
    return engine


def bodies_of(engine: Engine) -> list[Any]:
    """States of YADE's rigid bodies: one per smarticle, or three."""
    own = _own(engine)
    return [own._omega.bodies[body].state for body in own._assembly.bodies]
