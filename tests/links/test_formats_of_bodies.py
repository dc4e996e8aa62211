"""Frames in one file, and capsules for GSD, of bodies that are no smarticles."""

import importlib.util
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import small
from scipy.spatial.transform import Rotation

from dem.body.placement import Poses
from dem.body.state import RigidState
from dem.engine.links.shapes import rigid_shape
from dem.record.frame import RecordedBars, segment_mesh
from dem.record.names import MANIFEST, SCENE
from dem.record.run import Run
from dem.record.vtkhdf import read_step
from dem.run.build import _frame_writer, build_engine
from dem.run.run import manifest
from dem.scene.reading import dump_scene
from postprocess.measures.caging import cages
from postprocess.measures.contacts import strands_of
from postprocess.trajectory import capsules_of, motion_of, shapes_of, write_trajectory
from smarticles.commands.compare import compare_bits

SHAPES: dict[str, dict[str, Any]] = {
    "rod": {"length_m": 0.014},
    "round rod": {"shape": "rod", "length_m": 0.014, "diameter_m": 0.8e-3},
    "staple": {"crown_m": 0.01, "leg_m": [0.007, 0.005], "angle_deg": [70, 110], "twist_deg": [0, 40]},
    "z": {"middle_m": 0.01, "arm_m": 0.006, "angle_deg": 60, "diameter_m": 0.8e-3},
    "ring": {"radius_m": 0.005},
    "cross": {"arm_m": 0.006},
}


def written(
    out: Path,
    *names: str,
    count: int,
    frames: str = "vtkhdf",
    fidelity: str = "draft",
    places: NDArray[np.float64] | None = None,
    turns: Rotation | None = None,
) -> tuple[RigidState, Run]:
    """Bodies, apart and at random orientations if not given, and a run directory with one frame of them."""
    particle = [{"shape": name, **SHAPES[name]} for name in names]
    changes = {"count": count, "particle": particle, "recording.frames": frames, "fidelity": fidelity}
    scene = small({"engine": "links", **changes})
    out.mkdir(exist_ok=True)
    steps = [1e-5] * len(scene.phases)
    manifest(scene, out, steps=steps, command="test", made_by=("links", "1"), threads=1).write(out / MANIFEST)
    (out / SCENE).write_text(dump_scene(scene), encoding="utf-8")
    engine = build_engine(scene, 1e-5)
    assert scene.mixture is not None
    turns = Rotation.random(count, rng=np.random.default_rng(1)) if turns is None else turns
    places = np.arange(1, count + 1)[:, None] * [0.0, 0.0, 0.05] if places is None else places
    engine.add(Poses(places, tuple(turns), scene.mixture.of))
    state = engine.state().bodies
    assert state is not None
    mesh = segment_mesh(state, contacts=np.zeros(count, int), time=0.0, floor=0.0, phase=0)
    _frame_writer(scene, out).write(mesh, 0.0)
    return state, Run(out)


def test_frames_in_one_file_are_those_in_many(tmp_path: Path) -> None:
    (_, many), (_, one) = (written(tmp_path / to, *SHAPES, count=10, frames=to) for to in ("vtu", "vtkhdf"))
    bits = compare_bits(many, one)
    assert bits["identical"], bits
    assert bits["frames"] == 1
    mesh = read_step(one.path / "frames.vtkhdf", 0)
    kinds = one.manifest.kinds
    assert kinds is not None
    (of_line,) = mesh.cell_data["kind"]
    assert set(of_line) == set(range(len(SHAPES)))
    for number, kind in enumerate(kinds):
        radii = mesh.cell_data["radius_m"][0][of_line == number]
        flat = not kind.round and one.scene["fidelity"]["rows"] > 1
        width = 2 * (kind.thickness_normal_m + kind.thickness_in_plane_m) / np.pi
        assert radii == pytest.approx((width if flat else kind.sphere_diameter_m) / 2)


