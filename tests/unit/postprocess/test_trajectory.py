"""GSD: capsules placed by position, orientation and shape are the strands that contacts see."""

import importlib.util
import json
from dataclasses import replace

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation
from synthetic import RADIUS, SyntheticRun, write_run

from dem.errors import InputError
from dem.record.run import Run
from postprocess.export import export_run
from postprocess.geometry.links import strands
from postprocess.measures.contacts import chain_of
from postprocess.trajectory import capsules_of, orientations, shapes_of

HAS_GSD = importlib.util.find_spec("gsd") is not None


@pytest.fixture
def pile(tmp_path):
    return write_run(tmp_path / "pile", SyntheticRun(frames_per_phase=2, floor_z=-0.003))


def placed(positions, quaternions, shapes, types):
    """Ends of capsules (P, 2, 3) by the rules of the schema: the shape is turned, then moved."""
    vertices = np.array([shapes[k]["vertices"] for k in types])
    turned = Rotation.from_quat(np.asarray(quaternions, np.float64), scalar_first=True).as_matrix()
    return np.einsum("pij,pkj->pki", turned, vertices) + np.asarray(positions)[:, None]


def assert_same_ends(found, wanted, tolerance):
    """Ends agree, in either order."""
    straight, swapped = (np.abs(found - each).max(axis=(1, 2)) for each in (wanted, wanted[:, ::-1]))
    assert np.minimum(straight, swapped).max() < tolerance


@pytest.mark.parametrize(
    "directions",
    [np.vstack([np.eye(3), -np.eye(3)]), np.random.default_rng(0).normal(size=(200, 3))],
    ids=["axes", "random"],
)
def test_orientations_turn_z_along_the_capsule(directions):
    quaternions = orientations(directions)
    assert np.linalg.norm(quaternions, axis=1) == pytest.approx(1.0)
    turned = Rotation.from_quat(quaternions, scalar_first=True).apply([0.0, 0.0, 1.0])
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    assert np.abs((turned * unit).sum(axis=1)) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("rows", [1, 2])
def test_capsules_are_the_strands_that_contacts_see(pile, rows):
    scene = yaml.safe_load((pile / "scene.yaml").read_text(encoding="utf-8"))
    scene["fidelity"] = {"rows": rows, "pitch": 1.0}
    (pile / "scene.yaml").write_text(yaml.safe_dump(scene), encoding="utf-8")
    run = Run(pile)
    frame, chain = run.frames[-1], chain_of(run)
    capsules = capsules_of(frame, run)
    axes = strands(frame.vertices, chain)
    wanted = np.stack([axes[:, :, :-1], axes[:, :, 1:]], axis=3).reshape(-1, 2, 3)
    assert len(wanted) == 12 * rows * 3
    shapes = shapes_of(capsules)
    quaternions = orientations(capsules.ends[:, 1] - capsules.ends[:, 0])
    found = placed(capsules.ends.mean(axis=1), quaternions, shapes, capsules.type_of)
    assert_same_ends(found, wanted, 1e-12)
    assert [shape["rounding_radius"] for shape in shapes] == [run.manifest.sphere_diameter_m / 2] * 3
    # OVITO 3.17 opens no file with other polyhedra than capsules along z.
    assert all(np.array(shape["vertices"])[:, :2].tolist() == [[0.0, 0.0]] * 2 for shape in shapes)
    json.dumps(shapes)
    # The outermost surfaces of the rows are the faces of the flat bar.
    apart = np.linalg.norm(axes[:, 0, 1] - axes[:, -1, 1], axis=1)
    assert apart + chain.diameter == pytest.approx(chain.width if rows > 1 else chain.diameter)


@pytest.mark.skipif(not HAS_GSD, reason="the package gsd is not installed; the arrays that it would write are tested")
def test_a_trajectory_is_read_back(pile, tmp_path):
    import gsd.hoomd  # noqa: PLC0415

    path = export_run(
        pile, to="gsd", every_frame=True, output=tmp_path / "all.gsd", unwanted=["local_packing_fraction"]
    )
    run = Run(pile)
    with gsd.hoomd.open(path, "r") as file:
        assert len(file) == len(run.frames) == 8
        for number, found in enumerate(file):
            frame = run.frames[number]
            capsules = capsules_of(frame, run)
            assert found.configuration.step == number
            assert found.log["time_s"] == pytest.approx(frame.time)
            ends = placed(
                found.particles.position,
                found.particles.orientation,
                found.particles.type_shapes,
                found.particles.typeid,
            )
            assert_same_ends(ends, capsules.ends, 1e-6 * RADIUS * 10)  # single precision
            assert (np.abs(ends) <= found.configuration.box[:3] / 2).all()
            assert found.particles.body.tolist() == frame.smarticle_ids[capsules.body].tolist()
            contacts = found.log["particles/contacts"]
            assert contacts.tolist() == frame.contacts[capsules.body].tolist()


def test_links_without_length_are_spheres(tmp_path):
    run = Run(write_run(tmp_path / "straight", SyntheticRun(frames_per_phase=2)))
    capsules = capsules_of(run.frames[-1], run)
    barbs = capsules.type_of != 1
    ends = np.where(barbs[:, None, None], capsules.ends[:, :1], capsules.ends)
    shapes = shapes_of(replace(capsules, ends=ends))
    assert [shape["type"] for shape in shapes] == ["Sphere", "ConvexPolyhedron", "Sphere"]
    assert shapes[0]["diameter"] == 2 * capsules.radii[0]


@pytest.mark.skipif(HAS_GSD, reason="the package gsd is installed")
def test_without_the_package_nothing_is_left(pile):
    before = sorted(pile.rglob("*"))
    with pytest.raises(ModuleNotFoundError) as caught:
        export_run(pile, to="gsd", unwanted=["local_packing_fraction"])
    assert caught.value.name.partition(".")[0] == "gsd"  # from which the command line makes its message
    assert sorted(pile.rglob("*")) == before


def test_a_trajectory_without_smarticles_is_rejected(pile):
    with pytest.raises(InputError, match="nothing to export: the run has no wall, floor"):
        export_run(pile, to="gsd", unwanted=["smarticles"])
