"""A flexible body: a round rod that stretches, bends and twists, and may bend actively, in a liquid."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from dem.arrays import Array
from dem.errors import InputError

LEAST_NODES = 3  # one place that bends


@dataclass(frozen=True, kw_only=True)
class Liquid:
    """A liquid at rest, in which filaments are immersed; InputError if a number is negative or not finite."""

    viscosity: float  #: Dynamic viscosity μ [Pa s]
    density: float  #: [kg/m³]

    def __post_init__(self) -> None:
        _check(viscosity=self.viscosity, density=self.density)


@dataclass(frozen=True, kw_only=True, eq=False)
class PreferredCurvature:
    """Curvature of a filament without loads: a wave along it, whose plane turns about its axis.

    At inner node k and time t the two components of curvature in the frame of the filament's material are
    amplitude_k (cos(ψ + phase_k), sin(ψ + phase_k)), with dψ/dt = ± rate; the sign changes at random times. Phases that
    grow along the filament make a helix. γ = rate/(2π reversal_rate) is the mean number of turns between reversals.
    InputError if a number is not finite, or the reversal rate is negative.
    """

    amplitudes: float | Array  #: Amplitude [1/m]: a number for all inner nodes, or (nodes - 2,)
    phases: float | Array = 0.0  #: Phase [rad]: a number for all inner nodes, or (nodes - 2,)
    rate: float = 0.0  #: α, rate at which ψ rises or falls [rad/s]
    reversal_rate: float = 0.0  #: λ, mean number of reversals of the turn per second; 0: none [1/s]

    def __post_init__(self) -> None:
        _check(reversal_rate=self.reversal_rate)
        for name in ("amplitudes", "phases", "rate"):
            if not np.isfinite(getattr(self, name)).all():
                raise InputError(f"{name}: {getattr(self, name)}; give finite numbers")


@dataclass(frozen=True, kw_only=True)
class Activity:
    """Active bending of filaments: a wave of preferred curvature along them, whose plane turns."""

    curvature: float  #: Amplitude of the preferred curvature [1/m]
    wavelength: float = math.inf  #: Wavelength along the filament [m]; inf: equal curvature at all nodes
    rate: float = 0.0  #: α, rate at which the plane of the wave turns about the filament [rad/s]
    reversal_rate: float = 0.0  #: λ, mean number of reversals of the turn per second; 0: none [1/s]


class FilamentEnergies(NamedTuple):
    """Present energies of all filaments, and energies exchanged with them since the start [J]."""

    kinetic: float  #: Kinetic energy of nodes and of rolling segments, half a step before the present time
    potential: float  #: Weight less buoyancy, times height above z = 0
    stretching: float  #: Elastic energy of stretching
    bending: float  #: Elastic energy of bending, 0 at the preferred curvature
    twisting: float  #: Elastic energy of twisting
    damped: float  #: Dissipated by internal damping; 0 unless the engine keeps an energy ledger
    dragged: float  #: Dissipated by the liquid's drag
    active: float  #: Work of changes of the preferred curvature
    gripped: float  #: Work of grips

    @property
    def elastic(self) -> float:
        """Elastic energy of stretching, bending and twisting [J]."""
        return self.stretching + self.bending + self.twisting

    @property
    def stored(self) -> float:
        """Present kinetic, potential and elastic energy [J]."""
        return self.kinetic + self.potential + self.stretching + self.bending + self.twisting

    @property
    def residual(self) -> float:
        """Stored and dissipated energy, less the work done [J]; constant without contacts."""
        return self.stored + self.damped + self.dragged - self.active - self.gripped


@dataclass(frozen=True, kw_only=True, eq=False)
class Filament:
    """A kind of flexible filament: nodes at equal distances along a round rod.

    A stiffness that is left out follows from Young's modulus. Damping is that of a Kelvin–Voigt material: stress is
    E (ε + τ dε/dt), with the strain ε and two relaxation times τ: one for stretching and twisting, one for bending.
    InputError if a number is out of range, or neither Young's modulus nor all three stiffnesses are given.
    """

    nodes: int  #: Number of nodes, at least 3
    length: float  #: L, from the first to the last node, without the round caps of radius d/2 [m]
    diameter: float  #: Diameter d [m]
    density: float  #: [kg/m³]
    young_modulus: float | None = None  #: Young's modulus E [Pa]
    poisson_ratio: float = 0.5  #: [1]
    stretching_stiffness: float | None = None  #: EA [N]
    bending_stiffness: float | None = None  #: EI [N m²]
    twisting_stiffness: float | None = None  #: GJ [N m²]
    stretching_time: float = 0.0  #: Relaxation time τ of stretching and twisting [s]
    bending_time: float = 0.0  #: Relaxation time τ of bending [s]
    curvature: PreferredCurvature | None = None  #: Preferred curvature; None: straight
    liquid: Liquid | None = None  #: Liquid around the filament; None: no buoyancy, no drag
    #: Torque per length and rate of rolling about the axis, e.g. of bristles, in addition to the liquid's drag [N s]
    roll_drag: float = 0.0

    def __post_init__(self) -> None:
        if self.nodes < LEAST_NODES:
            raise InputError(f"nodes: {self.nodes}; give {LEAST_NODES} at least")
        for name in ("length", "diameter", "density"):
            if not 0 < getattr(self, name) < math.inf:
                raise InputError(f"{name}: {getattr(self, name):g}; give a number above 0")
        given = (self.stretching_stiffness, self.bending_stiffness, self.twisting_stiffness)
        if self.young_modulus is None and None in given:
            raise InputError("young_modulus: is left out; give it, or stiffnesses of stretching, bending and twisting")
        for name in ("young_modulus", "stretching_stiffness", "bending_stiffness", "twisting_stiffness"):
            value = getattr(self, name)
            if value is not None and not 0 < value < math.inf:
                raise InputError(f"{name}: {value:g}; give a number above 0")
        _check(stretching_time=self.stretching_time, bending_time=self.bending_time, roll_drag=self.roll_drag)
        if not -1 < self.poisson_ratio <= 0.5:
            raise InputError(f"poisson_ratio: {self.poisson_ratio:g}; give a number above -1 and up to 0.5")
        if self.liquid is not None and self.length <= self.diameter:
            raise InputError(
                f"length: {self.length:g} m; the drag of slender bodies needs more than the diameter, "
                f"{self.diameter:g} m: make it longer, or leave out the liquid"
            )
        if self.curvature is not None:
            for name in ("amplitudes", "phases"):
                shape = np.shape(getattr(self.curvature, name))
                if shape not in ((), (self.nodes - 2,)):
                    raise InputError(f"{name}: shape {shape}; give one number, or {self.nodes - 2}, one per inner node")

    @property
    def segment_length(self) -> float:
        """Distance between neighbouring nodes at rest [m]."""
        return self.length / (self.nodes - 1)

    @property
    def area(self) -> float:
        """Area A of the section [m²]."""
        return math.pi * self.diameter**2 / 4

    @property
    def second_moment(self) -> float:
        """Second moment of area I of the section about a diameter [m⁴]."""
        return math.pi * self.diameter**4 / 64

    @property
    def mass(self) -> float:
        """Mass of the filament, without its round caps [kg]."""
        return self.density * self.area * self.length

    @property
    def masses(self) -> Array:
        """(nodes,) masses of the nodes [kg]; an end node has half the mass of an inner node."""
        found = np.full(self.nodes, self.mass / (self.nodes - 1))
        found[[0, -1]] /= 2
        return found

    @property
    def effective_mass(self) -> float:
        """Typical effective mass of the filament at a contact [kg].

        A force at the place s (0 to 1) along a segment acts on two nodes of mass m. The mobility there is
        ((1 - s)² + s²)/m, with the mean 2/(3 m) over s.
        """
        return 1.5 * self.mass / (self.nodes - 1)

    @property
    def axial_inertia(self) -> float:
        """Moment of inertia of one segment about its own axis [kg m²]."""
        return self.density * 2 * self.second_moment * self.segment_length

    @property
    def stiffnesses(self) -> tuple[float, float, float]:
        """Stiffnesses of stretching EA [N], bending EI [N m²] and twisting GJ [N m²]."""
        modulus = self.young_modulus or 0.0
        shear = modulus / (2 * (1 + self.poisson_ratio))
        by_modulus = modulus * self.area, modulus * self.second_moment, shear * 2 * self.second_moment
        given = (self.stretching_stiffness, self.bending_stiffness, self.twisting_stiffness)
        stretching, bending, twisting = (a if a is not None else b for a, b in zip(given, by_modulus, strict=True))
        return stretching, bending, twisting

    @property
    def stiffest(self) -> tuple[float, float, float]:
        """Squares of the highest angular frequencies of stretching, bending and twisting [1/s²].

        In these modes neighbouring nodes, or segments, move in opposite directions.
        """
        length, (stretching, bending, twisting) = self.segment_length, self.stiffnesses
        mass, inertia = self.mass / (self.nodes - 1), self.axial_inertia
        return 4 * stretching / length / mass, 16 * bending / length**3 / mass, 4 * twisting / length / inertia

    @property
    def drags(self) -> tuple[float, float, float]:
        """Drag coefficients, for motion across and along the axis [Pa s] and for rolling about it [N s].

        They are force per length and speed, and torque per length and rate of rolling.

        Source: Cox, J. Fluid Mech. 44, 791 (1970), slender bodies at low Reynolds number: 4πμ/(ln(L/d) + 1/2) across,
        and half of this along; πμd² for a cylinder that turns about its axis.
        """
        if self.liquid is None:
            return 0.0, 0.0, self.roll_drag
        across = 4 * math.pi * self.liquid.viscosity / (math.log(self.length / self.diameter) + 0.5)
        return across, across / 2, self.roll_drag + math.pi * self.liquid.viscosity * self.diameter**2

    @property
    def weight_share(self) -> float:
        """Weight less buoyancy, over weight [1]."""
        return 1.0 if self.liquid is None else 1.0 - self.liquid.density / self.density


def _check(**values: float) -> None:
    for name, value in values.items():
        if not 0 <= value < math.inf:
            raise InputError(f"{name}: {value:g}; give a number of 0 or above")
