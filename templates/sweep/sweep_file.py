"""Read sweep files, which make many scenes from one template.

`smarticles sweep --help` shows a sweep file with all its keys. Variants are JSON merge patches (RFC 7386) of the file:
FILE@quick applies the variant `quick`, FILE@code,quick applies `code` and then `quick`.
"""

import csv
import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import yaml
from pydantic import AfterValidator, Field, ValidationError, field_validator, model_validator

from dem.errors import InputError, nearest, shown
from dem.strict import Strict, equal, explained
from dem.yaml_text import parse_yaml
from templates.sweep.render import Value

SEED = "seed"
LONGEST_TABLE = 10_000_000  # characters; a table of 100 000 points, more than a sweep can compute, is shorter
ENGINE = "engine"  #: The constant of a sweep that names the engine of its scenes
_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")
_BOOLEANS = {"true": True, "false": False}
_WHOLE = re.compile(r"[-+]?(?:0|[1-9][0-9]{0,999})\Z")
_NUMBER = re.compile(r"[-+]?(?:(?:(?:0|[1-9][0-9]*)(?:\.[0-9]*)?|\.[0-9]+)(?:e[-+]?[0-9]+)?|inf|nan)\Z", re.IGNORECASE)
_RESERVED = {SEED, "loop", "true", "false", "none", "True", "False", "None"}


def _names(mapping: Mapping[str, Any]) -> Mapping[str, Any]:
    for name in mapping:
        if not _IDENTIFIER.match(name) or name in _RESERVED:
            raise ValueError(
                f"{name!r} cannot name a variable: use letters, digits and _, "
                f"and none of {', '.join(sorted(_RESERVED))}"
            )
    return mapping


def _finite(value: Value) -> Value:
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{value!r} is not a finite number")
    if isinstance(value, list):
        for item in value:
            _finite(item)
    return value


class Table(Strict):
    """Points from the rows of a CSV file."""

    file: str = Field(description="CSV file; a relative path starts at the sweep file")
    only: dict[str, list[Value]] = Field(default={}, description="keep the rows whose column holds one of these values")


class Points(Strict):
    """Sources of the points, of which all combinations are made; values of later sources vary faster."""

    table: Table | None = None
    list_: list[dict[str, Value]] | None = Field(default=None, alias="list", min_length=1)
    zip_: dict[str, list[Value]] | None = Field(default=None, alias="zip", min_length=1)
    grid: dict[str, list[Value]] | None = Field(default=None, min_length=1)

    @model_validator(mode="after")
    def _check(self) -> Self:
        rows, zip_, grid = self.list_ or [], self.zip_ or {}, self.grid or {}
        if not (self.table or rows or zip_ or grid):
            raise ValueError("no points: give at least one of table, list, zip, grid")
        for row in rows:
            if set(_names(row)) != set(rows[0]):
                raise ValueError(f"list: every point needs the same variables: got {row!r}")
        for source, columns in (("zip", zip_), ("grid", grid)):
            for name, values in _names(columns).items():
                _finite(values)
                if not values:
                    raise ValueError(f"{source}: {name} has no values")
        lengths = {name: len(values) for name, values in zip_.items()}
        if len(set(lengths.values())) > 1:
            raise ValueError(f"zip: lists of unequal length: got {lengths}")
        return self


def _once_each(seeds: tuple[int, ...]) -> tuple[int, ...]:
    if len(set(seeds)) != len(seeds):
        raise ValueError(f"a seed is given twice: got {list(seeds)}")
    return seeds


Seeds = Annotated[tuple[int, ...], AfterValidator(_once_each)]


class MoreSeeds(Strict):
    """Further seeds for some of the points, computed after the seeds of all points."""

    seeds: Seeds = Field(min_length=1, description="further seeds, one run each")
    only: dict[str, list[Value]] = Field(
        min_length=1, description="the points whose variable holds one of these values"
    )


class Repeats(Strict):
    """Seeds with which every point is repeated."""

    seeds: Seeds = Field(min_length=1, description="seeds of the scene, one run each")
    seed_by_seed: bool = Field(
        default=False,
        description="start every point with the first seed before any with the second, so that the finished runs of an "
        "interrupted sweep cover all points",
    )
    more: MoreSeeds | None = None

    @model_validator(mode="after")
    def _others(self) -> Self:
        shared = [seed for seed in self.more.seeds if seed in self.seeds] if self.more else []
        if shared:
            raise ValueError(f"more.seeds: {shared[0]} is one of `seeds` already; leave it out of one of them")
        return self


