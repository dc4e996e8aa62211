"""Measure how a free-standing column collapses on a vibrating floor: height against time, and τ.

A column loses height because it sinks and because smarticles leave it. On a floor that shakes with several g,
smarticles that have left hop as high as a low column, so that the mean height of all smarticles does not fall to that
of a layer. The height `remaining` avoids this bias: it counts the smarticles that have not left.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from dem.errors import InputError
from dem.record.document import Phase
from dem.record.run import Run
from postprocess.geometry.bars import body_centres
from postprocess.geometry.links import Floats
from postprocess.statistics.seeds import mean_with_error

REMAINING, COM, CORE = "remaining", "com", "core"

HEIGHTS: Mapping[str, str] = MappingProxyType(
    {
        REMAINING: "smarticles still within the container's radius, over their number before vibration: the height "
        "that a column of unchanged density would have",
        COM: "height of the centre of mass of all smarticles, over its height before vibration",
        CORE: "height of the centre of mass of the smarticles within the container's radius, over its height before "
        "vibration; from frames",
    }
)  #: Definitions of a column's height by name, each relative to the height before vibration

_KNOWN_ENDS: Mapping[str, Mapping[str, float]] = MappingProxyType({REMAINING: {"start": 1.0, "end": 0.0}})
"""Known start and end of the fitted curve [-], by the definition of the height.

