"""A scene as an input deck of LAMMPS: `in.lammps`, `spheres.data`, `bodies.txt`.

Smarticles are rigid bodies of spheres (`fix rigid/small`) that touch by a spring with a dashpot and a sliding friction
with memory (`gran/hooke/history`), as on YADE. Keywords are those of the version of January 2022, which Debian 12 has.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from dem.deck.passive import PassivePhase, PassiveScene, passive
from dem.errors import InputError
from dem.phases.remove_container import RemoveContainer
from dem.phases.shake import Shake
from dem.phases.take_over import TakeOver
from dem.record.files import write_text
from dem.scene.reading import scene_hash
from dem.scene.scene import Scene

DECK, DATA, BODIES, DUMP = "in.lammps", "spheres.data", "bodies.txt", "bodies.dump"
SKIN = 0.2  # sphere diameters that neighbours are looked for beyond contact


def write_deck(scene: Scene, folder: Path) -> None:
    """Write the deck of a scene into a folder of its own.

    Raises:
        InputError: the scene has what LAMMPS cannot be told, or the folder is there already.
        RunError: it cannot be written.
    """
    told = passive(scene, "LAMMPS")
    if folder.exists():
        msg = f"--output {folder}: exists; choose another name"
        raise InputError(msg)
    try:
        folder.mkdir()
    except OSError as error:
        msg = f"--output {folder}: cannot be made ({error.strerror}); choose another place"
        raise InputError(msg) from None
    for name, lines in ((DATA, _data(told)), (BODIES, _bodies(told)), (DECK, _deck(told))):
        write_text(folder / name, "\n".join(lines) + "\n")


def _data(told: PassiveScene) -> Iterator[str]:
    """All spheres: number, type, place, diameter, density, smarticle."""
    scene, spheres = told.scene, told.spheres
    count, each = spheres.shape[:2]
    d, cylinder = scene.sphere_diameter, scene.cylinder
    yield f"Spheres of {count} smarticles, {each} each: {_one_line(scene.name)}"
    yield f"\n{count * each} atoms\n1 atom types\n"
    side, top = cylinder.corner_radius + d, cylinder.height + d
    for low, high, axis in ((-side, side, "x"), (-side, side, "y"), (cylinder.bottom - d, top, "z")):
        yield f"{low:.9g} {high:.9g} {axis}lo {axis}hi"
    yield "\nAtoms # hybrid sphere bond\n"
    densities = told.sphere_masses / (math.pi / 6 * d**3)
    for k in range(count):
        for s, (x, y, z) in enumerate(spheres[k]):
            yield f"{k * each + s + 1} 1 {x:.17g} {y:.17g} {z:.17g} {d:.17g} {densities[s]:.17g} {k + 1}"


def _bodies(told: PassiveScene) -> Iterator[str]:
    """All smarticles: number, mass, centre, inertia (xx yy zz xy xz yz), velocity, angular momentum, image."""
    mass, tensors = told.scene.particle.boxes.mass, told.inertias
    yield str(told.state.count)
    for k, ((x, y, z), i) in enumerate(zip(told.state.positions, tensors, strict=True)):
        moments = (i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2])
        inertia = " ".join(f"{value:.17g}" for value in moments)
        yield f"{k + 1} {mass:.17g} {x:.17g} {y:.17g} {z:.17g} {inertia} 0 0 0 0 0 0 0 0 0"


def _deck(told: PassiveScene) -> Iterator[str]:
    scene, law, boxes = told.scene, told.law, told.scene.particle.boxes
    d, dt, cylinder = scene.sphere_diameter, told.time_step, scene.cylinder
    each, reach = len(scene.particle.centres), scene.particle.reach
    frame = _steps(scene.recording.frame_interval_s, dt)
    # LAMMPS multiplies a damping with the effective mass of the two bodies that touch, M/2, or M at a wall.
    between, wall = law.normal_damping / (boxes.mass / 2), law.wall_damping / boxes.mass
    tangential = law.tangential_damping
    contact = (
        f"{law.normal_stiffness:.9g} {law.tangential_stiffness:.9g} {between:.9g} {between * tangential:.9g} "
        f"{law.friction:.9g} 1"
    )
    at_wall = (
        f"hooke/history {law.normal_stiffness:.9g} {law.tangential_stiffness:.9g} {wall:.9g} {wall * tangential:.9g} "
        f"{law.wall_friction:.9g} 1"
    )
    extent = f"{cylinder.radius:.9g} {cylinder.bottom:.9g} {cylinder.height:.9g}"
    columns = " ".join(f"c_where[{k}]" for k in range(1, 12))
    first = told.phases[0]
    assert isinstance(first, TakeOver)
    yield f"""\
