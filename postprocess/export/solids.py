"""Bodies as files of triangles: STL, OBJ with colours, glTF with colours, fields and materials."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import trimesh
from trimesh.exchange import gltf, obj, stl

from postprocess.export.colours import PAINTS, linear

if TYPE_CHECKING:
    from numpy.typing import NDArray

SUFFIXES = ("stl", "obj", "gltf", "glb")

_GLTF, _OBJ, _STL = (cast("Any", module) for module in (gltf, obj, stl))  # typed in part only

_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # rows: x, y, z of glTF in ours


@dataclass(frozen=True, kw_only=True, eq=False)
class Solid:
    """One kind of body, in metres, z upwards.

    Attributes:
        kind: Its name, a key of `postprocess.export.bodies.KINDS`.
        points: (n, 3) [m].
        triangles: (m, 3) numbers of points, counter-clockwise seen from outside.
        colours: (n, 3) sRGB, 0 to 255.
        attributes: (n,) values of fields, for glTF.
    """

    kind: str
    points: NDArray[np.float64] = field(repr=False)
    triangles: NDArray[np.int64] = field(repr=False)
    colours: NDArray[np.uint8] = field(repr=False)
    attributes: Mapping[str, NDArray[Any]] = field(default_factory=dict, repr=False)


def solids_file(solids: list[Solid], suffix: str, told: Mapping[str, Any]) -> bytes:
    """The content of a file.

    Args:
        solids: What to write, one object of the file each; an STL has one object for all.
        suffix: One of `SUFFIXES`.
        told: What a glTF is to tell of itself: plain data.
    """
    scene = trimesh.Scene()
    for solid in solids:
        scene.add_geometry(_mesh(solid, y_up=suffix in {"gltf", "glb"}), node_name=solid.kind, geom_name=solid.kind)
    if suffix == "stl":
        content: bytes = _STL.export_stl(scene.to_mesh())
        return content
    if suffix == "obj":
        text: str = _OBJ.export_obj(scene, include_normals=False, header="metres, z upwards")
        return text.encode("utf-8")

    def finish(tree: dict[str, Any]) -> None:
        _add_materials(tree)
        tree["asset"]["extras"] = dict(told)

    if suffix == "glb":
        return bytes(_GLTF.export_glb(scene, include_normals=False, tree_postprocessor=finish))
    files = _GLTF.export_gltf(
        scene, include_normals=False, merge_buffers=True, embed_buffers=True, tree_postprocessor=finish
    )
    return bytes(files["model.gltf"])


def _mesh(solid: Solid, *, y_up: bool) -> trimesh.Trimesh:
    points = solid.points @ _Y_UP.T if y_up else solid.points
    colours = linear(solid.colours) if y_up else solid.colours
    opaque = np.full((len(colours), 1), 255, dtype=np.uint8)
    mesh = trimesh.Trimesh(points, solid.triangles, vertex_colors=np.hstack([colours, opaque]), process=False)
    if y_up:
        # Names of own attributes begin with an underscore, and whole numbers of four bytes are not allowed.
        mesh.vertex_attributes |= {
            f"_{name.upper()}": np.asarray(values, dtype=np.float32) for name, values in solid.attributes.items()
        }
    return mesh


def _add_materials(tree: dict[str, Any]) -> None:
    """Dull surfaces: what a file without materials says is mirror-like metal."""
    tree["materials"] = []
    for mesh in tree["meshes"]:
        paint = PAINTS[mesh["name"]]
        see_through = {"alphaMode": "BLEND"} if paint.opacity < 1 else {}
        material = {
            "name": mesh["name"],
            "doubleSided": True,
            "pbrMetallicRoughness": {
                "baseColorFactor": [1.0, 1.0, 1.0, paint.opacity],
                "metallicFactor": 0.0,
                "roughnessFactor": 0.7,
            },
            **see_through,
        }
        for primitive in mesh["primitives"]:
            primitive["material"] = len(tree["materials"])
        tree["materials"].append(material)
