"""A body of rigid links that are joined end to end: geometry, joints, and the motion of its motors."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from dem.arrays import Array
from dem.body.bars import Bars
from dem.body.linear import applied, matrix_product
from dem.errors import InputError

Three = tuple[float, float, float]
Law = Literal["free", "elastic", "motor"]


@dataclass(frozen=True, kw_only=True)
class Joint:
    """Joint between a link and the link after it.

    Frames of links have x along the link and z along its normal. At angles of 0 the frames of both links are parallel.
    """

    #: Unit vectors about which the links turn, in their common frame at angles of 0. One: a hinge; two at right angles:
    #: the first is fixed in the link before, the second in the link after; three: the links turn about any direction
    axes: tuple[Three, ...]
    law: Law = "free"
    stiffness: float = 0.0  #: Stiffness of the elastic joint, or of the motor about its command [N m/rad]
    damping: float = 0.0  #: Damping of the joint, or of a motor's angle against its command [N m s/rad]
    #: Angles at which an elastic joint has no torque; of three axes the components of a rotation vector [rad]
    rest: Three = (0.0, 0.0, 0.0)
    poured: Three = (0.0, 0.0, 0.0)  #: Angles at the start, which motors hold; in the form of `rest` [rad]
    most: float = math.inf  #: Torque at which an elastic joint yields, or torque limit of a motor [N m]
    breaks: float = math.inf  #: Moment in any direction at which an elastic joint breaks [N m]
    speed: float = math.inf  #: Greatest speed of a motor's command [rad/s]

    def vector(self, angles: Three) -> Array:
        """Return the rotation vector (3,) of angles about the axes [rad], the sum of angle times axis."""
        return np.asarray((np.array(angles)[: len(self.axes), None] * np.array(self.axes)).sum(axis=0))

    @property
    def turn(self) -> Array:
        """(3, 3) rotation from the frame of the link after to that of the link before, at the start."""
        if len(self.axes) > 2:
            return np.asarray(Rotation.from_rotvec(self.vector(self.poured)).as_matrix())
        found = np.eye(3)
        for axis, angle in zip(self.axes, self.poured, strict=False):
            found = matrix_product(found, Rotation.from_rotvec(angle * np.array(axis)).as_matrix())
        return found


@dataclass(frozen=True, kw_only=True)
class Linkage:
    """One kind of linkage: n links and the n - 1 joints between them."""

    links: tuple[Bars, ...]  #: The links, each along x of its own frame, with its middle at the origin
    joints: tuple[Joint, ...]  #: Joint k is between the links k and k + 1
    pin_stiffness: float | None = None  #: Stiffness of springs between ends of links [N/m]; None: twice a contact's

    @cached_property
    def effective_mass(self) -> float:
        """Typical effective mass of a contact [kg]: the mean over the links, as if each were by itself."""
        return float(np.mean([link.effective_mass for link in self.links]))

    @property
    def has_motors(self) -> bool:
        """Whether any joint has a motor."""
        return any(joint.law == "motor" for joint in self.joints)

    @cached_property
    def places(self) -> Array:
        """(n - 1,) distances of the joints from the start of the first link, along the links [m]."""
        return np.cumsum([float(link.lengths[0]) for link in self.links])[:-1]


@dataclass(frozen=True, kw_only=True)
class Swing:
    """Motion of one motor about one axis: its command is centre + amplitude sin(ψ + phase)."""

    joint: int  #: Number of the joint, from 0
    axis: int = 0  #: Number of its axis, from 0
    centre: float | None = None  #: Mean of the command [rad]; None: the angle at the start
    amplitude: float = 0.0  #: Greatest distance of the command from its mean [rad]
    phase: float = 0.0  #: Phase against ψ [rad]


@dataclass(frozen=True, kw_only=True)
class Undulation:
    """Gait of the motors of linkages: swings of given joints, and a wave along all other joints."""

    rate: float  #: Rate at which ψ, the angle of wave and swings, grows [rad/s]
    amplitude: float = 0.0  #: Amplitude of the wave, about the first axis of each motor [rad]
    wavelength: float = math.inf  #: Length of the wave over that of the linkage [1]
    swings: Sequence[Swing] = ()  #: Motions of single motors; their joints do not follow the wave
    reversal_rate: float = 0.0  #: Mean number of reversals of ψ per second, at random times; 0: none [1/s]
    together: bool = False  #: Whether ψ of all linkages begins at 0, not at random

    def swings_of(self, linkage: Linkage) -> list[Swing]:
        """Return the swings of all motors of a linkage: those of `swings`, and those of the wave."""
        given = {swing.joint for swing in self.swings}
        whole = sum(float(link.lengths[0]) for link in linkage.links)
        return [
            *self.swings,
            *(
                Swing(joint=k, amplitude=self.amplitude, phase=-2 * math.pi * place / (whole * self.wavelength))
                for k, (joint, place) in enumerate(zip(linkage.joints, linkage.places, strict=True))
                if joint.law == "motor" and k not in given
            ),
        ]


def link_of(length: float, *, thickness_normal: float, thickness_in_plane: float, density: float, disc: bool) -> Bars:
    """Return a link of a length [m] with a section of two thicknesses [m]; `disc`: whether it is round."""
    return Bars(
        points=np.array([[[-length / 2, 0.0, 0.0], [length / 2, 0.0, 0.0]]]),
        normals=np.array([[0.0, 0.0, 1.0]]),
        thickness_normal=thickness_normal,
        thickness_in_plane=thickness_in_plane,
        density=density,
        round=disc,
    )


def layout_of(lengths: Sequence[float], joints: Sequence[Joint]) -> tuple[Array, Array]:
    """Return both ends (n, 2, 3) [m] and the normals (n, 3) of the links of a linkage as it is poured.

    Lengths of the n links are in [m]; InputError unless there are n - 1 joints.
    """
    if len(joints) != len(lengths) - 1:
        raise InputError(
            f"joints: {len(joints)} for {len(lengths)} links; give one for all, or a list of {len(lengths) - 1}"
        )
    frame, place, points, normals = np.eye(3), np.zeros(3), [], []
    for k, length in enumerate(lengths):
        if k:
            frame = matrix_product(frame, joints[k - 1].turn)
        end = place + length * frame[:, 0]
        points.append([place, end])
        normals.append(applied(frame, np.array([[0.0, 0.0, 1.0]]))[0])
        place = end
    return np.array(points), np.array(normals)
