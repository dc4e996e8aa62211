"""Test access to the links engine, through its arrays."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from dem.body.particle import Boxes, Particle, SphereChain
from dem.engine.demand import contact_law_of, motor_law_of
from dem.engine.interface import Engine
from dem.engine.links.arrays import FLOOR, WALL
from dem.engine.links.engine import LinksEngine
from dem.engine.links.motion.planar import lay_out
from dem.engine.links.motors import LAWS
from dem.engine.links.shape import shape_of
from dem.physics.contact import ContactLaw
from dem.plan.steps import time_step
from dem.scene.scene import Scene
from dem.setting.container import Cylinder
from validation.engines import BALL_MASS, BALL_RADIUS

Array = NDArray[np.float64]

HEAVY = 1e9  # a middle link that is held weighs so many times as much
# Transverse moments of inertia of the stub that stands for a ball: so large, about 3000 m r², that it does not turn
# while it touches the floor, or its end would not stay the lowest point of it.
STUB_THICKNESS = 200 * BALL_RADIUS
POINTS = 400  # that stand for a link


def _bar(length: float, thickness: float, radius: float) -> Particle:
    """A bar without barbs, of the ball's mass [m]."""
    boxes = Boxes(
        middle_length=length,
        barb_length=0.0,
        thickness_normal=thickness,
        thickness_in_plane=thickness,
        density=BALL_MASS / (length * thickness**2),
    )
    return Particle(boxes, SphereChain(rows=1, diameter=2 * radius, pitch=2 * radius))


class Pushed(LinksEngine):
    """The engine under forces that no run knows.

    Args:
        keys: of the engine.
    """

    def __init__(self, **keys: Any) -> None:
        super().__init__(**keys)
        self.forces: dict[tuple[int, int], Array] = {}
        """On the centre of a link, by smarticle and link [N]."""
        self.grown = (0.0, 0.0)
        """When forces begin to grow, and for how long they do [s]."""

    def advance(self, steps: int) -> None:
        """Build a simulation whose forces can be changed, step by step."""
        if not self.forces:
            super().advance(steps)
            return
        for _ in range(steps):
            self._kick()
            super().advance(1)

    def _kick(self) -> None:
        world, dt = self._world, self.time_step
        bodies, shape, motors = world.posed(), world.shape, world.motors
        share = shape.barb_mass / shape.mass
        begun, rise = self.grown
        part = min(1.0, (self.time - begun + dt) / rise) if rise else 1.0
        for (k, link), full in self.forces.items():
            force = part * full
            row, axes = bodies.plane[k], bodies.axes[k]
            # About the centre of mass, in the middle link's axes.
            centre = np.array([*((row[2:4], -row[0:2], row[4:6])[link]), 0.0])
            local = axes.T @ force
            bodies.velocity[k] += dt * force / shape.mass
            bodies.momentum[k] += dt * axes @ np.cross(centre, local)
            if motors is None or not world.articulated:
                continue
            pulled = -share * np.array([row[6:8] @ local[:2], row[8:10] @ local[:2]])
            if link != 1:
                sign, place, hinge = (-1.0, 0, -shape.half) if link == 0 else (1.0, 1, shape.half)
                arm = centre[:2] - [hinge - row[0], -row[1]]
                pulled[place] += sign * (arm[0] * local[1] - arm[1] * local[0])
            free = LAWS[motors.law] in ("slip", "servo")
            (motors.momentum if free else motors.impulse)[k] += dt * pulled


