"""Bodies made ready for files of triangles: coloured by one field on one scale over all frames."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.export.bodies import Bodies, solid
from postprocess.export.colours import colour_field, paint_of, painted, scalars, scale, span
from postprocess.export.fields import Field
from postprocess.export.solids import Solid

if TYPE_CHECKING:
    import pyvista as pv
    from numpy.typing import NDArray

_BOX_POINTS, _BOX_FACES = 8, 6


@dataclass(frozen=True)
class Painter:
    """Colours smarticles by a field.

    Args:
        run: The run.
        field: What to colour by.
        bounds: The least and the greatest value of it in all frames.
    """

    run: Run
    field: Field
    bounds: tuple[float, float]

    @classmethod
    def of(cls, run: Run, color_by: str | None, frames: Iterable[Frame]) -> Self:
        """One scale for all frames.

        Raises:
            InputError: There is no field of this name, or no value of it.
        """
        field = colour_field(color_by, run)
        values = [scalars(field, frame, run) for frame in frames]
        if not any(np.isfinite(each).any() for each in values):
            msg = f"--color-by {field.name}: no frame to export has it; choose another field"
            raise InputError(msg)
        bounds = [span(each) for each in values if np.isfinite(each).any()]
        return cls(run, field, (min(low for low, _ in bounds), max(high for _, high in bounds)))

    def told(self, frame: Frame) -> dict[str, Any]:
        """What a file tells of itself: plain data."""
        return {
            "run_name": self.run.manifest.name,
            "scene_sha256": self.run.manifest.scene_sha256,
            "time_s": frame.time,
            "unit": "m",
            "coloured_by": self.field.name,
            "least": self.bounds[0],
            "greatest": self.bounds[1],
        }

    def solids(self, bodies: Bodies, frame: Frame) -> list[Solid]:
        """The bodies of a frame, as triangles with colours."""
        return [self._solid(kind, mesh, frame) for kind, mesh in bodies.at(frame).items()]

    def _solid(self, kind: str, mesh: pv.PolyData, frame: Frame) -> Solid:
        triangles = solid(kind, mesh, self.run)
        colours = np.tile(paint_of(kind), (triangles.n_points, 1))
        attributes: dict[str, NDArray[Any]] = {}
        if kind == "smarticles":
            # Every box has its own points, in the order of the boxes, and so have its faces.
            colours = np.repeat(self._colours(frame, mesh), _BOX_POINTS, axis=0)
            attributes = {
                name: np.repeat(np.asarray(values)[::_BOX_FACES], _BOX_POINTS, axis=0)
                for name, values in mesh.cell_data.items()
                if values.ndim == 1 and np.isfinite(values).all()
            }
        return Solid(
            kind=kind,
            points=np.asarray(triangles.points, dtype=np.float64),
            triangles=triangles.regular_faces.astype(np.int64),
            colours=colours,
            attributes=attributes,
        )

    def _colours(self, frame: Frame, mesh: pv.PolyData) -> NDArray[np.uint8]:
        """(boxes, 3) sRGB."""
        values = scalars(self.field, frame, self.run)
        owner, link = (mesh.cell_data[name][::_BOX_FACES] for name in ("smarticle_id", "link"))
        order = np.argsort(frame.smarticle_ids)
        index = order[np.searchsorted(frame.smarticle_ids, owner, sorter=order)]
        return painted(scale(self.field, self.bounds), values[index, link])
