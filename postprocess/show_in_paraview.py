"""Show an exported run in ParaView: bodies coloured by crossings, entries or contacts, and the wall cut open.

    paraview --script=show_in_paraview.py                     in ParaView's window; then press play
    pvpython show_in_paraview.py FOLDER --picture last.png    a picture of the last frame, without a window
    pvpython show_in_paraview.py FOLDER --film pictures       one picture per frame in a new folder

FOLDER is the folder that `smarticles export --to vtp` wrote; by default the folder of this script. As a macro (Macros,
Import new macro) the script shows the folder of the open .pvd file. It needs ParaView 5.11 or later, and no module of
smarticles.
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
except ImportError:  # a Python without ParaView imports this module, too
    simple = None

COLOURS = {
    "wall": "#9db4c8",
    "floor": "#e9e9e7",
    "hooks": "#b3261e",
    "plate": "#6d7f91",
    "strings": "#5b4636",
    "crossings": "#1a1a1a",
    "forces": "#a11a2e",
}
SIZE = [1000, 800]  # of pictures [pixel]
NUMBER = "smarticle_id"  #: Field that colours planar runs
KINDS = ("smarticles", "wall", "floor", "hooks", "plate", "strings", "crossings", "forces")


def rgb(colour: str) -> list[float]:
    """Return red, green and blue of a hexadecimal colour, from 0 to 1."""
    return [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]


def folder_of_export(given: str | None) -> Path:
    """Return the given folder, else the folder of the open .pvd file, else the folder of this script."""
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
    """Show all kinds of bodies from their files `KIND.pvd` in a folder.

    Returns ParaView's view and its animation scene.
    """
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
    aim(view, sources["smarticles"])
    return view, scene


def plain(kind: str, source: Any, view: Any) -> Any:
    """Show a kind of body in its colour, and return ParaView's display properties."""
    shown = simple.Show(source, view)
    shown.ColorArrayName = ["POINTS", ""]
    shown.DiffuseColor = shown.AmbientColor = rgb(COLOURS[kind])
    return shown


def times(source: Any) -> list[float]:
    """Return the times [s] at which the bodies of a `.pvd` reader are recorded, the last one first."""
    # ParaView gives a single time as a number, not as a list.
    found = source.TimestepValues
    return [found] if isinstance(found, float) else list(found)[::-1]


def data_at(source: Any, time: float) -> Any:
    """Return the data of a `.pvd` reader at a time [s].

    ParaView's own summaries of data may be those of another time.
    """
    source.UpdatePipeline(time)
    found = simple.servermanager.Fetch(source)
    return found.GetBlock(0) if found.IsA("vtkMultiBlockDataSet") else found


def size(source: Any, name: str) -> float:
    """Return a length of the smarticles [m] by its name in the field data."""
    return float(data_at(source, times(source)[0]).GetFieldData().GetArray(name).GetValue(0))


def largest_at(source: Any, time: float, name: str) -> float:
    """Return the largest value of a cell field at a time [s]; 0 if there is no value."""
    values = data_at(source, time).GetCellData().GetArray(name)
    return float(values.GetRange()[1]) if values is not None and values.GetNumberOfTuples() else 0.0


def boxes(_kind: str, source: Any, view: Any) -> None:
    """Colour bodies by `colouring` on one scale for all times."""
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
    shown.SetScalarBarVisibility(view, name != NUMBER)


def colouring(source: Any) -> str:
    """Return the name of the field that colours bodies: as in pictures of `smarticles render`."""
    source.UpdatePipeline()
    fields = source.CellData
    if fields.GetArray("crossings") is None:  # the run is planar
        return NUMBER
    entry = fields.GetArray("entry")
    if entry is None:
        return "crossings"
    return "entry" if entry.GetRange()[1] > 0 else "contacts"


def wall(kind: str, source: Any, view: Any) -> None:
    """Show the half of a round wall behind the pile, or all of the walls of a channel."""
    # A removed wall has no points at the last time; load the last time at which it has.
    next(time for time in times(source) if data_at(source, time).GetNumberOfPoints())
    low_x, high_x, low_y, high_y = source.GetDataInformation().GetBounds()[:4]
    if abs((high_x - low_x) - (high_y - low_y)) > 0.01 * (high_x - low_x):
        plain(kind, source, view)
        return
    half = simple.Clip(registrationName="wall, cut open", Input=source, ClipType="Plane")
    half.ClipType.Origin = [0.0, 0.0, 0.0]
    half.ClipType.Normal = [0.0, -1.0, 0.0]
    simple.Hide(source, view)
    plain(kind, half, view).Opacity = 0.3


def plate(kind: str, source: Any, view: Any) -> None:
    """Show the plate, through which bodies are visible."""
    plain(kind, source, view).Opacity = 0.35


def strings(kind: str, source: Any, view: Any) -> None:
    """Show strings as thick lines."""
    plain(kind, source, view).LineWidth = 3.0


def arrows(kind: str, source: Any, view: Any) -> None:
    """Show one arrow per crossing."""
    glyph = simple.Glyph(registrationName="arrows", Input=source, GlyphType="Arrow")
    glyph.OrientationArray = ["POINTS", "direction"]
    glyph.ScaleArray = ["POINTS", "No scale array"]
    glyph.ScaleFactor = size(source, "middle_length_m") / 3
    glyph.GlyphMode = "All Points"
    plain(kind, glyph, view)


def forces(kind: str, source: Any, view: Any) -> None:
    """Show forces as lines that are darker for a larger normal force, on one scale for all times.

    Tubes with the force as radius are no alternative: ParaView 5.11 loses the name of the field at a time without
    force.
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
    "plate": plate,
    "strings": strings,
    "crossings": arrows,
    "forces": forces,
}


def aim(view: Any, source: Any) -> None:
    """Point the camera at the smarticles from the front, slightly from above; at a planar run from above."""
    low_x, high_x, low_y, high_y, low_z, high_z = source.GetDataInformation().GetBounds()
    focus = [(low_x + high_x) / 2, (low_y + high_y) / 2, (low_z + high_z) / 2]
    flat = colouring(source) == NUMBER
    direction, view.CameraViewUp = ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0]) if flat else ([0.0, -1.0, 0.35], [0.0, 0.0, 1.0])
    view.CameraFocalPoint = focus
    view.CameraPosition = [f + d for f, d in zip(focus, direction, strict=True)]
    view.ResetCamera(False)


def main() -> None:
    """Run the script with the arguments of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?")
    parser.add_argument("--picture", metavar="FILE.png")
    parser.add_argument("--film", metavar="FOLDER")
    arguments = parser.parse_known_args()[0]
    view, scene = show(folder_of_export(arguments.folder))
    simple.Render(view)
    if arguments.picture:
        simple.SaveScreenshot(arguments.picture, view, ImageResolution=SIZE)
    if arguments.film:
        Path(arguments.film).mkdir()
        simple.SaveAnimation(str(Path(arguments.film) / "frame.png"), view, scene=scene, ImageResolution=SIZE)


if __name__ == "__main__":
    main()
