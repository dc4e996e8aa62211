"""Strings of a strain test, against what the simulator's own chain says."""

import json

import numpy as np
import pytest
import yaml
from synthetic import SyntheticRun, mesh_of, write_manifest, write_run

from dem.body.chain import Chain
from dem.body.particle import Boxes, Particle, SphereChain
from dem.body.state import State
from dem.record.frames import FrameWriter, read_frames
from dem.record.run import open_run
from postprocess.bodies.meshes import RunBoundaries

W, T, GAP, LENGTH, SPEED = 0.0467, 0.0095, 0.00105, 0.1, 0.02
BOXES = Boxes(middle_length=W, barb_length=W, thickness_normal=0.021, thickness_in_plane=T, density=1250.0)
PARTICLE = Particle(BOXES, SphereChain(rows=1, diameter=T, pitch=0.001))


def laid_out(directory, count, tied_at):
    """A run of a chain as the simulator lays it out, held so for a second of its strain; the simulator's knots."""
    chain = Chain(PARTICLE, count, GAP)
    poses = chain.poses()
    turns = np.array([turn.as_matrix() for turn in poses.rotations])
    state = State.rigid(BOXES, poses.positions, turns, np.zeros((count, 3)), np.zeros((count, 3)))
    made = SyntheticRun(count=count, phases=("relax", "strain"), frames_per_phase=1, packing=(0.1, 0.1))
    write_run(directory, made)
    size = {"middle_length_m": W, "barb_length_m": W, "sphere_diameter_m": T, "thickness_normal_m": 0.021}
    write_manifest(directory, made, planar=True, thickness_in_plane_m=T, **size)
    phases = [
        {"type": "arrange", "gap_m": GAP},
        {"type": "strain", "speed_m_per_s": SPEED, "tied_at": tied_at, "string_length_m": LENGTH},
    ]
    (directory / "scene.yaml").write_text(yaml.safe_dump({"schema_version": 1, "phases": phases}))
    for name in ("run.json", "done.json"):
        content = json.loads((directory / name).read_text())
        content["phases"][0]["type"] = "arrange"
        (directory / name).write_text(json.dumps(content))
    writer = FrameWriter(directory)
    start = content["phases"][1]["start_s"]
    for time, phase in ((start, 0), (start, 1), (start + 1.0, 1)):
        writer.write(mesh_of(state.vertices, time=time, phase=phase), time)
    ties = chain.ties(tied_at)
    return np.array(
        [
            state.link_positions[tie.smarticle, tie.link]
            + tie.along * state.link_rotations[tie.smarticle, tie.link, :, 0]
            for tie in ties
        ]
    )


@pytest.mark.parametrize("tied_at", ["tip", "axis"])
@pytest.mark.parametrize("count", [2, 3, 6])
def test_strings_are_tied_where_the_simulator_ties_them(tmp_path, count, tied_at):
    knots = laid_out(tmp_path, count, tied_at)
    run, frames = open_run(tmp_path), read_frames(tmp_path)
    strings = RunBoundaries(run).strings
    assert len(strings.lines(frames[0])) == 0
    first, later = strings.lines(frames[1]), strings.lines(frames[2])
    assert first[:, 0] == pytest.approx(knots, abs=1e-12)
    # Straight, as long as a string is, the other ends outwards on the axis.
    assert np.linalg.norm(first[:, 1] - first[:, 0], axis=1) == pytest.approx([LENGTH, LENGTH])
    assert first[:, 1, 1:] == pytest.approx(np.zeros((2, 2)), abs=1e-12)
    assert first[0, 1, 0] < first[0, 0, 0] < first[1, 0, 0] < first[1, 1, 0]
    assert later[:, 1] - first[:, 1] == pytest.approx(np.array([[0.0, 0.0, 0.0], [SPEED, 0.0, 0.0]]))
