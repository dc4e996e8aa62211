"""Exported files, read by libraries that did not write them: VTK, and for VTK's own the parser of XML beside it."""

import json
import struct
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import pyvista as pv
from synthetic import T1, T2, SyntheticRun, W, u_shape, write_frame, write_run
from synthetic.forces import pressed
from vtkmodules.vtkIOGeometry import vtkGLTFReader

from dem.errors import InputError
from dem.record.forces import force_mesh
from dem.record.frames import FrameWriter, read_frames
from dem.record.names import FORCE
from postprocess.bodies.fields import FIELDS
from postprocess.export import FORMATS, SUFFIXES, export_run
from postprocess.geometry.links import centres_of_mass

HOSTILE = ["<script>alert(1)</script>", '"/><x y="', "a\nv 1 2 3\r\nb", "{{ constructor }} ../../up é∀\u202e %s %n"]


@pytest.fixture
def pile(tmp_path):
    return write_run(tmp_path / "pile", SyntheticRun(frames_per_phase=2, floor_z=-0.003))


@pytest.fixture
def opened(tmp_path):
    """A run whose last phase takes the wall away."""
    kinds = ("deposit", "relax", "shake", "remove-container")
    return write_run(tmp_path / "opened", SyntheticRun(frames_per_phase=2, phases=kinds))


def smarticles_of(tree):
    """The attributes of the points of smarticles in a glTF."""
    shape = next(mesh for mesh in tree["meshes"] if mesh["name"] == "smarticles")
    return set(shape["primitives"][0]["attributes"])


@pytest.fixture
def single(tmp_path):
    """One U, flat: its middle link along x, its mouth towards y, its plane at z = 3 mm; nothing passes through it."""
    directory = tmp_path / "single"
    write_run(directory, SyntheticRun(count=1, frames_per_phase=1, phases=("relax",), packing=(0.001,)))
    vertices = u_shape(0.7 * W) + np.array([0.001, 0.002, 0.003])
    write_frame(directory / "frames/frame_000000.vtu", vertices[None], time=0.5, phase=0)
    return directory


def glb_tree(path):
    """The JSON part of a binary glTF, read by the book."""
    content = path.read_bytes()
    magic, version, length, size, kind = struct.unpack("<4sII I4s", content[:20])
    assert (magic, version, length, kind) == (b"glTF", 2, len(content), b"JSON")
    return json.loads(content[20 : 20 + size])


def meshes(path):
    """Parts of a glTF as VTK reads them, by name."""
    reader = vtkGLTFReader()
    reader.SetFileName(str(path))
    reader.Update()
    parts = []

    def walk(block):
        for number in range(block.n_blocks):
            part = block[number]
            if isinstance(part, pv.MultiBlock):
                walk(part)
            elif part is not None and part.n_points:
                parts.append(part)

    walk(pv.wrap(reader.GetOutputDataObject(0)))
    tree = glb_tree(path) if path.suffix == ".glb" else json.loads(path.read_text())
    return dict(zip([node["name"] for node in tree["nodes"]], parts, strict=True))


# glTF


@pytest.mark.parametrize("suffix", ["gltf", "glb"])
def test_gltf_has_the_boxes_in_metres_with_y_upwards(single, tmp_path, suffix):
    path = export_run(single, to=suffix, output=tmp_path / f"one.{suffix}")
    found = meshes(path)
    assert set(found) == {"smarticles", "wall", "floor"}
    shape = found["smarticles"].extract_surface(algorithm="dataset_surface").triangulate()
    assert shape.volume * 1e9 == pytest.approx(1e9 * T1 * T2 * W * 2.4, rel=1e-4)
    # x stays, y is our z, z is our -y.
    barb = 0.7 * W
    low_y = 0.002 - barb**2 / (W + 2 * barb)
    assert shape.bounds == pytest.approx(
        (
            0.001 - W / 2 - T2 / 2, 0.001 + W / 2 + T2 / 2, 0.003 - T1 / 2, 0.003 + T1 / 2,
            -(low_y + barb), -(low_y - T2 / 2),
        ),
        abs=1e-7,
    )  # fmt: skip


def test_gltf_colours_are_the_palettes_as_linear_light(single, tmp_path):
    path = export_run(single, to="glb", output=tmp_path / "one.glb")
    colours = np.asarray(meshes(path)["smarticles"].point_data["COLOR_0"])
    # Nothing passes through it: the grey of no crossing, #c9c9c9, is 0.584 of the light.
    scaled = colours / (255 if colours.max() > 1 else 1)
    assert scaled[:, :3] == pytest.approx(np.full((24, 3), 149 / 255), abs=1e-3)


