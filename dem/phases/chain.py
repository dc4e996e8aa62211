"""The chain of interlocked smarticles and its strain test, as data: how it is laid out, tied and pulled.

⊔-⊓-⊔: every second smarticle is turned by half a turn, and neighbouring barbs hook into each other. The chain lies
along x, its middle at the origin. Source: Savoie et al., Soft Matter 2023, "Robophysical experiment".
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator
from scipy.spatial.transform import Rotation

from dem.body.particle import Particle
from dem.body.placement import Poses
from dem.body.state import State
from dem.phases.actuation import Actuate
from dem.setting.motion import Hold
from dem.setting.part import Length, Part, refuse_wrong_unit

if TYPE_CHECKING:
    from dem.scene.scene import Scene
    from dem.setting.parts import Motor, Smarticle

Array = NDArray[np.float64]

LEAST_COUNT = 2


class Arrange(Part):
    """Lay the smarticles out as a chain, ⊔-⊓-⊔…, each hooked into the next; takes no time."""

    type: Literal["arrange"]
    gap_m: Length = Field(..., description="free distance of neighbours where they will touch first [m]")

    _length_unit = field_validator("gap_m")(refuse_wrong_unit)


class Strain(Part):
    """Pull the chain by strings at its two end barbs, one held, one moved along x, until it parts.

    The other ends of the strings are on the chain's axis. Strings pull and never push. Motors hold their angles.
    """

    type: Literal["strain"]
    speed_m_per_s: float = Field(0.005, gt=0, description="speed of the moved end [m/s]")
    distance_m: Length = Field(..., description="how far it moves at most [m]; the phase ends when the chain parts")
    tied_at: Literal["tip", "axis"] = Field(
        "tip", description="where on the end barbs: at their tips, or where they cross the chain's axis"
    )
    string_length_m: Length = Field(0.1, description="length of either string [m]")
    string_stiffness_N_per_m: float = Field(5000.0, gt=0, description="of either string when taut [N/m]")
    string_damping_N_s_per_m: float = Field(1.0, ge=0, description="of either string when taut [N s/m]")

    _length_unit = field_validator("distance_m", "string_length_m")(refuse_wrong_unit)

    @property
    def duration_s(self) -> float:
        """Length of the phase [s], unless the chain parts before."""
        return self.distance_m / self.speed_m_per_s

    def spelled_out(self, smarticle: Smarticle, motor: Motor) -> Actuate:
        """What the barbs are to do: to stay."""
        return Actuate(type="actuate", barbs=Hold(type="hold"), duration_s=self.duration_s)

    def own_key(self, key: str) -> str:
        """The key of this phase that sets `key` of the spelled-out one."""
        return "distance_m"


@dataclass(frozen=True)
class Tie:
    """Where a string is tied: smarticle, link, and distance along x from the link's centre [m]."""

    smarticle: int
    link: int
    along: float


@dataclass(frozen=True)
class Chain:
    """Layout of a chain. Lengths in m.

    Args:
        particle: one smarticle, a U.
        count: how many.
        gap: free distance of neighbours.
    """

    particle: Particle
    count: int
    gap: float

    @property
    def offset(self) -> float:
        """Distance of the two rows of middle links: the tips of each row are a gap away from the other's links."""
        return self.particle.boxes.barb_length + self.gap + self.particle.radius

    @property
    def width(self) -> float:
        """h, the whole width [m]."""
        return self.offset + 2 * self.particle.radius

    @property
    def step(self) -> float:
        """Distance of neighbouring middle links along x: their hooked barbs are a gap apart."""
        return self.particle.boxes.middle_length - 2 * self.particle.radius - self.gap

    @property
    def length(self) -> float:
        """Distance along x of the two points where strings are tied."""
        return (self.count - 1) * self.step + self.particle.boxes.middle_length

    def poses(self) -> Poses:
        """Poses of the centres of mass."""
        numbers = np.arange(self.count)
        turned = numbers % 2 == 1
        sign = np.where(turned, 1.0, -1.0)
        # From the middle link towards the mouth.
        inwards = -self.particle.boxes.vertices[1, 1]
        across = sign * (self.offset / 2 - inwards)
        along = (numbers - (self.count - 1) / 2) * self.step
        positions = np.stack([along, across, np.zeros(self.count)], axis=1)
        return Poses(positions, tuple(Rotation.from_rotvec([0.0, 0.0, math.pi * half]) for half in turned))

    def ties(self, tied_at: Literal["tip", "axis"]) -> tuple[Tie, Tie]:
        """Of the string at the lower and at the higher x, on the outer barbs; see `Strain.tied_at`."""
        half = self.particle.boxes.barb_length / 2
        along = half - self.particle.radius if tied_at == "tip" else self.offset / 2 - half
        last = self.count - 1
        return Tie(0, 0, along), Tie(last, 0 if last % 2 else 2, along)


