"""GSD: capsules placed by position, orientation and shape are the strands that contacts see."""

import importlib.util
import json
from dataclasses import replace

import numpy as np
import pytest
import yaml
from scenes import make_boxes
from scipy.spatial.transform import Rotation
from synthetic import RADIUS, SyntheticRun, write_manifest, write_run

from dem.body.state import State
from dem.errors import InputError
from dem.record.frame import centreline_mesh
from dem.record.frames import FrameWriter
from dem.record.run import Run
from postprocess.export import export_run
from postprocess.geometry.links import strands
from postprocess.measures.contacts import chain_of
from postprocess.trajectory import capsules_of, motion_of, shapes_of

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
    found = placed(capsules.ends.mean(axis=1), motion_of(capsules, frame).orientation, shapes, capsules.type_of)
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


def moving(directory, rows):
    """A run of smarticles that move and turn as rigid bodies, and its state."""
    run, random = SyntheticRun(count=4, phases=("deposit",)), np.random.default_rng(2)
    write_manifest(directory, run)
    write_scene = {"schema_version": 1, "fidelity": {"rows": rows, "pitch": 1.0}, "phases": [{"type": "deposit"}]}
    (directory / "scene.yaml").write_text(yaml.safe_dump(write_scene), encoding="utf-8")
    places, velocities, spins = random.normal(size=(3, 4, 3))
    turns = Rotation.random(4, rng=random).as_matrix()
    state = State.rigid(make_boxes(), 0.02 * places, turns, velocities, spins)
    mesh = centreline_mesh(
        state.vertices, velocities=state.link_velocities, spins=state.link_spins,
        contacts=np.zeros(4, int), time=0.0, floor=0.0, phase=0,
    )  # fmt: skip
    FrameWriter(directory).write(mesh, 0.0)
    return Run(directory), state


def turn_back(quaternions, vectors):
    return Rotation.from_quat(quaternions, scalar_first=True).inv().apply(vectors)


@pytest.mark.skipif(not HAS_GSD, reason="the package gsd is not installed")
@pytest.mark.parametrize("rows", [1, 2])
def test_a_trajectory_has_the_energy_and_the_momenta_of_the_run_by_the_rules_of_hoomd(tmp_path, rows):
    import gsd.hoomd  # noqa: PLC0415

    run, state = moving(tmp_path, rows)
    path = export_run(run.path, to="gsd", output=tmp_path / "one.gsd", unwanted=["local_packing_fraction"])
    with gsd.hoomd.open(path, "r") as file:
        found = file[0]
    particles = found.particles
    assert particles.N == 4 * 3 * rows
    assert particles.mass.sum() == pytest.approx(4 * make_boxes().mass, rel=1e-6)
    # HOOMD-blue, ComputeThermo: s = conj(q) p / 2 is the angular momentum in the particle's frame.
    q, p = np.float64(particles.orientation), np.float64(particles.angmom)
    inverse = q * [1, -1, -1, -1]
    product = inverse[:, :1] * p[:, 1:] + p[:, :1] * inverse[:, 1:] + np.cross(inverse[:, 1:], p[:, 1:])
    spin = 0.5 * product
    real = 0.5 * (inverse[:, 0] * p[:, 0] - (inverse[:, 1:] * p[:, 1:]).sum(axis=1))
    assert np.abs(real).max() < 1e-6 * np.abs(spin).max()
    rotation = (spin**2 / particles.moment_inertia).sum()
    translation = (particles.mass[:, None] * np.float64(particles.velocity) ** 2).sum()
    assert 0.5 * (translation + rotation) == pytest.approx(state.kinetic_energy, rel=1e-5)
    own = Rotation.from_quat(q, scalar_first=True).apply(spin)
    # Capsules of barbs are not about the links' centres, since they end at the tips: the orbital part is that of links.
    orbital = np.cross(state.link_positions, make_boxes().link_masses[:, None] * state.link_velocities)
    assert own.sum(axis=0) == pytest.approx(state.angular_momentum - orbital.sum(axis=(0, 1)), rel=1e-4)
    # Whole bodies, in double precision.
    log = found.log
    assert log["bodies/mass_kg"] == pytest.approx([make_boxes().mass] * 4)
    np.testing.assert_allclose(log["bodies/position_m"], state.positions)
    spins = turn_back(log["bodies/orientation"], log["bodies/angular_velocity_rad_per_s"])
    energy = (log["bodies/mass_kg"][:, None] * log["bodies/velocity_m_per_s"] ** 2).sum()
    energy += (log["bodies/moment_of_inertia_kg_m2"] * spins**2).sum()
    assert 0.5 * energy == pytest.approx(state.kinetic_energy)


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
