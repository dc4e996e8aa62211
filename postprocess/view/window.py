"""What the page draws: bodies of one frame as VTK's actors, whose geometry is sent to it; nothing is drawn here."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pyvista as pv
from matplotlib.colors import to_rgb
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow

from dem.record.run import Run
from postprocess.export.bodies import solid
from postprocess.export.colours import PAINTS
from postprocess.pictures.camera import FIELD_OF_VIEW, MILLIMETRE

if TYPE_CHECKING:
    from numpy.typing import NDArray

BOX_POINTS, BOX_FACES = 8, 6


class Window:
    """Actors by kind in one VTK window.

    Args:
        run: The run.
    """

    def __init__(self, run: Run) -> None:
        self._run = run
        self.vtk = vtkRenderWindow()
        self._renderer = vtkRenderer()
        self._renderer.SetBackground(1.0, 1.0, 1.0)
        self.vtk.AddRenderer(self._renderer)
        self._mappers: dict[str, vtkPolyDataMapper] = {}
        self._actors: dict[str, vtkActor] = {}
        for kind in PAINTS:
            mapper, actor = vtkPolyDataMapper(), vtkActor()
            mapper.SetInputData(pv.PolyData())
            actor.SetMapper(mapper)
            paint = PAINTS[kind]
            look = actor.GetProperty()
            look.SetColor(*to_rgb(paint.colour))
            look.SetOpacity(paint.opacity)
            look.SetInterpolationToFlat()
            # Light comes from the camera; a floor that it grazes would be black.
            look.SetAmbient(0.6 if kind == "floor" else 0.25)
            look.SetDiffuse(0.4 if kind == "floor" else 0.8)
            actor.SetVisibility(False)
            self._renderer.AddActor(actor)
            self._mappers[kind], self._actors[kind] = mapper, actor

    def show(self, bodies: dict[str, pv.PolyData], colours: NDArray[np.uint8], floor_z: float) -> None:
        """Put bodies where they are.

        Args:
            bodies: By kind [m].
            colours: (boxes, 3) of the smarticles, 0 to 255.
            floor_z: Height of the floor [m], which stays where it is in the picture.
        """
        for kind, actor in self._actors.items():
            mesh = bodies.get(kind)
            actor.SetVisibility(mesh is not None)
            if mesh is None:
                continue
            shape = pv.PolyData(solid(kind, mesh, self._run), deep=True)
            shape.clear_data()
            # In mm: tolerances of the page's camera do not suit scenes of centimetres in m.
            shape.points = np.asarray((shape.points - [0.0, 0.0, floor_z]) * MILLIMETRE, dtype=np.float32)
            if kind == "smarticles":
                shape.point_data["colour"] = np.repeat(colours, BOX_POINTS, axis=0)
                shape.set_active_scalars("colour")
            self._mappers[kind].SetInputData(shape)
            self._mappers[kind].SetScalarVisibility(kind == "smarticles")
            self._mappers[kind].SetScalarModeToUsePointFieldData()
            self._mappers[kind].SelectColorArray("colour")

    def mesh(self, kind: str) -> pv.PolyData:
        """What is drawn of a kind of body [mm]."""
        mesh: pv.PolyData = pv.wrap(self._mappers[kind].GetInput())
        return mesh

    def look_from(self, direction: tuple[float, float, float], up: tuple[float, float, float]) -> None:
        """Turn the camera to everything there is."""
        camera = self._renderer.GetActiveCamera()
        camera.SetViewAngle(FIELD_OF_VIEW)
        camera.SetFocalPoint(0.0, 0.0, 0.0)
        camera.SetPosition(*direction)
        camera.SetViewUp(*up)
        self._renderer.ResetCamera()

    def picked(self, ray: NDArray[np.float64]) -> int | None:
        """Number of the box that a ray (2, 3) [mm] meets first; None if it meets none."""
        mesh = self.mesh("smarticles")
        if not mesh.n_points:
            return None
        _, faces = mesh.ray_trace(ray[0], ray[1], first_point=True)
        return int(np.atleast_1d(faces)[0]) // (2 * BOX_FACES) if np.size(faces) else None