class Again(Strict):
    """Repetition of some points with other constants, such as another engine, after all other points."""

    constants: dict[str, Value] = Field(min_length=1, description="constants that differ in the repetition")
    only: dict[str, list[Value]] = Field(
        default={}, description="the points whose variable holds one of these values; the seed is one of them"
    )


class SweepFile(Strict):
    """Validated content of a sweep file."""

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
    def _known(self) -> Self:
        for name in self.again.constants if self.again else ():
            if name not in self.constants:
                raise ValueError(f"again.constants: {name!r} is none of the constants; add it there")
        return self

    @field_validator("derived")
    @classmethod
    def _expressions(cls, mapping: dict[str, Value]) -> dict[str, Value]:
        for name, value in mapping.items():
            if not isinstance(value, str | int | float | bool):
                raise ValueError(
                    f'{name}: {value!r} is neither an expression nor a number; write it in quotes, "(count / 2) | int"'
                )
        return mapping

    @field_validator("constants", "derived")
    @classmethod
    def _variables(cls, mapping: dict[str, Value]) -> dict[str, Value]:
        for value in _names(mapping).values():
            _finite(value)
        return mapping


@dataclass(frozen=True, kw_only=True)
class Sweep:
    """A sweep file that has been read, with its scene template and the selected rows of its table."""

    path: Path
    text: str
    content: SweepFile
    template: Path
    template_text: str
    table: tuple[Mapping[str, Value], ...] = ()
    table_text: str | None = None


def load_sweep(path: Path) -> Sweep:
    """Read a sweep file with its scene template and its table; InputError if one is invalid.

    `path` is FILE or FILE@VARIANT,VARIANT; variants are patches in the file, which are applied in this order.
    """
    name, _, variants = path.name.partition("@")
    text = read_text(path.with_name(name), "sweep file")
    data = parse_yaml(text, str(path))
    if variants and isinstance(data, dict):
        data = _varied(path, data, variants.split(","))
        # The manifest must hold the file with its variants applied.
        text = yaml.safe_dump(data, sort_keys=False, allow_unicode=True)
    if not isinstance(data, dict):
        raise InputError(f"{path}: a sweep file holds keys such as template and points: got {shown(data)}")
    if "phases" in data and "points" not in data:
        raise InputError(f"{path}: is one scene, not a sweep file; give it to `smarticles run` or `smarticles plan`")
    try:
        content = SweepFile.model_validate(data)
    except ValidationError as error:
        raise InputError(f"{path}: {explained(error, data, described='`smarticles sweep --help`')}") from error
    template = path.parent / content.template
    table, table_text = _read_table(path, content.points.table)
    return Sweep(
        path=path,
        text=text,
        content=content,
        template=template,
        template_text=read_text(template, "scene template"),
        table=tuple(table),
        table_text=table_text,
    )


def _varied(path: Path, data: Mapping[str, Any], variants: Sequence[str]) -> dict[str, Any]:
    patches = data.get("variants") or {}
    varied = {key: value for key, value in data.items() if key != "variants"}
    for variant in variants:
        if variant not in patches:
            known = nearest(variant, sorted(patches)) if patches else "it has none"
            raise InputError(f"{path}: there is no variant {variant!r}; {known}")
        varied = {
            **patched(varied, patches[variant]),
            "name": patches[variant].get("name", f"{varied['name']}-{variant}"),
        }
    return varied


def patched(value: Any, patch: Any) -> Any:
    """Apply a JSON merge patch (RFC 7386): merge mappings, remove keys with null, replace other values."""
    if not isinstance(patch, Mapping):
        return patch
    result = dict(value) if isinstance(value, Mapping) else {}
    for key, part in patch.items():
        if part is None:
            result.pop(key, None)
        else:
            result[key] = patched(result.get(key), part)
    return result


def with_constants(sweep: Sweep, constants: Mapping[str, Value]) -> Sweep:
    """Return a sweep with other values of some constants; raise InputError if one does not exist."""
    for name in constants:
        if name not in sweep.content.constants:
            msg = f"{sweep.path}: constants: there is no {name!r}; {nearest(name, sorted(sweep.content.constants))}"
            raise InputError(msg)
    content = sweep.content.model_copy(update={"constants": {**sweep.content.constants, **constants}})
    return replace(sweep, content=content)


