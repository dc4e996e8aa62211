"""What is drawn and measured of robots whose bodies are thicker in the plane than their barbs."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from scenes import chain
from scipy.spatial.transform import Rotation
from synthetic import SyntheticRun, mesh_of, write_manifest, write_run

from dem.body.chain import Chain
from dem.body.particle import HINGE_CLEARANCE, INWARDS, Boxes, Particle, SphereChain
from dem.body.state import State
from dem.record.frames import FrameWriter
from dem.record.run import open_run
from dem.scene.reading import dump_scene
from postprocess.bodies.meshes import link_boxes
from postprocess.geometry import links
from postprocess.measures.contacts import chain_of

W, L, T1, BARB, BODY = 0.0467, 0.042, 0.021, 0.0095, 0.0213
SPREAD = np.array([[0.3, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.0, 0.0]])  # m/s, of barb 1, middle link, barb 2


def robot(angles: tuple[float, float] = (90.0, 90.0)) -> Boxes:
    return Boxes(
        middle_length=W,
        barb_length=L,
        thickness_normal=T1,
        thickness_in_plane=BARB,
        density=1250.0,
        angles=(math.radians(angles[0]), math.radians(angles[1])),
        middle_thickness_in_plane=BODY,
    )


PARTICLE = Particle(robot(), SphereChain(rows=1, diameter=BARB, pitch=0.2 * BARB))
LAYOUT = Chain(PARTICLE, 2, 0.001)


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """A run of two such robots, hooked, about to be strained; the first one's links move against each other."""
    poses = LAYOUT.poses()
    turns = np.array([turn.as_matrix() for turn in poses.rotations])
    state = State.rigid(robot(), poses.positions, turns, np.zeros((2, 3)), np.zeros((2, 3)))
    made = SyntheticRun(count=2, phases=("relax", "strain"), frames_per_phase=1, packing=(0.1, 0.1))
    write_run(tmp_path, made)
    size = {"middle_length_m": W, "barb_length_m": L, "sphere_diameter_m": BARB, "thickness_normal_m": T1}
    size |= {"thickness_in_plane_m": BARB, "middle_thickness_in_plane_m": BODY}
    write_manifest(tmp_path, made, planar=True, **size)
    scene = chain({"phases.0.gap_m": 0.001, "phases.1.tied_at": "axis"})
    (tmp_path / "scene.yaml").write_text(dump_scene(scene))
    for name in ("run.json", "done.json"):
        content = json.loads((tmp_path / name).read_text())
        content["phases"][0]["type"] = "arrange"
        (tmp_path / name).write_text(json.dumps(content))
    mesh = mesh_of(state.vertices, time=0.5, phase=1)
    velocities = np.zeros((6, 3))
    velocities[:3] = SPREAD
    mesh.cell_data["velocity_m_per_s"] = [velocities]
    FrameWriter(tmp_path).write(mesh, 0.5)
    return tmp_path


def test_boxes_are_as_thick_as_their_links() -> None:
    vertices = robot().vertices[None]
    mesh = link_boxes(
        vertices * 1e3, thickness_normal=1e3 * T1, thickness_in_plane=[1e3 * t for t in (BARB, BODY, BARB)]
    )
    low, high = mesh.points.min(axis=0) / 1e3, mesh.points.max(axis=0) / 1e3
    # The body shows below the hinges, barbs beside them.
    assert high - low == pytest.approx([W + BARB, L + BODY / 2, T1])
    assert mesh.triangulate().volume * 1e-9 == pytest.approx(T1 * (W * BODY + 2 * L * BARB), rel=1e-6)


@pytest.mark.parametrize("angles", [(90.0, 90.0), (30.0, 100.0)])
@pytest.mark.parametrize("pitch", [0.2, 1.0])
def test_spheres_are_where_the_simulator_puts_them(angles: tuple[float, float], pitch: float, run: Path) -> None:
    boxes = robot(angles)
    particle = Particle(boxes, SphereChain(rows=1, diameter=BARB, pitch=pitch * BARB))
    turn = Rotation.from_euler("xyz", [0.3, -1.1, 2.0]).as_matrix()
    known = chain_of(open_run(run))
    chain = links.Chain(
        diameter=known.diameter, rows=known.rows, width=known.width, pitch=pitch * BARB, bulge=known.bulge
    )
    found = links.spheres((boxes.vertices @ turn.T)[None], chain)[0]
    expected = particle.centres @ turn.T
    assert found.shape == expected.shape
    apart = np.linalg.norm(found[:, None] - expected, axis=2)
    assert apart.min(axis=0).max() < 1e-12
    assert apart.min(axis=1).max() < 1e-12
    assert (links._CLEARANCE, links._INWARDS) == (HINGE_CLEARANCE, INWARDS)
