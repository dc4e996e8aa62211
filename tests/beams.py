"""Beam theory that filaments on several engines are compared with."""

import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq


def elastica(load: float) -> tuple[float, float]:
    """Place of the free end of a horizontal cantilever whose weight per length is `load` B/L³: along and up, in L.

    B θ'' = w (L - s) cos θ, θ(0) = 0, θ'(L) = 0; for small loads the end is w L⁴/8B below.
    """

    def shoot(bend: float) -> np.ndarray:
        found = solve_ivp(
            lambda s, y: [y[1], load * (1 - s) * math.cos(y[0]), math.cos(y[0]), math.sin(y[0])],
            (0, 1), [0, bend, 0, 0], rtol=1e-10, atol=1e-12,
        )  # fmt: skip
        return np.asarray(found.y[:, -1])

    _, _, x, z = shoot(-brentq(lambda bend: shoot(-bend)[1], 0.0, load))
    return float(x), float(z)
