"""Stops a run whose result would be nonsense, and says why."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dem.errors import RunError
from dem.state import State


@dataclass(frozen=True, kw_only=True)
class Watchdog:
    """Limits that no smarticle may pass.

    Args:
        radius: of the container [m]; a centre of mass beyond it has escaped.
        height: of the container's wall [m]; a centre of mass above it has been thrown out.
        speed: [m/s]; faster than anything that falls or is shaken in the scene.
    """

    radius: float
    height: float
    speed: float

    def check(self, state: State, *, floor: float, time: float) -> None:
        """Look at all smarticles once.

        Raises:
            RunError: cause, smarticles concerned, time and the way out.
        """
        positions = state.positions
        speeds = np.linalg.norm(state.velocities, axis=1)
        heights = positions[:, 2] - floor
        broken = ~(np.isfinite(positions).all(axis=1) & np.isfinite(speeds))
        self._refuse(
            broken,
            time,
            "a position or velocity that is no number",
            "lower fidelity.time_step_fraction",
        )
        self._refuse(
            speeds > self.speed,
            time,
            f"a speed above {self.speed:.3g} m/s (fastest {speeds.max(initial=0):.3g} m/s), "
            "which nothing in this scene explains",
            "lower fidelity.time_step_fraction",
        )
        outside = (np.hypot(positions[:, 0], positions[:, 1]) > self.radius) | (heights < 0)
        self._refuse(outside, time, "left through the wall or the floor", "raise fidelity.stiffness_N_per_m")
        self._refuse(
            heights > self.height,
            time,
            f"thrown out over the wall of {self.height:.3g} m",
            "raise container.height_m or shake less",
        )

    @staticmethod
    def _refuse(concerned: np.ndarray, time: float, cause: str, way_out: str) -> None:
        if concerned.any():
            ids = np.flatnonzero(concerned)
            shown = ", ".join(str(k) for k in ids[:5]) + (", …" if len(ids) > 5 else "")
            msg = f"at t = {time:.4f} s: {len(ids)} smarticle(s) ({shown}): {cause}; {way_out}"
            raise RunError(msg)
