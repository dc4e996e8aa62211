"""Forces at contacts as lines from centre to centre, and as tubes that are as thick as the forces are large."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pyvista as pv

from dem.record.forces import RecordedForces

if TYPE_CHECKING:
    from numpy.typing import NDArray

_THINNEST = 0.05  # of the thickest tube
_SIDES = 8


def force_lines(forces: RecordedForces) -> pv.PolyData:
    """Lines from centres of mass to the contacts [m]: two for each contact, and one where a fixture is touched.

    Straight lines, each with two points of its own: a tube about a line that bends at a sharp angle is torn. Cell data
    `contact`, the place of the contact.
    """
    halves = [np.stack([forces.ends[:, k], forces.contacts.points], axis=1) for k in (0, 1)]
    segments = np.concatenate([halves[0], halves[1][forces.between]])
    numbers = np.arange(len(forces.ends))
    lines = np.column_stack([np.full(len(segments), 2), np.arange(2 * len(segments)).reshape(-1, 2)])
    mesh = pv.PolyData(segments.reshape(-1, 3), lines=lines)
    mesh.cell_data["contact"] = np.concatenate([numbers, numbers[forces.between]])
    return mesh


def force_tubes(lines: pv.PolyData, normal: NDArray[np.float64], *, thickest: float, largest: float) -> pv.PolyData:
    """Lines of force as tubes whose radius is in proportion to the normal force.

    Args:
        lines: One or more.
        normal: Normal force of each [N].
        thickest: Radius of the tube of the largest force [m].
        largest: That force [N]; a larger one is as thick.

    Returns:
        The tubes [m]; no tube is thinner than a twentieth of the thickest.
    """
    bare = pv.PolyData(lines.points, lines=lines.lines)
    bare.point_data["radius"] = np.repeat(thickest * np.clip(normal / largest, _THINNEST, 1.0), 2)
    tubes: pv.PolyData = bare.tube(radius=1.0, scalars="radius", absolute=True, n_sides=_SIDES, capping=True)
    return tubes
