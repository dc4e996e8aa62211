"""A run, and beside it what the engine itself said whenever something was recorded; see `cases.py`."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from unittest.mock import patch

import cases
import numpy as np

from dem.engine.interface import Engine
from dem.run.recorder import Recorder


def noted(data: dict[str, Any], out: str) -> list[dict[str, Any]]:
    """Run a scene; the engine's own numbers at every sample, straight from it."""
    notes: list[dict[str, Any]] = []
    record = Recorder.record

    def look(recorder: Recorder, engine: Engine, phase: int) -> None:
        record(recorder, engine, phase)
        notes.append(_numbers(engine, phase))

    with patch.object(Recorder, "record", look):
        answer = cases.run(data, str(Path(out)))
    assert answer["error"] is None, answer
    return notes


def _numbers(engine: Engine, phase: int) -> dict[str, Any]:
    state, motors = engine.state(), engine.motors.readings if engine.motors.articulated else None
    return {
        "time": engine.time,
        "phase": phase,
        "count": engine.count,
        "floor": engine.boundaries.floor,
        "vertices": np.array(state.vertices),
        "velocities": np.array(state.link_velocities),
        "spins": np.array(state.link_spins),
        "angles": np.array(state.angles),
        "heights": np.array(state.positions[:, 2]) - engine.boundaries.floor,
        "kinetic_energy": state.kinetic_energy,
        "contacts": engine.neighbours(),
        "torques": None if motors is None else np.array(motors.torques),
        "volume": engine.particle.boxes.volume,
        "mass": engine.particle.boxes.mass,
        "radius": engine.cylinder.radius,
    }
