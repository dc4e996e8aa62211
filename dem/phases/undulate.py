"""The phase in which the motors of chains bend them."""

import math
from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from dem.body.linkage import Linkage, Swing, Undulation
from dem.engine.interface import Engine
from dem.phases.phase import SceneView, TimedPhase, spans_of_wave
from dem.setting.hooks import TOLERANCE
from dem.setting.joints import BENT, Bend
from dem.setting.part import Duration, Part
from dem.setting.span import Span

Amplitude = Annotated[float, Field(ge=0, le=BENT)]


class JointMotion(Part):
    """Motion of one motor: centre + amplitude sin(2π f t + phase)."""

    joint: int = Field(..., ge=0, lt=199, description="number of the joint, from 0 [1]")
    axis: int = Field(0, ge=0, le=2, description="number of its axis, from 0 [1]")
    centre_deg: Bend | None = Field(None, description="angle about which it swings [deg]; default: that at the start")
    amplitude_deg: Amplitude = Field(0.0, description="amplitude [deg]")
    phase_deg: float = Field(0.0, ge=-1e6, le=1e6, description="phase [deg]")

    @property
    def swing(self) -> Swing:
        """Motion with its angles in radians."""
        return Swing(
            joint=self.joint,
            axis=self.axis,
            centre=None if self.centre_deg is None else math.radians(self.centre_deg),
            amplitude=math.radians(self.amplitude_deg),
            phase=math.radians(self.phase_deg),
        )


class Undulate(Part, TimedPhase):
    """Bend chains by their motors: a wave travels along each chain, or motors swing as a table says.

    The motion goes on in later phases until the next `undulate` or `relax`.
    """

    bends: ClassVar[frozenset[str]] = frozenset({"chain"})
    type: Literal["undulate"]
    duration_s: Duration = Field(..., description="length of the phase [s]")
    frequency_hz: float = Field(1.0, ge=0, le=1e4, description="periods per second; 0: motors hold still [Hz]")
    amplitude_deg: Amplitude = Field(
        0.0, description="amplitude of the wave, about the first axis of each motor that `joints` does not name [deg]"
    )
    wavelength_lengths: float | None = Field(
        None,
        ge=1e-3,
        le=1e6,
        description="wavelength over the length of the chain [1]; the wave travels from the first link to the last "
        "one; default: all motors swing together",
    )
    joints: tuple[JointMotion, ...] = Field(
        (), max_length=597, description="motions of single motors instead of the wave"
    )
    turns_between_reversals: float | None = Field(
        None,
        ge=1e-3,
        le=1e6,
        description="mean number of periods between two reversals of the motion, at random times [1]; default: none",
    )
    starts: Literal["random", "together"] = Field(
        "random", description="random: each chain begins at a random point of the period; together: all at its start"
    )
    ramp_s: float = Field(0.2, ge=0, le=1e6, description="time in which angles grow from those at the start [s]")

    def check(self, scene: SceneView, index: int) -> Iterator[str]:
        assert scene.mixture is not None  # the scene was checked
        linkages = [kind.linkage for kind in scene.mixture.kinds if kind.linkage is not None]
        key = f"phases.{index}"
        if not any(linkage.has_motors for linkage in linkages):
            yield f"{key}: undulate needs motors, but no joint has law: motor; give one, or leave the phase out"
        places = [(motion.joint, motion.axis) for motion in self.joints]
        for number, (motion, place) in enumerate(zip(self.joints, places, strict=True)):
            if (first := places.index(place)) < number:
                yield (
                    f"{key}.joints.{number}: joint {motion.joint}, axis {motion.axis} moves by joints.{first} already; "
                    "leave one of them out"
                )
            for linkage in linkages:
                yield from _of_motion(f"{key}.joints.{number}", motion, linkage)
        for linkage in linkages:
            yield from self._of_swings(key, linkage)

    def _of_swings(self, key: str, linkage: Linkage) -> Iterator[str]:
        named = {(motion.joint, motion.axis): f"joints.{number}." for number, motion in enumerate(self.joints)}
        for swing in self.undulation.swings_of(linkage):
            joint, where = linkage.joints[swing.joint], named.get((swing.joint, swing.axis), "")
            centre = joint.poured[swing.axis] if swing.centre is None else swing.centre
            farthest = math.degrees(abs(centre) + swing.amplitude)
            if farthest > BENT * (1 + TOLERANCE):
                yield (
                    f"{key}.{where}amplitude_deg: {math.degrees(swing.amplitude):g}° about {math.degrees(centre):g}° "
                    f"bends joint {swing.joint} by {farthest:g}°; keep within {BENT:g}°"
                )
            fastest = 2 * math.pi * self.frequency_hz * swing.amplitude
            if fastest > joint.speed * (1 + TOLERANCE):
                yield (
                    f"{key}.{where}amplitude_deg: {math.degrees(swing.amplitude):g}° at {self.frequency_hz:g} Hz needs "
                    f"{fastest:.3g} rad/s at joint {swing.joint}, whose speed_limit_rad_per_s is {joint.speed:g}; "
                    "swing less or slower"
                )

    def spans(self) -> Iterator[Span]:
        swings = any((self.amplitude_deg, *(motion.amplitude_deg for motion in self.joints)))
        yield from spans_of_wave(self.frequency_hz if swings else 0.0, self.ramp_s)

    @property
    def undulation(self) -> Undulation:
        """Gait of the motors, with angles in radians."""
        turns = self.turns_between_reversals
        return Undulation(
            rate=2 * math.pi * self.frequency_hz,
            amplitude=math.radians(self.amplitude_deg),
            wavelength=math.inf if self.wavelength_lengths is None else self.wavelength_lengths,
            swings=tuple(motion.swing for motion in self.joints),
            reversal_rate=0.0 if turns is None else self.frequency_hz / turns,
            together=self.starts == "together",
        )

    def act(self, engine: Engine) -> None:
        assert engine.filaments is not None  # the scene was checked
        engine.filaments.act(self.undulation, ramp=self.ramp_s)


def _of_motion(key: str, motion: JointMotion, linkage: Linkage) -> Iterator[str]:
    """Yield errors about the motion of one motor in a kind of chain."""
    number = len(linkage.joints)
    if motion.joint >= number:
        yield f"{key}.joint: there is no joint {motion.joint} in a chain of {number + 1} links; use 0 to {number - 1}"
        return
    joint = linkage.joints[motion.joint]
    if joint.law != "motor":
        yield f"{key}.joint: joint {motion.joint} has no motor, but law: {joint.law}; give it one, or leave it out"
    if motion.axis >= len(joint.axes):
        yield (
            f"{key}.axis: joint {motion.joint} has no axis {motion.axis}, but {len(joint.axes)} of them; use 0 to "
            f"{len(joint.axes) - 1}"
        )
