"""Motors on the engine links; `dem.engine.links.motion.motoring` describes how they act."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.engine.interface import MotorReadings
from dem.engine.links.arrays import Motoring
from dem.engine.links.motion.motoring import engage, release
from dem.engine.links.world import World
from dem.errors import InputError
from dem.physics.motor import LAWS, MotorLaw

Array = NDArray[np.float64]

UPDATES = 64  # control updates planned at once, so many that the cost of a kernel's call is negligible


class LinksMotors:
    """`dem.engine.interface.Motors` on links.

    Without a law smarticles stay welded; InputError if the engine does not know it. `strengths` (N, 2) are factors on
    torque limit and stiffness [1]; None: 1 for all motors.
    """

    def __init__(self, world: World, law: MotorLaw | None, strengths: Array | None) -> None:
        self._world = world
        self._law = law
        self._strengths = strengths
        if law is not None and law.law not in LAWS:
            msg = f"motor.law: {law.law!r} is not known to the links engine; use {', '.join(LAWS)}, or engine: yade"
            raise InputError(msg)

    @property
    def present(self) -> bool:
        return self._law is not None

    @property
    def updates_at_once(self) -> int:
        return UPDATES

    @property
    def articulated(self) -> bool:
        return self._world.articulated

    def articulate(self) -> None:
        world = self._world
        if world.articulated:
            return
        assert self._law is not None  # the engine was built for scenes that never articulate
        if world.motors is None:
            world.motors = self._made(self._law)
        world.set_articulated(True)
        engage(world.shapes, world.bodies, world.motors)
        world.motors.due[1] = -1

    def weld(self) -> None:
        world = self._world
        if world.articulated:
            assert world.motors is not None
            world.totals[0] += release(world.shapes, world.bodies, world.motors)
            world.set_articulated(False)

    def actuate(self, targets: Array, interval: float) -> None:
        """Set the schedule: angles (U, N, 2) [rad] at the ends of U control periods, and their length [s].

        The first control update is made in the next step, between forces and kick.
        """
        world = self._world
        assert world.motors is not None  # only articulated smarticles are actuated
        world.motors = world.motors._replace(
            interval=float(interval),
            period=max(1, round(interval / world.time_step)),
            targets=np.ascontiguousarray(targets, dtype=np.float64),
        )
        world.motors.due[:] = 0

    @property
    def readings(self) -> MotorReadings | None:
        motors = self._world.motors
        if motors is None:
            return None
        return MotorReadings(
            schedule=motors.schedule.copy(),
            commands=motors.command.copy(),
            torques=motors.torque.copy(),
            work=motors.work.copy(),
            halted=motors.halted.copy(),
        )

    @property
    def work(self) -> float:
        world = self._world
        if world.motors is None:
            return 0.0
        return float(world.motors.work.sum())

    def gaps(self) -> Array:
        """Return zeros (N, 2), since hinges are rigid."""
        return np.zeros((self._world.count, 2))

    def _made(self, law: MotorLaw) -> Motoring:
        n = self._world.count
        factors = np.ones((n, 2)) if self._strengths is None else np.asarray(self._strengths, dtype=np.float64)
        return Motoring(
            law=LAWS.index(law.law),
            speed=float(law.speed_limit),
            limit=law.torque_limit * factors,
            stiffness=law.stiffness * factors,
            damping=float(law.damping),
            command=np.zeros((n, 2)),
            pace=np.zeros((n, 2)),
            schedule=np.zeros((n, 2)),
            torque=np.zeros((n, 2)),
            work=np.zeros((n, 2)),
            halted=np.zeros((n, 2), dtype=np.bool_),
            momentum=np.zeros((n, 2)),
            impulse=np.zeros((n, 2)),
            elapsed=np.zeros(1),
            interval=0.0,
            period=0,
            targets=np.zeros((1, n, 2)),
            due=np.array([0, -1]),
            over=np.zeros(n, dtype=np.int64),
        )

    # -- checkpoints -------------------------------------------------------------------------------------------

    @property
    def arrays(self) -> dict[str, Array]:
        """Arrays of the motors' state by name, for `restore`; empty before the first articulation."""
        motors, found = self._world.motors, {}
        if motors is not None:
            found = {name: value for name, value in motors._asdict().items() if isinstance(value, np.ndarray)}
            found["period"] = np.array([motors.interval, motors.period])
        return found

    def restore(self, arrays: dict[str, Array]) -> None:
        """Restore the state of motors that `arrays` returned; the bodies must be restored before."""
        world = self._world
        world.motors = None
        if "command" in arrays:
            assert self._law is not None  # a checkpoint belongs to its scene
            made, (interval, period) = self._made(self._law), arrays["period"]
            kept: dict[str, Any] = {name: arrays[name] for name in arrays if name in made._fields}
            world.motors = made._replace(**{**kept, "interval": float(interval), "period": int(period)})
