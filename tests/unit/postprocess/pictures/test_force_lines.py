"""Lines of force in pictures, exports and fields: where they are, and how thick."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from PIL import Image
from synthetic import SyntheticRun, W, u_shape, write_frame, write_run
from synthetic.forces import pressed, write_forces

from dem.errors import InputError
from dem.record.forces import read_forces
from dem.record.frames import read_frames
from dem.record.run import open_run
from postprocess.export.export import export_run
from postprocess.export.fields import BY_NAME, fields_of
from postprocess.geometry.links import centres_of_mass
from postprocess.pictures.force_lines import force_lines, force_tubes
from postprocess.pictures.render import render_run

COUNT = 3


@pytest.fixture
def row(tmp_path: Path) -> Path:
    """Three U's in a row along x; the outer two press the middle one, the right one with a fifth of the force."""
    directory = tmp_path / "row"
    made = SyntheticRun(count=COUNT, frames_per_phase=1, phases=("relax",), packing=(0.001,))
    write_run(directory, made)
    vertices = np.stack([u_shape(0.7 * W) + np.array([1.2 * W * k, 0.0, 0.004]) for k in (-1, 0, 1)])
    write_frame(directory / "frames/frame_000000.vtu", vertices, time=0.5, phase=0)
    centres = centres_of_mass(vertices)
    points = [(centres[0] + centres[1]) / 2, (centres[1] + centres[2]) / 2, centres[1] - [0, 0, 0.004]]
    write_forces(directory, pressed([(0, 1), (1, 2), (1, -1)], [5e-3, 1e-3, 2e-3], points))
    return directory


def red(path: Path) -> np.ndarray:
    """Which pixels have the colour of forces: of smarticles, which are pale, none has."""
    image = np.asarray(Image.open(path).convert("RGB")).astype(int)
    r, g, b = np.moveaxis(image, 2, 0)
    found: np.ndarray = (r > 100) & (r > 2.2 * g) & (r > 2 * b)
    return found


def test_a_line_of_force_lies_between_those_that_touch_as_thick_as_the_force(row: Path, tmp_path: Path) -> None:
    drawn = render_run(row, output=tmp_path / "f.png", forces=True, view="top", color_by="contacts", size=(600, 600))
    bare = render_run(row, output=tmp_path / "b.png", view="top", color_by="contacts", size=(600, 600))
    assert not red(bare).any()
    lines = red(drawn)
    columns = np.flatnonzero(lines.any(axis=0))
    thick = lines.sum(axis=0)
    quarter = (columns[-1] - columns[0]) // 4
    left, right = thick[columns[0] + quarter], thick[columns[-1] - quarter]
    assert left > 3 * right > 0
    # Along x alone, as the centres lie: no row far from that of the centres has any.
    rows = np.flatnonzero(lines.any(axis=1))
    assert np.ptp(rows) < 0.1 * len(lines)


def test_the_largest_force_sets_the_scale_and_none_is_too_thin(row: Path) -> None:
    forces = read_forces(read_frames(row)[0])
    lines = force_lines(forces)
    assert lines.n_cells == 5  # two for each pair, one for the floor
    normal = forces.contacts.normal[lines.cell_data["contact"]]
    tubes = force_tubes(lines, normal, thickest=1e-3, largest=5e-3)
    assert np.ptp(tubes.points[:, 1]) == pytest.approx(2e-3, rel=0.1)
    thin = force_tubes(lines, normal, thickest=1e-3, largest=5e3)
    assert np.ptp(thin.points[:, 1]) == pytest.approx(2 * 0.05e-3, rel=0.1)


def test_an_export_has_lines_with_their_forces(row: Path, tmp_path: Path) -> None:
    folder = export_run(row, to="vtp", output=tmp_path / "out", wanted=["forces"])
    mesh = pv.read(folder / "forces" / "forces_000000.vtp")
    lengths = mesh.compute_cell_sizes()["Length"]
    assert sorted(lengths) == pytest.approx([0.004, *[0.6 * W] * 4], rel=1e-6)
    columns = [mesh.cell_data[name].tolist() for name in ("first_id", "second_id", "normal_force_N", "strong")]
    by_pair = {(first, second): told for first, second, *told in zip(*columns, strict=True)}
    assert by_pair == {(0, 1): [5e-3, 1], (1, 2): [1e-3, 0], (1, -1): [2e-3, 0]}
    assert (tmp_path / "out" / "forces.pvd").is_file()
    assert export_run(row, to="glb", output=tmp_path / "out.glb", wanted=["forces"]).stat().st_size > 0


def test_fields_tell_what_presses_each_and_its_chain(row: Path) -> None:
    run, frame = open_run(row), read_frames(row)[0]
    assert {"normal_force_N", "force_chain"} <= {field.name for field in fields_of(run)}
    assert BY_NAME["normal_force_N"].take(frame, run) == pytest.approx([5e-3, 8e-3, 1e-3])
    assert BY_NAME["force_chain"].take(frame, run).tolist() == [0, 0, 1]


def test_a_run_that_records_none_says_how_to(tmp_path: Path) -> None:
    run = write_run(tmp_path / "run", SyntheticRun(count=COUNT, frames_per_phase=1))
    with pytest.raises(InputError, match=r"records no forces to draw; .*recording.contact_forces: true"):
        render_run(run, forces=True)
    with pytest.raises(InputError, match=r"records no forces; .*recording.contact_forces: true"):
        export_run(run, to="vtp", wanted=["forces"])
    assert not {"normal_force_N", "force_chain"} & {field.name for field in fields_of(open_run(run))}
