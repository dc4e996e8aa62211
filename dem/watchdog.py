"""Stops a run whose result would be nonsense, and says why."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dem.container import Cylinder
from dem.errors import refuse
from dem.state import State

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Watchdog:
    """Limits that no smarticle may pass.

    Args:
        cylinder: the container; a centre of mass beyond its wall has escaped, one above it has been thrown out.
        speed: [m/s]; faster than anything that falls or is shaken in the scene.
        gap: [m]; a hinge whose links are farther apart is broken.
    """

    cylinder: Cylinder
    speed: float
    gap: float = math.inf

    def check(
        self, state: State, *, floor: float, time: float, raised: float | None = 0.0, gaps: Array | None = None
    ) -> None:
        """Look at all smarticles once.

        Args:
            state: the smarticles.
            floor: height of the floor [m].
            time: simulated time [s].
            raised: how far a hook may have raised smarticles [m]; None: nothing holds them, so that none escapes.
            gaps: (N, 2) how far the links of each hinge are apart [m]; None while welded.

        Raises:
            RunError: cause, smarticles concerned, time and the way out.
        """
        positions = state.positions
        speeds = np.linalg.norm(state.velocities, axis=1)
        heights = positions[:, 2] - floor
        broken = ~(np.isfinite(positions).all(axis=1) & np.isfinite(speeds))
        refuse(
            broken,
            time,
            "a position or velocity that is no number",
            "lower fidelity.time_step_fraction",
        )
        refuse(
            speeds > self.speed,
            time,
            f"a speed above {self.speed:.3g} m/s (fastest {speeds.max(initial=0):.3g} m/s), "
            "which nothing in this scene explains",
            "lower fidelity.time_step_fraction",
        )
        if gaps is not None:
            # A gap that is no number is not below the limit either.
            refuse(
                (~np.less_equal(gaps, self.gap)).any(axis=1),
                time,
                f"links more than {self.gap:.3g} m apart at a hinge (most {gaps.max(initial=0):.3g} m)",
                "lower fidelity.time_step_fraction, or raise fidelity.hinge_stiffness_N_per_m",
            )
        radii, height = np.full(state.count, math.inf), math.inf
        if raised is not None:
            radii, height = self.cylinder.radii(heights - raised), self.cylinder.height + raised
        outside = (np.hypot(positions[:, 0], positions[:, 1]) > radii) | (heights < 0)
        refuse(outside, time, "left through the wall or the floor", "raise fidelity.stiffness_N_per_m")
        refuse(
            heights > height,
            time,
            f"thrown out over the wall of {self.cylinder.height:.3g} m",
            "raise container.height_m or shake less",
        )
