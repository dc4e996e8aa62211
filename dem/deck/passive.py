"""A scene as far as other simulators can be told: given poses that rest, are shaken, and lose their wall."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dem.body.state import State
from dem.engine.demand import contact_law_of
from dem.errors import InputError
from dem.phases.relax import Relax
from dem.phases.remove_container import RemoveContainer
from dem.phases.shake import Shake
from dem.phases.take_over import TakeOver, poses_of
from dem.physics.contact import ContactLaw
from dem.plan.steps import time_steps
from dem.scene.rules import foreign
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
    def spheres(self) -> Array:
        """(N, S, 3) centres of the spheres [m]."""
        return self.state.spheres(self.scene.particle)


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
        law=contact_law_of(scene),
        state=State.rigid(scene.particle.boxes, poses.positions, turns, still, still),
    )
    _check_depths(told, target)
    return told


def _foreign(scene: Scene) -> Iterator[str]:
    """What other simulators cannot be told, by key and name."""
    if scene.smooth:
        yield f"engine: {scene.engine} takes links as they are, a deck has chains of spheres (use engine: yade)"
    yield from foreign(scene)
    for index, phase in enumerate(scene.phases):
        if phase.pours:
            yield f"phases.{index} ({phase.kind}): a pour (run it here, and begin with take-over of that run)"
        elif not phase.actuates and not isinstance(phase, PassivePhase):
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
