"""What is wrong with a file that pydantic refuses, in one line."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from pydantic import BaseModel, ValidationError

from dem.errors import nearest

Models = Mapping[tuple[str, ...], type[BaseModel]]
"""Place in the file -> its model; `*` stands for any name."""


def explain(error: ValidationError, path: Path, models: Models, advice: str) -> str:
    """File, key, value and way out of the first thing that is wrong.

    Args:
        error: what pydantic found.
        path: the file.
        models: the model of every table in it, for suggestions.
        advice: where a missing key is described.
    """
    # A misspelt key is also a missing one: the spelling tells more.
    unknown_first = sorted(error.errors(include_url=False), key=lambda item: item["type"] != "extra_forbidden")
    first = unknown_first[0]
    place = tuple(str(step) for step in first["loc"])
    key = ".".join(place) or "the file"
    if first["type"] == "extra_forbidden":
        return f"{path}: {key}: unknown key; {nearest(place[-1], sorted(_keys(_model_of(place[:-1], models))))}"
    if first["type"] == "missing":
        return f"{path}: {key}: missing; add it ({advice})"
    text = re.sub(r"^Value error, ", "", first["msg"])
    if first["type"] == "value_error":
        return f"{path}: {key}: {text}"
    more = f" (and {error.error_count() - 1} more)" if error.error_count() > 1 else ""
    return f"{path}: {key}: {text}: got {first['input']!r}{more}"


def _model_of(place: tuple[str, ...], models: Models) -> type[BaseModel]:
    for pattern, model in models.items():
        if len(pattern) == len(place) and all(p in ("*", step) for p, step in zip(pattern, place, strict=True)):
            return model
    return models[()]


def _keys(model: type[BaseModel]) -> Iterator[str]:
    for name, field in model.model_fields.items():
        yield field.alias or name
