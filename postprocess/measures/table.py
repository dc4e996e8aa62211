"""Measure whole runs and return tables with one row per frame, or one row per phase."""

import math
from collections.abc import Collection, Iterable, Sequence
from typing import Literal

import numpy as np
import pandas as pd

from dem.errors import InputError
from dem.record.columns import COMPONENTS, EVERY
from dem.record.frame import Frame
from dem.record.frames import FrameSequence
from dem.record.run import Run
from dem.record.series import Series
from postprocess.measures.packing import DEFINITIONS
from postprocess.measures.pile import POUR, settled
from postprocess.measures.registry import FrameMeasure, frame_measures, phase_measures
from postprocess.statistics.points import ASPECT, SEED, marked
from postprocess.statistics.seeds import mean_with_error

Costly = Literal["never", "phase-end", "every-frame"]  #: Frames for which costly measures are computed

LAST_FRAMES = 20  #: Number of frames averaged at the end of a phase, as in Savoie et al

_PHASE = ("phase", "phase type")
_LABELS = ("run", "name", SEED, ASPECT, "count", "fidelity", "scene_sha256")
# Left out, because the table computes these from the frames.
_SERIES_MEASURED = frozenset({"time_s", "phase", "count", "com_height_m", "packing_fraction"})


def measure_run(
    run: Run,
    *,
    definitions: Sequence[str] = tuple(DEFINITIONS),
    costly: Costly = "phase-end",
    measures: Sequence[FrameMeasure] = (),
    also: Collection[str] = (),
) -> pd.DataFrame:
    """Measure every frame of a run, which may be finished, failed or still running.

    Args:
        definitions: Definitions of the packing fraction, keys of `packing.DEFINITIONS`.
        costly: Frames for which costly measures are computed: "never" none, "phase-end" the last recorded frame of each
            phase, "every-frame" all.
        measures: Further measures, whose columns follow those of the registered ones.
        also: Names of measures that tables have on request alone, such as "crossing-number", computed for every frame.

    Returns:
        A table with one row per frame and units in its column names. Columns of `series.h5`, if that file exists, have
        the sample of the frame's phase that is nearest in time. A value is NaN if it is undefined for its frame, such
        as the packing fraction of one smarticle, or if it is costly and not computed.

    Raises:
        InputError: Unknown definition or name, or a file is missing or damaged.
    """
    frames, series = _open(run, definitions)
    rows: list[dict[str, object]] = []
    for part in filter(None, _frames_by_phase(run, frames)):
        known = (*frame_measures(definitions, also), *measures)
        rows += _rows(part, run, series, known, costly, asked=also, offset=len(rows))
    return pd.DataFrame(rows)


def summarise_run(
    run: Run,
    *,
    last: int = LAST_FRAMES,
    definitions: Sequence[str] = tuple(DEFINITIONS),
    costly: Costly = "phase-end",
    also: Collection[str] = (),
    phases: Collection[int] | None = None,
    measures: Sequence[FrameMeasure] = (),
) -> pd.DataFrame:
    """Measure each phase of a run: means over its last frames, and measures of the whole phase.

    Args:
        last: Number of frames to average, at equal intervals of time; a phase with fewer is averaged over all of them.
        definitions: Definitions of the packing fraction, keys of `packing.DEFINITIONS`.
        costly: Frames for which costly measures are computed, see `measure_run`.
        also: Names of measures that tables have on request alone, such as "crossing-number".
        phases: Indices of the phases to measure; all if not given.
        measures: Further measures, whose columns follow those of the registered ones.

    Returns:
        A table with one row per phase that the run has begun and units in its column names. A column "… SE" follows
        each mean with its standard error, see `seeds.mean_with_error`. "frames averaged" is the number of frames. The
        frame at the end of a phase counts in means where no other frame has a value, since it may follow at another
        interval. Of a pour, only frames of the settled pile are averaged. If there is no frame to average, the number
        is 0 and all means are NaN. By default costly measures are computed for the last frame alone and have no error.

    Raises:
        InputError: Unknown definition or name, `last` below 1, or a file is missing or damaged.
    """
    if last < 1:
        raise InputError(f"last must be 1 frame or more: got {last}; {LAST_FRAMES} is usual")
    frames, series = _open(run, definitions)
    known = (*frame_measures(definitions, also), *measures)
    summaries = []
    for index, part in enumerate(_frames_by_phase(run, frames)):
        if (phases is not None and index not in phases) or not (part or _begun(run, series, index)):
            continue
        summary: dict[str, object] = {**_labels(run, index), "time [s]": run.phases[index].end_s, "frames averaged": 0}
        if part:
            summary |= _means(part, run, series, known, last=last, costly=costly)
        if series is not None:
            for measure in phase_measures():
                summary |= measure.columns(run, series, index)
        summaries.append(summary)
    return pd.DataFrame(summaries)


def _means(
    part: FrameSequence,
    run: Run,
    series: Series | None,
    known: Sequence[FrameMeasure],
    *,
    last: int,
    costly: Costly,
) -> dict[str, object]:
    """Return means over the last frames of a phase, with errors, and values of its last frame by column."""
    end = part[-1]
    chosen = _averaged(run.at_intervals(part)[-last:], run) or _averaged([end], run)
    shown = [*(frame for frame in chosen if frame.number != end.number), end]
    table = pd.DataFrame(_rows(shown, run, series, known, costly if chosen else "never"))
    found: dict[str, object] = {"time [s]": end.time, "frames averaged": len(chosen)}
    for name in table.columns.difference([*_LABELS, *_PHASE, *found, "frame"], sort=False):
        values = table[name].iloc[: len(chosen)]
        mean = mean_with_error(values if values.notna().any() or not chosen else table[name])
        found |= {name: mean.value, marked(name, "SE"): mean.standard_error}
    return found


