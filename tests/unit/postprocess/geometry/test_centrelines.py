"""Centre lines from files, and what is said about files that hold none."""

import meshio
import numpy as np
import pytest
from synthetic import write_frame
from synthetic.curves import rings, torus_curve

from dem.errors import InputError
from postprocess import closed_linking, crossing_pairs, polygon_crossings, read_centrelines, read_frame, segments_of

CSV = """body, x [mm], y [mm], z [mm], kind
2, 0, 0, 0, hook
2, 1, 0, 0, hook
5, 0, 0, 9, rod
2, 1, 1, 0, hook
5, 0, 0, 8, rod
5, 0, 0, 8, rod
"""


def test_rows_of_a_table_are_joined_in_their_order(tmp_path):
    (tmp_path / "a.csv").write_text(CSV, encoding="utf-8")
    found = read_centrelines(tmp_path / "a.csv")
    expected = [[[0, 0, 0], [1, 0, 0]], [[1, 0, 0], [1, 1, 0]], [[0, 0, 9], [0, 0, 8]]]
    np.testing.assert_allclose(found.segments, 1e-3 * np.array(expected))
    assert found.body.tolist() == [2, 2, 5]
    assert found.kind is not None
    assert found.kind.tolist() == ["hook", "hook", "rod"]
    with pytest.raises(ValueError, match="read-only"):
        found.segments[0] = 0
    commas = CSV.replace("\n", ",\n").replace(",\n", "\n", 1)  # at the ends of all rows, as some programs write them
    (tmp_path / "c.csv").write_text(commas, encoding="utf-8-sig")
    np.testing.assert_array_equal(read_centrelines(tmp_path / "c.csv").segments, found.segments)
    plain = CSV.replace(" [mm]", "").replace("body", " Body ")
    (tmp_path / "b.csv").write_text(plain, encoding="utf-8")
    np.testing.assert_allclose(read_centrelines(tmp_path / "b.csv", unit="cm").segments, 10 * found.segments)


@pytest.mark.parametrize(
    ("header", "unit"),
    [
        ("body,x [mm],y [mm],z [mm],yield [MPa]", None),
        ("body,x [ mm ],y [mm],z [mm],more", None),
        ("body,x [µm],y [um],z [μm],more", "um"),
    ],
)
def test_units_are_those_of_the_coordinates_in_any_spelling(tmp_path, header, unit):
    (tmp_path / "a.csv").write_text(f"{header}\n1,0,0,0,5\n1,1,0,0,5\n", encoding="utf-8")
    found = read_centrelines(tmp_path / "a.csv", unit=unit)
    assert found.segments[0, 1, 0] == pytest.approx(1e-6 if unit else 1e-3)


