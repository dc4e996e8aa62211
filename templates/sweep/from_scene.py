"""Make a sweep from a scene and the keys that change: the text of its template, and its variables."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel

from dem.arrays import plain
from dem.errors import InputError, shown
from dem.scene.keys import put
from dem.setting.contact import PRESET
from templates.sweep.render import Value
from templates.sweep.sweep_file import SEED

_IN_A_NAME = re.compile(r"[A-Za-z0-9._+=-]*\Z")  # what names of runs consist of
_OF_A_FILE = re.compile(rf"contact\.{PRESET}|phases\.\d+\.(run|file)")  # keys whose value is a path
_LONGEST_NUMBER = 8  # characters of a number in names of runs; longer ones are rounded


@dataclass(frozen=True, kw_only=True)
class Variable:
    """A key of a scene that changes in a sweep, with its values."""

    source: str  #: Argument that gave the key, for messages: `vary` or `zip`
    key: str  #: Key of the scene, with dots for nesting
    name: str  #: Name of the variable
    values: Sequence[Value]  #: Values in the order of the sweep, or their names
    named: Mapping[str, Value] | None = None  #: Values by their names; None: values have no names

    @property
    def expression(self) -> str:
        """Expression of the value in a template."""
        return f"{{{{ {self.name} }}}}" if self.named is None else f"{{{{ {dict(self.named)!r}[{self.name}] }}}}"

    @property
    def in_run_name(self) -> str:
        """Part of the template of run names: name and value, or the name of a value alone."""
        if self.named is not None:
            return f"{{{{ {self.name} }}}}"
        if any(isinstance(value, list) for value in self.values):
            return f"{self.name}{{{{ {self.name} | join('_') }}}}"
        digits = _digits(self.values)
        form = "" if digits is None else f"'%.{digits}g' % "
        return f"{self.name}{{{{ {form}{self.name} }}}}"


def _digits(values: Sequence[Value]) -> int | None:
    """Return the fewest significant digits, from 3, that distinguish numbers; None if all of them are short."""
    if not all(type(value) in (int, float) for value in values):
        return None
    if all(isinstance(value, int) or len(str(value)) <= _LONGEST_NUMBER for value in values):
        return None
    return next(n for n in range(3, 18) if len({f"{value:.{n}g}" for value in values}) == len(set(values)))


def variables(vary: Mapping[str, Any], zipped: Mapping[str, Any]) -> list[Variable]:
    """Return the variables of a sweep over keys of a scene, those of `zipped` first.

    `vary` and `zipped` have lists of values, or mappings of names to values, by key of the scene. A variable is named
    by the last word of its key, or by all words if two keys end alike. InputError if values are none of these.
    """
    sources = {"zip": zipped, "vary": vary}
    for source, given in sources.items():
        if not isinstance(given, Mapping):
            raise InputError(f"{source}: {shown(given)} is no mapping; give values by key, e.g. {{'seed': [1, 2, 3]}}")
        if other := [key for key in given if not isinstance(key, str)]:
            raise InputError(f"{source}: {shown(other[0])} is no text; give a key of the scene, e.g. 'seed'")
    if both := [key for key in vary if key in zipped]:
        raise InputError(f"zip: {both[0]}: is in vary, too; leave it out of one of them")
    keys = [*zipped, *vary]
    for key in keys:
        if inner := [other for other in keys if other.startswith(f"{key}.")]:
            raise InputError(
                f"{'zip' if inner[0] in zipped else 'vary'}: {inner[0]}: is part of {key}, which varies, too"
            )
    last = [key.rpartition(".")[2] for key in keys]
    names = {
        key: word if last.count(word) == 1 and not word.isdigit() else key.replace(".", "_")
        for key, word in zip(keys, last, strict=True)
    }
    found = [
        _variable(source, key, names[key], values) for source, given in sources.items() for key, values in given.items()
    ]
    lengths = {variable.key: len(variable.values) for variable in found if variable.source == "zip"}
    if SEED in lengths:
        raise InputError("zip: seed: seeds repeat all points; give them in vary, {'seed': [1, 2, 3]}")
    if len(set(lengths.values())) > 1:
        counts = ", ".join(f"{key} has {length}" for key, length in lengths.items())
        raise InputError(f"zip: numbers of values differ: {counts}; give each key as many")
    return found


def _variable(source: str, key: str, name: str, given: Any) -> Variable:
    where = f"{source}: {key}"
    given = plain(given)
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise InputError(f"{where}: {shown(given)} is one value; give a list of values, e.g. [{given!r}]")
    if isinstance(given, set | frozenset):
        raise InputError(f"{where}: {shown(given)} has no order; give a list")
    named = given if isinstance(given, Mapping) else None
    listed = list(given if named is None else named.values())
    if not listed:
        raise InputError(f"{where}: has no values; give one at least")
    if named is not None and key == SEED:
        raise InputError(f"{where}: seeds have no names; give a list, e.g. {listed}")
    values = [_value(where, key, value) for value in listed]
    for value in listed if named is None else named:
        _check_for_run_names(where, key, value, named is not None)
    if named is None:
        return Variable(source=source, key=key, name=name, values=values)
    return Variable(source=source, key=key, name=name, values=list(named), named=dict(zip(named, values, strict=True)))


def _value(where: str, key: str, value: Any) -> Value:
    """Return a value as plain data, with an absolute path for keys of files; InputError if it is no data."""
    value = plain(value)
    if isinstance(value, BaseModel):  # part of a scene
        return value.model_dump(mode="json", exclude_unset=True)
    if isinstance(value, Mapping):
        return {str(name): _value(where, f"{key}.{name}", item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_value(where, f"{key}.{number}", item) for number, item in enumerate(value)]
    if isinstance(value, str) and _OF_A_FILE.fullmatch(key):
        return str(Path(value).resolve())
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError(f"{where}: {shown(value)} is not a finite number; leave it out")
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise InputError(f"{where}: {shown(value)} is of type {type(value).__name__}; give numbers, text, lists, mappings")


def _check_for_run_names(where: str, key: str, value: Value, is_name: bool) -> None:
    """Raise InputError if a value, or the name of a value, cannot be part of the names of runs."""
    if is_name and not (isinstance(value, str) and value and _IN_A_NAME.match(value)):
        raise InputError(f"{where}: {shown(value)} cannot name a value; use letters, digits and . _ + = -")
    items = value if isinstance(value, list | tuple) else [value]
    if any(isinstance(item, Mapping | list | tuple | BaseModel) or not _IN_A_NAME.match(str(item)) for item in items):
        raise InputError(
            f"{where}: {shown(value)} cannot be part of the name of a run; give values with names, "
            f"{{{key!r}: {{'NAME': VALUE, …}}}}"
        )


def varied_template(data: Any, changing: Sequence[Variable], source: str) -> str:
    """Return the text of a template for a sweep over `changing`; the other arguments are those of `as_template`."""
    text = as_template(data, {variable.key: variable.name for variable in changing}, source)
    for variable in changing:
        text = text.replace(f"{{{{ {variable.name} }}}}", variable.expression)
    return text


def as_template(data: Any, names: Mapping[str, str], source: str) -> str:
    """Return the text of a template for a sweep: a scene in YAML with variables in place of some values.

    InputError if the scene, `data`, which is changed in place, has text that a template would execute, or lacks a key.
    `names` are those of variables by the key whose value they replace; dots separate nested keys, as in `motor.law`.
    """
    text = _dumped(data)
    for mark in ("{{", "{%", "{#"):
        if mark in text:
            raise InputError(f"{source}: contains {mark!r}, which is template syntax; remove it")
    for key, name in names.items():
        try:
            put(data, key, f"{{{{ {name} }}}}")
        except InputError as error:
            raise InputError(f"{source}: {error}") from None
    text = _dumped(data)
    for name in names.values():
        text = text.replace(f"'{{{{ {name} }}}}'", f"{{{{ {name} }}}}")
    return text


def _dumped(data: Any) -> str:
    return str(yaml.safe_dump(data, sort_keys=False, allow_unicode=True))
