"""LAMMPS as an engine, without running it: what is rejected, commands, contacts, a child that is missing or ends."""

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import SMALL, changed, small
from scipy.spatial.transform import Rotation

from dem.body.state import State
from dem.engine.lammps.boundaries import LammpsBoundaries
from dem.engine.lammps.child import NEEDED, Child, explain
from dem.engine.lammps.contacts import Contacts
from dem.engine.lammps.text import contact_terms
from dem.errors import InputError, RunError
from dem.physics.contact import contact_law
from dem.plan.steps import stable_step
from dem.run.run import run_scene
from dem.scene.reading import parse_scene
from dem.setting.container import Cylinder

LIFT = {"type": "remove-container", "duration_s": 0.1, "speed_m_per_s": 0.1}
PHASES = [{"type": "deposit", "per_layer": 5}, {"type": "relax", "duration_s": 0.1}]


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"container": {"tiers": [{"radius_m": 0.04, "height_m": 0.1}]}}, None),
        (
            {"container": {"tiers": [{"radius_m": 0.04, "height_m": 0.03}, {"radius_m": 0.02, "height_m": 0.1}]}},
            ["container.tiers"],
        ),
        ({"phases": [*PHASES, LIFT]}, ["phases.2.speed_m_per_s: a wall that is lifted"]),
        ({"phases": [*PHASES, {**LIFT, "speed_m_per_s": None}]}, None),
        ({"phases": [*PHASES, {"type": "shape-change"}]}, ["phases.2 (shape-change): motors"]),
        ({"recording.energy": True}, ["recording.energy"]),
        (
            {"hooks": {"lower_height_m": 0.03, "upper_height_m": 0.04}, "recording.energy": True},
            ["hooks", "recording.energy"],
        ),
    ],
)
def test_what_it_cannot_compute_is_rejected_by_name_when_the_scene_is_read(
    changes: dict[str, Any], named: list[str] | None
) -> None:
    data = changed(SMALL, {"engine": "lammps", **changes})
    if named is None:
        assert parse_scene(data, source="x").engine == "lammps"
        return
    with pytest.raises(InputError) as error:
        parse_scene(data, source="x")
    (line,) = str(error.value).splitlines()
    assert "engine: lammps cannot compute" in line
    assert "; leave that out, or use engine: yade or" in line
    for each in named:
        assert each in line
    assert parse_scene({**data, "engine": "yade"}, source="x").engine == "yade"


def test_damping_is_given_by_mass_as_lammps_multiplies_it() -> None:
    scene = small()
    law, mass = contact_law(scene.body, scene.contact, 250.0), scene.body.boxes.mass
    between, wall = (
        [float(value) for value in terms.split() if value[0].isdigit()] for terms in contact_terms(law, mass)
    )
    assert between[:2] == wall[:2] == [250.0, pytest.approx(205)]
    assert between[2] * mass / 2 == pytest.approx(law.normal_damping, rel=1e-8)
    assert wall[2] * mass == pytest.approx(law.wall_damping, rel=1e-8)
    assert between[3] / between[2] == pytest.approx(law.tangential_damping, rel=1e-8)
    assert between[4:] == [law.friction, 1]


def test_the_step_of_a_mixture_knows_that_dashpots_go_with_mass() -> None:
    def step(*densities: float, **contact: float) -> float:
        particle = [
            {"shape": "rod", "length_m": 0.015, "diameter_m": 1e-3, "density_kg_per_m3": density, "count": 5}
            for density in densities
        ]
        fidelity = {"base": "draft", "stiffness_N_per_m": 250.0}
        count = 5 * len(densities)
        return stable_step(
            small({"engine": "lammps", "count": count, "particle": particle, "fidelity": fidelity, "contact": contact})
        )

    light, heavy = 1000.0, 9000.0
    assert step(light, heavy) == pytest.approx(step(light), rel=1e-12)
    # Dashpots of the heavy kind have a third of the rate of the light kind, which they then have for the light one too.
    assert step(light) < step(heavy, light) < step(light, restitution=1.0)


