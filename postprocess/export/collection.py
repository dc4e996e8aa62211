"""A run for ParaView: a folder with a collection in time of each kind of body, and the script that shows them."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pyvista as pv
from vtkmodules.vtkCommonCore import vtkStringArray

from dem.record.frame import Frame
from dem.record.manifest import RunManifest

SCRIPT = "show_in_paraview.py"
"""Name of the script beside the collections."""


class Collection:
    """Files of one export: `smarticles.pvd` lists `smarticles/smarticles_000000.vtp` and so on, likewise of each kind.

    Args:
        folder: To write into; it exists.
        run: Whose frames they are.
    """

    def __init__(self, folder: Path, run: RunManifest) -> None:
        self._folder = folder
        self._run = run
        self._listed: dict[str, list[tuple[float, str]]] = {}

    def add(self, number: int, frame: Frame, bodies: Mapping[str, pv.PolyData]) -> None:
        """Write the bodies of a frame."""
        for kind, mesh in bodies.items():
            name = f"{kind}/{kind}_{number:06d}.vtp"
            (self._folder / kind).mkdir(exist_ok=True)
            # The name by which VTK's readers know the time.
            mesh.field_data["TimeValue"] = np.array([frame.time])
            mesh.field_data["phase"] = np.array([frame.phase])
            mesh.GetFieldData().AddArray(_text("run_name", self._run.name))
            mesh.GetFieldData().AddArray(_text("scene_sha256", self._run.scene_sha256))
            mesh.save(self._folder / name)
            self._listed.setdefault(kind, []).append((frame.time, name))

    def close(self) -> None:
        """Write what lists the files, and the script."""
        for kind, entries in self._listed.items():
            root = ET.Element("VTKFile", type="Collection", version="0.1", byte_order="LittleEndian")
            parent = ET.SubElement(root, "Collection")
            for time, name in entries:
                ET.SubElement(parent, "DataSet", timestep=f"{time:.9g}", group="", part="0", file=name)
            tree = ET.ElementTree(root)
            ET.indent(tree)
            tree.write(self._folder / f"{kind}.pvd", encoding="utf-8", xml_declaration=True)
        shutil.copyfile(Path(__file__).with_name(SCRIPT), self._folder / SCRIPT)


def _text(name: str, value: str) -> vtkStringArray:
    """A text of any alphabet; PyVista takes none but the Latin one without accents."""
    array = vtkStringArray()
    array.SetName(name)
    array.InsertNextValue(value)
    return array
