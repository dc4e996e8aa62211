"""Strict models of files that users write, and one-line messages for errors in such files."""

import difflib
import math
import re
from collections.abc import Mapping, Sequence
from numbers import Integral, Real
from typing import Annotated, Any, Literal, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator
from pydantic.fields import FieldInfo

from dem.errors import nearest, shown

_WITH_UNIT = re.compile(r"\s*[-+]?[\d.]+(?:[eE][-+]?\d+)?\s*[^\W\d]\S*\s*")
_WITH_COMMA = re.compile(r"\s*[-+]?\d+,\d+\s*")
# Words that may end a key, and how the unit that they spell is written.
_UNITS = {
    **{word: word for word in ("m", "cm", "mm", "um", "s", "ms", "g", "w", "N", "J", "Pa", "kg", "rad", "deg")},
    **{"hz": "Hz", "m2": "m²", "m3": "m³", "mm2": "mm²", "mm3": "mm³", "s2": "s²", "per": "/"},
}
_TAGS = ("type", "shape", "law")  # keys that say which member of a union a mapping is
_TAG_OF = {"particle": "shape", "joints": "law"}  # the one that a key needs; all others need `type`
_OTHER_WORDS = {
    **dict.fromkeys(("tap", "taps", "tapping"), ("shake", ", with the key taps")),
    **dict.fromkeys(("vibrate", "vibration", "jolt"), ("shake", "")),
    **dict.fromkeys(("pour", "drop", "fill", "insert", "create", "rain"), ("deposit", "")),
    **dict.fromkeys(("wait", "rest", "settle", "equilibrate", "hold"), ("relax", "")),
    **dict.fromkeys(("press", "squeeze", "piston"), ("compress", "")),
    **dict.fromkeys(("pull", "hook"), ("pull-hook", "")),
    **dict.fromkeys(("stretch", "elongate"), ("tension", "")),
    **dict.fromkeys(("collapse", "remove-wall", "open"), ("remove-container", "")),
    **dict.fromkeys(("restart", "continue", "load"), ("take-over", "")),
    **dict.fromkeys(("gait", "move", "swing"), ("actuate", "")),
    **dict.fromkeys(("stick", "bar", "needle", "cylinder"), ("rod", "")),
    **dict.fromkeys(("worm", "fibre", "fiber", "polymer"), ("filament", "")),
    "u": ("staple", ", which has the form of a smarticle"),
}
"""Words for types of phases and for shapes that users try, with the known word and what to add to it."""
_OF_A_KEY = "[key]"  # last step of pydantic's path if the key itself is wrong
# A message that begins with a key is about that key, within the place that pydantic reports.
_OWN_KEY = re.compile(r"\w[\w.]*(?=: )")
SAME = 1e-9
"""Ratio below which two numbers differ by rounding alone [-].

Sums and products in double precision, such as 0.1 + 0.2, are off by some 1e-16; files state numbers that differ with
fewer than nine digits."""

_LONGEST_KEY = 60  # characters of a key that are shown
_MOST_ERRORS = 3  # shown at once

_NO_LIST = "{shown} is not a list; write its items in brackets, [ … ]"
_NO_BOOLEAN = "{shown} is neither true nor false; use one of them"
_TEXTS = {
    "missing": "missing; it has no default",
    "greater_than": "{shown}{unit} is out of range; use more than {gt:g}{unit}",
    "greater_than_equal": "{shown}{unit} is out of range; use at least {ge:g}{unit}",
    "less_than": "{shown}{unit} is out of range; use less than {lt:g}{unit}",
    "less_than_equal": "{shown}{unit} is out of range; use at most {le:g}{unit}",
    "finite_number": "{shown} is not a finite number; give one{in_unit}",
    "float_type": "{shown} is not a number; give one{in_unit}",
    "int_type": "{shown} is not a whole number; give one{in_unit}",
    "int_from_float": "{shown} is not a whole number; use e.g. {rounded}",
    "int_parsing_size": "{shown} is out of range; use a smaller one",
    "bool_type": _NO_BOOLEAN,
    "bool_parsing": _NO_BOOLEAN,
    "string_type": "{shown} is not text; {text_way_out}",
    "string_too_short": "{shown} is too short; use {min_length} or more characters",
    "string_too_long": "{shown} has {length} characters; use at most {max_length}",
    "literal_error": "{shown} is not known; {choice}",
    "too_short": "an empty list; give at least {least}",
    "too_long": "{shown} has {items}; give at most {most}",
    "tuple_type": _NO_LIST,
    "list_type": _NO_LIST,
    "dict_type": "{shown} is not keys and values; write them as {{key: value}}",
    "model_type": "{shown} is not keys and values; write them as {{key: value}}",
    "model_attributes_type": "{shown} is not keys and values; write them as {{{tag_key}: …}}",
    "union_tag_not_found": "{tag_key}: missing in {shown}; write which one it is, see `smarticles keys`",
    "union_tag_invalid": "{tag_key}: {shown_tag} is not known; {choice}",
}
"""Message for each of pydantic's types of error; `_text` fills in the fields in braces."""