@pytest.fixture
def commands() -> list[str]:
    return []


@pytest.fixture
def clock() -> list[float]:
    return [0, 1e-4]


@pytest.fixture
def boundaries(commands: list[str], clock: list[float]) -> LammpsBoundaries:
    cylinder = Cylinder(radius=0.02, height=0.05, facets=64)
    return LammpsBoundaries(cylinder, commands.extend, lambda: (int(clock[0]), clock[1]))


def test_floor_and_wall_are_where_lammps_s_variables_put_them(
    boundaries: LammpsBoundaries, commands: list[str], clock: list[float]
) -> None:
    clock[0] = 30
    boundaries.shake(amplitude=1e-3, frequency=25.0)
    values = dict(line.split()[1::2] for line in commands)
    assert values["begun"] == "30"
    clock[0] = 90  # 6 ms later
    omega, t = 2 * math.pi * 25, 6e-3
    assert boundaries.floor == pytest.approx(1e-3 * math.sin(omega * t), rel=1e-12)
    assert boundaries.velocity == pytest.approx(1e-3 * omega * math.cos(omega * t), rel=1e-12)
    assert boundaries.wall_bottom == pytest.approx(-0.002 + boundaries.floor, rel=1e-12)
    assert boundaries.moving
    assert boundaries.enclosed
    height = boundaries.floor
    boundaries.stop()
    clock[0] = 500
    assert (boundaries.floor, boundaries.velocity, boundaries.moving) == (height, 0.0, False)
    del commands[:]
    boundaries.remove_wall()
    assert commands == ["unfix wall", "region wall delete"]
    assert (boundaries.walled, boundaries.enclosed, boundaries.raised) == (False, False, None)
    boundaries.shake(amplitude=1e-3, frequency=25.0, walls=True)
    assert "variable wall_amplitude equal 0" in commands
    again = LammpsBoundaries(boundaries.cylinder, commands.extend, lambda: (510, 1e-4))
    again.restore(boundaries.memory)
    clock[0] = 510
    assert again.floor == boundaries.floor != height


def test_contacts_are_those_of_all_pairs_of_spheres(boundaries: LammpsBoundaries) -> None:
    # Spheres of one smarticle overlap.
    scene, rng = small({"fidelity": {"base": "draft", "pitch": 0.7}}), np.random.default_rng(3)
    count, radius = 12, scene.body.radius
    places = np.column_stack([rng.uniform(-0.009, 0.009, (count, 2)), rng.uniform(0.005, 0.012, count)])
    turns, still = Rotation.random(count, random_state=rng).as_matrix(), np.zeros((count, 3))
    spheres = State.rigid(scene.body.boxes, places, turns, still, still).spheres(scene.body)
    found = Contacts.of(spheres, radius, boundaries)
    touches, neighbours, depths = np.zeros(count, int), np.zeros(count, int), []
    for k in range(count):
        beside = [radius - spheres[k, :, 2], radius - (0.02 - np.hypot(spheres[k, :, 0], spheres[k, :, 1]))]
        for depth in beside:
            touches[k] += (depth > 0).sum()
            depths += list(depth[depth > 0])
        for j in range(count):
            apart = np.linalg.norm(spheres[k][:, None] - spheres[j][None], axis=-1)
            deep = 2 * radius - apart
            if j != k:
                touches[k] += (deep > 0).sum()
                neighbours[k] += (deep > 0).any()
            if j > k:
                depths += list(deep[deep > 0])
    assert neighbours.max() > 1
    assert np.array_equal(found.touches(), touches)
    assert np.array_equal(found.neighbours(), neighbours)
    law = contact_law(scene.body, scene.contact, 250.0)
    overlaps = found.overlaps(radius, law)
    assert overlaps.deepest == pytest.approx(max(depths), rel=1e-12)
    assert 0 < overlaps.deep.sum() < count
    normal = 250 / 2 * sum(depth**2 for depth in depths)
    assert overlaps.elastic_energy == pytest.approx(normal * (1 + 0.4**2 / 0.82), rel=1e-12)
    assert Contacts.of(np.zeros((0, 18, 3)), radius, boundaries).touches().shape == (0,)


