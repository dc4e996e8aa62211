"""What is wrong with a file that pydantic refuses: one line with key, value with its unit, and the way out."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pydantic import ValidationError

from dem.errors import shown

# Words that may end a key, and how the unit that they spell is written.
_UNITS = {
    **{word: word for word in ("m", "s", "g", "w", "N", "kg", "rad", "deg")},
    **{"hz": "Hz", "m3": "m³", "s2": "s²", "per": "/"},
}
_OF_A_KEY = "[key]"  # how pydantic ends the place of a key that is wrong itself
_QUOTED = re.compile(r"'([^']*)'")
# A message that begins with a key is about that key, below the place that pydantic tells.
_OWN_KEY = re.compile(r"\w[\w.]*(?=: )")
_LONGEST_KEY = 60  # characters of a key that are shown
_MOST_ERRORS = 3  # that are told at once; who made more reads the file again anyway


def refusals(error: ValidationError, data: Any, *, described: str) -> str:
    """Pydantic's errors as `key: value and what is wrong with it; way out`, the first few of them in one line.

    Args:
        error: what pydantic found.
        data: what it was given.
        described: where the keys are described, for one that is missing.
    """
    told: dict[str, str] = {}
    filled: set[str] = set()  # places of values that the file does not hold
    for found in error.errors(include_url=False):
        # A default that follows from other keys is not asked for where one of them is wrong; that is no second error.
        # Nor is a list too short whose items are there, but wrong.
        if found["type"] == "default_factory_not_called" or (found["type"] == "too_short" and found["input"]):
            continue
        place = _key(found["loc"], data)
        text = _text(found["type"], found["msg"], found["input"], found.get("ctx", {}), unit_of(place))
        if found["type"] == "missing":
            text += f", see {described}"
        given = found["type"] == "missing" or _is_given(found["loc"], data)
        if place:
            place += "." if _OWN_KEY.match(text) else ": "
        told.setdefault(place, text)  # of one value, what was found first
        if not given:
            filled.add(place)
    # What was filled in from a value that is wrong is wrong in the same words, and no second error.
    said = {text for place, text in told.items() if place not in filled}
    lines = [place + text for place, text in told.items() if place not in filled or text not in said]
    more = f" (and {len(lines) - _MOST_ERRORS} more)" if len(lines) > _MOST_ERRORS else ""
    return "; also ".join(lines[:_MOST_ERRORS]) + more


def unit_of(key: str) -> str:
    """The unit that the end of a key spells, `m/s` of `phases.2.speed_m_per_s`; empty where it spells none."""
    words: list[str] = []
    for word in reversed(key.rpartition(".")[2].split("_")[1:]):
        if word not in _UNITS:
            break
        words.insert(0, _UNITS[word])
    return " ".join(words).replace(" / ", "/")


def _text(kind: str, message: str, value: Any, context: Mapping[str, Any], unit: str) -> str:
    """What is wrong with a value and what to do about it; `kind`, `message` and `context` are pydantic's."""
    if kind in _BOUNDS:
        name, words = _BOUNDS[kind]
        return f"{shown(value)} {unit}".rstrip() + f" is out of range; use {words} {context[name]:g} {unit}".rstrip()
    if kind in _TOLD:
        return _TOLD[kind](shown(value), value, context, unit)
    if kind == "value_error":
        return message.removeprefix("Value error, ")
    return f"{message[0].lower()}{message[1:]}, got {shown(value)}"


def _chosen(value: Any, choices: str) -> str:
    """The one of the choices that a value is nearly, or all of them; `choices` is pydantic's list of them."""
    close = difflib.get_close_matches(value, _QUOTED.findall(choices), n=1) if isinstance(value, str) else []
    return f"did you mean {close[0]!r}?" if close else f"use {choices}"


def _not_text(shown: str, value: Any, *_: Any) -> str:
    return f"{shown} is not text; " + ("write it in quotes" if isinstance(value, int | float) else "write some")


