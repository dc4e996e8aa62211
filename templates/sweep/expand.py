"""Make the points of a sweep: named and validated scenes."""

import itertools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from dem.errors import InputError
from dem.scene.reading import parse_scene, scene_hash
from dem.scene.scene import Scene
from templates.sweep.render import Value, evaluate, render_text, render_yaml
from templates.sweep.sweep_file import SEED, Sweep, matching

MAX_POINTS = 10_000  #: Largest number of runs of a sweep by default, because a mistake in a grid makes millions

# Valid as directory name on every system, needs no quoting in a shell, and cannot be taken for an option.
_RUN_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._+=-]{0,99}\Z")


@dataclass(frozen=True, kw_only=True)
class Point:
    """One run of a sweep."""

    name: str  #: Name of the run and its directory
    values: Mapping[str, Value]  #: Values of all variables, with the seed
    scene: Scene
    scene_sha256: str  #: Hash of the scene
    again: bool = False  #: Whether the point repeats another one with other constants, see `Again`


def expand(sweep: Sweep, *, max_points: int = MAX_POINTS) -> list[Point]:
    """Make all points of a sweep in the order of its file; InputError for too many or an invalid scene."""
    # Counted before they are made, which could exhaust the memory.
    sources = _sources(sweep)
    repeats, again = sweep.content.repeats, sweep.content.again
    _check_count(sweep, math.prod([*map(len, sources), len(repeats.seeds) if repeats else 1]), max_points)
    crossed = [{k: v for part in parts for k, v in part.items()} for parts in itertools.product(*sources)]
    assigned = list(_repeated(sweep, [_derived(sweep, values) for values in crossed]))
    repeated: list[dict[str, Value]] = []
    if again is not None:
        chosen = matching(assigned, again.only, f"{sweep.path}: again.only", ("variable", "point"))
        repeated = [_derived(sweep, {**point, **again.constants}) for point in chosen]
    _check_count(sweep, len(assigned) + len(repeated), max_points)
    return points_of(sweep, [*assigned, *repeated], again_from=len(assigned))


def points_of(sweep: Sweep, rows: Sequence[Mapping[str, Value]], *, again_from: int | None = None) -> list[Point]:
    """Make the points of a sweep from the values of all its variables; InputError if a scene is not valid.

    Rows are values with the seed. From the index `again_from` on, points repeat other ones, see `Again`; None: none
    does.
    """
    points = []
    for index, values in enumerate(rows):
        name = render_text(sweep.content.run_name, values, f"{sweep.path}: run_name")
        if not _RUN_NAME.match(name):
            raise InputError(
                f"{sweep.path}: run_name: gives {name!r}, which cannot be a directory of its own; "
                "use up to 100 letters, digits and . _ + = -, a letter or digit first"
            )
        data = render_yaml(sweep.template_text, values, str(sweep.template))
        source = f"{sweep.template}, rendered for run {name}"
        scene = parse_scene(data, source=source, folder=sweep.template.parent)
        again = again_from is not None and index >= again_from
        points.append(Point(name=name, values=values, scene=scene, scene_sha256=scene_hash(scene), again=again))
    _reject_twins(sweep, points)
    return points


def _check_count(sweep: Sweep, count: int, most: int) -> None:
    if count > most:
        advice = f"shorten its lists, or give --max-points {count}"
        raise InputError(f"{sweep.path}: points: {count} runs, more than {most}; {advice}")


def _sources(sweep: Sweep) -> list[Sequence[Mapping[str, Value]]]:
    """Return the lists of values of which all combinations are the points; later lists vary faster."""
    points = sweep.content.points
    zipped = points.zip_ or {}
    sources: dict[str, Sequence[Sequence[Mapping[str, Value]]]] = {
        "constants": [[sweep.content.constants]],
        "points.table": [sweep.table],
        "points.list": [points.list_ or []],
        "points.zip": [[dict(zip(zipped, row, strict=True)) for row in zip(*zipped.values(), strict=True)]],
        "points.grid": [[{name: value} for value in column] for name, column in (points.grid or {}).items()],
    }
    crossed = {where: [rows for rows in parts if rows] for where, parts in sources.items()}
    names = {where: {name for rows in parts for name in rows[0]} for where, parts in crossed.items()}
    names["derived"] = set(sweep.content.derived)
    for one, other in itertools.combinations(names, 2):
        for name in sorted(names[one] & names[other]):
            raise InputError(f"{sweep.path}: {name!r} is set in both {one} and {other}; rename or remove one of them")
    return [rows for parts in crossed.values() for rows in parts]


def _repeated(sweep: Sweep, points: Sequence[dict[str, Value]]) -> Iterator[dict[str, Value]]:
    repeats = sweep.content.repeats
    if repeats is None:
        yield from points
        return
    if repeats.seed_by_seed:
        yield from ({**values, SEED: seed} for seed in repeats.seeds for values in points)
    else:
        yield from ({**values, SEED: seed} for values in points for seed in repeats.seeds)
    if repeats.more:
        where = f"{sweep.path}: repeats.more.only"
        chosen = matching(points, repeats.more.only, where, ("variable", "point"))
        yield from ({**values, SEED: seed} for seed in repeats.more.seeds for values in chosen)


def _derived(sweep: Sweep, values: Mapping[str, Value]) -> dict[str, Value]:
    values = dict(values)
    for name, expression in sweep.content.derived.items():
        where = f"{sweep.path}: derived.{name}"
        values[name] = evaluate(expression, values, where) if isinstance(expression, str) else expression
    return values


def _reject_twins(sweep: Sweep, points: list[Point]) -> None:
    names: dict[str, Point] = {}
    scenes: dict[str, Point] = {}
    for point in points:
        # Some file systems take names that differ in case only for one.
        twin = names.setdefault(point.name.casefold(), point)
        if twin is not point:
            differing = difference(twin.values, point.values)
            if not differing:
                raise InputError(
                    f"{sweep.path}: points: {point.name} is given twice with equal values; remove one of the two"
                )
            if twin.name == point.name:
                problem = f"two runs are called {point.name!r}"
            else:
                problem = f"the names {twin.name!r} and {point.name!r} differ in upper and lower case only"
            raise InputError(f"{sweep.path}: run_name: {problem}: {differing}; put what differs into run_name")
        twin = scenes.setdefault(point.scene_sha256, point)
        if twin is not point:
            raise InputError(
                f"{sweep.path}: runs {twin.name} and {point.name} have identical scenes although "
                f"{difference(twin.values, point.values)}; use that variable in {sweep.template}"
            )


def difference(one: Mapping[str, Value], other: Mapping[str, Value]) -> str:
    """Return the variables in which two points differ, as `friction 0.2 and 0.4, seed 1 and 2`."""
    texts = [(name, str(one.get(name, "absent")), str(other.get(name, "absent"))) for name in {**one, **other}]
    return ", ".join(f"{name} {first} and {second}" for name, first, second in texts if first != second)