def test_gltf_names_its_run_and_has_dull_materials_and_fields(pile, tmp_path):
    tree = glb_tree(export_run(pile, to="glb", output=tmp_path / "pile.glb", color_by="height"))
    assert tree["asset"]["extras"]["coloured_by"] == "height_m"
    assert tree["asset"]["extras"]["time_s"] == pytest.approx(read_frames(pile).times[-1])
    materials = {material["name"]: material for material in tree["materials"]}
    assert all(material["pbrMetallicRoughness"]["metallicFactor"] == 0 for material in materials.values())
    assert materials["wall"]["alphaMode"] == "BLEND"
    assert {"_SMARTICLE_ID", "_LINK", "_CROSSINGS", "_HEIGHT_M", "_CONTACTS"} <= smarticles_of(tree)
    for accessor in tree["accessors"]:
        assert np.isfinite(np.asarray(accessor.get("min", [0]) + accessor.get("max", [0]), dtype=float)).all()


def test_gltf_has_no_field_with_holes(opened, tmp_path):
    """Its numbers must be finite; without a wall there is no local packing."""
    attributes = smarticles_of(glb_tree(export_run(opened, to="glb", output=tmp_path / "a.glb")))
    assert "_CROSSINGS" in attributes
    assert "_LOCAL_PACKING_FRACTION" not in attributes


# STL and OBJ


def test_stl_and_obj_have_equal_shapes(single, tmp_path):
    for suffix in ("stl", "obj"):
        path = export_run(single, to=suffix, output=tmp_path / f"one.{suffix}", unwanted=["wall", "floor"])
        shape = pv.read(path).clean()
        assert shape.triangulate().volume * 1e9 == pytest.approx(1e9 * T1 * T2 * W * 2.4, rel=1e-4)
        assert shape.bounds[4:] == pytest.approx((0.003 - T1 / 2, 0.003 + T1 / 2), abs=1e-8)


def test_obj_names_its_objects_and_colours_points(single, tmp_path):
    lines = export_run(single, to="obj", output=tmp_path / "one.obj").read_text().splitlines()
    assert [line for line in lines if line.startswith("o ")] == ["o smarticles", "o wall", "o floor"]
    first = next(line.split() for line in lines if line.startswith("v "))
    assert [float(part) for part in first[4:7]] == pytest.approx([201 / 255] * 3, abs=1e-6)


# vtp


def test_vtp_lists_every_frame_with_its_time_and_all_fields(pile, tmp_path):
    folder = export_run(pile, to="vtp", output=tmp_path / "out", every_frame=True, wanted=["crossings"])
    frames = read_frames(pile)
    listed = [entry.attrib for entry in ET.parse(folder / "smarticles.pvd").getroot().iter("DataSet")]
    assert [float(entry["timestep"]) for entry in listed] == pytest.approx(frames.times.tolist(), rel=1e-8)
    mesh = pv.read(folder / listed[-1]["file"])
    assert mesh.n_cells == 12 * 3 * 6
    asked_for = {
        "angle_rad",
        "motor_torque_N_m",
        "motor_work_J",
        "halted",
        "normal_force_N",
        "force_chain",
        "entry",
        "kind",
    }
    rigid = {field.name for field in FIELDS if not field.on_request} - asked_for
    assert set(mesh.cell_data.keys()) == rigid
    assert mesh.field_data["TimeValue"] == pytest.approx([frames.times[-1]])
    assert {path.stem for path in folder.glob("*.pvd")} == {"smarticles", "wall", "floor", "crossings"}
    assert (folder / "show_in_paraview.py").is_file()


def test_a_field_on_request_is_exported_if_it_is_named(pile, tmp_path):
    folder = export_run(pile, to="vtp", output=tmp_path / "out", wanted=["average_crossing_number"])
    (file,) = folder.glob("smarticles/*.vtp")
    assert (pv.read(file).cell_data["average_crossing_number"] > 0).all()


