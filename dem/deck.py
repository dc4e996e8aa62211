"""Write a scene as an input deck of LAMMPS: `in.lammps`, `spheres.data`, `bodies.txt`.

A deck can describe a scene without motors whose first phase takes over the pile of another run, and whose other phases
are relax, shake or remove-container. Smarticles are rigid bodies of spheres (`fix rigid/small`) with spring, dashpot
and Coulomb friction with a tangential spring (`gran/hooke/history`), as on YADE. `dem.engine.lammps.text` writes the
LAMMPS commands that decks and the engine share.
"""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from dem.body.linear import matrix_product
from dem.body.state import State
from dem.engine.demand import contact_law_of
from dem.engine.lammps import text
from dem.engine.lammps.text import Moving
from dem.errors import InputError
from dem.phases.relax import Relax
from dem.phases.remove_container import RemoveContainer
from dem.phases.shake import Shake
from dem.phases.take_over import TakeOver, poses_of
from dem.plan.steps import time_steps
from dem.record.files import write_text
from dem.scene.reading import scene_hash
from dem.scene.rules import beyond, foreign
from dem.scene.scene import Scene

PassivePhase = TakeOver | Relax | Shake | RemoveContainer

DECK, DATA, BODIES, DUMP = "in.lammps", "spheres.data", "bodies.txt", "bodies.dump"

# Largest overlap that is accepted, in sphere diameters. Overlaps in piles at rest are 0.02 at most; poses of the engine
# links have overlaps of 0.2 and more as spheres, so that smarticles would fly apart.
DEEPEST = 0.05


def passive(scene: Scene) -> State:
    """Return the initial state of a scene, at rest, after a check that a deck can describe the scene.

    InputError lists what LAMMPS cannot compute, or says that spheres overlap by more than `DEEPEST` diameters, as in
    piles of another engine or fidelity.
    """
    found = list(_foreign(scene))
    if found:
        raise InputError(
            f"cannot be carried over to LAMMPS: {'; '.join(found)}; leave that out, or run the scene here "
            "(smarticles run)"
        )
    first = scene.phases[0]
    assert isinstance(first, TakeOver)  # all others were named
    first.ready(scene)
    poses = poses_of(scene, first.taken)
    turns, zero = np.array([turn.as_matrix() for turn in poses.rotations]), np.zeros_like(poses.positions)
    state = State.rigid(scene.body.boxes, poses.positions, turns, zero, zero)
    spheres = state.spheres(scene.body)
    owners = np.repeat(np.arange(len(spheres)), spheres.shape[1])
    near = cKDTree(spheres.reshape(-1, 3))
    pairs = near.query_pairs(scene.sphere_diameter * (1 - DEEPEST), output_type="ndarray")
    deep = pairs[owners[pairs[:, 0]] != owners[pairs[:, 1]]]
    if len(deep):
        raise InputError(
            f"phases.0.run: {len(deep)} pairs of spheres in {first.taken} overlap by more than {DEEPEST:g} diameters, "
            "as those of another engine or fidelity do, and would fly apart in LAMMPS; run this scene's take-over "
            "and a relax phase here (engine: yade), and take over that run"
        )
    return state


def _foreign(scene: Scene) -> Iterator[str]:
    """Yield the parts of a scene that a deck cannot describe, as texts such as "plane: motion in a plane"."""
    if scene.smooth:
        yield f"engine: {scene.engine} takes links as they are, a deck has chains of spheres (use engine: yade)"
    if scene.mixture is not None:
        yield "particle: other bodies than smarticles (run the scene here on engine: lammps)"
    yield from foreign(scene)
    for index, phase in enumerate(scene.phases):
        if phase.pours:
            yield f"phases.{index} ({phase.kind}): a pour (run it here, and begin with take-over of that run)"
        elif isinstance(phase, Shake) and (phase.sweeps or phase.taps is not None):
            yield f"phases.{index} ({phase.kind}): taps or a sweep (run the scene here on engine: lammps)"
        elif not phase.actuates and not beyond(phase) and not isinstance(phase, PassivePhase):
            yield f"phases.{index} ({phase.kind})"


def write_deck(scene: Scene, folder: Path) -> None:
    """Make a folder and write the deck of a scene into it.

    InputError as in `passive`, or if the folder exists or cannot be made; RunError if a file cannot be written.
    """
    state = passive(scene)
    if folder.exists():
        raise InputError(f"--output {folder}: exists; choose another name")
    try:
        folder.mkdir()
    except OSError as error:
        raise InputError(f"--output {folder}: cannot be made ({error.strerror}); choose another place") from None
    spheres, zero = state.spheres(scene.body), np.zeros((state.count, 3))
    turns = matrix_product(state.link_rotations[:, 1], scene.body.boxes.link_rotations[1].T)
    title = f"Spheres of {len(spheres)} smarticles, {spheres.shape[1]} each: {_one_line(scene.name)}"
    contents = {
        DATA: text.sphere_lines([scene.body] * state.count, scene.cylinder, spheres, title=title),
        BODIES: text.body_lines([scene.body] * state.count, Moving(state.positions, turns, zero, zero, zero, zero)),
        DECK: _deck(scene),
    }
    for name, lines in contents.items():
        write_text(folder / name, "\n".join(lines) + "\n")


