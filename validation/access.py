"""Test access to the internals of the engines YADE and links, for example to set velocities.

Both engines use the leapfrog scheme, whose velocities belong to the half step before the positions. For a velocity v at
t = 0 under an acceleration a, set the velocity v − a dt/2.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from dem.body.linear import applied
from dem.body.particle import Boxes, Particle, SphereChain
from dem.engine.demand import contact_law_of, motor_law_of
from dem.engine.interface import Engine
from dem.engine.links.arrays import FLOOR, WALL
from dem.engine.links.engine import LinksEngine
from dem.engine.links.motion.planar import lay_out
from dem.engine.links.shapes import Planar, smarticle_shape
from dem.engine.yade.construction import SMARTICLE_MATERIAL, WALL_MATERIAL
from dem.engine.yade.engine import YadeEngine
from dem.engine.yade.kind import hinge_law
from dem.engine.yade.library import rows_of
from dem.physics.contact import ContactLaw
from dem.plan.steps import time_step
from dem.scene.scene import Scene
from dem.setting.container import Cylinder

Array = NDArray[np.float64]

ENGINES = ("yade", "links")

# Steel ball of all cases; contact stiffness of the fidelities `standard` and `reference`.
BALL_RADIUS, BALL_MASS = 2e-3, 2.6e-4  # m, kg
STIFFNESS = 500.0  # N/m


class _Access:
    """Test access that both engines share; it has no state, so that it can be sent to other processes."""

    engine: ClassVar[type[Any]]

    def build(
        self,
        particle: Particle,
        law: ContactLaw,
        *,
        dt: float,
        gravity: float = 0.0,
        height: float = 0.2,
        **motors: Any,
    ) -> Engine:
        """Build an engine with a floor at z = 0 and a wall of radius 0.5 m, which no body reaches.

        `dt` is the time step [s]; gravity is in [m/s²], the height of the wall in [m]. `motors` are keyword arguments
        of the engine, see `motors_of`.
        """
        cylinder = Cylinder(radius=0.5, height=height, facets=16)
        keys = {"particle": particle, "cylinder": cylinder, "law": law, "gravity": gravity, "time_step": dt}
        engine: Engine = self.engine(**keys, shaken=False, **motors)
        return engine

    def motors_of(self, scene: Scene) -> dict[str, Any]:
        """Return the keyword arguments for the engine's constructor that describe the motors of a scene."""
        raise NotImplementedError

    def build_hinged(self, scene: Scene, *, gravity: float, dt: float | None = None) -> Engine:
        """Build an engine for articulated smarticles of a scene, with a time step `dt` [s] or the scene's own."""
        law, dt = contact_law_of(scene), dt or time_step(scene)
        height, motors = scene.cylinder.height, self.motors_of(scene)
        return self.build(scene.body, law, dt=dt, gravity=gravity, height=height, **motors)


def _bar(length: float, thickness: float, radius: float, kind: type[Particle] = Particle) -> Particle:
    """Return a barbless smarticle of mass BALL_MASS and square section, for spheres of a radius [m].

    `thickness` is the side of the section [m], `kind` the class.
    """
    boxes = Boxes(
        middle_length=length,
        barb_length=0.0,
        thickness_normal=thickness,
        thickness_in_plane=thickness,
        density=BALL_MASS / (length * thickness**2),
    )
    return kind(boxes, SphereChain(rows=1, diameter=2 * radius, pitch=2 * radius))


def _spoilt_place(engine: Engine, what: str, place: Iterable[float]) -> tuple[float, float, float]:
    """Return an invalid position (3,) [m], to which the caller moves a body that is at `place`.

    `what`, a key of `hard.broken.SPOILT`, says in which way the position is invalid.
    """
    (x, y, z), reach, radius = place, engine.particle.reach, engine.particle.radius
    return {
        "position": (x, y, math.nan),
        "over the wall": (x, y, engine.cylinder.height + reach),
        "through the wall": (engine.cylinder.radius + reach, y, z),
        "under the floor": (x, y, -reach),
        "hinge": (x, y, z + radius),
        "overlap": (x, y, z - 2.5 * radius),
    }[what]