def on_engine(sweep: Sweep, engine: str) -> Sweep:
    """Return a sweep with all runs on one engine; repetitions on another engine are left out.

    InputError if the sweep has no constant `engine`, or `engine` is a variable of its points.
    """
    content = sweep.content
    points = content.points
    columns = [*(sweep.table or [{}])[0], *(points.zip_ or {}), *(points.grid or {}), *(points.list_ or [{}])[0]]
    if ENGINE in columns:
        msg = f"{sweep.path}: points: 'engine' is a variable, so its runs are on several; leave --engine {engine} out"
        raise InputError(msg)
    if ENGINE not in content.constants:
        raise InputError(
            f"{sweep.path}: constants: there is no 'engine' that could be {engine}; add `engine: yade` there, and "
            f"`engine: {{{{ engine }}}}` to {sweep.template}"
        )
    again = content.again
    if again is not None and ENGINE in again.constants:
        again = None
    constants = {**content.constants, ENGINE: engine}
    return replace(sweep, content=content.model_copy(update={"constants": constants, "again": again}))


def read_text(path: Path, what: str) -> str:
    """Return the text of a file without its byte-order mark; InputError, which calls it `what`, if it is not UTF-8."""
    try:
        with path.open(encoding="utf-8-sig") as file:
            text = file.read(LONGEST_TABLE + 1)
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text (byte {error.start}); a {what} is a text file") from error
    except OSError as error:
        raise InputError(f"{path}: cannot read the {what}: {error.strerror}; check the path") from error
    if len(text) > LONGEST_TABLE:
        raise InputError(f"{path}: has more than {LONGEST_TABLE} characters; a {what} is shorter")
    return text


def parse_table(text: str, source: str) -> list[dict[str, bool | int | float | str]]:
    """Return the rows of a CSV text whose first line names the columns.

    Cells are numbers, true or false, or else text: also 007 and 1_2, which are names and lose characters as numbers.
    InputError for no row, an invalid column name, a row of another length, or an empty cell.
    """
    rows = [row for row in csv.reader(io.StringIO(text)) if row]
    if len(rows) < 2:
        raise InputError(f"{source}: the table has no rows; the first line names the columns, rows follow")
    header = [name.strip() for name in rows[0]]
    for name in header:
        if not _IDENTIFIER.match(name) or header.count(name) > 1:
            raise InputError(
                f"{source}, line 1: column {name!r} cannot be a variable; column names are "
                "letters, digits and _, each once"
            )
    table = []
    for number, row in enumerate(rows[1:], start=2):
        if len(row) != len(header) or not all(cell.strip() for cell in row):
            msg = f"{source}, row {number}: expected {len(header)} filled cells ({', '.join(header)}): got {row!r}"
            raise InputError(msg)
        table.append({name: cell_value(cell) for name, cell in zip(header, row, strict=True)})
    return table


def cell_value(text: str) -> bool | int | float | str:
    """Return the value of a cell of a table, see `parse_table`."""
    text = text.strip()
    if text.lower() in _BOOLEANS:
        return _BOOLEANS[text.lower()]
    if _WHOLE.match(text):
        return int(text)
    return float(text) if _NUMBER.match(text) else text


def _read_table(path: Path, table: Table | None) -> tuple[list[dict[str, Value]], str | None]:
    if table is None:
        return [], None
    file = path.parent / table.file
    text = read_text(file, "table")
    rows = parse_table(text, str(file))
    try:
        for row in rows:
            for value in _names(row).values():
                _finite(value)
    except ValueError as error:
        raise InputError(f"{file}: {error}") from error
    return matching(rows, table.only, f"{path}: points.table.only", ("column", f"row of {file}")), text


def matching(
    rows: Sequence[dict[str, Value]], only: Mapping[str, Sequence[Value]], where: str, nouns: tuple[str, str]
) -> list[dict[str, Value]]:
    """Return the rows that have, in each variable named in `only`, one of the values listed there; see `equal`.

    InputError if no row is left, or a variable or a value of `only` occurs in no row; it has the place of `only`,
    `where`, and words for a variable and for a row, `nouns`.
    """
    variable, row_ = nouns
    kept = list(rows)
    for name, wanted in only.items():
        if name not in rows[0]:
            raise InputError(f"{where}.{name}: no such {variable}; {nearest(name, sorted(rows[0]))}")
        present = [row[name] for row in rows]
        for value in wanted:
            if not any(equal(value, one) for one in present):
                known = ", ".join(dict.fromkeys(map(str, present)))
                raise InputError(f"{where}.{name}: no {row_} has {value!r}; there are {known}")
        kept = [row for row in kept if any(equal(row[name], value) for value in wanted)]
    if not kept:
        raise InputError(f"{where}: keeps no {row_}; give fewer conditions")
    return kept
