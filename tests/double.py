"""An engine in memory: `dem.engine.interface` with physics that can be computed by hand.

Smarticles fall freely, without turning, through each other, until they stand on the floor; there they stay and go
with it. Barbs never turn, and a smarticle that a string is tied to goes where the string goes. `calls` lists the calls;
answers may be set.
"""

from __future__ import annotations

import math
import pickle
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.body.chain import Tie
from dem.body.forces import ContactForces, at_boundaries, at_links, contacts_of_points
from dem.body.particle import Particle
from dem.body.placement import Poses
from dem.body.state import PileState, State
from dem.engine.demand import Activity, Demand
from dem.engine.effect import Adds, EffectName
from dem.engine.interface import Engine, MotorReadings, Saved
from dem.engine.kinds import EngineKind
from dem.errors import RunError
from dem.physics.contact import StringLaw
from dem.physics.overlaps import Extremes, Overlaps
from dem.setting.container import Cylinder

Array = NDArray[np.float64]
Calls = list[tuple[Any, ...]]
"""Calls in order: a name and numbers."""

STABLE_STEP = 5e-4  # s; nothing here is unstable


@dataclass(kw_only=True)
class BoundariesDouble:
    """Floor, wall, hooks and plate.

    The upper hook is pulled down by a spring, `hook_stiffness` [N/m], as it is raised. The plate is pushed up by a
    spring, `plate_stiffness` [N/m], below the height `plate_rest` [m].
    """

    calls: Calls
    top: float = math.inf
    bottom: float = -0.001
    upper_start: float | None = None
    planar: bool = False
    hook_stiffness: float = 0.0
    plate_stiffness: float = 0.0
    plate_rest: float = 0.0
    plate_height: float | None = None
    plate_sum: Array = field(default_factory=lambda: np.zeros(3))
    _plate_speed: float = 0.0
    floor: float = 0.0
    velocity: float = 0.0
    walled: bool = True
    hook_sums: Array = field(default_factory=lambda: np.zeros((0, 3)))
    channel_sums: Array = field(default_factory=lambda: np.zeros((0, 3)))
    _shaken: tuple[float, float, float] | None = None
    _clock: float = 0.0
    _speeds: tuple[float, float] = (0.0, 0.0)  # of the wall and of the upper hook, against the floor
    _moved: tuple[float, float] = (0.0, 0.0)

    @property
    def wall_bottom(self) -> float:
        return self.floor + self.bottom + self._moved[0] if self.walled else math.inf

    @property
    def enclosed(self) -> bool:
        return self.walled and not self.planar and self.wall_bottom < self.floor

    @property
    def raised(self) -> float | None:
        return self._moved[1] if self.enclosed and self.upper_height - self.floor <= self.top else None

    @property
    def upper_height(self) -> float:
        return self.floor + (self.upper_start or 0.0) + self._moved[1]

    def shake(self, *, amplitude: float, frequency: float, walls: bool = True, from_rest: bool = False) -> None:
        self.calls.append(("shake", amplitude, frequency) if walls else ("shake the floor", amplitude, frequency))
        self._shaken, self._clock = (self.floor, amplitude, 2 * math.pi * frequency), 0.0
        if from_rest:
            self._shaken, self._clock = (self.floor + amplitude, *self._shaken[1:]), -0.25 / frequency

    def stop_shaking(self) -> None:
        self.calls.append(("stop shaking",))
        self._shaken, self.velocity = None, 0.0

    def lift_wall(self, speed: float) -> None:
        self.calls.append(("lift_wall", speed))
        self._speeds = (speed, self._speeds[1])

    def raise_upper(self, speed: float) -> None:
        self.calls.append(("raise_upper", speed))
        self._speeds = (self._speeds[0], speed)

    def place_plate(self, height: float) -> None:
        self.calls.append(("place_plate", height))
        self.plate_height = height

    def move_plate(self, speed: float) -> None:
        self.calls.append(("move_plate", speed))
        self._plate_speed = speed

    def remove_plate(self) -> None:
        self.calls.append(("remove_plate",))
        self.plate_height = None

    def stop(self) -> None:
        self.calls.append(("stop",))
        self._shaken, self._speeds, self.velocity = None, (0.0, 0.0), 0.0

    def remove_wall(self) -> None:
        self.calls.append(("remove_wall",))
        self.walled = False

    def step(self, dt: float) -> None:
        """Go on by dt [s]."""
        if self._shaken is not None:
            start, amplitude, omega = self._shaken
            self._clock += dt
            self.floor = start + amplitude * math.sin(omega * self._clock)
            self.velocity = amplitude * omega * math.cos(omega * self._clock)
        self._moved = (self._moved[0] + self._speeds[0] * dt, self._moved[1] + self._speeds[1] * dt)
        if self.plate_height is not None:
            self.plate_height += self._plate_speed * dt
            pressed = max(0.0, self.plate_rest - self.plate_height)
            self.plate_sum = self.plate_sum + np.array([0.0, 0.0, self.plate_stiffness * pressed])
        if len(self.hook_sums):
            self.hook_sums = self.hook_sums - [[0, 0, 0], [0, 0, self.hook_stiffness * self._moved[1]]]