By `REMAINING` the curve starts at 1 and ends at 0, since all smarticles leave in the end. By the other definitions
start and end are fitted, because smarticles bounce at the start and hop in the end."""

REST = 0.1  #: Time before vibration over which the reference height is averaged [s]
LEAST_FALL = 0.25  #: A column that has lost less than this fraction of its height still stands [-]
WORST_ERROR = 0.5  #: Largest relative error of a collapse time that counts as measured [-]

_LEAST_SAMPLES = 10
_EXPONENTS = (0.3, 3.0)  # bounds of β
_LONGEST = 1e4  # bound of τ over the observation time; for larger ones the curve is flat, whatever τ


@dataclass(frozen=True, kw_only=True)
class Vibration:
    """The phase that shakes a free-standing column."""

    phase: Phase
    acceleration: float  #: Peak acceleration of the floor over g [-]
    frequency: float  #: Frequency of the floor's motion [Hz]


@dataclass(frozen=True, kw_only=True, eq=False)
class ColumnHistory:
    """Heights of one column against time."""

    times: Floats  #: (n,) times since the vibration began [s]; negative before
    heights: Floats  #: (n,) heights divided by `before` [-]
    before: float  #: Mean height in the last `REST` seconds before the vibration [m]; a fraction [-] for `REMAINING`


@dataclass(frozen=True, kw_only=True)
class CollapseTime:
    """Fit of h(t) = h_end + (h_start − h_end) exp(−(t/τ)^β) to the height of a collapsing column."""

    #: "collapsed": τ was measured; "collapsing": the column has lost height, but τ is longer than the observation or
    #: its error too large; "standing": the column has lost less than `LEAST_FALL` of its height
    outcome: Literal["collapsed", "collapsing", "standing"]
    time: float  #: τ [s]; NaN unless collapsed
    #: Standard error of τ [s], which allows for the correlation of successive residuals. If τ is shorter than the time
    #: of the first sample, the error is that time. NaN unless collapsed
    error: float
    bound: float  #: Lower bound of τ [s]: the observation time; NaN if collapsed
    exponent: float  #: β [-]
    start: float  #: h_start, in the heights' unit
    end: float  #: h_end, in the heights' unit
    fall: float  #: Fraction of the height that the fitted curve loses during the observation [-]


def vibration(run: Run) -> Vibration:
    """Find the first phase of a run that shakes the floor after the wall was removed.

    InputError if the run has no such phase.
    """
    kinds = [phase.type for phase in run.phases]
    after = kinds.index("remove-container") if "remove-container" in kinds else len(kinds)
    found = next((phase for phase in run.phases[after:] if phase.type == "shake"), None)
    if found is None:
        raise InputError(f"{run.path}: no shake after a remove-container: its phases are {', '.join(kinds)}")
    settings = run.scene["phases"][found.index]
    return Vibration(phase=found, acceleration=settings["peak_acceleration_g"], frequency=settings["frequency_hz"])


def column_history(run: Run, definition: str, shaken: Vibration) -> ColumnHistory:
    """Read a column's heights from the phase before its vibration to the end of the vibration.

    The definition is a key of `HEIGHTS`. InputError if the run has no samples before the vibration.
    """
    times, heights = _core(run, shaken) if definition == CORE else _of_series(run, definition, shaken)
    assert shaken.phase.start_s is not None  # the run is finished
    times = times - shaken.phase.start_s
    resting = (times > -REST * (1 + 1e-6)) & (times < 1e-9)
    before = float(heights[resting].mean()) if resting.any() else math.nan
    if not before > 0:
        raise InputError(
            f"{run.path}: no height of the column in the last {REST:g} s before its vibration; record more often, "
            "or rest longer before"
        )
    return ColumnHistory(times=times, heights=heights / before, before=before)


def height_with_the_wall(run: Run) -> float:
    """Return the height of a column's centre of mass just before the wall is removed [m].

    It is the height in the last sample before the phase that removes the wall. InputError if there is no such sample.
    """
    series = run.series
    removal = [phase.type for phase in run.phases].index("remove-container")
    heights = series["com_height_m"][series["phase"] < removal]
    if not len(heights):
        raise InputError(f"{run.path}: no height of the column before its wall was removed; record more often")
    return float(heights[-1])


def _of_series(run: Run, definition: str, shaken: Vibration) -> tuple[Floats, Floats]:
    series = run.series
    last = shaken.phase.index
    shown = (series["phase"] >= last - 1) & (series["phase"] <= last)
    if definition == REMAINING:
        heights = 1 - series["outside_count"][shown] / run.manifest.count
    else:
        heights = np.asarray(series["com_height_m"][shown], dtype=np.float64)
    return series.time[shown], heights


def _core(run: Run, shaken: Vibration) -> tuple[Floats, Floats]:
    frames, last = run.frames, shaken.phase.index
    times, heights = [], []
    for frame in (frame for phase in (last - 1, last) for frame in run.at_intervals(frames.in_phase(phase))):
        centres = body_centres(frame)
        within = np.hypot(centres[:, 0], centres[:, 1]) <= run.manifest.container_radius_m
        times.append(frame.time)
        heights.append(max(0.0, float(centres[within, 2].mean() - frame.floor_z)) if within.any() else 0.0)
    return np.array(times), np.array(heights)


def collapse_of(history: ColumnHistory, definition: str, shaken: Vibration) -> CollapseTime:
    """Fit the collapse time of a column to its heights, averaged over each period of the vibration.

    The definition is the key of `HEIGHTS` by which the heights were read.
    """
    times, heights = period_means(history.times, history.heights, shaken.frequency)
    return collapse_time(times, heights, **_KNOWN_ENDS.get(definition, {}))


def period_means(times: Floats, values: Floats, frequency: float) -> tuple[Floats, Floats]:
    """Average values (n,) over each period of a vibration with a frequency [Hz] that begins at time 0.

    Values belong to times (n,) [s]; samples at or before time 0 are left out. Returns mean times (m,) [s]
    and mean values (m,) of the m periods with a sample.
    """
    # A sample at the end of a period belongs to this period.
    period = np.ceil(times * frequency - 1e-6).astype(np.int64)
    used = period > 0
    _, place = np.unique(period[used], return_inverse=True)
    samples = np.bincount(place)
    return np.bincount(place, times[used]) / samples, np.bincount(place, values[used]) / samples


def collapse_time(
    times: ArrayLike, heights: ArrayLike, *, start: float | None = None, end: float | None = None
) -> CollapseTime:
    """Fit a stretched exponential to height against time, and decide whether τ was measured.

    Least squares with 0.3 ≤ β ≤ 3 and 0 ≤ h_end ≤ h_start. τ counts as measured if the column lost at least
    `LEAST_FALL` of its height, τ is shorter than the observation, and its relative error is at most `WORST_ERROR`.
    Otherwise the observation time is a lower bound of τ. InputError for too few samples, or times or heights out of
    their range.

    Args:
        times: (n,) times since the collapse began [s], ascending and above 0; n ≥ 10.
        heights: (n,) heights in any unit, not below 0.
        start: h_start if it is known, in the unit of the heights; None: fitted.
        end: h_end if it is known, in the unit of the heights; None: fitted.

    Source:
        τ of Gravish, Franklin, Hu, Goldman, Phys. Rev. Lett. 108, 208001 (2012); the function is that of Kohlrausch.
    """
    t, h = np.asarray(times, dtype=np.float64), np.asarray(heights, dtype=np.float64)
    _check(t, h)
    scale = float(h.max()) if start is None else start
    if scale <= 0:
        msg = f"heights of a collapse are all 0, or start is not above 0: got {scale:g}; a column has a height"
        raise InputError(msg)
    observed = float(t[-1])
    # The fit is in units of the observation time and of a height near the start.
    known = None if start is None else 1.0, None if end is None else end / scale
    fit = _fit(t / observed, h / scale, *known)
    tau, beta, first, last = _named(fit.x, *known)
    curve = _curve(fit.x, t / observed, *known)
    # A fitted h_start may rest on one sample, so the fall counts from the curve at the first sample.
    top = float(curve[0]) if start is None else first
    fall = float((top - curve[-1]) / top)
    shortest, error = float(t[0] / observed), _error(fit) * tau
    outcome: Literal["collapsed", "collapsing", "standing"] = "collapsed"
    if fall < LEAST_FALL:
        outcome = "standing"
    elif tau < shortest:
        error = shortest  # nothing resolves a time before the first sample
    elif tau >= 1 or not error <= WORST_ERROR * tau:
        outcome = "collapsing"
    measured = outcome == "collapsed"
    return CollapseTime(
        outcome=outcome,
        time=tau * observed if measured else math.nan,
        error=error * observed if measured else math.nan,
        bound=math.nan if measured else observed,
        exponent=beta,
        start=first * scale,
        end=last * scale,
        fall=fall,
    )


def _check(times: Floats, heights: Floats) -> None:
    if times.ndim != 1 or times.shape != heights.shape or len(times) < _LEAST_SAMPLES:
        msg = (
            f"a collapse needs {_LEAST_SAMPLES} times and as many heights: got shapes {times.shape} and "
            f"{heights.shape}; watch longer or sample more often"
        )
    elif not (np.isfinite(times).all() and np.isfinite(heights).all()):
        msg = "times [s] and heights of a collapse must be finite; leave out samples that are not"
    elif times[0] <= 0 or (np.diff(times) <= 0).any():
        msg = f"times of a collapse must be above 0 s, where it begins, and ascend: the first is {times[0]:g} s"
    elif heights.min() < 0:
        msg = f"heights of a collapse must not be below 0: got {heights.min():g}; measure them from the floor"
    else:
        return
    raise InputError(msg)


def _named(free: Floats, start: float | None, end: float | None) -> tuple[float, float, float, float]:
    """Return τ [s], β, h_start and h_end from the free parameters of the fit.

    The free parameters are ln τ, β, h_start unless `start` is given, and h_end/h_start unless `end` is given.
    """
    rest = list(free[2:])
    start = float(rest.pop(0)) if start is None else start
    end = float(rest.pop(0)) * start if end is None else end
    return float(np.exp(free[0])), float(free[1]), start, end


def _curve(free: Floats, times: Floats, start: float | None, end: float | None) -> Floats:
    tau, beta, start, end = _named(free, start, end)
    curve: Floats = end + (start - end) * np.exp(-((times / tau) ** beta))
    return curve


def _fit(times: Floats, heights: Floats, start: float | None, end: float | None) -> Any:
    """Fit a stretched exponential from several starting points; return the best result of `least_squares`.

    There may be several minima. `start` and `end` are h_start and h_end in the unit of the heights, None if they are
    free parameters; `_named` describes the parameters.
    """
    low, high = [math.log(times[0] / 10), _EXPONENTS[0]], [math.log(_LONGEST), _EXPONENTS[1]]
    guess: list[float] = []
    if start is None:
        low, high, guess = [*low, 1e-3], [*high, 3.0], [*guess, max(float(heights[0]), 2e-3)]
    if end is None:
        low, high, guess = [*low, 0.0], [*high, 1.0], [*guess, min(float(heights[-1] / heights.max()), 0.9)]
    fits = [
        least_squares(
            lambda free: _curve(free, times, start, end) - heights,
            [math.log(tau), beta, *guess],
            bounds=(low, high),
            x_scale=0.1,
        )
        for tau in (0.03, 0.3, 3.0)
        for beta in (0.7, 1.5)
    ]
    return min(fits, key=lambda fit: float(fit.cost))


def _error(fit: Any) -> float:
    """Return the standard error of ln τ for a result of `_fit`; inf if the samples do not determine τ."""
    residuals, jacobian = fit.fun, fit.jac
    freedom = len(residuals) - len(fit.x)
    # The column of a parameter at its bound could make the matrix singular.
    free = fit.active_mask == 0
    if freedom < 1 or not free[0]:
        return math.inf
    kept = np.flatnonzero(free)
    try:
        covariance = np.linalg.inv(jacobian[:, kept].T @ jacobian[:, kept])
    except np.linalg.LinAlgError:
        return math.inf
    correlated = len(residuals) / mean_with_error(residuals).effective_count
    return math.sqrt(max(float(covariance[0, 0]), 0.0) * float(residuals @ residuals) / freedom * correlated)
