"""The scene: a validated, frozen description of one run; everything that decides its result.

SI units throughout. Every key carries its unit in its name or in its description.
"""

from __future__ import annotations

import difflib
import hashlib
import json
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from dem.errors import InputError
from dem.particle import Boxes, Particle, SphereChain, mean_width_diameter

SCHEMA_VERSION = 1
LONGEST_LENGTH = 1.0  # m; a longer smarticle or container is taken for a mistaken unit


class Part(BaseModel):
    """A frozen part of a scene: no unknown keys, no NaN, no infinity, no silent conversion of text to numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, data: Any) -> Any:
        if isinstance(data, Mapping):
            for key in data:
                if key not in cls.model_fields:
                    near = difflib.get_close_matches(str(key), cls.model_fields, n=1, cutoff=0.4)
                    hint = (
                        f"did you mean {near[0]!r}?"
                        if near
                        else "known keys: " + ", ".join(cls.model_fields)
                    )
                    msg = f"unknown key {key!r}; {hint}"
                    raise ValueError(msg)
        return data

    @model_validator(mode="before")
    @classmethod
    def _refuse_booleans_as_numbers(cls, data: Any) -> Any:
        # YAML reads `yes` and `on` as true, and true would pass as 1.
        if isinstance(data, Mapping):
            for key, value in data.items():
                field = cls.model_fields.get(str(key))
                if isinstance(value, bool) and field is not None and field.annotation is not bool:
                    msg = f"{key}: got the boolean {str(value).lower()}, expected {_kind(field.annotation)}"
                    raise ValueError(msg)
        return data


def _kind(annotation: Any) -> str:
    return "a number" if annotation in (int, float, float | None, int | None) else "a value of its kind"


def _refuse_wrong_unit(value: float) -> float:
    if value > LONGEST_LENGTH:
        msg = (
            f"{value:g} means {value:g} m, which no smarticle scene needs; "
            f"lengths are in metres: for {value:g} mm write {value / 1000:g}"
        )
        raise ValueError(msg)
    return value


Length = Annotated[float, Field(gt=0)]
Duration = Annotated[float, Field(gt=0)]


class Smarticle(Part):
    """Geometry and material of one smarticle."""

    middle_length_m: Length = Field(0.0117, description="w, length of the middle link, hinge to hinge [m]")
    aspect_ratio: float = Field(0.7, ge=0, le=2, description="l/w, barb length over middle length [1]")
    thickness_normal_m: Length = Field(
        1.27e-3, description="t1, thickness along the normal of the smarticle's plane [m]"
    )
    thickness_in_plane_m: Length = Field(0.5e-3, description="t2, thickness in the smarticle's plane [m]")
    density_kg_per_m3: float = Field(
        7850.0, gt=0, description="density of the links [kg/m³]; mass and inertia are those of the boxes"
    )
    angles_deg: tuple[float, float] = Field(
        (90.0, 90.0), description="barb angles (α1, α2) [deg]: 0 straight, 90 the U; from -15 to 105"
    )

    _length_unit = field_validator("middle_length_m", "thickness_normal_m", "thickness_in_plane_m")(
        _refuse_wrong_unit
    )

    @field_validator("density_kg_per_m3")
    @classmethod
    def _density_unit(cls, value: float) -> float:
        if not 50 <= value <= 25000:
            msg = (
                f"{value:g} kg/m³ is outside 50 … 25000 kg/m³; "
                "density is in kg/m³: steel is 7850, not 7.85"
            )
            raise ValueError(msg)
        return value

    @field_validator("angles_deg")
    @classmethod
    def _angle_range(cls, value: tuple[float, float]) -> tuple[float, float]:
        for angle in value:
            if not -15 <= angle <= 105:
                msg = f"{angle:g}° is outside -15° … 105°, where the links of one smarticle stay apart"
                raise ValueError(msg)
        return value

    @model_validator(mode="after")
    def _thinner_than_long(self) -> Self:
        thickest = max(self.thickness_normal_m, self.thickness_in_plane_m)
        if thickest > self.middle_length_m / 2:
            msg = (
                f"thickness {thickest:g} m is more than half of middle_length_m = {self.middle_length_m:g} m; "
                "a smarticle is a chain of thin links"
            )
            raise ValueError(msg)
        return self

    @property
    def boxes(self) -> Boxes:
        """Exact geometry, mass and inertia."""
        return Boxes(
            middle_length=self.middle_length_m,
            barb_length=self.aspect_ratio * self.middle_length_m,
            thickness_normal=self.thickness_normal_m,
            thickness_in_plane=self.thickness_in_plane_m,
            density=self.density_kg_per_m3,
            angles=(math.radians(self.angles_deg[0]), math.radians(self.angles_deg[1])),
        )


class Container(Part):
    """Upright hollow cylinder, closed at the bottom, open at the top."""

    radius_m: Length = Field(0.0234, description="inner radius [m]; the paper's is 2w")
    height_m: float | None = Field(
        None, gt=0, description="height of the wall [m]; by default high enough for the pour"
    )

    _length_unit = field_validator("radius_m")(_refuse_wrong_unit)


class Contact(Part):
    """Contact of smarticles with each other and with the container."""

    friction_smarticle: float = Field(0.4, ge=0, le=10, description="Coulomb coefficient, smarticle-smarticle [1]")
    friction_wall: float = Field(0.4, ge=0, le=10, description="Coulomb coefficient, smarticle-container [1]")
    restitution: float = Field(
        0.5,
        gt=0,
        le=1,
        description="normal restitution of a contact at a typical lever: effective mass = harmonic mean over the "
        "smarticle's spheres and directions [1]",
    )
    tangential_stiffness_ratio: float = Field(
        0.82, gt=0, le=1, description="ks/kn [1]; Mindlin's 2(1-ν)/(2-ν) is 0.82 for steel, ν = 0.3"
    )
    tangential_damping_ratio: float = Field(
        0.9,
        ge=0,
        le=1,
        description="cs/cn of a sticking contact [1]; √(ks/kn) = 0.9 damps both directions by the same ratio",
    )


class Fidelity(Part):
    """Knobs of accuracy against cost; none of them changes mass or inertia."""

    base: Literal["draft", "standard", "reference"] = Field(
        "standard", description="named setting that the other knobs start from"
    )
    rows: int = Field(..., ge=1, le=4, description="rows of spheres across t1, the thickness along the normal [1]")
    diameter_m: float | None = Field(
        None,
        gt=0,
        description="sphere diameter [m]; default: one row 2(t1+t2)/π, the round bar of equal mean width; "
        "several rows t2, the true section",
    )
    pitch: float = Field(..., gt=0, le=2, description="largest distance of neighbouring spheres over their diameter [1]")
    stiffness_N_per_m: float = Field(..., gt=0, description="normal stiffness kn of one contact [N/m]")
    time_step_fraction: float = Field(
        ..., gt=0, le=1, description="time step over the stable one, which is computed from masses and stiffness [1]"
    )
    time_step_s: float | None = Field(
        None, gt=0, description="time step [s] by hand; refused above the stable one; default: from the fraction"
    )
    wall_facets: int = Field(64, ge=16, le=512, description="flat facets around the cylinder's wall [1]")


FIDELITIES: Mapping[str, Mapping[str, Any]] = {
    "draft": {"rows": 1, "pitch": 1.3, "stiffness_N_per_m": 500.0, "time_step_fraction": 0.8},
    "standard": {"rows": 1, "pitch": 1.0, "stiffness_N_per_m": 1000.0, "time_step_fraction": 0.8},
    "reference": {"rows": 2, "pitch": 1.0, "stiffness_N_per_m": 5000.0, "time_step_fraction": 0.4},
}


class Settle(Part):
    """When a pile counts as settled: both hold at the same check."""

    speed_m_per_s: float = Field(0.02, gt=0, description="largest speed of any smarticle [m/s]")
    unbalanced_force: float = Field(
        0.05, gt=0, description="mean net force on a smarticle over the mean contact force [1]"
    )
    timeout_s: Duration = Field(5.0, description="longest wait [s]; then the run fails with the residuals")


class Deposit(Part):
    """Pour smarticles in layers of random, non-overlapping poses just above the pile, then wait until it settles."""

    type: Literal["deposit"]
    per_layer: int = Field(10, ge=1, description="smarticles per layer [1]")
    layer_height_w: float = Field(
        1.0, gt=0, le=10, description="height of the slab above the pile that a layer is spread over, in units of w [1]"
    )
    landed_speed_m_per_s: float = Field(
        0.2,
        gt=0,
        description="a layer has come down when each of its smarticles touches something and falls slower than this [m/s]",
    )
    settle: Settle = Field(default_factory=Settle, description="when the poured pile counts as settled")


class Relax(Part):
    """Let the pile rest; nothing acts but gravity."""

    type: Literal["relax"]
    duration_s: Duration = Field(0.5, description="length of the phase [s]")


class Shake(Part):
    """Shake the whole container along the vertical, z = A sin(2πft) with A = Γg/(2πf)²."""

    type: Literal["shake"]
    duration_s: Duration = Field(20.0, description="length of the phase [s]")
    frequency_hz: float = Field(30.0, gt=0, le=2000, description="f, frequency [Hz]")
    peak_acceleration_g: float = Field(2.0, ge=0, le=100, description="Γ, peak acceleration in units of gravity [1]")


Phase = Annotated[Deposit | Relax | Shake, Field(discriminator="type")]


class Recording(Part):
    """What is written, and how often."""

    frame_interval_s: float = Field(
        0.04, gt=0, description="time between VTK frames [s]; not a multiple of the shaking period, to sample all its phases"
    )
    series_interval_s: float = Field(0.004, gt=0, description="time between samples of the HDF5 series [s]")


class Scene(Part):
    """One run: everything that decides its result."""

    schema_version: Literal[1] = Field(..., description="version of this format [1]")
    name: str = Field("scene", min_length=1, max_length=100, description="name for titles and tables")
    seed: int = Field(..., ge=0, lt=2**63, description="the only source of randomness [1]")
    smarticle: Smarticle = Field(default_factory=Smarticle, description="geometry and material of one smarticle")
    count: int = Field(..., ge=1, le=100_000, description="N, number of smarticles [1]")
    container: Container = Field(default_factory=Container, description="the container")
    contact: Contact = Field(default_factory=Contact, description="friction and restitution")
    gravity_m_per_s2: float = Field(9.81, ge=0, le=1000, description="g, downwards [m/s²]")
    fidelity: Fidelity = Field(
        default_factory=lambda: Fidelity(base="standard", **FIDELITIES["standard"]),
        description="a name (draft, standard, reference) or a mapping: base and the knobs that differ from it",
    )
    phases: tuple[Phase, ...] = Field(..., min_length=1, description="stages of the run, in order")
    recording: Recording = Field(default_factory=Recording, description="frames and series")

    @field_validator("fidelity", mode="before")
    @classmethod
    def _fidelity_by_name(cls, value: Any) -> Any:
        if isinstance(value, str):
            value = {"base": value}
        if not isinstance(value, Mapping):
            return value
        base = value.get("base", "standard")
        if base not in FIDELITIES:
            msg = f"unknown fidelity {base!r}; known: {', '.join(FIDELITIES)}"
            raise ValueError(msg)
        return {"base": base, **FIDELITIES[base], **value}

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check_phases()
        self._check_section()
        self._check_container()
        self._check_recording()
        return self

    def _check_phases(self) -> None:
        kinds = [phase.type for phase in self.phases]
        if kinds[0] != "deposit" or kinds.count("deposit") > 1:
            msg = f"phases: got {', '.join(kinds)}; a run starts with one 'deposit' and has no other"
            raise ValueError(msg)
        if self.gravity_m_per_s2 == 0:
            msg = "gravity_m_per_s2: 0 m/s²; without gravity nothing comes down in phases.0 (deposit)"
            raise ValueError(msg)

    def _check_section(self) -> None:
        rows, t1 = self.fidelity.rows, self.smarticle.thickness_normal_m
        diameter = self.sphere_diameter
        if rows > 1 and diameter >= t1:
            msg = (
                f"fidelity.rows: {rows} rows of {diameter:g} m do not fit into thickness_normal_m = {t1:g} m; "
                "use one row or a smaller diameter_m"
            )
            raise ValueError(msg)

    def _check_container(self) -> None:
        radius, reach = self.container.radius_m, self.particle.reach
        if reach > radius:
            msg = (
                f"container.radius_m: {radius:g} m is narrower than a smarticle, whose farthest point is {reach:.4g} m "
                f"from its centre of mass; use at least {reach:.4g} m"
            )
            raise ValueError(msg)
        height = self.container.height_m
        if height is not None:
            # No random packing of thin bars comes near one half; a scene beyond it cannot fit, whatever the pour.
            most = int(0.5 * math.pi * radius**2 * height / self.smarticle.boxes.volume)
            if self.count > most:
                msg = (
                    f"count: {self.count} smarticles cannot fit into {height:g} m of container.height_m "
                    f"(half full is {most}); lower the count or leave height_m out"
                )
                raise ValueError(msg)

    def _check_recording(self) -> None:
        frame, series = self.recording.frame_interval_s, self.recording.series_interval_s
        if abs(frame / series - round(frame / series)) > 1e-6 or frame < series:
            msg = (
                f"recording.frame_interval_s: {frame:g} s is not a whole multiple of series_interval_s = {series:g} s; "
                f"use e.g. {max(1, round(frame / series)) * series:g} s"
            )
            raise ValueError(msg)
        for number, phase in enumerate(self.phases):
            if not isinstance(phase, Deposit) and phase.duration_s < series:
                msg = (
                    f"phases.{number}.duration_s: {phase.duration_s:g} s is shorter than "
                    f"recording.series_interval_s = {series:g} s; lengthen the phase or sample more often"
                )
                raise ValueError(msg)

    @property
    def sphere_diameter(self) -> float:
        """Sphere diameter [m]: given, or by the rule that `Fidelity.diameter_m` states."""
        if self.fidelity.diameter_m is not None:
            return self.fidelity.diameter_m
        smarticle = self.smarticle
        if self.fidelity.rows == 1:
            return mean_width_diameter(smarticle.thickness_normal_m, smarticle.thickness_in_plane_m)
        return smarticle.thickness_in_plane_m

    @property
    def particle(self) -> Particle:
        """The smarticle as the engine sees it."""
        diameter = self.sphere_diameter
        chain = SphereChain(rows=self.fidelity.rows, diameter=diameter, pitch=self.fidelity.pitch * diameter)
        return Particle(self.smarticle.boxes, chain)


def derive_seed(seed: int, purpose: str) -> int:
    """A 64-bit seed for one purpose, from the scene's seed alone.

    Scenes that differ in fidelity only get the same poses, so that fidelities are compared on equal terms.
    """
    digest = hashlib.sha256(f"{seed}/{purpose}".encode()).digest()
    return int.from_bytes(digest[:8], "big")


def parse_scene(data: Any, *, source: str) -> Scene:
    """Validate plain data.

    Args:
        data: the content of a scene file.
        source: file name for messages.

    Raises:
        InputError: one line with file, key, value and the way out.
    """
    if not isinstance(data, Mapping):
        msg = f"{source}: a scene is a mapping of keys to values, got {type(data).__name__}"
        raise InputError(msg)
    version = data.get("schema_version")
    if isinstance(version, int) and version != SCHEMA_VERSION:
        msg = f"{source}: schema_version: {version} is not known here; this version reads {SCHEMA_VERSION}"
        raise InputError(msg)
    try:
        return Scene.model_validate(data)
    except ValidationError as error:
        raise InputError(f"{source}: {_first_line(error)}") from None


def load_scene(path: Path, overrides: Sequence[str] = ()) -> Scene:
    """Read a scene file.

    Args:
        path: YAML file.
        overrides: `KEY=VALUE` with dots for nesting, e.g. `phases.1.duration_s=2`; the value is read as YAML.

    Raises:
        InputError: unreadable file, bad YAML, bad override or invalid scene.
    """
    try:
        data = yaml.load(path.read_text(encoding="utf-8"), Loader=_Loader)
    except OSError as error:
        msg = f"{path}: cannot be read ({error.strerror}); give the path of a scene file"
        raise InputError(msg) from None
    except UnicodeDecodeError:
        msg = f"{path}: is not a text file; give the path of a scene file"
        raise InputError(msg) from None
    except yaml.YAMLError as error:
        raise InputError(f"{path}: not valid YAML: {' '.join(str(error).split())}") from None
    for override in overrides:
        _apply(data, override)
    return parse_scene(data, source=str(path))


def dump_scene(scene: Scene) -> str:
    """The resolved scene as YAML, every default written out."""
    return yaml.safe_dump(scene.model_dump(mode="json"), sort_keys=False, allow_unicode=True)


def scene_hash(scene: Scene) -> str:
    """SHA-256 of the canonical JSON of the resolved scene."""
    text = json.dumps(scene.model_dump(mode="json"), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def json_schema() -> dict[str, Any]:
    """JSON schema of the scene file, for editors."""
    return Scene.model_json_schema()


class _Loader(yaml.SafeLoader):
    """Safe YAML that reads 1e-3 as a number, as YAML 1.2 does, and refuses a key given twice."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        keys = [self.construct_object(key, deep=deep) for key, _ in node.value]
        for key in keys:
            if keys.count(key) > 1:
                msg = f"key {key!r} is given twice"
                raise yaml.constructor.ConstructorError(None, None, msg, node.start_mark)
        return super().construct_mapping(node, deep=deep)


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)$"),
    list("-+0123456789."),
)


