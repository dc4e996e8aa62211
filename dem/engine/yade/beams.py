"""Bonds between neighbouring nodes of a filament as beams: their springs, and matrices from motion to forces.

A bond resists stretching, shear, bending and twisting. With the stiffnesses EA/ℓ, 12 EI/ℓ³, EI/ℓ and GJ/ℓ of a bond of
length ℓ it is the beam element of Euler and Bernoulli, whose deflections by loads on nodes are exact.
"""

import numpy as np

from dem.arrays import Array
from dem.body.filament import Filament

FREEDOMS = 6  # of a node: velocity and angular velocity


def springs(filament: Filament) -> Array:
    """Return (4,) stiffnesses of a bond: stretching, shear [N/m], bending, twisting [N m/rad]."""
    length, (stretching, bending, twisting) = filament.segment_length, filament.stiffnesses
    return np.array([stretching / length, 12 * bending / length**3, bending / length, twisting / length])


def matrices(edges: Array, values: Array) -> Array:
    """Return (B, 12, 12) matrices of bonds, from the motion of both nodes to the forces and torques on them.

    Forces and torques are minus the matrix times velocity [m/s] and angular velocity [rad/s] of the first node, then of
    the second. No motion as of a rigid body causes forces, so that momentum and angular momentum are conserved.

    Args:
        edges: (B, 3) vectors from the first to the second node of each bond [m].
        values: (B, 4) coefficients, in the order of `springs`.
    """
    lengths = np.sqrt((edges**2).sum(axis=1))
    along = edges[:, :, None] * edges[:, None, :] / (lengths**2)[:, None, None]
    across = np.eye(3) - along
    # Strains: relative velocity in the middle of the bond, to which both angular velocities contribute, and relative
    # angular velocity. `half` is the cross product with half the edge from the left.
    x, y, z = edges.T / 2
    zero = np.zeros_like(x)
    half = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    strains = np.zeros((len(edges), 6, 12))
    strains[:, :3, 3:6] = strains[:, :3, 9:] = half
    strains[:, :3, :3] = strains[:, 3:, 3:6] = -np.eye(3)
    strains[:, :3, 6:9] = strains[:, 3:, 9:] = np.eye(3)
    stretching, shear, bending, twisting = values.T[:, :, None, None]
    laws = np.zeros((len(edges), 6, 6))
    laws[:, :3, :3] = stretching * along + shear * across
    laws[:, 3:, 3:] = twisting * along + bending * across
    return np.asarray(np.swapaxes(strains, 1, 2) @ laws @ strains)
