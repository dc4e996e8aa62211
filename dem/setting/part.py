"""Base of the parts of a scene, and types of numbers that several parts use."""

import difflib
import re
from pathlib import Path
from typing import Annotated, Any, get_args

from pydantic import AfterValidator, Field, ValidationInfo

from dem.errors import shown
from dem.strict import Strict

HINGE_RANGE = (-15.0, 105.0)  # deg
LONGEST_LENGTH = 1.0  # m; longer smarticles or containers are taken for lengths in millimetres
EARTH_GRAVITY = 9.81  # m/s²
REFERENCE_ASPECT_RATIO = 0.7  # l/w of the smarticle for which the paper states torques and swings


# Words that users try as keys, and what no scene can describe.
_BEYOND = {
    **dict.fromkeys(("shape", "shapes", "mesh", "mixture", "species", "types"), "such key, see `particle` for shapes"),
    **dict.fromkeys(("cohesion", "adhesion", "capillary", "glue", "magnets"), "cohesion"),
    **dict.fromkeys(("air", "drag", "fluid", "water", "wind"), "air or water"),
    **dict.fromkeys(("material", "materials", "young_modulus", "poisson_ratio"), "materials by this key"),
    **dict.fromkeys(("lid", "box", "walls", "periodic"), "containers by this key"),
}


class Part(Strict):
    """Base of all parts of a scene: a frozen mapping of keys."""

    @classmethod
    def nearest_key(cls, key: str) -> str:
        """Return advice about an unknown key: use a key of similar spelling, or move it to another part."""
        # Most often the unit, or one half of a name, was left out.
        known = cls.known_keys()
        similar = [name for name in known if name.startswith(f"{key}_") or name.endswith(f"_{key}")]
        similar = similar or difflib.get_close_matches(key, known, n=1, cutoff=0.7)
        if similar:
            return f"did you mean {' or '.join(map(repr, similar))}?"
        if key in _BEYOND:
            return f"scenes have no {_BEYOND[key]}; docs/limits.md lists what the project cannot do and what there is"
        # A key of one phase does not belong in another phase.
        others = [part for part in _parts() if not ("type" in part.model_fields and "type" in cls.model_fields)]
        owners = [
            "particle" if "shape" in part.model_fields else part.tag() for part in others if key in part.known_keys()
        ]
        if owners:
            return f"it belongs in {' or '.join(dict.fromkeys(owners))}"
        known_here = "known keys: " + ", ".join(known)
        for part in others:
            elsewhere = difflib.get_close_matches(key, part.known_keys(), n=1, cutoff=0.65)
            if elsewhere:
                return f"{known_here}; {elsewhere[0]!r} belongs in {part.tag()}"
        return known_here

    @classmethod
    def tag(cls) -> str:
        """Return the name of this part in scene files: the value of its `type` or `shape`, or else its key."""
        kind = cls.model_fields.get("type") or cls.model_fields.get("shape")
        return str(get_args(kind.annotation)[0]) if kind else cls.__name__.lower()


def _parts(base: type[Part] = Part) -> list[type[Part]]:
    """Return the parts of scene files: all classes below `base` that are no base themselves."""
    return [part for below in base.__subclasses__() for part in (_parts(below) or [below])]


def as_list(value: Any) -> Any:
    """Return an unvalidated list as it is, and any other value as the only item of a tuple."""
    return value if isinstance(value, list | tuple) else (value,)


def in_hinge_range(angle: float) -> float:
    """Return an angle [deg]; raise ValueError if it is outside the range of the hinges."""
    low, high = HINGE_RANGE
    if not low <= angle <= high:
        raise ValueError(f"{angle:g}° is outside {low:g}° … {high:g}°, the range of the hinges")
    return angle


def reject_wrong_unit(value: float) -> float:
    """Return a length [m]; raise ValueError if it is so large that it must be in millimetres."""
    if value > LONGEST_LENGTH:
        raise ValueError(
            f"{value:g} means {value:g} m, which no smarticle scene needs; "
            f"lengths are in metres: for {value:g} mm write {value / 1000:g}"
        )
    return value


def reject_density_in_other_units(value: float) -> float:
    """Return a density [kg/m³]; raise ValueError if no solid has it, as after a mistake in the unit."""
    if not 50 <= value <= 25000:
        msg = f"{value:g} kg/m³ is outside 50 … 25000 kg/m³; density is in kg/m³: steel is 7850, not 7.85"
        raise ValueError(msg)
    return value


def seen_from_the_scene(path: str, info: ValidationInfo) -> str:
    """Return the absolute path of a file or directory that a scene names relative to its own file."""
    if not path.isprintable():
        raise ValueError(f"{shown(path)} has characters that cannot be printed; give the path of a file or directory")
    folder = (info.context or {}).get("folder") or Path()
    return str((Path(folder) / path).resolve())


def reject_no_hash(value: str) -> str:
    """Return a SHA-256; raise ValueError if it is none."""
    if not re.fullmatch("[0-9a-f]{64}", value):
        raise ValueError(f"{shown(value)} is no SHA-256 of 64 digits; leave it out, it is filled in")
    return value


ScenePath = Annotated[str, Field(min_length=1), AfterValidator(seen_from_the_scene)]
Sha256 = Annotated[str, AfterValidator(reject_no_hash)]
# Numbers, from 0, of bodies in the order in which they were added.
BodyNumbers = Annotated[tuple[Annotated[int, Field(ge=0, lt=100_000)], ...], Field(min_length=1)]
# Wide physical limits: numbers beyond them are typing errors, or overflow in sums.
Length = Annotated[
    float, Field(ge=1e-6, json_schema_extra={"maximum": LONGEST_LENGTH}), AfterValidator(reject_wrong_unit)
]
Density = Annotated[
    float,
    Field(json_schema_extra={"minimum": 50, "maximum": 25000}),
    AfterValidator(reject_density_in_other_units),
]
Duration = Annotated[float, Field(ge=1e-6, le=1e6)]
Speed = Annotated[float, Field(ge=1e-9, le=1e3)]  # m/s
Turning = Annotated[float, Field(ge=1e-6, le=1e4)]  # rad/s
Frequency = Annotated[float, Field(ge=1e-3, le=1e4)]  # Hz
Stiffness = Annotated[float, Field(ge=1e-3, le=1e12)]  # N/m
Force = Annotated[float, Field(ge=1e-12, le=1e6)]  # N
HingeAngle = Annotated[
    float,
    Field(json_schema_extra={"minimum": HINGE_RANGE[0], "maximum": HINGE_RANGE[1]}),
    AfterValidator(in_hinge_range),
]