def _apply(data: Any, override: str) -> None:
    key, separator, text = override.partition("=")
    if not separator or not key:
        msg = f"--set {override}: write KEY=VALUE, e.g. --set phases.1.duration_s=2"
        raise InputError(msg)
    try:
        value = yaml.load(text, Loader=_Loader)
    except yaml.YAMLError:
        msg = f"--set {override}: the value is not valid YAML"
        raise InputError(msg) from None
    *parents, last = key.split(".")
    here = data
    for part in parents:
        here = _child(here, part, override)
    if isinstance(here, dict):
        here[last] = value
    elif isinstance(here, list) and last.isdigit() and int(last) < len(here):
        here[int(last)] = value
    else:
        msg = f"--set {override}: there is no {last!r} to set; lists are numbered from 0"
        raise InputError(msg)


def _child(here: Any, part: str, override: str) -> Any:
    if isinstance(here, dict):
        if isinstance(here.get(part), str) and part == "fidelity":
            here[part] = {"base": here[part]}
        return here.setdefault(part, {})
    if isinstance(here, list) and part.isdigit() and int(part) < len(here):
        return here[int(part)]
    msg = f"--set {override}: there is no {part!r} in the scene; lists are numbered from 0"
    raise InputError(msg)


def _first_line(error: ValidationError) -> str:
    """The first of pydantic's errors as `key: what, value; way out`, and how many more there are."""
    errors = error.errors()
    first = errors[0]
    # Members of a discriminated union carry the tag as an extra step of the path; it is no key of the file.
    place = ".".join(str(step) for step in first["loc"] if step not in ("deposit", "relax", "shake"))
    text = first["msg"].removeprefix("Value error, ")
    if first["type"] == "missing":
        text = "missing; it has no default"
    elif first["type"] != "value_error":
        text = f"{text[0].lower()}{text[1:]}, got {first['input']!r}"
    more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
    return f"{place}: {text}{more}" if place else f"{text}{more}"
