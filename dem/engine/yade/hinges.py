"""Hinges between the links of articulated smarticles, made of YADE's bonds.

A hinge consists of two bonds: a pin, a spring of length zero that holds the two links together at the hinge's centre;
and a shaft along the hinge's axis, which transmits the motor's torque, keeps the two links in one plane, and damps the
pin's vibrations. Both act between nodes, which have no contacts.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from dem.arrays import Array
from dem.body.particle import Boxes
from dem.engine.yade.library import Yade

HINGE_MATERIAL = "hinge"
NODE_RADIUS = 1e-4  # m; has no effect on forces, but YADE needs a radius
OFFSET = 1e-9  # m; a spring of exactly zero length has no direction
SHAFT_STIFFNESS = 1e-3  # N/m along the axis, small since the pin takes this force
SHAFT_FORCE = 1e-4  # N along the axis; YADE takes the torque cap of a slipping shaft as a multiple of this force
# YADE integrates rotations to first order, which adds energy to the pin's fast vibrations: without damping they grow
# within a second after a hard impact. A damper, a spring and a dashpot in series, removes this energy and does not
# affect slow motion.
DAMPER_SHARE = 0.25  # stiffness of the damper's spring over that of the pin
DAMPER_VISCOSITY = 0.15  # N s/m; at the stiffness of the named fidelities the damper relaxes within a few time steps
DAMPER_TIME = 4e-5  # s; least relaxation time with stiffer pins, since a step must not relax more than the whole force
UPDATES_PER_TILT = 10  # control updates between corrections of the tilt's drift
# Turning a barb inwards (α up) turns barb 1 and barb 2 in opposite directions about the smarticle's normal.
SENSE = np.array([1.0, -1.0])
BARBS = (0, 2)  # links that hinge 1 and hinge 2 join to the middle link


@dataclass(frozen=True, kw_only=True)
class HingeLaw:
    """Stiffness and damping of the hinges."""

    pin_stiffness: float  #: Stiffness against a gap between the links [N/m]
    tilt_stiffness: float  #: Stiffness against rotation of a link out of the common plane [N m/rad]
    shaft_stiffness: float  #: Twist stiffness of the motor's shaft [N m/rad]
    torque_cap: float | None  #: Torque at which a shaft slips [N m]; None: shafts do not slip
    shaft_damping: float = 0.0  #: Derivative gain of the motors [N m s/rad]; only the stable time step uses it
    damper_time: float = DAMPER_TIME  #: Least relaxation time of the dampers [s], at least a time step

    @property
    def damper_stiffness(self) -> float:
        """Stiffness of the damper's spring, across the axis [N/m]."""
        return DAMPER_SHARE * self.pin_stiffness

    @property
    def damper_viscosity(self) -> float:
        """Viscosity of the damper's dashpot [N s/m]."""
        return max(DAMPER_VISCOSITY, self.damper_stiffness * self.damper_time)


def hinge_nodes(boxes: Boxes, link: int) -> Array:
    """Return (n, 3) positions of a link's hinge nodes, in the frame of the link [m].

    A barb has one hinge, at its start, with a node at the centre and one at the end of the axis, half the thickness t1
    above the plane; the middle link has a node at the centre of each of its two hinges.
    """
    half = boxes.lengths[link] / 2
    if link != 1:
        return np.array([[-half, 0.0, OFFSET], [-half, 0.0, boxes.thickness_normal / 2]])
    return np.array([[-half, 0.0, 0.0], [half, 0.0, 0.0]])


def add_nodes(yade: Yade, count: int) -> list[int]:
    """Add bodies for hinge nodes, without mass and contacts; return their ids."""
    ids = []
    for _ in range(count):
        body = yade.classes.Body()
        body.shape = yade.classes.GridNode(radius=NODE_RADIUS)
        body.material = yade.omega.materials[HINGE_MATERIAL]
        body.mask, body.bounded = 0, False
        ids.append(yade.omega.bodies.append(body))
    return ids


