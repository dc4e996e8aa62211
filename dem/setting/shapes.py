"""Shapes of bodies other than smarticles: the key `particle` of a scene."""

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal, Self, get_args

import numpy as np
from pydantic import BeforeValidator, Field, model_validator
from scipy.special import ndtri

from dem.arrays import Array
from dem.body.bars import Bars
from dem.body.filament import Filament, Liquid, PreferredCurvature
from dem.body.linkage import Linkage, layout_of, link_of
from dem.errors import InputError, nearest, shown
from dem.setting.joints import AnyJoint
from dem.setting.part import LONGEST_LENGTH, Density, Length, Part, Stiffness, as_list
from dem.strict import in_radians

SIZES = 16  # equally frequent lengths that stand in for a spread of lengths
NORMAL, IN_PLANE = 1.27e-3, 0.5e-3  # m, the section of the paper's smarticles


def _twice(value: Any) -> Any:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return (value, value) if number else value


Angle = Annotated[float, Field(ge=1, le=180)]
Turn = Annotated[float, Field(ge=-180, le=180)]
Coordinate = Annotated[float, Field(ge=-LONGEST_LENGTH, le=LONGEST_LENGTH)]
Point = tuple[Coordinate, Coordinate, Coordinate]
Number = Annotated[int, Field(ge=0, lt=400)]
Lengths = Annotated[
    tuple[Length, Length], BeforeValidator(_twice, json_schema_input_type=Length | tuple[Length, Length])
]
Angles = Annotated[tuple[Angle, Angle], BeforeValidator(_twice, json_schema_input_type=Angle | tuple[Angle, Angle])]
Turns = Annotated[tuple[Turn, Turn], BeforeValidator(_twice, json_schema_input_type=Turn | tuple[Turn, Turn])]
Segments = Annotated[int, Field(ge=2, le=200)]


class Shaped(Part):
    """Base of all shapes: section, material, and frequency in a mixture."""

    thickness_normal_m: Length | None = Field(
        None, description="thickness along the normal of a flat section [m]; default: 1.27e-3, the paper's t1"
    )
    thickness_in_plane_m: Length | None = Field(
        None, description="thickness in the plane of a flat section [m]; default: 0.5e-3, the paper's t2"
    )
    diameter_m: Length | None = Field(None, description="diameter of a round section [m]; default: a flat section")
    density_kg_per_m3: Density = Field(7850.0, description="density [kg/m³]; mass and inertia are those of the bars")
    share: float | None = Field(
        None,
        ge=0,
        le=1e6,
        description="part of all bodies that have this shape, relative to other shapes [1]; 0: none has it",
    )
    count: int | None = Field(None, ge=0, le=100_000, description="bodies of this shape, instead of a share [1]")
    spread: float = Field(
        0.0,
        ge=0,
        le=0.4,
        description="standard deviation of the body's lengths over their mean [1]; normally distributed, in 16 equally "
        "frequent sizes, whose sections are equal",
    )

    @model_validator(mode="after")
    def _makes_a_body(self) -> Self:
        if self.diameter_m is not None and (self.thickness_normal_m, self.thickness_in_plane_m) != (None, None):
            raise ValueError("diameter_m: a round section has no thicknesses; leave diameter_m or the thicknesses out")
        if self.share is not None and self.count is not None:
            raise ValueError("share: count is given too; leave one of them out")
        try:
            for factor in self.factors[[0, -1]]:
                _ = self.bars(float(factor))
        except InputError as error:
            smallest = min(np.ravel(getattr(self, "angle_deg", 0.0)), key=abs)
            raise ValueError(f"shape: {self.tag()}: {error}{in_radians(smallest)}") from None
        return self

    @property
    def absent(self) -> bool:
        """Whether the scene says that no body has this shape."""
        return self.share == 0 or self.count == 0

    @property
    def factors(self) -> Array:
        """Factors on the body's lengths [1]: `SIZES` equally frequent values, or only 1 if `spread` is 0."""
        if not self.spread:
            return np.ones(1)
        values = ndtri((np.arange(SIZES) + 0.5) / SIZES)
        return np.asarray(1 + self.spread * values / math.sqrt(float((values**2).mean())))

    def bars(self, factor: float = 1.0) -> Bars:
        """Return the body, lengths multiplied by a factor [1]; raise InputError if its bars touch or cross."""
        points, normals = self.layout()
        flat = (self.thickness_normal_m or NORMAL, self.thickness_in_plane_m or IN_PLANE)
        normal, in_plane = flat if self.diameter_m is None else (self.diameter_m, self.diameter_m)
        return Bars(
            points=factor * points,
            normals=normals,
            thickness_normal=normal,
            thickness_in_plane=in_plane,
            density=self.density_kg_per_m3,
            round=self.diameter_m is not None,
        )

    def layout(self) -> tuple[Array, Array]:
        """Return both ends (S, 2, 3) [m] and normals (S, 3) [1] of all bars, in any frame."""
        raise NotImplementedError


