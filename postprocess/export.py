"""Export a run for other programs: VTP for ParaView, GSD for OVITO, triangles as STL, OBJ or glTF."""

import os
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pyvista as pv
import trimesh
from vtkmodules.vtkCommonCore import vtkPoints, vtkStringArray

from dem.errors import InputError, RunError, nearest
from dem.record.frame import Frame
from dem.record.frames import read_frames
from dem.record.run import Run, open_run
from postprocess.bodies.colours import PAINTS, ColourScale, colour_field, linear, scalars, span
from postprocess.bodies.fields import IDENTITY, fields_of
from postprocess.bodies.meshes import Bodies, at_points, checked_kinds, owners, solid
from postprocess.trajectory import write_trajectory

SUFFIXES = ("stl", "obj", "gltf", "glb")
FORMATS = ("vtp", "gsd", *SUFFIXES)  #: Formats of exports

SCRIPT = "show_in_paraview.py"  #: Name of the script for ParaView in an export as vtp

_FIELDLESS = ("stl", "obj")
_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # rows: axes of glTF in coordinates of the run


def export_run(
    directory: Path | str,
    *,
    to: str,
    output: Path | str | None = None,
    time: float | None = None,
    every_frame: bool = False,
    wanted: Sequence[str] = (),
    unwanted: Sequence[str] = (),
    color_by: str | None = None,
    progress: Callable[[int, int], None] = lambda _done, _all: None,
) -> Path:
    """Export the bodies of a run to files for other programs; return the path of the file or folder.

    The file or folder exists only if the export is complete.

    Args:
        directory: A run directory with at least one frame; the run may be unfinished.
        to: Format of the export, one of `FORMATS`.
        output: Path to write, which must not exist. It is a folder for vtp, and for all frames as stl, obj, gltf or
            glb; otherwise it is a file, whose suffix must be that of the format. None: `export-TO` (folder) or
            `export.TO` (file) in the run directory, where TO is the format.
        time: Simulated time [s]; the frame nearest to it is exported. None: the last frame.
        every_frame: Whether to export all frames; `time` must then be None.
        wanted: Kinds of bodies besides `postprocess.bodies.meshes.USUAL`, and fields on request.
        unwanted: Kinds of bodies and fields to leave out.
        color_by: Name or short name of the field that colours the smarticles, for formats with colours; None: the usual
            field, see `colour_field`.
        progress: Called after each frame with the number of exported frames and the number of all.

    Raises:
        InputError: An unknown format, kind or field, no frame, a damaged file, a time outside the recorded frames, or
            an output that exists.
        RunError: The output cannot be written.
    """
    if to not in FORMATS:
        raise InputError(f"--to {to}: no such format; {nearest(to, FORMATS, cutoff=0.5)}")
    if every_frame and time is not None:
        raise InputError(f"--time {time:g}: all frames are asked for; leave --time or --all out")
    run = open_run(directory)
    fields = fields_of(run)
    kinds = checked_kinds(wanted, unwanted, also=[field.name for field in fields])
    fields = tuple(field for field in fields if not field.on_request or field.name in wanted)
    frames = read_frames(directory)
    chosen = range(len(frames)) if every_frame else [len(frames) - 1 if time is None else frames.nearest(time)]
    folder = to == "vtp" or (every_frame and to != "gsd")
    path = _checked_output(run.path, output, to, folder=folder)
    carried = [field for field in fields if field.name in IDENTITY or not (to in _FIELDLESS or field.name in unwanted)]
    bodies = Bodies(run, kinds, carried)
    if to != "gsd":
        bodies.hold(frames[index] for index in chosen)

    def exported() -> Iterator[tuple[int, Frame]]:
        for done, index in enumerate(chosen):
            yield index, frames[index]
            progress(done + 1, len(chosen))

    with _whole(path) as made:
        if folder:
            made.mkdir()
        if to == "gsd":
            every = (frames[index] for index in chosen)
            written = write_trajectory(made, run, exported(), carried, first=every) if "smarticles" in kinds else 0
        elif to == "vtp":
            written = _write_collection(made, bodies, exported())
        else:
            painter = _Painter(bodies, color_by, (frames[index] for index in chosen))
            written = 0
            for index, frame in exported():
                content = painter.content(frame, to)
                if content is not None:  # there is no body of the wanted kinds
                    (made / f"frame_{index:06d}.{to}" if folder else made).write_bytes(content)
                    written += 1
        if not written:
            raise InputError(f"nothing to export: the run has no {', '.join(kinds)} at this time; leave out less")
    return path