# -- links -------------------------------------------------------------------------------------------------------------

HEAVY = 1e9  # factor by which `hold` increases the mass of the middle link
# The stub that represents a ball has large transverse moments of inertia, about 3000 m r², so that it does not turn
# during a contact and its end remains the lowest point.
STUB_THICKNESS = 200 * BALL_RADIUS
POINTS = 400  # spheres that represent a link in `swept`


class Pushed(LinksEngine):
    """Engine `links` with additional external forces on single links of smarticles."""

    def __init__(self, **keys: Any) -> None:
        super().__init__(**keys)
        self.forces: dict[tuple[int, int], Array] = {}  #: Force [N] on the centre of a link, by (smarticle, link)
        self.grown = (0.0, 0.0)  #: Start and duration of the linear rise of all forces [s]

    def advance(self, steps: int) -> None:
        """Advance by a number of steps, and apply the forces before each step."""
        if not self.forces:
            super().advance(steps)
            return
        for _ in range(steps):
            self._kick()
            super().advance(1)

    def _kick(self) -> None:
        """Add the impulse of the forces over one time step to the momenta."""
        world, dt = self._world, self.time_step
        bodies, planar, motors = world.posed(), Planar(*world.shapes.planar[0]), world.motors
        share = planar.barb_mass / planar.mass
        begun, rise = self.grown
        part = min(1.0, (self.time - begun + dt) / rise) if rise else 1.0
        for (k, link), full in self.forces.items():
            force = part * full
            row, axes = bodies.plane[k], bodies.axes[k]
            # Centre of the link relative to the centre of mass, in the axes of the middle link.
            centre = np.array([*((row[2:4], -row[0:2], row[4:6])[link]), 0.0])
            local = axes.T @ force
            bodies.velocity[k] += dt * force / planar.mass
            bodies.momentum[k] += dt * axes @ np.cross(centre, local)
            if motors is None or not world.articulated:
                continue
            pulled = -share * np.array([row[6:8] @ local[:2], row[8:10] @ local[:2]])
            if link != 1:
                sign, place, hinge = (-1.0, 0, -planar.half) if link == 0 else (1.0, 1, planar.half)
                arm = centre[:2] - [hinge - row[0], -row[1]]
                pulled[place] += sign * (arm[0] * local[1] - arm[1] * local[0])
            motors.momentum[k] += dt * pulled


