"""Make the arrays of filaments for the kernels of `dem.engine.links.motion.bending`."""

import math

import numpy as np
from numpy.typing import NDArray

from dem.body.filament import Filament, PreferredCurvature
from dem.body.linear import by_element
from dem.engine.links.arrays import Filaments
from dem.engine.links.motion import bending

Array = NDArray[np.float64]

# A circle with the diameter of a filament is its tightest bend: segments half a turn apart begin to touch each other.
TIGHTEST = math.pi / 2  # arc between them, in diameters


def apart(filament: Filament) -> int:
    """Return the least difference between the numbers of two segments of a filament that can touch."""
    return 1 + max(1, math.ceil(TIGHTEST * filament.diameter / filament.segment_length))


def rod_of(filament: Filament) -> Array:
    """Return (ROD,) constants of a filament, in the columns from `bending.LENGTH` on."""
    length, (stretching, bend, twist) = filament.segment_length, filament.stiffnesses
    across, along, roll = filament.drags
    _, stiffest, stiffest_twist = filament.stiffest
    return np.array(
        [
            length, stretching / length, bend / length, twist / length, filament.stretching_time, filament.bending_time,
            filament.axial_inertia, across * length / 2, along * length / 2, roll * length, filament.weight_share,
            stiffest, stiffest_twist,
        ]
    )  # fmt: skip


def wave_of(filament: Filament, curvature: PreferredCurvature | None) -> Array:
    """Return the wave (nodes, 3) of preferred κ along one filament, as in `Filaments.wave`.

    It has amplitude, cosine and sine of the phase at each node [1]. Without a curvature the filament has none.
    """
    wave = np.zeros((filament.nodes, 3))
    if curvature is not None:
        # A curvature 1/R turns a segment by the angle ℓ/R, and κ is twice the tangent of half of it.
        wave[1:-1, 0] = 2 * by_element(math.tan, np.asarray(curvature.amplitudes) * filament.segment_length / 2)
        phases = np.asarray(curvature.phases)
        wave[1:-1, 1], wave[1:-1, 2] = by_element(math.cos, phases), by_element(math.sin, phases)
    return wave


def gaits_of(bodies: NDArray[np.int64], starts: Array | None, seed: int) -> Array:
    """Return the states (F, GAIT) of the waves of new filaments or linkages, which do not turn yet.

    Args:
        bodies: (F,) numbers of the filaments or linkages among all bodies.
        starts: (F,) initial angles ψ [rad]; None: 0.
        seed: seed of the times at which waves reverse, together with the number of the body.
    """
    gait = np.zeros((len(bodies), bending.GAIT))
    gait[:, bending.SENSE] = gait[:, bending.FACTOR] = gait[:, bending.TARGET] = 1.0
    gait[:, bending.WAIT] = math.inf
    gait[:, bending.SEED], gait[:, bending.NUMBER] = seed, bodies
    gait[:, bending.PSI] = 0.0 if starts is None else starts
    return gait


def none_of() -> Filaments:
    """Return arrays for a pile without filaments."""
    f = np.zeros
    return Filaments(
        f(0, np.int32), f(1, np.int32), f((0, bending.ROD)), f((0, bending.GAIT)), f((0, 3)), f((0, 2)), f(0),
        f((0, 3)), f((0, 3)), f(0), f((0, 3)), f(0), f((0, 3)), f((0, 4)), f((0, 4)), f((0, 4)), f(0, np.int64),
        f((0, 3)), f((0, 3)), f(bending.SUMS),
    )  # fmt: skip


def filaments_at(
    old: Filaments,
    filament: Filament,
    bodies: NDArray[np.int64],
    points: Array,
    velocities: Array | None,
    starts: Array | None,
    seed: int,
) -> Filaments:
    """Return arrays of the filaments of `old` and of F new ones.

    Args:
        bodies: (F,) numbers of the new filaments among all bodies.
        points: (F, nodes, 3) positions of the nodes [m].
        velocities: (F, nodes, 3) velocities of the nodes [m/s]; None: at rest.
        starts: (F,) initial angle ψ of each preferred curvature [rad]; None: 0.
        seed: seed of the times at which preferred curvatures reverse.
    """
    count, nodes, _ = points.shape
    edges = np.diff(points, axis=1)
    extents = np.sqrt((edges**2).sum(axis=2))
    tangents = edges / extents[:, :, None]
    gait = gaits_of(bodies, starts, seed)
    if filament.curvature is not None:
        own = filament.curvature
        gait[:, bending.RATE], gait[:, bending.REVERSALS] = own.rate, own.reversal_rate

    def per_node(values: Array) -> Array:
        """Return values (F, nodes - 1, …) of segments as (F nodes, …), with zeros at each last node."""
        return np.concatenate([values, np.zeros_like(values[:, :1])], axis=1).reshape(count * nodes, *values.shape[2:])

    total = count * nodes
    fresh = none_of()._replace(
        body=bodies.astype(np.int32),
        begin=(len(old.mass) + nodes * np.arange(1, count + 1)).astype(np.int32),
        rod=np.tile(rod_of(filament), (count, 1)),
        gait=gait,
        wave=np.tile(wave_of(filament, filament.curvature), (count, 1)),
        preferred=np.zeros((total, 2)),
        mass=np.tile(filament.masses, count),
        position=points.reshape(total, 3).copy(),
        velocity=np.zeros((total, 3)) if velocities is None else velocities.reshape(total, 3).copy(),
        spin=np.zeros(total),
        tangent=per_node(tangents),
        extent=per_node(extents),
        director=per_node(_untwisted(tangents)),
        **{name: np.zeros((total, 4)) for name in ("force", "damping", "drag")},
        grip=np.zeros(total, np.int64),
    )
    joined = Filaments(*(np.concatenate([a, b]) for a, b in zip(old, fresh, strict=True)))
    return joined._replace(sums=old.sums)


def _untwisted(tangents: Array) -> Array:
    """Return first directors (F, S, 3) of untwisted filaments, unit vectors across each segment.

    `tangents` (F, S, 3) are unit vectors along the S segments of each of F filaments [1].
    """
    found = np.zeros_like(tangents)
    for f, own in enumerate(tangents):
        least = np.zeros(3)
        least[np.abs(own[0]).argmin()] = 1.0
        d = least
        for k, tangent in enumerate(own):
            if k:
                middle = own[k - 1] + tangent
                d = d - (d * tangent).sum() / (1 + (own[k - 1] * tangent).sum()) * middle
            d = d - (d * tangent).sum() * tangent
            d = d / math.sqrt((d**2).sum())
            found[f, k] = d
    return found
