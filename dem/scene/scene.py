"""The scene: parts of `dem.setting` and phases of `dem.phases` that fit together by `dem.scene.rules`."""

import hashlib
import math
from collections.abc import Mapping
from functools import cached_property
from itertools import pairwise
from typing import Any, Literal, Self, TypeVar

import numpy as np
from pydantic import (
    Field,
    ModelWrapValidatorHandler,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from dem.arrays import Array, Numbers, plain
from dem.body.kinds import Kind, Mixture, bodies_of
from dem.body.particle import Particle, SphereChain, chain_mean_width, mean_width
from dem.engine.demand import Activity
from dem.engine.effect import EffectName
from dem.errors import InputError, nearest, shown
from dem.notebook import Facts, Shown, bodies_text
from dem.phases.deposit import Deposit
from dem.phases.kinds import AnyPhase
from dem.phases.phase import Settle
from dem.phases.pull_hook import with_pull_defaults
from dem.phases.take_over import TakeOver
from dem.scene.keys import put
from dem.scene.rules import problems
from dem.scene.stiffness import stiffness_for
from dem.scene.strands import Section, Sections
from dem.setting.contact import Contact, with_preset
from dem.setting.container import Container, Cylinder
from dem.setting.fidelity import FIDELITIES, MOST_ROWS, Fidelity, fidelities
from dem.setting.hooks import Hooks, with_hook_defaults
from dem.setting.liquid import Liquid
from dem.setting.motor import Motor
from dem.setting.part import EARTH_GRAVITY, REFERENCE_ASPECT_RATIO, Part
from dem.setting.plane import Channel, Plane
from dem.setting.protocol import Protocol, with_protocol
from dem.setting.recording import Recording
from dem.setting.shapes import AnyShape, Chain, Flexible, Shaped, listed, numbers_of_shapes
from dem.setting.smarticle import Smarticle
from dem.strict import explained

# Distance of neighbouring spheres, in diameters, of the chains that represent smooth links in pours and pictures. Where
# such chains do not overlap, the links themselves overlap by a thirtieth of a diameter at most.
SMOOTH_PITCH = 0.35
#: Version of the format of scenes; version 1, which is read too, has another default engine
SCHEMA_VERSION: Literal[2] = 2
ENGINE_OF_VERSION_1 = "yade"
P = TypeVar("P", bound=Part)
_TURNS = 10  # times in which a body turns back, for which a pile must at least be still
_LEAST_GRAVITY = 1e-6  # m/s²; below it motors, whose torque limit is proportional to gravity, cannot move anything


def _named(base: str, given: Mapping[str, Any], *, diameter: Any = None, pitch: Any = None) -> Mapping[str, Any]:
    """Return the parameters of a named fidelity by key of `Fidelity`, adapted to a scene.

    On the engine links `rows` is 1 in a plane, for t1 ≤ t2, and if a sphere diameter is given. Several rows become as
    many as leave no hole, see `dem.scene.strands`.

    `given` are parts of the scene that are validated already, by name; `diameter` and `pitch` are `fidelity.diameter_m`
    and `fidelity.pitch`, which may not be validated, or None.
    """
    engine, smarticle = given.get("engine", ""), given.get("smarticle") or Smarticle()
    named = fidelities(engine)[base]
    narrow = smarticle.thickness_normal_m <= smarticle.thickness_in_plane_m
    single = given.get("plane") is not None or narrow or diameter is not None
    if engine == "links" and single:
        return {**named, "rows": 1}
    if named["rows"] == 1:
        return named
    width, spacing = (each if isinstance(each, int | float) else None for each in (diameter, pitch))
    least = _sections(given, width).rows(smooth=engine == "links", pitch=spacing or named["pitch"])
    return {**named, "rows": min(max(named["rows"], least), MOST_ROWS)}


def _sections(given: Mapping[str, Any], diameter: float | None) -> Sections:
    """Return the sections of all bodies, from parts of the scene that are validated already, by name.

    `diameter` is `fidelity.diameter_m`.
    """
    shapes = [shape for shape in given.get("particle") or () if not shape.absent]
    found = [Section.of(shape.bars(), single=isinstance(shape, Chain)) for shape in shapes]
    smarticle, hooks = given.get("smarticle") or Smarticle(), given.get("hooks")
    own = Section(normal=smarticle.thickness_normal_m, in_plane=smarticle.thickness_in_plane_m)
    hook = math.inf if hooks is None else hooks.side_m
    return Sections(sections=found or [own], diameter=diameter, hook=hook)


class Scene(Part, Shown):
    """Description of one run: everything that its result depends on."""

    schema_version: Literal[1, 2] = Field(
        SCHEMA_VERSION, description="version of this format [1]; in version 1 the default of engine is yade"
    )
    engine: Literal["links", "yade", "lammps"] = Field(
        "links",
        description="engine: links, swept segments; yade, chains of spheres on YADE; or lammps, chains of spheres on "
        "LAMMPS, on several processes and nodes, for passive scenes",
    )
    protocol: Protocol | None = Field(
        None,
        description="rules for keys that the scene leaves open (motor.law, friction, container, what a shake moves): "
        "text, those of the paper's text, or code, those of the paper's own code; default: neither",
    )
    name: str = Field("scene", min_length=1, max_length=100, description="name for titles and tables")
    seed: int = Field(..., ge=0, lt=2**63, description="the only source of randomness [1]")
    particle: tuple[AnyShape, ...] | None = Field(
        None,
        min_length=1,
        max_length=16,
        description="shape of the bodies, or a list of shapes for a mixture; default: smarticle, described by the key "
        "smarticle",
    )
    smarticle: Smarticle = Field(default_factory=Smarticle, description="geometry and material of one smarticle")
    count: int = Field(..., ge=1, le=100_000, description="N, number of smarticles, or other bodies [1]")
    container: Container = Field(default_factory=Container, description="the container")
    plane: Plane | None = Field(
        None, description="plane that all motion is confined to, between two walls instead of a container; null: none"
    )
    hooks: Hooks | None = Field(None, description="hooks in the pile, for phases that pull one; default: none")
    liquid: Liquid | None = Field(None, description="liquid around filaments; default: none")
    contact: Contact = Field(default_factory=Contact, description="friction and restitution")
    motor: Motor = Field(default_factory=Motor, description="the motors of the hinges, for phases that actuate")
    gravity_m_per_s2: float = Field(EARTH_GRAVITY, ge=0, le=1000, description="g, downwards [m/s²]; 0 or from 1e-6")
    fidelity: Fidelity = Field(
        default_factory=lambda given: Fidelity(base="standard", **_named("standard", given)),
        description="a name (draft, standard, reference) or a mapping: base and the parameters that differ from it",
    )
    phases: tuple[AnyPhase, ...] = Field(..., min_length=1, description="phases of the run, in order")
    recording: Recording = Field(default_factory=Recording, description="frames and series")

    def __init__(self, **keys: Any) -> None:
        """Make a scene from its keys; raise InputError in one line if they are not valid."""
        keys = plain(keys)
        try:
            super().__init__(**keys)
        except ValidationError as error:
            raise InputError(f"Scene: {explained(error, keys, described='`smarticles keys`')}") from None

    # Tells pydantic that files are validated without this method, which would lose the folder of relative paths.
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    def _facts(self) -> Facts:
        yield "scene", self.name
        numbers: dict[str, int] = {}
        if self.particle is not None:
            for shape, number in zip(self.particle, numbers_of_shapes(self.particle, self.count), strict=True):
                numbers[shape.tag()] = numbers.get(shape.tag(), 0) + number
        yield "bodies", bodies_text(self.count, numbers, self.smarticle.aspect_ratio)
        if self.plane is None:
            yield "container", f"radius {1e3 * self.container.radius_m:g} mm"
        yield "engine", f"{self.engine}, {self.fidelity.base}, seed {self.seed}"
        timed = [(phase.kind, getattr(phase, "duration_s", None)) for phase in self.phases]
        yield "phases", ", ".join(kind if duration is None else f"{kind} {duration:g} s" for kind, duration in timed)

    def __eq__(self, other: object) -> bool:
        """Return whether all keys are equal; pydantic would compare cached properties, too, with their arrays."""
        return isinstance(other, Scene) and self._values == other._values

    def __hash__(self) -> int:
        return hash(self._values)

    @property
    def _values(self) -> tuple[Any, ...]:
        return tuple(getattr(self, name) for name in type(self).model_fields)

    def __setattr__(self, name: str, value: Any) -> None:
        """Raise InputError: a scene is not changed after it was checked."""
        raise InputError(f"{name}: a scene cannot be changed; make another one, by scene.replace({name}=…)")

    def replace(self, **changes: Any) -> Self:
        """Return a scene with other values of some keys; raise InputError if it is not valid.

        Keys of parts have dots: `scene.replace(count=40, **{"smarticle.aspect_ratio": 0.4})`. Values that follow from
        other keys follow anew.
        """
        data = self.given
        for key, value in plain(changes).items():
            put(data, key, value)
        return type(self)(**data)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return a copy; with `update`, the scene of `replace`, which is checked."""
        return self.replace(**update) if update else super().model_copy(deep=deep)

    @property
    def given(self) -> dict[str, Any]:
        """The keys that were set, with their values, as nested mappings.

        Keys of `fidelity` are left out if their values follow from the rest of the scene.
        """
        data = self.model_dump(mode="json", exclude_unset=True)
        if "fidelity" in data:
            derived = dict(self.named_knobs)
            if self.smooth:
                derived["stiffness_N_per_m"] = max(derived["stiffness_N_per_m"], stiffness_for(self))
            differing = {key: value for key, value in data["fidelity"].items() if derived.get(key) != value}
            data["fidelity"] = {**differing, "base": self.fidelity.base}
        return data

    @model_validator(mode="before")
    @classmethod
    def _of_this_version(cls, data: Any) -> Any:
        """Return the data of a scene of version 1 as data of `SCHEMA_VERSION`."""
        version = data.get("schema_version") if isinstance(data, Mapping) else None
        if version == 1 and not isinstance(version, bool):
            return {"engine": ENGINE_OF_VERSION_1, **data, "schema_version": SCHEMA_VERSION}
        return data

    @model_validator(mode="before")
    @classmethod
    def _filled_by_preset_and_protocol(cls, data: Any, info: ValidationInfo) -> Any:
        return with_protocol(with_preset(data, (info.context or {}).get("folder")))

    @field_validator("fidelity", mode="before")
    @classmethod
    def _fidelity_by_name(cls, value: Any, info: ValidationInfo) -> Any:
        if isinstance(value, str):
            value = {"base": value}
        if not isinstance(value, Mapping):
            return value
        base = value.get("base", "standard")
        if not isinstance(base, str) or base not in FIDELITIES:
            raise ValueError(f"unknown fidelity {shown(base)}; {nearest(str(base), FIDELITIES)}")
        return {
            "base": base,
            **_named(base, info.data, diameter=value.get("diameter_m"), pitch=value.get("pitch")),
            **value,
        }

    @field_validator("container", mode="before")
    @classmethod
    def _some_container(cls, value: Any) -> Any:
        if value is None:
            raise ValueError(
                "got null, but there is no scene without a container; leave the key out, give a radius_m that is "
                "never reached, or add the phase remove-container; see docs/limits.md"
            )
        return value

    @field_validator("gravity_m_per_s2")
    @classmethod
    def _some_or_none(cls, value: float) -> float:
        if 0 < value < _LEAST_GRAVITY:
            raise ValueError(f"{value:g} m/s² is out of range; use 0 m/s² or at least {_LEAST_GRAVITY:g} m/s²")
        return value

    @field_validator("particle", mode="before")
    @classmethod
    def _one_or_many(cls, value: Any) -> Any:
        return listed(value)

    @field_validator("particle")
    @classmethod
    def _of_some_body(cls, value: tuple[AnyShape, ...] | None) -> tuple[AnyShape, ...] | None:
        if value is not None and all(shape.absent for shape in value):
            raise ValueError("all shares are 0, so that no body has a shape; give one of them a share above 0")
        return value

    @field_validator("hooks", mode="before")
    @classmethod
    def _hooks_of_body(cls, value: Any, info: ValidationInfo) -> Any:
        return with_hook_defaults(value, _sizes(info.data))

    @field_validator("phases", mode="before")
    @classmethod
    def _pulls_of_body(cls, value: Any, info: ValidationInfo) -> Any:
        if not isinstance(value, list | tuple):
            return value
        sizes = _sizes(info.data)
        return [with_pull_defaults(phase, sizes) for phase in value]

    @model_validator(mode="wrap")
    @classmethod
    def _stiff_enough(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """Return the validated scene; on the engine links, increase kn if loads and speeds need more.

        Only a kn that comes from the named fidelity is increased; one that the scene gives is kept.
        """
        scene = handler(data)
        given = data.get("fidelity") if isinstance(data, Mapping) else scene.fidelity
        chosen = given is not None and not isinstance(given, str | Mapping)
        if not scene.smooth or chosen or (isinstance(given, Mapping) and "stiffness_N_per_m" in given):
            return scene
        needed = stiffness_for(scene)
        if needed <= scene.fidelity.stiffness_N_per_m:
            return scene
        knobs = {"base": given} if isinstance(given, str) else dict(given or {})
        return handler({**data, "fidelity": {**knobs, "stiffness_N_per_m": needed}})

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for problem in problems(self, self.engine):
            raise ValueError(problem)
        return self

    @model_validator(mode="after")
    def _filled_by_size(self) -> Self:
        """Scale defaults that are those of the paper's smarticle at 9.81 m/s²; see their descriptions."""
        gravity, paper = self.gravity_m_per_s2 or EARTH_GRAVITY, Smarticle()
        if self.particle is None:
            ratio = _usual_torque(self.smarticle, gravity) / _usual_torque(paper, EARTH_GRAVITY)
            vars(self)["motor"] = _scaled(self.motor, "stiffness_N_m_per_rad", ratio)
        root = math.sqrt(gravity * _sizes(dict(self))[0] / (EARTH_GRAVITY * paper.middle_length_m))
        usual = Settle()
        turn = 2 * root * usual.speed_m_per_s / gravity  # time for which a body that turns back is slower
        longer = max(1.0, _TURNS * turn / usual.hold_s)
        vars(self)["phases"] = tuple(
            _filled(phase, settle=_scaled(_scaled(phase.settle, "speed_m_per_s", root), "hold_s", longer))
            if isinstance(phase, Deposit | TakeOver)
            else phase
            for phase in self.phases
        )
        return self

    @cached_property
    def cylinder(self) -> Cylinder:
        """The container of the simulation; its height is `ample_height` if the scene gives none."""
        container, upper = self.container, []
        tiers, bottom = container.tiers or (), 0.0
        for below, tier in pairwise(tiers):
            bottom += below.height_m
            if tier.radius_m < below.radius_m:
                upper.append((bottom, tier.radius_m))
        hooks_top = 0.0 if self.hooks is None else self.hooks.upper_height_m + self.hooks.side_m / 2
        return Cylinder(
            radius=container.radius_m,
            height=self.ample_height(hooks_top) if container.height_m is None else container.height_m,
            facets=self.fidelity.wall_facets,
            upper=tuple(upper),
        )

    def ample_height(self, hooks_top: float = 0.0) -> float:
        """Return a wall height [m] that leaves room for a layer above the loosest pile and above the hooks.

        A loose random packing of thin bars has the packing fraction φ ≈ 2.4 d/L, with d the mean width of the section
        and L the length of all three links (Gravish's φ_0 at l/w = 0, 0.7 and 1.4). The loosest pile is assumed to have
        half this packing fraction. The highest point of the hooks is at `hooks_top` [m].
        """
        # Smarticles may come to lie on a hook.
        pile = self._height_at(1.2)
        return max(pile, hooks_top) + 4 * self.model.reach + 6 * self.model.size

    @property
    def loose_height(self) -> float:
        """Approximate height of the poured pile [m], at the packing fraction 2.4 d/L of `ample_height`.

        In 9 piles of 100 to 160 smarticles with l/w = 0.4 and 0.7, half of the smarticles were below 0.6 to 0.7 of this
        height, and the highest one was at 1.2 to 1.7 of it.
        """
        return self._height_at(2.4)

    def _height_at(self, factor: float) -> float:
        """Return the height [m] of a pile with the packing fraction `factor` d/L, see `ample_height`."""
        mixture = self.mixture
        if mixture is None:
            length = float(self.smarticle.boxes.lengths.sum())
        else:
            length = mixture.mean([kind.length for kind in mixture.kinds])
        filling = factor * self.sphere_diameter / length
        return self.count * self.model.volume / (math.pi * self.container.radius_m**2 * filling)

    @property
    def named_knobs(self) -> Mapping[str, Any]:
        """Parameters of the named fidelity for this scene, before the scene or a rule changes them."""
        fidelity = self.fidelity
        return _named(fidelity.base, dict(self), diameter=fidelity.diameter_m, pitch=fidelity.pitch)

    @property
    def smooth(self) -> bool:
        """Whether the engine computes links as swept segments, not as chains of spheres."""
        return self.engine == "links"

    @property
    def sphere_diameter(self) -> float:
        """Sphere diameter [m]: `fidelity.diameter_m`, or the default that its description states.

        In a mixture it is the diameter of the smallest spheres.
        """
        if self.mixture is not None:
            return self.mixture.diameter
        smarticle, rows = self.smarticle, self.fidelity.rows
        return self._diameter_of(smarticle.thickness_normal_m, smarticle.thickness_in_plane_m, rows)

    def _diameter_of(self, normal: float, in_plane: float, rows: int, *, disc: bool = False) -> float:
        """Return the diameter [m] of the spheres that stand for a bar with a given cross-section.

        A bar is a chain of spheres, or on the engine links a sphere that is swept along the bar's axis. If
        `fidelity.diameter_m` is given, it is the diameter of all bars.

        The section has the thickness `normal` (t1) along the normal and `in_plane` (t2) [m], or with `disc` is a disc.
        Spheres are in `rows` along the normal.
        """
        if self.fidelity.diameter_m is not None:
            return self.fidelity.diameter_m
        if rows > 1:
            return in_plane
        width = in_plane if disc else mean_width(normal, in_plane)
        # A smooth round bar touches others at its own diameter, which chains of spheres do not.
        return width if self.smooth else width / chain_mean_width(self._pitch)

    def seed_for(self, purpose: str) -> int:
        """Return a 64-bit seed for one purpose, derived from the scene's seed alone.

        Scenes that differ in nothing but the fidelity begin with identical poses, so that fidelities can be compared.
        """
        digest = hashlib.sha256(f"{self.seed}/{purpose}".encode()).digest()
        return int.from_bytes(digest[:8], "big")

    @property
    def torque_limit(self) -> float:
        """Torque limit τ_max [N m]: `motor.torque_limit_N_m`, or the default that its description states."""
        if self.motor.torque_limit_N_m is not None:
            return self.motor.torque_limit_N_m
        return _usual_torque(self.smarticle, self.gravity_m_per_s2)

    @cached_property
    def motor_strengths(self) -> Array | None:
        """(N, 2) factors on τ_max and stiffness of the motors [1]; None where all motors are equal."""
        spread = self.motor.strength_spread
        if not spread:
            return None
        rng = np.random.default_rng(self.seed_for("strengths"))
        return 1 + spread * rng.uniform(-1, 1, (self.count, 2))

    @property
    def wave_seed(self) -> int:
        """Seed of the waves of actively bending filaments and chains."""
        return self.seed_for("waves") % 2**32  # exact in an array of floats

    @property
    def channel(self) -> Channel | None:
        """Table and walls of a scene in a plane; None in a container."""
        if self.plane is None:
            return None
        return Channel(width=self.plane.width_m, table=-self.smarticle.thickness_normal_m / 2)

    @property
    def actuates(self) -> bool:
        """Whether motors move or hold barbs in any phase, so that smarticles have hinges."""
        return any(phase.actuates for phase in self.phases)

    @property
    def pulled_by(self) -> tuple[tuple[float, float], ...]:
        """Stiffness [N/m] and damping [N s/m] of the strings, for each phase with strings."""
        return tuple(phase.pulled_by for phase in self.phases if phase.pulled_by is not None)

    def calls_for(self, effect: EffectName) -> bool:
        """Return whether any phase of the scene needs an effect."""
        return any(effect in phase.calls(self, index) for index, phase in enumerate(self.phases))

    def activity(self, index: int) -> Activity:
        """Return the activity of a phase, on which its cost per step depends."""
        phase = self.phases[index]
        if phase.pours:
            return Activity.POUR
        if phase.actuates:
            return Activity.ACTUATE
        return Activity.SHAKE if EffectName.CONTAINER_MOTION in phase.calls(self, index) else Activity.REST

    @property
    def activities(self) -> frozenset[Activity]:
        """Activities of all phases that take simulated time."""
        durations = [phase.expected_duration(self) for phase in self.phases]
        return frozenset(self.activity(index) for index, duration in enumerate(durations) if duration > 0)

    @cached_property
    def body(self) -> Particle:
        """One smarticle, with the spheres that represent it."""
        if self.particle is not None:
            raise InputError("body: a scene with the key particle has no smarticles; its bodies are in scene.bodies")
        diameter = self.sphere_diameter
        chain = SphereChain(rows=self.fidelity.rows, diameter=diameter, pitch=self._pitch * diameter)
        return Particle(self.smarticle.boxes, chain)

    @cached_property
    def sections(self) -> Sections:
        """Sections of all bodies, with the thinnest bars of the hooks."""
        return _sections(dict(self), self.fidelity.diameter_m)

    @property
    def least_rows(self) -> int:
        """Least `fidelity.rows` above 1 that leave no hole in flat bars, see `dem.scene.strands`; 1 without any."""
        return self.sections.rows(smooth=self.smooth, pitch=self._pitch)

    @cached_property
    def _pitch(self) -> float:
        return SMOOTH_PITCH if self.smooth else min(self.fidelity.pitch, self.sections.widest_pitch)

    @cached_property
    def mixture(self) -> Mixture | None:
        """Kinds of bodies and the kind of each body, from the key `particle`; None for smarticles."""
        if self.particle is None:
            return None
        rng = np.random.default_rng(self.seed_for("shapes"))
        kinds: list[Kind] = []
        of: list[Numbers] = []
        shapes, numbers = self.particle, numbers_of_shapes(self.particle, self.count)
        for shape, number in zip(shapes, numbers, strict=True):
            if shape.absent:
                continue
            of.append(len(kinds) + rng.integers(len(shape.factors), size=number))
            kinds += [self._kind(shape, float(factor)) for factor in shape.factors]
        order = np.concatenate(of)
        return Mixture(tuple(kinds), rng.permutation(order) if len(kinds) > 1 else order)

    def _kind(self, shape: Shaped, factor: float) -> Kind:
        bars = shape.bars(factor)
        normal, in_plane = bars.thickness_normal, bars.thickness_in_plane
        linkage = shape.linkage(factor, bars) if isinstance(shape, Chain) else None
        # Rows have a meaning only across the wide side of a flat section; links of a chain have one.
        section = Section.of(bars, single=isinstance(shape, Chain))
        rows = self.fidelity.rows if section.is_wide(self.fidelity.diameter_m) else 1
        diameter, pitch = self._diameter_of(normal, in_plane, rows, disc=bars.round), self._pitch
        filament = None
        if isinstance(shape, Flexible):  # of cylinders on every engine
            filament = shape.filament(factor, None if self.liquid is None else self.liquid.immersing)
            diameter, pitch = self.fidelity.diameter_m or in_plane, SMOOTH_PITCH
        return Kind(
            name=shape.tag(),
            bars=bars,
            rows=rows,
            diameter=diameter,
            pitch=pitch * diameter,
            filament=filament,
            linkage=linkage,
        )

    @property
    def model(self) -> Particle | Mixture:
        """The bodies as engines compute them: one smarticle, or a mixture."""
        return self.mixture or self.body

    @property
    def bodies(self) -> tuple[Particle | Kind, ...]:
        """One body of each kind. The damping in the contact law is computed from the effective mass of the first."""
        return bodies_of(self.model)


def _usual_torque(smarticle: Smarticle, gravity: float) -> float:
    """Return the default torque limit [N m] of a smarticle's motors; `gravity` in [m/s²]."""
    boxes = smarticle.model_copy(update={"aspect_ratio": REFERENCE_ASPECT_RATIO}).boxes
    return boxes.mass * gravity * boxes.middle_length


def _filled(part: P, **values: Any) -> P:
    """Return a copy of a part of a scene with other values, which do not count as given by the user."""
    copied = part.model_copy(update=values)
    copied.model_fields_set.intersection_update(part.model_fields_set)
    return copied


def _scaled(part: P, key: str, factor: float) -> P:
    """Return a part with the default of a key multiplied by a factor, to three digits; a given value is kept."""
    if key in part.model_fields_set:
        return part
    field = type(part).model_fields[key]
    low, high = field.metadata
    return _filled(part, **{key: min(max(float(f"{field.default * factor:.3g}"), low.ge), high.le)})


def _sizes(given: Mapping[str, Any]) -> tuple[float, float]:
    """Return w and t2 of the smarticle, or longest bar and smallest thickness of other bodies [m].

    `given` are parts of the scene that are validated already, by their names in the model.
    """
    if given.get("particle"):
        bars = [shape.bars() for shape in given["particle"] if not shape.absent]
        return max(float(each.lengths.max()) for each in bars), min(each.thickness_in_plane for each in bars)
    smarticle = given.get("smarticle") or Smarticle()
    return smarticle.middle_length_m, smarticle.thickness_in_plane_m
