"""Laws of contacts and strings, and the damping that gives a coefficient of restitution."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from dem.body.kinds import Body
from dem.setting.contact import Contact


@dataclass(frozen=True, kw_only=True)
class ContactLaw:
    """Parameters of contacts: linear springs, dashpots and Coulomb friction."""

    normal_stiffness: float  #: Normal stiffness kn [N/m]
    tangential_stiffness: float  #: Tangential stiffness ks [N/m]
    normal_damping: float  #: Normal damping cn between bodies [N s/m]
    wall_damping: float  #: Normal damping cn at boundaries [N s/m]
    tangential_damping: float  #: Tangential over normal damping, cs/cn [1]
    friction: float  #: Coulomb coefficient between bodies [1]
    wall_friction: float  #: Coulomb coefficient at boundaries [1]

    def scaled(self, *, springs: float = 1.0, dashpots: float = 1.0) -> ContactLaw:
        """Return the law with all springs and all dashpots multiplied by factors [1]."""
        return replace(
            self,
            normal_stiffness=springs * self.normal_stiffness,
            tangential_stiffness=springs * self.tangential_stiffness,
            normal_damping=dashpots * self.normal_damping,
            wall_damping=dashpots * self.wall_damping,
        )


def typical_effective_mass(body: Body) -> float:
    """Return the effective mass [kg] of a body at a contact, averaged over spheres and directions.

    The average is a harmonic mean. The inverse of the effective mass at a point r from the centre of mass in the
    direction n is the mobility 1/m + (r × n)·I⁻¹(r × n). The mean of the mobility over n is a third of its trace.
    """
    if body.filament is not None:  # only what is near the contact gives way
        return body.filament.effective_mass
    if body.linkage is not None:
        return body.linkage.effective_mass
    inverse = 1.0 / body.inertia
    x, y, z = body.centres.T
    rotation = (inverse[0] * (y**2 + z**2) + inverse[1] * (x**2 + z**2) + inverse[2] * (x**2 + y**2)) / 3
    return float(1.0 / np.mean(1.0 / body.mass + rotation))


def restitution_of(damping_ratio: float) -> float:
    """Return the coefficient of restitution [1] of a linear spring and dashpot, at a damping ratio ζ [1].

    The contact never pulls: it ends when its force is zero, before its overlap is zero.

    Source: Schwager and Pöschel, Granular Matter 9, 465 (2007): with ω = √(1 - ζ²) in units of the undamped frequency,
    e = exp[-(ζ/ω)(π - arg(ω² - ζ² + 2iζω))] for ζ < 1, and its continuation above.
    """
    zeta = damping_ratio
    if zeta < 1:
        omega = math.sqrt(1 - zeta**2)
        return math.exp(-zeta / omega * (math.pi - math.atan2(2 * zeta * omega, omega**2 - zeta**2)))
    if zeta == 1:
        return math.exp(-2)
    omega = math.sqrt(zeta**2 - 1)
    return float(((zeta + omega) / (zeta - omega)) ** (-zeta / omega))


def damping_ratio(restitution: float) -> float:
    """Return the damping ratio ζ [1] of a coefficient of restitution [1], inverse to `restitution_of`."""
    if restitution == 1:
        return 0.0
    return float(brentq(lambda zeta: restitution_of(zeta) - restitution, 0.0, 1e4, xtol=1e-14))


def contact_law(body: Body, contact: Contact, stiffness: float) -> ContactLaw:
    """Return the contact law of a body for a scene's contact parameters and a normal stiffness kn [N/m].

    The damping is such that collisions have `contact.restitution`, at the typical effective mass of two bodies, or of a
    body and the container.
    """
    single = typical_effective_mass(body)
    zeta = damping_ratio(contact.restitution)
    return ContactLaw(
        normal_stiffness=stiffness,
        tangential_stiffness=stiffness * contact.tangential_stiffness_ratio,
        normal_damping=2 * zeta * math.sqrt(stiffness * single / 2),
        wall_damping=2 * zeta * math.sqrt(stiffness * single),
        tangential_damping=contact.tangential_damping_ratio,
        friction=contact.friction_smarticle,
        wall_friction=contact.friction_wall,
    )


@dataclass(frozen=True, kw_only=True)
class StringLaw:
    """Law of a string: a spring with a dashpot that pulls and never pushes."""

    length: float  #: Unstretched length [m]
    stiffness: float  #: Stiffness while taut [N/m]
    damping: float  #: Damping coefficient while taut [N s/m]

    def tension(self, length: float, rate: float) -> float:
        """Return the tension [N] at a length [m] that grows at a rate [m/s]; 0 while the string is slack."""
        stretch = length - self.length
        return max(0.0, self.stiffness * stretch + self.damping * rate) if stretch > 0 else 0.0
