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
from dem.record.run import Run

SCRIPT = "show_in_paraview.py"
"""Name of the script beside the collections."""


class Collection:
    """Files of one export: `smarticles.pvd` lists `smarticles/smarticles_000000.vtp` and so on, likewise of each kind.

    A kind has a file for every frame, without a point where there is none of it: ParaView would show the one before, a
    wall that is gone or the forces of a moment ago.

    Args:
        folder: To write into; it exists.
        run: Whose frames they are.
    """

    def __init__(self, folder: Path, run: Run) -> None:
        self._folder = folder
        self._run = run
        self._frames: list[tuple[int, float, int]] = []  # number, time, phase
        self._without: dict[str, pv.PolyData] = {}  # of each kind that there was: what stands where there is none

    @property
    def kinds(self) -> tuple[str, ...]:
        """Of what there was any so far."""
        return tuple(self._without)

    def add(self, number: int, frame: Frame, bodies: Mapping[str, pv.PolyData]) -> None:
        """Write the bodies of a frame."""
        for kind, mesh in bodies.items():
            if kind not in self._without:
                (self._folder / kind).mkdir()
                self._without[kind] = _without_points(mesh)
                for before in self._frames:
                    self._write(kind, self._without[kind], before)
        self._frames.append((number, frame.time, frame.phase))
        for kind, none in self._without.items():
            self._write(kind, bodies.get(kind, none), self._frames[-1])

    def _write(self, kind: str, mesh: pv.PolyData, frame: tuple[int, float, int]) -> None:
        number, time, phase = frame
        run = self._run
        # The name by which VTK's readers know the time.
        mesh.field_data["TimeValue"] = np.array([time])
        mesh.field_data["phase"] = np.array([phase])
        mesh.field_data["middle_length_m"] = np.array([run.manifest.middle_length_m])
        mesh.field_data["thickness_m"] = np.array(
            [min(run.manifest.thickness_in_plane_m, run.manifest.thickness_normal_m)]
        )
        mesh.GetFieldData().AddArray(_text("run_name", run.manifest.name))
        mesh.GetFieldData().AddArray(_text("scene_sha256", run.manifest.scene_sha256))
        mesh.save(self._folder / _file(kind, number))

    def close(self) -> None:
        """Write what lists the files, and the script."""
        for kind in self._without:
            root = ET.Element("VTKFile", type="Collection", version="0.1", byte_order="LittleEndian")
            parent = ET.SubElement(root, "Collection")
            for number, time, _ in self._frames:
                place = _file(kind, number)
                ET.SubElement(parent, "DataSet", timestep=f"{time:.9g}", group="", part="0", file=place)
            tree = ET.ElementTree(root)
            ET.indent(tree)
            tree.write(self._folder / f"{kind}.pvd", encoding="utf-8", xml_declaration=True)
        shutil.copyfile(Path(__file__).with_name(SCRIPT), self._folder / SCRIPT)


def _file(kind: str, number: int) -> str:
    """Where the bodies of one kind are, of the frame of this number."""
    return f"{kind}/{kind}_{number:06d}.vtp"


def _without_points(mesh: pv.PolyData) -> pv.PolyData:
    """Nothing, with the fields of this mesh: what reads or filters them finds them at all times."""
    empty = pv.PolyData()
    empty.GetPointData().CopyStructure(mesh.GetPointData())
    empty.GetCellData().CopyStructure(mesh.GetCellData())
    return empty


def _text(name: str, value: str) -> vtkStringArray:
    """A text of any alphabet; PyVista takes none but the Latin one without accents."""
    array = vtkStringArray()
    array.SetName(name)
    array.InsertNextValue(value)
    return array