HELP = "Large-scale Atomic/Molecular Massively Parallel Simulator - 29 Sep 2021\n\n" + " ".join(NEEDED)
SAYS = f"while read -r line; do echo \"$line\"; done <<'E'\n{HELP}\nE"
Programs = Callable[..., Path]


@pytest.fixture
def programs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Programs:
    """Makes programs that are all that is found; each a shell script."""
    folder = tmp_path / "bin"
    folder.mkdir()
    monkeypatch.setenv("PATH", str(folder))

    def make(**scripts: str) -> Path:
        for name, text in scripts.items():
            (folder / name).write_text(f"#!/bin/sh\n{text}\n")
            (folder / name).chmod(0o755)
        return folder

    return make


@pytest.mark.parametrize(("there", "missing"), [({}, "lmp of LAMMPS"), ({"lmp": SAYS}, "mpirun of Open MPI")])
def test_what_is_missing_is_named_and_no_directory_is_left(
    programs: Programs, there: dict[str, str], missing: str, tmp_path: Path
) -> None:
    programs(**there)
    way_out = r"`make setup-mpi` or `apt-get install lammps openmpi-bin`, or use engine: yade"
    with pytest.raises(RunError, match=rf"^engine: lammps needs the program {missing}, .*; install it with {way_out}"):
        run_scene(small({"engine": "lammps"}), tmp_path / "run", command="test")
    assert not (tmp_path / "run").exists()


KILLED = """\
--------------------------------------------------------------------------
mpirun noticed that process rank 1 with PID 0 on node box exited on
signal 9 (Killed).
--------------------------------------------------------------------------
"""
UNKNOWN = "ERROR: Unknown fix style nonsense (../modify.cpp:899)\nLast command: fix bogus all   nonsense\n"


@pytest.mark.parametrize(
    ("log", "printed", "cause", "way_out"),
    [
        ("", KILLED, "rank 1 was ended by signal 9 (Killed)", "if memory ran out.*fewer --ranks; go on .*resume"),
        ("", KILLED.replace("9 (Killed)", "11 (Segmentation fault)"), "signal 11 (Segm", "^go on from the last check"),
        (UNKNOWN, "", "Unknown fix style nonsense (command: fix bogus all nonsense)", "lacks commands .*setup-mpi"),
        ("ERROR: Lost atoms: original 180 (../thermo.cpp:438)", "", "Lost atoms: original", "fly apart.*low"),
        ("", "ERROR on proc 1: Failed to allocate 8 bytes for array x (../memory.cpp:66)", "Failed", "memory is short"),
        ("", "There are not enough slots available in the system", "fewer cores than ranks", "fewer --ranks"),
        ("units si", "", "exit status 3 (no output)", "see its log"),
    ],
)
def test_why_it_ended_is_read_from_its_own_log(log: str, printed: str, cause: str, way_out: str) -> None:
    found = explain(log, printed, 3)
    assert cause in found[0]
    assert "cpp" not in found[0]
    assert re.search(way_out, found[1])


def test_the_error_of_a_child_that_ends_names_its_log_and_its_folder_is_gone(
    programs: Programs, tmp_path: Path
) -> None:
    echo = "\n".join(f"echo '{line}'" for line in KILLED.splitlines())
    programs(mpirun=f"read -r line\n{echo}\nexit 137")
    child = Child(2)
    with pytest.raises(
        RunError, match=r"^LAMMPS ended: rank 1 was ended by signal 9 \(Killed\); .*; its log: /"
    ) as error:
        child.send("run 1")
    assert not child.scratch.exists()
    kept = Path(str(error.value).rpartition("its log: ")[2])
    assert "signal 9 (Killed)" in kept.read_text()
    kept.unlink()
    kept.parent.rmdir()
