"""Data files of spheres and bodies, and commands of contacts and container, for LAMMPS.

Keywords are those of version 29 Sep 2021, update 2, which Debian 12 has.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from dem.arrays import Array
from dem.body.kinds import Kind, Mixture
from dem.body.linear import eigen_symmetric, matrix_product, transformed
from dem.body.particle import Particle
from dem.physics.contact import ContactLaw
from dem.setting.container import Cylinder

NEVER_PULLS = "limit_damping"
"""Keyword of a contact law: the normal force is zero where spring and dashpot together would pull."""
SKIN = 0.2  # distance between spheres up to which they are listed as neighbours, in sphere diameters
FLAT = 1e-12  # of the largest eigenvalue: below it, spheres lie in a plane or on a line
WRITTEN = "mol x y z vx vy vz quatw quati quatj quatk omegax omegay omegaz angmomx angmomy angmomz fx fy fz"
"""Quantities that LAMMPS writes to a dump file for each body."""


@dataclass(frozen=True)
class Moving:
    """Motion of N bodies at one instant, in the laboratory frame."""

    positions: Array  #: (N, 3) centres of mass [m]
    turns: Array  #: (N, 3, 3) rotations from the body frame to the laboratory frame [1]
    velocities: Array  #: (N, 3) velocities of the centres of mass [m/s]
    spins: Array  #: (N, 3) angular velocities [rad/s]
    momenta: Array  #: (N, 3) angular momenta about the centres of mass [kg m²/s]
    forces: Array  #: (N, 3) sums of contact forces and weight [N]

    @classmethod
    def none(cls) -> Self:
        """Return the motion of no bodies: arrays for N = 0."""
        empty = np.zeros((0, 3))
        return cls(empty, np.zeros((0, 3, 3)), empty, empty, empty, empty)


def sphere_masses(body: Particle | Kind) -> Array:
    """Return (S,) masses of a body's spheres [kg] that together have the body's mass and centre of mass.

    The weights of the spheres then exert no torque. The masses are as equal as possible, by least squares.
    """
    count = len(body.centres)
    # Conditions: the masses sum to the smarticle's mass, the first moments to zero.
    rows = np.concatenate([np.ones((1, count)), body.centres.T / body.size])
    wanted = np.array([body.mass, 0.0, 0.0, 0.0])
    equal = np.full(count, body.mass / count)
    # Of a flat body no mass moves the centre out of its plane.
    values, vectors = (found[0] for found in eigen_symmetric(matrix_product(rows, rows.T)[None]))
    inverses = np.divide(1.0, values, out=np.zeros(4), where=values > FLAT * values.max())
    part = transformed(vectors, inverses * transformed(vectors.T, wanted - transformed(rows, equal)))
    return np.asarray(equal + transformed(rows.T, part))


def sphere_lines(
    bodies: Sequence[Particle | Kind],
    cylinder: Cylinder,
    spheres: Iterable[Array],
    *,
    title: str,
    first: int = 0,
    first_sphere: int = 0,
) -> Iterator[str]:
    """Yield the lines of a file of spheres, for the command `read_data`.

    A line has number, type, position, diameter and density of a sphere, and the number of its body.

    Args:
        cylinder: the container, in which all spheres lie up to a margin.
        spheres: (S, 3) centres of the spheres of each body [m].
        first: number of bodies that LAMMPS has already.
        first_sphere: number of spheres that LAMMPS has already.
    """
    d = max(body.diameter for body in bodies)
    yield title
    yield f"\n{sum(len(body.centres) for body in bodies)} atoms\n1 atom types\n"
    side, top = cylinder.corner_radius + d, cylinder.height + d
    for low, high, axis in ((-side, side, "x"), (-side, side, "y"), (cylinder.bottom - d, top, "z")):
        yield f"{low:.9g} {high:.9g} {axis}lo {axis}hi"
    yield "\nAtoms # hybrid sphere bond\n"
    ends: dict[int, list[str]] = {}  # diameters and densities of the spheres, by kind of body
    number = first_sphere
    for k, (body, chain) in enumerate(zip(bodies, spheres, strict=True), first):
        if id(body) not in ends:
            densities = sphere_masses(body) / (math.pi / 6 * body.diameter**3)
            ends[id(body)] = [f"{body.diameter:.17g} {density:.17g}" for density in densities]
        for (x, y, z), end in zip(chain.tolist(), ends[id(body)], strict=True):
            number += 1
            yield f"{number} 1 {x:.17g} {y:.17g} {z:.17g} {end} {k + 1}"


def body_lines(bodies: Sequence[Particle | Kind], moving: Moving) -> Iterator[str]:
    """Yield the lines of a file of bodies, for `infile` of `fix rigid/small`.

    A line has number, mass, centre of mass, inertia tensor (xx yy zz xy xz yz), velocity, angular momentum and three
    image flags of a body.
    """
    inertias = np.array([np.diag(body.inertia) for body in bodies]).reshape(-1, 3, 3)
    tensors = matrix_product(matrix_product(moving.turns, inertias), np.swapaxes(moving.turns, 1, 2))
    moments = tensors[:, (0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)]
    yield str(len(moving.positions))
    columns = (moving.positions, moments, moving.velocities, moving.momenta)
    for k, (body, row) in enumerate(zip(bodies, np.concatenate(columns, axis=1).tolist(), strict=True)):
        numbers = " ".join("0" if value == 0 else f"{value:.17g}" for value in row)
        yield f"{k + 1} {body.mass:.17g} {numbers} 0 0 0"


def contact_terms(law: ContactLaw, mass: float) -> tuple[str, str]:
    """Return the arguments of `pair_style gran/hooke/history` and of `fix wall/gran/region`.

    The arguments are kn and ks [N/m]; normal and tangential damping [1/s], which LAMMPS multiplies by the effective
    mass, M/2 for two smarticles of mass M [kg] and M at a wall; the friction coefficient; 1, which switches tangential
    damping on; and the keyword `NEVER_PULLS`.
    """
    between, wall = law.normal_damping / (mass / 2), law.wall_damping / mass
    springs, tangential = f"{law.normal_stiffness:.9g} {law.tangential_stiffness:.9g}", law.tangential_damping
    return (
        f"{springs} {between:.9g} {between * tangential:.9g} {law.friction:.9g} 1 {NEVER_PULLS}",
        f"hooke/history {springs} {wall:.9g} {wall * tangential:.9g} {law.wall_friction:.9g} 1 {NEVER_PULLS}",
    )


def before_box(particle: Particle | Mixture) -> Iterator[str]:
    """Yield the commands that must precede the simulation box, such as units and atom style."""
    yield "units            si"
    yield "# Springs of friction need each pair on both of two processors, and velocities of spheres at their borders."
    yield "newton           off"
    yield "boundary         m m m"
    yield (
        "# Style bond brings the number of the smarticle that a sphere belongs to; rigid/small looks spheres up by "
        "number."
    )
    yield "atom_style       hybrid sphere bond"
    yield "atom_modify      map array"
    yield "# A body is moved by the processor of one of its spheres, which must see all others: as far as it is long."
    yield f"comm_modify      vel yes cutoff {2 * particle.reach + 2 * particle.radius:.9g}"


def neighbours(particle: Particle | Mixture) -> Iterator[str]:
    """Yield the commands of the neighbour list."""
    yield "# Spheres of one smarticle do not touch each other."
    yield f"neighbor         {SKIN * particle.diameter:.9g} bin"
    yield "neigh_modify     delay 0 every 1 check yes exclude molecule/intra all"


def container(cylinder: Cylinder, at_wall: str, *, walled: bool = True) -> Iterator[str]:
    """Yield the commands of floor and wall, whose heights are the variables `floor_z` and `wall_z`.

    `at_wall` are LAMMPS's words for the contact law at floor and wall. Unless `walled`, there is no wall.
    """
    extent = f"{cylinder.radius:.9g} {cylinder.bottom:.9g} {cylinder.height:.9g}"
    yield "variable         wave equal sin(v_omega*(step-v_begun)*dt)"
    yield "variable         floor_z equal v_floor_base+v_floor_amplitude*v_wave"
    yield "variable         wall_z equal v_wall_base+v_wall_amplitude*v_wave"
    yield "region           floor plane 0 0 0 0 0 1 side in move NULL NULL v_floor_z"
    yield f"fix              floor all wall/gran/region {at_wall} region floor"
    if walled:
        yield f"region           wall cylinder z 0 0 {extent} side in open 1 open 2 move NULL NULL v_wall_z"
        yield f"fix              wall all wall/gran/region {at_wall} region wall"


def body_dump(dump: str, *, when: str) -> Iterator[str]:
    """Yield the commands that write all bodies to files.

    In the name `dump`, `*` is replaced by the step. `when` are the steps, as an argument of `dump_modify every`.
    """
    count = len(WRITTEN.split())
    yield f"compute          where all rigid/local bodies {WRITTEN}"
    yield f"dump             bodies all local 1 {dump} {' '.join(f'c_where[{k + 1}]' for k in range(count))}"
    yield f"dump_modify      bodies every {when} first yes format float %.17g"
