"""Show an exported run in ParaView: boxes by crossings, the wall cut open, time ready to run.

    paraview --script=show_in_paraview.py                     in its window; then press play
    pvpython show_in_paraview.py FOLDER --picture last.png    the last frame, without a window
    pvpython show_in_paraview.py FOLDER --film pictures       one picture per frame into a new folder

As a macro (Macros, Import new macro) it shows the folder of the .pvd file that is open. It needs ParaView 5.11 or later
and nothing of the simulator. FOLDER is what `smarticles export --to vtp` wrote; by default that of this script.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

try:
    simple: Any = import_module("paraview.simple")
except ImportError:  # where this script is imported, not run
    simple = None

COLOURS = {
    "wall": "#9db4c8",
    "floor": "#e9e9e7",
    "hooks": "#b3261e",
    "strings": "#5b4636",
    "crossings": "#1a1a1a",
    "forces": "#a11a2e",
}
SIZE = [1000, 800]  # pixels
KINDS = ("smarticles", "wall", "floor", "hooks", "strings", "crossings", "forces")


def rgb(colour: str) -> list[float]:
    """Return shares of red, green and blue of a hexadecimal colour."""
    return [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]


def folder_of_export(given: str | None) -> Path:
    """Find the .pvd files: as given, else of what is open, else beside this script, else here."""
    source = simple.GetActiveSource()
    places = [Path(given)] if given else []
    if source is not None and hasattr(source, "FileName"):
        places.append(Path(str(source.FileName)).parent)
    if "__file__" in globals():
        places.append(Path(__file__).resolve().parent)
    for place in (*places, Path.cwd()):
        if (place / "smarticles.pvd").is_file():
            return place
    sys.exit(f"no smarticles.pvd in {places[0]}; give the folder that `smarticles export --to vtp` wrote")


def show(folder: Path) -> tuple[Any, Any]:
    """Read every collection, and show each kind as it is."""
    simple._DisableFirstRenderCameraReset()
    view = simple.GetActiveViewOrCreate("RenderView")
    view.UseColorPaletteForBackground = 0
    view.Background = [1.0, 1.0, 1.0]
    view.OrientationAxesVisibility = 0
    view.ViewSize = SIZE
    sources = {}
    for kind in KINDS:
        path = folder / f"{kind}.pvd"
        if path.is_file():
            sources[kind] = simple.PVDReader(registrationName=kind, FileName=str(path))
    scene = simple.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    scene.GoToLast()
    for kind, source in sources.items():
        SHOWERS.get(kind, plain)(kind, source, view)
    stamp = simple.AnnotateTimeFilter(registrationName="time", Input=sources["smarticles"])
    stamp.Format = "t = {time:.3f} s"
    shown = simple.Show(stamp, view)
    shown.Color, shown.FontSize = [0.1, 0.1, 0.1], 16
    look(view, sources["smarticles"])
    return view, scene


def plain(kind: str, source: Any, view: Any) -> Any:
    """Show in one colour."""
    shown = simple.Show(source, view)
    shown.ColorArrayName = ["POINTS", ""]
    shown.DiffuseColor = shown.AmbientColor = rgb(COLOURS[kind])
    return shown


def times(source: Any) -> list[float]:
    """Return all times of a collection, the last one first; one alone is no list in ParaView."""
    found = source.TimestepValues
    return [found] if isinstance(found, float) else list(found)[::-1]


def data_at(source: Any, time: float) -> Any:
    """Fetch the data of a time itself: what ParaView reports of it may be of another time."""
    source.UpdatePipeline(time)
    found = simple.servermanager.Fetch(source)
    return found.GetBlock(0) if found.IsA("vtkMultiBlockDataSet") else found


def points_at(source: Any, time: float) -> int:
    """Read a time, and count its points."""
    return int(data_at(source, time).GetNumberOfPoints())


def size(source: Any, name: str) -> float:
    """Return a length of all smarticles [m]."""
    return float(data_at(source, times(source)[0]).GetFieldData().GetArray(name).GetValue(0))


def largest_at(source: Any, time: float, name: str) -> float:
    """Return the largest value of a field of cells at a time; 0 where there is none."""
    values = data_at(source, time).GetCellData().GetArray(name)
    return float(values.GetRange()[1]) if values is not None and values.GetNumberOfTuples() else 0.0


def boxes(_kind: str, source: Any, view: Any) -> None:
    """Colour by crossings, one scale for all times; of motion in a plane, which has none, by number."""
    shown = simple.Show(source, view)
    name = colouring(source)
    simple.ColorBy(shown, ("CELLS", name))
    lut = simple.GetColorTransferFunction(name)
    lut.ApplyPreset("Viridis (matplotlib)", True)
    shown.RescaleTransferFunctionToDataRangeOverTime()
    low, high = (int(lut.RGBPoints[k]) for k in (0, -4))
    lut.RescaleTransferFunction(low - 0.5, high + 0.5)
    lut.NumberOfTableValues = max(1, min(256, high - low + 1))
    bar = simple.GetScalarBar(lut, view)
    bar.Title, bar.ComponentTitle = name, ""
    bar.TitleColor = bar.LabelColor = [0.1, 0.1, 0.1]
    bar.WindowLocation = "Any Location"
    bar.Position, bar.ScalarBarLength = [0.88, 0.25], 0.5
    bar.UseCustomLabels, bar.AddRangeLabels = 1, 0
    bar.AutomaticLabelFormat, bar.LabelFormat = 0, "%.0f"
    bar.CustomLabels = [float(value) for value in range(low, high + 1, max(1, (high - low) // 12))]
    shown.SetScalarBarVisibility(view, name == "crossings")


def colouring(source: Any) -> str:
    """Name the field that the boxes are coloured by."""
    source.UpdatePipeline()
    return "crossings" if source.CellData.GetArray("crossings") is not None else "smarticle_id"


def wall(kind: str, source: Any, view: Any) -> None:
    """Show the half behind the pile, seen from the front; of a plane all of it."""
    # One that was taken away is none at the end.
    next(time for time in times(source) if points_at(source, time))
    low_x, high_x, low_y, high_y = source.GetDataInformation().GetBounds()[:4]
    if abs((high_x - low_x) - (high_y - low_y)) > 0.01 * (high_x - low_x):
        plain(kind, source, view)
        return
    half = simple.Clip(registrationName="wall, cut open", Input=source, ClipType="Plane")
    half.ClipType.Origin = [0.0, 0.0, 0.0]
    half.ClipType.Normal = [0.0, -1.0, 0.0]
    simple.Hide(source, view)
    plain(kind, half, view).Opacity = 0.3


def strings(kind: str, source: Any, view: Any) -> None:
    """Show as thin tubes."""
    plain(kind, source, view).LineWidth = 3.0


def arrows(kind: str, source: Any, view: Any) -> None:
    """Show one arrow per passage."""
    glyph = simple.Glyph(registrationName="passages", Input=source, GlyphType="Arrow")
    glyph.OrientationArray = ["POINTS", "direction"]
    glyph.ScaleArray = ["POINTS", "No scale array"]
    glyph.ScaleFactor = size(source, "middle_length_m") / 3
    glyph.GlyphMode = "All Points"
    plain(kind, glyph, view)


def forces(kind: str, source: Any, view: Any) -> None:
    """Show lines through the smarticles, the darker the larger the normal force, one scale for all times.

    Not tubes whose radius is the force: ParaView 5.11 forgets which field that is where a time has no force.
    """
    name = "normal_force_N"
    largest = max(largest_at(source, time, name) for time in times(source))
    shown = simple.Show(source, view)
    simple.ColorBy(shown, ("CELLS", name))
    lut = simple.GetColorTransferFunction(name)
    red, green, blue = rgb(COLOURS[kind])
    lut.ColorSpace = "RGB"
    lut.RGBPoints = [0.0, 1.0, 0.9, 0.87, largest or 1.0, red, green, blue]
    shown.LineWidth, shown.RenderLinesAsTubes = 4.0, 1
    shown.SetScalarBarVisibility(view, False)
    simple.GetDisplayProperties(simple.FindSource("smarticles"), view).Opacity = 0.25


SHOWERS: dict[str, Callable[[str, Any, Any], Any]] = {
    "smarticles": boxes,
    "wall": wall,
    "strings": strings,
    "crossings": arrows,
    "forces": forces,
}


def look(view: Any, source: Any) -> None:
    """Look from the front, a little from above; at a chain in a plane from above."""
    low_x, high_x, low_y, high_y, low_z, high_z = source.GetDataInformation().GetBounds()
    focus = [(low_x + high_x) / 2, (low_y + high_y) / 2, (low_z + high_z) / 2]
    flat = colouring(source) != "crossings"
    direction, view.CameraViewUp = ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0]) if flat else ([0.0, -1.0, 0.35], [0.0, 0.0, 1.0])
    view.CameraFocalPoint = focus
    view.CameraPosition = [f + d for f, d in zip(focus, direction, strict=True)]
    view.ResetCamera(False)


def main() -> None:
    """Do what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?")
    parser.add_argument("--picture", metavar="FILE.png")
    parser.add_argument("--film", metavar="FOLDER")
    words = parser.parse_known_args()[0]
    view, scene = show(folder_of_export(words.folder))
    simple.Render(view)
    if words.picture:
        simple.SaveScreenshot(words.picture, view, ImageResolution=SIZE)
    if words.film:
        Path(words.film).mkdir()
        simple.SaveAnimation(str(Path(words.film) / "frame.png"), view, scene=scene, ImageResolution=SIZE)


if __name__ == "__main__":
    main()
