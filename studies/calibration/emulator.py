"""Emulate one measure at one condition as a function of the free parameters, by a Gaussian process.

Every datum has its own emulator. The varied quantity, such as the aspect ratio, is not one of the inputs: all runs are
made exactly at the conditions of the data, so that nothing needs to be interpolated between conditions, and neither one
length scale nor one noise has to hold at all of them. (A condition may also change the count and the pour.)
"""

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial.distance import cdist
from scipy.stats import t

from dem.errors import InputError

Array = NDArray[np.float64]

LENGTHS = (0.3, 30.0)  #: Limits of length scales, over the ranges of the priors; no effect at the upper limit
NOISE = (1e-6, 10.0)  #: Limits of the variance from seed to seed, over the variance of the runs
#: Prior of ln(variance from seed to seed / variance of the runs): mean, standard deviation
NOISE_PRIOR = (math.log(0.1), 1.5)
AMPLITUDE_PRIOR = (0.0, 3.0)  #: Prior of ln(variance of the process / variance of the runs): mean, standard deviation
CHANCE = 1e-3  #: Probability with which chance alone counts as an effect of a parameter
LEAST_RUNS = 6  #: Fewest runs of an emulator


@dataclass(frozen=True, kw_only=True, eq=False)
class Emulator:
    """Gaussian process of one measure at one condition, fitted to n runs of d parameters."""

    inputs: Array  #: (n, d) parameters of the runs over the ranges of their priors
    amplitude: float  #: Variance of the process over the variance of the values [-]
    weights: Array  #: (n,) inverse of the covariance matrix times the values
    inverse: Array  #: (n, n) inverse of the covariance matrix with the noise
    mean: float  #: Mean of the values, which the process departs from
    scale: float  #: Standard deviation of the values
    noise: float  #: Standard deviation from seed to seed
    lengths: Array  #: (d,) length scales over the ranges of the priors
    loo: Array  #: (n,) leave-one-out errors: prediction of each run from all others; over their standard deviation
    explained: float  #: Fraction of the runs' variance that leave-one-out predictions explain [-]

    @property
    def noise_explains(self) -> float:
        """Largest `explained` that chance leaves likely where no parameter acts [-].

        The fraction is at most r², the squared correlation of n values with their predictions. If these are
        independent, r² is above t²/(n - 2 + t²) with a probability of 0.001, where t is that quantile of Student's
        distribution with n - 2 degrees of freedom. Since lengths and noise are fitted to all values, of 240 emulators
        of pure noise (12 to 60 runs, 2 to 4 parameters) 2 were above it.
        """
        freedom = len(self.inputs) - 2
        quantile = float(t.ppf(1 - CHANCE, freedom))
        return quantile**2 / (freedom + quantile**2)

    @property
    def resolved(self) -> bool:
        """Whether an effect of the parameters is seen beyond the scatter."""
        return self.explained > self.noise_explains

    def predict(self, inputs: Array) -> tuple[Array, Array]:
        """Return mean and variance (m,) of the measure without noise at scaled parameters (m, d)."""
        distance = cdist(inputs / self.lengths, self.inputs / self.lengths, "sqeuclidean")
        cross = self.amplitude * np.exp(-0.5 * distance)
        variance = self.amplitude - np.sum((cross @ self.inverse) * cross, axis=1)
        return self.mean + self.scale * (cross @ self.weights), self.scale**2 * np.maximum(variance, 0.0)


def fit(inputs: Array, values: Array, label: str) -> Emulator:
    """Fit an emulator to the values of one measure in n runs.

    The kernel is a squared exponential with a length scale for each parameter; white noise stands for the scatter from
    seed to seed. Amplitude, length scales and noise have their most probable values: they maximise the likelihood times
    log-normal priors. Without priors the emulator would pass exactly through few runs in several dimensions, scatter
    included.

    Parameters of the runs (n, d) are scaled from 0 to 1 over the ranges of their priors; runs with equal parameters and
    different seeds have a row each. The label names the datum in messages. InputError if there are fewer than
    `LEAST_RUNS` runs, or all n values are equal.

    Source:
        Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, chapters 2 and 5. Prior of the length
        scales: Hvarfner, Hellsten and Nardi, "Vanilla Bayesian optimization performs great in high dimensions", 2024.
    """
    from sklearn.exceptions import ConvergenceWarning  # noqa: PLC0415  (an extra)
    from sklearn.gaussian_process import GaussianProcessRegressor  # noqa: PLC0415

    if len(values) < LEAST_RUNS:
        raise InputError(f"{label}: {len(values)} finished runs; an emulator needs {LEAST_RUNS}: repair failed runs")
    mean, scale = float(np.mean(values)), float(np.std(values))
    if not scale > 1e-12 * abs(mean):
        raise InputError(f"{label}: all runs give {mean:g}, so that no parameter acts on it; leave it out of the data")
    process = GaussianProcessRegressor(
        kernel(inputs.shape[1]), alpha=1e-10, optimizer=_most_probable, n_restarts_optimizer=2, random_state=0
    )
    with warnings.catch_warnings():
        # A parameter without effect has its length scale at the upper limit, which is no failure.
        warnings.simplefilter("ignore", ConvergenceWarning)
        process.fit(inputs, (values - mean) / scale)
    fitted = process.kernel_
    covariance = fitted(inputs)
    covariance[np.diag_indices_from(covariance)] += process.alpha
    inverse = np.linalg.inv(covariance)
    weights = inverse @ ((values - mean) / scale)
    left_out = weights / np.diag(inverse)  # value minus its prediction from all others, ibid. equations 5.10 - 5.12
    return Emulator(
        inputs=inputs,
        amplitude=float(fitted.k1.k1.constant_value),
        weights=weights,
        inverse=inverse,
        mean=mean,
        scale=scale,
        noise=scale * float(np.sqrt(fitted.k2.noise_level)),
        lengths=np.atleast_1d(fitted.k1.k2.length_scale),
        loo=left_out * np.sqrt(np.diag(inverse)),
        explained=1.0 - float(np.mean(left_out**2)),
    )


def kernel(dimension: int) -> Any:
    """Return the kernel of an emulator of `dimension` parameters: squared exponential plus white noise."""
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel  # noqa: PLC0415  (an extra)

    signal = ConstantKernel(1.0, (1e-3, 1e3)) * RBF(np.ones(dimension), LENGTHS)
    return signal + WhiteKernel(0.1, NOISE)


def _most_probable(
    objective: Callable[[Array], tuple[float, Array]], start: Array, bounds: Array
) -> tuple[Array, float]:
    """Return the most probable logarithms of amplitude, length scales and noise, and the minimum there.

    `objective` returns minus the log-likelihood and its gradient; see `optimizer` of scikit-learn.
    """
    dimension = len(start) - 2
    length = (math.sqrt(2) + 0.5 * math.log(dimension), math.sqrt(3))
    centre, width = np.array([AMPLITUDE_PRIOR, *[length] * dimension, NOISE_PRIOR]).T

    def penalised(logarithms: Array) -> tuple[float, Array]:
        value, gradient = objective(logarithms)
        distance = (logarithms - centre) / width
        return value + 0.5 * float(distance @ distance), gradient + distance / width

    found = minimize(penalised, start, jac=True, bounds=bounds, method="L-BFGS-B")
    return found.x, float(found.fun)
