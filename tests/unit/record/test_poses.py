"""Files of start poses: what is read from them, and what is rejected in one line."""

import re
from pathlib import Path

import meshio
import numpy as np
import pytest

from dem.errors import InputError
from dem.record.poses import read_poses

TWO = "body,x [mm],y [mm],z [mm]\n7,0,0,1\n7,0,2,1\n3,1,0,5\n3,1,0,6\n7,4,2,1\n"


def write(folder: Path, text: str, name: str = "poses.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_points_of_a_body_are_joined_in_order_and_bodies_sorted(tmp_path: Path) -> None:
    first, second = read_poses(write(tmp_path, "\ufeff" + TWO))
    assert (first.name, second.name) == ("body 3 (line 4)", "body 7 (line 2)")
    np.testing.assert_allclose(first.segments, [[[1e-3, 0, 5e-3], [1e-3, 0, 6e-3]]])
    np.testing.assert_allclose(second.segments[:, 1], [[0, 2e-3, 1e-3], [4e-3, 2e-3, 1e-3]])
    assert (first.kind, second.kind) == (None, None)


def test_bars_that_meet_in_one_point_have_numbers(tmp_path: Path) -> None:
    text = "body,bar,kind,x,y,z\n" + "".join(f"0,{k},2,0,0,0\n0,{k},2,{k},1,0\n" for k in range(3))
    (body,) = read_poses(write(tmp_path, text), unit="cm")
    np.testing.assert_allclose(body.segments[:, 0], 0)
    np.testing.assert_allclose(body.segments[:, 1, 0], [0, 1e-2, 2e-2])
    assert body.kind == 2


def test_frames_of_runs_are_in_metres_above_their_floor(tmp_path: Path) -> None:
    points = np.arange(24.0).reshape(-1, 3)
    data = {"smarticle_id": [4, 1, 1, 1], "floor_z_m": [2.0] * 4, "kind": [1, 0, 0, 0]}
    cells = [("line", np.arange(8).reshape(-1, 2))]
    mesh = meshio.Mesh(points, cells, cell_data={name: [np.array(values)] for name, values in data.items()})
    mesh.write(tmp_path / "frame.vtu", file_format="vtu")
    first, second = read_poses(tmp_path / "frame.vtu")
    assert (first.name, len(first.segments), first.kind) == ("body 1", 3, 0)
    np.testing.assert_allclose(second.segments, [[[0, 1, 0], [3, 4, 3]]])
    with pytest.raises(InputError, match="has the units m and mm, by its header and the key unit; give one"):
        read_poses(tmp_path / "frame.vtu", unit="mm")
    mesh.cell_data["kind"] = [np.array([1, 0, 0, 2])]
    mesh.write(tmp_path / "frame.vtu", file_format="vtu")
    with pytest.raises(InputError, match="body 1 has several kinds"):
        read_poses(tmp_path / "frame.vtu")
    mesh.cell_data["time_s"] = [np.array([1.0, 1.0, 1.5, 1.5])]
    mesh.write(tmp_path / "frame.vtu", file_format="vtu")
    with pytest.raises(InputError, match="it holds 2 times by its cell data time_s; keep one"):
        read_poses(tmp_path / "frame.vtu")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "it has no column body, x, y, z"),
        ("body,x,y\n", "it has no column z"),
        ("body,x,y,z,x\n", "column 'x' is unknown, or there twice"),
        ("body,x,y,z,mass\n", "column 'mass' is unknown"),
        ("body,x [mm],y [mm],z [mm]\n", "it holds no point"),
        (TWO.replace("0,2,1", "0,2,1,5"), "line 3 has 5 cells, the header has 4"),
        (TWO.replace("0,2,1", "0,nan,1"), "line 3: y is 'nan', not a finite number"),
        (TWO.replace("0,2,1", "0,1_0,1"), "line 3: y is '1_0', not a finite number"),
        (TWO.replace("0,2,1", "0,,1"), "line 3: y is '', not a finite number"),
        (TWO.replace("7,0,2", "7.5,0,2"), "line 3: body is '7.5'; give a whole number from 0"),
        (TWO.replace("7,0,2", "-7,0,2"), "line 3: body is '-7'; give a whole number from 0"),
        (TWO.replace("7,0,2", "1e30,0,2"), "line 3: body is '1e30'; give a whole number from 0"),
        (TWO.replace("3,1,0,6", "9,1,0,6"), "line 4: body 3 has one point"),
        (TWO.replace("x [mm]", "x [cm]"), "has the units cm and mm"),
        (TWO.replace("[mm]", "[inch]"), "unit 'inch' is unknown"),
        (TWO.replace(" [mm]", ""), "states no unit of length; add it to the header, x [mm], or give unit: mm"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(text: str, message: str, tmp_path: Path) -> None:
    path = write(tmp_path, text)
    with pytest.raises(InputError, match=re.escape(message)) as raised:
        read_poses(path)
    assert str(path) in str(raised.value)
    assert "\n" not in str(raised.value)


def test_files_of_other_kinds(tmp_path: Path) -> None:
    for path, message in (
        (tmp_path / "absent.csv", "No such file"),
        (tmp_path / "absent.vtu", "No such file"),
        (write(tmp_path, "x", "poses.txt"), r"poses are read from \.csv and \.vtu: got \.txt"),
        (write(tmp_path, "<VTK", "poses.vtu"), "truncated or not VTK"),
    ):
        with pytest.raises(InputError, match=message):
            read_poses(path)
    (tmp_path / "latin.csv").write_bytes(b"body,x,y,z\n\xff")
    with pytest.raises(InputError, match="no CSV file in UTF-8"):
        read_poses(tmp_path / "latin.csv")