@dataclass(kw_only=True)
class MotorsDouble:
    """Motors that hold their commands, and turn nothing."""

    calls: Calls
    present: bool = False
    articulated: bool = False
    readings: MotorReadings | None = None
    work: float = 0.0
    angles: Array = field(default_factory=lambda: np.zeros((0, 2)))
    updates_at_once: int = 1
    targets: list[Array] = field(default_factory=list)

    def articulate(self) -> None:
        assert self.present
        if not self.articulated:
            self.calls.append(("articulate",))
            self.articulated = True
            self._hold(self.angles)

    def weld(self) -> None:
        if self.articulated:
            self.calls.append(("weld",))
            self.articulated = False

    def actuate(self, targets: Array, interval: float) -> None:
        assert self.articulated
        assert len(targets) <= self.updates_at_once
        self.calls.append(("actuate", interval))
        self.targets += list(targets)
        self._hold(targets[-1])

    def _hold(self, angles: Array) -> None:
        none = np.zeros_like(angles)
        self.readings = MotorReadings(
            schedule=angles, commands=angles, torques=none, work=none, halted=np.zeros(angles.shape, dtype=np.bool_)
        )

    def gaps(self) -> Array:
        return np.zeros_like(self.angles)


@dataclass(kw_only=True)
class StringsDouble:
    """Two strings of a constant tension, `tension` [N]."""

    calls: Calls
    tension: float = 0.0
    tied: bool = False
    sums: Array = field(default_factory=lambda: np.zeros((0, 3)))
    pulled: float = 0.0
    ties: Array = field(default_factory=lambda: np.zeros((0, 3)))
    places: Array = field(default_factory=lambda: np.zeros((0, 3, 3)))
    """(N, 3, 3) centres of the links [m], kept up to date by the engine."""
    velocities: dict[int, float] = field(default_factory=dict)
    """Speed along x of each smarticle that a string is tied to [m/s]."""

    def tie(self, ties: Sequence[Tie], law: StringLaw, speeds: Sequence[float]) -> None:
        self.calls.append(("tie", law.length, *speeds))
        self.ties = np.array([self.places[tie.smarticle, tie.link] for tie in ties])
        away = np.sign(self.ties[:, 0]) * np.array(speeds)
        self.velocities = {tie.smarticle: float(speed) for tie, speed in zip(ties, away, strict=True)}
        self.tied, self.pulled, self.sums = True, 0.0, np.zeros((len(ties), 3))

    def untie(self) -> None:
        if self.tied:
            self.calls.append(("untie",))
        self.tied, self.velocities = False, {}

    def step(self, dt: float) -> None:
        """Go on by dt [s]."""
        if not self.tied:
            return
        along = np.outer(list(self.velocities.values()), [1.0, 0.0, 0.0])
        self.ties, self.pulled = self.ties + along * dt, self.pulled + float(np.abs(along).sum()) * dt
        self.sums = self.sums + np.outer(np.sign(self.ties[:, 0]), [self.tension, 0.0, 0.0])


