"""Joints between the links of a chain: part of the key `particle` of a scene."""

import math
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import BeforeValidator, Field, model_validator

from dem.body.linkage import Joint, Three
from dem.errors import shown
from dem.setting.part import Part, Turning, as_list

BENT = 150.0  # deg, largest angle at rest or of a motor: beyond it, links would lie on each other
ACROSS = 1e-6  # largest cosine of the angle between two axes that count as perpendicular

Direction = tuple[float, float, float]
Number = Annotated[int, Field(ge=1, le=3)]
Bend = Annotated[float, Field(ge=-BENT, le=BENT)]
Torque = Annotated[float, Field(ge=1e-15, le=1e6)]  # N m
Damping = Annotated[float, Field(ge=0, le=1e6)]  # N m s/rad
_USUAL: tuple[Direction, ...] = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))


def _axes(value: Any) -> Any:
    if isinstance(value, int) and not isinstance(value, bool) and 1 <= value <= len(_USUAL):
        return _USUAL[:value]
    if not isinstance(value, list | tuple) or not all(isinstance(each, list | tuple) for each in value):
        raise ValueError(f"got {shown(value)}; give 1, 2 or 3, or a list of one or two directions such as [[0, 0, 1]]")
    if tuple(map(tuple, value)) != _USUAL and not 1 <= len(value) <= 2:
        raise ValueError(
            f"{len(value)} directions; give one (a hinge) or two (the second fixed in the link after), or the number "
            "3: links that turn about any axis"
        )
    return value


Axes = Annotated[tuple[Direction, ...], BeforeValidator(_axes, json_schema_input_type=Number | list[Direction])]
Bends = Annotated[tuple[Bend, ...], BeforeValidator(as_list, json_schema_input_type=Bend | list[Bend])]


class _Joint(Part):
    axes: Axes = Field(
        _USUAL[:1],
        description="axes about which the links turn: 1, a hinge about the normal; 2, about the normal of the link "
        "before and across the link after; 3, about any axis; or one or two directions (x along the link, z its "
        "normal)",
    )
    poured_deg: Bends | None = Field(
        None,
        max_length=3,
        description="angles at the start: one number, or one for each axis; for three axes a rotation vector [deg]; "
        "default: those at rest of an elastic joint, otherwise 0; motors hold them",
    )

    @classmethod
    def nearest_key(cls, key: str) -> str:
        """Return advice about an unknown key: the laws that have it, or else the advice for any part."""
        having = [kind for kind in _Joint.__subclasses__() if key in kind.known_keys()]
        laws = " or ".join(get_args(kind.model_fields["law"].annotation)[0] for kind in having)
        return f"it belongs in law: {laws}" if laws else super().nearest_key(key)

    @model_validator(mode="after")
    def _possible(self) -> Self:
        for number, axis in enumerate(self.axes):
            if not math.hypot(*axis) > 0:
                raise ValueError(f"axes.{number}: a direction of length 0; give e.g. [0, 0, 1]")
        if len(self.axes) == 2:
            one, two = self._directions
            cosine = abs(sum(a * b for a, b in zip(one, two, strict=True)))
            if cosine > ACROSS:
                raise ValueError(
                    f"axes: {math.degrees(math.acos(min(1.0, cosine))):.3g}° apart; two axes must be at right angles"
                )
        for key in ("poured_deg", "rest_angle_deg"):
            values = getattr(self, key, None) or ()
            if len(values) > len(self.axes):
                raise ValueError(f"{key}: {len(values)} angles for {len(self.axes)} axes; give one for each axis")
        return self

    @property
    def _directions(self) -> tuple[Three, ...]:
        """Directions of the axes, of length 1."""
        return tuple((x / n, y / n, z / n) for x, y, z in self.axes for n in [math.hypot(x, y, z)])

    @property
    def _poured(self) -> Three:
        return _radians(self.poured_deg or ())

    def joint(self) -> Joint:
        """Return the joint of a `dem.body.linkage.Linkage`."""
        raise NotImplementedError


def _radians(degrees: tuple[float, ...]) -> Three:
    first, second, third = (math.radians(angle) for angle in (*degrees, *(0.0,) * (3 - len(degrees))))
    return first, second, third


class FreeJoint(_Joint):
    """Joint without torque: links turn freely about its axes."""

    law: Literal["free"]

    def joint(self) -> Joint:  # noqa: D102 - as in the base class
        return Joint(axes=self._directions, poured=self._poured)


class ElasticJoint(_Joint):
    """Torsional spring with a dashpot about each axis; with three axes, one against the whole rotation."""

    law: Literal["elastic"]
    stiffness_N_m_per_rad: float = Field(..., gt=0, le=1e6, description="stiffness about each axis [N m/rad]")
    damping_N_m_s_per_rad: Damping = Field(0.0, description="damping about each axis [N m s/rad]")
    rest_angle_deg: Bends = Field(
        (0.0,), max_length=3, description="angles without torque, one number or one for each axis [deg]; 0: straight"
    )
    yield_N_m: Torque | None = Field(
        None, description="torque of the spring above which its rest angle gives way [N m]; default: none"
    )
    break_N_m: Torque | None = Field(
        None,
        description="moment in any direction above which the joint breaks: its links then hang on each other, free "
        "about all axes [N m]; default: none",
    )

    def joint(self) -> Joint:  # noqa: D102
        rest = _radians(self.rest_angle_deg)
        return Joint(
            axes=self._directions,
            law="elastic",
            stiffness=self.stiffness_N_m_per_rad,
            damping=self.damping_N_m_s_per_rad,
            rest=rest,
            poured=rest if self.poured_deg is None else self._poured,
            most=math.inf if self.yield_N_m is None else self.yield_N_m,
            breaks=math.inf if self.break_N_m is None else self.break_N_m,
        )


class MotorJoint(_Joint):
    """Motor about each axis, which turns the links towards its command with a limited torque."""

    law: Literal["motor"]
    torque_limit_N_m: Torque = Field(..., description="greatest torque [N m]; of three axes in any direction")
    stiffness_N_m_per_rad: float = Field(
        ..., gt=0, le=1e6, description="torque over the angle by which the links lag behind the command [N m/rad]"
    )
    damping_N_m_s_per_rad: Damping = Field(0.0, description="torque over the rate of change of this angle [N m s/rad]")
    speed_limit_rad_per_s: Turning = Field(6.0, description="greatest speed of the command [rad/s]")

    def joint(self) -> Joint:  # noqa: D102
        return Joint(
            axes=self._directions,
            law="motor",
            stiffness=self.stiffness_N_m_per_rad,
            damping=self.damping_N_m_s_per_rad,
            poured=self._poured,
            most=self.torque_limit_N_m,
            speed=self.speed_limit_rad_per_s,
        )


AnyJoint = Annotated[FreeJoint | ElasticJoint | MotorJoint, Field(discriminator="law")]