@pytest.mark.parametrize(
    ("text", "unit", "message"),
    [
        (CSV.replace(" [mm]", ""), None, "states no unit of length; give unit='mm', or another one of m, cm, mm, um"),
        (CSV, "cm", "states mm as unit of its columns x, y, z, unit is cm; give one unit"),
        (CSV, "inch", "unit 'inch' is unknown; known: m, cm"),
        (CSV, 1e-3, "unit 0.001 is unknown; known: m, cm"),
        (CSV.replace("body", "particle"), None, "it has no column body; a CSV file needs columns body, x, y, z"),
        (CSV.replace("5, 0, 0, 9", "5, 0, 0, x"), None, "a value is no number"),
        (CSV.replace("5, 0, 0, 9", "5, 0, , 9"), None, "line 4 needs three finite coordinates"),
        (CSV.replace("5, 0, 0, 9", "7, 0, 0, 9"), None, "body 7 has one point"),
        (CSV.replace(", kind\n", "\n"), None, "rows have more cells than the first line has names; n"),
        ("body,x [m],y,z\n0,0,0,0,1\n1,0,0,0,2\n", None, "rows have more cells than the first line has names"),
        ("body,x [m],y,z\n0,0,0,0\n1,0,0,0,2\n", None, "Expected 4 fields in line 3, saw 5"),
        (CSV.replace("5, 0, 0, 9, rod", "5, 0, 0, 9"), None, "line 4 has no kind"),
        (CSV.replace("5, 0, 0, 9", "-5, 0, 0, 9"), None, "line 4: body -5 is no whole number from 0"),
        (CSV.replace("5, 0, 0, 9", "inf, 0, 0, 9"), None, "line 4: body inf is no whole number"),
        (CSV.replace("5, 0, 0, 9", ", 0, 0, 9"), None, "line 4: body nan is no whole number"),
        (CSV.replace("5, 0, 0, 9", "5.5, 0, 0, 9"), None, "line 4: body 5.5 is no whole number"),
        (CSV.replace("5, 0, 0, 9", "1_2, 0, 0, 9"), None, "line 4: body 1_2 is no whole number"),
        (CSV.replace("5, 0, 0, 9", f"{10**20}, 0, 0, 9"), None, f"line 4: body {10**20} is no whole number"),
        (CSV.replace("2, ", "9007199254740992.0, "), None, "line 2: body 9007199254740992.0 is no whole number"),
        (CSV.replace("5, 0, 0, 8", "5, 0, 0, 9"), None, "all points of body 5 coincide"),
        (CSV[: CSV.index("\n") + 1], None, "it holds no segment"),
        *(
            (
                f"{name}body,x [mm],y,z\n0,1,0,0,0\n0,1,1,0,0\n5,1,0,0,9\n5,1,1,0,9\n",
                None,
                f"column {said} has 2 values",
            )
            for name, said in (("frame,", "frame"), ("Time [s],", "time"), ("t [ms],", "t"), ("timestep,", "timestep"))
        ),
        ("body,index,x [mm],y,z\n1,0,0,0,0\n1,1,1,0,0\n1,0,0,0,9\n", None, "line 4: body 1 has index 0 twice; number"),
        ("body,index,x [mm],y,z\n1,0,0,0,0\n1,,1,0,0\n", None, "line 3: index is nan, no number"),
        ("", None, "cannot read centre lines .*; a CSV file needs columns"),
    ],
)
def test_tables_that_say_too_little_are_rejected(tmp_path, text, unit, message):
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        read_centrelines(tmp_path / "a.csv", unit=unit)


def test_points_are_in_the_order_of_their_index_and_one_time_is_no_matter(tmp_path):
    rows = ["frame,time [s],body,index,x [mm],y,z"]
    rows += [f"3,0.5,{body},{index},{index**2},{body},0" for index in (10, 2, 0) for body in (7, 4)]
    (tmp_path / "a.csv").write_text("\n".join(rows), encoding="utf-8")
    found = read_centrelines(tmp_path / "a.csv")
    assert found.body.tolist() == [4, 4, 7, 7]
    np.testing.assert_allclose(1e3 * found.segments[:, :, 0], [[0, 4], [4, 100]] * 2)


def test_lines_of_several_times_in_one_vtk_file_are_rejected(tmp_path):
    points, cells = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1], [1, 0, 1.0]]), [("line", np.array([[0, 1], [2, 3]]))]
    several = {"cell data time_s": {"cell_data": {"time_s": [[0.1, 0.2]]}}}
    several["point data frame"] = {"point_data": {"frame": [0, 0, 1, 1]}}
    for number, (said, data) in enumerate(several.items()):
        meshio.Mesh(points, cells, **data).write(tmp_path / f"{number}.vtu")
        with pytest.raises(InputError, match=f"{said} has 2 values: it holds the bodies at several times; keep one"):
            read_centrelines(tmp_path / f"{number}.vtu", unit="m")


