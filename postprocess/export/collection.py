"""A run for ParaView: a folder with a collection in time of each kind of body, and the script that shows them."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pyvista as pv
from vtkmodules.vtkCommonCore import vtkStringArray

from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.bodies.meshes import Bodies

SCRIPT = "show_in_paraview.py"
"""Name of the script beside the collections."""


def write_collection(folder: Path, bodies: Bodies, frames: Iterable[tuple[int, Frame]]) -> int:
    """Write `smarticles.pvd`, which lists `smarticles/smarticles_000000.vtp` and so on, likewise of each kind.

    A kind has a file for every frame, without a point where there is none of it: ParaView would show the one before, a
    wall that is gone or the forces of a moment ago.

    Args:
        folder: To write into; it exists.
        bodies: Of the run.
        frames: With their numbers.

    Returns:
        How many kinds there are.
    """
    written: list[tuple[int, float, int]] = []  # number, time, phase
    nothing: dict[str, pv.PolyData] = {}  # of each kind that there was: what stands where there is none
    for number, frame in frames:
        found = bodies.at(frame)
        for kind, mesh in found.items():
            if kind not in nothing:
                (folder / kind).mkdir()
                nothing[kind] = _without_points(mesh)
                for before in written:
                    _write(folder, kind, nothing[kind], before, bodies.run)
        written.append((number, frame.time, frame.phase))
        for kind, none in nothing.items():
            _write(folder, kind, found.get(kind, none), written[-1], bodies.run)
    for kind in nothing:
        root = ET.Element("VTKFile", type="Collection", version="0.1", byte_order="LittleEndian")
        parent = ET.SubElement(root, "Collection")
        for number, time, _ in written:
            place = _file(kind, number)
            ET.SubElement(parent, "DataSet", timestep=f"{time:.9g}", group="", part="0", file=place)
        tree = ET.ElementTree(root)
        ET.indent(tree)
        tree.write(folder / f"{kind}.pvd", encoding="utf-8", xml_declaration=True)
    shutil.copyfile(Path(__file__).with_name(SCRIPT), folder / SCRIPT)
    return len(nothing)


def _write(folder: Path, kind: str, mesh: pv.PolyData, frame: tuple[int, float, int], run: Run) -> None:
    number, time, phase = frame
    # The name by which VTK's readers know the time.
    mesh.field_data["TimeValue"] = np.array([time])
    mesh.field_data["phase"] = np.array([phase])
    mesh.field_data["middle_length_m"] = np.array([run.manifest.middle_length_m])
    mesh.field_data["thickness_m"] = np.array([min(run.manifest.thickness_in_plane_m, run.manifest.thickness_normal_m)])
    for name, value in (("run_name", run.manifest.name), ("scene_sha256", run.manifest.scene_sha256)):
        # PyVista takes no alphabet but the Latin one without accents.
        text = vtkStringArray()
        text.SetName(name)
        text.InsertNextValue(value)
        mesh.GetFieldData().AddArray(text)
    mesh.save(folder / _file(kind, number))


def _file(kind: str, number: int) -> str:
    return f"{kind}/{kind}_{number:06d}.vtp"


def _without_points(mesh: pv.PolyData) -> pv.PolyData:
    """Return nothing, with the fields of a mesh: what reads or filters them finds them at all times."""
    empty = pv.PolyData()
    empty.GetPointData().CopyStructure(mesh.GetPointData())
    empty.GetCellData().CopyStructure(mesh.GetCellData())
    return empty