class Strict(BaseModel):
    """A frozen mapping of keys that rejects unknown keys, NaN, infinity, and text in place of numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def known_keys(cls) -> dict[str, FieldInfo]:
        """Return the fields of the model by their key in a file, in the order of their declaration."""
        return {field.alias or name: field for name, field in cls.model_fields.items()}

    @classmethod
    def nearest_key(cls, key: str) -> str:
        """Return advice about an unknown key: the nearest known key, or else all known keys."""
        return nearest(key, sorted(cls.known_keys()))

    @model_validator(mode="before")
    @classmethod
    def _reject_unknown_keys_and_other_kinds(cls, data: Any) -> Any:
        # YAML reads `yes` and `on` as true, and true would pass as 1; "0.4" in quotes would pass as 0.4.
        if not isinstance(data, Mapping):
            return data
        known = cls.known_keys()
        for key, value in data.items():
            if key not in known:
                continue
            annotation = known[key].annotation
            for item in value if isinstance(value, list) else [value]:
                if isinstance(item, bool) and annotation not in (bool, Any):
                    raise ValueError(f"{key}: got the boolean {str(item).lower()}, expected {_kind(annotation)}")
                if isinstance(item, str) and _kind(annotation) == "a number":
                    raise ValueError(f"{key}: got the text {shown(item)}, expected a number; {_as_a_number(item, key)}")
        for key in data:
            if key not in known:
                raise ValueError(f"unknown key {shown(key)}; {cls.nearest_key(str(key))}")
        return data


def _as_a_number(text: str, key: str) -> str:
    """Return advice about text in the place of the number of a key."""
    try:
        return "leave out the quotes" if math.isfinite(float(text)) else "write a finite one"
    except ValueError:
        pass
    if _WITH_COMMA.fullmatch(text):
        return f"write {text.strip().replace(',', '.')}, with a point"
    has_unit = unit_of(key)[1] and _WITH_UNIT.fullmatch(text)
    return "leave out the unit, which the key names" if has_unit else "write it in digits"


def _kind(annotation: Any) -> str:
    """Return in words the kind of values that a field with this annotation accepts."""
    parts = [annotation] if get_origin(annotation) is None else [*get_args(annotation)]
    parts = [get_args(part)[0] if get_origin(part) is Annotated else part for part in parts]
    if any(part in (int, float) for part in parts) and all(part in (int, float, type(None), ...) for part in parts):
        return "a number"
    if get_origin(annotation) is Literal:
        return " or ".join(map(repr, get_args(annotation)))
    models = [kind for kind in parts if isinstance(kind, type) and issubclass(kind, Strict)]
    return "keys and values" if models else "text" if annotation is str else "a value of its kind"


def explained(error: ValidationError, data: Any, *, described: str) -> str:
    """Return pydantic's first errors in one line, each as `key: value and what is wrong; what to do`.

    `data` was validated; `described` is the command or page that describes the keys, for the message.
    """
    texts: dict[str, str] = {}
    filled: set[str] = set()  # places of values that the file does not hold
    for found in error.errors(include_url=False):
        # Missing defaults that follow from a wrong key are no second error, nor are lists that lack only wrong items.
        if found["type"] == "default_factory_not_called" or (found["type"] == "too_short" and found["input"]):
            continue
        place, given = _place(found["loc"], data)
        names = [step for step in found["loc"] if isinstance(step, str)]
        context = {"discriminator": _TAG_OF.get(names[-1] if names else "", "type")} | found.get("ctx", {})
        text = _text(found["type"], found["msg"], found["input"], context, unit_of(place.rpartition(".")[2])[1])
        if found["type"] == "missing":
            text, given = f"{text}, see {described}", True
        if place:
            place += "." if _OWN_KEY.match(text) else ": "
        texts.setdefault(place, text)  # the first error of a value
        if not given:
            filled.add(place)
    # A default that follows from a wrong value has an identical message, which is no second error.
    reported = {text for place, text in texts.items() if place not in filled}
    lines = [place + text for place, text in texts.items() if place not in filled or text not in reported]
    more = f" (and {len(lines) - _MOST_ERRORS} more)" if len(lines) > _MOST_ERRORS else ""
    return "; also ".join(lines[:_MOST_ERRORS]) + more


def equal(one: Any, other: Any) -> bool:
    """Return whether two values of files are equal: numbers to `SAME`, whole ones exactly; a boolean is no number."""
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(equal(value, other[key]) for key, value in one.items())
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        return len(one) == len(other) and all(map(equal, one, other))
    if isinstance(one, bool) or isinstance(other, bool):
        return one is other
    if isinstance(one, Integral) and isinstance(other, Integral):
        return int(one) == int(other)
    if isinstance(one, Real) and isinstance(other, Real):
        return math.isclose(float(one), float(other), rel_tol=SAME)
    return bool(one == other)


def unit_of(key: str) -> tuple[str, str]:
    """Split a key into name and unit: ("speed", "m/s") for `speed_m_per_s`."""
    words = key.split("_")
    count = len(words)
    while count > 1 and words[count - 1] in _UNITS:
        count -= 1
    unit = " ".join(_UNITS[word] for word in words[count:]).replace(" / ", "/")
    return "_".join(words[:count]), re.sub("^/ ", "1/", unit)


def _text(kind: str, message: str, value: Any, context: Mapping[str, Any], unit: str) -> str:
    """Return what is wrong with a value, and advice to the user.

    `kind`, `message` and `context` are pydantic's; `unit` is that of the value, "" for none.
    """
    if kind == "value_error":
        return message.removeprefix("Value error, ")
    if kind not in _TEXTS:
        return f"{message[0].lower()}{message[1:]}, got {shown(value)}"
    number = isinstance(value, int | float)
    choices, chosen = context.get("expected_tags", context.get("expected", "")), context.get("tag", value)
    words = re.findall("'([^']*)'", choices)
    # Of several near words the one that begins alike is meant: relax, not release, by 'relaks'.
    close = difflib.get_close_matches(chosen, words) if isinstance(chosen, str) else []
    close.sort(key=lambda word: -sum(str(chosen).startswith(word[: k + 1]) for k in range(len(word))))
    other, addition = _OTHER_WORDS.get(chosen.lower(), ("", "")) if isinstance(chosen, str) else ("", "")
    if other not in words:
        other, addition = (close[0], "") if close else ("", "")
    length = len(value) if hasattr(value, "__len__") else 0
    items, least, most = (
        f"{count} item" + ("s" if count != 1 else "")
        for count in (length, context.get("min_length"), context.get("max_length"))
    )
    text = _TEXTS[kind].format(
        **context,
        shown=shown(value),
        shown_tag=shown(context.get("tag")),
        tag_key=str(context.get("discriminator", "type")).strip("'"),
        unit=f" {unit}" if unit else "",
        in_unit=f" in {unit}" if unit else "",
        rounded=round(value) if isinstance(value, float) and math.isfinite(value) else "",
        length=length,
        items=items,
        least=least,
        most=most,
        text_way_out="write it in quotes" if number else "write some",
        choice=f"did you mean {other!r}{addition}?" if other else f"use {choices}",
    )
    return text + (in_radians(value) if unit == "deg" and "out of range" in text else "")


def in_radians(angle: float) -> str:
    """Return, as the end of a message, what a wrong number of degrees would be in radians; "" if it is too large."""
    return f"; {angle:g} rad are {math.degrees(angle):.4g} deg" if 0 < abs(angle) <= 2 * math.pi else ""


def _place(steps: Sequence[int | str], data: Any) -> tuple[str, bool]:
    """Return pydantic's path to a value as a key of the file, and whether the file holds the value.

    In a discriminated union the path has an extra step, the value of `type`, `shape` or `law`, which is no key.
    """
    node, keys, given = data, [], True
    for step in steps:
        if isinstance(node, Mapping) and step not in node and step in map(node.get, _TAGS):
            continue
        if isinstance(node, Mapping) and isinstance(step, int):
            continue  # one item that the file gives without a list
        if step == _OF_A_KEY:
            given = False
            continue
        keys.append(str(step) if len(str(step)) <= _LONGEST_KEY else f"{str(step)[:_LONGEST_KEY]}…")
        if isinstance(node, Mapping):
            given &= step in node
            node = node.get(step)
        elif isinstance(node, list) and isinstance(step, int):
            node = node[step] if step < len(node) else None
    return ".".join(keys), given