def test_a_kind_that_comes_or_goes_is_nothing_at_the_other_times(opened, tmp_path):
    # ParaView shows the file before of a collection that has none at a time: a wall that was taken away would stay.
    laid = pressed([(0, 1)], [2.0])
    writer = FrameWriter(opened, FORCE)
    for index, frame in enumerate(read_frames(opened)):
        found = laid if index in (2, 3) else pressed([], [])
        writer.write(force_mesh(found, centres_of_mass(frame.vertices), time=frame.time, phase=frame.phase), frame.time)
    folder = export_run(
        opened, to="vtp", output=tmp_path / "out", every_frame=True, wanted=["forces"],
        unwanted=["local_packing_fraction"],
    )  # fmt: skip
    found = {}
    for kind in ("wall", "forces"):
        listed = [entry.attrib["file"] for entry in ET.parse(folder / f"{kind}.pvd").getroot().iter("DataSet")]
        assert listed == [f"{kind}/{kind}_{k:06d}.vtp" for k in range(8)]
        found[kind] = [pv.read(folder / file) for file in listed]
        assert all(b'Name="Points"' in (folder / file).read_bytes() for file in listed)  # else ParaView complains
    assert [mesh.n_points > 0 for mesh in found["wall"]] == 6 * [True] + 2 * [False]
    assert [mesh.n_points > 0 for mesh in found["forces"]] == [k in (2, 3) for k in range(8)]
    # A filter finds its fields at all times.
    assert {tuple(mesh.cell_data.keys()) for mesh in found["forces"]} == {tuple(found["forces"][2].cell_data.keys())}
    assert {float(mesh.field_data["thickness_m"][0]) for mesh in found["forces"]} == {T2}
    assert [float(mesh.field_data["TimeValue"][0]) for mesh in found["wall"]] == pytest.approx(
        read_frames(opened).times.tolist()
    )


# All formats


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_names_are_data(tmp_path, name):
    run = write_run(tmp_path / "run", SyntheticRun(count=2, frames_per_phase=1, name=name))
    before = sorted(path.name for path in tmp_path.iterdir())
    for suffix in ("vtp", *SUFFIXES):
        export_run(run, to=suffix, unwanted=["local_packing_fraction"])
    assert sorted(path.name for path in tmp_path.iterdir()) == before
    (file,) = (run / "export-vtp" / "smarticles").glob("*.vtp")
    assert pv.read(file).field_data["run_name"][0] == name
    for suffix in ("gltf", "glb"):
        path = run / f"export.{suffix}"
        tree = glb_tree(path) if suffix == "glb" else json.loads(path.read_text())
        assert tree["asset"]["extras"]["run_name"] == name
    lines = (run / "export.obj").read_text().splitlines()
    assert not any(line.startswith("v 1 2 3") for line in lines)
    script = (run / "export-vtp" / "show_in_paraview.py").read_text()
    assert name not in script


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_all_frames_are_numbered_files(pile, tmp_path, suffix):
    reports, left_out = [], ["local_packing_fraction"]
    options = {"output": tmp_path / "out", "unwanted": left_out, "progress": lambda *done: reports.append(done)}
    folder = export_run(pile, to=suffix, every_frame=True, **options)
    assert sorted(path.name for path in folder.iterdir()) == [f"frame_{k:06d}.{suffix}" for k in range(8)]
    assert reports == [(k + 1, 8) for k in range(8)]


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"to": "gltff"}, r"--to gltff: no such format; did you mean 'gltf'\?"),
        ({"to": "glb", "time": 99.0}, "time must be between 0.5 s and 22 s, the run's frames: got 99 s"),
        ({"to": "glb", "time": 1.0, "every_frame": True}, "leave --time or --all out"),
        ({"to": "glb", "unwanted": ["wals"]}, r"'wals' is nothing to export; did you mean 'wall'"),
        ({"to": "glb", "color_by": "angle_rad"}, "no frame to export has it"),
        ({"to": "vtp", "wanted": ["forces"]}, "records no forces; .*recording.contact_forces: true"),
    ],
)
def test_errors_are_one_line_and_leave_nothing(pile, asked, message):
    before = sorted(pile.rglob("*"))
    with pytest.raises(InputError, match=message) as caught:
        export_run(pile, **asked)
    assert "\n" not in str(caught.value)
    assert sorted(pile.rglob("*")) == before


@pytest.mark.parametrize("suffix", ["vtp", "glb"])
def test_a_file_of_nothing_is_rejected(pile, tmp_path, suffix):
    # This run has neither hooks nor plate nor strings.
    with pytest.raises(InputError, match="the run has no hooks, plate, strings at this time; leave out less"):
        export_run(pile, to=suffix, output=tmp_path / f"out.{suffix}", unwanted=["smarticles", "wall", "floor"])
    assert list(tmp_path.iterdir()) == [pile]


@pytest.mark.parametrize("suffix", FORMATS)
def test_nothing_is_replaced(pile, tmp_path, suffix):
    target = tmp_path / f"there.{suffix}"
    target.write_text("mine")
    with pytest.raises(InputError, match="exists, and exports replace nothing"):
        export_run(pile, to=suffix, output=target)
    assert target.read_text() == "mine"
