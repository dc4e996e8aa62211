"""Choose engine and fidelity for a scene, from a table of measured errors and costs.

A fidelity is a named set of numerical parameters: `draft`, `standard` or `reference`. `smarticles accuracy` measures a
table on one scene. The shipped table joins the tables of three scenes, each named by its activity: the types of phases
that drive the pile. A row has the errors of one named fidelity, and the ratio of the measured processor time to the
planned wall time. This ratio corrects the wall times planned for other scenes. The column `knob` states what a row
compares: `engine` all engines with one reference, `fidelity` the fidelities of one engine.
"""

import csv
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from dem.engine import ENGINES
from dem.errors import InputError
from dem.plan.outlook import Plan, plan
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene
from dem.setting.fidelity import FIDELITIES, fidelities

SHIPPED = Path(__file__).with_name("work_precision.csv")  #: Default table of measured errors and costs

QUANTITIES = {"phi_0": "φ_0", "phi_f": "φ_f", "crossings": "⟨N⟩"}
"""Quantities with measured errors: symbols by the names in columns and in `--of`."""

PACKING = ("phi_0", "phi_f")  #: Default of the option `--of`: quantities whose errors decide a choice

_HOW = "make one: smarticles accuracy SCENE.yaml --out DIR, then --table DIR/results/work_precision.csv"
_FINEST = (list(FIDELITIES)[-1], "converged")
_KNOB, _VALUE, _SEEDS, _RATIO = "knob", "value", "seeds [-]", "processor time over expected wall time [-]"
_ASPECT, _COUNT, _ACTIVITY, _VERDICT = "aspect ratio [-]", "smarticles [-]", "activity", "verdict"
_COLUMNS = (
    *(_KNOB, _VALUE, _SEEDS, _RATIO, _ASPECT, _COUNT, _ACTIVITY, _VERDICT),
    *(f"{name} error{mark} [%]" for name in QUANTITIES for mark in ("", " 95 %")),
)


@dataclass(frozen=True, kw_only=True)
class Error:
    """The relative error of a quantity."""

    of: str  #: Symbol of the quantity, such as φ_f
    value: float  #: Relative deviation from the reference fidelity [1]; NaN if unknown
    band: float  #: Half-width of the 95 % interval over seeds [1]; NaN if unknown

    def __str__(self) -> str:
        band = f" ± {self.band:.3f}" if math.isfinite(self.band) else ", scatter unknown"
        return f"{self.of} {self.value:+.3f}{band}"

    @property
    def size(self) -> float:
        """Absolute value of the error [1]; inf if unknown."""
        return math.inf if math.isnan(self.value) else abs(self.value)


@dataclass(frozen=True, kw_only=True)
class Measured:
    """One fidelity (`draft`, `standard` or `reference`) of an engine, with its errors and cost from the table."""

    fidelity: str
    errors: tuple[Error, ...]  #: Errors of the quantities that decide a choice
    engine: str = "yade"
    others: tuple[Error, ...] = ()  #: Errors of all other quantities
    seeds: int  #: Number of seeds
    ratio: float  #: Measured processor time over the planned wall time [1]
    is_reference: bool  #: Whether this fidelity is the reference of all errors
    hours: float = math.nan  #: Expected wall time of the scene to be planned, on one core of the table's machine [h]

    @property
    def name(self) -> str:
        """Fidelity and engine in words, such as `standard on links`."""
        return f"{self.fidelity} on {self.engine}"

    @property
    def worst(self) -> Error:
        """Largest error of `errors`; an unknown error counts as larger than all known ones."""
        return max(self.errors, key=lambda error: error.size)


@dataclass(frozen=True, kw_only=True)
class AccuracyTable:
    """Measured fidelities, and the scene on which they were measured."""

    path: Path
    fidelities: tuple[Measured, ...]  #: Fidelities with finished runs, engine by engine, coarse to fine
    reference: str  #: Name of the fidelity to which all errors are relative
    aspect_ratio: float  #: Barb length over middle length, l/w, in the measured scene [1]
    count: int  #: Number of smarticles in the measured scene
    activity: str  #: Types of the measured scene's phases in which something drives the pile, separated by spaces


def activity_of(scene: Scene) -> str:
    """Return the types of the phases in which something drives the pile, separated by spaces."""
    return " ".join(dict.fromkeys(phase.type for phase in scene.phases if not phase.at_rest))