def test_files_that_are_missing_or_of_another_kind_are_rejected(tmp_path):
    for name in ("a.csv", "a.vtu", "a.vtp"):
        with pytest.raises(InputError, match=f"cannot read centre lines .*{name}: No such file"):
            read_centrelines(tmp_path / name, unit="m")
    with pytest.raises(InputError, match=r"centre lines are read from .csv, .vtu, .vtp and .vtk: got .stl"):
        read_centrelines(tmp_path / "a.stl", unit="m")
    (tmp_path / "b.vtu").write_text("no XML")
    with pytest.raises(InputError, match=r"b.vtu: truncated or not VTK"):
        read_centrelines(tmp_path / "b.vtu", unit="m")


def test_a_frame_of_a_run_is_measured_as_in_the_run(tmp_path, scene):
    write_frame(tmp_path / "frame.vtu", scene(20, 4, box=1.2, angles=(90, 90)))
    frame, found = read_frame(tmp_path / "frame.vtu"), read_centrelines(tmp_path / "frame.vtu", unit="m")
    segments, body = segments_of(frame)
    np.testing.assert_array_equal(found.segments, segments)
    np.testing.assert_array_equal(found.body, body)
    assert len(crossing_pairs(frame.vertices).i) == len(polygon_crossings(found.segments, found.body).i) > 10


def test_lines_that_share_points_are_one_body(tmp_path):
    corners = np.concatenate([torus_curve(1, 1), torus_curve(1, 1, shift=np.pi)])
    lines = np.concatenate([np.stack([np.arange(24), np.roll(np.arange(24), -1)], axis=1) + k for k in (0, 24)])
    meshio.Mesh(corners, [("line", lines)]).write(tmp_path / "rings.vtu")
    found = read_centrelines(tmp_path / "rings.vtu", unit="mm")
    assert found.body.tolist() == [0] * 24 + [1] * 24
    assert closed_linking(found.segments, found.body).number.tolist() == [-1]


def test_polylines_of_polydata_are_read_with_their_numbers(tmp_path):
    pv = pytest.importorskip("pyvista")
    corners = np.concatenate([torus_curve(1, 1), torus_curve(1, 1, shift=np.pi)])
    closed = [np.append(np.arange(24), 0) + k for k in (0, 24)]
    mesh = pv.PolyData(corners, lines=np.concatenate([np.append(len(one), one) for one in closed]))
    for name in ("a.vtp", "b.vtk"):
        mesh.save(tmp_path / name)
        found = read_centrelines(tmp_path / name, unit="mm")
        np.testing.assert_allclose(found.segments, 1e-3 * rings(*corners.reshape(2, 24, 3))[0], rtol=1e-6)
        assert found.body.tolist() == [0] * 24 + [1] * 24
    mesh.cell_data["body"] = [9, 4]
    mesh.save(tmp_path / "c.vtp")
    assert np.unique(read_centrelines(tmp_path / "c.vtp", unit="mm").body).tolist() == [4, 9]
    pv.Sphere().save(tmp_path / "d.vtp")
    with pytest.raises(InputError, match="it holds no lines, but a PolyData"):
        read_centrelines(tmp_path / "d.vtp", unit="mm")


def test_numbers_of_bodies_in_a_table_are_exact(tmp_path):
    rows = [f"{2**53 + k},{x},0,0\n" for k in range(3) for x in range(2)]
    (tmp_path / "a.csv").write_text("body,x,y,z\n" + "".join(rows), encoding="utf-8")
    assert read_centrelines(tmp_path / "a.csv", unit="m").body.tolist() == [2**53, 2**53 + 1, 2**53 + 2]


LINE, POLYLINE, QUADRATIC, CUBIC, VERTEX = 3, 4, 21, 35, 1


def grid(points, cells, **data):
    """A grid of VTK: cells as pairs of type and points."""
    pv = pytest.importorskip("pyvista")
    joined = [number for _, corners in cells for number in (len(corners), *corners)]
    made = pv.UnstructuredGrid(np.array(joined), np.array([kind for kind, _ in cells], np.uint8), np.array(points))
    for name, values in data.items():
        made.cell_data[name] = values
    return made


