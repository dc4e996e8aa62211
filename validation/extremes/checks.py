"""Check a run from its frames and series, with NumPy alone: container, floor, crossings of axes, numbers, energy."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from postprocess import read_frames

Array = NDArray[np.float64]

DEPTH = 0.1  # of a link's thickness: how far a point may be outside the container or below the floor
ENERGY = 0.01  # of the energy put in: how much more there may be
INSIDE = 1e-3  # of a segment's length: a crossing is at least so far from both ends


def segments(vertices: Array) -> Array:
    """Return the axes of all links.

    Args:
        vertices: (N, 4, 3) barb tip, hinge, hinge, barb tip [m].

    Returns:
        (3N, 2, 3) ends of each link's axis [m].
    """
    found: Array = np.stack([vertices[:, :-1], vertices[:, 1:]], axis=2).reshape(-1, 2, 3)
    return found


def surface(vertices: Array, thickness: float) -> tuple[Array, Array]:
    """Return points of all axes, and how much material surrounds each.

    A link ends at its tip, where there is nothing beyond the axis; half a thickness from there on it is a thickness
    wide. So neither a square nor a rounded end is taken for more than it is.

    Args:
        vertices: (N, 4, 3) barb tip, hinge, hinge, barb tip [m].
        thickness: of a link [m].

    Returns:
        (M, 3) points [m], (M,) radius of the material about each [m].
    """
    ends = segments(vertices)
    along = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(along, axis=-1)
    wide = length > thickness
    step = along[wide] / length[wide, None] * thickness / 2
    inner = np.concatenate([ends[wide, 0] + step, ends[wide, 1] - step])
    points = np.concatenate([ends.reshape(-1, 3), inner])
    return points, np.repeat([0.0, thickness / 2], [2 * len(ends), len(inner)])


def crossings(before: Array, after: Array) -> list[tuple[int, int]]:
    """Find axes of different smarticles that pass through each other while vertices move along straight lines.

    While two axes pass through each other the volume that their four ends span changes its sign, and both axes'
    common point is inside of both.

    Args:
        before: (N, 4, 3) vertices in a frame [m].
        after: (N, 4, 3) vertices in the next one [m].

    Returns:
        Pairs of links, numbered along `segments`.
    """
    one, two = segments(before), segments(after)
    # A link without length, of l/w = 0, has no axis to cross.
    long = np.minimum(np.ptp(one, axis=1), np.ptp(two, axis=1)).max(axis=-1) > 0
    low = np.minimum(one, two).min(axis=1)
    high = np.maximum(one, two).max(axis=1)
    i, j = np.triu_indices(len(one), k=1)
    near = (i // 3 != j // 3) & long[i] & long[j]
    i, j = i[near], j[near]
    near = ((low[i] <= high[j]) & (low[j] <= high[i])).all(axis=-1)
    i, j = i[near], j[near]
    if not len(i):
        return []

    def ends(time: Array) -> tuple[Array, Array, Array]:
        a = one[i] + time[:, None, None] * (two[i] - one[i])
        b = one[j] + time[:, None, None] * (two[j] - one[j])
        return a[:, 1] - a[:, 0], b[:, 1] - b[:, 0], b[:, 0] - a[:, 0]

    def volume(time: Array) -> Array:
        u, v, apart = ends(time)
        found: Array = (np.cross(u, v) * apart).sum(axis=-1)
        return found

    found = np.zeros(len(i), dtype=bool)
    times = np.linspace(0, 1, 17)
    values = np.array([volume(np.full(len(i), time)) for time in times])
    for k in range(len(times) - 1):
        change = (values[k] > 0) != (values[k + 1] > 0)
        if not change.any():
            continue
        lower, upper = np.full(len(i), times[k]), np.full(len(i), times[k + 1])
        for _ in range(40):
            middle = (lower + upper) / 2
            left = (volume(middle) > 0) == (values[k] > 0)
            lower, upper = np.where(left, middle, lower), np.where(left, upper, middle)
        u, v, apart = ends((lower + upper) / 2)
        normal = np.cross(u, v)
        square = (normal**2).sum(axis=-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            s = (np.cross(apart, v) * normal).sum(axis=-1) / square
            t = (np.cross(apart, u) * normal).sum(axis=-1) / square
        inside = (np.abs(s - 0.5) < 0.5 - INSIDE) & (np.abs(t - 0.5) < 0.5 - INSIDE)
        found |= change & inside
    return list(zip(i[found].tolist(), j[found].tolist(), strict=True))


def check_run(path: Path, scene: Mapping[str, Any]) -> dict[str, Any]:
    """Check one finished run.

    Args:
        path: the run directory.
        scene: plain data of the scene, as `draw_scene` gives it.

    Returns:
        What was measured, and under "wrong" what is not as it must be, "" if nothing.
    """
    thickness = min(scene["smarticle"]["thickness_normal_m"], scene["smarticle"]["thickness_in_plane_m"])
    radius, wall = scene["container"]["radius_m"], scene["container"]["height_m"]
    wrong: list[str] = []
    floor_depth = wall_depth = moved = -np.inf
    crossed: set[tuple[int, int]] = set()
    finite, first, last = True, None, None
    for frame in read_frames(path):
        vertices = frame.vertices
        finite &= bool(np.isfinite(vertices).all())
        if not finite:
            wrong.append(f"no number in the frame at {frame.time:.4f} s")
            break
        points, inset = surface(vertices, thickness)
        height = points[:, 2] - frame.floor_z - inset
        out = np.hypot(points[:, 0], points[:, 1]) + inset - radius
        floor_depth = max(floor_depth, float((-height).max()) / thickness)
        wall_depth = max(wall_depth, float(np.where(height < wall, out, -np.inf).max()) / thickness)
        if last is not None:
            count = min(len(last), len(vertices))
            moved = max(moved, float(np.linalg.norm(vertices[:count] - last[:count], axis=-1).max()) / thickness)
            pairs = crossings(last[:count], vertices[:count])
            crossed.update(pairs)
            first = first if first is not None or not pairs else frame.time
        last = vertices
    if floor_depth > DEPTH:
        wrong.append(f"{floor_depth:.2f} thicknesses below the floor")
    if wall_depth > DEPTH:
        wrong.append(f"{wall_depth:.2f} thicknesses outside the wall")
    if crossed:
        wrong.append(f"{len(crossed)} pairs of axes crossed, first before {first:.4f} s")
    excess, residual = energy_errors(path)
    if not excess <= ENERGY:
        wrong.append(f"energy {100 * excess:.1f} % above what was put in")
    return {
        "below the floor [t]": floor_depth,
        "outside the wall [t]": wall_depth,
        "pairs of axes crossed [1]": len(crossed),
        "farthest moved between frames [t]": moved,
        "energy above what was put in [1]": excess,
        "largest residual over dissipated [1]": residual,
        "wrong": "; ".join(wrong),
    }


def energy_errors(path: Path) -> tuple[float, float]:
    """Return the largest excess of energy over what was put in [1], and of the residual over what was dissipated [1].

    `added_energy_J` has the height and speed that smarticles are poured with; works are those of motors and container.
    NaN is passed on.
    """
    with h5py.File(path / "series.h5") as file:
        series = {name: np.asarray(dataset[()], dtype=float) for name, dataset in file.items()}

    def column(name: str) -> Array:
        return series.get(name, np.zeros(len(series["time_s"])))

    given = column("added_energy_J")
    works = column("motor_work_J") + column("container_work_J")
    stored = sum(
        column(name)
        for name in (
            "kinetic_energy_J",
            "gravitational_energy_J",
            "contact_elastic_energy_J",
            "hinge_elastic_energy_J",
        )
    )
    scale = np.maximum.accumulate(np.abs(given) + np.abs(works))
    scale = np.where(scale > 0, scale, np.inf)
    excess = ((stored - given - works) / scale).max()
    dissipated = np.maximum.accumulate(np.abs(column("dissipated_energy_J")))
    residual = (np.abs(column("energy_residual_J")) / np.where(dissipated > 0, dissipated, np.inf)).max()
    return float(excess), float(residual)
