"""The sweep file: which scenes one template makes.

schema_version: 1
name: friction                      # what the sweep is called
template: scene.yaml.j2             # Jinja2 template of a scene, beside this file
run_name: "mu{{ '%.1f' | format(friction) }}_seed{{ seed }}"
constants: {count: 100}             # the same in every point
points:                             # any of these; several are crossed with each other
  table: {file: counts.csv, only: {l_over_w: [0.4, 0.7]}}   # rows of a CSV file, all or some
  list: [{friction: 0.4, count: 100}]                       # points written out
  zip: {friction: [0.2, 0.4], count: [90, 100]}             # first with first, second with second
  grid: {friction: [0.2, 0.4], count: [90, 100]}            # every combination
derived: {half: "(count / 2) | round | int"}                # expressions, in order
repeats: {seeds: [1, 2, 3]}         # each point once per seed; the variable is `seed`
                                    # `seed_by_seed: true` beside it: all points with the first seed come first
                                    # `more: {seeds: [4], only: {friction: [0.2]}}`: more of some points, afterwards
again: {constants: {engine: yade}, only: {friction: [0.2], seed: [1]}}   # some of the points once more, changed
variants:                           # JSON merge patches (RFC 7386) of this file; null removes a key
  quick: {constants: {count: 20}, repeats: {seeds: [1]}}    # FILE@quick; FILE@code,quick applies two, in this order
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from pydantic import AfterValidator, Field, ValidationError, field_validator, model_validator

from dem.errors import InputError, nearest, shown
from dem.scene.yaml_text import parse_yaml
from dem.strict import Strict, explained
from templates.sweep.files import IDENTIFIER, parse_table, read_text
from templates.sweep.render import Value

SEED = "seed"
_RESERVED = {SEED, "loop", "true", "false", "none", "True", "False", "None"}


def _names(mapping: Mapping[str, Any]) -> Mapping[str, Any]:
    for name in mapping:
        if not IDENTIFIER.match(name) or name in _RESERVED:
            msg = (
                f"{name!r} cannot name a variable: use letters, digits and _, "
                f"and none of {', '.join(sorted(_RESERVED))}"
            )
            raise ValueError(msg)
    return mapping


def _finite(value: Value) -> Value:
    if isinstance(value, float) and not math.isfinite(value):
        msg = f"{value!r} is not a finite number"
        raise ValueError(msg)
    if isinstance(value, list):
        for item in value:
            _finite(item)
    return value


class Table(Strict):
    """Points from the rows of a CSV file."""

    file: str = Field(description="CSV file; a relative path starts at the sweep file")
    only: dict[str, list[Value]] = Field(default={}, description="keep the rows whose column holds one of these values")


class Points(Strict):
    """Where the points come from. Several sources are crossed; later ones vary faster."""

    table: Table | None = None
    list_: list[dict[str, Value]] | None = Field(default=None, alias="list", min_length=1)
    zip_: dict[str, list[Value]] | None = Field(default=None, alias="zip", min_length=1)
    grid: dict[str, list[Value]] | None = Field(default=None, min_length=1)

    @model_validator(mode="after")
    def _check(self) -> Points:
        if self.table is None and self.list_ is None and self.zip_ is None and self.grid is None:
            msg = "no points: give at least one of table, list, zip, grid"
            raise ValueError(msg)
        for row in self.list_ or []:
            if set(row) != set((self.list_ or [row])[0]):
                msg = f"list: every point needs the same variables: got {row!r}"
                raise ValueError(msg)
        for columns in (self.zip_, self.grid, *(self.list_ or [])):
            _names(columns or {})
        for source, columns in (("zip", self.zip_), ("grid", self.grid)):
            for name, values in (columns or {}).items():
                _finite(values)
                if not values:
                    msg = f"{source}: {name} has no values"
                    raise ValueError(msg)
        lengths = {name: len(values) for name, values in (self.zip_ or {}).items()}
        if len(set(lengths.values())) > 1:
            msg = f"zip: lists of unequal length: got {lengths}"
            raise ValueError(msg)
        return self


def _once_each(seeds: tuple[int, ...]) -> tuple[int, ...]:
    if len(set(seeds)) != len(seeds):
        msg = f"a seed is given twice: got {list(seeds)}"
        raise ValueError(msg)
    return seeds


Seeds = Annotated[tuple[int, ...], AfterValidator(_once_each)]


class MoreSeeds(Strict):
    """Further seeds of some points, where an answer asks for them; after those that all points have."""

    seeds: Seeds = Field(min_length=1, description="seeds beside those of all points, one run each")
    only: dict[str, list[Value]] = Field(
        min_length=1, description="the points whose variable holds one of these values"
    )


class Repeats(Strict):
    """The same point with other random numbers."""

    seeds: Seeds = Field(min_length=1, description="seeds of the scene, one run each")
    seed_by_seed: bool = Field(
        default=False,
        description="start every point with the first seed before any with the second, so that what is there when the "
        "sweep is interrupted covers all points",
    )
    more: MoreSeeds | None = None

    @model_validator(mode="after")
    def _others(self) -> Repeats:
        shared = [seed for seed in self.more.seeds if seed in self.seeds] if self.more else []
        if shared:
            msg = f"more.seeds: {shared[0]} is one of `seeds` already; leave it out of one of them"
            raise ValueError(msg)
        return self


class Again(Strict):
    """Some of the points once more, with other constants, after all others; such as on another engine."""

    constants: dict[str, Value] = Field(min_length=1, description="constants that differ there")
    only: dict[str, list[Value]] = Field(
        default={}, description="the points whose variable holds one of these values; the seed is one of them"
    )


class SweepFile(Strict):
    """What a sweep file says, validated."""

    schema_version: Literal[1]
    name: str = Field(min_length=1)
    template: str = Field(description="scene template; a relative path starts at the sweep file")
    run_name: str = Field(description="Jinja2 text that names a run's directory")
    constants: dict[str, Value] = Field(default={})
    points: Points
    derived: dict[str, Value] = Field(default={})
    repeats: Repeats | None = None
    again: Again | None = None
    variants: dict[str, dict[str, Any]] = Field(default={}, description="merge patches of this file, by name")

    @model_validator(mode="after")
    def _known(self) -> SweepFile:
        for name in self.again.constants if self.again else ():
            if name not in self.constants:
                msg = f"again.constants: {name!r} is none of the constants; add it there"
                raise ValueError(msg)
        return self

    @field_validator("derived")
    @classmethod
    def _expressions(cls, mapping: dict[str, Value]) -> dict[str, Value]:
        for name, value in mapping.items():
            if not isinstance(value, str | int | float | bool):
                msg = (
                    f'{name}: {value!r} is neither an expression nor a number; write it in quotes, "(count / 2) | int"'
                )
                raise ValueError(msg)
        return mapping

    @field_validator("constants", "derived")
    @classmethod
    def _variables(cls, mapping: dict[str, Value]) -> dict[str, Value]:
        for value in _names(mapping).values():
            _finite(value)
        return mapping


@dataclass(frozen=True, kw_only=True)
class Sweep:
    """A sweep file and everything it refers to.

    Args:
        path: the sweep file.
        text: its text.
        content: what it says.
        template: path of the scene template.
        template_text: its text.
        table: rows of the table, those that are kept; empty without a table.
        table_path: the table's file, or None.
        table_text: the table's text, or None.
    """

    path: Path
    text: str
    content: SweepFile
    template: Path
    template_text: str
    table: tuple[Mapping[str, Value], ...] = ()
    table_path: Path | None = None
    table_text: str | None = None


VARIANT = "@"
"""Stands between a sweep file and the names of its variants, which commas separate: `strength.yaml@code,quick`."""


def load_sweep(path: Path) -> Sweep:
    """Read a sweep file, its template and its table.

    Args:
        path: The file; `FILE@VARIANT` applies one of its variants, `FILE@VARIANT,VARIANT` several in this order.

    Raises:
        InputError: a file is missing or malformed, a key or variant unknown, a value out of range.
    """
    name, _, variants = path.name.partition(VARIANT)
    text = read_text(path.with_name(name), "sweep file")
    data = parse_yaml(text, str(path))
    if variants and isinstance(data, dict):
        data = _varied(path, data, variants.split(","))
        # The resolved file, so that the record of a sweep is complete.
        text = yaml.safe_dump(data, sort_keys=False, allow_unicode=True)
    if not isinstance(data, dict):
        msg = f"{path}: a sweep file holds keys such as template and points: got {shown(data)}"
        raise InputError(msg)
    if "phases" in data and "points" not in data:
        msg = f"{path}: is one scene, not a sweep file; give it to `smarticles run` or `smarticles plan`"
        raise InputError(msg)
    try:
        content = SweepFile.model_validate(data)
    except ValidationError as error:
        msg = f"{path}: {explained(error, data, described='`smarticles sweep --help`')}"
        raise InputError(msg) from error
    template = path.parent / content.template
    table, table_path, table_text = _read_table(path, content.points.table)
    return Sweep(
        path=path,
        text=text,
        content=content,
        template=template,
        template_text=read_text(template, "scene template"),
        table=tuple(table),
        table_path=table_path,
        table_text=table_text,
    )


def _varied(path: Path, data: Mapping[str, Any], variants: Sequence[str]) -> dict[str, Any]:
    patches = data.get("variants") or {}
    varied = {key: value for key, value in data.items() if key != "variants"}
    for variant in variants:
        if variant not in patches:
            known = nearest(variant, sorted(patches)) if patches else "it has none"
            msg = f"{path}: there is no variant {variant!r}; {known}"
            raise InputError(msg)
        varied = {
            **merged(varied, patches[variant]),
            "name": patches[variant].get("name", f"{varied['name']}-{variant}"),
        }
    return varied


def merged(value: Any, patch: Any) -> Any:
    """Apply a JSON merge patch (RFC 7386): mappings are merged, null removes a key, all else replaces."""
    if not isinstance(patch, Mapping):
        return patch
    result = dict(value) if isinstance(value, Mapping) else {}
    for key, part in patch.items():
        if part is None:
            result.pop(key, None)
        else:
            result[key] = merged(result.get(key), part)
    return result


def with_constants(sweep: Sweep, constants: Mapping[str, Value]) -> Sweep:
    """The same sweep with other values for some of its constants.

    Raises:
        InputError: the sweep has no such constant.
    """
    for name in constants:
        if name not in sweep.content.constants:
            msg = f"{sweep.path}: constants: there is no {name!r}; {nearest(name, sorted(sweep.content.constants))}"
            raise InputError(msg)
    content = sweep.content.model_copy(update={"constants": {**sweep.content.constants, **constants}})
    return replace(sweep, content=content)


ENGINE = "engine"
"""The constant of a sweep that names the engine of its scenes."""


def on_engine(sweep: Sweep, engine: str) -> Sweep:
    """The same sweep with all its runs on one engine: nothing is run again on another.

    Raises:
        InputError: the sweep has no constant that names its engine.
    """
    content = sweep.content
    points = content.points
    columns = [*(sweep.table or [{}])[0], *(points.zip_ or {}), *(points.grid or {}), *(points.list_ or [{}])[0]]
    if ENGINE in columns:
        msg = f"{sweep.path}: points: 'engine' is a variable, so its runs are on several; leave --engine {engine} out"
        raise InputError(msg)
    if ENGINE not in content.constants:
        msg = (
            f"{sweep.path}: constants: there is no 'engine' that could be {engine}; add `engine: yade` there, and "
            f"`engine: {{{{ engine }}}}` to {sweep.template}"
        )
        raise InputError(msg)
    again = content.again
    if again is not None and ENGINE in again.constants:
        again = None
    constants = {**content.constants, ENGINE: engine}
    return replace(sweep, content=content.model_copy(update={"constants": constants, "again": again}))


def _read_table(path: Path, table: Table | None) -> tuple[list[dict[str, Value]], Path | None, str | None]:
    if table is None:
        return [], None, None
    file = path.parent / table.file
    text = read_text(file, "table")
    rows = parse_table(text, str(file))
    for row in rows:
        try:
            for value in _names(row).values():
                _finite(value)
        except ValueError as error:
            msg = f"{file}: {error}"
            raise InputError(msg) from error
    for column, wanted in table.only.items():
        if column not in rows[0]:
            msg = f"{path}: points.table.only.{column}: no such column; {nearest(column, sorted(rows[0]))}"
            raise InputError(msg)
        present = [row[column] for row in rows]
        for value in wanted:
            if value not in present:
                msg = (
                    f"{path}: points.table.only.{column}: {value!r} is not in {file}; "
                    f"it has {', '.join(map(str, present))}"
                )
                raise InputError(msg)
        rows = [row for row in rows if row[column] in wanted]
    if not rows:
        msg = f"{path}: points.table.only: keeps no row of {file}; give fewer conditions"
        raise InputError(msg)
    return rows, file, text