def read_table(
    path: Path | None, *, of: Sequence[str] = PACKING, engine: str | None = None, activity: str = ""
) -> AccuracyTable:
    """Read a table of `smarticles accuracy`.

    Args:
        path: the table; None: `SHIPPED`.
        of: keys of `QUANTITIES`; the errors of these quantities decide a choice.
        engine: the only engine that may be chosen; None: any.
        activity: activity of the scene to be planned, see `activity_of`. Only rows of this activity are read; if the
            table has none, only rows of its first activity.

    Raises:
        InputError: the file is missing, is no table of errors and costs, or has no named fidelities.
    """
    file = SHIPPED if path is None else path
    if path is None and not file.is_file():
        raise InputError(f"--table: no table of measured errors ships at {file}; {_HOW}")
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "not a text file"
        raise InputError(f"--table {file}: cannot be read ({why}); {_HOW}") from None
    reader = csv.DictReader(line for line in lines if line and not line.startswith("#"))
    for column in _COLUMNS:
        if column not in (reader.fieldnames or ()):
            msg = f"--table {file}: has no column {column!r}, so it is no table of work and precision; {_HOW}"
            raise InputError(msg)
    rows = list(reader)
    measured = dict.fromkeys(row[_ACTIVITY] for row in rows if row[_ACTIVITY])
    there_is = activity if activity in measured else next(iter(measured), "")
    rows = [row for row in rows if row[_ACTIVITY] in ("", there_is)]
    named = _named_fidelities(rows)
    try:
        every = [_measured(*key, row, of) for key, row in named.items() if int(row[_SEEDS]) > 0]
        knobs = {row[_KNOB] for row in named.values()}
        references = [row for row in rows if row[_KNOB] in knobs and row[_VERDICT] == "reference"]
        reference = next((row[_VALUE] for row in references if int(row[_SEEDS]) > 0), None)
        if reference is None or len(every) < 2:
            raise InputError(f"--table {file}: has fewer than two named fidelities with runs; {_HOW}")
        found = tuple(one for one in every if engine in (None, one.engine))
        if not found:
            there = ", ".join(dict.fromkeys(one.engine for one in every))
            msg = f"--table {file}: has nothing on the engine {engine}, only on {there}; leave --engine out, or {_HOW}"
            raise InputError(msg)
        first = next(iter(named.values()))
        return AccuracyTable(
            path=file,
            fidelities=found,
            reference=reference,
            aspect_ratio=float(first[_ASPECT]),
            count=round(float(first[_COUNT])),
            activity=first[_ACTIVITY],
        )
    except (TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"--table {file}: a row of fidelity does not hold numbers ({error}); {_HOW}") from None


def _named_fidelities(rows: Sequence[dict[str, str]]) -> dict[tuple[str, str], dict[str, str]]:
    """Return the rows of named fidelities by (engine, fidelity), engine by engine, from coarse to fine.

    Only rows whose errors have the same reference are returned: those with `engine` in the column `knob` if there are
    any, otherwise those with `fidelity`.
    """
    named = {row[_VALUE]: row for row in rows if row[_KNOB] == "engine"} or {
        # Older tables lack the column.
        f"{row.get('engine') or 'yade'} {row[_VALUE]}": row
        for row in rows
        if row[_KNOB] == "fidelity"
    }
    keys = ((engine, name) for engine in ENGINES for name in fidelities(engine))
    return {key: named[" ".join(key)] for key in keys if " ".join(key) in named}


def _measured(engine: str, name: str, row: dict[str, str], of: Sequence[str]) -> Measured:
    def number(column: str) -> float:
        return float(row[column]) if row[column].strip() else math.nan

    errors = {
        key: Error(of=symbol, value=number(f"{key} error [%]") / 100, band=number(f"{key} error 95 % [%]") / 100)
        for key, symbol in QUANTITIES.items()
    }
    ratio = number(_RATIO)
    return Measured(
        engine=engine,
        fidelity=name,
        errors=tuple(error for key, error in errors.items() if key in of),
        others=tuple(error for key, error in errors.items() if key not in of),
        seeds=int(row[_SEEDS]),
        ratio=ratio if ratio > 0 else 1.0,
        is_reference=row[_VERDICT] == "reference",
    )


@dataclass(frozen=True, kw_only=True)
class Choice:
    """The engine and fidelity that were chosen for a scene."""

    planned: Plan  #: Plan of the scene with corrected wall times
    expected: Measured  #: Errors and cost of the chosen fidelity
    why: str  #: Limit that decided the choice, in words
    notes: tuple[str, ...]  #: Caveats in words

    def to_dict(self) -> dict[str, Any]:
        """Return the choice as plain data, for the option `--json`."""
        return {
            "engine": self.expected.engine,
            "fidelity": self.expected.fidelity,
            "expected_hours": self.expected.hours,
            "errors": [asdict(error) for error in self.expected.errors],
            "seeds": self.expected.seeds,
            "why": self.why,
            "notes": list(self.notes),
        }

    def to_text(self) -> str:
        """Return the choice as text for the terminal."""
        found = self.expected
        errors = "none by definition" if found.is_reference else ", ".join(map(str, found.errors))
        lines = [
            f"engine {found.engine}, fidelity {found.fidelity}: {self.why}",
            f"expected: {found.hours:.2g} h of one core, error {errors} ({found.seeds} seeds)",
            *(f"note: {note}" for note in self.notes),
        ]
        return "\n".join([*lines, f"use it: --engine {found.engine} --set fidelity={found.fidelity}"])


