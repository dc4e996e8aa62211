#!/usr/bin/env bash
# VTK 9.7.2: a legacy file that was cut off is read without an error code, with points for the bytes that are missing.
#
# A program that checks GetErrorCode() after Update() sees 0 for a legacy (.vtk) file that lacks half of its binary
# points, and a mesh of the stated number of points. The reader reports the fault to VTK's output window alone: even
# observers of ErrorEvent and WarningEvent on the reader see nothing. A cut XML file (.vtp) has the error code 0, too,
# but raises ErrorEvent and gives an empty mesh. Whoever reads legacy files must watch the output window.
#
# Seen on 2026-11-28:
#   cut legacy file: error code 0, events of the reader [], points 100, output window: Error reading binary data!
#   cut XML file: error code 0, events of the reader ['ErrorEvent'], points 0, output window: (none)
set -euo pipefail
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
python3 -m venv "$scratch/venv"
"$scratch/venv/bin/python" -m pip -qq --disable-pip-version-check install vtk==9.7.2 numpy==2.4.6
cd "$scratch"
venv/bin/python - 2>/dev/null <<'PYTHON' | tee said
from pathlib import Path

import vtk
from vtk.util.numpy_support import numpy_to_vtk
import numpy as np

points = vtk.vtkPoints()
points.SetData(numpy_to_vtk(np.arange(300.0).reshape(100, 3), deep=True))
mesh = vtk.vtkPolyData()
mesh.SetPoints(points)

KINDS = {
    "legacy": (vtk.vtkPolyDataWriter, vtk.vtkPolyDataReader, "a.vtk"),
    "XML": (vtk.vtkXMLPolyDataWriter, vtk.vtkXMLPolyDataReader, "a.vtp"),
}
for kind, (writer_type, reader_type, name) in KINDS.items():
    writer = writer_type()
    writer.SetFileName(name)
    writer.SetInputData(mesh)
    if kind == "legacy":
        writer.SetFileTypeToBinary()
    writer.Write()
    data = Path(name).read_bytes()
    Path(name).write_bytes(data[: len(data) // 2])
    events = []
    reader = reader_type()
    for event in ("ErrorEvent", "WarningEvent"):
        reader.AddObserver(event, lambda _, name: events.append(name))
    window = vtk.vtkStringOutputWindow()
    vtk.vtkOutputWindow.SetInstance(window)
    reader.SetFileName(name)
    reader.Update()
    shown = "Error reading binary data!" if "Error reading binary data!" in window.GetOutput() else "(none)"
    count = reader.GetOutput().GetNumberOfPoints()
    print(
        f"cut {kind} file: error code {reader.GetErrorCode()}, events of the reader {sorted(set(events))}, "
        f"points {count}, output window: {shown}"
    )
PYTHON
grep -qF "cut legacy file: error code 0, events of the reader [], points 100, output window: Error reading" said
grep -qF "cut XML file: error code 0, events of the reader ['ErrorEvent'], points 0" said
echo "as described"
