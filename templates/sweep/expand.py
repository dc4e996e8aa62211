"""A sweep becomes points: named, rendered, validated scenes."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from dem.errors import InputError
from dem.scene.reading import parse_scene, scene_hash
from dem.scene.scene import Scene
from templates.sweep.render import Value, evaluate, render_text, render_yaml
from templates.sweep.sweep_file import SEED, Sweep

MAX_POINTS = 10_000
"""Runs of one sweep, unless the user asks for more: a slip in a grid makes millions."""

# What is a directory name everywhere, needs no quoting in a shell and does not look like an option.
_RUN_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._+=-]{0,99}\Z")


@dataclass(frozen=True, kw_only=True)
class Point:
    """One run of a sweep.

    Args:
        name: directory name of the run.
        values: every variable, the seed included.
        scene: the validated scene.
        scene_sha256: its hash.
    """

    name: str
    values: Mapping[str, Value]
    scene: Scene
    scene_sha256: str


def expand(sweep: Sweep, *, max_points: int = MAX_POINTS) -> list[Point]:
    """All points of a sweep, in the order of its file.

    Args:
        sweep: the sweep.
        max_points: how many runs it may have.

    Raises:
        InputError: too many runs, a name is unknown, two runs share a name or a scene, a scene is not valid.
    """
    count = _count(sweep)
    if count > max_points:
        msg = (
            f"{sweep.path}: points: {count} runs, more than {max_points}; "
            f"shorten its lists, or give --max-points {count}"
        )
        raise InputError(msg)
    points: list[Point] = []
    for values in _assignments(sweep):
        name = _run_name(sweep, values)
        data = render_yaml(sweep.template_text, values, str(sweep.template))
        scene = parse_scene(data, source=f"{sweep.template}, rendered for run {name}")
        points.append(Point(name=name, values=values, scene=scene, scene_sha256=scene_hash(scene)))
    _refuse_twins(sweep, points)
    return points


def _count(sweep: Sweep) -> int:
    """How many points there will be, without making them."""
    points, repeats = sweep.content.points, sweep.content.repeats
    lengths = [
        len(sweep.table) or 1,
        len(points.list_ or [0]),
        len(next(iter(points.zip_.values()))) if points.zip_ else 1,
        *(len(column) for column in (points.grid or {}).values()),
        len(repeats.seeds) if repeats else 1,
    ]
    return math.prod(lengths)


def _assignments(sweep: Sweep) -> Iterator[dict[str, Value]]:
    """Values of all variables, point by point."""
    points = sweep.content.points
    sources: dict[str, list[dict[str, Value]]] = {
        "constants": [dict(sweep.content.constants)],
        "points.table": [dict(row) for row in sweep.table],
        "points.list": points.list_ or [],
    }
    if points.zip_:
        rows = zip(*points.zip_.values(), strict=True)
        sources["points.zip"] = [dict(zip(points.zip_, row, strict=True)) for row in rows]
    if points.grid:
        combinations = itertools.product(*points.grid.values())
        sources["points.grid"] = [dict(zip(points.grid, row, strict=True)) for row in combinations]
    used = {where: rows for where, rows in sources.items() if rows}
    _refuse_shared(sweep, {where: set(rows[0]) for where, rows in used.items()})
    repeats = sweep.content.repeats
    assigned = list(_without_seed(sweep, list(used.values())))
    if repeats is None:
        yield from assigned
    elif repeats.seed_by_seed:
        yield from ({**values, SEED: seed} for seed in repeats.seeds for values in assigned)
    else:
        yield from ({**values, SEED: seed} for values in assigned for seed in repeats.seeds)


def _without_seed(sweep: Sweep, sources: Sequence[Sequence[Mapping[str, Value]]]) -> Iterator[dict[str, Value]]:
    """Values of all variables but the seed, point by point."""
    for parts in itertools.product(*sources):
        values = {name: value for part in parts for name, value in part.items()}
        for name, expression in sweep.content.derived.items():
            where = f"{sweep.path}: derived.{name}"
            literal = not isinstance(expression, str)
            values[name] = expression if literal else evaluate(str(expression), values, where)
        yield values


def _refuse_shared(sweep: Sweep, names: Mapping[str, set[str]]) -> None:
    every = {**names, "derived": set(sweep.content.derived)}
    for (one, first), (other, second) in itertools.combinations(every.items(), 2):
        for name in sorted(first & second):
            msg = f"{sweep.path}: {name!r} is set in both {one} and {other}; rename or remove one of them"
            raise InputError(msg)


def _run_name(sweep: Sweep, values: Mapping[str, Value]) -> str:
    name = render_text(sweep.content.run_name, values, f"{sweep.path}: run_name")
    if not _RUN_NAME.match(name):
        msg = (
            f"{sweep.path}: run_name: gives {name!r}, which cannot be a directory of its own; "
            "use up to 100 letters, digits and . _ + = -, a letter or digit first"
        )
        raise InputError(msg)
    return name


def _refuse_twins(sweep: Sweep, points: list[Point]) -> None:
    names: dict[str, Point] = {}
    scenes: dict[str, Point] = {}
    for point in points:
        twin = names.setdefault(point.name.casefold(), point)
        if twin is not point:
            msg = (
                f"{sweep.path}: run_name: two runs are called {point.name!r}: "
                f"{difference(twin.values, point.values)}; put what differs into run_name"
            )
            raise InputError(msg)
        twin = scenes.setdefault(point.scene_sha256, point)
        if twin is not point:
            msg = (
                f"{sweep.path}: runs {twin.name} and {point.name} are the same scene although "
                f"{difference(twin.values, point.values)}; use that variable in {sweep.template}"
            )
            raise InputError(msg)


def difference(one: Mapping[str, Value], other: Mapping[str, Value]) -> str:
    """`friction 0.2 and 0.4, seed 1 and 2`: the variables in which two points differ."""
    parts = [f"{name} {one[name]} and {other[name]}" for name in one if one[name] != other[name]]
    return ", ".join(parts) or "they differ in nothing"
