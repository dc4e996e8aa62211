"""MuJoCo with boxes of the true size, welded, or hinged with position servos of limited torque."""

import importlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.rivals.overlap import halves_of
from benchmarks.rivals.task import Array, Knobs, Outcome, Task, World, simulated

MIDDLE = 1  # index of the middle link
SERVO = 0.02  # deviation from the target at which a servo reaches its torque limit [rad]


def simulate(task: Task, knobs: Knobs) -> Outcome:
    """Simulate a task; `knobs`: `time_step` [s], and MuJoCo's `solver`, `iterations`, `cone`, `solref`."""
    return simulated(task, InMujoco(task, **knobs))


class InMujoco(World):
    """Simulation of free bodies whose barbs are welded or hinged."""

    def __init__(
        self, task: Task, *, time_step: float, solver: str, iterations: int, cone: str, solref: Sequence[float]
    ) -> None:
        mujoco = self._mujoco = importlib.import_module("mujoco")
        super().__init__(task, time_step, f"mujoco {mujoco.__version__}")
        self._hinged = task.actuates
        spec = mujoco.MjSpec()
        spec.option.timestep, spec.option.iterations = time_step, iterations
        spec.option.solver = getattr(mujoco.mjtSolver, f"mjSOL_{solver.upper()}")
        spec.option.cone = getattr(mujoco.mjtCone, f"mjCONE_{cone.upper()}")
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.option.gravity = [0.0, 0.0, -task.scene.gravity_m_per_s2]
        spec.compiler.boundmass = spec.compiler.boundinertia = 0.0
        spec.memory = 2**30
        friction = [task.scene.contact.friction_smarticle, 0.0, 0.0]
        self._surface = {"friction": friction, "solref": list(solref), "condim": 3}
        self._add_container(spec)
        for k in range(task.scene.count):
            self._add_smarticle(spec, k)
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        mujoco.mj_forward(self._model, self._data)

    def _add_container(self, spec: Any) -> None:
        """Add floor and walls as planes to MuJoCo's model `spec`."""
        plane = self._mujoco.mjtGeom.mjGEOM_PLANE
        spec.worldbody.add_geom(type=plane, size=[1, 1, 1], **self._surface)
        for point, inward in zip(*self.task.walls(), strict=True):
            side = np.cross([0.0, 0.0, 1.0], inward)
            frame = np.column_stack([side, np.cross(inward, side), inward])
            spec.worldbody.add_geom(type=plane, size=[1, 1, 1], pos=point, quat=_quaternion(frame), **self._surface)

    def _add_smarticle(self, spec: Any, k: int) -> None:
        """Add the three links of smarticle `k` to MuJoCo's model `spec`; hinges and servos if barbs move."""
        task, boxes, joint = self.task, self.task.boxes, self._mujoco.mjtJoint
        if not self._hinged:
            body = spec.worldbody.add_body(
                pos=task.state.positions[k], quat=_quaternion(task.turns[k]), mass=boxes.mass, inertia=boxes.inertia,
                ipos=[0, 0, 0], explicitinertial=True,
            )  # fmt: skip
            body.add_freejoint()
            for link in range(3):
                self._box(body, link, boxes.link_centres[link], boxes.link_rotations[link])
            return
        places, frames = task.state.link_positions[k], task.state.link_rotations[k]
        middle = spec.worldbody.add_body(pos=places[MIDDLE], quat=_quaternion(frames[MIDDLE]), **self._inertial(MIDDLE))
        middle.add_freejoint()
        self._box(middle, MIDDLE, np.zeros(3), np.eye(3))
        for barb in (0, 2):
            own = frames[MIDDLE].T @ frames[barb]
            place = frames[MIDDLE].T @ (places[barb] - places[MIDDLE])
            body = middle.add_body(pos=place, quat=_quaternion(own), **self._inertial(barb))
            # A positive angle turns barb 2 about the normal, and barb 1 in the opposite sense.
            axis = [0.0, 0.0, 1.0 if barb else -1.0]
            hinge = body.add_joint(
                name=f"hinge {k} {barb}", type=joint.mjJNT_HINGE, axis=axis, pos=[-boxes.barb_length / 2, 0.0, 0.0]
            )
            self._box(body, barb, np.zeros(3), np.eye(3))
            self._servo(spec, hinge.name, barb)

    def _inertial(self, link: int) -> dict[str, Any]:
        boxes = self.task.boxes
        return {
            "mass": boxes.link_masses[link],
            "inertia": boxes.link_inertias[link],
            "ipos": [0, 0, 0],
            "explicitinertial": True,
        }

    def _box(self, body: Any, link: int, centre: Array, frame: Array) -> None:
        geom = self._mujoco.mjtGeom.mjGEOM_BOX
        sides = halves_of(self.task.boxes)[link]
        body.add_geom(type=geom, size=sides, pos=centre, quat=_quaternion(frame), mass=0.0, **self._surface)

    def _servo(self, spec: Any, hinge: str, barb: int) -> None:
        """Add a position servo to MuJoCo's model `spec`, at the joint `hinge` of the link `barb`, 0 or 2.

        It is critically damped for the barb alone, with the middle link fixed.
        """
        limit, boxes = float(self.task.scene.torque_limit), self.task.boxes
        inertia = boxes.link_inertias[barb][2] + boxes.link_masses[barb] * (boxes.barb_length / 2) ** 2
        gain = limit / SERVO
        servo = spec.add_actuator(
            trntype=self._mujoco.mjtTrn.mjTRN_JOINT, target=hinge, forcelimited=True, forcerange=[-limit, limit]
        )
        servo.set_to_position(kp=gain, kv=2 * float(np.sqrt(gain * inertia)))

    def kick(self, speed: float) -> None:
        """Add a vertical velocity [m/s] to all smarticles if they are welded."""
        free = self._model.jnt_dofadr[self._model.jnt_type == self._mujoco.mjtJoint.mjJNT_FREE]
        if not self._hinged:
            self._data.qvel[free + 2] += speed

    def step(self, gravity: float, time_s: float) -> None:
        """Take one step, to the time `time_s` [s] since the activity began; 0 during the rest.

        `gravity` [m/s²] acts on welded smarticles; on hinged ones gravity is constant, and servos get the target angles
        of that time.
        """
        if not self._hinged:
            self._model.opt.gravity[2] = -gravity
        elif time_s:
            self._data.ctrl[:] = (self.task.gait.targets(time_s) - self.task.gait.start).ravel()
        self._mujoco.mj_step(self._model, self._data)

    def links(self) -> tuple[Array, Array]:
        # The last geoms are three per smarticle, starting with the middle link if hinged.
        count = 3 * self.task.scene.count
        self._mujoco.mj_kinematics(self._model, self._data)
        places = self._data.geom_xpos[-count:].reshape(-1, 3, 3)
        frames = self._data.geom_xmat[-count:].reshape(-1, 3, 3, 3)
        order = [1, 0, 2] if self._hinged else [0, 1, 2]
        return places[:, order].copy(), frames[:, order].copy()


def _quaternion(frame: Array) -> list[float]:
    """Return (w, x, y, z) of a rotation matrix."""
    quaternion: list[float] = Rotation.from_matrix(frame).as_quat()[[3, 0, 1, 2]].tolist()
    return quaternion