def _path(lengths: Sequence[float], headings: Sequence[float]) -> tuple[Array, Array]:
    """Return the layout of bars in a plane, end to end, of given lengths [m] and headings from x [rad]."""
    steps = np.array(lengths)[:, None] * np.array([[math.cos(h), math.sin(h), 0.0] for h in headings])
    corners = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    return np.stack([corners[:-1], corners[1:]], axis=1), np.tile([0.0, 0.0, 1.0], (len(steps), 1))


def _arc(radius: float, angle: float, segments: int) -> tuple[list[float], list[float]]:
    """Return lengths [m] and headings [rad] of bars along an arc, from its radius [m] and angle [rad]."""
    step = angle / segments
    return [abs(radius * step)] * segments, [(k + 0.5) * step for k in range(segments)]


class Rod(Shaped):
    """A straight rod."""

    shape: Literal["rod"]
    length_m: Length = Field(..., description="length [m]")

    def layout(self) -> tuple[Array, Array]:  # noqa: D102 - as in the base class
        return _path([self.length_m], [0.0])


class Staple(Shaped):
    """A crown with a leg at each end; legs at 90° give the U of a smarticle, without hinges."""

    shape: Literal["staple"]
    crown_m: Length = Field(..., description="length of the crown, the middle bar [m]")
    leg_m: Lengths = Field(..., description="length of the legs, one number or one for each [m]")
    angle_deg: Angles = Field(
        (90.0, 90.0), description="angle between crown and leg, one or one for each [deg]; 90: U, below: closed inwards"
    )
    twist_deg: Turns = Field(
        (0.0, 0.0), description="turn of a leg about the crown out of the plane, one or one for each [deg]"
    )

    def layout(self) -> tuple[Array, Array]:  # noqa: D102
        return _three_bars(self.crown_m, self.leg_m, self.angle_deg, self.twist_deg)


def _three_bars(
    middle: float, arms: tuple[float, float], angles: tuple[float, float], twists: tuple[float, float]
) -> tuple[Array, Array]:
    """Return the layout of a middle bar along x with an arm at each end; lengths in m.

    Angles are those between arms and middle bar, 180 straight; twists are rotations of arms about the middle bar [deg].
    """
    joints = np.array([[-middle / 2, 0.0, 0.0], [middle / 2, 0.0, 0.0]])
    bars, normals = [], []
    for joint, arm, angle, twist, sign in zip(joints, arms, angles, twists, (-1.0, 1.0), strict=True):
        # As `dem.body.particle.Boxes.directions`, whose angle is 180° less this one.
        a, t = math.radians(180.0 - angle), math.radians(twist)
        along = np.array([sign * math.cos(a), math.sin(a) * math.cos(t), math.sin(a) * math.sin(t)])
        bars.append([joint, joint + arm * along])
        normals.append([0.0, -math.sin(t), math.cos(t)])
    return np.array([bars[0], joints, bars[1]]), np.array([normals[0], [0.0, 0.0, 1.0], normals[1]])


class Z(Shaped):
    """A middle bar with arms that point to opposite sides, in one plane."""

    shape: Literal["z"]
    middle_m: Length = Field(..., description="length of the middle bar [m]")
    arm_m: Lengths = Field(..., description="length of the arms, one number or one for each [m]")
    angle_deg: Angles = Field((90.0, 90.0), description="angle between middle bar and arm, one or one for each [deg]")

    def layout(self) -> tuple[Array, Array]:  # noqa: D102
        return _three_bars(self.middle_m, self.arm_m, self.angle_deg, (0.0, 180.0))


