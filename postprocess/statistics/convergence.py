"""Order of convergence of a result without scatter, such as that of a deterministic case of two bodies, in its step.

For results that scatter between seeds, `studies.accuracy` says what is resolved.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from dem.errors import InputError

Array = NDArray[np.float64]

ORDERS = (0.05, 10.0)
"""Orders among which a fit looks."""

# Relative to the largest value: differences below are rounding, and have no order.
_ROUNDING = 1e-13


@dataclass(frozen=True, kw_only=True, eq=False)
class Convergence:
    """A fit v(h) = limit + coefficient · h^order.

    Attributes:
        order: Observed order p [-]; NaN where values do not depend on the step beyond rounding, and where the best fit
            lies at an end of `ORDERS`, as it does for values that follow no power of the step.
        standard_error: Of the order [-]; NaN without a degree of freedom to spare.
        limit: Value at h = 0, given or fitted; NaN without an order to fit it by [unit of the values].
        coefficient: [unit of the values over that of the step to the power p].
        residual: Largest deviation of a value from the fit [unit of the values].
        local_orders: (n − 1,) or (n − 2,): orders between successive steps, from coarse to fine, of errors where the
            limit is given and of differences where it is not; they tell whether the order is one of all steps [-].
        monotone: Whether the values come nearer to the limit with every finer step.
    """

    order: float
    standard_error: float
    limit: float
    coefficient: float
    residual: float
    local_orders: tuple[float, ...] = field(default=())
    monotone: bool

    def value(self, step: float) -> float:
        """The fit at a step, in the unit of the values."""
        return float(self.limit + self.coefficient * step**self.order)


def observed_order(steps: Sequence[float], values: Sequence[float], *, exact: float | None = None) -> Convergence:
    """Observed order of convergence.

    With the exact value known, a straight line through log |v − exact| against log h; otherwise least squares of
    v = limit + C h^p with weights 1/h, so that finer steps, which are nearer to the asymptotic range, count more.

    Args:
        steps: h, all different, in any order: two or more where the exact value is known, three or more otherwise [s].
        values: One per step, of any unit.
        exact: The value at h = 0, if it is known.

    Returns:
        The fit with its order.

    Raises:
        InputError: Too few steps, steps that are not positive or not different, values that are not finite.

    Source:
        Eça and Hoekstra, J. Comput. Phys. 262 (2014) 104: least squares over grid refinements.

    Example:
        >>> round(observed_order([0.1, 0.2, 0.4], [1.01, 1.04, 1.16]).order, 3)
        2.0
    """
    h, v = _checked(steps, values, least=3 if exact is None else 2)
    scale = max(float(np.abs(v).max()), abs(exact or 0.0))
    spread = float(np.ptp(v)) if exact is None else float(np.abs(v - exact).max())
    if spread <= _ROUNDING * scale:
        limit = float(v[0]) if exact is None else exact
        nan = math.nan
        return Convergence(order=nan, standard_error=nan, limit=limit, coefficient=0.0, residual=spread, monotone=False)
    fit = _without_limit(h, v) if exact is None else _with_limit(h, v, exact, _ROUNDING * scale)
    order, error, limit, coefficient = fit
    falling = np.diff(np.abs(v - limit)) > 0  # h grows
    fitted = limit + coefficient * h**order if math.isfinite(order) else np.full_like(h, math.nan)
    return Convergence(
        order=order,
        standard_error=error,
        limit=limit,
        coefficient=coefficient,
        residual=float(np.abs(v - fitted).max()),
        local_orders=_local(h, v, exact),
        monotone=bool(falling.all()) and len(set(np.sign(v - limit))) == 1,
    )


def _checked(steps: Sequence[float], values: Sequence[float], *, least: int) -> tuple[Array, Array]:
    """Both as arrays, the finest step first."""
    h, v = np.asarray(steps, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if h.ndim != 1 or h.shape != v.shape:
        msg = (
            f"steps and values must be lists of one length: got shapes {h.shape} and {v.shape}; give one value per step"
        )
        raise InputError(msg)
    if len(h) < least:
        msg = f"an order needs {least} steps or more: got {len(h)}; add a finer one"
        raise InputError(msg)
    for name, numbers in (("step", h), ("value", v)):
        bad = numbers[~np.isfinite(numbers) | ((numbers <= 0) & (name == "step"))]
        if len(bad):
            wanted = "finite and > 0" if name == "step" else "finite"
            msg = f"every {name} must be {wanted}: got {bad[0]:g}; leave it out"
            raise InputError(msg)
    rank = np.argsort(h)
    h, v = h[rank], v[rank]
    twice = h[1:][np.diff(h) == 0]
    if len(twice):
        msg = f"step {twice[0]:g} is given twice; give each once"
        raise InputError(msg)
    return h, v


def _with_limit(h: Array, v: Array, exact: float, rounding: float) -> tuple[float, float, float, float]:
    """Order, its standard error, limit, coefficient from a straight line through logarithms."""
    error = v - exact
    known = np.abs(error) > rounding
    x, y = np.log(h[known]), np.log(np.abs(error[known]))
    if len(x) < 2:
        return math.nan, math.nan, exact, 0.0
    about = x - x.mean()
    order = float(about @ y / (about @ about))
    rest = y - y.mean() - order * about
    freedom = len(x) - 2
    standard = math.sqrt(float(rest @ rest) / freedom / float(about @ about)) if freedom > 0 else math.nan
    coefficient = math.copysign(math.exp(float(y.mean() - order * x.mean())), float(error[known][-1]))
    return order, standard, exact, coefficient


def _without_limit(h: Array, v: Array) -> tuple[float, float, float, float]:
    """Order, its standard error, limit, coefficient by least squares; the order is searched, the rest is linear."""
    unit = float(h[-1])
    x, weight = h / unit, unit / h

    def solve(order: float) -> tuple[float, tuple[float, float]]:
        columns = np.stack([np.ones_like(x), x**order], axis=1) * weight[:, None]
        found, *_ = np.linalg.lstsq(columns, v * weight, rcond=None)
        rest = v * weight - columns @ found
        return float(rest @ rest), (float(found[0]), float(found[1]))

    # The sum of squares may have several minima: the best of a coarse scan, then refined.
    grid = np.geomspace(*ORDERS, 200)
    best = int(np.argmin([solve(order)[0] for order in grid]))
    if best in (0, len(grid) - 1):
        return math.nan, math.nan, math.nan, math.nan
    refined = minimize_scalar(
        lambda order: solve(order)[0],
        bounds=(float(grid[best - 1]), float(grid[best + 1])),
        method="bounded",
        options={"xatol": 1e-10},
    )
    order = float(refined.x)
    squares, (limit, coefficient) = solve(order)
    freedom = len(h) - 3
    error = math.nan
    if freedom > 0:
        slopes = np.stack([np.ones_like(x), x**order, coefficient * x**order * np.log(x)], axis=1) * weight[:, None]
        covariance = np.linalg.pinv(slopes.T @ slopes) * squares / freedom
        error = math.sqrt(max(float(covariance[2, 2]), 0.0))
    return order, error, limit, coefficient / unit**order


def _local(h: Array, v: Array, exact: float | None) -> tuple[float, ...]:
    """Orders between successive steps, from coarse to fine; NaN where there is none."""
    h, v = h[::-1], v[::-1]
    if exact is None:
        # Of differences, between the geometric means of the steps that they lie between: exact for a constant ratio.
        change, at = np.diff(v), np.sqrt(h[1:] * h[:-1])
    else:
        change, at = v - exact, h
    orders = []
    for k in range(len(change) - 1):
        ratio = change[k] / change[k + 1] if change[k + 1] else math.nan
        orders.append(math.log(ratio) / math.log(at[k] / at[k + 1]) if ratio > 0 else math.nan)
    return tuple(orders)
