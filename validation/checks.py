"""Checks of finished runs of bodies of any shape, from their frames alone; NumPy, and no code of the engines.

Each check returns what it measured, and the limit that a right run keeps.
"""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
GRAVITY = 9.81


class Solid(NamedTuple):
    """The section of all bars of a kind: half of its thicknesses [m], along the normal of the plane and in it."""

    normal: float
    in_plane: float


def linking_number(one: Array, two: Array) -> int:
    """Return how often two closed polygons, of corners (M, 3) and (N, 3) [m], are linked.

    Half the sum of the signed crossings in a projection (any direction; here a fixed oblique one).
    """
    along = np.array([0.2672612419, 0.5345224838, 0.8017837257])
    side = np.cross(along, [1.0, 0, 0])
    side /= np.linalg.norm(side)
    axes = np.stack([side, np.cross(along, side), along])
    a, b = (np.stack([corners, np.roll(corners, -1, axis=0)], axis=1) @ axes.T for corners in (one, two))
    p, q = a[:, None, 0], b[None, :, 0]
    u, v = a[:, None, 1] - p, b[None, :, 1] - q
    apart = q - p
    area = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (apart[..., 0] * v[..., 1] - apart[..., 1] * v[..., 0]) / area
        t = (apart[..., 0] * u[..., 1] - apart[..., 1] * u[..., 0]) / area
    above = (p + s[..., None] * u)[..., 2] > (q + t[..., None] * v)[..., 2]
    met = (s >= 0) & (s < 1) & (t >= 0) & (t < 1)
    return int(np.where(met, np.sign(area) * np.where(above, 1, -1), 0).sum()) // 2


def closed_curve(ends: Array) -> Array | None:
    """Return the corners (M, 3) [m] of bars (M, 2, 3) that follow one another in a closed curve; None of others."""
    size = np.ptp(ends.reshape(-1, 3), axis=0).max()
    joined = np.linalg.norm(ends[:, 1] - np.roll(ends[:, 0], -1, axis=0), axis=-1)
    return ends[:, 0] if len(ends) > 2 and joined.max() < 1e-6 * size else None


def linked_pairs(ends: Array, body: NDArray[np.int64]) -> list[tuple[int, int]]:
    """Return the pairs of bodies, of bars (M, 2, 3) [m], whose closed curves are linked."""
    curves = {n: curve for n in np.unique(body) if (curve := closed_curve(ends[body == n])) is not None}
    boxes = {n: (curve.min(axis=0), curve.max(axis=0)) for n, curve in curves.items()}
    return [
        (int(m), int(n))
        for m, n in combinations(curves, 2)
        if (boxes[m][0] <= boxes[n][1]).all()
        and (boxes[n][0] <= boxes[m][1]).all()
        and linking_number(curves[m], curves[n])
    ]


def axes_in_solids(
    ends: Array, body: NDArray[np.int64], normals: Array | None, solids: Sequence[Solid]
) -> list[tuple[int, int]]:
    """Return pairs of bars (m, n) of different bodies, where the axis of m goes through the solid of n.

    Ends of axes are (M, 2, 3) [m], `normals` (M, 3) unit vectors along the normals of flat sections; `solids` has one
    section for each bar. The solid of a bar is the box around its axis, or the round bar. Half a thickness at both ends
    of axes and solids is left out, where round bars end in half spheres.
    """
    found: set[tuple[int, int]] = set()
    middle = ends.mean(axis=1)
    reach = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1) / 2
    thickness = np.array([2 * min(solid) for solid in solids])
    inset = np.minimum(thickness / (4 * np.maximum(reach, 1e-12)), 0.5)
    for n, solid in enumerate(solids):
        apart = np.linalg.norm(middle - middle[n], axis=-1)
        near = (body != body[n]) & (apart < reach + reach[n] + max(solid))
        (others,) = np.nonzero(near)
        if not len(others) or reach[n] == 0:
            continue
        along = (ends[n, 1] - ends[n, 0]) / (2 * reach[n])
        shares = inset[others, None] + np.linspace(0, 1, 201) * (1 - 2 * inset[others, None])
        points = ends[others, 0, None] + shares[..., None] * (ends[others, 1] - ends[others, 0])[:, None] - middle[n]
        within = np.abs(points @ along) < reach[n] - thickness[n] / 2
        normal = None if normals is None or not normals[n].any() else normals[n]
        if normal is None:
            radial = points - (points @ along)[..., None] * along
            within &= np.linalg.norm(radial, axis=-1) < min(solid)
        else:
            within &= np.abs(points @ normal) < solid.normal
            within &= np.abs(points @ np.cross(along, normal)) < solid.in_plane
        found.update((int(m), n) for m in others[within.any(axis=1)])
    return sorted(found)


def unrest(speeds: Array, spins: Array, thickness: float) -> float:
    """Return how far a pile is from rest: the largest change of a bar's speed between two frames [1].

    Velocities and angular velocities are (frames, M, 3) [m/s, rad/s]; the speed of the surface is taken in units of
    sqrt(g t), with the thinnest thickness t [m]. A round bar that rolls on evenly counts as at rest.
    """
    surface = np.linalg.norm(np.diff(spins, axis=0), axis=-1) * thickness / 2
    centre = np.linalg.norm(np.diff(speeds, axis=0), axis=-1)
    return float(np.median(np.maximum(surface, centre).max(axis=1)) / np.sqrt(GRAVITY * thickness))


def floor_error(times: Array, heights: Array, phase: Mapping[str, Any], start: float) -> float:
    """Return the largest deviation of the floor from a shake as the scene asks for it, over its amplitude [1].

    The phase is that of the scene, without a sweep; the floor's heights (frames,) [m] belong to times [s], and the
    phase starts at `start` [s].
    """
    frequency = phase["frequency_hz"]
    amplitude = phase["peak_acceleration_g"] * GRAVITY / (2 * np.pi * frequency) ** 2
    since = times - start
    if "taps" not in phase:
        asked = amplitude * np.sin(2 * np.pi * frequency * since)
    else:
        within = np.mod(since, 1 / frequency + phase["rest_s"])
        asked = np.where(within < 1 / frequency, amplitude * (1 - np.cos(2 * np.pi * frequency * within)), 0)
    return float(np.abs(heights - asked).max() / amplitude)