class LinksAccess:
    """See `validation.engines.EngineAccess`."""

    name = "links"
    ball_turn = Rotation.from_euler("y", -90, degrees=True)  # turns the body's x axis to the vertical
    arm_share = 0.5

    def ball(self) -> Particle:
        # There are no balls; an upright stub meets things with its round end.
        return _bar(2 * BALL_RADIUS, STUB_THICKNESS, BALL_RADIUS / 2)

    def roller(self) -> Particle:
        # A bar that lies across its way, with the ball's moment about its axis, I = m t²/6.
        return _bar(5 * BALL_RADIUS, BALL_RADIUS * math.sqrt(12 / 5), BALL_RADIUS)

    def ends(self, particle: Particle) -> Array:
        # Ends of links, hinges once.
        shape, boxes = shape_of(particle), particle.boxes
        places = [np.array([side * shape.end, 0.0, 0.0]) for side in (-1, 1)]
        for link, side in ((0, -1), (2, 1)):
            if link in shape.kinds:
                places.append(np.array([side * shape.half, 0.0, 0.0]) + shape.tip * boxes.directions[link])
        return boxes.to_body(np.array([place + np.array([0.0, 0.0, z]) for place in places for z in shape.offsets]))

    def swept(self, particle: Particle) -> Array:
        shape, boxes, found = shape_of(particle), particle.boxes, []
        starts = {0: -shape.half, 1: -shape.end, 2: shape.half}
        for link in shape.kinds:
            long = 2 * shape.end if link == 1 else shape.tip
            way = np.linspace(0, long, POINTS)[:, None] * boxes.directions[link]
            found += [way + np.array([starts[int(link)], 0.0, z]) for z in shape.offsets]
        return boxes.to_body(np.concatenate(found))

    def pin_stiffness(self, scene: Scene) -> float:
        return math.inf

    def spring_shafts(self) -> dict[str, Any]:
        # The shafts of motors that halt are rigid, those of motors that slip are springs.
        return {"law": "slip"}

    def build(self, particle: Particle, law: ContactLaw, *, dt: float, gravity: float = 0.0) -> Pushed:
        return Pushed(
            particle=particle,
            cylinder=Cylinder(radius=0.5, height=0.2, facets=16),
            law=law,
            gravity=gravity,
            time_step=dt,
            shaken=False,
        )

    def build_hinged(self, scene: Scene, *, gravity: float, dt: float | None = None) -> Pushed:
        return Pushed(
            particle=scene.particle,
            cylinder=Cylinder(radius=0.5, height=scene.cylinder.height, facets=16),
            law=contact_law_of(scene),
            gravity=gravity,
            time_step=dt or time_step(scene),
            shaken=False,
            motor_law=motor_law_of(scene),
        )

    def push(self, engine: Engine, k: int, velocity: ArrayLike = (0, 0, 0), spin: ArrayLike = (0, 0, 0)) -> None:
        own = _own(engine)
        bodies = own._world.posed()
        row, axes = bodies.plane[k], bodies.axes[k]
        inertia = np.array([[row[14], row[17], 0.0], [row[17], row[15], 0.0], [0.0, 0.0, row[16]]])
        bodies.velocity[k] = velocity
        bodies.momentum[k] = axes @ inertia @ axes.T @ np.asarray(spin, float)

    def force(self, engine: Engine, k: int, link: int, force: ArrayLike) -> None:
        assert isinstance(engine, Pushed)
        engine.forces[k, link] = np.asarray(force, float)

    def hold(self, engine: Engine) -> None:
        # It becomes too heavy to move, and something bears its weight.
        own = _own(engine)
        world = own._world
        middle = own.state().link_positions[0, 1].copy()
        shape = world.shape
        mass = HEAVY * shape.middle_mass
        world.shape = shape._replace(
            mass=2 * shape.barb_mass + mass, middle_mass=mass, middle_inertia=HEAVY * shape.middle_inertia
        )
        lay_out(world.shape, float(world.bodies.alpha[0, 0]), float(world.bodies.alpha[0, 1]), world.bodies.plane[0])
        bodies = world.posed()
        bodies.position[0] = middle + bodies.axes[0, :, :2] @ bodies.plane[0, :2]
        bodies.velocity[0] = bodies.momentum[0] = 0.0
        if own.gravity:
            self.force(own, 0, 1, (0.0, 0.0, world.shape.mass * own.gravity))

    def swing(self, engine: Engine, links: Iterable[tuple[float, float, float]]) -> None:
        world = _own(engine)._world
        motors, (first, middle, second) = world.motors, np.array(list(links))
        assert motors is not None
        shape = world.shape
        bodies, row = world.posed(), world.bodies.plane[0]
        masses = np.array([shape.barb_mass, shape.middle_mass, shape.barb_mass])
        rates = np.array([middle[2] - first[2], second[2] - middle[2]])
        velocity = (masses[:, None] * [first[:2], middle[:2], second[:2]]).sum(axis=0) / shape.mass
        spin = row[16] * middle[2] + row[18:20] @ rates
        bodies.velocity[0], bodies.momentum[0] = (*velocity, 0.0), (0.0, 0.0, spin)
        bodies.rate[0] = rates
        motors.momentum[0] = row[18:20] * middle[2] + np.array([[row[20], row[21]], [row[21], row[20]]]) @ rates

    def burden(self, engine: Engine, k: int, ratio: float, *, rise: float) -> None:
        # All smarticles share one mass, so that the weight alone becomes larger.
        own = _own(engine)
        if not isinstance(own, Pushed):
            own.__class__ = Pushed  # a run's engine, built by its kind
        assert isinstance(own, Pushed)
        boxes = own.particle.boxes
        # A force on the middle link would turn it: all links get theirs.
        weights = -(ratio - 1) * own.gravity * boxes.link_masses
        own.forces = {(k, link): np.array([0.0, 0.0, weights[link]]) for link in range(3)}
        own.grown = own.time, rise

    def floor_force(self, engine: Engine) -> Array:
        felt = _own(engine)._world.ground.force
        found: Array = felt[FLOOR] + felt[WALL]
        return found

    def torques(self, engine: Engine) -> Array:
        # The mean since the last look.
        readings = engine.motors.readings
        assert readings is not None
        found: Array = readings.torques[0].copy()
        return found

    def spoil(self, engine: Engine, what: str) -> None:
        bodies, particle = _own(engine)._world.bodies, engine.particle
        x, y, z = bodies.position[1]
        reach, radius = particle.reach, particle.radius
        if what == "velocity":
            bodies.velocity[1, 1] = math.nan
        elif what == "spin":
            bodies.momentum[1, 0] = math.nan
        elif what == "speed":
            bodies.velocity[1] = 0.0, 0.0, 1e3
        else:
            bodies.position[1] = {
                "position": (x, y, math.nan),
                "over the wall": (x, y, engine.cylinder.height + reach),
                "through the wall": (engine.cylinder.radius + reach, y, z),
                "under the floor": (x, y, -reach),
                "overlap": (x, y, z - 2.5 * radius),
            }[what]

    def heat(self, engine: Engine, share: float) -> None:
        world = _own(engine)._world
        world.laws = tuple(law._replace(damping=-share * law.damping, shear_damping=0.0) for law in world.laws)


def _own(engine: Engine) -> LinksEngine:
    assert isinstance(engine, LinksEngine)
    return engine
