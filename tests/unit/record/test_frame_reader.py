import meshio
import numpy as np
import pytest

from dem.errors import InputError
from dem.record.columns import FIELDS
from postprocess import read_frame, read_frames


def assert_one_line(error, *parts):
    message = str(error.value)
    assert "\n" not in message
    assert "Traceback" not in message
    for part in parts:
        assert part in message


def test_frame_holds_what_was_written(tmp_path, write_frame, scene):
    vertices = scene(3, 1)
    torque = np.arange(9.0)
    path = write_frame(
        tmp_path, vertices, time=1.25, phase=2, floor_z=-0.01, contacts=[4, 0, 2], extra={"torque_N_m": torque}
    )
    frame = read_frame(path)
    assert (frame.time, frame.phase, frame.floor_z, frame.count) == (1.25, 2, -0.01, 3)
    np.testing.assert_array_equal(frame.vertices, vertices)
    np.testing.assert_array_equal(frame.smarticle_ids, [100, 101, 102])
    np.testing.assert_array_equal(frame.contacts, [4, 0, 2])
    np.testing.assert_array_equal(frame.link_velocity, np.arange(27.0).reshape(3, 3, 3))
    assert frame.link_angular_velocity.shape == (3, 3, 3)
    assert list(frame.cell_data) == ["torque_N_m"]
    np.testing.assert_array_equal(frame.cell_data["torque_N_m"], torque.reshape(3, 3))
    with pytest.raises(ValueError, match="read-only"):
        frame.vertices[0] = 0


def test_frames_are_a_sequence_in_time_order(make_run):
    frames = read_frames(make_run([(0, 0.0), (1, 0.0), (1, 0.0), (2, 0.0)]))
    assert len(frames) == 4
    np.testing.assert_allclose(frames.times, [0, 0.1, 0.2, 0.3])
    assert [frame.time for frame in frames] == pytest.approx([0, 0.1, 0.2, 0.3])
    assert frames[-1].time == pytest.approx(0.3)
    assert [frame.phase for frame in frames[1:3]] == [1, 1]
    assert len(frames[::2]) == 2
    with pytest.raises(IndexError):
        frames[4]


@pytest.mark.parametrize("phase", ["shake", -1, 0.5, None])
def test_what_is_no_number_of_a_phase_is_rejected(make_run, phase):
    frames = read_frames(make_run([(0, 0.0), (1, 0.0), (1, 0.0)]))
    assert [len(frames.in_phase(number)) for number in (0, np.int64(1), 2)] == [1, 2, 0]
    with pytest.raises(InputError, match=r"^in_phase: .* is no number of a phase; give one from 0"):
        frames.in_phase(phase)


def test_frames_after_a_time(make_run):
    """Those at that very time are not later, and no file is read for it."""
    run = make_run([(0, 0.0), (0, 0.0), (0, 0.0), (0, 0.0)])
    for path in (run / "frames").glob("*.vtu"):
        path.unlink()
    frames = read_frames(run)
    assert [len(frames.after(time)) for time in (-1.0, 0.0, 0.05, 0.3 - 0.2, 0.1 + 0.1, 0.3)] == [4, 3, 3, 2, 1, 0]
    np.testing.assert_allclose(frames.after(0.15).times, [0.2, 0.3])
    assert len(frames[1:].after(0.15)) == 2


def test_frames_are_read_lazily(run):
    (run / "frames" / "frame_000001.vtu").unlink()
    frames = read_frames(run)
    assert frames[0].count == 1
    with pytest.raises(InputError, match=r"frame_000001\.vtu: No such file"):
        frames[1]


@pytest.mark.parametrize("kept", [0, 10, 400, 0.5, 0.95])
def test_truncated_frame(tmp_path, write_frame, kept, capfd):
    path = write_frame(tmp_path)
    data = path.read_bytes()
    path.write_bytes(data[: kept if isinstance(kept, int) else int(kept * len(data))])
    with pytest.raises(InputError, match="cannot read frame") as error:
        read_frame(path)
    assert_one_line(
        error, str(path), "truncated or not VTK", "remove its line from", "frames.pvd", "scene.yaml anew elsewhere"
    )
    assert capfd.readouterr() == ("", "")


def test_damaged_bytes_in_a_whole_file(tmp_path, write_frame):
    path = write_frame(tmp_path)
    text = path.read_text()
    middle = text.index("eJ") + 8
    path.write_text(text[:middle] + "AAAAAAAA" + text[middle + 8 :])
    with pytest.raises(InputError, match="truncated or not VTK"):
        read_frame(path)


@pytest.mark.parametrize("name", FIELDS)
def test_missing_cell_data(tmp_path, write_frame, name):
    path = write_frame(tmp_path, drop=name)
    with pytest.raises(InputError, match=f"'{name}' is missing") as error:
        read_frame(path)
    assert_one_line(error, str(path))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda mesh: mesh.points.__setitem__((3, 0), np.nan), "a point is not finite"),
        (lambda mesh: mesh.cell_data["link"][0].__setitem__(slice(2), [1, 0]), "smarticle-major"),
        (lambda mesh: mesh.cell_data["time_s"][0].__setitem__(2, 5.0), "'time_s' must be finite and the same"),
        (lambda mesh: mesh.cell_data["velocity_m_per_s"].__setitem__(0, np.zeros(6)), "'velocity_m_per_s' has shape"),
        (lambda mesh: mesh.cells[0].data.__setitem__(0, [0, 2]), "tip, hinge, hinge, tip"),
    ],
)
def test_frame_that_breaks_the_contract(tmp_path, write_frame, change, message):
    with pytest.raises(InputError, match=message):
        read_frame(write_frame(tmp_path, change=change))


def test_frame_with_other_cells(tmp_path):
    path = tmp_path / "frame.vtu"
    meshio.vtu.write(path, meshio.Mesh(np.eye(3), [("triangle", np.array([[0, 1, 2]]))]))
    with pytest.raises(InputError, match="one block of lines"):
        read_frame(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "No such file"),
        ("<VTKFile><Collec", "ParseError"),
        ("<VTKFile/>", "lists no frame"),
        ('<VTKFile><DataSet timestep="now" file="a"/></VTKFile>', "entry 0 lacks"),
        ('<V><DataSet timestep="1" file="a"/><DataSet timestep="0" file="b"/></V>', "do not ascend"),
        ('<V><DataSet timestep="1" file="../a.vtu"/></V>', "'../a.vtu' lies outside of the run directory"),
        ('<V><DataSet timestep="1" file="/etc/passwd"/></V>', "'/etc/passwd' lies outside of the run directory"),
    ],
)
def test_bad_list_of_frames(tmp_path, text, message):
    if text is not None:
        (tmp_path / "frames.pvd").write_text(text)
    with pytest.raises(InputError, match=message) as error:
        read_frames(tmp_path)
    assert_one_line(error, "frames.pvd")
