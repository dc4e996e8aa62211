"""What is read from files that people write: no key that is not known, nothing taken for a number that is none."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal, get_args, get_origin

from pydantic import BaseModel, ConfigDict, model_validator
from pydantic.fields import FieldInfo

from dem.errors import nearest, shown

_WITH_UNIT = re.compile(r"\s*[-+]?[\d.]+(?:[eE][-+]?\d+)?\s*[^\W\d]\S*\s*")
_WITH_COMMA = re.compile(r"\s*[-+]?\d+,\d+\s*")


class Strict(BaseModel):
    """A frozen mapping of keys: no unknown ones, no NaN, no infinity, no silent conversion of text to numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def known_keys(cls) -> dict[str, FieldInfo]:
        """The keys as a file has them, in order."""
        return {field.alias or name: field for name, field in cls.model_fields.items()}

    @classmethod
    def nearest_key(cls, key: str) -> str:
        """The way out for an unknown key."""
        return nearest(key, sorted(cls.known_keys()))

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, data: Any) -> Any:
        if isinstance(data, Mapping):
            for key in data:
                if key not in cls.known_keys():
                    msg = f"unknown key {shown(key)}; {cls.nearest_key(str(key))}"
                    raise ValueError(msg)
        return data

    @model_validator(mode="before")
    @classmethod
    def _refuse_other_kinds_as_numbers(cls, data: Any) -> Any:
        # YAML reads `yes` and `on` as true, and true would pass as 1; "0.4" in quotes would pass as 0.4.
        if isinstance(data, Mapping):
            for key, value in data.items():
                field = cls.known_keys().get(str(key))
                if field is None or field.annotation is Any:
                    continue
                for item in value if isinstance(value, list) else [value]:
                    if isinstance(item, bool) and field.annotation is not bool:
                        msg = f"{key}: got the boolean {str(item).lower()}, expected {_kind(field.annotation)}"
                        raise ValueError(msg)
                    if isinstance(item, str) and _kind(field.annotation) == "a number":
                        msg = f"{key}: got the text {shown(item)}, expected a number; {_as_a_number(item)}"
                        raise ValueError(msg)
        return data


def _as_a_number(text: str) -> str:
    """What to do about text where a number is wanted."""
    try:
        number = float(text)
    except ValueError:
        pass
    else:
        return "leave out the quotes" if math.isfinite(number) else "write a finite one"
    if _WITH_COMMA.fullmatch(text):
        return f"write {text.strip().replace(',', '.')}, with a point"
    return "leave out the unit, which the key names" if _WITH_UNIT.fullmatch(text) else "write it in digits"


def _kind(annotation: Any) -> str:
    """What a key takes, in words; `annotation` is the type of its field."""
    parts = [annotation] if get_origin(annotation) is None else [*get_args(annotation)]
    parts = [get_args(part)[0] if get_origin(part) is Annotated else part for part in parts]
    if any(part in (int, float) for part in parts) and all(part in (int, float, type(None), ...) for part in parts):
        return "a number"
    if get_origin(annotation) is Literal:
        return " or ".join(map(repr, get_args(annotation)))
    models = [kind for kind in parts if isinstance(kind, type) and issubclass(kind, Strict)]
    return "keys and values" if models else "text" if annotation is str else "a value of its kind"
