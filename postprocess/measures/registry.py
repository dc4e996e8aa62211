"""What a measure is, and all that there are.

A measure is one module of this package with one tuple `MEASURES`: its name, what it takes of a frame or of a phase,
and the columns of that with their units. Tables, `smarticles measure` and its CSV and JSON take them from here, so
that a new one needs its module, a test, and a line in README.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module

from dem.record.frame import Frame
from dem.record.run import Run
from dem.record.series import Series

_PACKAGE = __name__.rpartition(".")[0]


@dataclass(frozen=True, kw_only=True)
class Shown:
    """A column of short tables for a person; most columns are for CSV alone."""

    heading: str  #: With the unit that it is shown in
    place: int  #: Among the others: lower ones come first
    form: str  #: Format of the number
    factor: float = 1.0  #: From SI to the unit of the heading [1]
    with_error: bool = False  #: Whether its standard error stands beside


@dataclass(frozen=True)
class Quantity:
    """One column of a table.

    Example:
        >>> Quantity("com height", "m").header
        'com height [m]'
    """

    label: str  #: Its name
    unit: str  #: SI, or "-" for a pure number, "degree", "smarticles"
    shown: Shown | None = None  #: In short tables; None: not at all

    @property
    def header(self) -> str:
        """Name of its column."""
        return f"{self.label} [{self.unit}]"


@dataclass(frozen=True, kw_only=True)
class FrameMeasure:
    """A measure of each frame."""

    name: str  #: Of the measure, unique
    place: int  #: Among the columns of a table: those of lower places come first
    quantities: tuple[Quantity, ...]  #: Its columns
    #: The values of a frame of a run, one per column; NaN where they have no meaning in this frame
    take: Callable[[Frame, Run], Sequence[float]]
    #: Whether a run has it at all; else its tables have no such columns
    available_for: Callable[[Run], bool] = lambda _: True
    definition: str | None = None  #: Where several measures define one quantity, by what name this one is chosen
    #: Whether it takes longer than all that is cheap together, tens of milliseconds per frame or more: tables have it
    #: of the last frame of a phase, unless asked for at every frame
    costly: bool = False

    def columns(self, frame: Frame | None, run: Run) -> dict[str, float]:
        """Return its values by column; NaN without a frame."""
        values = [float("nan")] * len(self.quantities) if frame is None else self.take(frame, run)
        return dict(zip((quantity.header for quantity in self.quantities), values, strict=True))


@dataclass(frozen=True, kw_only=True)
class PhaseMeasure:
    """A measure of a whole phase."""

    name: str  #: Of the measure, unique
    phases: tuple[str, ...]  #: Types of the phases that have it
    quantities: tuple[Quantity, ...]  #: Its columns
    take: Callable[[Run, Series, int], Sequence[float]]  #: The values of a phase of an index, one per column
    #: Whether the series holds enough of a phase of an index; else there are no such columns
    available_for: Callable[[Series, int], bool]

    def columns(self, run: Run, series: Series, phase: int) -> dict[str, float]:
        """Return its values by column; none where the phase is of another type or the series holds too little."""
        if run.phases[phase].type not in self.phases or not self.available_for(series, phase):
            return {}
        values = self.take(run, series, phase)
        return dict(zip((quantity.header for quantity in self.quantities), values, strict=True))


def in_space(run: Run) -> bool:
    """Whether smarticles move in space, not in a plane, where all lie at one height."""
    return not run.manifest.planar


@cache
def registered() -> tuple[FrameMeasure | PhaseMeasure, ...]:
    """Return all measures of this package, by module."""
    package = import_module(_PACKAGE)
    modules = [import_module(f"{_PACKAGE}.{found.name}") for found in pkgutil.iter_modules(package.__path__)]
    measures = tuple(measure for module in modules for measure in getattr(module, "MEASURES", ()))
    names = [measure.name for measure in measures]
    headers = [quantity.header for measure in measures for quantity in measure.quantities]
    for kind, words in (("name", names), ("header", headers)):
        if repeated := {word for word in words if words.count(word) > 1}:
            raise ValueError(f"measures share a {kind}: {', '.join(sorted(repeated))}")
    return measures


def shown_quantities() -> tuple[tuple[Quantity, Shown], ...]:
    """Return the columns of short tables, in their order."""
    found = [(one, one.shown) for measure in registered() for one in measure.quantities if one.shown is not None]
    return tuple(sorted(found, key=lambda pair: pair[1].place))


def frame_measures(definitions: Sequence[str]) -> tuple[FrameMeasure, ...]:
    """Return the measures of frames in the order of columns, those with definitions as given."""
    known = sorted((m for m in registered() if isinstance(m, FrameMeasure)), key=lambda measure: measure.place)
    chosen = {measure.definition: measure for measure in known}
    return (
        *(measure for measure in known if measure.definition is None),
        *(chosen[definition] for definition in definitions),
    )


def phase_measures() -> tuple[PhaseMeasure, ...]:
    """Return the measures of whole phases."""
    return tuple(measure for measure in registered() if isinstance(measure, PhaseMeasure))
