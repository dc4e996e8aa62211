"""The ball of both benches: steel, and the stiffness of the fidelities `standard` and `reference`."""

from __future__ import annotations

BALL_RADIUS, BALL_MASS = 2e-3, 2.6e-4  # m, kg
STIFFNESS = 500.0  # N/m