class S(Shaped):
    """Two arcs of opposite curvature that join smoothly."""

    shape: Literal["s"]
    radius_m: Length = Field(..., description="radius of both arcs [m]")
    angle_deg: float = Field(180.0, ge=10, le=300, description="angle that each arc spans [deg]")
    segments: Segments = Field(8, description="straight bars of each arc, as long as the arc together [1]")

    def layout(self) -> tuple[Array, Array]:  # noqa: D102
        lengths, headings = _arc(self.radius_m, math.radians(self.angle_deg), self.segments)
        return _path([*lengths, *lengths], [*headings, *headings[::-1]])


class Hook(Shaped):
    """A straight shank that ends in an arc."""

    shape: Literal["hook"]
    shank_m: Length = Field(..., description="length of the straight part [m]")
    radius_m: Length = Field(..., description="radius of the arc [m]")
    angle_deg: float = Field(180.0, ge=10, le=300, description="angle that the arc spans [deg]")
    segments: Segments = Field(8, description="straight bars of the arc, as long as the arc together [1]")

    def layout(self) -> tuple[Array, Array]:  # noqa: D102
        lengths, headings = _arc(self.radius_m, math.radians(self.angle_deg), self.segments)
        return _path([self.shank_m, *lengths], [0.0, *headings])


class C(Shaped):
    """An arc of a circle."""

    shape: Literal["c"]
    radius_m: Length = Field(..., description="radius [m]")
    opening_deg: float = Field(90.0, ge=1, le=350, description="opening angle: the part of the circle left out [deg]")
    segments: Segments = Field(12, description="straight bars, as long as the arc together [1]")

    def layout(self) -> tuple[Array, Array]:  # noqa: D102
        return _path(*_arc(self.radius_m, math.radians(360.0 - self.opening_deg), self.segments))


class Ring(Shaped):
    """A closed ring."""

    shape: Literal["ring"]
    radius_m: Length = Field(..., description="radius [m]")
    segments: Annotated[int, Field(ge=3, le=200)] = Field(
        12, description="straight bars, as long as the circle together [1]"
    )

    def layout(self) -> tuple[Array, Array]:  # noqa: D102
        return _path(*_arc(self.radius_m, 2 * math.pi, self.segments))


def _from_centre(directions: Any, lengths: Any) -> tuple[Array, Array]:
    """Return the layout of arms of given directions (S, 3) and lengths (S,) [m] from the origin."""
    along = np.array(directions, dtype=np.float64)
    along /= np.linalg.norm(along, axis=1)[:, None]
    ends = np.stack([np.zeros_like(along), np.array(lengths)[:, None] * along], axis=1)
    return ends, np.array([[0.0, 0.0, 1.0] if abs(z) < 0.9 else [1.0, 0.0, 0.0] for _, _, z in along])


class Cross(Shaped):
    """Four arms in a plane from one centre."""

    shape: Literal["cross"]
    arm_m: Lengths = Field(..., description="length of the arms along either line, one number or one for each [m]")
    angle_deg: Angle = Field(90.0, description="angle between the two lines [deg]")

    def layout(self) -> tuple[Array, Array]:  # noqa: D102
        a, b = math.radians(self.angle_deg), self.arm_m
        along = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [math.cos(a), math.sin(a), 0.0], [-math.cos(a), -math.sin(a), 0.0]]
        return _from_centre(along, [b[0], b[0], b[1], b[1]])


class Star(Shaped):
    """Equal arms from one centre, evenly in space: a flat tripod, a tetrapod or a hexapod."""

    shape: Literal["star"]
    arms: Literal[3, 4, 6] = Field(6, description="number of arms: 3 in a plane, 4 a tetrapod, 6 a hexapod [1]")
    arm_m: Length = Field(..., description="length of each arm [m]")

    def layout(self) -> tuple[Array, Array]:  # noqa: D102
        half = math.sqrt(3) / 2
        along = {
            3: [[1, 0, 0], [-0.5, half, 0], [-0.5, -half, 0]],
            4: [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]],
            6: [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]],
        }[self.arms]
        return _from_centre(along, [self.arm_m] * self.arms)


