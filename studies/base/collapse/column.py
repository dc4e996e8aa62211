"""The height of a column while it collapses, by several definitions, against time.

A column on a floor without end loses height in two ways: it sinks, and smarticles leave it. On a floor that shakes with
several g, those that have left hop millimetres high, as high as a low column, so heights of all smarticles, or of the
uppermost ones, do not go to the height of a layer. `remaining` does not mind: it counts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from dem.errors import InputError
from dem.record.frames import read_frames
from dem.record.manifest import PhaseRecord, RunManifest
from dem.record.series import read_series
from postprocess.geometry.links import centres_of_mass
from postprocess.scene_file import read_phases
from studies.base.collapse.collapse_time import CollapseTime, collapse_time

if TYPE_CHECKING:
    from numpy.typing import NDArray

REMAINING, COM, CORE = "remaining", "com", "core"

DEFINITIONS: Mapping[str, str] = MappingProxyType(
    {
        REMAINING: "smarticles still within the container's radius, over those before vibration: the height that the "
        "column has left above its base at the density it had",
        COM: "height of the centre of mass of all smarticles, over that before vibration",
        CORE: "height of the centre of mass of those within the container's radius, over that before vibration; from "
        "frames",
    }
)
"""Definitions of a column's height by name, each over that before vibration."""

KNOWN_ENDS: Mapping[str, tuple[float | None, float | None]] = MappingProxyType(
    {REMAINING: (1.0, 0.0), COM: (None, None), CORE: (None, None)}
)
"""Start and end of the fitted curve [-] where they are known: in the end all have left. The other heights bounce up at
the start and hop in the end, so theirs are fitted."""

REST = 0.1
"""How long before vibration the height is averaged that others are taken over [s]."""


@dataclass(frozen=True, kw_only=True)
class Vibration:
    """The phase in which a free-standing column is shaken.

    Attributes:
        phase: Its record.
        acceleration: Γ, peak acceleration over g [-].
        frequency: f [Hz].
    """

    phase: PhaseRecord
    acceleration: float
    frequency: float


@dataclass(frozen=True, kw_only=True, eq=False)
class ColumnHistory:
    """Heights of one column against time.

    Attributes:
        times: (n,) since the vibration began [s], some of them before.
        heights: (n,) over the mean height in the last `REST` before [-].
        before: That height: [m], or a share of the smarticles by `REMAINING` [-].
    """

    times: NDArray[np.float64]
    heights: NDArray[np.float64]
    before: float


def vibration(run: RunManifest) -> Vibration:
    """The first phase of a run that shakes the floor after the wall was taken away.

    Raises:
        InputError: There is none, or the scene does not say how it shakes.
    """
    kinds = [phase.type for phase in run.phases]
    after = kinds.index("remove-container") if "remove-container" in kinds else len(kinds)
    found = next((phase for phase in run.phases[after:] if phase.type == "shake"), None)
    if found is None:
        msg = f"{run.directory}: no shake after a remove-container: its phases are {', '.join(kinds)}"
        raise InputError(msg)
    settings = read_phases(run.directory)[found.index]
    return Vibration(
        phase=found,
        acceleration=settings.number("peak_acceleration_g"),
        frequency=settings.number("frequency_hz"),
    )


def column_history(run: RunManifest, definition: str, shaken: Vibration) -> ColumnHistory:
    """Heights of a run's column from the phase before its vibration to the end of that.

    Args:
        run: A finished run.
        definition: Name from `DEFINITIONS`.
        shaken: See `vibration`.

    Raises:
        InputError: The run lacks its series or frames, or samples before the vibration.
    """
    times, heights = _from_frames(run, shaken) if definition == CORE else _from_series(run, definition, shaken)
    assert shaken.phase.start is not None  # of a finished run
    times = times - shaken.phase.start
    resting = (times > -REST * (1 + 1e-6)) & (times < 1e-9)
    before = float(heights[resting].mean()) if resting.any() else math.nan
    if not before > 0:
        msg = (
            f"{run.directory}: no height of the column in the last {REST:g} s before its vibration; record more often, "
            "or rest longer before"
        )
        raise InputError(msg)
    return ColumnHistory(times=times, heights=heights / before, before=before)


def height_with_the_wall(run: RunManifest) -> float:
    """Height of the centre of mass when the wall was last there [m].

    Raises:
        InputError: The run lacks its series, or samples before its wall went.
    """
    series = read_series(run.directory)
    gone = [phase.type for phase in run.phases].index("remove-container")
    heights = series["com_height_m"][series["phase"] < gone]
    if not len(heights):
        msg = f"{run.directory}: no height of the column before its wall went; record more often"
        raise InputError(msg)
    return float(heights[-1])


def _from_series(
    run: RunManifest, definition: str, shaken: Vibration
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    series = read_series(run.directory)
    last = shaken.phase.index
    shown = (series["phase"] >= last - 1) & (series["phase"] <= last)
    if definition == REMAINING:
        heights = 1 - series["outside_count"][shown] / run.count
    else:
        heights = np.asarray(series["com_height_m"][shown], dtype=np.float64)
    return series.time[shown], heights


def _from_frames(run: RunManifest, shaken: Vibration) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    frames, last = read_frames(run.directory), shaken.phase.index
    times, heights = [], []
    for phase in (last - 1, last):
        for frame in frames.in_phase(phase):
            times.append(frame.time)
            heights.append(core_height(frame.vertices, floor_z=frame.floor_z, radius=run.container_radius))
    return np.array(times), np.array(heights)


def core_height(vertices: NDArray[np.float64], *, floor_z: float, radius: float) -> float:
    """Mean height [m] of the centres of mass within a radius from the axis; 0 where there is none.

    Args:
        vertices: (N, 4, 3) [m], barb tip, hinge, hinge, barb tip of each smarticle.
        floor_z: Height of the floor [m].
        radius: [m].

    Raises:
        InputError: Bad vertices.
    """
    centres = centres_of_mass(vertices)
    within = np.hypot(centres[:, 0], centres[:, 1]) <= radius
    return max(0.0, float(centres[within, 2].mean() - floor_z)) if within.any() else 0.0


def collapse_of(history: ColumnHistory, definition: str, shaken: Vibration) -> CollapseTime:
    """The collapse time of a column.

    Means over each period of the vibration are fitted, so that bouncing within a period does not count.

    Args:
        history: See `column_history`.
        definition: Its definition.
        shaken: See `vibration`.

    Raises:
        InputError: It was sampled too rarely, or watched for too short a time.
    """
    times, heights = period_means(history.times, history.heights, shaken.frequency)
    start, end = KNOWN_ENDS[definition]
    return collapse_time(times, heights, start=start, end=end)


def period_means(
    times: NDArray[np.float64], values: NDArray[np.float64], frequency: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Means over whole periods from time 0 on; periods without a sample are left out.

    Args:
        times: (n,) [s].
        values: (n,).
        frequency: [Hz].

    Returns:
        Mean times (m,) [s] of the samples of each period, and mean values (m,).
    """
    # A sample at the end of a period belongs to it.
    period = np.ceil(times * frequency - 1e-6).astype(np.int64)
    used = period > 0
    _, place = np.unique(period[used], return_inverse=True)
    samples = np.bincount(place)
    return np.bincount(place, times[used]) / samples, np.bincount(place, values[used]) / samples