def chain_of(scene: Scene) -> Chain:
    """The chain of a scene that begins with one."""
    first = scene.phases[0]
    assert isinstance(first, Arrange)  # the caller has asked
    return Chain(scene.particle, scene.count, first.gap_m)


def parted(state: State, diameter: float) -> bool:
    """Whether a straight line across the chain separates two neighbours, which can then not hook again."""
    places = state.vertices[..., 0]
    return bool((places[:-1].max(axis=1) + diameter < places[1:].min(axis=1)).any())


def extent(state: State, diameter: float) -> float:
    """Width of the chain across its axis, with the links' thickness [m]."""
    places = state.vertices[..., 1]
    return float(np.ptp(places) + diameter)


def check_chain(scene: Scene) -> None:
    """Check that the chain can be laid out, fits between its walls, and can reach them.

    Raises:
        ValueError: one line with key, value and the way out.
    """
    if scene.plane is None:
        return
    if scene.count < LEAST_COUNT:
        msg = f"count: {scene.count} is no chain; use at least {LEAST_COUNT}"
        raise ValueError(msg)
    if scene.smarticle.angles_deg != (90.0, 90.0):
        first, second = scene.smarticle.angles_deg
        msg = f"smarticle.angles_deg: a chain is laid out of U shapes, not of ({first:g}, {second:g}); use (90, 90)"
        raise ValueError(msg)
    chain, d = chain_of(scene), scene.sphere_diameter
    mouth = scene.smarticle.middle_length_m
    if mouth < 3 * (d + chain.gap):
        msg = (
            f"phases.0.gap_m: two barbs of {d:.4g} m and three gaps of {chain.gap:g} m do not fit into a mouth of "
            f"{mouth - d:.4g} m; use a smaller gap or thinner links"
        )
        raise ValueError(msg)
    for index, phase in enumerate(scene.phases):
        if isinstance(phase, Strain) and phase.string_length_m < chain.width:
            msg = (
                f"phases.{index}.string_length_m: {phase.string_length_m:g} m does not reach the axis from a barb of a "
                f"chain that is h = {chain.width:.4g} m wide; use at least {chain.width:.4g} m"
            )
            raise ValueError(msg)
    width = scene.plane.width_m
    if width is None:
        return
    if width <= chain.width:
        msg = (
            f"plane.width_m: H = {width:g} m leaves no room for a chain that is h = {chain.width:.4g} m wide, h/H = "
            f"{chain.width / width:.3g}; h/H must be below 1"
        )
        raise ValueError(msg)
    # Hooked tip to tip, with barbs at right angles: no opening of the servos makes a chain wider, short of one that
    # turns as a whole, whose middle links then add their share.
    widest = 2 * scene.particle.boxes.barb_length + scene.smarticle.middle_length_m
    if width > widest:
        msg = (
            f"plane.width_m: H = {width:g} m, h/H = {chain.width / width:.3g}, is beyond the stroke of the servos: the "
            f"chain gets no wider than {widest:.4g} m before it parts; use less, or leave width_m out for no walls"
        )
        raise ValueError(msg)
