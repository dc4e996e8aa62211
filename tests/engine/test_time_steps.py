"""A run whose phases have different time steps: bits before motors act, and samples after the step has changed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import cases
import numpy as np
import pytest
from run_files import series

from dem.plan.steps import time_steps
from dem.scene.reading import parse_scene

SceneData = Callable[..., dict[str, Any]]
Simulate = Callable[..., dict[str, Any]]
REST = [{"type": "deposit", "per_layer": 4}, {"type": "relax", "duration_s": 0.05}]
SWING = {"type": "internal-oscillation", "theta_deg": 10, "duration_s": 0.06}
# Phases end at multiples of 0.01 s: not at samples, and neither step is a whole fraction of the time left to the next.
RECORDING = {"series_interval_s": 0.0034, "frame_interval_s": 0.017, "checkpoint_interval_s": 0.034}


@pytest.fixture
def runs(simulate: Simulate, scene_data: SceneData, tmp_path: Path) -> dict[str, tuple[Path, dict[str, Any]]]:
    """The same pile, left alone and then actuated, or only left alone: run directories and scenes."""
    found = {}
    for name, phases in (("swung", [*REST, SWING, REST[1]]), ("left alone", REST)):
        data = scene_data({"count": 8, "phases": phases}) | {"recording": RECORDING}
        answer = simulate(cases.run, data, str(tmp_path / name))
        assert answer["error"] is None, answer["text"]
        found[name] = tmp_path / name, data
    return found


def test_samples_stay_on_their_grid_when_the_step_changes(runs: dict[str, tuple[Path, dict[str, Any]]]) -> None:
    directory, data = runs["swung"]
    steps = time_steps(parse_scene(data, source="test"))
    assert steps[0] == steps[1] > 1.5 * steps[2] == 1.5 * steps[3]
    found = series(directory)
    times, phases = found["time_s"], found["phase"]
    wanted = RECORDING["series_interval_s"] * np.arange(len(times))
    off = np.abs(times - wanted)
    for phase, step in enumerate(steps):
        # Rounded to the step nearest; the times of steps before the change are no multiples of the step after it.
        assert off[phases == phase].max() <= step / 2 + 1e-12
    assert off[phases == 2].max() > 1e-9
    assert times[-1] > 0.1