@dataclass(kw_only=True)
class GripsDouble:
    """Grips that hold nothing, and a spring of `stiffness` [N/m] between the first two along z."""

    calls: Calls
    stiffness: float = 0.0
    sums: Array = field(default_factory=lambda: np.zeros((0, 3)))
    pushed: Array = field(default_factory=lambda: np.zeros((0, 3)))
    moved: Array = field(default_factory=lambda: np.zeros((0, 3)))
    held: list[list[int]] = field(default_factory=list)
    _speeds: Array = field(default_factory=lambda: np.zeros((0, 3)))

    @property
    def weights(self) -> Array:
        return np.zeros(len(self.held))

    @property
    def counts(self) -> NDArray[np.int64]:
        return np.array([len(bodies) for bodies in self.held], dtype=np.int64)

    @property
    def places(self) -> Array:
        return self.moved

    @property
    def made(self) -> int:
        return sum(call[0] == "hold" for call in self.calls)

    def hold(self, bodies: Sequence[int]) -> int:
        self.calls.append(("hold", *bodies))
        self.held.append(list(bodies))
        self.sums, self.pushed, self.moved, self._speeds = (
            np.append(each, np.zeros((1, 3)), axis=0) for each in (self.sums, self.pushed, self.moved, self._speeds)
        )
        return len(self.held) - 1

    def move(self, grip: int, velocity: tuple[float, float, float]) -> None:
        self.calls.append(("move", grip, *velocity))
        self._speeds[grip] = velocity

    def release(self) -> None:
        self.calls.append(("release",))
        self.held = []
        self.sums = self.pushed = self.moved = self._speeds = np.zeros((0, 3))

    def step(self, dt: float) -> None:
        """Go on by dt [s]."""
        if len(self.moved) == 2:
            self.moved = self.moved + self._speeds * dt
            pull = self.stiffness * float(self.moved[1, 2] - self.moved[0, 2])
            self.sums = self.sums + np.array([[0.0, 0.0, pull], [0.0, 0.0, -pull]])
            self.pushed = self.pushed + np.array([[0.0, 0.0, pull], [0.0, 0.0, -pull]])


@dataclass
class LedgerDouble:
    """Energies, exact."""

    container_work: float = 0.0
    added: float = 0.0
    dissipated: float = 0.0

    @property
    def given(self) -> float:
        return self.added + self.container_work

    def elastic(self) -> tuple[float, float]:
        return 0.0, 0.0

    def take_in(self) -> None:
        pass