class LinksAccess(_Access):
    """Test access to the links engine, through its arrays."""

    name = "links"
    engine = Pushed
    ball_turn = Rotation.from_euler("y", -90, degrees=True)
    """Rotation of `ball` with which a single point is lowest, and two balls along z touch at their ends."""
    arm_share = 0.5
    """Point of action of the floor's force within the overlap [1]: 0 at the surface of the body, 1 at the floor."""

    def motors_of(self, scene: Scene) -> dict[str, Any]:
        return {"motor_law": motor_law_of(scene)}

    def ball(self) -> Particle:
        """Return a body that hits the floor like a ball of BALL_RADIUS and BALL_MASS if turned by `ball_turn`."""
        # The engine has no balls: an upright stub touches the floor with its round end.
        return _bar(2 * BALL_RADIUS, STUB_THICKNESS, BALL_RADIUS / 2)

    def roller(self) -> Particle:
        """Return a particle that, unrotated, rolls along y like a solid ball of BALL_RADIUS and BALL_MASS."""
        # A bar across the direction of motion, with the moment of the ball about its axis, I = m t²/6.
        return _bar(5 * BALL_RADIUS, BALL_RADIUS * math.sqrt(12 / 5), BALL_RADIUS)

    def ends(self, particle: Particle) -> Array:
        """Return the centres (n, 3) [m], in the body frame, of all spheres that can touch the floor."""
        shape = smarticle_shape(particle)
        starts, ends = shape.lines[:, :3], shape.lines[:, :3] + shape.lines[:, 3:6]
        # Ends of links; each hinge once.
        return applied(particle.boxes.link_rotations[1], np.concatenate([starts[shape.shared == 0], ends]))

    def swept(self, particle: Particle) -> Array:
        """Return the centres (n, 3) [m], in the body frame, of spheres that cover the smarticle."""
        lines, way = smarticle_shape(particle).lines, np.linspace(0, 1, POINTS)[:, None]
        points = [line[:3] + way * line[3:6] for line in lines]
        return applied(particle.boxes.link_rotations[1], np.concatenate(points))

    def pin_stiffness(self, scene: Scene) -> float:
        """Return the stiffness of a hinge, force over gap [N/m]; inf if hinges cannot open."""
        return math.inf

    def push(self, engine: Engine, k: int, velocity: ArrayLike = (0, 0, 0), spin: ArrayLike = (0, 0, 0)) -> None:
        """Set the velocity (3,) [m/s] and the angular velocity `spin` (3,) [rad/s] of welded smarticle `k`."""
        bodies = _links(engine)._world.posed()
        row, axes = bodies.plane[k], bodies.axes[k]
        inertia = np.array([[row[14], row[17], 0.0], [row[17], row[15], 0.0], [0.0, 0.0, row[16]]])
        bodies.velocity[k] = velocity
        bodies.momentum[k] = axes @ inertia @ axes.T @ np.asarray(spin, float)

    def force(self, engine: Engine, k: int, link: int, force: ArrayLike) -> None:
        """Apply a constant force (3,) [N] to the centre of a link of smarticle `k` from the next step on."""
        assert isinstance(engine, Pushed)
        engine.forces[k, link] = np.asarray(force, float)

    def hold(self, engine: Engine) -> None:
        """Fix the middle link of smarticle 0, which must be articulated and at rest."""
        # The link becomes too heavy to move, and an external force carries its weight.
        own = _links(engine)
        world, planar = own._world, Planar(*own._world.shapes.planar[0])
        middle = own.state().smarticles.link_positions[0, 1].copy()
        mass, heavy = HEAVY * planar.middle_mass, ("middle_mass", "middle_xx", "middle_yy", "middle_zz")
        planar = planar._replace(
            mass=2 * planar.barb_mass + mass, **{name: HEAVY * getattr(planar, name) for name in heavy}
        )
        world.shapes.planar[0], world.shapes.mass[0] = planar, planar.mass
        lay_out(planar, float(world.bodies.alpha[0, 0]), float(world.bodies.alpha[0, 1]), world.bodies.plane[0])
        bodies = world.posed()
        bodies.position[0] = middle + bodies.axes[0, :, :2] @ bodies.plane[0, :2]
        bodies.velocity[0] = bodies.momentum[0] = 0.0
        if own.gravity:
            self.force(own, 0, 1, (0.0, 0.0, planar.mass * own.gravity))

    def swing(self, engine: Engine, links: Iterable[tuple[float, float, float]]) -> None:
        """Set velocities in the plane for smarticle 0, which must be articulated and unrotated.

        `links` has, for barb 1, middle link and barb 2, the velocities along x and y [m/s] and the angular velocity
        about z [rad/s]; they must be consistent with the hinges.
        """
        world = _links(engine)._world
        motors, (first, middle, second) = world.motors, np.array(list(links))
        assert motors is not None
        planar, bodies, row = Planar(*world.shapes.planar[0]), world.posed(), world.bodies.plane[0]
        masses = np.array([planar.barb_mass, planar.middle_mass, planar.barb_mass])
        rates = np.array([middle[2] - first[2], second[2] - middle[2]])
        velocity = (masses[:, None] * [first[:2], middle[:2], second[:2]]).sum(axis=0) / planar.mass
        spin = row[16] * middle[2] + row[18:20] @ rates
        bodies.velocity[0], bodies.momentum[0] = (*velocity, 0.0), (0.0, 0.0, spin)
        bodies.rate[0] = rates
        motors.momentum[0] = row[18:20] * middle[2] + np.array([[row[20], row[21]], [row[21], row[20]]]) @ rates

    def burden(self, engine: Engine, k: int, ratio: float, *, rise: float) -> None:
        """Multiply the weight of smarticle `k` by `ratio`.

        On the engine `links` this is an external force, which rises linearly within the time `rise` [s]. On YADE mass
        and inertia change at once.
        """
        # All smarticles on links have one mass, so that an external force is added.
        own = _links(engine)
        if not isinstance(own, Pushed):
            own.__class__ = Pushed  # a run's engine, built by its kind
        assert isinstance(own, Pushed)
        # One force per link: a force on the middle link alone would turn the smarticle.
        weights = -(ratio - 1) * own.gravity * particle_of(own).boxes.link_masses
        own.forces = {(k, link): np.array([0.0, 0.0, weights[link]]) for link in range(3)}
        own.grown = own.time, rise

    def floor_force(self, engine: Engine) -> Array:
        """Return the force of all smarticles on floor and wall in the last step, (3,) [N]."""
        force = _links(engine)._world.ground.force
        return np.asarray(force[FLOOR] + force[WALL])

    def torques(self, engine: Engine) -> Array:
        """Return the torques of the motors of smarticle 0, (2,) [N m]."""
        readings = engine.motors.readings  # the mean since the last control update
        assert readings is not None
        return np.array(readings.torques[0])

    def spoil(self, engine: Engine, what: str) -> None:
        """Set an invalid state of the second smarticle, on YADE of its last link if it is articulated.

        `what`, a key of `hard.broken.SPOILT`, is the kind of invalid state.
        """
        bodies = _links(engine)._world.bodies
        if what == "velocity":
            bodies.velocity[1, 1] = math.nan
        elif what == "spin":
            bodies.momentum[1, 0] = math.nan
        elif what == "speed":
            bodies.velocity[1] = 0.0, 0.0, 1e3
        else:
            bodies.position[1] = _spoilt_place(engine, what, bodies.position[1])

    def heat(self, engine: Engine, share: float) -> None:
        """Multiply normal damping by −`share`, so that dashpots supply energy; set tangential damping to 0."""
        world = _links(engine)._world
        world.laws = tuple(law._replace(damping=-share * law.damping, shear_damping=0.0) for law in world.laws)


