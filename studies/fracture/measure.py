"""What the study `fracture` takes from a run: the pile before the pull, and what the hook felt in it.

Forces are over n W_s, the weight of all smarticles, as in the paper; what a peak is, is in `postprocess.measures.pull`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from dem.errors import InputError
from dem.record.frames import read_frames
from dem.record.manifest import RunManifest
from dem.record.series import Series, read_series
from postprocess.geometry.links import centres_of_mass
from postprocess.measures.pull import (
    END,
    FREE,
    PULL,
    WINDOW,
    HookPull,
    freed,
    held_at,
    held_fast,
    peak,
    read_pull,
    weight_of_one,
)
from postprocess.measures.table import summarise_run
from postprocess.scene_file import PhaseSettings, read_phases
from postprocess.statistics.columns import ASPECT, SEED
from studies.framework.procedures import ACTIVE, CROSSINGS, INTERNAL, PHI, PROCEDURE, STATIC, THETA, prepared_by
from studies.framework.runs import DEFINITION, duration

PEAK, PEAK_TIME, PEAK_RAISED = "peak force over n W_s [-]", "time of the peak [s]", "hook raised at the peak [m]"
WINDOWS: Mapping[float, str] = MappingProxyType(
    {
        window: f"peak force over n W_s, window {window:g} s [-]"
        for window in (WINDOW / 4, WINDOW / 2, 2 * WINDOW, 4 * WINDOW)
    }
)
"""The peak over other windows than `WINDOW`: window [s] and column."""
HELD, NET = "lower hook force at the peak over n W_s [-]", "peak force less lower hook's over n W_s [-]"
WORK, LEFT, BEFORE = "work over n W_s w [-]", "load at the end over n W_s [-]", "load before the pull over n W_s [-]"
HELD_FAST, LIMIT = "held fast [-]", "force limit over n W_s [-]"
CAME_FREE, FREE_TIME = "came free [-]", "time of coming free [s]"
ABOVE, ACCOUNT = "smarticles above the hook [-]", "work less that of the engine's account [-]"
QUANTITIES: Mapping[str, str] = MappingProxyType(
    {
        PEAK: f"largest mean over {WINDOW:g} s of the force that raises the hook, over n W_s; at least, where it held",
        HELD_FAST: "1 where the hook was stopped by its force limit on the way, 0 where it arrived",
        **{column: f"the same over {window:g} s" for window, column in WINDOWS.items()},
        HELD: "upwards on the lower hook at the peak, over n W_s: what goes from hook to hook",
        NET: f"largest mean over {WINDOW:g} s of the force on the upper hook less that on the lower, over n W_s",
        PEAK_TIME: "time since the pull began at which the peak is",
        PEAK_RAISED: "how far the hook had been raised then",
        WORK: "∫ F dz over the whole pull, over n W_s w",
        CAME_FREE: f"1 where the force came below {FREE:g} of its peak for good, 0 where it did not",
        FREE_TIME: "when it did so, since the pull began; empty where it did not",
        LEFT: f"force over n W_s, mean over the last {END:g} s of the pull",
        BEFORE: f"force on the hook over n W_s, mean over the last {END:g} s before the pull",
        ABOVE: "smarticles whose centre of mass is above the hook before the pull, over n",
        CROSSINGS: "⟨N⟩ at rest before the pull: links of others through a smarticle's plane",
        PHI: "packing fraction at rest before the pull",
    }
)
"""What is averaged over seeds: columns of the table of runs."""


def fracture_row(run: RunManifest) -> dict[str, object]:
    """One run's row of the table of runs.

    Args:
        run: A finished run.

    Raises:
        InputError: It is not a pull after one activity or none, or cannot be read.
    """
    procedure, pulled = prepared_by(run, PULL), run.phases[-1]
    rest = pulled.index - 1
    settings = read_phases(run.directory)
    asked = settings[pulled.index]
    if asked.type != PULL:
        msg = f"{run.directory}: phase {pulled.index} is {PULL} in run.json, {asked.type} in scene.yaml"
        raise InputError(msg)
    series = read_series(run.directory)
    table = summarise_run(run.directory, definitions=[DEFINITION], phases={rest, pulled.index}).set_index("phase")
    if rest not in table.index:
        msg = f"{run.directory}: no frame of the rest before the pull; run it again"
        raise InputError(msg)
    before = table.loc[rest]
    row: dict[str, object] = {
        PROCEDURE: procedure,
        THETA: settings[2].number("theta_deg") if procedure == INTERNAL else math.nan,
        ASPECT: round(run.aspect_ratio, 6),
        SEED: run.seed,
        "smarticles [-]": run.count,
        "fidelity": run.fidelity,
        ACTIVE: duration(run.phases[2]) if procedure != STATIC else 0.0,
        PHI: before[PHI],
        CROSSINGS: before["crossings mean [-]"],
        ABOVE: _above(run, series, rest) / run.count,
    }
    pull = read_pull(run, series, pulled.index)
    row |= _of_pull(run, pull)
    row[HELD_FAST] = float(held_fast(pull, asked))
    row[LIMIT] = _limit(asked) / run.count / weight_of_one(run)
    row["escaped at the end [-]"] = table["escaped [-]"].iloc[-1]
    row["frames averaged [-]"] = int(before["frames averaged"])
    row["scene_sha256"] = run.scene_sha256
    row["run"] = run.directory.name
    return row


def _limit(asked: PhaseSettings) -> float:
    """The force that stops the hook [N]; infinite where none does."""
    return math.inf if asked.values.get("force_limit_N") is None else asked.number("force_limit_N", positive=True)


def _of_pull(run: RunManifest, pull: HookPull) -> dict[str, float]:
    total = run.count * weight_of_one(run)
    highest, free = peak(pull), freed(pull)
    return {
        PEAK: highest.force / total,
        **{column: peak(pull, window).force / total for window, column in WINDOWS.items()},
        HELD: held_at(pull, highest.time) / total,
        NET: peak(pull.net).force / total,
        PEAK_TIME: highest.time,
        PEAK_RAISED: highest.raised,
        WORK: pull.work / total / run.middle_length,
        CAME_FREE: float(math.isfinite(free)),
        FREE_TIME: free,
        LEFT: pull.left / total,
        BEFORE: pull.before / total,
        ACCOUNT: pull.work / pull.engine_work - 1 if pull.engine_work else math.nan,
    }


def _above(run: RunManifest, series: Series, phase: int) -> int:
    """Smarticles with their centre of mass above the upper hook at the end of a phase."""
    frame = read_frames(run.directory).in_phase(phase)[-1]
    hook = float(series["hook_upper_z_m"][series.nearest(frame.time)])
    return int((centres_of_mass(frame.vertices)[:, 2] > hook).sum())


def force_history(run: RunManifest, *, net: bool = False) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times since the pull began, (n,) [s], and force over n W_s, (n,) [-], mean between two samples.

    Args:
        run: A run.
        net: Whether to leave out what goes on to the lower hook.

    Raises:
        InputError: There is no series of it.
    """
    pull = read_pull(run, read_series(run.directory), run.phases[-1].index)
    return pull.times, (pull.net if net else pull).force / run.count / weight_of_one(run)