def _not_a_number(shown: str, unit: str, what: str = "a number") -> str:
    return f"{shown} is not {what}; give one" + (f" in {unit}" if unit else "")


def _items(count: int) -> str:
    return f"{count} item" + ("s" if count > 1 else "")


_BOUNDS = {
    "greater_than": ("gt", "more than"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "less than"),
    "less_than_equal": ("le", "at most"),
}

_TOLD: Mapping[str, Callable[[str, Any, Mapping[str, Any], str], str]] = {
    "missing": lambda *_: "missing; it has no default",
    "finite_number": lambda shown, _v, _c, unit: _not_a_number(shown, unit, "a finite number"),
    "float_type": lambda shown, _v, _c, unit: _not_a_number(shown, unit),
    "int_type": lambda shown, _v, _c, unit: _not_a_number(shown, unit, "a whole number"),
    "int_from_float": lambda shown, value, _c, _u: f"{shown} is not a whole number; use e.g. {round(value)}",
    "int_parsing_size": lambda shown, *_: f"{shown} is out of range; use a smaller one",
    "bool_type": lambda shown, *_: f"{shown} is neither true nor false; use one of them",
    "bool_parsing": lambda shown, *_: f"{shown} is neither true nor false; use one of them",
    "string_type": _not_text,
    "string_too_short": lambda shown, _v, context, _u: (
        f"{shown} is too short; use {context['min_length']} or more characters"
    ),
    "string_too_long": lambda shown, value, context, _u: (
        f"{shown} has {len(value)} characters; use at most {context['max_length']}"
    ),
    "literal_error": lambda shown, value, context, _u: f"{shown} is not known; {_chosen(value, context['expected'])}",
    "too_short": lambda _s, _v, context, _u: f"an empty list; give at least {_items(context['min_length'])}",
    "too_long": lambda shown, value, context, _u: (
        f"{shown} has {_items(len(value))}; give at most {_items(context['max_length'])}"
    ),
    "tuple_type": lambda shown, *_: f"{shown} is not a list; write its items in brackets, [ … ]",
    "list_type": lambda shown, *_: f"{shown} is not a list; write its items in brackets, [ … ]",
    "dict_type": lambda shown, *_: f"{shown} is not keys and values; write them as {{key: value}}",
    "model_type": lambda shown, *_: f"{shown} is not keys and values; write them as {{key: value}}",
    "model_attributes_type": lambda shown, *_: f"{shown} is not keys and values; write them as {{type: …}}",
    "union_tag_not_found": lambda shown, *_: (
        f"type: missing in {shown}; write which one it is, see `smarticles schema`"
    ),
    "union_tag_invalid": lambda _s, _v, context, _u: (
        f"type: {shown(context['tag'])} is not known; {_chosen(context['tag'], context['expected_tags'])}"
    ),
}


def _key(steps: Sequence[int | str], data: Any) -> str:
    """Pydantic's path to a value as the key of the scene file.

    Members of a discriminated union carry their tag, the value of `type`, as an extra step of the path; it is no key.
    """
    here, keys = data, []
    for step in steps:
        if isinstance(here, Mapping) and step not in here and here.get("type") == step:
            continue
        if step == _OF_A_KEY:
            continue
        keys.append(str(step) if len(str(step)) <= _LONGEST_KEY else f"{str(step)[:_LONGEST_KEY]}…")
        if isinstance(here, Mapping):
            here = here.get(step)
        elif isinstance(here, list) and isinstance(step, int):
            here = here[step] if step < len(here) else None  # one that is missing
    return ".".join(keys)


def _is_given(steps: Sequence[int | str], data: Any) -> bool:
    """Whether the file holds the value at the end of pydantic's path."""
    here = data
    for step in steps:
        if isinstance(here, Mapping) and step not in here and here.get("type") == step:
            continue
        if isinstance(here, Mapping):
            if step not in here:
                return False
            here = here[step]
        elif isinstance(here, list) and isinstance(step, int) and step < len(here):
            here = here[step]
    return True
