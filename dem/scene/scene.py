"""The scene: a validated, frozen description of one run; everything that decides its result.

Its parts are in `dem.setting.parts`; this module joins them, checks them against each other and reads scene files.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np
import yaml
from numpy.typing import NDArray
from pydantic import Field, ValidationError, ValidationInfo, field_validator, model_validator

from dem.body.particle import Particle, SphereChain, chain_mean_width, mean_width
from dem.errors import InputError
from dem.phases.actuation import actuated
from dem.phases.actuation_checks import check_actuation
from dem.phases.chain import check_chain
from dem.phases.release import check_release
from dem.scene.overrides import apply_override
from dem.scene.refusal import first_line
from dem.scene.yaml_text import load_yaml
from dem.setting.container import Cylinder
from dem.setting.hooks import Hooks, check_hooks, with_hook_defaults, with_pull_defaults
from dem.setting.part import REFERENCE_ASPECT_RATIO, Part
from dem.setting.parts import FIDELITIES, Contact, Container, Deposit, Fidelity, Motor, Phase, Recording, Smarticle
from dem.setting.plane import Channel, Plane, check_plane

SCHEMA_VERSION = 1


class Scene(Part):
    """One run: everything that decides its result."""

    schema_version: Literal[1] = Field(..., description="version of this format [1]")
    name: str = Field("scene", min_length=1, max_length=100, description="name for titles and tables")
    seed: int = Field(..., ge=0, lt=2**63, description="the only source of randomness [1]")
    smarticle: Smarticle = Field(default_factory=Smarticle, description="geometry and material of one smarticle")
    count: int = Field(..., ge=1, le=100_000, description="N, number of smarticles [1]")
    container: Container = Field(default_factory=Container, description="the container")
    plane: Plane | None = Field(
        None, description="confine all motion to a plane, between two walls instead of in the container; default: not"
    )
    hooks: Hooks | None = Field(None, description="hooks in the pile, for phases that pull one; default: none")
    contact: Contact = Field(default_factory=Contact, description="friction and restitution")
    motor: Motor = Field(default_factory=Motor, description="the motors of the hinges, for phases that actuate")
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
        if not isinstance(base, str) or base not in FIDELITIES:
            msg = f"unknown fidelity {base!r}; known: {', '.join(FIDELITIES)}"
            raise ValueError(msg)
        return {"base": base, **FIDELITIES[base], **value}

    @field_validator("hooks", mode="before")
    @classmethod
    def _hooks_of_smarticle(cls, value: Any, info: ValidationInfo) -> Any:
        return with_hook_defaults(value, info.data.get("smarticle") or Smarticle())

    @field_validator("phases", mode="before")
    @classmethod
    def _pulls_of_smarticle(cls, value: Any, info: ValidationInfo) -> Any:
        if not isinstance(value, list | tuple):
            return value
        return [with_pull_defaults(phase, info.data.get("smarticle") or Smarticle()) for phase in value]

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        check_plane(self)
        if self.plane is None:
            self._check_phases()
            self._check_container()
        self._check_section()
        self._check_recording()
        check_actuation(self)
        check_release(self)
        check_hooks(self)
        check_chain(self)
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
        tiers = self.container.tiers or ()
        for number, tier in enumerate(tiers):
            if reach > tier.radius_m:
                msg = (
                    f"container.tiers.{number}.radius_m: {tier.radius_m:g} m is narrower than a smarticle, whose "
                    f"farthest point is {reach:.4g} m from its centre of mass; use at least {reach:.4g} m"
                )
                raise ValueError(msg)
        height = self.container.height_m
        if height is not None:
            # No random packing of thin bars comes near one half; a scene beyond it cannot fit, whatever the pour.
            space = math.fsum(t.radius_m**2 * t.height_m for t in tiers) if tiers else radius**2 * height
            most = int(0.5 * math.pi * space / self.smarticle.boxes.volume)
            if self.count > most:
                way_out = "make the top tier higher" if tiers else "leave height_m out"
                msg = (
                    f"count: {self.count} smarticles cannot fit into {height:g} m of container.height_m "
                    f"(half full is {most}); lower the count or {way_out}"
                )
                raise ValueError(msg)
            self._check_first_layer(height)

    def _check_first_layer(self, height: float) -> None:
        """The slab that a layer is poured into must end below the wall, with a smarticle that lies flat on its top."""
        pour = self.phases[0]
        assert isinstance(pour, Deposit)  # checked before
        slab = pour.layer_height_w * self.smarticle.middle_length_m
        least = 2 * self.particle.radius + slab + self.particle.reach
        if height < least:
            key = "container.height_m" if self.container.tiers is None else "container.tiers"
            what = "it" if self.container.tiers is None else "height_m of the top tier"
            msg = (
                f"{key}: {height:g} m of wall is too low for one layer of the pour, spread over "
                f"phases.0.layer_height_w = {pour.layer_height_w:g} w, which reaches {least:.4g} m; raise {what} by at "
                f"least {least - height:.3g} m or lower layer_height_w"
            )
            raise ValueError(msg)

    def _check_recording(self) -> None:
        series = self.recording.series_interval_s
        for key in ("frame_interval_s", "sphere_interval_s", "checkpoint_interval_s"):
            interval = getattr(self.recording, key)
            if interval is None:
                continue
            if abs(interval / series - round(interval / series)) > 1e-6 or interval < series:
                msg = (
                    f"recording.{key}: {interval:g} s is not a whole multiple of series_interval_s = {series:g} s; "
                    f"use e.g. {max(1, round(interval / series)) * series:g} s"
                )
                raise ValueError(msg)
        sampled = self.recording.dissipation_interval_s
        if sampled is not None and sampled > series:
            msg = (
                f"recording.dissipation_interval_s: {sampled:g} s is longer than series_interval_s = {series:g} s, so "
                "that the account of energies would not close; 2e-4 s is dense enough"
            )
            raise ValueError(msg)
        for number, phase in enumerate(self.phases):
            # How long a pour takes is not known, and laying out a chain takes no time.
            duration = getattr(phase, "duration_s", math.inf)
            if duration < series:
                # A shape change has no key for its length; it is the sum of three.
                key = ".duration_s" if "duration_s" in type(phase).model_fields else ""
                msg = (
                    f"phases.{number}{key}: {duration:g} s is shorter than "
                    f"recording.series_interval_s = {series:g} s; lengthen the phase or sample more often"
                )
                raise ValueError(msg)

    @cached_property
    def cylinder(self) -> Cylinder:
        """The container as the engine builds it."""
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
        """Height [m] of a wall that is enough for the loosest pile, hooks in it, and a layer being poured.

        A loose random packing of thin bars has φ ≈ 2.4 d/L with L the length of all links (Gravish's φ_0 at l/w = 0,
        0.7 and 1.4, with d the mean width of the section); half of that is taken as the loosest.

        Args:
            hooks_top: height of the hooks' top [m]; 0 without hooks.
        """
        boxes = self.smarticle.boxes
        loosest = 1.2 * self.sphere_diameter / float(boxes.lengths.sum())
        pile = self.count * boxes.volume / (math.pi * self.container.radius_m**2 * loosest)
        # What is poured may come to lie on a hook.
        return max(pile, hooks_top) + 4 * self.particle.reach + 6 * boxes.middle_length

    @property
    def sphere_diameter(self) -> float:
        """Sphere diameter [m]: given, or by the rule that `Fidelity.diameter_m` states."""
        if self.fidelity.diameter_m is not None:
            return self.fidelity.diameter_m
        smarticle = self.smarticle
        if self.fidelity.rows == 1:
            width = mean_width(smarticle.thickness_normal_m, smarticle.thickness_in_plane_m)
            return width / chain_mean_width(self.fidelity.pitch)
        return smarticle.thickness_in_plane_m

    def seed_for(self, purpose: str) -> int:
        """See `derive_seed`."""
        return derive_seed(self.seed, purpose)

    @property
    def torque_limit(self) -> float:
        """τ_max [N m] of the motors: given, or by the rule that `Motor.torque_limit_N_m` states."""
        if self.motor.torque_limit_N_m is not None:
            return self.motor.torque_limit_N_m
        paper = self.smarticle.model_copy(update={"aspect_ratio": REFERENCE_ASPECT_RATIO}).boxes
        return paper.mass * self.gravity_m_per_s2 * paper.middle_length

    @cached_property
    def motor_strengths(self) -> NDArray[np.float64] | None:
        """(N, 2) factors on τ_max and stiffness of the motors [1]; None where all are alike."""
        spread = self.motor.strength_spread
        if not spread:
            return None
        rng = np.random.default_rng(self.seed_for("strengths"))
        return 1 + spread * rng.uniform(-1, 1, (self.count, 2))

    @property
    def channel(self) -> Channel | None:
        """Table and walls as the engine builds them, in a scene that is confined to a plane."""
        if self.plane is None:
            return None
        return Channel(width=self.plane.width_m, table=-self.smarticle.thickness_normal_m / 2)

    @property
    def actuates(self) -> bool:
        """Whether a phase moves the barbs or holds them, so that there are hinges and motors."""
        return any(actuated(phase) for phase in self.phases)

    @cached_property
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
    if data is None:
        msg = f"{source}: is empty; a scene is a mapping of keys to values, see `smarticles schema`"
        raise InputError(msg)
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
        msg = f"{source}: {first_line(error, data)}"
        raise InputError(msg) from None


def load_scene(path: Path, overrides: Sequence[str] = ()) -> Scene:
    """Read a scene file.

    Args:
        path: YAML file.
        overrides: `KEY=VALUE` with dots for nesting, e.g. `phases.1.duration_s=2`; the value is read as YAML.

    Raises:
        InputError: unreadable file, bad YAML, bad override or invalid scene.
    """
    try:
        data = load_yaml(path.read_text(encoding="utf-8"))
    except OSError as error:
        msg = f"{path}: cannot be read ({error.strerror}); give the path of a scene file"
        raise InputError(msg) from None
    except UnicodeDecodeError:
        msg = f"{path}: is not a text file; give the path of a scene file"
        raise InputError(msg) from None
    except yaml.YAMLError as error:
        msg = f"{path}: not valid YAML: {' '.join(str(error).split())}"
        raise InputError(msg) from None
    for override in overrides if isinstance(data, Mapping) else ():
        apply_override(data, override)
    return parse_scene(data, source=str(path))


def dump_scene(scene: Scene) -> str:
    """The resolved scene as YAML, every default written out."""
    return str(yaml.safe_dump(scene.model_dump(mode="json"), sort_keys=False, allow_unicode=True))


def scene_hash(scene: Scene) -> str:
    """SHA-256 of the canonical JSON of the resolved scene."""
    text = json.dumps(scene.model_dump(mode="json"), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def json_schema() -> dict[str, Any]:
    """JSON schema of the scene file, for editors."""
    schema = Scene.model_json_schema()
    # The file may name a fidelity, or give its base and some knobs; the model that pydantic describes has them all.
    fidelity = schema["properties"]["fidelity"]
    mapping = {"$ref": fidelity.pop("$ref")}
    fidelity["anyOf"] = [{"type": "string", "enum": list(FIDELITIES)}, mapping]
    schema["$defs"]["Fidelity"].pop("required")
    # These follow from the smarticle where they are not given.
    schema["$defs"]["Hooks"].pop("required")
    schema["$defs"]["PullHook"]["required"] = ["type"]
    return schema
