"""Measure how a free-standing column collapses on a vibrating floor: height against time, and τ.

A column on a floor without end loses height in two ways: it sinks, and smarticles leave it. On a floor that shakes with
several g, those that have left hop millimetres high, as high as a low column, so heights of all smarticles, or of the
uppermost ones, do not go to the height of a layer. `remaining` is free of this: it counts.
"""

from __future__ import annotations

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
from postprocess.geometry.links import Floats, centres_of_mass
from postprocess.statistics.seeds import mean_with_error

REMAINING, COM, CORE = "remaining", "com", "core"

HEIGHTS: Mapping[str, str] = MappingProxyType(
    {
        REMAINING: "smarticles still within the container's radius, over those before vibration: the height that the "
        "column has left above its base at the density it had",
        COM: "height of the centre of mass of all smarticles, over that before vibration",
        CORE: "height of the centre of mass of those within the container's radius, over that before vibration; from "
        "frames",
    }
)
"""Definitions of a column's height by name, each over that before vibration."""

_KNOWN_ENDS: Mapping[str, Mapping[str, float]] = MappingProxyType({REMAINING: {"start": 1.0, "end": 0.0}})
"""Start and end of the fitted curve [-] where they are known: in the end all have left. The other heights bounce up at
the start and hop in the end, so theirs are fitted."""

REST = 0.1  #: How long before vibration the height is averaged that others are taken over [s]
LEAST_FALL = 0.25  #: A column that has lost less of its height than this share still stands [-]
WORST_ERROR = 0.5  #: Relative error beyond which a time is not taken for known [-]

_LEAST_SAMPLES = 10
_EXPONENTS = (0.3, 3.0)
_LONGEST = 1e4  # τ over the time watched: beyond it a curve is flat, whatever τ


@dataclass(frozen=True, kw_only=True)
class Vibration:
    """The phase that shakes a free-standing column: peak acceleration over g [-], frequency [Hz]."""

    phase: Phase
    acceleration: float
    frequency: float


@dataclass(frozen=True, kw_only=True, eq=False)
class ColumnHistory:
    """Heights of one column against time."""

    times: Floats  #: (n,) since the vibration began [s], some of them before
    heights: Floats  #: (n,) over the mean height in the last `REST` before [-]
    before: float  #: That height: [m], or a share of the smarticles by `REMAINING` [-]


@dataclass(frozen=True, kw_only=True)
class CollapseTime:
    """The collapse of one column.

    h(t) = h_end + (h_start − h_end) exp(−(t/τ)^β).
    """

    #: "collapsed": τ was seen; "collapsing": it has lost height, but τ is beyond the end, or not known from what was
    #: seen; "standing": it has lost less than `LEAST_FALL`
    outcome: Literal["collapsed", "collapsing", "standing"]
    time: float  #: τ [s]; NaN unless collapsed
    #: Standard error of the fit [s], with the correlation of successive residuals, or the first sample's time where τ
    #: is shorter than that; NaN unless collapsed
    error: float
    bound: float  #: Lower bound of τ [s]: the time watched; NaN if collapsed
    exponent: float  #: β of the fit [-]
    start: float  #: h_start of the fit, in the heights' unit
    end: float  #: h_end of the fit, in the heights' unit
    fall: float  #: Share of the height that the fit loses while it is watched [-]


def vibration(run: Run) -> Vibration:
    """Find the first phase of a run that shakes the floor after the wall was taken away.

    Raises:
        InputError: There is none, or the scene does not say how it shakes.
    """
    kinds = [phase.type for phase in run.phases]
    after = kinds.index("remove-container") if "remove-container" in kinds else len(kinds)
    found = next((phase for phase in run.phases[after:] if phase.type == "shake"), None)
    if found is None:
        raise InputError(f"{run.path}: no shake after a remove-container: its phases are {', '.join(kinds)}")
    settings = run.scene["phases"][found.index]
    return Vibration(
        phase=found,
        acceleration=settings["peak_acceleration_g"],
        frequency=settings["frequency_hz"],
    )


def column_history(run: Run, definition: str, shaken: Vibration) -> ColumnHistory:
    """Read a column's heights, by one of `HEIGHTS`, from the phase before its vibration to the end of that.

    Raises:
        InputError: The run lacks its series or frames, or samples before the vibration.
    """
    times, heights = _core(run, shaken) if definition == CORE else _of_series(run, definition, shaken)
    assert shaken.phase.start_s is not None  # of a finished run
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
    """Read the height of the centre of mass when the wall was last there [m].

    Raises:
        InputError: The run lacks its series, or samples before its wall went.
    """
    series = run.series
    gone = [phase.type for phase in run.phases].index("remove-container")
    heights = series["com_height_m"][series["phase"] < gone]
    if not len(heights):
        raise InputError(f"{run.path}: no height of the column before its wall went; record more often")
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
    for frame in (frame for phase in (last - 1, last) for frame in frames.in_phase(phase)):
        centres = centres_of_mass(frame.vertices)
        within = np.hypot(centres[:, 0], centres[:, 1]) <= run.manifest.container_radius_m
        times.append(frame.time)
        heights.append(max(0.0, float(centres[within, 2].mean() - frame.floor_z)) if within.any() else 0.0)
    return np.array(times), np.array(heights)