class Hinges:
    """All hinges of N articulated smarticles.

    Args:
        nodes: ids of the nodes of each link of each smarticle, in the order of `hinge_nodes`.
        angles: (N, 2) angles of the barbs when the bonds were made [rad].
    """

    def __init__(self, yade: Yade, law: HingeLaw, nodes: Sequence[Sequence[Sequence[int]]], angles: Array) -> None:
        self._yade = yade
        self._law = law
        self._nodes = nodes
        self._angles = angles
        self._pins: list[Any] = []
        self._shafts: list[tuple[Any, Any]] = []
        self._ends: list[tuple[Any, Any]] = []
        # Twists (2N,) [rad] and gaps (2N,) [m] at loading, since YADE computes them in each step but does not save
        # them.
        self._loaded: tuple[Array, Array] | None = None
        self._updates = 0

    def make(self, strengths: Array | None = None) -> None:
        """Make the bonds; `strengths` (N, 2): factors on stiffness and torque cap of shafts [1], None: 1."""
        factors = np.ones_like(self._angles) if strengths is None else strengths
        for (barb_centre, barb_end, middle_centre), factor in zip(self._hinges(), factors.flat, strict=True):
            self._bond(barb_centre, middle_centre, self._law.pin_stiffness)
            self._shaft(barb_end, middle_centre, float(factor))
        self.bind()

    def bind(self) -> None:
        """Look up the bonds of the hinges in YADE again, after loading has replaced them."""
        interactions = self._yade.omega.interactions
        self._pins = [interactions[centre, middle].geom for centre, _, middle in self._hinges()]
        shafts = [interactions[end, middle] for _, end, middle in self._hinges()]
        self._shafts = [(bond.geom, bond.phys) for bond in shafts]
        bodies = self._yade.omega.bodies
        self._ends = [(bodies[end].state, bodies[middle].state) for _, end, middle in self._hinges()]

    def remove(self) -> None:
        """Remove bonds and nodes."""
        for links in self._nodes:
            for node in (node for link in links for node in link):
                self._yade.omega.bodies.erase(node)
        self._pins, self._shafts, self._ends = [], [], []

    def _hinges(self) -> Iterator[tuple[int, int, int]]:
        """Yield the ids of the three nodes of each hinge, smarticle by smarticle.

        They are the barb's node at the centre of the hinge, its node at the end of the hinge's axis, and the middle
        link's node at the centre.
        """
        for links in self._nodes:
            for hinge, barb in enumerate(BARBS):
                centre, end = links[barb]
                yield centre, end, links[1][hinge]

    def _bond(self, first: int, second: int, stiffness: float) -> Any:
        bond = self._yade.utils.createInteraction(first, second)
        phys = bond.phys
        phys.kn, phys.ks, phys.kr, phys.ktw = stiffness, 0.0, 0.0, 0.0
        phys.momentRotationLaw, phys.fragile, phys.cohesionBroken = False, False, False
        phys.normalAdhesion, phys.shearAdhesion = 1e9, 0.0
        phys.maxRollPl = phys.maxTwistPl = -1.0
        phys.unp = 2 * NODE_RADIUS
        return bond

    def _shaft(self, end: int, centre: int, strength: float) -> None:
        law = self._law
        bond = self._bond(end, centre, SHAFT_STIFFNESS)
        phys = bond.phys
        phys.unp = bond.geom.penetrationDepth
        phys.momentRotationLaw, phys.ktw, phys.kr = True, strength * law.shaft_stiffness, law.tilt_stiffness
        phys.ks, phys.shearAdhesion = law.damper_stiffness, 1e9
        if law.torque_cap is not None:
            # YADE takes the cap as a multiple of the normal force, which is therefore kept constant and small.
            phys.unp -= SHAFT_FORCE / SHAFT_STIFFNESS
            phys.maxTwistPl = strength * law.torque_cap / SHAFT_FORCE

    def moved(self) -> None:
        """Use the twists and gaps that YADE computes; call this after the first step after loading.

        Until then, `angles` and `gaps` return the values that were saved.
        """
        self._loaded = None

    def _twists(self) -> Array:
        return np.array([geom.twist for geom, _ in self._shafts]) if self._loaded is None else self._loaded[0]

    def _gaps(self) -> Array:
        if self._loaded is not None:
            return self._loaded[1]
        return 2 * NODE_RADIUS - np.array([geom.penetrationDepth for geom in self._pins])

    def angles(self) -> Array:
        """Return the barbs' angles (N, 2) [rad], from the twist of the shafts."""
        return np.asarray(self._angles + SENSE * self._twists().reshape(-1, 2))

    def rates(self) -> Array:
        """Return the rates (N, 2) of the barbs' angles [rad/s], half a step before the angles."""
        up = self._yade.vector(0, 0, 1)
        turning = [(barb.angVel - middle.angVel).dot(middle.ori * up) for barb, middle in self._ends]
        return np.asarray(-SENSE * np.array(turning).reshape(-1, 2))

    def set_torques(self, torques: Array, time_step: float) -> None:
        """Set the torques of the shafts on the barbs; positive torques raise the barbs' angles.

        In every step YADE adds increments to these torques and to the moments against tilt, the rotation of a barb out
        of the smarticle's plane, so that errors add up. Each call replaces the torques. Every `UPDATES_PER_TILT` calls
        the moments against tilt are computed anew from the present orientations.

        Args:
            torques: (N, 2) torques about the hinges' axes [N m].
            time_step: dt [s].
        """
        moments = (-SENSE * torques).ravel().tolist()
        for (geom, phys), moment in zip(self._shafts, moments, strict=True):
            phys.moment_twist = geom.normal * moment
        if self._updates % UPDATES_PER_TILT == 0:
            self._set_tilts(time_step)
        self._updates += 1

    def _set_tilts(self, time_step: float) -> None:
        # The tilt is computed from the axes: YADE splits a rotation into twist and tilt by its rotation vector, which
        # is right only for small twists. The next step will add the rotation of the last step, which the axes already
        # include, so that it is subtracted here; otherwise each correction would add energy to the pins' vibrations.
        up, tilt = self._yade.vector(0, 0, 1), self._law.tilt_stiffness
        for (_, phys), (barb, middle) in zip(self._shafts, self._ends, strict=True):
            axis = barb.ori * up
            turn = (middle.angVel - barb.angVel) * time_step
            phys.moment_bending = ((middle.ori * up).cross(axis) + turn - axis * axis.dot(turn)) * tilt

    def torques(self) -> Array:
        """Return YADE's present torques (N, 2) on the barbs [N m]."""
        moments = [geom.normal.dot(phys.moment_twist) for geom, phys in self._shafts]
        return np.asarray(-SENSE * np.array(moments).reshape(-1, 2))

    def gaps(self) -> Array:
        """Return (N, 2) distances between the two links of each hinge [m]."""
        return self._gaps().reshape(-1, 2)

    def elastic_energy(self) -> float:
        """Return the elastic energy of pins, dampers and tilted shafts [J], without the twist of the shafts."""
        dampers = self._damper_forces() / self._law.damper_stiffness
        pins = self._law.pin_stiffness * (self.gaps() ** 2).sum()
        tilts = sum(phys.moment_bending.squaredNorm() for _, phys in self._shafts) / self._law.tilt_stiffness
        return float(0.5 * (pins + dampers + tilts))

    def damped(self, time_step: float) -> float:
        """Return the energy [J] that the dampers dissipate in a step dt [s]."""
        # YADE reduces a damper's force by this fraction in each step.
        loss = time_step * self._law.damper_stiffness / self._law.damper_viscosity
        return self._damper_forces() * (2 * loss - loss**2) / (2 * self._law.damper_stiffness)

    def _damper_forces(self) -> float:
        """Return the sum of the squares of all dampers' forces [N²]."""
        return float(sum(phys.shearForce.squaredNorm() for _, phys in self._shafts))

    @property
    def memory(self) -> dict[str, Any]:
        return {
            "nodes": self._nodes,
            "angles": self._angles.tolist(),
            # Not in YADE's own file.
            "twists": self._twists().tolist(),
            "gaps": self._gaps().tolist(),
            "looks": self._updates,
        }

    @classmethod
    def restored(cls, yade: Yade, law: HingeLaw, memory: Mapping[str, Any]) -> Self:
        """Return the hinges of a loaded simulation, from the `memory` that was saved with it."""
        hinges = cls(yade, law, memory["nodes"], np.array(memory["angles"]).reshape(-1, 2))
        hinges.bind()
        hinges._loaded = np.array(memory["twists"]), np.array(memory["gaps"])
        hinges._updates = memory["looks"]
        return hinges
