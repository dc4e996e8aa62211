"""LIGGGHTS (Debian's `liggghts`): the spheres and the law of LAMMPS's deck, with bodies by `fix multisphere`.

It reads no bodies from a file: each smarticle is a template of its own, its spheres where the pose has them, that is
put in once, at its place. Floor and wall are a mesh that moves; the wall has flats, as YADE's.
"""

from __future__ import annotations

import math
import re
import resource
import shutil
import subprocess
import time
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.rivals.given import ACTIVITY, CREEP, REST, Array, Given, Knobs, Outcome, rigid_links
from dem.deck.passive import PassiveScene, passive
from dem.phases.shake import Shake

DECK, CUP, DUMP, PROGRAM = "in.liggghts", "cup.stl", "spheres.dump", "liggghts"
LOOP = re.compile(r"^Loop time of (\S+) on 1 procs", re.MULTILINE)
FLATS, HIGH = 32, 0.08  # of the wall; m
NEAR = 1e-6  # m, half the side of the cube in which a smarticle's centre of mass is put at random
SKIN = 0.2  # sphere diameters that neighbours are looked for beyond contact, as on LAMMPS


def simulate(given: Given, knobs: Knobs) -> Outcome:
    """Simulate; there are no knobs, what may differ is of the scene."""
    assert not knobs
    folder, told = Path(given.folder) / "deck", passive(given.scene, "LIGGGHTS")
    folder.mkdir()
    (folder / CUP).write_text("\n".join(_cup(told)) + "\n", encoding="utf-8")
    (folder / DECK).write_text("\n".join(_deck(told, given.look_s)) + "\n", encoding="utf-8")
    log, share = _run(folder)
    frames = _dumped(folder / DUMP, told)
    looks, activity = len(frames), round(given.activity_s / given.look_s)
    begun = looks - activity - 1
    rested = begun - round(CREEP / given.look_s)
    poses = [_poses(told, frame) for frame in frames]
    seen = [poses[rested], poses[begun]]
    for k in range(begun + 1, looks):
        places, turns = poses[k]
        seen.append((places - np.array([0.0, 0.0, given.floor((k - begun) * given.look_s)]), turns))
    links = [rigid_links(given.boxes, *pose) for pose in seen]
    positions, axes = (np.array(each) for each in zip(*links, strict=True))
    return Outcome(
        time_step=told.time_step,
        processor_s=float(LOOP.findall(log)[ACTIVITY]) * share,
        positions=positions,
        frames=axes,
        version=log.splitlines()[0].strip("() "),
    )


def _run(folder: Path) -> tuple[str, float]:
    """Its log, and processor time over wall time [1]."""
    begun, before = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
    with (folder / "said.txt").open("wb") as said:
        command = [shutil.which(PROGRAM) or PROGRAM, "-in", DECK]
        subprocess.run(command, cwd=folder, stdout=said, stderr=subprocess.STDOUT, check=True)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = used.ru_utime + used.ru_stime - before.ru_utime - before.ru_stime
    log = (folder / "log.liggghts").read_text(encoding="utf-8", errors="replace")
    return log, min(1.0, spent / (time.monotonic() - begun))


def _cup(told: PassiveScene) -> Iterator[str]:
    """Floor and wall as triangles."""
    radius = told.scene.cylinder.corner_radius
    angles = 2 * math.pi * np.arange(FLATS + 1) / FLATS
    low = np.column_stack([radius * np.cos(angles), radius * np.sin(angles), np.zeros(FLATS + 1)])
    high, centre = low + np.array([0.0, 0.0, HIGH]), np.zeros(3)
    yield "solid cup"
    for k in range(FLATS):
        yield from _triangle(centre, low[k], low[k + 1])
        yield from _triangle(low[k], high[k], low[k + 1])
        yield from _triangle(low[k + 1], high[k], high[k + 1])
    yield "endsolid cup"


def _triangle(*corners: Array) -> Iterator[str]:
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    yield f"facet normal {_numbers(normal / np.linalg.norm(normal))}"
    yield "outer loop"
    yield from (f"vertex {_numbers(corner)}" for corner in corners)
    yield "endloop"
    yield "endfacet"