def _checked_output(directory: Path, output: Path | str | None, to: str, *, folder: bool) -> Path:
    path = Path(output) if output is not None else directory / (f"export-{to}" if folder else f"export.{to}")
    if not folder and path.suffix != f".{to}":
        msg = f"--output {path}: a file of --to {to} must end in .{to}; got {path.suffix!r}"
    elif os.path.lexists(path):
        msg = f"--output {path}: exists, and exports replace nothing; choose another name"
    elif not path.parent.is_dir():
        msg = f"--output {path}: the folder {path.parent} does not exist; create it or choose another output"
    else:
        return path
    raise InputError(msg)


@contextmanager
def _whole(path: Path) -> Iterator[Path]:
    """Yield a temporary path, which is renamed to `path` if the block ends without an error, else removed."""
    scratch: Path | None = None
    try:
        scratch = Path(tempfile.mkdtemp(prefix=f".{path.name}.", dir=path.parent))
        made = scratch / path.name
        yield made
        made.rename(path)
    except OSError as error:
        msg = f"{path}: cannot be written ({error.strerror or error}); free space or choose another --output"
        raise RunError(msg) from error
    finally:
        if scratch is not None:
            shutil.rmtree(scratch, ignore_errors=True)


def _write_collection(folder: Path, bodies: Bodies, frames: Iterable[tuple[int, Frame]]) -> int:
    """Write `KIND.pvd`, a list of `KIND/KIND_000000.vtp` …, for each kind; return the number of kinds.

    Each kind has a file for every frame. If a frame has no body of the kind, the file has no points: without a file
    ParaView would show the body of the previous frame.
    """
    written: list[tuple[int, float, int]] = []  # number, time, phase
    empty: dict[str, pv.PolyData] = {}  # mesh without points of each kind
    for number, frame in frames:
        found = bodies.at(frame)
        for kind, mesh in found.items():
            if kind not in empty:
                (folder / kind).mkdir()
                # ParaView's filters need the fields at all times, and its reader reports files that lack points.
                empty[kind] = pv.PolyData()
                empty[kind].SetPoints(vtkPoints())
                empty[kind].GetPointData().CopyStructure(mesh.GetPointData())
                empty[kind].GetCellData().CopyStructure(mesh.GetCellData())
                for before in written:
                    _write_mesh(folder, kind, empty[kind], before, bodies.run)
        written.append((number, frame.time, frame.phase))
        for kind, nothing in empty.items():
            _write_mesh(folder, kind, found.get(kind, nothing), written[-1], bodies.run)
    for kind in empty:
        root = ET.Element("VTKFile", type="Collection", version="0.1", byte_order="LittleEndian")
        parent = ET.SubElement(root, "Collection")
        for number, time, _ in written:
            ET.SubElement(parent, "DataSet", timestep=f"{time:.9g}", group="", part="0", file=_name(kind, number))
        tree = ET.ElementTree(root)
        ET.indent(tree)
        tree.write(folder / f"{kind}.pvd", encoding="utf-8", xml_declaration=True)
    shutil.copyfile(Path(__file__).with_name(SCRIPT), folder / SCRIPT)
    return len(empty)


def _name(kind: str, number: int) -> str:
    return f"{kind}/{kind}_{number:06d}.vtp"


def _write_mesh(folder: Path, kind: str, mesh: pv.PolyData, frame: tuple[int, float, int], run: Run) -> None:
    number, time, phase = frame
    mesh.field_data["TimeValue"] = np.array([time])  # name required by VTK's readers
    mesh.field_data["phase"] = np.array([phase])
    mesh.field_data["middle_length_m"] = np.array([run.manifest.middle_length_m])
    mesh.field_data["thickness_m"] = np.array([min(run.manifest.thickness_in_plane_m, run.manifest.thickness_normal_m)])
    for name, value in (("run_name", run.manifest.name), ("scene_sha256", run.manifest.scene_sha256)):
        # PyVista writes ASCII text only.
        text = vtkStringArray()
        text.SetName(name)
        text.InsertNextValue(value)
        mesh.GetFieldData().AddArray(text)
    mesh.save(folder / _name(kind, number))


