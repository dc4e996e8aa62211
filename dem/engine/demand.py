"""What a scene asks of an engine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from dem.body.particle import Particle
from dem.engine.effect import EffectName
from dem.physics.contact import ContactLaw, contact_law
from dem.setting.contact import Contact
from dem.setting.container import Cylinder
from dem.setting.fidelity import Fidelity
from dem.setting.hooks import Hooks
from dem.setting.motor import Motor
from dem.setting.plane import Channel
from dem.setting.recording import Recording
from dem.setting.smarticle import Smarticle


class Demand(Protocol):
    """A scene, as far as an engine has to know it: what is given, and what phases call for, not what they are."""

    @property
    def smarticle(self) -> Smarticle:
        """Geometry and material of one smarticle."""

    @property
    def count(self) -> int:
        """N."""

    @property
    def hooks(self) -> Hooks | None:
        """Hooks in the pile."""

    @property
    def contact(self) -> Contact:
        """Friction and restitution."""

    @property
    def motor(self) -> Motor:
        """The motors of the hinges."""

    @property
    def gravity_m_per_s2(self) -> float:
        """Gravity, g [m/s²]."""

    @property
    def fidelity(self) -> Fidelity:
        """Accuracy against cost."""

    @property
    def recording(self) -> Recording:
        """Frames and series."""

    @property
    def particle(self) -> Particle:
        """One smarticle as the engine sees it."""

    @property
    def cylinder(self) -> Cylinder:
        """The container as it is to be built."""

    @property
    def channel(self) -> Channel | None:
        """Table and walls, where motion is confined to a plane."""

    @property
    def torque_limit(self) -> float:
        """τ_max [N m]."""

    @property
    def motor_strengths(self) -> NDArray[np.float64] | None:
        """(N, 2) factors on what the motors can do [1]; None where all are alike."""

    @property
    def actuates(self) -> bool:
        """Whether motors act in any phase."""

    @property
    def pulled_by(self) -> Sequence[tuple[float, float]]:
        """Stiffness [N/m] and damping [N s/m] of the strings of each phase that pulls by some."""

    def calls_for(self, effect: EffectName) -> bool:
        """Whether a phase calls for an effect."""


def contact_law_of(scene: Demand) -> ContactLaw:
    """Return the contact law of a scene, the same on all engines."""
    return contact_law(scene.particle, scene.contact, scene.fidelity.stiffness_N_per_m)
