"""When a pile counts as settled: shared by the phases that a run begins with."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from dem.engine.interface import Engine
from dem.errors import RunError
from dem.phases.phase import CHECK_INTERVAL, Memory
from dem.setting.part import Duration, Part, Speed

SETTLE_SECONDS = 0.35  # of a pile that was poured, about


class Settle(Part):
    """When a pile counts as settled: all hold at every look over a stretch of time."""

    speed_m_per_s: Speed = Field(0.02, description="largest speed of any smarticle [m/s]")
    unbalanced_force: float = Field(
        0.05, ge=1e-9, le=1e6, description="mean net force on a smarticle over its weight [1]"
    )
    hold_s: float = Field(0.05, ge=0, le=1e6, description="how long both must hold [s]")
    timeout_s: Duration = Field(5.0, description="longest wait [s]; then the run fails with the residuals")


def has_settled(settle: Settle, memory: Memory, engine: Engine) -> bool:
    """Look at a pile once, every `CHECK_INTERVAL`.

    Args:
        settle: when it counts as settled.
        memory: of the stage: `waited` [s] for the pile so far, which the stage adds up; `still` [s] that it has been.
        engine: that it is on.

    Raises:
        RunError: it takes too long.
    """
    speed = float(np.linalg.norm(engine.state().velocities, axis=1).max())
    unbalanced = engine.unbalanced_force()
    still = speed < settle.speed_m_per_s and unbalanced < settle.unbalanced_force
    memory["still"] = memory["still"] + CHECK_INTERVAL if still else 0.0
    if memory["still"] > settle.hold_s:
        return True
    if memory["waited"] > settle.timeout_s:
        msg = (
            f"the pile has not settled after {settle.timeout_s:g} s: speed {speed:.3g} m/s (limit "
            f"{settle.speed_m_per_s:g} m/s), unbalanced force {unbalanced:.3g} (limit "
            f"{settle.unbalanced_force:g}); raise phases.0.settle.timeout_s or its limits"
        )
        raise RunError(msg)
    return False