def _deck(scene: Scene) -> Iterator[str]:
    law, boxes, first = contact_law_of(scene), scene.body.boxes, scene.phases[0]
    assert isinstance(first, TakeOver)
    d, dt, cylinder = scene.sphere_diameter, min(time_steps(scene)), scene.cylinder
    each = len(scene.body.centres)
    before_box, neighbours = "\n".join(text.before_box(scene.body)), "\n".join(text.neighbours(scene.body))
    between, at_wall = text.contact_terms(law, boxes.mass)
    container = "\n".join(text.container(cylinder, at_wall))
    frame = _steps(scene.recording.frame_interval_s, dt)
    columns = " ".join(f"c_where[{k}]" for k in range(1, 12))
    yield f"""\
# {_one_line(scene.name)}: {scene.count} smarticles of {each} spheres of {1e3 * d:.4g} mm
# l/w = {scene.smarticle.aspect_ratio:g}. Made by smarticles export --to lammps, of the scene {scene_hash(scene)[:12]}.
# Poses: frame {first.frame} of a run, SHA-256 {first.sha256}
# Run:   lmp -in {DECK}        on n processors: mpirun -np n lmp -in {DECK}
# Gives: {DUMP}, every {scene.recording.frame_interval_s:g} s: number from 1, centre of mass, velocity, quaternion
#        (w, x, y, z) of each smarticle.
# Not as in a run of the scene: the wall is round ({cylinder.facets} flats there), phases end by time, nothing watches.

{before_box}
read_data        {DATA}

{neighbours}

# Contact: kn and ks [N/m]; damping across and along the surface, to be multiplied with the effective mass of the two
# bodies, M/2 [1/s]; friction; 1: damping along the surface is on; where the dashpot would pull there is no force.
# cn = {law.normal_damping:.6g} N s/m: restitution {scene.contact.restitution:g} at the typical effective mass.
pair_style       gran/hooke/history {between}
pair_coeff       * *

# Mass, {boxes.mass:.6g} kg, and inertia are those of the boxes, read from {BODIES}; "reinit no": once, not at each run.
fix              bodies all rigid/small molecule infile {BODIES} reinit no
# Weight pulls at spheres: their masses in {DATA} add up to the smarticle's and are balanced about its centre of
# mass, so that LAMMPS's warning of overlapping particles does not concern it.
fix              weight all gravity {scene.gravity_m_per_s2:.9g} vector 0 0 -1

# Floor and wall at heights that phases change: base + amplitude sin(2 pi f t), t since the phase began.
variable         omega equal 0
variable         begun equal 0
variable         floor_base equal 0
variable         floor_amplitude equal 0
variable         wall_base equal 0
variable         wall_amplitude equal 0
# The same springs; damping times the mass of one body, M.
{container}

timestep         {dt:.17g}
thermo           {frame}
thermo_style     custom step time v_floor_z
thermo_modify    lost error flush yes
compute          where all rigid/local bodies mol x y z vx vy vz quatw quati quatj quatk
dump             bodies all local {frame} {DUMP} {columns}
dump_modify      bodies format float %.12g"""
    walled = True
    for index, phase in enumerate(scene.phases):
        assert isinstance(phase, PassivePhase)  # all others were rejected
        yield f"\n# -- phase {index}: {phase.kind} " + "-" * 40
        yield from _phase(phase, dt, scene.gravity_m_per_s2, walled=walled)
        walled = walled and not isinstance(phase, RemoveContainer)


def _phase(phase: PassivePhase, dt: float, gravity: float, *, walled: bool) -> Iterator[str]:
    if isinstance(phase, TakeOver):
        hold = phase.settle.hold_s
        yield "# Springs of friction begin anew: the pile settles a little, for as long as it must be still in a run."
        yield f"run              {_steps(hold, dt)}"
        return
    if isinstance(phase, RemoveContainer):
        yield "# The wall is gone at once."
        yield "unfix            wall"
        yield "region           wall delete"
    if not isinstance(phase, Shake):
        yield f"run              {_steps(phase.duration_s, dt)}"
        return
    amplitude = phase.amplitude(gravity)
    moving = ("floor", "wall") if walled and phase.moves == "container" else ("floor",)
    yield (
        f"# Gamma = {phase.peak_acceleration_g:g} at {phase.frequency_hz:g} Hz: A = Gamma g/(2 pi f)^2 = "
        f"{1e3 * amplitude:.4g} mm; what moves: {' and '.join(moving)}."
    )
    yield "variable         begun equal $(step)"
    yield f"variable         omega equal {2 * math.pi * phase.frequency_hz:.17g}"
    yield from (f"variable         {what}_amplitude equal {amplitude:.17g}" for what in moving)
    yield f"run              {_steps(phase.duration_s, dt)}"
    yield "# It stops where it is."
    for what in moving:
        yield f"variable         {what}_base equal $(v_{what}_z:%.17g)"
        yield f"variable         {what}_amplitude equal 0"


def _steps(time: float, dt: float) -> int:
    return max(1, round(time / dt))


def _one_line(text: str) -> str:
    """Return a name without line breaks, which would end a comment."""
    return " ".join(text.split())