def test_frames_of_bodies_are_read_only(tmp_path: Path) -> None:
    (frame,) = written(tmp_path / "run", *SHAPES, count=10, frames="vtu")[1].frames
    assert frame.bars is not None
    arrays = [value for part in (frame, frame.bars) for value in vars(part).values() if isinstance(value, np.ndarray)]
    assert len(arrays) == 10
    assert not any(array.flags.writeable for array in arrays)


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("fidelity", ["draft", "standard"])
def test_capsules_are_the_strands_of_the_engine(name: str, fidelity: str, tmp_path: Path) -> None:
    state, run = written(tmp_path, name, count=2, fidelity=fidelity)
    (kind,) = state.mixture.kinds
    found = capsules_of(run.frames[0], run)
    lines = rigid_shape(kind.bars, kind.rows, kind.radius).lines
    local = np.stack([lines[:, :3], lines[:, :3] + lines[:, 3:6]], axis=1)
    wanted = np.concatenate([local @ state.rotations[k].T + state.positions[k] for k in range(2)])
    assert len(found.ends) == len(wanted) == 2 * kind.rows * len(kind.bars.points)
    # Strands are compared as a set: their order along the normal is of no account.
    for ends in wanted:
        apart = np.minimum(*(np.abs(found.ends - each).max(axis=(1, 2)) for each in (ends, ends[::-1])))
        assert apart.min() < 1e-9
    assert found.radii == pytest.approx(kind.radius)
    quaternions = motion_of(found, run.frames[0]).orientation
    vertices = np.array([shapes_of(found)[k]["vertices"] for k in found.type_of])
    turned = np.einsum("pij,pkj->pki", Rotation.from_quat(quaternions, scalar_first=True).as_matrix(), vertices)
    placed = turned + found.ends.mean(axis=1, keepdims=True)
    apart = np.minimum(*(np.abs(placed - each).max(axis=(1, 2)) for each in (found.ends, found.ends[:, ::-1])))
    assert apart.max() < 1e-9
    assert len(set(found.types)) == len(found.types) == len(kind.bars.points)


def test_round_rods_that_cross_touch_once_at_any_fidelity(tmp_path: Path) -> None:
    for fidelity in ("draft", "standard", "reference"):
        crossing = Rotation.from_euler("z", [[0.0], [90.0]], degrees=True)
        places = np.array([[0.0, 0.0, 0.01], [0.001, 0.001, 0.0102]])
        _, run = written(tmp_path / fidelity, "round rod", count=2, fidelity=fidelity, places=places, turns=crossing)
        strands = strands_of(run.frames[0], run)
        assert cages(strands.axes, strands.body, diameter=strands.diameter).contacts.tolist() == [1, 1], fidelity


@pytest.mark.skipif(importlib.util.find_spec("gsd") is None, reason="the package gsd is not installed")
def test_a_trajectory_has_the_shapes_of_kinds_that_are_poured_later(tmp_path: Path) -> None:
    import gsd.hoomd  # noqa: PLC0415

    _, run = written(tmp_path, "rod", "cross", count=4)
    last = run.frames[0]
    assert last.bars is not None
    bars = np.flatnonzero(last.body == 0)
    alone = RecordedBars(*(getattr(last.bars, name)[bars] for name in ("segments", "body", "number")),
                         last.bars.kind[:1], last.bars.normals[bars])  # fmt: skip
    early = replace(
        last,
        vertices=last.vertices[:1],
        smarticle_ids=last.smarticle_ids[:1],
        link_velocity=last.link_velocity[bars],
        link_angular_velocity=last.link_angular_velocity[bars],
        bars=alone,
    )
    assert len(set(last.kind)) == 2
    frames = [early, last]
    assert write_trajectory(tmp_path / "all.gsd", run, enumerate(frames), [], first=frames) == 2
    with gsd.hoomd.open(tmp_path / "all.gsd", "r") as file:
        assert [frame.particles.N for frame in file] == [len(capsules_of(frame, run).ends) for frame in frames]
        for frame in file:
            assert [len(shape["vertices"]) for shape in frame.particles.type_shapes] == [2] * 5  # no points
            assert frame.particles.type_shapes == shapes_of(capsules_of(last, run))
