"""A scene as far as other simulators can be told: given poses that rest, are shaken, and lose their wall."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dem.body.state import State
from dem.errors import InputError
from dem.phases.relax import Relax
from dem.phases.remove_container import RemoveContainer
from dem.phases.shake import Shake
from dem.phases.take_over import TakeOver, poses_of
from dem.physics.contact import ContactLaw, contact_law
from dem.plan.steps import time_steps
from dem.scene.scene import Scene

Array = NDArray[np.float64]
PassivePhase = TakeOver | Relax | Shake | RemoveContainer

# Sphere diameters. Piles at rest are 0.02 deep at most; what is deeper was poured as something else, and flies apart
# where nobody stops it: 0.2 and more from links.
DEEPEST = 0.05


@dataclass(frozen=True)
class PassiveScene:
    """What is told.

    Args:
        scene: the scene.
        phases: its phases.
        time_step: of all of them [s].
        law: of contacts.
        state: the smarticles at the beginning, at rest.
    """

    scene: Scene
    phases: Sequence[PassivePhase]
    time_step: float
    law: ContactLaw
    state: State

    @property
    def turns(self) -> Array:
        """(N, 3, 3) body frame to laboratory frame."""
        own = self.scene.particle.boxes.link_rotations[1]
        turns: Array = self.state.link_rotations[:, 1] @ own.T
        return turns

    @property
    def inertias(self) -> Array:
        """(N, 3, 3) about the centres of mass, laboratory axes [kg m²]."""
        turns = self.turns
        tensors: Array = turns @ np.diag(self.scene.particle.boxes.inertia) @ np.swapaxes(turns, 1, 2)
        return tensors

    @property
    def spheres(self) -> Array:
        """(N, S, 3) centres of the spheres [m]."""
        return self.state.spheres(self.scene.particle)

    @property
    def sphere_masses(self) -> Array:
        """(S,) [kg] that add up to a smarticle's mass, balanced about its centre, so that weight does not turn it.

        As near to equal as that goes: those of least squares.
        """
        particle = self.scene.particle
        count = len(particle.centres)
        # Of each sphere: its share of the mass, and of the first moments, which are to vanish.
        rows = np.concatenate([np.ones((1, count)), particle.centres.T / particle.boxes.middle_length])
        wanted = np.array([particle.boxes.mass, 0.0, 0.0, 0.0])
        equal = np.full(count, particle.boxes.mass / count)
        masses: Array = equal + np.linalg.pinv(rows) @ (wanted - rows @ equal)
        return masses


def passive(scene: Scene, target: str) -> PassiveScene:
    """A scene as it is told to another simulator, `target`.

    Raises:
        InputError: it has what cannot be told, all of it by name; or its poses are those of another engine.
    """
    found = list(_foreign(scene))
    if found:
        msg = (
            f"cannot be carried over to {target}: {'; '.join(found)}; leave that out, or run the scene here "
            "(smarticles run)"
        )
        raise InputError(msg)
    first, *others = scene.phases
    assert isinstance(first, TakeOver)  # all others were named
    first.ready(scene)
    poses = poses_of(scene, first.taken)
    turns, still = np.array([turn.as_matrix() for turn in poses.rotations]), np.zeros_like(poses.positions)
    told = PassiveScene(
        scene=scene,
        phases=[first, *(phase for phase in others if isinstance(phase, Relax | Shake | RemoveContainer))],
        time_step=min(time_steps(scene)),
        law=contact_law(scene.particle, scene.contact, scene.fidelity.stiffness_N_per_m),
        state=State.rigid(scene.particle.boxes, poses.positions, turns, still, still),
    )
    _check_depths(told, target)
    return told


def _foreign(scene: Scene) -> Iterator[str]:
    """What other simulators cannot be told, by key and name."""
    if scene.smooth:
        yield f"engine: {scene.engine} takes links as they are, a deck has chains of spheres (use engine: yade)"
    if scene.plane is not None:
        yield "plane: motion in a plane"
    if scene.hooks is not None:
        yield "hooks"
    if scene.cylinder.upper:
        yield "container.tiers"
    for index, phase in enumerate(scene.phases):
        if isinstance(phase, RemoveContainer) and phase.speed_m_per_s is not None:
            yield f"phases.{index}.speed_m_per_s: a wall that is lifted (use null, gone at once)"
        elif phase.actuates:
            yield f"phases.{index} ({phase.kind}): motors"
        elif phase.pours:
            yield f"phases.{index} ({phase.kind}): a pour (run it here, and begin with take-over of that run)"
        elif not isinstance(phase, PassivePhase):
            yield f"phases.{index} ({phase.kind})"


def _check_depths(told: PassiveScene, target: str) -> None:
    diameter = told.scene.sphere_diameter
    spheres = told.spheres
    owners = np.repeat(np.arange(len(spheres)), spheres.shape[1])
    pairs = cKDTree(spheres.reshape(-1, 3)).query_pairs(diameter * (1 - DEEPEST), output_type="ndarray")
    deep = pairs[owners[pairs[:, 0]] != owners[pairs[:, 1]]]
    if len(deep):
        first = told.phases[0]
        assert isinstance(first, TakeOver)
        msg = (
            f"phases.0.run: {len(deep)} pairs of spheres in {first.taken} overlap by more than {DEEPEST:g} diameters, "
            f"as those of another engine or fidelity do, and would fly apart in {target}; run this scene's take-over "
            "and a relax phase here (engine: yade), and take over that run"
        )
        raise InputError(msg)
