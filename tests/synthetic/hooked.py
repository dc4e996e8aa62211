"""Synthetic runs with hooks: what the upper one feels is a given function of how far it has been raised."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray

from synthetic import SyntheticRun, W, write_run, write_series

GRAVITY = 9.81
SPEED = W  # of the hook: w per second
LOWER, UPPER = 0.005, 0.010
INTERVAL = 0.004
HELD = 0.25  # share of the force that goes on to the lower hook
AFTER_REST = ("deposit", "relax", "pull-hook")


def weight(run: SyntheticRun) -> float:
    """Of one smarticle [N]."""
    return 7850 * run.solid_volume * GRAVITY


def write_hooked_run(
    directory: Path,
    run: SyntheticRun,
    force: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    *,
    limit: float | None = None,
    stops: float = np.inf,
    spent: float | None = None,
) -> Path:
    """A whole run whose last phase pulls the hook.

    Args:
        directory: the run directory.
        run: phases and pile.
        force: needed to raise the hook [N], of times since the pull began [s].
        limit: force that stops the hook [N].
        stops: when it does so, since the pull began [s].
        spent: by motors, or by the shaken container, steadily in the third phase [J].
    """
    write_run(directory, run)
    path = directory / "scene.yaml"
    scene = yaml.safe_load(path.read_text())
    scene["gravity_m_per_s2"] = GRAVITY
    scene["hooks"] = {"side_m": 5e-4, "length_m": W, "lower_height_m": LOWER, "upper_height_m": UPPER}
    scene["phases"][-1] |= {"distance_m": SPEED * run.durations["pull-hook"], "force_limit_N": limit}
    path.write_text(yaml.safe_dump(scene))
    ends = np.cumsum([run.durations[kind] for kind in run.phases])
    times = np.arange(1, round(ends[-1] / INTERVAL) + 1) * INTERVAL
    phase = np.searchsorted(ends, times - INTERVAL / 2)
    since = np.clip(times - ends[-2], 0, None)
    upper = np.zeros((len(times), 3))
    # A sample is the mean since the one before: taken in the middle between them.
    upper[:, 2] = -np.where(since > 0, force(since - INTERVAL / 2), weight(run))
    lower = -HELD * np.where(since[:, None] > 0, upper, 0.0)
    raised = SPEED * np.minimum(since, stops)
    work = np.cumsum(-upper[:, 2] * np.diff(raised, prepend=0.0))
    # A vibration may move the container, and hooks with it.
    floor = run.floor_z + np.where(since > 0, 3e-4 * np.sin(2 * np.pi * 13 * since), 0.0)
    columns = {
        "time_s": times,
        "phase": phase,
        "hook_upper_force_N": upper,
        "hook_lower_force_N": lower,
        "hook_upper_z_m": UPPER + floor + raised,
        "container_z_m": floor,
        "container_work_J": work,
    }
    if spent is not None:
        by = "container_work_J" if run.phases[2] == "shake" else "motor_work_J"
        done = spent * np.clip((times - ends[1]) / (ends[2] - ends[1]), 0, 1)
        columns[by] = done + columns.get(by, 0.0)
    write_series(directory, columns, seed=run.seed)
    return directory