class Free(Shaped):
    """Any points and bars that join them, also trees and closed rings."""

    shape: Literal["segments"]
    points_m: tuple[Point, ...] = Field(..., min_length=2, max_length=400, description="points (x, y, z) [m]")
    pairs: tuple[tuple[Number, Number], ...] = Field(
        ..., min_length=1, max_length=400, description="bars: the numbers, from 0, of the two points that each joins"
    )
    normal: Point = Field((0.0, 0.0, 1.0), description="direction of the thickness along the normal, of all bars [1]")

    def layout(self) -> tuple[Array, Array]:  # noqa: D102
        ends = np.array(self.points_m, dtype=np.float64)[np.array(self.pairs)]
        if self.diameter_m is None:
            return ends, np.tile(self.normal, (len(ends), 1))
        # Of a round bar any direction across it will do: that axis which the bar follows least.
        return ends, np.eye(3)[np.abs(ends[:, 1] - ends[:, 0]).argmin(axis=1)]

    @model_validator(mode="before")
    @classmethod
    def _joined(cls, data: Any) -> Any:
        # Before the bars are laid out, which needs points that exist.
        try:
            points, pairs = [tuple(map(float, p)) for p in data["points_m"]], [(a, b) for a, b in data["pairs"]]
        except (KeyError, TypeError, ValueError, OverflowError):
            return data  # validation of the fields reports what is wrong
        for k, pair in enumerate(pairs):
            for end in pair:
                if not (isinstance(end, int) and 0 <= end < len(points)):
                    raise ValueError(f"pairs.{k}: there is no point {shown(end)}; use 0 to {len(points) - 1}")
            if points[pair[0]] == points[pair[1]]:
                raise ValueError(f"pairs.{k}: joins a point with itself, a bar 0 m long; join two different points")
        reached = {pairs[0][0]} if pairs else set()
        for _ in pairs:
            reached |= {end for pair in pairs if reached & set(pair) for end in pair}
        apart = {end for pair in pairs for end in pair} - reached
        if apart:
            raise ValueError(f"pairs: no bars lead from point {pairs[0][0]} to {min(apart)}; a body is in one piece")
        return data


class Flexible(Shaped):
    """A round filament that stretches, bends and twists, on the engines links and yade."""

    shape: Literal["filament"]
    length_m: Length = Field(..., description="length along its axis; round caps reach beyond [m]")
    diameter_m: Length = Field(..., description="diameter [m]")
    segments: Segments = Field(12, description="straight segments, between nodes that bend [1]")
    density_kg_per_m3: Density = Field(1060.0, description="density [kg/m³]")
    young_modulus_Pa: float = Field(..., ge=1.0, le=1e12, description="E, of stretching, bending and twisting [Pa]")
    stretching_time_s: float = Field(
        0.0, ge=0, le=1.0, description="time τ of internal damping E τ dε/dt of stretching and twisting [s]"
    )
    bending_time_s: float = Field(0.0, ge=0, le=1.0, description="time τ of internal damping of bending [s]")
    roll_drag_N_s: float = Field(
        0.0,
        ge=0,
        le=1.0,
        description="torque per length and rate of rolling about the axis, as of bristles, beside the liquid's [N s]",
    )
    curvature_per_m: float = Field(
        0.0, ge=0, le=1e5, description="curvature that it prefers at rest, in a plane that turns with it [1/m]"
    )
    poured_bend_deg: float = Field(
        0.0, ge=0, le=300, description="angle of the arc as which it is poured, 0 straight [deg]"
    )

    def layout(self) -> tuple[Array, Array]:  # noqa: D102
        bend = math.radians(self.poured_bend_deg)
        if not bend:
            return _path([self.length_m / self.segments] * self.segments, [0.0] * self.segments)
        return _path(*_arc(self.length_m / bend, bend, self.segments))

    def filament(self, factor: float, liquid: Liquid | None) -> Filament:
        """Return the filament, its length multiplied by a factor [1], in a liquid; None: no liquid."""
        assert self.diameter_m is not None
        rest = PreferredCurvature(amplitudes=self.curvature_per_m) if self.curvature_per_m else None
        return Filament(
            nodes=self.segments + 1,
            length=factor * self.length_m,
            diameter=self.diameter_m,
            density=self.density_kg_per_m3,
            young_modulus=self.young_modulus_Pa,
            stretching_time=self.stretching_time_s,
            bending_time=self.bending_time_s,
            curvature=rest,
            liquid=liquid,
            roll_drag=self.roll_drag_N_s,
        )


