"""Run directories of columns that collapse: a given share of the smarticles leaves, and all of them sink."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray

from dem.record.frames import FrameWriter
from synthetic import RADIUS, SyntheticRun, W, mesh_of, u_shape, write_ending, write_manifest, write_series

F = 30.0
PHASES = ("deposit", "shake", "relax", "remove-container", "shake")
H0 = 0.0075  # m
WITH_WALL = 1.25  # of it: the column sinks when its wall goes


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column of `count` smarticles whose share within the radius goes as exp(-(t/tau)^beta).

    Its centre of mass goes from H0 to 0.4 H0 in half that time.
    """

    tau: float
    beta: float = 1.0
    aspect_ratio: float = 0.4
    gamma: float = 2.5
    seed: int = 1
    count: int = 50
    frequency: float = F
    status: str = "done"
    phases: tuple[str, ...] = PHASES


def write_column(directory: Path, column: Column) -> Path:
    """A whole run directory; returns it."""
    directory.mkdir(parents=True)
    known = {"phases": column.phases, "count": column.count, "aspect_ratio": column.aspect_ratio}
    write_manifest(directory, SyntheticRun(seed=column.seed, **known))
    durations = [1.0, 0.5, 0.2, 0.2, 3.0]
    ends = np.cumsum(durations[: len(column.phases)])
    starts = ends - durations[: len(column.phases)]
    times = np.arange(1, round(ends[-1] / 0.005) + 1) * 0.005
    phases = np.searchsorted(ends, times - 1e-9)
    table = np.column_stack([times, phases, *_shares(column, times - starts[-1])])
    _write_series(directory, column, table)
    _write_frames(directory, column, table[19::20])
    _write_scene(directory, column)
    spans = list(zip(starts, ends, strict=True))
    write_ending(directory, column.phases, spans, status=column.status, wall=1.0)
    return directory


def _shares(column: Column, times: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    since = np.clip(times, 0, None)
    left = np.exp(-((since / column.tau) ** column.beta))
    return left, 0.4 + 0.6 * np.exp(-((2 * since / column.tau) ** column.beta))


def _outside(column: Column, left: NDArray[np.float64]) -> NDArray[np.int64]:
    return np.round(column.count * (1 - np.asarray(left))).astype(np.int64)


def _write_series(directory: Path, column: Column, table: NDArray[np.float64]) -> None:
    times, phases, left, sunk = table.T
    # Everything bounces within a period while it is shaken.
    bounce = np.where(phases == len(column.phases) - 1, 0.1 * np.sin(2 * np.pi * F * times), 0.0)
    columns = {
        "time_s": times,
        "phase": phases.astype(np.int64),
        "com_height_m": H0 * (sunk + bounce) * np.where(phases < len(column.phases) - 2, WITH_WALL, 1.0),
        "outside_count": _outside(column, left),
    }
    write_series(directory, columns, seed=column.seed)


def _write_frames(directory: Path, column: Column, table: NDArray[np.float64]) -> None:
    shape, frames = u_shape(column.aspect_ratio * W), FrameWriter(directory)
    for time, phase, left, height in table:
        centres = np.zeros((column.count, 3))
        centres[:, 2] = H0 * height
        centres[: _outside(column, left), 0] = 2 * RADIUS
        frames.write(mesh_of(centres[:, None] + shape, time=float(time), phase=int(phase)), float(time))


def _write_scene(directory: Path, column: Column) -> None:
    shake = {"type": "shake", "frequency_hz": column.frequency, "peak_acceleration_g": 2.0}
    phases = [dict(shake) if kind == "shake" else {"type": kind} for kind in column.phases]
    phases[-1]["peak_acceleration_g"] = column.gamma
    (directory / "scene.yaml").write_text(yaml.safe_dump({"schema_version": 1, "phases": phases}))
