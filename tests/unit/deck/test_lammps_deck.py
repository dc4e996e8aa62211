"""A scene as a deck of LAMMPS: what is in it, what is rejected, and what the distribution's LAMMPS makes of it."""

import math
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import SMALL, changed
from scipy.spatial.transform import Rotation
from synthetic import SyntheticRun, mesh_of, write_ending, write_manifest

from dem.body.state import State
from dem.deck import BODIES, DATA, DECK, DUMP, passive, write_deck
from dem.errors import InputError
from dem.plan.steps import time_steps
from dem.record.frames import FrameWriter
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene
from smarticles.main import main

Array = NDArray[np.float64]

RELAX = {"type": "relax", "duration_s": 0.1}
SHAKE = {"type": "shake", "duration_s": 0.2, "frequency_hz": 30, "peak_acceleration_g": 2}
REMOVE = {"type": "remove-container", "duration_s": 0.1}
HEIGHT = 0.004  # m, of the second smarticle above the first
LMP = shutil.which("lmp")


def source(folder: Path) -> Path:
    """A run of two smarticles: one lies on the floor, its barbs along x; the other hangs askew beside it."""
    run = SyntheticRun(count=2, phases=("deposit", "relax"))
    folder.mkdir()
    write_manifest(folder, run)
    boxes = parse_scene(SMALL, source="x").body.boxes
    turns = np.array([np.eye(3), Rotation.from_rotvec([0.5, 1.0, 0.3]).as_matrix()])
    places = np.array([[-0.015, 0.0, 1e-3], [0.015, 0.0, 1e-3 + 2 * HEIGHT]])
    still = np.zeros((2, 3))
    FrameWriter(folder).write(mesh_of(State.rigid(boxes, places, turns, still, still).vertices, phase=1), 0.0)
    write_ending(folder, run.phases, [(0, 1), (1, 2)], status="done", wall=1.0)
    return folder


def scene_of(run: Path, *phases: dict[str, Any], **changes: Any) -> Scene:
    data = {"count": 2, "phases": [{"type": "take-over", "run": str(run)}, *phases], "container.radius_m": 0.04}
    return parse_scene(changed(SMALL, {**data, **changes}), source="scene.yaml")


def words(deck: str, first: str) -> list[list[str]]:
    """The words of all commands of a name."""
    return [line.split() for line in deck.splitlines() if line.split(" ")[0] == first]


def test_spheres_and_bodies_are_those_of_the_scene(tmp_path: Path) -> None:
    scene = scene_of(source(tmp_path / "run"))
    write_deck(scene, tmp_path / "deck")
    particle, given = scene.body, passive(scene)
    count = len(particle.centres)
    text = (tmp_path / "deck" / DATA).read_text().partition("Atoms # hybrid sphere bond\n\n")
    rows = np.array([line.split() for line in text[2].splitlines()], float)
    assert f"{2 * count} atoms" in text[0]
    assert np.array_equal(rows[:, 0], np.arange(1, 2 * count + 1))
    assert np.array_equal(rows[:, 2:5].reshape(2, count, 3), given.spheres(particle))
    assert np.array_equal(rows[:, 7], np.repeat([1, 2], count))
    assert set(rows[:, 5]) == {scene.sphere_diameter}
    masses = (rows[:, 6] * math.pi / 6 * rows[:, 5] ** 3).reshape(2, count)
    assert masses.min() > 0
    assert masses.sum(axis=1) == pytest.approx(particle.boxes.mass, rel=1e-12)
    # Weight turns no smarticle: spheres are balanced about the centre of mass, which equal ones are not.
    levers = rows[:, 2:5].reshape(2, count, 3) - given.positions[:, None]
    balance = np.einsum("ns,nsi->ni", masses, levers) / particle.boxes.mass
    assert np.abs(balance).max() < 1e-15
    assert np.linalg.norm(levers.mean(axis=1), axis=1).min() > 1e-5
    number, *lines = (tmp_path / "deck" / BODIES).read_text().splitlines()
    assert number == "2"
    for k, line in enumerate(lines):
        value = np.array(line.split(), float)
        assert len(value) == 20
        assert (value[0], value[1]) == (k + 1, particle.boxes.mass)
        assert np.array_equal(value[2:5], given.positions[k])
        xx, yy, zz, xy, xz, yz = value[5:11]
        # The same tensor, link by link.
        whole = np.zeros((3, 3))
        for link in range(3):
            frame, mass = given.link_rotations[k, link], particle.boxes.link_masses[link]
            arm = given.link_positions[k, link] - given.positions[k]
            whole += frame @ np.diag(particle.boxes.link_inertias[link]) @ frame.T
            whole += mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        np.testing.assert_allclose([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], whole, atol=1e-12 * whole.max())


HOOKS = {"hooks": {"lower_height_m": 0.03, "upper_height_m": 0.04}}
TIERS = {"container": {"tiers": [{"radius_m": 0.04, "height_m": 0.03}, {"radius_m": 0.02, "height_m": 0.05}]}}
OPEN, SWING = {"type": "shape-change"}, {"type": "internal-oscillation", "theta_deg": 4}