@dataclass(kw_only=True)
class EngineDouble:
    """The engine; see above."""

    particle: Particle
    cylinder: Cylinder
    gravity: float
    time_step: float
    planar: bool = False
    stops_at: int | None = None
    """Step at which it stops by itself."""
    drift: float = 0.0
    """Speed at which standing smarticles slide along x [m/s]."""
    deepest: float = 0.0
    """Depth of the deepest contact of each standing smarticle [m]."""
    time: float = 0.0
    steps: int = 0
    cpu_elsewhere: float = 0.0
    calls: Calls = field(default_factory=list)
    filaments: None = None
    grips: GripsDouble | None = None
    ledger: LedgerDouble = field(default_factory=LedgerDouble)

    def __post_init__(self) -> None:
        self.boundaries = BoundariesDouble(calls=self.calls, top=self.cylinder.height, planar=self.planar)
        self.motors = MotorsDouble(calls=self.calls)
        self.strings = StringsDouble(calls=self.calls)
        self.positions = np.zeros((0, 3))
        self.velocities = np.zeros((0, 3))
        self._rotations = np.zeros((0, 3, 3))
        self._standing = np.zeros(0, dtype=np.bool_)
        self._seconds = 0.0
        self.stands = np.zeros(0)
        """(N,) heights above the floor at which centres of mass come to rest: the lowest sphere touches it [m]."""

    @classmethod
    def of(cls, scene: Demand, time_step: float) -> EngineDouble:
        """The double that a scene calls for."""
        engine = cls(
            particle=scene.body,
            cylinder=scene.cylinder,
            gravity=scene.gravity_m_per_s2,
            time_step=time_step,
            planar=scene.channel is not None,
        )
        engine.motors.present = scene.actuates
        engine.boundaries.bottom = scene.cylinder.bottom
        if scene.hooks is not None:
            engine.boundaries.upper_start = scene.hooks.upper_height_m
            engine.boundaries.hook_sums = np.zeros((2, 3))
        if scene.channel is not None and scene.channel.width is not None:
            engine.boundaries.channel_sums = np.zeros((2, 3))
        return engine

    # -- time --------------------------------------------------------------------------------------------------

    def set_time_step(self, time_step: float) -> None:
        self.time_step = time_step

    def advance(self, steps: int) -> None:
        target = self.steps + max(0, steps)
        while self.steps < target:
            if self.steps == self.stops_at:
                msg = f"the double stopped at step {self.steps} of {target}"
                raise RunError(msg)
            self._step()

    def _step(self) -> None:
        dt, carried, floor = self.time_step, self._standing, self.boundaries.floor
        falling = ~carried
        self.boundaries.step(dt)
        self.strings.step(dt)
        if self.grips is not None:
            self.grips.step(dt)
        self.time, self.steps = self.time + dt, self.steps + 1
        self._seconds += dt * self.count
        if self.planar:
            self.velocities[:] = 0.0
            for k, velocity in self.strings.velocities.items():
                self.velocities[k, 0] = velocity
                self.positions[k, 0] += dt * velocity
                self.strings.places[k, :, 0] += dt * velocity
            return
        if self.boundaries.floor == floor and not (self.drift or self.velocities.any() or falling.any()):
            return
        ground, before = self.boundaries.floor + self.stands, self._energy(carried)
        along = [self.drift, 0.0, self.boundaries.velocity]
        self.positions[carried, 0] += self.drift * dt
        self.positions[carried, 2], self.velocities[carried] = ground[carried], along
        self.ledger.container_work += self._energy(carried) - before
        if not falling.any():
            return
        self.positions[falling] += dt * self.velocities[falling] - [0.0, 0.0, self.gravity * dt**2 / 2]
        self.velocities[falling, 2] -= self.gravity * dt
        landed = falling & (self.positions[:, 2] <= ground)
        if landed.any():
            before = self._energy(landed)
            self.positions[landed, 2], self.velocities[landed] = ground[landed], along
            self.ledger.dissipated += before - self._energy(landed)
            self._standing = carried | landed

    def _energy(self, which: NDArray[np.bool_]) -> float:
        heights, speeds = self.positions[which, 2], self.velocities[which]
        return float(self.particle.boxes.mass * (self.gravity * heights.sum() + (speeds**2).sum() / 2))

    # -- smarticles --------------------------------------------------------------------------------------------

    @property
    def count(self) -> int:
        return len(self.positions)

    def add(self, poses: Poses, *, speed: float = 0.0) -> None:
        self.calls.append(("add", len(poses.positions)))
        n, boxes = len(poses.positions), self.particle.boxes
        self.positions = np.concatenate([self.positions, poses.positions])
        self.velocities = np.concatenate([self.velocities, np.tile([0.0, 0.0, -speed], (n, 1))])
        turned = np.array([turn.as_matrix() for turn in poses.rotations]).reshape(-1, 3, 3)
        self._rotations = np.concatenate([self._rotations, turned])
        lowest = (self._rotations[:, 2] @ self.particle.centres.T).min(axis=1)
        self.stands = self.particle.radius - lowest
        self._standing = np.concatenate([self._standing, np.zeros(n, dtype=np.bool_)])
        energy = self.gravity * float(poses.positions[:, 2].sum()) + n * speed**2 / 2
        self.ledger.added += boxes.mass * energy
        self.motors.angles = np.tile(boxes.angles, (self.count, 1))
        self.strings.places = self.state().link_positions

    def still(self) -> None:
        assert not self.motors.articulated
        self.calls.append(("still",))
        self.ledger.dissipated += self.state().kinetic_energy
        self.velocities[:] = 0.0

    def state(self) -> State:
        still = np.zeros_like(self.positions)
        return State.rigid(self.particle.boxes, self.positions.copy(), self._rotations, self.velocities.copy(), still)

    @property
    def impulse(self) -> float:
        return self._seconds * self.particle.boxes.mass * self.gravity

    def unbalanced_force(self) -> float:
        return float((~self._standing).mean()) if self.count and self.gravity else math.inf

    def neighbours(self) -> NDArray[np.int64]:
        return np.zeros(self.count, dtype=np.int64)

    def touches(self) -> NDArray[np.int64]:
        return self._standing.astype(np.int64)

    def overlaps(self, limit: float) -> Overlaps:
        deep = self._standing & (self.deepest > limit)
        return Overlaps(self.deepest, deep, 0.0)

    def contact_forces(self) -> ContactForces:
        """Standing smarticles, each pressed by its weight onto the floor below its middle link."""
        standing = np.flatnonzero(self._standing)
        points, up = self.positions[standing] * [1, 1, 0], np.tile([0.0, 0.0, 1.0], (len(standing), 1))
        weight = self.particle.boxes.mass * self.gravity
        return contacts_of_points(
            at_links(standing, np.ones_like(standing)),
            at_boundaries(np.zeros_like(standing)),
            loads=np.full(len(standing), weight),
            points=points + np.array([0.0, 0.0, self.boundaries.floor]),
            friction=0 * up,
            forces=weight * up,
        )

    def extremes(self, state: PileState) -> Extremes | None:
        return None

    # -- checkpoints -------------------------------------------------------------------------------------------

    def save(self, scratch: Path) -> Saved:
        kept = {name: value for name, value in vars(self).items() if name not in ("particle", "cylinder", "calls")}
        parts = {name: vars(kept.pop(name)) for name in ("boundaries", "motors", "strings", "ledger")}
        content = {name: {key: value for key, value in part.items() if key != "calls"} for name, part in parts.items()}
        time, steps = kept.pop("time"), kept.pop("steps")
        return Saved(content=pickle.dumps((kept, content)), memory={"time": time, "steps": steps})

    def load(self, saved: Saved, scratch: Path) -> None:
        kept, parts = pickle.loads(saved.content)
        vars(self).update(kept | dict(saved.memory))
        for name, values in parts.items():
            vars(getattr(self, name)).update(values)


class KindDouble:
    """`dem.engine.kinds.EngineKind`; `built` are the engines that it has built."""

    name = "double"
    workers = "threads"
    damps_once_per_update = False
    idle_knobs: tuple[str, ...] = ()
    adds: Mapping[EffectName, Adds] = {}
    order: tuple[str, ...] = ()
    built: list[EngineDouble]

    def __init__(self) -> None:
        self.built = []

    def version(self) -> str:
        return "1"

    def threads(self) -> int:
        return 1

    def stable_step(self, scene: Demand, *, articulated: bool) -> float:
        return STABLE_STEP

    def seconds_per_second(self, scene: Demand, time_step: float, activity: Activity) -> float:
        return 1e-6 / time_step

    def seconds_to_compile(self, scene: Demand) -> float:
        return 0.0

    def build(self, scene: Demand, time_step: float) -> EngineDouble:
        self.built.append(EngineDouble.of(scene, time_step))
        return self.built[-1]


def _conforms(engine: EngineDouble, kind: KindDouble) -> tuple[Engine, EngineKind]:
    """For the type checker alone: the doubles implement the interfaces."""
    return engine, kind