def _deck(told: PassiveScene, look_s: float) -> Iterator[str]:
    scene, law, spheres, dt = told.scene, told.law, told.spheres, told.time_step
    d, boxes, side = scene.sphere_diameter, scene.particle.boxes, scene.cylinder.corner_radius + 0.01
    yield "units si"
    yield "atom_style granular"
    yield "atom_modify map array"
    yield "boundary f f f"
    yield "newton off"
    yield f"communicate single vel yes cutoff {2 * scene.particle.reach + d:.9g}"
    yield f"region domain block -{side:.9g} {side:.9g} -{side:.9g} {side:.9g} -0.01 {HIGH + 0.01:.9g} units box"
    yield "create_box 2 domain"
    yield f"neighbor {SKIN * d:.9g} bin"
    yield "neigh_modify delay 0"
    for name, own, wall in (
        ("kn", law.normal_stiffness, law.normal_stiffness),
        ("kt", law.tangential_stiffness, law.tangential_stiffness),
        ("gamman_abs", law.normal_damping, law.wall_damping),
        ("gammat_abs", law.normal_damping * law.tangential_damping, law.wall_damping * law.tangential_damping),
        ("coefficientFriction", law.friction, law.wall_friction),
    ):
        yield f"fix of_{name} all property/global {name} peratomtypepair 2 {_numbers([own, wall, wall, wall])}"
    model = "model hooke/stiffness tangential history"
    how = "tangential_damping on absolute_damping on limitForce on"
    yield f"pair_style gran {model} {how}"
    yield "pair_coeff * *"
    yield f"timestep {dt:.17g}"
    yield f"fix weight all gravity {scene.gravity_m_per_s2:.17g} vector 0 0 -1"
    yield f"fix cup all mesh/surface file {CUP} type 2"
    yield f"fix walls all wall/gran {model} mesh n_meshes 1 meshes cup {how}"
    yield "fix bodies all multisphere"
    density = boxes.mass / (spheres.shape[1] * math.pi / 6 * d**3)
    for k, (centre, turn) in enumerate(zip(told.state.positions, told.turns, strict=True)):
        yield from _smarticle(told, k, centre, turn, density)
    yield f"dump looks all custom {round(look_s / dt)} {DUMP} id x y z"
    yield 'dump_modify looks first yes sort id format "%d %.12g %.12g %.12g"'
    yield "run 1"
    # Done, and looked at in every step otherwise.
    yield from (f"unfix in{k}" for k in range(len(spheres)))
    yield f"run {round(float(scene.phases[REST].known_duration or 0.0) / dt)}"
    shake = scene.phases[ACTIVITY]
    assert isinstance(shake, Shake)
    amplitude, period = shake.amplitude(scene.gravity_m_per_s2), 1 / shake.frequency_hz
    yield f"fix moves all move/mesh mesh cup wiggle amplitude 0. 0. {amplitude:.17g} period {period:.17g}"
    yield f"run {round(shake.duration_s / dt)}"


def _smarticle(told: PassiveScene, k: int, centre: Array, turn: Array, density: float) -> Iterator[str]:
    """One smarticle: a template in its own orientation, put in once."""
    boxes, radius = told.scene.particle.boxes, told.scene.particle.radius
    tensor = turn @ np.diag(boxes.inertia) @ turn.T
    places = " ".join(f"{_numbers(place)} {radius:.17g}" for place in told.spheres[k] - centre)
    moments = _numbers(tensor[(0, 0, 0, 1, 1, 2), (0, 1, 2, 1, 2, 2)])
    seeds = _primes(3 * k)
    yield (
        f"fix shape{k} all particletemplate/multisphere {seeds[0]} atom_type 1 density constant {density:.17g} "
        f"nspheres {len(told.spheres[k])} ntry 1000 spheres {places} type {k + 1} "
        f"mass {boxes.mass:.17g} inertia_tensor {moments} use_density"
    )
    yield f"fix kind{k} all particledistribution/discrete {seeds[1]} 1 shape{k} 1.0"
    ends = " ".join(f"{value - NEAR:.12g} {value + NEAR:.12g}" for value in centre)
    yield f"region at{k} block {ends} volume_limit 1e-24 units box"
    yield (
        f"fix in{k} all insert/pack seed {seeds[2]} distributiontemplate kind{k} insert_every once overlapcheck no "
        f"orientation template vel constant 0. 0. 0. particles_in_region 1 region at{k}"
    )


def _primes(first: int) -> Sequence[int]:
    """Three of the primes that seeds are, others for each number."""
    return _seeds()[first : first + 3]


@cache
def _seeds() -> Sequence[int]:
    """Primes above 10 000, as LIGGGHTS asks seeds to be."""
    sieve = np.ones(200_000, dtype=bool)
    for k in range(2, 448):
        sieve[k * k :: k] = False
    found = np.flatnonzero(sieve)
    return [int(prime) for prime in found[found > 10_000]]


def _numbers(values: Sequence[float] | Array) -> str:
    return " ".join(f"{value:.12g}" for value in values)


def _dumped(path: Path, told: PassiveScene) -> list[Array]:
    """(N, S, 3) centres of the spheres [m] at each look, from the first one with all of them."""
    found = []
    for block in path.read_text(encoding="utf-8").split("ITEM: TIMESTEP\n")[1:]:
        rows = np.array([line.split() for line in block.partition("ITEM: ATOMS")[2].splitlines()[1:]], float)
        if len(rows) == told.spheres.shape[0] * told.spheres.shape[1]:
            found.append(rows[np.argsort(rows[:, 0]), 1:].reshape(told.spheres.shape))
    return found


def _poses(told: PassiveScene, spheres: Array) -> tuple[Array, Array]:
    """(N, 3) centres of mass [m] and (N, 3, 3) rotations that put the spheres of a smarticle where they are."""
    own = told.scene.particle.centres
    middle, means = own.mean(axis=0), spheres.mean(axis=1)
    turns = np.array(
        [Rotation.align_vectors(each - mean, own - middle)[0].as_matrix()
         for each, mean in zip(spheres, means, strict=True)]
    )  # fmt: skip
    return means - turns @ middle, turns