@pytest.mark.parametrize(
    ("phases", "changes", "named"),
    [
        ([], {"engine": "links"}, ["engine: links"]),
        ([], HOOKS, ["hooks"]),
        ([], TIERS, ["container.tiers"]),
        ([{**REMOVE, "speed_m_per_s": 0.1}], {}, ["phases.1.speed_m_per_s: a wall that is lifted"]),
        ([RELAX, OPEN, SWING], {}, ["phases.2 (shape-change): motors", "phases.3 (internal-oscillation): motors"]),
        ([{"type": "pull-hook"}], HOOKS, ["hooks", "phases.1 (pull-hook)"]),
        ([{"type": "shake", "taps": 2}], {}, ["phases.1 (shake): taps or a sweep"]),
        ([{"type": "shake", "frequency_end_hz": 50}], {}, ["phases.1 (shake): taps or a sweep"]),
    ],
)
def test_what_cannot_be_carried_over_is_rejected_by_name(
    tmp_path: Path, phases: list[dict[str, Any]], changes: dict[str, Any], named: list[str]
) -> None:
    scene = scene_of(source(tmp_path / "run"), *phases, **changes)
    with pytest.raises(InputError, match=r"^cannot be carried over to LAMMPS: .*; leave that out, or run") as caught:
        write_deck(scene, tmp_path / "deck")
    for each in named:
        assert each in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1
    assert not (tmp_path / "deck").exists()


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source(tmp_path / "run")
    file = tmp_path / "on.yaml"
    file.write_text(
        "schema_version: 1\nseed: 1\ncount: 2\nfidelity: draft\ncontainer: {radius_m: 0.04}\n"
        "phases: [{type: take-over, run: run}, {type: relax, duration_s: 0.1}]\n"
    )
    assert main(["export", str(file), "--to", "lammps"]) == 0
    assert capsys.readouterr().out == f"{tmp_path / 'on-lammps'}: written; run in this folder: lmp -in in.lammps\n"
    assert {path.name for path in (tmp_path / "on-lammps").iterdir()} == {DECK, DATA, BODIES}
    assert main(["export", str(file), "--to", "lammps"]) == 2
    assert "--output" in (said := capsys.readouterr().err)
    assert "exists; choose another name" in said
    for option in (["--all"], ["--time", "1"], ["--with", "crossings"], ["--color-by", "contacts"]):
        assert main(["export", str(file), "--to", "lammps", *option]) == 2
        assert f"{option[0]}: selects from the frames of a run" in capsys.readouterr().err
    assert main(["export", str(tmp_path / "run"), "--to", "lammps"]) == 2
    assert main(["export", str(tmp_path / "none.yaml"), "--to", "lammps"]) == 2
    assert main(["export", str(file), "--to", "lammps", "--output", str(tmp_path / "no" / "where")]) == 2


def dumped(path: Path) -> dict[int, Array]:
    """(N, 10) centre of mass, velocity and quaternion of each smarticle, by step."""
    found = {}
    for part in path.read_text().split("ITEM: TIMESTEP\n")[1:]:
        step, _, rows = part.partition("\n")
        values = np.array([line.split() for line in re.split(r"ITEM: ENTRIES.*\n", rows)[1].splitlines()], float)
        found[int(step)] = values[np.argsort(values[:, 0]), 1:]
    return found


@pytest.mark.skipif(LMP is None, reason="needs the distribution's package lammps")
def test_lammps_takes_it_as_it_is(tmp_path: Path) -> None:
    scene = scene_of(source(tmp_path / "run"), RELAX, SHAKE, REMOVE, **{"recording": {"frame_interval_s": 0.004}})
    write_deck(scene, tmp_path / "deck")
    assert LMP is not None
    command = [LMP, "-in", DECK, "-log", "log.txt"]
    done = subprocess.run(command, cwd=tmp_path / "deck", capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr
    given, dt = passive(scene), min(time_steps(scene))
    frames = dumped(tmp_path / "deck" / DUMP)
    np.testing.assert_allclose(frames[0][:, :3], given.positions, rtol=1e-11)
    assert not frames[0][:, 3:6].any()
    # The one that hangs falls freely, and does not turn: its weight pulls at its centre of mass.
    falling = [step for step in frames if 0 < step * dt < math.sqrt(2 * (HEIGHT - 2e-3) / 9.81)]
    assert len(falling) > 3
    for step in falling:
        drop = given.positions[1] - frames[step][1, :3]
        # Leapfrog from rest: exact but for half a step's fall.
        assert drop == pytest.approx([0, 0, 9.81 * (step * dt) ** 2 / 2], abs=9.81 * step * dt * dt)
        assert np.abs(frames[step][1, 6:] - frames[0][1, 6:]).max() < 1e-9
    # The other one comes to rest on its spheres, where their springs bear its weight; the first phases are 0.15 s.
    radius = scene.body.radius
    rested = frames[max(step for step in frames if step * dt < 0.15)]
    sunk = scene.body.boxes.mass * 9.81 / 250 / len(scene.body.centres)
    assert rested[0, 2] == pytest.approx(radius - sunk, abs=0.2 * sunk)
    assert np.abs(rested[0, 3:6]).max() < 1e-3
    # Shaken at 2 g it is thrown up: higher than the floor goes.
    shaken = [values[0, 2] for step, values in frames.items() if 0.15 < step * dt < 0.35]
    assert max(shaken) - radius > 1.5 * 2 * 9.81 / (2 * math.pi * 30) ** 2