def _links(engine: Engine) -> LinksEngine:
    assert isinstance(engine, LinksEngine)
    return engine


# -- YADE --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Ball(Particle):
    """Particle of one sphere."""

    def __post_init__(self) -> None:
        """Skip the checks of `Particle`, which compare spheres with links."""

    @cached_property
    def _layout(self) -> tuple[Array, NDArray[np.int64]]:
        return np.zeros((1, 3)), np.ones(1, dtype=np.int64)


class YadeAccess(_Access):
    """Test access to YADE, through its bodies; `LinksAccess` documents the methods."""

    name = "yade"
    engine = YadeEngine
    ball_turn = Rotation.identity()
    arm_share = 1.0

    def motors_of(self, scene: Scene) -> dict[str, Any]:
        return {"hinge_law": hinge_law(scene), "motor_law": motor_law_of(scene)}

    def ball(self) -> Particle:
        # A cube of side r √(12/5) has the moment of a solid ball, 2/5 m r².
        side = BALL_RADIUS * math.sqrt(12 / 5)
        return _bar(side, side, BALL_RADIUS, Ball)

    def roller(self) -> Particle:
        return self.ball()

    def ends(self, particle: Particle) -> Array:
        return particle.centres

    def swept(self, particle: Particle) -> Array:
        return particle.centres

    def pin_stiffness(self, scene: Scene) -> float:
        return hinge_law(scene).pin_stiffness

    def push(self, engine: Engine, k: int, velocity: ArrayLike = (0, 0, 0), spin: ArrayLike = (0, 0, 0)) -> None:
        own = _yade(engine)
        bodies, vector = own._omega.bodies, own._yade.vector
        clump, (v, w) = bodies[own._assembly.bodies[k]].state, (np.asarray(velocity, float), np.asarray(spin, float))
        state = own.state().smarticles
        rotation = state.link_rotations[k, 1] @ state.boxes.link_rotations[1].T
        clump.vel, clump.angVel = vector(*v), vector(*w)
        # YADE integrates the angular momentum.
        clump.angMom = vector(*(rotation @ np.diag(particle_of(own).boxes.inertia) @ rotation.T @ w))
        # Contact laws read the velocities of the spheres in the first step.
        for sphere in own._assembly._spheres[k]:
            member = bodies[sphere].state
            member.vel = vector(*(v + np.cross(w, np.array(member.pos) - np.array(clump.pos))))
            member.angVel = clump.angVel

    def force(self, engine: Engine, k: int, link: int, force: ArrayLike) -> None:
        own = _yade(engine)
        own._omega.forces.setPermF(own._assembly.bodies[3 * k + link], own._yade.vector(*np.asarray(force, float)))

    def hold(self, engine: Engine) -> None:
        body, zero = bodies_of(engine)[1], _yade(engine)._yade.vector(0, 0, 0)
        body.blockedDOFs = "xyzXYZ"
        body.vel, body.angVel, body.angMom = zero, zero, zero

    def swing(self, engine: Engine, links: Iterable[tuple[float, float, float]]) -> None:
        own = _yade(engine)
        vector, inertias = own._yade.vector, particle_of(own).boxes.link_inertias[:, 2]
        for body, (along, across, spin), inertia in zip(bodies_of(engine), links, inertias, strict=True):
            body.vel, body.angVel = vector(float(along), float(across), 0.0), vector(0, 0, float(spin))
            body.angMom = vector(0, 0, float(spin * inertia))

    def burden(self, engine: Engine, k: int, ratio: float, *, rise: float) -> None:
        heavy = bodies_of(engine)[k]
        heavy.mass, heavy.inertia = ratio * heavy.mass, ratio * heavy.inertia

    def floor_force(self, engine: Engine) -> Array:
        own = _yade(engine)
        return np.asarray(rows_of(own._omega.forces.f(body) for body in own.boundaries.container).sum(axis=0))

    def torques(self, engine: Engine) -> Array:
        return np.asarray(_yade(engine).motors._hinges.torques()[0])

    def spoil(self, engine: Engine, what: str) -> None:
        own = _yade(engine)
        body, vector = bodies_of(engine)[2 * (len(own._assembly.bodies) // 3) - 1], own._yade.vector
        if what == "velocity":
            body.vel = vector(0, math.nan, 0)
        elif what == "spin":
            body.angVel = body.angMom = vector(math.nan, 0, 0)
        elif what == "speed":
            body.vel = vector(0, 0, 1e3)
        else:
            body.pos = vector(*_spoilt_place(engine, what, body.pos))

    def heat(self, engine: Engine, share: float) -> None:
        omega = _yade(engine)._omega
        for material in (omega.materials[label] for label in (SMARTICLE_MATERIAL, WALL_MATERIAL)):
            material.cn, material.cs = -share * material.cn, 0.0
        for contact in omega.interactions:
            contact.phys.cn, contact.phys.cs = -share * contact.phys.cn, 0.0


def _yade(engine: Engine) -> YadeEngine:
    assert isinstance(engine, YadeEngine)
    return engine


def particle_of(engine: Engine) -> Particle:
    """Return the smarticle of an engine."""
    assert isinstance(engine.particle, Particle)
    return engine.particle


def bodies_of(engine: Engine) -> list[Any]:
    """Return the states of YADE's rigid bodies: one per welded smarticle, three per articulated one."""
    own = _yade(engine)
    return [own._omega.bodies[body].state for body in own._assembly.bodies]


EngineAccess = LinksAccess | YadeAccess


def engine_access(engine: str) -> EngineAccess:
    """Return the test access to an engine, by the engine's name."""
    return YadeAccess() if engine == "yade" else LinksAccess()
