"""A flexible body: a round rod that stretches, bends and twists, and may bend by itself in a liquid."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from dem.arrays import Array
from dem.errors import InputError

LEAST_NODES = 3  # one place that bends


@dataclass(frozen=True, kw_only=True)
class Liquid:
    """A liquid at rest, which filaments are immersed in.

    Raises:
        InputError: a number is negative or not finite.
    """

    viscosity: float  #: μ [Pa s]
    density: float  #: [kg/m³]

    def __post_init__(self) -> None:
        _check(viscosity=self.viscosity, density=self.density)


@dataclass(frozen=True, kw_only=True, eq=False)
class PreferredCurvature:
    """The curvature that a filament bends to by itself: a wave along it, whose plane turns about its axis.

    At inner node k and time t the two components in the frame of the filament's material are
    amplitude_k (cos(ψ + phase_k), sin(ψ + phase_k)), with dψ/dt = ± rate; the sign changes at random times. Phases that
    grow along the filament make a helix. γ = rate/(2π reversal_rate) is the mean number of turns between reversals.

    Raises:
        InputError: a number is not finite, or the reversal rate is negative.
    """

    amplitudes: float | Array  #: [1/m], one for all inner nodes or (nodes - 2,)
    phases: float | Array = 0.0  #: [rad], one for all inner nodes or (nodes - 2,)
    rate: float = 0.0  #: α [rad/s]
    reversal_rate: float = 0.0  #: λ, mean number of reversals per second; 0: none [1/s]

    def __post_init__(self) -> None:
        _check(reversal_rate=self.reversal_rate)
        for name in ("amplitudes", "phases", "rate"):
            if not np.isfinite(getattr(self, name)).all():
                raise InputError(f"{name}: {getattr(self, name)}; give finite numbers")


@dataclass(frozen=True, kw_only=True)
class Activity:
    """How filaments bend by themselves: a wave of preferred curvature that travels along them and turns."""

    curvature: float  #: Amplitude [1/m]
    wavelength: float = math.inf  #: [m]; infinite: equal along the filament
    rate: float = 0.0  #: α, rate at which the plane of the wave turns about the filament [rad/s]
    reversal_rate: float = 0.0  #: λ, mean number of reversals per second; 0: none [1/s]


class FilamentEnergies(NamedTuple):
    """Energies of all filaments [J]; work since the start."""

    kinetic: float  #: Of nodes and of rolling, half a step before
    potential: float  #: Weight less buoyancy times height above z = 0
    stretching: float
    bending: float  #: Against the preferred curvature
    twisting: float
    damped: float  #: Taken by internal damping; summed only where the engine keeps a ledger
    dragged: float  #: Taken by the liquid's drag
    active: float  #: Given by changes of the preferred curvature
    gripped: float  #: Given by grips

    @property
    def elastic(self) -> float:
        """Of stretched, bent and twisted filaments [J]."""
        return self.stretching + self.bending + self.twisting

    @property
    def stored(self) -> float:
        """[J]."""
        return self.kinetic + self.potential + self.stretching + self.bending + self.twisting

    @property
    def residual(self) -> float:
        """What is stored, less what was given, plus what was taken; constant without contacts [J]."""
        return self.stored + self.damped + self.dragged - self.active - self.gripped


@dataclass(frozen=True, kw_only=True, eq=False)
class Filament:
    """One kind of flexible filament: nodes at equal distances along a round rod, straight unless it is told otherwise.

    A stiffness that is left out follows from Young's modulus. Damping is that of a Kelvin–Voigt material: stress is
    E (ε + τ dε/dt), with a time τ for stretching and twisting, whose waves are fast, and another one for bending.

    Raises:
        InputError: a number is out of its range, or neither a modulus nor the three stiffnesses are there.
    """

    nodes: int  #: n, at least 3
    length: float  #: L, from the first node to the last; round caps reach by half a diameter beyond [m]
    diameter: float  #: d [m]
    density: float  #: [kg/m³]
    young_modulus: float | None = None  #: E [Pa]
    poisson_ratio: float = 0.5  #: [1]
    stretching_stiffness: float | None = None  #: EA [N]
    bending_stiffness: float | None = None  #: EI [N m²]
    twisting_stiffness: float | None = None  #: GJ [N m²]
    stretching_time: float = 0.0  #: τ of stretching and twisting [s]
    bending_time: float = 0.0  #: τ of bending [s]
    curvature: PreferredCurvature | None = None  #: None: it prefers to be straight
    liquid: Liquid | None = None  #: None: no buoyancy, no drag
    #: Torque per length and rate that resists rolling about its own axis, besides the liquid's: that of bristles [N s]
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
        """[m]."""
        return self.length / (self.nodes - 1)

    @property
    def area(self) -> float:
        """A [m²]."""
        return math.pi * self.diameter**2 / 4

    @property
    def second_moment(self) -> float:
        """I of the section about a diameter [m⁴]."""
        return math.pi * self.diameter**4 / 64

    @property
    def mass(self) -> float:
        """Of the whole filament, without caps [kg]."""
        return self.density * self.area * self.length

    @property
    def masses(self) -> Array:
        """(nodes,) at the nodes [kg]: each end has half of what an inner node has."""
        found = np.full(self.nodes, self.mass / (self.nodes - 1))
        found[[0, -1]] /= 2
        return found

    @property
    def effective_mass(self) -> float:
        """Typical effective mass of a contact [kg]: a push at s moves two nodes by (1 - s)²/m and s²/m, 2/3 in mean."""
        return 1.5 * self.mass / (self.nodes - 1)

    @property
    def axial_inertia(self) -> float:
        """Moment of inertia of one segment about its own axis [kg m²]."""
        return self.density * 2 * self.second_moment * self.segment_length

    @property
    def stiffnesses(self) -> tuple[float, float, float]:
        """EA [N], EI [N m²] and GJ [N m²]."""
        modulus = self.young_modulus or 0.0
        shear = modulus / (2 * (1 + self.poisson_ratio))
        by_modulus = modulus * self.area, modulus * self.second_moment, shear * 2 * self.second_moment
        given = (self.stretching_stiffness, self.bending_stiffness, self.twisting_stiffness)
        stretching, bending, twisting = (a if a is not None else b for a, b in zip(given, by_modulus, strict=True))
        return stretching, bending, twisting

    @property
    def stiffest(self) -> tuple[float, float, float]:
        """Squares of the greatest frequencies of stretching, bending and twisting [1/s²].

        In these modes neighbouring nodes, or segments, move against each other.
        """
        length, (stretching, bending, twisting) = self.segment_length, self.stiffnesses
        mass, inertia = self.mass / (self.nodes - 1), self.axial_inertia
        return 4 * stretching / length / mass, 16 * bending / length**3 / mass, 4 * twisting / length / inertia

    @property
    def drags(self) -> tuple[float, float, float]:
        """Force per length and speed across and along the axis [Pa s], torque per length and rate of roll [N s].

        Source: 4πμ/(ln(L/d) + 1/2) across and half of it along, slender bodies at low Reynolds number, Cox, J. Fluid
        Mech. 44, 791 (1970); πμd² for a cylinder that turns about its axis.
        """
        if self.liquid is None:
            return 0.0, 0.0, self.roll_drag
        across = 4 * math.pi * self.liquid.viscosity / (math.log(self.length / self.diameter) + 0.5)
        return across, across / 2, self.roll_drag + math.pi * self.liquid.viscosity * self.diameter**2

    @property
    def weight_share(self) -> float:
        """Weight in the liquid over weight [1]."""
        return 1.0 if self.liquid is None else 1.0 - self.liquid.density / self.density


def _check(**values: float) -> None:
    for name, value in values.items():
        if not 0 <= value < math.inf:
            raise InputError(f"{name}: {value:g}; give a number of 0 or above")
