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
        (CSV.replace("body", "particle"), None, "it has no column body; a CSV file needs columns body, x, y, z"),
        (CSV.replace("5, 0, 0, 9", "5, 0, 0, x"), None, "a value is no number"),
        (CSV.replace("5, 0, 0, 9", "5, 0, , 9"), None, "line 4 needs a whole number as body and three finite coord"),
        (CSV.replace("5, 0, 0, 9", "7, 0, 0, 9"), None, "body 7 has one point"),
        (CSV[: CSV.index("\n") + 1], None, "it holds no segment"),
        ("", None, "cannot read centre lines .*; a CSV file needs columns"),
    ],
)
def test_tables_that_say_too_little_are_rejected(tmp_path, text, unit, message):
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        read_centrelines(tmp_path / "a.csv", unit=unit)


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
