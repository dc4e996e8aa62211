"""What contacts and hinges dissipate, sampled: YADE's viscoelastic law does not keep a ledger of it.

A sample works out, for every contact, how much of the work done on it in one step is neither stored in its springs at
the end of the step nor given back, from the force that acts in the step and the velocity that moves the bodies in it.
Summed over the steps of a run, work and stored energy then differ by this and by what the scheme itself gains or loses,
mostly where contacts begin in the middle of a step. Only every so many steps are sampled, and stand for those between.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.engine.yade.assembly import Assembly
from dem.engine.yade.library import Yade

Array = NDArray[np.float64]


Velocities = Mapping[tuple[int, int], tuple[float, float, float]]


@dataclass(frozen=True)
class Contacts:
    """M contacts in one step.

    Args:
        normals: (M, 3) from the first body to the second [1].
        before: (M, 3) velocity of the second body against the first at the contact point, before the step [m/s].
        after: (M, 3) the same after it, which moves the bodies [m/s].
        overlaps: (M,) [m].
        viscous: (M,) normal viscous force of the step, positive where bodies approach [N].
        shear: (M, 3) elastic shear force [N].
        stiffness: (M, 2) normal and tangential [N/m].
        damping: (M, 2) normal and tangential [N s/m].
        friction: (M,) Coulomb coefficient [1].
    """

    normals: Array
    before: Array
    after: Array
    overlaps: Array
    viscous: Array
    shear: Array
    stiffness: Array
    damping: Array
    friction: Array

    @property
    def elastic_energy(self) -> float:
        """Energy in all springs of contacts [J]."""
        kn, ks = self.stiffness.T
        return float(0.5 * (kn * self.overlaps**2).sum() + 0.5 * ((self.shear**2).sum(axis=1) / ks).sum())

    def dissipated(self, time_step: float) -> float:
        """Energy dissipated by all contacts in one step [J].

        Args:
            time_step: dt [s].
        """
        kn, ks = self.stiffness.T
        cn, cs = self.damping.T
        closing, sliding = self._split(self.after)
        closed, slid = self._split(self.before)
        # The contact never pulls.
        pressed = np.maximum(kn * self.overlaps + self.viscous, 0.0)
        later = np.maximum(self.overlaps + closing * time_step, 0.0)
        # A force takes from the kinetic energy what it does along the mean of the velocities before and after.
        normal = pressed * (closed + closing) / 2 * time_step - 0.5 * kn * (later**2 - self.overlaps**2)

        strength = np.linalg.norm(self.shear, axis=1)
        # YADE scales the force of a sliding contact to the limit exactly, and adds the dashpot only where it sticks.
        sticks = strength < self.friction * pressed * (1 - 1e-9)
        force = self.shear + np.where(sticks, cs, 0.0)[:, None] * slid
        trial = self.shear + (ks * time_step)[:, None] * sliding
        limit = self.friction * np.maximum(kn * later + cn * closing, 0.0) * (later > 0)
        stored = np.minimum(np.linalg.norm(trial, axis=1), limit)
        work = np.einsum("mi,mi->m", force, (slid + sliding) / 2) * time_step
        shear = work - 0.5 * (stored**2 - strength**2) / ks
        return float(normal.sum() + shear.sum())

    def _split(self, velocities: Array) -> tuple[Array, Array]:
        """Speed of approach (M,) and velocity of the first body along the second (M, 3) [m/s]."""
        closing = -np.einsum("mi,mi->m", velocities, self.normals)
        return closing, -(velocities + closing[:, None] * self.normals)


class Meter:
    """Samples contacts and hinges of a running simulation.

    Args:
        yade: the simulation.
        assembly: the smarticles in it.
    """

    def __init__(self, yade: Yade, assembly: Assembly) -> None:
        self._yade = yade
        self._assembly = assembly

    def velocities(self) -> Velocities:
        """Relative velocities at all contacts, to be taken before the step that is sampled [m/s]."""
        found = {}
        for contact in self._contacts():
            v = contact.geom.incidentVel(contact, False)
            found[contact.id1, contact.id2] = (v[0], v[1], v[2])
        return found

    def dissipated(self, before: Velocities, time_step: float) -> float:
        """Energy dissipated in the step that was just made [J].

        Args:
            before: `velocities` before that step.
            time_step: dt [s].
        """
        loss = self.contacts(before).dissipated(time_step)
        if self._assembly.hinges is not None:
            loss += self._assembly.hinges.damped(time_step)
        return loss

    def contacts(self, before: Velocities) -> Contacts:
        """All contacts; one that is new has no velocity in `before`, and counts with its present one."""
        rows = []
        for contact in self._contacts():
            geom, phys = contact.geom, contact.phys
            n, v, s = geom.normal, geom.incidentVel(contact, False), phys.shearForce
            after = (v[0], v[1], v[2])
            earlier = before.get((contact.id1, contact.id2), after)
            law = (phys.Fv, phys.kn, phys.ks, phys.cn, phys.cs, phys.tangensOfFrictionAngle)
            depth = geom.penetrationDepth
            if math.isnan(depth):
                # YADE does not save it; until the next step the spring's force tells.
                depth = phys.Fn / phys.kn
            rows.append((n[0], n[1], n[2], *earlier, *after, s[0], s[1], s[2], depth, *law))
        table = np.array(rows).reshape(-1, 19)
        normals, first, last, shear, rest = np.split(table, (3, 6, 9, 12), axis=1)
        # An overlap that is negative belongs to a contact that has just ended.
        overlaps = np.maximum(rest[:, 0], 0.0)
        return Contacts(normals, first, last, overlaps, rest[:, 1], shear, rest[:, 2:4], rest[:, 4:6], rest[:, 6])

    def _contacts(self) -> Iterator[Any]:
        return contacts_of(self._yade, self._assembly)


def contacts_of(yade: Yade, assembly: Assembly) -> Iterator[Any]:
    """YADE's interactions that are contacts; the others are bonds of hinges."""
    smarticle_of = assembly.smarticle_of
    for interaction in yade.omega.interactions:
        if interaction.isReal and (interaction.id1 in smarticle_of or interaction.id2 in smarticle_of):
            yield interaction