class Chain(Shaped):
    """Rigid links joined end to end, with a law at each joint, on the engine links."""

    shape: Literal["chain"]
    links: Annotated[int, Field(ge=2, le=200)] | None = Field(
        None, description="number of links of one length [1]; default: that of the lengths in link_m"
    )
    link_m: Annotated[tuple[Length, ...], BeforeValidator(as_list, json_schema_input_type=Length | list[Length])] = (
        Field(
            ..., min_length=1, max_length=200, description="lengths of the links, from joint to joint, one or all [m]"
        )
    )
    joints: Annotated[
        tuple[AnyJoint, ...], BeforeValidator(as_list, json_schema_input_type=AnyJoint | list[AnyJoint])
    ] = Field(..., min_length=1, max_length=199, description="one joint for all places between links, or one for each")
    pin_stiffness_N_per_m: Stiffness | None = Field(
        None,
        description="stiffness of the springs that keep ends of links together, and links in line where they cannot "
        "turn [N/m]; default: twice that of contacts",
    )

    def layout(self) -> tuple[Array, Array]:  # noqa: D102
        return layout_of(self._lengths, [joint.joint() for joint in self._all_joints])

    @property
    def _lengths(self) -> tuple[float, ...]:
        number, given = self.links or len(self.link_m), self.link_m
        if len(given) not in (1, number):
            raise InputError(f"link_m: {len(given)} lengths for links: {number}; give one for all, or leave links out")
        if number < 2:
            raise InputError("links: one link is no chain; give links: 2 or more, or a list link_m")
        return given * number if len(given) == 1 else given

    @property
    def _all_joints(self) -> tuple[AnyJoint, ...]:
        return self.joints * (len(self._lengths) - 1) if len(self.joints) == 1 else self.joints

    def linkage(self, factor: float, body: Bars) -> Linkage:
        """Return links and joints, with the lengths of links multiplied by a factor [1].

        `body` is the result of `bars` for this factor.
        """
        return Linkage(
            links=tuple(
                link_of(
                    factor * length,
                    thickness_normal=body.thickness_normal,
                    thickness_in_plane=body.thickness_in_plane,
                    density=body.density,
                    disc=body.round,
                )
                for length in self._lengths
            ),
            joints=tuple(joint.joint() for joint in self._all_joints),
            pin_stiffness=self.pin_stiffness_N_per_m,
        )


AnyShape = Annotated[
    Rod | Staple | Z | S | Hook | C | Cross | Star | Ring | Free | Flexible | Chain,
    Field(discriminator="shape"),
]
SHAPES = get_args(get_args(AnyShape)[0])


def listed(value: Any) -> Any:
    """Return the unvalidated value of the key `particle` as a list of shapes; None for smarticles."""
    if value is None or value == "smarticle":
        return None
    if isinstance(value, str):
        names = [*(shape.tag() for shape in SHAPES), "smarticle"]
        if value not in names:
            raise ValueError(f"{shown(value)} is no shape; {nearest(value, names)}")
        raise ValueError(f"{value!r} needs its lengths: write {{shape: {value}, …}}; shapes are {', '.join(names)}")
    return [value] if not isinstance(value, list | tuple) else value


def numbers_of_shapes(shapes: Sequence[Shaped], count: int) -> list[int]:
    """Return the number of bodies of each shape, of `count` bodies in all.

    ValueError if counts of the shapes do not add up to `count`, or only some shapes have a count.
    """
    counts = [shape.count for shape in shapes]
    given = [number for number in counts if number is not None]
    if given:
        if len(given) < len(counts):
            raise ValueError(f"particle.{counts.index(None)}.count: missing, while other shapes have one; give all")
        if sum(given) != count:
            raise ValueError(f"count: {count} bodies, but those of particle add up to {sum(given)}; make them equal")
        return given
    shares = np.array([1.0 if shape.share is None else shape.share for shape in shapes])
    exact = count * shares / shares.sum()
    whole = np.floor(exact).astype(int)
    # Largest remainders first.
    for k in np.argsort(whole - exact, kind="stable")[: count - int(whole.sum())]:
        whole[k] += 1
    return [int(number) for number in whole]