def chopped(corners, random):
    """The points `corners` of a body, in order, as cells of VTK of random types."""
    cells, at = [], 0
    while at < len(corners) - 1:
        kind, steps = [(LINE, 1), (POLYLINE, random.integers(1, 6)), (QUADRATIC, 2), (CUBIC, 3)][random.integers(4)]
        own = corners[at : at + steps + 1]
        if len(own) == steps + 1:
            cells.append((kind, [own[0], own[-1], *own[1:-1]] if kind in {QUADRATIC, CUBIC} else list(own)))
            at += steps
    return cells


def save(mesh, path, compressor):
    if path.suffix == ".vtk":
        mesh.save(path, binary=compressor is not None)
        return
    writer = pytest.importorskip("vtkmodules.vtkIOXML").vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(mesh)
    if compressor is None:
        writer.SetDataModeToAscii()
    else:
        getattr(writer, f"SetCompressorTypeTo{compressor}")()
    writer.Write()


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(
    ("name", "compressor"),
    [("a.vtu", "ZLib"), ("a.vtu", "LZ4"), ("a.vtu", "LZMA"), ("a.vtu", None), ("a.vtk", "-"), ("a.vtk", None)],
)
def test_lines_of_all_types_in_a_grid_are_read(tmp_path, seed, name, compressor):
    random = np.random.default_rng(seed)
    sizes = random.integers(2, 12, size=6)
    points = random.integers(-50, 50, size=(sizes.sum(), 3)) / 8.0  # exact in every format
    points[:, 0] += np.arange(len(points))
    numbers = random.permutation(2**53 + np.arange(6))
    # Polylines of the bodies in random order, with vertices between them.
    cells = [
        (number, one)
        for number, corners in zip(numbers, np.split(np.arange(len(points)), np.cumsum(sizes)[:-1]), strict=True)
        for one in chopped(corners, random)
    ]
    cells += [(-1, (VERTEX, [number])) for number in range(3)]
    order = random.permutation(len(cells))
    body, kinds = [cells[k][0] for k in order], [7 * (cells[k][0] % 2) for k in order]
    mesh = grid(points, [cells[k][1] for k in order], kind=np.array(kinds), body=np.array(body))
    save(mesh, tmp_path / name, compressor)
    found = read_centrelines(tmp_path / name, unit="m")
    wanted = {
        (number, *map(float, np.sort(points[[k, k + 1]], axis=0).ravel()))
        for number, stop, size in zip(numbers, np.cumsum(sizes), sizes, strict=True)
        for k in range(stop - size, stop - 1)
    }
    rows = zip(found.body.tolist(), np.sort(found.segments, axis=1).reshape(-1, 6).tolist(), strict=True)
    assert {(number, *ends) for number, ends in rows} == wanted
    assert len(found.body) == len(wanted)
    np.testing.assert_array_equal(found.kind, 7 * (found.body % 2))


def test_vertices_of_polydata_come_before_its_lines(tmp_path):
    pv = pytest.importorskip("pyvista")
    corners = np.arange(15.0).reshape(5, 3) ** 2
    mesh = pv.PolyData(corners, verts=[1, 0, 1, 1], lines=[3, 0, 1, 2, 2, 3, 4])
    mesh.cell_data["body"] = [-1, -1, 8, 6]
    mesh.save(tmp_path / "a.vtp")
    found = read_centrelines(tmp_path / "a.vtp", unit="m")
    assert found.body.tolist() == [8, 8, 6]
    np.testing.assert_allclose(found.segments, corners[[[0, 1], [1, 2], [3, 4]]])


def test_all_arrays_of_a_legacy_file_are_read(tmp_path):
    pytest.importorskip("pyvista")
    arrays = "".join(
        f"SCALARS {name} int 1\nLOOKUP_TABLE default\n{first} 5\n" for name, first in (("a", 1), ("body", 7))
    )
    (tmp_path / "a.vtk").write_text(
        "# vtk DataFile Version 3.0\nrods\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 1 0 0 2 0 0\n"
        f"LINES 2 6\n2 0 1\n2 2 3\nCELL_DATA 2\n{arrays}"
    )
    assert read_centrelines(tmp_path / "a.vtk", unit="m").body.tolist() == [7, 5]


