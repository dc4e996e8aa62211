"""The energy ledger on YADE: energy added, work and dissipation.

YADE's viscoelastic law does not sum its dissipation, which is therefore sampled. A sample takes, for every contact, the
work that the bodies do against the contact's force in one step, less the increase of the energy in its springs. A
sampled step stands for all steps up to the next sample. The ledger's residual is then the error of the sampling and of
the integration scheme, mostly where contacts begin in the middle of a step.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from dem.arrays import Array
from dem.engine.yade.assembly import Assembly
from dem.engine.yade.boundaries import YadeBoundaries
from dem.engine.yade.contacts import contacts_of
from dem.engine.yade.library import Yade

Velocities = Mapping[tuple[int, int], tuple[float, float, float]]
_SUMS = ("container_work", "added", "dissipated")


@dataclass(frozen=True)
class Contacts:
    """M contacts of pairs of bodies in one time step."""

    normals: Array  #: (M, 3) unit vectors from the first body to the second [1]
    before: Array  #: (M, 3) velocities of second bodies relative to first bodies at the contacts before the step [m/s]
    after: Array  #: (M, 3) velocities of second bodies relative to first bodies at the contacts after the step [m/s]
    overlaps: Array  #: (M,) overlaps [m]
    viscous: Array  #: (M,) normal viscous forces of the step, positive where bodies approach [N]
    shear: Array  #: (M, 3) elastic tangential forces [N]
    stiffness: Array  #: (M, 2) normal and tangential stiffness [N/m]
    damping: Array  #: (M, 2) normal and tangential damping [N s/m]
    friction: Array  #: (M,) Coulomb coefficients [1]

    @property
    def elastic_energy(self) -> float:
        """Energy in all springs of contacts [J]."""
        kn, ks = self.stiffness.T
        return float(0.5 * (kn * self.overlaps**2).sum() + 0.5 * ((self.shear**2).sum(axis=1) / ks).sum())

    def dissipated(self, time_step: float) -> float:
        """Return the energy [J] that all contacts dissipate in a step dt [s]."""
        kn, ks = self.stiffness.T
        cn, cs = self.damping.T
        closing, sliding = self._split(self.after)
        closed, slid = self._split(self.before)
        # The contact never pulls.
        pressed = np.maximum(kn * self.overlaps + self.viscous, 0.0)
        later = np.maximum(self.overlaps + closing * time_step, 0.0)
        # The work of a force in a step is that along the mean of the velocities before and after.
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
        """Return approach speeds (M,) and tangential velocities (M, 3) at the contacts [m/s].

        Tangential velocities are those of first bodies relative to second bodies.

        Args:
            velocities: (M, 3) velocities of second bodies relative to first bodies [m/s].
        """
        closing = -np.einsum("mi,mi->m", velocities, self.normals)
        return closing, -(velocities + closing[:, None] * self.normals)


class YadeLedger:
    """`dem.engine.interface.EnergyLedger` on YADE.

    Args:
        works: whether to sum the work of moving boundaries.
        dissipation_interval: time between samples of the dissipation [s]; None: no samples.
    """

    def __init__(
        self,
        yade: Yade,
        assembly: Assembly,
        boundaries: YadeBoundaries,
        *,
        works: bool,
        dissipation_interval: float | None,
    ) -> None:
        self.container_work = self.added = self.dissipated = 0.0
        self._yade = yade
        self._assembly = assembly
        self._boundaries = boundaries
        self._works = works
        self._interval = dissipation_interval
        self._time_step, self._every = 0.0, 0
        self._owed = False  # whether the next step finds contacts of which `take_in` was told

    def set_time_step(self, time_step: float) -> None:
        """Set the length of all further steps [s]."""
        self._time_step = time_step
        self._every = max(1, round(self._interval / time_step)) if self._interval else 0

    def step(self, number: int, advance: Callable[[], None]) -> None:
        """Make the step numbered `number` by calling `advance`, and add its work and dissipation to the sums."""
        if not self._every or number % self._every:
            advance()
        else:
            before = self._velocities()
            advance()
            loss, hinges = self._contacts(before).dissipated(self._time_step), self._assembly.hinges
            if hinges is not None:
                loss += hinges.damped(self._time_step)
            self.dissipated += self._every * loss
        if self._owed:
            self._owed = False
            self.added += self.elastic()[0]
        if self._works and self._boundaries.moving:
            self.container_work += self._boundaries.power() * self._time_step

    def elastic(self) -> tuple[float, float]:
        return self._contacts({}).elastic_energy, self._assembly.elastic_energy()

    def take_in(self) -> None:
        self._owed = True

    @property
    def given(self) -> float:
        return math.nan if self._boundaries.moving and not self._works else self.added + self.container_work

    def book_removal(self, remove: Callable[[], None]) -> None:
        """Call `remove`, which removes contacts; the elastic energy of these contacts counts as dissipated."""
        stored = self.elastic()[0] if self._every else 0.0
        remove()
        if self._every:
            self.dissipated += stored - self.elastic()[0]

    def _velocities(self) -> Velocities:
        """Return the relative velocities at all contacts [m/s], by the ids of the two bodies."""
        found = {}
        for contact in contacts_of(self._yade, self._assembly):
            v = contact.geom.incidentVel(contact, False)
            found[contact.id1, contact.id2] = (v[0], v[1], v[2])
        return found

    def _contacts(self, before: Velocities) -> Contacts:
        """Return all contacts after a step.

        Args:
            before: relative velocities before the step, by the ids of the two bodies. For a contact that is absent,
                the velocity after the step is used instead.
        """
        rows = []
        for contact in contacts_of(self._yade, self._assembly):
            geom, phys = contact.geom, contact.phys
            n, v, s = geom.normal, geom.incidentVel(contact, False), phys.shearForce
            after = (v[0], v[1], v[2])
            earlier = before.get((contact.id1, contact.id2), after)
            law = (phys.Fv, phys.kn, phys.ks, phys.cn, phys.cs, phys.tangensOfFrictionAngle)
            depth = geom.penetrationDepth
            if math.isnan(depth):
                # After loading, since YADE does not save depths; until the next step the spring's force gives it.
                depth = phys.Fn / phys.kn
            rows.append((n[0], n[1], n[2], *earlier, *after, s[0], s[1], s[2], depth, *law))
        table = np.array(rows).reshape(-1, 19)
        normals, first, last, shear, rest = np.split(table, (3, 6, 9, 12), axis=1)
        # A contact that has just ended has a negative overlap.
        overlaps = np.maximum(rest[:, 0], 0.0)
        return Contacts(normals, first, last, overlaps, rest[:, 1], shear, rest[:, 2:4], rest[:, 4:6], rest[:, 6])

    @property
    def memory(self) -> dict[str, float]:
        return {name: getattr(self, name) for name in _SUMS}

    def restore(self, memory: Mapping[str, float]) -> None:
        self.container_work, self.added, self.dissipated = (memory[name] for name in _SUMS)