def collapse_of(history: ColumnHistory, definition: str, shaken: Vibration) -> CollapseTime:
    """Fit the collapse time of a column to means over periods: bouncing within one does not count.

    Raises:
        InputError: It was sampled too rarely, or watched for too short a time.
    """
    times, heights = period_means(history.times, history.heights, shaken.frequency)
    return collapse_time(times, heights, **_KNOWN_ENDS.get(definition, {}))


def period_means(times: Floats, values: Floats, frequency: float) -> tuple[Floats, Floats]:
    """Average over whole periods from time 0 on: times (m,) [s] and values (m,) of those with a sample."""
    # A sample at the end of a period belongs to it.
    period = np.ceil(times * frequency - 1e-6).astype(np.int64)
    used = period > 0
    _, place = np.unique(period[used], return_inverse=True)
    samples = np.bincount(place)
    return np.bincount(place, times[used]) / samples, np.bincount(place, values[used]) / samples


def collapse_time(
    times: ArrayLike, heights: ArrayLike, *, start: float | None = None, end: float | None = None
) -> CollapseTime:
    """Fit a stretched exponential to a height against time, and say whether its time was seen.

    Least squares with 0.3 ≤ β ≤ 3 and 0 ≤ h_end ≤ h_start. A τ counts as seen where it is shorter than the time
    watched, so that 63 % of the fall are before the end, and its error is below `WORST_ERROR`; the column must have
    fallen by `LEAST_FALL` at all. Otherwise the time watched is a bound that τ is not below.

    Args:
        times: (n,) since the collapse was set going [s], ascending and above 0; n ≥ 10.
        heights: (n,) in any unit, above or equal to 0.
        start: h_start where it is known, in that unit; None: fitted.
        end: h_end likewise.

    Raises:
        InputError: Too few samples, or times or heights that cannot be.

    Source:
        τ of Gravish, Franklin, Hu, Goldman, Phys. Rev. Lett. 108, 208001 (2012); the function is that of Kohlrausch.

    Example:
        >>> t = np.linspace(0.05, 5, 100)
        >>> round(collapse_time(t, 0.02 * np.exp(-(t / 0.8) ** 0.7), end=0.0).time, 3)
        0.8
    """
    t, h = np.asarray(times, dtype=np.float64), np.asarray(heights, dtype=np.float64)
    _check(t, h)
    scale = float(h.max()) if start is None else start
    if scale <= 0:
        msg = f"heights of a collapse are all 0, or start is not above 0: got {scale:g}; a column has a height"
        raise InputError(msg)
    watched = float(t[-1])
    # Times are over the time watched, heights over a height of the start.
    known = None if start is None else 1.0, None if end is None else end / scale
    fit = _fit(t / watched, h / scale, *known)
    tau, beta, first, last = _named(fit.x, *known)
    curve = _curve(fit.x, t / watched, *known)
    # A start that is fitted may lie on a single sample: no more has fallen than was seen to.
    top = float(curve[0]) if start is None else first
    fall = float((top - curve[-1]) / top)
    shortest, error = float(t[0] / watched), _error(fit) * tau
    outcome: Literal["collapsed", "collapsing", "standing"] = "collapsed"
    if fall < LEAST_FALL:
        outcome = "standing"
    elif tau < shortest:
        error = shortest  # over before the first sample: known as well as that
    elif tau >= 1 or not error <= WORST_ERROR * tau:
        outcome = "collapsing"
    seen = outcome == "collapsed"
    return CollapseTime(
        outcome=outcome,
        time=tau * watched if seen else math.nan,
        error=error * watched if seen else math.nan,
        bound=math.nan if seen else watched,
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
        msg = "times [s] and heights of a collapse must be finite; leave out what is not"
    elif times[0] <= 0 or (np.diff(times) <= 0).any():
        msg = f"times of a collapse must ascend from above 0 s, when it was set going: the first is {times[0]:g} s"
    elif heights.min() < 0:
        msg = f"heights of a collapse must not be below 0: got {heights.min():g}; measure them from the floor"
    else:
        return
    raise InputError(msg)


def _named(free: Floats, start: float | None, end: float | None) -> tuple[float, float, float, float]:
    """Return τ, β, start and end of free parameters: ln τ, β, and start and end over start unless given."""
    rest = list(free[2:])
    start = float(rest.pop(0)) if start is None else start
    end = float(rest.pop(0)) * start if end is None else end
    return float(np.exp(free[0])), float(free[1]), start, end


def _curve(free: Floats, times: Floats, start: float | None, end: float | None) -> Floats:
    tau, beta, start, end = _named(free, start, end)
    curve: Floats = end + (start - end) * np.exp(-((times / tau) ** beta))
    return curve


def _fit(times: Floats, heights: Floats, start: float | None, end: float | None) -> Any:
    """Return the best of several fits: the sum of squares may have more than one valley."""
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
    """Return the standard error of ln τ; infinite where the samples do not determine it."""
    residuals, jacobian = fit.fun, fit.jac
    spare = len(residuals) - len(fit.x)
    # What is at a bound is not free; its column would make the matrix singular.
    free = fit.active_mask == 0
    if spare < 1 or not free[0]:
        return math.inf
    kept = np.flatnonzero(free)
    try:
        covariance = np.linalg.inv(jacobian[:, kept].T @ jacobian[:, kept])
    except np.linalg.LinAlgError:
        return math.inf
    correlated = len(residuals) / mean_with_error(residuals).effective_count
    return math.sqrt(max(float(covariance[0, 0]), 0.0) * float(residuals @ residuals) / spare * correlated)
