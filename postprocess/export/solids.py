"""Bodies as files of triangles: STL, OBJ with colours, glTF with colours, fields and materials."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyvista as pv
import trimesh
from numpy.typing import NDArray

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.frames import FrameSequence
from postprocess.bodies.colours import PAINTS, ColourScale, colour_field, linear, scalars, span
from postprocess.bodies.meshes import BOX_FACES, BOX_POINTS, Bodies, owners, solid

SUFFIXES = ("stl", "obj", "gltf", "glb")

_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # rows: x, y, z of glTF in ours


class Painter:
    """Colours smarticles by a field, on one scale for all frames, and writes the files.

    Args:
        bodies: Of the run.
        color_by: Name of a field; None: crossings, in a plane smarticle_id.
        frames: All of the run.
        chosen: Of those that are exported.

    Raises:
        InputError: There is no field of this name, or no value of it.
    """

    def __init__(self, bodies: Bodies, color_by: str | None, frames: FrameSequence, chosen: Sequence[int]) -> None:
        self._bodies = bodies
        self._field = colour_field(color_by, bodies.run)
        values = [scalars(self._field, frames[index], bodies.run) for index in chosen]
        if not any(np.isfinite(each).any() for each in values):
            msg = f"--color-by {self._field.name}: no frame to export has it; choose another field"
            raise InputError(msg)
        self._bounds = span(values)
        self._scale = ColourScale.of(self._field, self._bounds)

    def content(self, frame: Frame, suffix: str) -> bytes | None:
        """Return the content of a file of a frame; None where there is none of the bodies.

        Args:
            suffix: One of `SUFFIXES`; an STL has one object for all bodies, others one for each kind.
        """
        scene: Any = trimesh.Scene()
        for kind, mesh in self._bodies.at(frame).items():
            shape = self._mesh(kind, mesh, frame, y_up=suffix in {"gltf", "glb"})
            scene.add_geometry(shape, node_name=kind, geom_name=kind)
        if not scene.geometry:
            return None
        if suffix == "stl":
            return _bytes(scene.to_mesh().export(file_type="stl"))
        if suffix == "obj":
            return _bytes(scene.export(file_type="obj", include_normals=False, header="metres, z upwards"))

        def finish(tree: dict[str, Any]) -> None:
            _add_materials(tree)
            tree["asset"]["extras"] = self._provenance(frame)

        if suffix == "glb":
            return _bytes(scene.export(file_type="glb", include_normals=False, tree_postprocessor=finish))
        files: Any = scene.export(
            file_type="gltf", include_normals=False, merge_buffers=True, embed_buffers=True, tree_postprocessor=finish
        )
        return _bytes(files["model.gltf"])

    def _provenance(self, frame: Frame) -> dict[str, Any]:
        run = self._bodies.run
        return {
            "run_name": run.manifest.name,
            "scene_sha256": run.manifest.scene_sha256,
            "time_s": frame.time,
            "unit": "m",
            "coloured_by": self._field.name,
            "least": self._bounds[0],
            "greatest": self._bounds[1],
        }

    def _mesh(self, kind: str, mesh: pv.PolyData, frame: Frame, *, y_up: bool) -> trimesh.Trimesh:
        run = self._bodies.run
        triangles = solid(kind, mesh, run)
        points = np.asarray(triangles.points, dtype=np.float64)
        colours = np.tile(PAINTS[kind].rgb, (len(points), 1))
        fields: dict[str, NDArray[Any]] = {}
        if kind == "smarticles":
            # Every box has its own points, in the order of the boxes, and so have its faces.
            found = self._scale.painted(scalars(self._field, frame, run)[owners(mesh, frame)])
            colours = np.repeat(found, BOX_POINTS, axis=0)
            for name, values in mesh.cell_data.items():
                if values.ndim == 1 and np.isfinite(values).all():
                    fields[name] = np.repeat(np.asarray(values)[::BOX_FACES], BOX_POINTS, axis=0)
        colours = linear(colours) if y_up else colours
        opaque = np.full((len(colours), 1), 255, dtype=np.uint8)
        shape = trimesh.Trimesh(
            points @ _Y_UP.T if y_up else points,
            triangles.regular_faces.astype(np.int64),
            vertex_colors=np.hstack([colours, opaque]),
            process=False,
        )
        if y_up:
            # Names of own attributes begin with an underscore, and whole numbers of four bytes are not allowed.
            shape.vertex_attributes |= {f"_{name.upper()}": one.astype(np.float32) for name, one in fields.items()}
        return shape


def _bytes(content: Any) -> bytes:
    return content.encode("utf-8") if isinstance(content, str) else bytes(content)


def _add_materials(tree: dict[str, Any]) -> None:
    """Make surfaces dull: what a file without materials says is mirror-like metal."""
    tree["materials"] = []
    for mesh in tree["meshes"]:
        paint = PAINTS[mesh["name"]]
        material: dict[str, Any] = {
            "name": mesh["name"],
            "doubleSided": True,
            "pbrMetallicRoughness": {
                "baseColorFactor": [1.0, 1.0, 1.0, paint.opacity],
                "metallicFactor": 0.0,
                "roughnessFactor": 0.7,
            },
        }
        if paint.opacity < 1:
            material["alphaMode"] = "BLEND"
        for primitive in mesh["primitives"]:
            primitive["material"] = len(tree["materials"])
        tree["materials"].append(material)
