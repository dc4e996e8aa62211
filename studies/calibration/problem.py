"""Read calibration files: free parameters with priors, measured data, and the runs to spend on them.

`smarticles calibrate --help` shows a calibration file with all its keys.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError, model_validator
from scipy import stats

from dem.errors import InputError, nearest, shown
from dem.strict import Strict, equal, explained
from dem.yaml_text import parse_yaml
from templates.sweep.expand import Point, points_of
from templates.sweep.from_scene import as_template
from templates.sweep.render import Value, variables_of
from templates.sweep.sweep_file import SEED, Sweep, SweepFile, parse_table, read_text

Array = NDArray[np.float64]

POINT, CONDITION, REPEAT = "point", "condition", "repeat"  #: Variables that every run has beside those in the file
MEASURE, VALUE, ERROR, PREDICT = "measure", "value", "error", "predict"  #: Columns of the data that are not variables
_SEEDS_PER_WAVE = 1_000_000  # so that no two runs of a calibration have one seed
_RUN_NAME = f"p{{{{ {POINT} }}}}_c{{{{ {CONDITION} }}}}_r{{{{ {REPEAT} }}}}"


class Prior(Strict):
    """Knowledge of a parameter before the calibration: uniform, or normal and cut at both ends."""

    low: float = Field(description="smallest value")
    high: float = Field(description="largest value")
    mean: float | None = Field(default=None, description="mean of a normal distribution; default: uniform")
    sd: float | None = Field(default=None, gt=0, description="standard deviation of the normal distribution")

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not self.low < self.high:
            raise ValueError(f"high: {self.high:g} is not above low, {self.low:g}; exchange them")
        if (self.mean is None) != (self.sd is None):
            raise ValueError("a normal prior needs both mean and sd; give both, or neither for a uniform prior")
        if self.mean is not None and not self.low <= self.mean <= self.high:
            raise ValueError(f"mean: {self.mean:g} is outside low … high, {self.low:g} … {self.high:g}")
        return self

    @property
    def distribution(self) -> Any:
        """Frozen distribution of SciPy."""
        if self.mean is None or self.sd is None:
            return stats.uniform(self.low, self.high - self.low)
        ends = (self.low - self.mean) / self.sd, (self.high - self.mean) / self.sd
        return stats.truncnorm(*ends, loc=self.mean, scale=self.sd)


class CalibrationFile(Strict):
    """Validated content of a calibration file."""

    schema_version: int = Field(1, ge=1, le=1)
    name: str = Field(min_length=1)
    template: str | None = Field(None, description="scene template; a relative path starts at the calibration file")
    scene: str | None = Field(None, description="scene file, instead of a template; `keys` says what changes in it")
    keys: dict[str, str] = Field({}, description="dotted key of the scene for each variable, with `scene`")
    constants: dict[str, Value] = Field({}, description="values of variables of the template that all runs share")
    free: dict[str, Prior] = Field(min_length=1, description="free parameters: variables with their priors")
    data: str = Field(description="CSV file of measured points; a relative path starts at the calibration file")
    budget: int = Field(ge=1, description="largest number of runs, over all waves [1]")
    seeds: int = Field(1, ge=1, description="runs with different seeds at every point and condition [1]")
    waves: int = Field(2, ge=1, le=10, description="number of waves; each narrows the region of the next [1]")
    first_seed: int = Field(1, ge=0, lt=2**40, description="seed of the first run, and of all random choices [1]")
    discrepancy: float = Field(
        0.05,
        gt=0,
        le=1,
        description="scale of the half-normal prior of the model's discrepancy, over the mean size of a measure [1]",
    )

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.template is not None and self.scene is not None:
            raise ValueError("both template and scene are given; keep one of them")
        if self.scene is None and self.keys:
            raise ValueError("keys: are for `scene`; a template names its variables itself, so leave keys out")
        for name in (POINT, CONDITION, REPEAT):
            if name in self.free or name in self.constants:
                raise ValueError(f"{name}: is set by the program; choose another name")
        return self


@dataclass(frozen=True, kw_only=True)
class Datum:
    """One measured point."""

    condition: int  #: Index of its condition in `Problem.conditions`
    measure: str  #: Name of the measure
    value: float  #: Measured value
    error: float  #: Standard deviation of the measured value, including the scatter of repetitions
    fitted: bool  #: Whether the calibration uses the point; otherwise the point is predicted only

    def label(self, conditions: Sequence[Mapping[str, Value]]) -> str:
        """Return measure and condition as text."""
        where = ", ".join(f"{name} {value}" for name, value in conditions[self.condition].items())
        return f"{self.measure} ({where})" if where else self.measure


@dataclass(frozen=True, kw_only=True)
class Problem:
    """Parameters, data and runs of a calibration; a condition is a combination of the data's variables."""

    path: Path
    text: str
    content: CalibrationFile
    data_text: str = ""
    conditions: tuple[Mapping[str, Value], ...]
    data: tuple[Datum, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the free parameters."""
        return tuple(self.content.free)

    @property
    def fitted(self) -> list[Datum]:
        """Data that the calibration uses."""
        return [datum for datum in self.data if datum.fitted]

    @cached_property
    def sizes(self) -> Array:
        """Mean size of the measure of each of the J data, (J,), in the unit of the measure.

        It is the mean absolute value over all fitted data of this measure, or over all its data if none is fitted. The
        standard deviation of the model's discrepancy is σ times this size.
        """
        found = []
        for datum in self.data:
            alike = [one for one in self.data if one.measure == datum.measure]
            used = [one for one in alike if one.fitted] or alike
            found.append(float(np.mean([abs(one.value) for one in used])))
        return np.array(found)

    def conditions_of(self, wave: int) -> list[int]:
        """Return the indices of the conditions in a wave: conditions with fitted data; in the last wave all."""
        last = wave == self.content.waves
        return [k for k in range(len(self.conditions)) if last or any(one.condition == k for one in self.fitted)]

    @property
    def points_per_wave(self) -> int:
        """Number of points that the budget allows in each wave; InputError if they are too few to emulate."""
        content = self.content
        per_point = content.seeds * sum(len(self.conditions_of(wave)) for wave in range(1, content.waves + 1))
        points, least = content.budget // per_point, 3 * len(self.names) + 3
        if points * content.waves < least:
            raise InputError(
                f"{self.path}: budget: {content.budget} runs are {points} points in each of {content.waves} waves; "
                f"{len(self.names)} free parameters need {least} points in all: give at least "
                f"{per_point * -(-least // content.waves)}, or fewer waves, seeds or conditions"
            )
        return points

    def scaled(self, theta: Array) -> Array:
        """Return parameters (n, d) over the ranges of their priors, from 0 to 1."""
        low, high = self.bounds
        return (theta - low) / (high - low)

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Smallest and largest values of the parameters, (d,) each."""
        priors = self.content.free.values()
        return np.array([prior.low for prior in priors]), np.array([prior.high for prior in priors])

    def from_unit(self, unit: Array) -> Array:
        """Return parameters (n, d) whose cumulative prior probabilities are `unit` (n, d)."""
        columns = [prior.distribution.ppf(unit[:, k]) for k, prior in enumerate(self.content.free.values())]
        found: Array = np.clip(np.stack(columns, axis=1), *self.bounds)
        return found

    def log_prior(self, theta: Array) -> Array:
        """Return ln of the prior density (n,) of parameters (n, d), up to a constant; -inf out of range."""
        low, high = self.bounds
        found: Array = np.where(np.all((low <= theta) & (theta <= high), axis=1), 0.0, -np.inf)
        for k, prior in enumerate(self.content.free.values()):
            if prior.mean is not None and prior.sd is not None:
                found -= 0.5 * ((theta[:, k] - prior.mean) / prior.sd) ** 2
        return found

    def runs(self, wave: int, theta: Array) -> list[dict[str, Value]]:
        """Return the variables of all runs of a wave (counted from 1) at parameters (n, d).

        No two runs of a calibration have one seed, so that the scatter from seed to seed is independent.
        """
        content = self.content
        found: list[dict[str, Value]] = []
        for point, row in enumerate(theta):
            for condition in self.conditions_of(wave):
                for repeat in range(content.seeds):
                    seed = content.first_seed + _SEEDS_PER_WAVE * (wave - 1) + len(found)
                    parameters = dict(zip(self.names, map(float, row), strict=True))
                    numbers = {POINT: point, CONDITION: condition, REPEAT: repeat, SEED: seed}
                    found.append({**content.constants, **parameters, **self.conditions[condition], **numbers})
        return found

    def sweep(self, wave: int, theta: Array) -> tuple[Sweep, list[Point]]:
        """Return a wave (counted from 1) at parameters (n, d) as a sweep with its points.

        InputError if the file names no scene, the scene cannot be read, or a run's scene is not valid.
        """
        content = self.content
        source = content.template or content.scene
        if source is None:
            raise InputError(f"{self.path}: template: missing; give a scene template, or `scene`, or runs by --table")
        file = self.path.parent / source
        text = read_text(file, "scene template" if content.template else "scene")
        runs = self.runs(wave, theta)
        described = {
            "schema_version": 1,
            "name": f"{content.name}-wave{wave}",
            "template": source,
            "run_name": _RUN_NAME,
            "points": {"list": [{POINT: 0}]},
        }
        sweep = Sweep(
            path=self.path,
            text=self.text,
            content=SweepFile.model_validate(described),
            template=file,
            template_text=text if content.template else self._template(text, file),
        )
        points = points_of(sweep, runs)
        self._check_used(sweep)
        return sweep, points

    def _check_used(self, sweep: Sweep) -> None:
        """Raise InputError for a variable without effect: the runs would be spent on nothing."""
        used = variables_of(sweep.template_text)
        file = self.path.parent / self.content.data
        places = {
            **dict.fromkeys(self.names, f"{self.path}: free"),
            **dict.fromkeys(self.conditions[0], f"{file}, line 1: column"),
        }
        for name in sorted(places.keys() - used):
            raise InputError(
                f"{places[name]}: {name!r} is no variable of {sweep.template}; {nearest(name, sorted(used))}"
            )

    def _template(self, text: str, file: Path) -> str:
        """Turn the text of a scene into a template with a variable for each of `keys`, and one for the seed.

        `keys` of the calibration file has the key of the scene that each variable changes. `file` is the path of the
        scene, for messages. InputError if `keys` lacks a variable or has an unknown one.
        """
        data = parse_yaml(text, str(file))
        if not isinstance(data, dict):
            raise InputError(f"{file}: a scene is a mapping of keys to values, got {shown(data)}")
        own = {*self.names, *self.content.constants, *(name for one in self.conditions for name in one)}
        for name in own - set(self.content.keys):
            raise InputError(f"{self.path}: keys: {name!r} is missing; give the key of {file} that it changes")
        for name in set(self.content.keys) - own:
            raise InputError(f"{self.path}: keys.{name}: is no variable; there are {', '.join(sorted(own))}")
        return as_template(data, {key: name for name, key in {**self.content.keys, SEED: SEED}.items()}, str(file))


def load_problem(path: Path) -> Problem:
    """Read a calibration file and its data; raise InputError if either is not valid."""
    text = read_text(path, "calibration file")
    data = parse_yaml(text, str(path))
    if not isinstance(data, dict):
        raise InputError(f"{path}: a calibration file holds keys such as free and data: got {shown(data)}")
    try:
        content = CalibrationFile.model_validate(data)
    except ValidationError as error:
        raise InputError(f"{path}: {explained(error, data, described='`smarticles calibrate --help`')}") from error
    file = path.parent / content.data
    table = read_text(file, "table of data")
    conditions, points = _read_data(file, table, content)
    return Problem(path=path, text=text, content=content, data_text=table, conditions=conditions, data=points)


def _read_data(
    file: Path, text: str, content: CalibrationFile
) -> tuple[tuple[Mapping[str, Value], ...], tuple[Datum, ...]]:
    rows = parse_table(text, str(file))
    for name in (MEASURE, VALUE, ERROR):
        if name not in rows[0]:
            raise InputError(f"{file}, line 1: column {name!r} is missing; columns are {', '.join(rows[0])}")
    variables = [name for name in rows[0] if name not in (MEASURE, VALUE, ERROR, PREDICT)]
    for name in variables:
        if name in {*content.free, *content.constants, POINT, CONDITION, REPEAT, SEED}:
            raise InputError(f"{file}, line 1: column {name!r} is a variable with another meaning; rename it")
    conditions: list[Mapping[str, Value]] = []
    data: list[Datum] = []
    for number, row in enumerate(rows, start=2):
        where = f"{file}, row {number}"
        value, error, predict = row[VALUE], row[ERROR], row.get(PREDICT, 0)
        if isinstance(value, str) or not np.isfinite(value):
            raise InputError(f"{where}: {VALUE}: {value!r} is not a finite number")
        if isinstance(error, str) or not 0 < error < np.inf:
            msg = f"{where}: {ERROR}: {error!r} is not a number above 0; give the standard deviation of the value"
            raise InputError(msg)
        if predict not in (0, 1):
            raise InputError(f"{where}: {PREDICT}: {predict!r} is neither 0 (fit) nor 1 (predict only)")
        condition = {name: row[name] for name in variables}
        index = next((k for k, one in enumerate(conditions) if equal(one, condition)), len(conditions))
        if index == len(conditions):
            conditions.append(condition)
        datum = Datum(
            condition=index,
            measure=str(row[MEASURE]),
            value=float(value),
            error=float(error),
            fitted=not predict,
        )
        if any((one.condition, one.measure) == (datum.condition, datum.measure) for one in data):
            raise InputError(f"{where}: {datum.label(conditions)} is given twice; give one mean with its error")
        data.append(datum)
    if not any(datum.fitted for datum in data):
        raise InputError(f"{file}: all rows have {PREDICT} 1, so that nothing is fitted; set it to 0 in some rows")
    return tuple(conditions), tuple(data)
