"""Centre of mass, inertia and generalised momenta of three hinged links in a plane, in closed form.

Frame: origin at the centre of mass, x along the middle link from hinge 1 to hinge 2, y towards the mouth, z along the
normal: the middle link's axes. With the angular velocity ω of the middle link and the rates α̇ of the two angles

    T = M V²/2 + ω·I(α)ω/2 + ω_z b(α)·α̇ + α̇·A(α)α̇/2

is the kinetic energy, L = I ω + (b·α̇) z the angular momentum about the centre of mass, and p = ∂T/∂α̇ = b ω_z + A α̇
the momentum conjugate to the angles. I, b and A follow from Σ m c = 0, with the centres c of the links from the centre
of mass. With m_b and I_n the mass of a barb and its inertia about the normal, M the mass of the smarticle, f = m_b/M,
s_1 = -1 and s_2 = 1, since a rising α_k turns barb 1 clockwise and barb 2 counterclockwise, and u_k = ∂(c_k -
c_middle)/∂α_k:

    b_k = s_k I_n + m_b (c_k × u_k),   A_kk = I_n + m_b (1 - f) u_k²,   A_12 = -f m_b u_1·u_2.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from dem.engine.links.compiler import inlined, kernel
from dem.engine.links.shapes import Planar, Shapes

Array = NDArray[np.float64]

# Constants of `direction`: 2/π, π/2 in two parts, coefficients of the series of sine and cosine.
QUARTERS, QUARTER, QUARTER_REST = 2 / math.pi, 1.5707963267341256, 6.077100506506192e-11
S1, S2, S3 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
S4, S5, S6 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
C1, C2, C3 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
C4, C5, C6 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11

SMALL = 1e-4  # rad²; up to this square of an angle the series used here are exact to the last digit


@inlined
def planar_at(shapes: Shapes, k: int) -> Planar:
    """Return the geometry of shape `k`, which must be a smarticle."""
    row = shapes.planar[k]
    return Planar(
        row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8], row[9], row[10], row[11], row[12]
    )


@kernel
def lay_out(planar: Planar, alpha1: float, alpha2: float, row: Array) -> None:
    """Compute the plane geometry of one smarticle; for u_k, b and A see the top of this module.

    Args:
        alpha1: angle of barb 1 [rad]; 0: straight, π/2: the U.
        alpha2: angle of barb 2 [rad].
        row: (PLANE,) written. 0 to 1: centre of mass from the middle link's centre [m]; 2 to 5: centres of barb 1 and
            barb 2 from the centre of mass [m]; 6 to 9: u_1 and u_2 [m]; 10 to 13: directions of barb 1 and barb 2 [1];
            14 to 17: inertia xx, yy, zz, xy [kg m²]; 18 to 19: b [kg m²]; 20: A_11 = A_22, 21: A_12 [kg m²]; 22 to
            23: see `invert`; 24 to 26: elements 11, 22 and 12 of the mobility (A - b bᵀ/I_zz)⁻¹ [1/(kg m²)],
            by which impulses of motors change the rates of the angles of a free smarticle.
    """
    lay_out_at(planar, alpha1, alpha2, row)


@inlined
def lay_out_at(planar: Planar, alpha1: float, alpha2: float, row: Array) -> None:
    """Compute the plane geometry like `lay_out`, from both angles [rad], inlined into other kernels."""
    c1, s1 = direction(alpha1)
    c2, s2 = direction(alpha2)
    lay_out_directions(planar, c1, s1, c2, s2, row)


@inlined
def direction(angle: float) -> tuple[float, float]:
    """Return the cosine and the sine of an angle [rad], exact to rounding up to a few turns.

    A multiple of π/2 is subtracted so that the angle is within ±π/4; π/2 is stored as a sum of two numbers to lose no
    digits. The series are those of fdlibm (k_sin.c, k_cos.c).
    """
    turns = math.floor(angle * QUARTERS + 0.5)
    x = (angle - turns * QUARTER) - turns * QUARTER_REST
    z = x * x
    sine = x + x * z * (S1 + z * (S2 + z * (S3 + z * (S4 + z * (S5 + z * S6)))))
    cosine = 1.0 - (0.5 * z - z * z * (C1 + z * (C2 + z * (C3 + z * (C4 + z * (C5 + z * C6))))))
    quarter = int(turns) & 3
    odd = quarter & 1
    c, s = sine if odd else cosine, cosine if odd else sine
    return -c if quarter in (1, 2) else c, -s if quarter >= 2 else s


@inlined
def lay_out_directions(planar: Planar, c1: float, s1: float, c2: float, s2: float, row: Array) -> None:
    """Compute the plane geometry like `lay_out`, from the cosines and sines of both angles."""
    arm, mb, mm = planar.arm, planar.barb_mass, planar.middle_mass
    share = mb / planar.mass
    x1, y1, x2, y2 = -planar.half - c1 * arm, s1 * arm, planar.half + c2 * arm, s2 * arm
    rx, ry = share * (x1 + x2), share * (y1 + y2)
    x1, y1, x2, y2 = x1 - rx, y1 - ry, x2 - rx, y2 - ry
    u1x, u1y, u2x, u2y = s1 * arm, c1 * arm, -s2 * arm, c2 * arm
    own = planar.barb_xx - planar.barb_yy
    row[0], row[1], row[2], row[3], row[4], row[5] = rx, ry, x1, y1, x2, y2
    row[6], row[7], row[8], row[9] = u1x, u1y, u2x, u2y
    row[10], row[11], row[12], row[13] = -c1, s1, c2, s2
    row[14] = (
        planar.middle_xx + mm * ry * ry + mb * (y1 * y1 + y2 * y2) + 2 * planar.barb_yy + own * (c1 * c1 + c2 * c2)
    )
    row[15] = (
        planar.middle_yy + mm * rx * rx + mb * (x1 * x1 + x2 * x2) + 2 * planar.barb_yy + own * (s1 * s1 + s2 * s2)
    )
    row[16] = (
        planar.middle_zz + mm * (rx * rx + ry * ry) + mb * (x1 * x1 + y1 * y1 + x2 * x2 + y2 * y2) + 2 * planar.barb_zz
    )
    row[17] = -mm * rx * ry - mb * (x1 * y1 + x2 * y2) + own * (c2 * s2 - c1 * s1)
    row[18] = -planar.barb_zz + mb * (x1 * u1y - y1 * u1x)
    row[19] = planar.barb_zz + mb * (x2 * u2y - y2 * u2x)
    row[20] = planar.barb_zz + mb * (1 - share) * arm * arm
    row[21] = -share * mb * (u1x * u2x + u1y * u2y)
    invert_at(row)
    b1, b2, normal = row[18], row[19], row[22]
    a, b, c = row[20] - b1 * b1 * normal, row[20] - b2 * b2 * normal, row[21] - b1 * b2 * normal
    inverse = 1 / (a * b - c * c)
    row[24], row[25], row[26] = b * inverse, a * inverse, -c * inverse


@kernel
def invert(row: Array) -> None:
    """Compute columns 22 and 23 of a plane geometry from the inertia in columns 14 to 17, see `lay_out`.

    Args:
        row: (PLANE,) written. 22: 1/I_zz [1/(kg m²)]; 23: inverse determinant of the in-plane inertia [1/(kg² m⁴)].
    """
    invert_at(row)


@inlined
def invert_at(row: Array) -> None:
    """Compute columns 22 and 23 of a plane geometry (PLANE,) like `invert`, inlined into other kernels."""
    row[22], row[23] = 1 / row[16], 1 / (row[14] * row[15] - row[17] * row[17])


@inlined
def lay_out_near(planar: Planar, by1: float, by2: float, from_: Array, row: Array) -> None:
    """Compute the plane geometry for angles that differ little from those of a known plane geometry.

    Only cosines and sines of the differences are needed, which are cheap.

    Args:
        by1: angle 1 less the known angle 1 [rad].
        by2: angle 2 less the known angle 2 [rad].
        from_: (PLANE,) known plane geometry.
        row: (PLANE,) written, see `lay_out`.
    """
    x1, x2 = by1 * by1, by2 * by2
    if x1 > SMALL or x2 > SMALL:
        c, s, d, t = math.cos(by1), math.sin(by1), math.cos(by2), math.sin(by2)
    else:
        c, s = 1 - x1 / 2 * (1 - x1 / 12 * (1 - x1 / 30)), by1 * (1 - x1 / 6 * (1 - x1 / 20))
        d, t = 1 - x2 / 2 * (1 - x2 / 12 * (1 - x2 / 30)), by2 * (1 - x2 / 6 * (1 - x2 / 20))
    c1, s1, c2, s2 = -from_[10], from_[11], from_[12], from_[13]
    lay_out_directions(planar, c1 * c - s1 * s, s1 * c + c1 * s, c2 * d - s2 * t, s2 * d + c2 * t, row)


@inlined
def spin_of(row: Array, lx: float, ly: float, lz: float, internal: float) -> tuple[float, float, float]:
    """Return the angular velocity ω = I⁻¹(L - h z) [rad/s]; vectors are in the middle link's axes.

    Args:
        row: plane geometry, see `lay_out`.
        lx: x component of the angular momentum L [kg m²/s].
        ly: y component of L [kg m²/s].
        lz: z component of L [kg m²/s].
        internal: h = b·α̇ [kg m²/s].
    """
    xx, yy, xy, normal, flat = row[14], row[15], row[17], row[22], row[23]
    return (yy * lx - xy * ly) * flat, (xx * ly - xy * lx) * flat, (lz - internal) * normal


@inlined
def momenta(row: Array, normal: float, rate1: float, rate2: float) -> tuple[float, float]:
    """Return the momenta p = b ω_z + A α̇ conjugate to both angles [kg m²/s].

    Args:
        row: plane geometry, see `lay_out`.
        normal: component of the angular momentum L along the normal [kg m²/s].
        rate1: α̇_1 [rad/s].
        rate2: α̇_2 [rad/s].
    """
    wz = (normal - row[18] * rate1 - row[19] * rate2) * row[22]
    return row[18] * wz + row[20] * rate1 + row[21] * rate2, row[19] * wz + row[21] * rate1 + row[20] * rate2


@inlined
def rates(row: Array, normal: float, p1: float, p2: float) -> tuple[float, float]:
    """Return the rates α̇ [rad/s] for conjugate momenta p1 and p2 [kg m²/s]; inverse of `momenta`.

    `row` is the plane geometry, `normal` the component of the angular momentum along the normal [kg m²/s].
    """
    wz = normal * row[22]
    q1, q2 = p1 - row[18] * wz, p2 - row[19] * wz
    return row[24] * q1 + row[26] * q2, row[26] * q1 + row[25] * q2


@inlined
def lagrange_force(
    planar: Planar, row: Array, k: int, wx: float, wy: float, wz: float, rate1: float, rate2: float
) -> float:
    """Return ∂T/∂α_k at fixed ω and α̇ [N m], the centrifugal and Coriolis torque on a barb.

    Args:
        row: plane geometry, see `lay_out`.
        k: 0 for barb 1, 1 for barb 2.
        wx: x component of ω in the middle link's axes [rad/s].
        wy: y component of ω [rad/s].
        wz: z component of ω [rad/s].
        rate1: α̇_1 [rad/s].
        rate2: α̇_2 [rad/s].
    """
    mb, own, share = planar.barb_mass, planar.barb_xx - planar.barb_yy, planar.barb_mass / planar.mass
    sign = -1.0 if k == 0 else 1.0
    cx, cy, ux, uy = row[2 + 2 * k], row[3 + 2 * k], row[6 + 2 * k], row[7 + 2 * k]
    dx, dy = row[10 + 2 * k], row[11 + 2 * k]
    # The direction's own derivative is s z × d.
    ex, ey = -sign * dy, sign * dx
    turned = 2 * own * dx * ex
    ixx = 2 * mb * cy * uy + turned
    iyy = 2 * mb * cx * ux - turned
    izz = 2 * mb * (cx * ux + cy * uy)
    ixy = -mb * (cx * uy + cy * ux) + own * (ex * dy + dx * ey)
    force = 0.5 * (ixx * wx * wx + iyy * wy * wy + izz * wz * wz) + ixy * wx * wy
    # u_k turns with the barb: its derivative is -arm d.
    vx, vy = row[8 - 2 * k], row[9 - 2 * k]
    mine, other = (rate1, rate2) if k == 0 else (rate2, rate1)
    b_mine = -mb * planar.arm * (cx * dy - cy * dx)
    b_other = -mb * share * (ux * vy - uy * vx)
    a_both = share * mb * planar.arm * (dx * vx + dy * vy)
    return float(force + wz * (b_mine * mine + b_other * other) + mine * other * a_both)
