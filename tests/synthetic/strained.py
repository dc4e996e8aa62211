"""Synthetic strain tests of a chain in a plane: the pulled string's force is a given function of the strain."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from synthetic import SyntheticRun, write_manifest, write_run, write_series

LENGTH, SPEED, INTERVAL = 0.083, 0.02, 0.001  # m, m/s, s
WIDTH = 0.062


def write_strained_run(
    directory: Path,
    force: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    *,
    channel: float = 0.08,
    **changes: Any,
) -> Path:
    """A whole run of one phase that strains a chain; `force` is on the pulled string [N], of strains [1].

    `channel` is the distance of the walls [m], `changes` are those of the `SyntheticRun`.
    """
    run = SyntheticRun(phases=("strain",), **{"count": 2, **changes})
    write_run(directory, run)
    write_manifest(directory, run, planar=True, channel_width_m=channel)
    path = directory / "scene.yaml"
    scene = yaml.safe_load(path.read_text())
    scene["phases"][0]["speed_m_per_s"] = SPEED
    path.write_text(yaml.safe_dump(scene))
    times = np.arange(1, round(run.durations["strain"] / INTERVAL) + 1) * INTERVAL
    strains = SPEED * (times - times[0]) / LENGTH
    pulled = np.zeros((len(times), 3))
    pulled[:, 0] = force(strains)
    columns = {
        "time_s": times,
        "phase": np.zeros(len(times), dtype=np.int64),
        "string_pulled_force_N": pulled,
        "string_fixed_force_N": -pulled,
        "channel_lower_force_N": np.zeros_like(pulled),
        "channel_upper_force_N": np.zeros_like(pulled),
        "pulled_m": SPEED * times,
        "chain_length_m": LENGTH * (1 + strains),
        "chain_width_m": WIDTH * (1 + 0.1 * strains),
    }
    write_series(directory, columns, seed=run.seed)
    return directory
