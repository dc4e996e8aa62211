"""Define measures, and find all measures that the modules of this package register.

Each module lists its measures in a tuple `MEASURES`. A measure has a name, a function of a frame or of a phase, and the
columns that this function fills, with units. Tables and `smarticles measure` read the registry, so that a new measure
needs its module and a test.
"""

import math
import pkgutil
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dem.errors import InputError, nearest, shown
from dem.record.frame import Frame
from dem.record.run import Run
from dem.record.series import Series
from dem.strict import unit_of
from postprocess.geometry.links import UndefinedMeasureError

ENTRY_POINTS = "smarticles.measures"  #: Group of the entry points by which installed packages add their `MEASURES`

_LAST = 1000  #: Place of columns that no measure has placed
_PACKAGE = __name__.rpartition(".")[0]


@dataclass(frozen=True, kw_only=True)
class Shown:
    """Format of a quantity in the short tables that commands print; short tables omit many quantities."""

    heading: str  #: Heading of the column, with the unit of its numbers
    place: int  #: Order of the columns: lower numbers come first
    form: str  #: Format specification of the number, such as `.3f`
    factor: float = 1.0  #: Factor from the SI unit to the unit of the heading [-]
    with_error: bool = False  #: Whether a column with the standard error follows


@dataclass(frozen=True)
class Quantity:
    """One column of a table; its header has label and unit, such as `com height [m]`."""

    label: str  #: Name of the quantity
    unit: str  #: SI unit, or "-" for a pure number, "degree", "smarticles"
    shown: Shown | None = None  #: Its column in short tables; None: short tables leave it out

    @property
    def header(self) -> str:
        """Name of the column: label and unit."""
        return f"{self.label} [{self.unit}]"


def any_run(_: Run) -> bool:
    """Return True: the measure applies to every run."""
    return True


@dataclass(frozen=True, kw_only=True)
class FrameMeasure:
    """A measure that is computed from one frame."""

    name: str  #: Unique name of the measure
    place: int  #: Order of its columns in a table: lower numbers come first
    quantities: tuple[Quantity, ...]  #: Columns that the measure fills
    #: Returns the values of a frame of a run, one per column; NaN for a value that is undefined in this frame
    take: Callable[[Frame, Run], Sequence[float]]
    #: Returns whether the measure applies to a run; tables of other runs lack its columns
    available_for: Callable[[Run], bool] = any_run
    definition: str | None = None  #: Key of the definition, for a quantity with several (packing fraction)
    #: Whether it takes tens of milliseconds per frame or more; tables then have its values for the last frame of each
    #: phase alone, unless the user asks for every frame
    costly: bool = False
    on_request: bool = False  #: Whether tables leave it out unless it is named

    def columns(self, frame: Frame | None, run: Run) -> dict[str, float]:
        """Return the values of a frame by column; all are NaN if the frame is None."""
        values = [float("nan")] * len(self.quantities) if frame is None else self.take(frame, run)
        return dict(zip((quantity.header for quantity in self.quantities), values, strict=True))


Values = float | ArrayLike | Mapping[str, float | ArrayLike]
"""What a function of a user returns: a number, an array of numbers, or a mapping of names to these."""


@dataclass(frozen=True, kw_only=True)
class OwnFrameMeasure(FrameMeasure):
    """A measure from a function of a user; its columns follow from what the function returns.

    A number fills one column, an array one column per number, whose label ends with the index. A mapping has names of
    quantities. Names end with the unit: `speed_m_per_s` makes the column `speed [m/s]`.
    """

    function: Callable[[Frame, Run], Values]  #: The function

    def columns(self, frame: Frame | None, run: Run) -> dict[str, float]:
        """Return the values of a frame by column; none if the frame is None."""
        if frame is None:
            return {}
        try:
            values = self.function(frame, run)
        except UndefinedMeasureError:
            values = math.nan
        each = values if isinstance(values, Mapping) else {self.name: values}
        columns = {}
        for name, value in each.items():
            label, unit = unit_of(str(name))
            for index, number in np.ndenumerate(self._numbers(name, value)):
                quantity = Quantity(" ".join([label.replace("_", " "), *map(str, index)]), unit or "-")
                columns[quantity.header] = float(number)
        return columns

    def _numbers(self, name: str, value: object) -> NDArray[np.float64]:
        try:
            array = np.asarray(value)
            if array.dtype.kind in "biuf":
                return array.astype(np.float64)
        except ValueError:  # rows of different lengths
            pass
        where = self.name if name == self.name else f"{self.name}, {name!r}"
        raise InputError(f"measure {where}: returned {shown(value)}; return a number, an array of numbers, or a dict")


def _no_values(_frame: Frame, _run: Run) -> tuple[float, ...]:
    return ()


def measure_of(function: Callable[[Frame, Run], Values] | FrameMeasure) -> FrameMeasure:
    """Make a measure from a function of a frame and its run, see `OwnFrameMeasure`; a measure is returned unchanged."""
    if isinstance(function, FrameMeasure):
        return function
    return OwnFrameMeasure(name=function.__name__, place=900, quantities=(), take=_no_values, function=function)


