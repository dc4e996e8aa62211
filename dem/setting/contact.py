"""Contact parameters of a scene, which may be read from a file that the scene names."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml
from pydantic import Field, ValidationError

from dem.errors import shown
from dem.setting.part import Part
from dem.strict import explained
from dem.yaml_text import load_yaml, read_text

PRESET = "preset"  #: Key of `contact` that names a file of contact parameters


class Contact(Part):
    """Friction, restitution and damping at contacts of smarticles with each other and the container."""

    friction_smarticle: float = Field(0.4, ge=0, le=10, description="Coulomb coefficient, smarticle-smarticle [1]")
    friction_wall: float = Field(0.4, ge=0, le=10, description="Coulomb coefficient, smarticle-container [1]")
    restitution: float = Field(
        0.7,
        ge=0.01,
        le=1,
        description="normal coefficient of restitution of a single contact at the typical effective mass, the harmonic "
        "mean over the smarticle's spheres and directions [1]; 0.7: steel on steel below 1 m/s",
    )
    tangential_stiffness_ratio: float = Field(
        0.82, ge=1e-3, le=1, description="ks/kn [1]; Mindlin's 2(1-ν)/(2-ν) is 0.82 for steel, ν = 0.3"
    )
    tangential_damping_ratio: float = Field(
        0.9,
        ge=0,
        le=1,
        description="cs/cn of a sticking contact [1]; √(ks/kn) = 0.9 damps both directions by the same ratio",
    )


def with_preset(data: Any, folder: Path | None) -> Any:
    """Return a scene's data, not yet validated, with the values of the file that `contact.preset` names.

    Keys that the scene gives beside `preset` have priority over those of the file. Its path is relative to `folder`;
    None: the working directory. ValueError if the file cannot be read, or does not hold valid keys of `contact`.
    """
    contact = data.get("contact") if isinstance(data, Mapping) else None
    if not isinstance(contact, Mapping) or PRESET not in contact:
        return data
    named = contact[PRESET]
    where = f"contact.{PRESET}"
    if not isinstance(named, str) or not named:
        raise ValueError(f"{where}: {shown(named)} is not text; give the path of a file of contact parameters")
    file = (folder or Path()) / named
    try:
        values = load_yaml(read_text(file))
    except OSError as error:
        raise ValueError(f"{where}: {file} cannot be read ({error.strerror}); give the path of a preset") from None
    except (UnicodeDecodeError, yaml.YAMLError) as error:
        cause = " ".join(str(getattr(error, "problem", None) or error).split())
        msg = f"{where}: {file} is not YAML; give a file that `smarticles calibrate` wrote ({cause})"
        raise ValueError(msg) from None
    if not isinstance(values, Mapping):
        raise ValueError(f"{where}: {file} holds {shown(values)}, not keys of `contact` with their values; correct it")
    try:
        Contact.model_validate(values)
    except ValidationError as error:
        raise ValueError(
            f"{where}: {file}: {explained(error, values, described='`smarticles keys contact`')}"
        ) from None
    return {**data, "contact": {**values, **{key: value for key, value in contact.items() if key != PRESET}}}
