"""A shipped study as it is known before it is asked for: light, so that the command line can tell of all of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from dem.errors import InputError

if TYPE_CHECKING:
    from studies.base.study import Study
    from templates.sweep.expand import Point
    from templates.sweep.render import Value


class Loader(Protocol):
    """Imports the class of a study and makes one; `quick`: whether its analysis is to take seconds."""

    def __call__(self, *, quick: bool) -> Study[Any]:
        """The study."""


@dataclass(frozen=True, kw_only=True)
class Shipped:
    """A study that is installed with this package.

    Attributes:
        name: For the command line; its sweep file is named after it.
        folder: With the sweep file, that of the quick variant if there is one, and what both need.
        about: What it is, for `smarticles study --help`.
        pictured: Values of the run that a picture is drawn of.
        load: Gives the study itself.
    """

    name: str
    folder: Path
    about: str
    pictured: Mapping[str, object]
    load: Loader

    def sweep_file(self, *, quick: bool = False) -> Path:
        """Its sweep file.

        Raises:
            InputError: It has no quick variant.
        """
        file = self.folder / (f"{self.name}.quick.yaml" if quick else f"{self.name}.yaml")
        if not file.is_file():
            msg = f"study {self.name} has no quick variant; leave --quick out"
            raise InputError(msg)
        return file


def differences(quick: Sequence[Point], full: Sequence[Point]) -> list[str]:
    """How a quick variant differs from the full study, found from the points themselves.

    Args:
        quick: points of the quick variant.
        full: points of the study.

    Returns:
        Lines such as `9 runs instead of 24`, `l_over_w: only 0.4, 0.7 of 0.4, 0.5, 0.7` (what is
        left out), `shake_s: 1.5 instead of 5.0` (what differs in the runs that both have), and `draws: 3` or
        `draws: not there` of a variable that only one of them knows.
    """
    lines = [] if len(quick) == len(full) else [f"{len(quick)} runs instead of {len(full)}"]
    twins = {point.name: point for point in full}
    both = [(point, twins[point.name]) for point in quick if point.name in twins]
    told: list[str] = []
    for name in dict.fromkeys([*full[0].values, *quick[0].values]):
        if not (name in full[0].values and name in quick[0].values):
            lines.append(f"{name}: {_distinct(quick, name) or 'not there'}")
            continue
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
        if name in point.values and point.values[name] not in values:
            values.append(point.values[name])
    if all(isinstance(value, int | float) for value in values):
        values.sort()
    return ", ".join(map(str, values))


def _follows(name: str, other: str, points: Sequence[Point]) -> bool:
    """Whether a variable is settled by another one, as the columns of a table are by its first."""
    seen: dict[str, Value] = {}
    return all(seen.setdefault(str(point.values[other]), point.values[name]) == point.values[name] for point in points)