def choose(
    scene: Scene, table: AccuracyTable, *, max_error: float | None = None, max_hours: float | None = None
) -> Choice:
    """Choose the cheapest fidelity within `max_error`; if that is None, the most exact within `max_hours`.

    One of the two limits must be given. InputError, with a limit that can be kept, if no fidelity is within the limits.

    The scene's own engine and fidelity are ignored. `max_error` is relative [1], of the quantities for which `table`
    was read; `max_hours` is wall time on one core [h].
    """
    plans: dict[str, Plan] = {}
    expected: list[Measured] = []
    rejected: list[InputError] = []
    for one in table.fidelities:
        data = {**scene.model_dump(mode="json"), "engine": one.engine, "fidelity": one.fidelity}
        try:
            planned = plan(parse_scene(data, source=f"{scene.name} at fidelity {one.name}")).corrected(one.ratio)
        except InputError as error:  # such as two rows in a section that is square
            rejected.append(error)
            continue
        plans[one.name] = planned
        expected.append(replace(one, hours=planned.wall_s / 3600))
    if not expected:
        raise rejected[0]
    picked, why = pick(expected, max_error=max_error, max_hours=max_hours)
    notes = (*map(str, rejected), *_notes(scene, table, picked, max_error))
    return Choice(planned=plans[picked.name], expected=picked, why=why, notes=notes)


def pick(expected: Sequence[Measured], *, max_error: float | None, max_hours: float | None) -> tuple[Measured, str]:
    """Return the fidelity that `choose` takes, and the limit that decided, in words.

    If `max_error` is given, this is the cheapest fidelity within it. Otherwise it is the reference, to which all errors
    are relative, if the reference takes at most `max_hours`. If it takes longer, each engine's finest fidelity within
    `max_hours` is a candidate, and the candidate with the least error is taken; unknown errors count as infinite.

    `expected` has those of one engine from coarse to fine. InputError if none is within the limits, or the cheapest
    within `max_error` takes too long.
    """
    quick = [one for one in expected if max_hours is None or one.hours <= max_hours]
    if max_error is None:
        if quick:
            finest = {one.engine: one for one in quick}.values()
            exact = min(finest, key=lambda one: (not one.is_reference, one.worst.size))
            return exact, f"the most exact within --max-hours {max_hours:g}"
        least = min(expected, key=lambda one: one.hours)
        raise InputError(
            f"--max-hours {max_hours:g}: even {least.name} is expected to take {least.hours:.2g} h; "
            f"give --max-hours {_above(least.hours)} or a smaller scene"
        )
    within = [one for one in expected if one.worst.size <= max_error]
    if not within:
        best = min(expected, key=lambda one: one.worst.size)
        raise InputError(
            f"--max-error {max_error:g}: no fidelity of the table is known to be within; the best is {best.name}, "
            f"{best.worst}; give --max-error {_above(best.worst.size)} or a table with finished reference runs"
        )
    need = min(within, key=lambda one: one.hours)
    if max_hours is None or need.hours <= max_hours:
        limits = f"--max-error {max_error:g}" + ("" if max_hours is None else f" and --max-hours {max_hours:g}")
        return need, f"the cheapest within {limits}"
    msg = (
        f"--max-error {max_error:g} and --max-hours {max_hours:g} contradict each other: {need.name}, the "
        f"cheapest within the error, is expected to take {need.hours:.2g} h; accuracy goes first, so the hours give "
        f"way: --max-hours {_above(need.hours)}"
    )
    known = [one for one in quick if math.isfinite(one.worst.size)]
    if known:
        best = min(known, key=lambda one: one.worst.size)
        msg += f"; or accept {best.name} ({best.worst}) with --max-error {_above(best.worst.size)}"
    raise InputError(msg)


def _above(number: float) -> str:
    """Return a number rounded up to two digits, as text."""
    if number <= 0 or math.isinf(number):
        return f"{max(0.0, number):g}"
    unit = 10.0 ** (math.floor(math.log10(number)) - 1)
    return f"{math.ceil(number / unit - 1e-9) * unit:.3g}"


def _notes(scene: Scene, table: AccuracyTable, measured: Measured, max_error: float | None) -> tuple[str, ...]:
    notes = []
    if not measured.is_reference:
        others = ", ".join(str(error) for error in measured.others if not math.isnan(error.value))
        if others:
            notes.append(f"not asked for (--of): {others}")
        bounds = [abs(error.value) + error.band for error in measured.errors]
        if any(math.isnan(bound) for bound in bounds):
            notes.append("the scatter between seeds is not known, so the error is not assured; measure with more seeds")
        elif max_error is not None and max(bounds) > max_error:
            notes.append(
                f"not assured: the scatter of {measured.seeds} seeds allows an error up to {max(bounds):.2g}, more "
                f"than --max-error {max_error:g}; measure with more seeds"
            )
    if not table.reference.endswith(_FINEST):
        notes.append(f"errors are against {table.reference}: the table has no finished runs of {_FINEST[0]}")
    activity = activity_of(scene)
    own_ratio = f"{scene.smarticle.aspect_ratio:g}" if scene.mixture is None else "that of no smarticle (key particle)"
    here = {
        "l/w": (own_ratio, f"{table.aspect_ratio:g}"),
        "N": (str(scene.count), str(table.count)),
        "activity": (activity, table.activity),
    }
    for name, (own, there) in here.items():
        if own != there:
            notes.append(f"errors were measured at {name} {there}, this scene has {own or 'none'}")
    return (*notes, f"table: {table.path}")
