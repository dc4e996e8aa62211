"""Forces at contacts: points made into contacts, and the file that docs/reference/files.md promises, read by VTK."""

from pathlib import Path

import numpy as np
import pytest
import pyvista as pv

from dem.body.forces import BOUNDARIES, FLOOR, NONE, at_boundaries, at_links, contacts_of_points
from dem.record.columns import FORCE_FIELDS
from dem.record.forces import force_mesh
from dem.record.frames import FrameWriter
from dem.record.names import FORCE


def some() -> dict[str, np.ndarray]:
    """Two points of links 0 of 3 and 1 of 1, listed once each way; one on the floor; one without a load."""
    high, low, floor = int(at_links(3, 0)), int(at_links(1, 1)), int(at_boundaries(FLOOR))
    return {
        "first": np.array([high, low, low, low]),
        "second": np.array([low, high, floor, at_links(2, 2)]),
        "loads": np.array([1.0, 3.0, 5.0, 0.0]),
        "points": np.array([[0.0, 0, 0], [4.0, 0, 0], [7.0, 0, 0], [0.0, 0, 0]]),
        "friction": np.array([[0.1, 0, 0], [0.4, 0, 0], [0.0, 0, 0], [0.0, 0, 0]]),
        "forces": np.array([[0.1, 0, 1.0], [0.4, 0, -3.0], [0.0, 0, 5.0], [0.0, 0, 0]]),
    }


def test_points_of_one_pair_of_links_are_one_contact() -> None:
    found = contacts_of_points(**some())
    order = np.argsort(found.normal)
    assert found.smarticles[order].tolist() == [[1, 3], [1, NONE]]
    assert found.links[order].tolist() == [[1, 0], [1, NONE]]
    assert found.boundaries[order].tolist() == [NONE, BOUNDARIES.index("floor")]
    assert found.normal[order] == pytest.approx([4.0, 5.0])
    # The one with the lower number is first: what acts on it is what the other way round acts on the other.
    np.testing.assert_allclose(found.forces[order[0]], [0.3, 0, -4.0])
    assert found.tangential[order] == pytest.approx([0.3, 0.0])
    np.testing.assert_allclose(found.points[order], [[3.0, 0, 0], [7.0, 0, 0]])


def test_a_file_has_a_line_per_contact_with_all_fields(tmp_path: Path) -> None:
    centres = np.arange(12.0).reshape(4, 3)
    found = contacts_of_points(**some())
    writer = FrameWriter(tmp_path, FORCE)
    writer.write(force_mesh(found, centres, time=0.5, phase=2), 0.5)
    mesh = pv.read(tmp_path / "forces" / "force_000000.vtu")
    assert set(mesh.cell_data.keys()) == set(FORCE_FIELDS)
    ends = mesh.points.reshape(-1, 2, 3)
    pair = found.boundaries == NONE
    np.testing.assert_allclose(ends[pair], [[centres[1], centres[3]]])
    np.testing.assert_allclose(ends[~pair], [[centres[1], [7.0, 0, 0]]])
    np.testing.assert_allclose(mesh.cell_data["normal_force_N"], found.normal)
    np.testing.assert_allclose(mesh.cell_data["force_N"], found.forces)
    assert set(mesh.cell_data["time_s"]) == {0.5}
    assert 'file="forces/force_000000.vtu"' in (tmp_path / "forces.pvd").read_text(encoding="utf-8")


def test_no_contact_is_a_file_that_vtk_reads(tmp_path: Path) -> None:
    none = {name: values[:0] for name, values in some().items()}
    FrameWriter(tmp_path, FORCE).write(force_mesh(contacts_of_points(**none), np.zeros((4, 3)), time=0, phase=0), 0)
    assert pv.read(tmp_path / "forces" / "force_000000.vtu").n_cells == 0