def test_bodies_may_be_numbered_by_points(tmp_path):
    mesh = grid(np.eye(4, 3), [(LINE, [0, 1]), (LINE, [2, 3])])
    mesh.point_data["body"] = [4, 4, 4, 4]  # one body of two pieces
    mesh.save(tmp_path / "a.vtu")
    assert read_centrelines(tmp_path / "a.vtu", unit="m").body.tolist() == [4, 4]
    mesh.point_data["body"] = [4, 4, 4, 5]
    mesh.save(tmp_path / "b.vtu")
    with pytest.raises(InputError, match="cell 1 joins points of body 4 and 5"):
        read_centrelines(tmp_path / "b.vtu", unit="m")


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ([0.0, np.inf], "cell 1: body inf is no whole number from 0 to 9007199254740991; number the bodies 0, 1, 2"),
        ([0.0, np.nan], "cell 1: body nan is no whole number"),
        ([0.0, 0.5], "cell 1: body 0.5 is no whole number"),
        ([0, -1], "cell 1: body -1 is no whole number from 0"),
        ([0.0, 2.0**53], "cell 1: body 9007199254740992.0 is no whole number"),
        (np.array([0, 2**24], np.float32), "cell 1: body 16777216.0 is no whole number from 0 to 16777215"),
        (np.array([0, 2**63], np.uint64), "cell 1: body 9223372036854775808 is no whole number"),
        (np.zeros((2, 3)), "cells have .* numbers of bodies each; one is needed"),
    ],
)
@pytest.mark.parametrize("name", ["a.vtu", "a.vtk"])
def test_numbers_of_bodies_that_are_none_are_rejected(tmp_path, body, message, name):
    grid(np.eye(4, 3), [(LINE, [0, 1]), (LINE, [2, 3])], body=np.asarray(body)).save(tmp_path / name)
    with pytest.raises(InputError, match=message):
        read_centrelines(tmp_path / name, unit="m")


def test_grids_with_other_cells_and_damaged_files_are_rejected(tmp_path, capfd):
    points = np.eye(5, 3) + np.arange(5)[:, None]
    grid(points, [(LINE, [0, 1]), (5, [2, 3, 4])]).save(tmp_path / "a.vtu")
    with pytest.raises(InputError, match=r"cell 1 is no line .*; save the lines alone"):
        read_centrelines(tmp_path / "a.vtu", unit="m")
    grid(points, [(LINE, [0, 1]), (POLYLINE, [2])]).save(tmp_path / "b.vtu")
    with pytest.raises(InputError, match="cell 1 is a line of one point"):
        read_centrelines(tmp_path / "b.vtu", unit="m")
    for name in ("c.vtu", "c.vtk"):
        grid(points, [(POLYLINE, [0, 1, 2, 3, 4])]).save(tmp_path / name)
        content = (tmp_path / name).read_bytes()
        (tmp_path / name).write_bytes(content[: len(content) // 2])
        with pytest.raises(InputError, match=f"{name}: truncated or not VTK") as error:
            read_centrelines(tmp_path / name, unit="m")
        assert "\n" not in str(error.value)
    # Cut off where a section ends, it is a valid file without cells, on which filters of VTK end the process.
    (tmp_path / "d.vtk").write_bytes(content[: content.index(b"CELLS")])
    with pytest.raises(InputError, match=r"d\.vtk: it holds no lines"):
        read_centrelines(tmp_path / "d.vtk", unit="m")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("given", [None, 3, np.zeros((2, 3))])
def test_what_is_no_file_is_rejected(given):
    with pytest.raises(InputError, match=r"^centre lines: .* is no file; give its path; of a frame, use segments_of"):
        read_centrelines(given)
