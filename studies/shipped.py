"""Shipped studies: sweeps with a quick variant, kept as data beside this module."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from dem.errors import InputError, nearest
from templates.sweep.expand import Point
from templates.sweep.render import Value

_FOLDER = Path(__file__).parent


def study_names() -> list[str]:
    """Names of the shipped studies."""
    files = (path.name.removesuffix(".yaml") for path in _FOLDER.glob("*/*.yaml"))
    return sorted(name for name in files if "." not in name)


def study_file(name: str, *, quick: bool = False) -> Path:
    """Sweep file of a study.

    Raises:
        InputError: there is no such study, or it has no quick variant.
    """
    if name not in study_names():
        msg = f"study {name!r} does not exist; {nearest(name, sorted(study_names()))}"
        raise InputError(msg)
    file = _FOLDER / name.partition("-")[0] / (f"{name}.quick.yaml" if quick else f"{name}.yaml")
    if not file.is_file():
        msg = f"study {name} has no quick variant; leave --quick out"
        raise InputError(msg)
    return file


def differences(quick: Sequence[Point], full: Sequence[Point]) -> list[str]:
    """How a quick variant differs from the full study, found from the points themselves.

    Args:
        quick: points of the quick variant.
        full: points of the study.

    Returns:
        Lines such as `9 runs instead of 24`, `l_over_w: only 0.4, 0.7 of 0.4, 0.5, 0.7` (what is
        left out) and `shake_s: 1.5 instead of 5.0` (what differs in the runs that both have).
    """
    lines = [] if len(quick) == len(full) else [f"{len(quick)} runs instead of {len(full)}"]
    twins = {point.name: point for point in full}
    both = [(point, twins[point.name]) for point in quick if point.name in twins]
    told: list[str] = []
    for name in full[0].values:
        some, every = _distinct(quick, name), _distinct(full, name)
        changed = [pair for pair in both if pair[0].values[name] != pair[1].values[name]]
        if changed:
            here = _distinct([pair[0] for pair in changed], name)
            there = _distinct([pair[1] for pair in changed], name)
            lines.append(f"{name}: {here} instead of {there}")
        elif some != every and not any(_follows(name, other, full) for other in told):
            told.append(name)
            lines.append(f"{name}: only {some} of {every}")
    return lines


def _distinct(points: Sequence[Point], name: str) -> str:
    values: list[Value] = []
    for point in points:
        if point.values[name] not in values:
            values.append(point.values[name])
    if all(isinstance(value, int | float) for value in values):
        values.sort()
    return ", ".join(map(str, values))


def _follows(name: str, other: str, points: Sequence[Point]) -> bool:
    """Whether a variable is settled by another one, as the columns of a table are by its first."""
    seen: dict[str, Value] = {}
    return all(seen.setdefault(str(point.values[other]), point.values[name]) == point.values[name] for point in points)
