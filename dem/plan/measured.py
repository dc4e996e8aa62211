"""What was measured of accuracy against cost, read from a table of `smarticles accuracy`."""

from __future__ import annotations

import csv
import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

from dem.engine import ENGINES
from dem.errors import InputError
from dem.setting.fidelity import FIDELITIES, fidelities

SHIPPED = Path(__file__).with_name("work_precision.csv")
"""The table that is used unless another one is given; there only if it was measured."""

_HOW = "make one: smarticles accuracy SCENE.yaml --out DIR, then --table DIR/results/work_precision.csv"
_ENGINE = "engine"
FINEST, FINER = list(FIDELITIES)[-1], "converged"
_KNOB, _VALUE, _SEEDS, _RATIO = "knob", "value", "seeds [-]", "processor time over expected wall time [-]"
_ASPECT, _COUNT, _ACTIVITY, _REFERENCE = "aspect ratio [-]", "smarticles [-]", "activity", "verdict"
QUANTITIES = {"phi_0": "φ_0", "phi_f": "φ_f", "crossings": "⟨N⟩"}
"""What a limit of the error can be of: names of columns and of `--of`, and symbols."""

PACKING = ("phi_0", "phi_f")
"""What it is of unless said otherwise."""

_COLUMNS = (
    *(_KNOB, _VALUE, _SEEDS, _RATIO, _ASPECT, _COUNT, _ACTIVITY, _REFERENCE),
    *(f"{name} error{mark} [%]" for name in QUANTITIES for mark in ("", " 95 %")),
)


@dataclass(frozen=True, kw_only=True)
class Error:
    """A relative error.

    Args:
        of: symbol of what.
        value: against the reference fidelity [1]; NaN if unknown.
        band: half-width of its 95 % interval over seeds [1]; NaN if unknown.
    """

    of: str
    value: float
    band: float

    def __str__(self) -> str:
        band = f" ± {self.band:.3f}" if math.isfinite(self.band) else ", scatter unknown"
        return f"{self.of} {self.value:+.3f}{band}"


@dataclass(frozen=True, kw_only=True)
class Measured:
    """One named fidelity of an engine as the table has it.

    Args:
        engine: whose it is.
        fidelity: its name.
        errors: of what is asked for, such as φ_0 and φ_f.
        others: of what is not, to be told.
        seeds: how many runs it was measured with.
        ratio: measured processor time over the planned wall time [1].
        is_reference: whether the errors of the others are against it.
    """

    fidelity: str
    errors: tuple[Error, ...]
    engine: str = "yade"
    others: tuple[Error, ...] = ()
    seeds: int
    ratio: float
    is_reference: bool

    @property
    def name(self) -> str:
        """Engine and fidelity."""
        return f"{self.fidelity} on {self.engine}"

    @property
    def worst(self) -> Error:
        """The largest error; NaN if one is unknown."""
        unknown = [error for error in self.errors if math.isnan(error.value)]
        return unknown[0] if unknown else max(self.errors, key=lambda error: abs(error.value))


@dataclass(frozen=True, kw_only=True)
class AccuracyTable:
    """What was measured, and of which scene.

    Args:
        path: the file.
        fidelities: those with finished runs, engine by engine in the order of their names.
        reference: what errors are against, as the table calls it.
        aspect_ratio: l/w [1].
        count: smarticles [1].
        activity: types of phase, separated by spaces.
    """

    path: Path
    fidelities: tuple[Measured, ...]
    reference: str
    aspect_ratio: float
    count: int
    activity: str


def read_table(path: Path | None, *, of: Sequence[str] = PACKING, engine: str | None = None) -> AccuracyTable:
    """Read a table of `smarticles accuracy`.

    Args:
        path: the file; None: the one that ships.
        of: what errors are asked for, keys of `QUANTITIES`.
        engine: the only one that may be chosen; None: any that the table tells of.

    Raises:
        InputError: there is none, it is another table, or it does not tell of named fidelities.
    """
    file = SHIPPED if path is None else path
    if path is None and not file.is_file():
        msg = f"--table: no table of measured errors ships at {file}; {_HOW}"
        raise InputError(msg)
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "not a text file"
        msg = f"--table {file}: cannot be read ({why}); {_HOW}"
        raise InputError(msg) from None
    reader = csv.DictReader(line for line in lines if line and not line.startswith("#"))
    for column in _COLUMNS:
        if column not in (reader.fieldnames or ()):
            msg = f"--table {file}: has no column {column!r}, so it is no table of work and precision; {_HOW}"
            raise InputError(msg)
    every_row = list(reader)
    rows = _rows_of_fidelities(every_row)
    try:
        every = [_measured(one, name, row, of) for (one, name), row in rows.items() if int(row[_SEEDS]) > 0]
        reference = _reference(every_row, {row[_KNOB] for row in rows.values()})
        if reference is None or len(every) < 2:
            msg = f"--table {file}: tells of fewer than two named fidelities with runs; {_HOW}"
            raise InputError(msg)
        found = tuple(one for one in every if engine in (None, one.engine))
        if not found:
            there = ", ".join(dict.fromkeys(one.engine for one in every))
            msg = (
                f"--table {file}: tells nothing of the engine {engine}, only of {there}; leave --engine out, or {_HOW}"
            )
            raise InputError(msg)
        first = next(iter(rows.values()))
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
        msg = f"--table {file}: a row of knob fidelity does not hold numbers ({error}); {_HOW}"
        raise InputError(msg) from None


def _rows_of_fidelities(rows: Sequence[dict[str, str]]) -> dict[tuple[str, str], dict[str, str]]:
    """Rows of named fidelities by engine and name, coarse to fine.

    One reference goes for all: where the table has the knob `engine`, its rows; otherwise those of the knob `fidelity`.
    """
    both = {row[_VALUE]: row for row in rows if row[_KNOB] == _ENGINE}
    # Before there was a second engine, tables did not name it.
    alone = {f"{row.get(_ENGINE) or 'yade'} {row[_VALUE]}": row for row in rows if row[_KNOB] == "fidelity"}
    named = both or alone
    return {
        (engine, name): named[f"{engine} {name}"]
        for engine in ENGINES
        for name in fidelities(engine)
        if f"{engine} {name}" in named
    }


def _reference(rows: Sequence[dict[str, str]], knobs: Collection[str]) -> str | None:
    """What errors are against, such as "links converged": it need not be a named fidelity."""
    found = (row for row in rows if row[_KNOB] in knobs and row[_REFERENCE] == "reference")
    return next((row[_VALUE] for row in found if int(row[_SEEDS]) > 0), None)


def _measured(engine: str, name: str, row: dict[str, str], of: Sequence[str]) -> Measured:
    ratio = _number(row[_RATIO])
    errors = {
        key: Error(
            of=symbol, value=_number(row[f"{key} error [%]"]) / 100, band=_number(row[f"{key} error 95 % [%]"]) / 100
        )
        for key, symbol in QUANTITIES.items()
    }
    return Measured(
        engine=engine,
        fidelity=name,
        errors=tuple(error for key, error in errors.items() if key in of),
        others=tuple(error for key, error in errors.items() if key not in of),
        seeds=int(row[_SEEDS]),
        ratio=ratio if ratio > 0 else 1.0,
        is_reference=row[_REFERENCE] == "reference",
    )


def _number(text: str) -> float:
    return float(text) if text.strip() else math.nan