@dataclass(frozen=True, kw_only=True)
class PhaseMeasure:
    """A measure that is computed from a whole phase."""

    name: str  #: Unique name of the measure
    phases: tuple[str, ...]  #: Types of phase to which the measure applies
    quantities: tuple[Quantity, ...]  #: Columns that the measure fills
    take: Callable[[Run, Series, int], Sequence[float]]  #: Returns the values of a phase by its index, one per column
    available_for: Callable[[Series, int], bool]  #: Returns whether the series holds enough samples of a phase

    def columns(self, run: Run, series: Series, phase: int) -> dict[str, float]:
        """Return the values of a phase by column; empty if the measure does not apply or has too few samples."""
        if run.phases[phase].type not in self.phases or not self.available_for(series, phase):
            return {}
        values = self.take(run, series, phase)
        return dict(zip((quantity.header for quantity in self.quantities), values, strict=True))


def any_in_space(run: Run) -> bool:
    """Return whether the bodies of a run, of any shape, move in three dimensions, not in a plane."""
    return not run.manifest.planar


def rigid_in_space(run: Run) -> bool:
    """Return whether the bodies of a run are rigid and move in three dimensions, not in a plane."""
    return any_in_space(run) and not is_flexible(run)


def is_flexible(run: Run) -> bool:
    """Return whether the bodies of a run are filaments or chains of links."""
    return any(kind.flexible for kind in run.manifest.kinds or ())


def in_space(run: Run) -> bool:
    """Return whether the bodies of a run are smarticles and move in three dimensions, not in a plane."""
    return any_in_space(run) and run.manifest.kinds is None


def in_one_cylinder(run: Run) -> bool:
    """Return whether the bodies of a run are smarticles in one cylinder.

    It is false for a mould with several tiers, which have different radii, and for a planar run, as in a channel.
    """
    return in_space(run) and run.manifest.container_tiers == 1


@cache
def registered() -> tuple[FrameMeasure | PhaseMeasure, ...]:
    """Return the measures of the modules of this package, followed by those of installed packages.

    The modules are in alphabetical order. ValueError if two measures have one name, or two quantities one header.
    """
    package = import_module(_PACKAGE)
    modules = [import_module(f"{_PACKAGE}.{found.name}") for found in pkgutil.iter_modules(package.__path__)]
    measures = (*(measure for module in modules for measure in getattr(module, "MEASURES", ())), *_installed())
    names = [measure.name for measure in measures]
    headers = [quantity.header for measure in measures for quantity in measure.quantities]
    for kind, words in (("name", names), ("header", headers)):
        if repeated := {word for word in words if words.count(word) > 1}:
            raise ValueError(f"measures share a {kind}: {', '.join(sorted(repeated))}")
    return measures


def _installed() -> Iterator[FrameMeasure | PhaseMeasure]:
    for point in entry_points(group=ENTRY_POINTS):
        try:
            yield from point.load()
        except Exception as error:  # of another package's code
            raise InputError(
                f"the measures of {point.value} cannot be loaded ({type(error).__name__}: {error}); repair or "
                "uninstall that package"
            ) from error


def shown_quantities(also: Collection[str] = ()) -> tuple[tuple[Quantity, Shown], ...]:
    """Return the quantities of short tables with their format, in the order of the columns.

    The quantities of the measures named in `also` are all among them; those without a format come last.
    """
    found = []
    for measure in registered():
        for quantity in measure.quantities:
            if quantity.shown is not None:
                found.append((quantity, quantity.shown))
            elif measure.name in also:
                heading = quantity.label if quantity.unit == "-" else quantity.header
                found.append((quantity, Shown(heading=heading, place=_LAST, form=".3g")))
    return tuple(sorted(found, key=lambda pair: pair[1].place))


def frame_measures(definitions: Sequence[str], also: Collection[str] = ()) -> tuple[FrameMeasure, ...]:
    """Return the measures of frames in the order of their columns.

    Quantities such as the packing fraction have several definitions, with one measure for each; those of `definitions`
    come after all other measures, in this order. Of the measures with `on_request` only those named in `also` are
    returned; InputError if one does not exist.
    """
    asked = {m.name: m for m in registered() if isinstance(m, FrameMeasure) and m.on_request}
    for name in also:
        if name not in asked:
            raise InputError(f"also: there is no measure {name!r} to add; {nearest(name, asked)}")
    known = sorted(
        (m for m in registered() if isinstance(m, FrameMeasure) and not (m.on_request and m.name not in also)),
        key=lambda measure: measure.place,
    )
    defined = {measure.definition: measure for measure in known}
    return (
        *(measure for measure in known if measure.definition is None),
        *(defined[definition] for definition in definitions),
    )


def phase_measures() -> tuple[PhaseMeasure, ...]:
    """Return the measures of whole phases."""
    return tuple(measure for measure in registered() if isinstance(measure, PhaseMeasure))