class _Painter:
    """Makes files of triangles, with smarticles coloured by a field on one scale for all frames."""

    def __init__(self, bodies: Bodies, color_by: str | None, frames: Iterable[Frame]) -> None:
        self._bodies = bodies
        self._field = colour_field(color_by, bodies.run)
        values = [scalars(self._field, frame, bodies.run) for frame in frames]
        if not any(np.isfinite(each).any() for each in values):
            raise InputError(f"--color-by {self._field.name}: no frame to export has it; choose another field")
        self._bounds = span(values)
        self._scale = ColourScale.of(self._field, self._bounds, [bodies.run])

    def content(self, frame: Frame, suffix: str) -> bytes | None:
        """Return the content of the file of a frame, with one object per kind; None if there is no body.

        `suffix` is the format: "stl", "obj", "gltf" or "glb". STL has one object for all kinds.
        """
        scene: Any = trimesh.Scene()
        web = suffix in {"gltf", "glb"}
        for kind, mesh in self._bodies.at(frame).items():
            scene.add_geometry(self._triangles(kind, mesh, frame, web=web), node_name=kind, geom_name=kind)
        if not scene.geometry:
            return None
        options: dict[str, Any] = {}
        if suffix == "stl":
            scene = scene.to_mesh()
        else:
            options["include_normals"] = False
        if suffix == "obj":
            options["header"] = "metres, z upwards"
        if web:
            options["tree_postprocessor"] = lambda tree: self._finish(tree, frame)
        if suffix == "gltf":
            options |= {"merge_buffers": True, "embed_buffers": True}
        content: Any = scene.export(file_type=suffix, **options)
        if suffix == "gltf":
            content = content["model.gltf"]
        return content.encode("utf-8") if isinstance(content, str) else bytes(content)

    def _triangles(self, kind: str, mesh: pv.PolyData, frame: Frame, *, web: bool) -> trimesh.Trimesh:
        run = self._bodies.run
        triangles = solid(kind, mesh, run)
        points = np.asarray(triangles.points, dtype=np.float64)
        colours = np.tile(PAINTS[kind].rgb, (len(points), 1))
        if kind == "smarticles":
            colours = at_points(mesh, self._scale.painted(scalars(self._field, frame, run)[owners(mesh, frame)]))
        shape = trimesh.Trimesh(
            points @ _Y_UP.T if web else points,
            triangles.regular_faces.astype(np.int64),
            vertex_colors=np.insert(linear(colours) if web else colours, 3, 255, axis=1),
            process=False,
        )
        if web and kind == "smarticles":
            # glTF demands an underscore in names of custom attributes, and has no integers of four bytes for them.
            for name, values in mesh.cell_data.items():
                if values.ndim == 1 and np.isfinite(values).all():
                    each = at_points(mesh, np.asarray(values))
                    shape.vertex_attributes[f"_{name.upper()}"] = each.astype(np.float32)
        return shape

    def _finish(self, tree: dict[str, Any], frame: Frame) -> None:
        """Add dull materials, as glTF's default is a metallic mirror, and provenance to the JSON `tree`."""
        tree["materials"] = []
        for mesh in tree["meshes"]:
            opacity = PAINTS[mesh["name"]].opacity
            surface = {"baseColorFactor": [1.0, 1.0, 1.0, opacity], "metallicFactor": 0.0, "roughnessFactor": 0.7}
            material: dict[str, Any] = {"name": mesh["name"], "doubleSided": True, "pbrMetallicRoughness": surface}
            if opacity < 1:
                material["alphaMode"] = "BLEND"
            for primitive in mesh["primitives"]:
                primitive["material"] = len(tree["materials"])
            tree["materials"].append(material)
        tree["asset"]["extras"] = {
            "run_name": self._bodies.run.manifest.name,
            "scene_sha256": self._bodies.run.manifest.scene_sha256,
            "time_s": frame.time,
            "unit": "m",
            "coloured_by": self._field.name,
            "least": self._bounds[0],
            "greatest": self._bounds[1],
        }
