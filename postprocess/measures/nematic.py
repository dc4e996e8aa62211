"""Measure the alignment of smarticles: the nematic order of their middle links."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.links import Floats, UndefinedMeasureError, checked_vertices
from postprocess.measures.registry import FrameMeasure, Quantity, in_space


@dataclass(frozen=True, kw_only=True, eq=False)
class NematicOrder:
    """Nematic order of unit vectors u, which does not depend on their signs."""

    tensor: Floats = field(repr=False)  #: (3, 3) float64 [-], Q = ⟨(3 u u - 1) / 2⟩, symmetric and traceless
    #: Nematic order parameter S, the largest eigenvalue of Q [-]: 1 if all u are parallel, 1/4 if they are random in a
    #: plane, and on average about 0.8 / N^½ for N random u in space
    order: float
    director: Floats  #: (3,) eigenvector of S, a unit vector that points upwards

    @property
    def polar_angle(self) -> float:
        """Angle of the director from the vertical [rad], 0 to π/2."""
        return math.acos(min(abs(float(self.director[2])), 1.0))

    @property
    def upright(self) -> float:
        """Q_zz = ⟨(3 cos²θ - 1) / 2⟩ [-], θ from the vertical: 1 all vertical, -1/2 horizontal, 0 random."""
        return float(self.tensor[2, 2])


def nematic_order(directions: ArrayLike) -> NematicOrder:
    """Compute the nematic order of vectors (N, 3) of any length above 0.

    Raises:
        InputError: Not (N, 3) finite vectors of a length above 0.
        UndefinedMeasureError: There is no vector.

    Source:
        Eppenga & Frenkel, Mol. Phys. 52, 1303 (1984): the largest eigenvalue of Q, and its bias of order N^-½. The
        result agrees with `freud.order.Nematic` (3.4.0) to its single precision, 2e-7.

    Example:
        >>> nematic_order([[0, 0, 2.0], [0, 0, -1.0]]).order
        1.0
    """
    directions = np.asarray(directions, dtype=np.float64)
    if directions.ndim != 2 or directions.shape[1] != 3 or not np.all(np.isfinite(directions)):
        raise InputError(f"directions must be (N, 3) finite numbers: got an array of shape {directions.shape}")
    if len(directions) == 0:
        raise UndefinedMeasureError("a nematic order needs at least 1 direction: got 0")
    lengths = np.linalg.norm(directions, axis=1)
    if not np.all(lengths > 0):
        raise InputError(f"direction {int(np.argmin(lengths))} has no length; leave it out")
    unit = directions / lengths[:, None]
    tensor = 1.5 * unit.T @ unit / len(unit) - 0.5 * np.eye(3)
    values, vectors = np.linalg.eigh(tensor)
    director = vectors[:, -1]
    return NematicOrder(
        tensor=tensor, order=float(values[-1]), director=-director if director[2] < 0 else director.copy()
    )


def _nematic_of(frame: Frame, _: Run) -> tuple[float, float, float]:
    order = nematic_order(np.diff(checked_vertices(frame.vertices), axis=1)[:, 1])
    return order.order, math.degrees(order.polar_angle), order.upright


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
)
