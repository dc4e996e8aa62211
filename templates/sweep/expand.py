"""A sweep becomes points: named, rendered, validated scenes."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from dem.errors import InputError, nearest
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
        again: whether it is another point once more, with other constants.
    """

    name: str
    values: Mapping[str, Value]
    scene: Scene
    scene_sha256: str
    again: bool = False


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
        raise _too_many(sweep, count, max_points)
    points: list[Point] = []
    assigned = list(_assignments(sweep))
    again = _again(sweep, assigned)
    if len(assigned) + len(again) > max_points:
        raise _too_many(sweep, len(assigned) + len(again), max_points)
    for index, values in enumerate([*assigned, *again]):
        name = _run_name(sweep, values)
        data = render_yaml(sweep.template_text, values, str(sweep.template))
        source = f"{sweep.template}, rendered for run {name}"
        scene = parse_scene(data, source=source, folder=sweep.template.parent)
        points.append(
            Point(
                name=name,
                values=values,
                scene=scene,
                scene_sha256=scene_hash(scene),
                again=index >= len(assigned),
            )
        )
    _refuse_twins(sweep, points)
    return points


def _too_many(sweep: Sweep, count: int, max_points: int) -> InputError:
    return InputError(
        f"{sweep.path}: points: {count} runs, more than {max_points}; shorten its lists, or give --max-points {count}"
    )


def _count(sweep: Sweep) -> int:
    """How many points there will be, without making them; those with more seeds and those once more apart."""
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
    yield from _repeated(sweep, [_derived(sweep, values) for values in _joined(used.values())])


def _repeated(sweep: Sweep, assigned: Sequence[dict[str, Value]]) -> Iterator[dict[str, Value]]:
    """Values of all variables with each seed."""
    repeats = sweep.content.repeats
    if repeats is None:
        yield from assigned
        return
    more = repeats.more
    chosen = _chosen(sweep, assigned, "repeats.more", more.only) if more else []
    if repeats.seed_by_seed:
        yield from ({**values, SEED: seed} for seed in repeats.seeds for values in assigned)
    else:
        yield from ({**values, SEED: seed} for values in assigned for seed in repeats.seeds)
    if more:
        yield from ({**values, SEED: seed} for seed in more.seeds for values in chosen)


def _joined(sources: Iterable[Sequence[Mapping[str, Value]]]) -> Iterator[dict[str, Value]]:
    for parts in itertools.product(*sources):
        yield {name: value for part in parts for name, value in part.items()}


def _derived(sweep: Sweep, values: Mapping[str, Value]) -> dict[str, Value]:
    """The same values with those that follow from them."""
    values = dict(values)
    for name, expression in sweep.content.derived.items():
        where = f"{sweep.path}: derived.{name}"
        literal = not isinstance(expression, str)
        values[name] = expression if literal else evaluate(str(expression), values, where)
    return values


def _again(sweep: Sweep, points: Sequence[Mapping[str, Value]]) -> list[dict[str, Value]]:
    """The points that come once more with other constants.

    Raises:
        InputError: a variable that chooses them is unknown, or no point has one of its values.
    """
    again = sweep.content.again
    if again is None:
        return []
    chosen = _chosen(sweep, points, "again", again.only)
    return [_derived(sweep, {**point, **again.constants}) for point in chosen]


def _chosen(
    sweep: Sweep, points: Sequence[Mapping[str, Value]], key: str, only: Mapping[str, Sequence[Value]]
) -> list[Mapping[str, Value]]:
    """The points whose variables hold one of the values wanted.

    Args:
        sweep: the sweep.
        points: values of all variables, point by point.
        key: part of the sweep file that chooses.
        only: values wanted, by variable.

    Raises:
        InputError: a variable is unknown, or no point has one of its values, or all of them.
    """
    chosen = list(points)
    for name, wanted in only.items():
        where = f"{sweep.path}: {key}.only.{name}"
        if name not in points[0]:
            msg = f"{where}: no such variable; {nearest(name, sorted(points[0]))}"
            raise InputError(msg)
        present = list(dict.fromkeys(str(point[name]) for point in points))
        for value in wanted:
            if not any(point[name] == value for point in points):
                msg = f"{where}: no point has {value!r}; there are {', '.join(present)}"
                raise InputError(msg)
        chosen = [point for point in chosen if point[name] in wanted]
    if not chosen:
        msg = f"{sweep.path}: {key}.only: keeps no point; give fewer conditions"
        raise InputError(msg)
    return chosen


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