def _begun(run: Run, series: Series | None, phase: int) -> bool:
    """Return whether a run has begun a phase, of which it has no frame."""
    return run.phases[phase].end_s is not None or (series is not None and bool((series["phase"] >= phase).any()))


def columns_of(run: Run, phase: int, recorded: Iterable[str]) -> list[str]:
    """Return the columns of numbers that `summarise_run` makes for a phase of a run, which need not have begun.

    `recorded` are the names of its series.
    """
    found = [
        *(
            quantity.header
            for measure in frame_measures(tuple(DEFINITIONS))
            if measure.available_for(run)
            for quantity in measure.quantities
        ),
        *(
            _header(EVERY[name].label, EVERY[name].unit, component)
            for name in recorded
            if name not in _SERIES_MEASURED
            for component in EVERY[name].components
        ),
    ]
    whole = (measure for measure in phase_measures() if run.phases[phase].type in measure.phases)
    return [
        *("count", ASPECT, "time [s]", "frames averaged"),
        *(column for name in found for column in (name, marked(name, "SE"))),
        *(quantity.header for measure in whole for quantity in measure.quantities),
    ]


def _open(run: Run, definitions: Iterable[str]) -> tuple[FrameSequence, Series | None]:
    for definition in definitions:
        if definition not in DEFINITIONS:
            raise InputError(f"unknown definition of the packing fraction '{definition}': {list(DEFINITIONS)}")
    _ = run.manifest
    # A run that failed in its first seconds may have frames and no series.
    return run.frames, run.series if run.has_series else None


def _frames_by_phase(run: Run, frames: FrameSequence) -> list[FrameSequence]:
    """Return the frames of each phase; none for a phase that takes no time, or that older versions recorded."""
    parts = [frames.in_phase(phase.index) for phase in run.phases]
    if sum(map(len, parts)) != len(frames):
        raise InputError(
            f"frames of {run.path} name phases that run.json does not have "
            f"(it has {len(parts)}), or not in order; run it again into a new directory"
        )
    return parts


def _averaged(part: Sequence[Frame], run: Run) -> list[Frame]:
    """Return the frames at the end of a phase that its means average: of a pour, those of the settled pile."""
    return [frame for frame in part if run.phases[frame.phase].type != POUR or settled(frame, run)]


def _labels(run: Run, phase: int) -> dict[str, object]:
    """Return the columns that identify a run and its phase."""
    made = run.manifest
    values = (str(run.path), made.name, made.seed, made.aspect_ratio, made.count, made.fidelity, made.scene_sha256)
    return dict(zip((*_LABELS, *_PHASE), (*values, phase, run.phases[phase].type), strict=True))


def _rows(
    part: Sequence[Frame],
    run: Run,
    series: Series | None,
    known: Sequence[FrameMeasure],
    costly: Costly,
    *,
    asked: Collection[str] = (),
    offset: int = 0,
) -> list[dict[str, object]]:
    """Return one row of a table for each of several successive frames of one phase.

    Values of `series`, if given, at the time of a frame are added. The measures `known` are computed if they apply to
    the run; rows of frames for which `costly` measures are not computed have NaN, see `measure_run`; those with a name
    in `asked` are computed for every frame. The first frame has the number `offset` in the column "frame".
    """
    rows: list[dict[str, object]] = []
    measures = [measure for measure in known if measure.available_for(run)]
    for number, frame in enumerate(part):
        take_costly = costly == "every-frame" or (costly == "phase-end" and number == len(part) - 1)
        labels = _labels(run, frame.phase)
        of_phase = {name: labels.pop(name) for name in _PHASE}
        row: dict[str, object] = {**labels, "frame": offset + number, "time [s]": frame.time, **of_phase}
        for measure in measures:
            taken = take_costly or not measure.costly or measure.name in asked
            columns = measure.columns(frame if taken else None, run)
            if twice := row.keys() & columns.keys():
                raise InputError(f"measure {measure.name}: the table has a column {min(twice)!r} already; rename it")
            row |= columns
        if series is not None:
            row |= _series_columns(series, frame)
        rows.append(row)
    return rows


def _series_columns(series: Series, frame: Frame) -> dict[str, float]:
    """Return the values of the series in the sample nearest in time with the phase and the bodies of a frame."""
    columns: dict[str, float] = {}
    alike = np.flatnonzero((series["phase"] == frame.phase) & (series.get("count", frame.count) == frame.count))
    if not len(alike):
        return columns
    index = alike[np.abs(series.time[alike] - frame.time).argmin()]
    for name, values in series.data.items():
        if name in _SERIES_MEASURED:
            continue
        # A newer version may have recorded a column that is unknown here.
        label = EVERY[name].label if name in EVERY else name
        unit = series.units[name]
        factor = math.degrees(1) if unit == "rad" else 1
        components = ("",) if values.ndim == 1 else COMPONENTS[values.shape[1]]
        for component, value in zip(components, np.atleast_1d(values[index]), strict=True):
            columns[_header(label, unit, component)] = factor * float(value)
    return columns


def _header(label: str, unit: str, component: str) -> str:
    """Return the column of a quantity of the series: label, component, and unit.

    Files write a pure number's unit as 1 and angles in radians; tables have a dash, and degrees as scenes do.
    """
    shown = {"1": "-", "": "-", "rad": "degree"}.get(unit, unit)
    return f"{label} {component}".strip() + f" [{shown}]"
