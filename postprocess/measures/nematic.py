"""Measure the alignment of bodies: nematic order of axes, and polar order of directions.

For smarticles these are the nematic order of their middle links, and on request the order of all links and of the
directions in which the mouths of bent smarticles point.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.bars import centres_of_bodies
from postprocess.geometry.links import Floats, UndefinedMeasureError, checked_vertices
from postprocess.geometry.segments import Curve, checked_curves, checked_segments, curves, segments_of
from postprocess.measures.entanglement import polygon_flaw
from postprocess.measures.registry import FrameMeasure, Quantity, any_in_space, in_space


@dataclass(frozen=True, kw_only=True, eq=False)
class NematicOrder:
    """Nematic order of unit vectors u, which does not depend on their signs."""

    tensor: Floats = field(repr=False)  #: (3, 3) float64 [-], Q = ⟨(3 u u - 1) / 2⟩, symmetric and traceless
    #: Nematic order parameter S, the largest eigenvalue of Q [-]: 1 if all u are parallel, 1/4 if they are random in a
    #: plane, and on average about 0.8 / N^½ for N random u in space
    order: float
    director: Floats  #: (3,) eigenvector of Q with the eigenvalue S, a unit vector that points upwards

    @property
    def polar_angle(self) -> float:
        """Angle of the director from the vertical [rad], 0 to π/2."""
        return math.acos(min(abs(float(self.director[2])), 1.0))

    @property
    def upright(self) -> float:
        """Q_zz = ⟨(3 cos²θ - 1) / 2⟩ [-], θ from the vertical: 1 all vertical, -1/2 horizontal, 0 random."""
        return float(self.tensor[2, 2])


@dataclass(frozen=True, kw_only=True, eq=False)
class PolarOrder:
    """Polar order of unit vectors u, which depends on their signs."""

    vector: Floats  #: (3,) mean of u [-]; its z-component is the mean cosine of the angle from the vertical
    order: float  #: Length of `vector` [-]: 1 if all u are equal, on average 0.92 / N^½ for N random u


def nematic_order(directions: ArrayLike, weights: ArrayLike | None = None) -> NematicOrder:
    """Compute the nematic order of vectors (N, 3) of any length above 0, with optional weights (N,).

    Raises:
        InputError: Not (N, 3) finite vectors of a length above 0, or not N weights above 0.
        UndefinedMeasureError: There is no vector.

    Source:
        Eppenga & Frenkel, Mol. Phys. 52, 1303 (1984): the largest eigenvalue of Q, and its bias of order N^-½. The
        result agrees with `freud.order.Nematic` (3.4.0) to its single precision, 2e-7.

    Example:
        >>> nematic_order([[0, 0, 2.0], [0, 0, -1.0]]).order
        1.0
    """
    unit = _unit(directions)
    if weights is None:
        tensor = 1.5 * unit.T @ unit / len(unit) - 0.5 * np.eye(3)
    else:
        share = np.asarray(weights, dtype=np.float64)
        if share.shape != (len(unit),) or not np.all(np.isfinite(share) & (share > 0)):
            raise InputError(f"weights must be {len(unit)} numbers above 0, one per direction: got shape {share.shape}")
        tensor = 1.5 * (unit.T * (share / share.sum())) @ unit - 0.5 * np.eye(3)
    values, vectors = np.linalg.eigh(tensor)
    director = vectors[:, -1]
    return NematicOrder(
        tensor=tensor, order=float(values[-1]), director=-director if director[2] < 0 else director.copy()
    )


def polar_order(directions: ArrayLike) -> PolarOrder:
    """Compute the polar order of vectors (N, 3) of any length above 0.

    Raises:
        InputError: Not (N, 3) finite vectors of a length above 0.
        UndefinedMeasureError: There is no vector.

    Example:
        >>> polar_order([[0, 0, 2.0], [0, 0, 1.0], [0, 0, -1.0], [0, 0, 3.0]]).order
        0.5
    """
    mean = _unit(directions).mean(axis=0)
    return PolarOrder(vector=mean, order=float(np.linalg.norm(mean)))


def segment_order(segments: ArrayLike, body: ArrayLike) -> NematicOrder:
    """Compute the nematic order of the directions of all segments, weighted by their lengths.

    Segments are (M, 2, 3) [m]; `body` (M,) is the number of the body of each segment.

    Raises:
        InputError: See `checked_segments`.
        UndefinedMeasureError: There is no segment.
    """
    along = np.diff(checked_segments(segments, body).segments, axis=1)[:, 0]
    return nematic_order(along, np.linalg.norm(along, axis=1))


def body_axes(segments: ArrayLike, body: ArrayLike, *, longest: bool = True) -> Floats:
    """Return the longest or the shortest axis of each body: (B, 3) unit vectors of arbitrary sign.

    The longest axis is the direction in which the material, spread evenly along the segments, spreads most. The
    shortest axis is that in which it spreads least: the normal of a flat body such as a ring. `nematic_order` takes
    such axes.

    Args:
        segments: (M, 2, 3) both ends of all segments [m].
        body: (M,) number of the body of each segment.
        longest: Whether to return the longest axis, else the shortest.

    Raises:
        InputError: See `checked_segments`; or a body spreads as far in a second direction, within 1e-6.
    """
    segments, body = checked_segments(segments, body)
    bodies, number = np.unique(body, return_inverse=True)
    lengths = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
    centred = segments - centres_of_bodies(segments, number)[number, None]
    # Exact second moments of line segments: their ends and their middles weigh 1 : 1 : 4.
    points = np.stack([centred[:, 0], centred[:, 1], 2 * centred.mean(axis=1)], axis=1)
    moments = np.zeros((len(bodies), 3, 3))
    np.add.at(moments, number, np.einsum("m,mpa,mpb->mab", lengths / 6, points, points))
    values, vectors = np.linalg.eigh(moments)
    gaps = values[:, 2] - values[:, 1] if longest else values[:, 1] - values[:, 0]
    alike = np.nonzero(gaps <= 1e-6 * values[:, 2])[0]
    if len(alike):
        which, other = ("longest", "shortest") if longest else ("shortest", "longest")
        raise InputError(
            f"body {bodies[alike[0]]} has no {which} axis: it spreads as far in a second direction; use the {other} "
            "axis, or `segment_order`, which needs none"
        )
    axes: Floats = vectors[:, :, 2 if longest else 0]
    return axes


def opening_directions(segments: ArrayLike, body: ArrayLike) -> Floats:
    """Return the direction in which each body is open: (B, 3) unit vectors, for `polar_order`.

    It points from the centre of mass to the middle between the two free ends, as out of the mouth of a U, and does not
    depend on the order of the segments. Segments are (M, 2, 3) [m]; `body` (M,) is the number of the body of each
    segment.

    Raises:
        InputError: See `checked_segments`; or a body has no such direction: it is closed, branches, has several pieces,
            or its ends lie on opposite sides, within 1e-6 of its length, as those of a rod, a Z and an S.
    """
    found = [_opening(one) for one in checked_curves(segments, body, "opening")]
    for one, (_, flaw) in zip(np.unique(body), found, strict=True):
        if flaw:
            raise InputError(f"body {one} has no opening: {flaw}; use `body_axes`")
    return np.array([direction for direction, _ in found]).reshape(-1, 3)


def _opening(curve: Curve) -> tuple[Floats, str]:
    """Return the unit vector (3,) in which a curve is open, and the reason if there is none."""
    if curve.closed:
        return np.zeros(3), "it is closed"
    lengths = np.linalg.norm(np.diff(curve.corners, axis=0), axis=1)
    middles = (curve.corners[:-1] + curve.corners[1:]) / 2
    opening = (curve.corners[0] + curve.corners[-1]) / 2 - np.average(middles, axis=0, weights=lengths)
    size = float(np.linalg.norm(opening))
    if size <= 1e-6 * lengths.sum():
        return np.zeros(3), "its ends lie on opposite sides of its centre of mass, as those of a rod, a Z and an S"
    return opening / size, ""


def _unit(directions: ArrayLike) -> Floats:
    """Return unit vectors (N, 3) of directions after checking these."""
    directions = np.asarray(directions, dtype=np.float64)
    if directions.ndim != 2 or directions.shape[1] != 3 or not np.all(np.isfinite(directions)):
        raise InputError(f"directions must be (N, 3) finite numbers: got an array of shape {directions.shape}")
    if len(directions) == 0:
        raise UndefinedMeasureError("an orientation order needs at least 1 direction: got 0")
    lengths = np.linalg.norm(directions, axis=1)
    if not np.all(lengths > 0):
        raise InputError(f"direction {int(np.argmin(lengths))} has no length; leave it out")
    unit: Floats = directions / lengths[:, None]
    return unit


def _nematic_of(frame: Frame, _: Run) -> tuple[float, float, float]:
    order = nematic_order(np.diff(checked_vertices(frame.vertices), axis=1)[:, 1])
    return order.order, math.degrees(order.polar_angle), order.upright


def _orientation_of(frame: Frame, _: Run) -> tuple[float, float, float]:
    segments, body = segments_of(frame)
    bent = [one for one in curves(segments, body) if not polygon_flaw(one)]
    mouths = np.array([direction for direction, flaw in map(_opening, bent) if not flaw])
    polar = polar_order(mouths) if len(mouths) else PolarOrder(vector=np.full(3, np.nan), order=math.nan)
    return segment_order(segments, body).order, polar.order, float(polar.vector[2])


MEASURES = (
    FrameMeasure(
        name="nematic order",
        place=46,
        quantities=(
            Quantity("nematic order", "-"),
            Quantity("director from vertical", "degree"),
            Quantity("upright order", "-"),
        ),
        take=_nematic_of,
        available_for=in_space,
    ),
    FrameMeasure(
        name="orientation",
        place=46,
        quantities=(
            Quantity("nematic order of all links", "-"),
            Quantity("polar order of mouths", "-"),
            Quantity("mouths upwards", "-"),
        ),
        take=_orientation_of,
        available_for=any_in_space,
        on_request=True,
    ),
)