# {_one_line(scene.name)}: {scene.count} smarticles of {each} spheres of {1e3 * d:.4g} mm
# l/w = {scene.smarticle.aspect_ratio:g}. Made by smarticles export --to lammps, of the scene {scene_hash(scene)[:12]}.
# Poses: frame {first.frame} of a run, SHA-256 {first.sha256}
# Run:   lmp -in {DECK}        on n processors: mpirun -np n lmp -in {DECK}
# Gives: {DUMP}, every {scene.recording.frame_interval_s:g} s: number from 1, centre of mass, velocity, quaternion
#        (w, x, y, z) of each smarticle.
# Not as in a run of the scene: the wall is round ({cylinder.facets} flats there), phases end by time, nothing watches.

units            si
# Springs of friction need each pair on both of two processors, and velocities of spheres at their borders.
newton           off
boundary         m m m
# Style bond brings the number of the smarticle that a sphere belongs to; rigid/small looks spheres up by number.
atom_style       hybrid sphere bond
atom_modify      map array
# A body is moved by the processor of one of its spheres, which must see all others: as far as it is long.
comm_modify      vel yes cutoff {2 * reach + d:.9g}
read_data        {DATA}

# Spheres of one smarticle do not touch each other.
neighbor         {SKIN * d:.9g} bin
neigh_modify     delay 0 every 1 check yes exclude molecule/intra all

# Contact: kn and ks [N/m]; damping across and along the surface, to be multiplied with the effective mass of the two
# bodies, M/2 [1/s]; friction; 1: damping along the surface is on.
# cn = {law.normal_damping:.6g} N s/m: restitution {scene.contact.restitution:g} at a typical lever.
pair_style       gran/hooke/history {contact}
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
variable         wave equal sin(v_omega*(step-v_begun)*dt)
variable         floor_z equal v_floor_base+v_floor_amplitude*v_wave
variable         wall_z equal v_wall_base+v_wall_amplitude*v_wave
region           floor plane 0 0 0 0 0 1 side in move NULL NULL v_floor_z
region           wall cylinder z 0 0 {extent} side in open 1 open 2 move NULL NULL v_wall_z
# The same springs; damping times the mass of one body, M.
fix              floor all wall/gran/region {at_wall} region floor
fix              wall all wall/gran/region {at_wall} region wall

timestep         {dt:.17g}
thermo           {frame}
thermo_style     custom step time v_floor_z
thermo_modify    lost error flush yes
compute          where all rigid/local bodies mol x y z vx vy vz quatw quati quatj quatk
dump             bodies all local {frame} {DUMP} {columns}
dump_modify      bodies format float %.12g"""
    walled = True
    for index, phase in enumerate(told.phases):
        yield f"\n# -- phase {index}: {phase.kind} " + "-" * 40
        yield from _phase(told, phase, walled=walled)
        walled = walled and not isinstance(phase, RemoveContainer)


def _phase(told: PassiveScene, phase: PassivePhase, *, walled: bool) -> Iterator[str]:
    dt, gravity = told.time_step, told.scene.gravity_m_per_s2
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
    """A name that ends no comment."""
    return " ".join(text.split())
