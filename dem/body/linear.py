"""Linear algebra of small matrices, with identical bits on every processor.

BLAS and LAPACK choose their kernels by the processor and differ in the last digit. A pile is chaotic, so that this
changes all poses within a second. Here everything consists of NumPy's elementwise operations and sums in a fixed order.
"""

import math
from collections.abc import Callable

import numpy as np

from dem.arrays import Array, Flags

SWEEPS = 12  # of Jacobi's method, which converges quadratically: five are enough for 4 × 4 matrices


def matrix_product(a: Array, b: Array) -> Array:
    """Return the products (…, i, k) of matrices (…, i, j) and (…, j, k)."""
    total: Array = a[..., :, :1] * b[..., :1, :]
    for j in range(1, b.shape[-2]):
        total = total + a[..., :, j : j + 1] * b[..., j : j + 1, :]
    return total


def dot(a: Array, b: Array) -> float:
    """Return the scalar product of two vectors (n,), summed from the first product on, for n < 8."""
    return float((a * b).sum())


def by_element(function: Callable[..., float], *values: Array) -> Array:
    """Return a function of `math` of each element of arrays of one shape; NumPy's own depend on the processor."""
    flat = (np.ravel(each).tolist() for each in values)
    return np.array([function(*each) for each in zip(*flat, strict=True)]).reshape(np.shape(values[0]))


def fused(a: Array, b: Array, c: Array) -> Array:
    """Return a b + c (n, k), rounded once, as by processors with a fused multiply-add.

    Products a b are split into their rounded values and the rest, which is exact unless it underflows. Arguments are of
    shapes that broadcast to (n, k).

    Source: Dekker, Numer. Math. 18, 224 (1971).
    """

    def halves(x: Array) -> tuple[Array, Array]:
        shifted = 134217729.0 * x  # 2**27 + 1: halves have 26 bits
        high = shifted - (shifted - x)
        return high, x - high

    product, (a1, a2), (b1, b2) = a * b, halves(a), halves(b)
    rest = ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2
    product, rest, c = np.broadcast_arrays(product, rest, c)
    total, left = _two_sum(product, c)
    left, least = _two_sum(left, rest)
    total, left = _two_sum(total, left)
    # What is left decides nothing unless it comes near half the distance to the next number.
    half = np.spacing(np.nextafter(np.abs(total), 0.0)) / 2
    unsure = ~(np.abs(left) + np.abs(least) < (1 - 1e-9) * half)
    terms = np.stack([each[unsure] for each in (product, rest, c)], axis=-1)
    total[unsure] = [math.fsum(three) for three in terms.tolist()]
    return total


def _two_sum(a: Array, b: Array) -> tuple[Array, Array]:
    """Return the rounded sums of arrays, and what is left: exact; Knuth, The Art of Computer Programming 2, 4.2.2."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def turned(turn: Array, points: Array) -> Array:
    """Return points (n, 3) turned by a rotation (3, 3).

    The bits are those of `scipy.spatial.transform.Rotation.apply` on processors with a fused multiply-add.
    """
    x, y, z = turn.T[:, None]
    return fused(points[:, 2:], z, fused(points[:, 1:2], y, points[:, :1] * x))


def applied(matrix: Array, points: Array) -> Array:
    """Return matrices (…, i, j) times points (…, n, j), or times common points (n, j), as (…, n, i)."""
    return matrix_product(points, np.swapaxes(matrix, -1, -2))


def transformed(matrix: Array, vector: Array) -> Array:
    """Return matrices (…, i, j) times vectors (…, j), as (…, i)."""
    return matrix_product(matrix, vector[..., None])[..., 0]


def solved(matrices: Array, vectors: Array) -> Array:
    """Return (…, 3) solutions x of A x = b for A (…, 3, 3) and b (…, 3), by Cramer's rule."""
    columns = [matrices[..., k] for k in range(3)]
    across = [np.cross(columns[(k + 1) % 3], columns[(k + 2) % 3]) for k in range(3)]
    volume = (columns[0] * across[0]).sum(axis=-1)
    return np.stack([(each * vectors).sum(axis=-1) / volume for each in across], axis=-1)


def eigen_symmetric(matrices: Array) -> tuple[Array, Array]:
    """Return eigenvalues (n, k) and eigenvectors (n, k, k) of symmetric matrices (n, k, k).

    Eigenvalues are in no order; eigenvectors are columns.

    Source: Jacobi's cyclic method, Golub and Van Loan, Matrix Computations, section 8.5.
    """
    a = np.array(matrices, dtype=np.float64)
    size = a.shape[-1]
    vectors = np.broadcast_to(np.eye(size), a.shape).copy()
    for _ in range(SWEEPS):
        for p in range(size):
            for q in range(p + 1, size):
                off = a[:, p, q]
                rest = off == 0.0
                with np.errstate(over="ignore"):  # an infinite theta gives a rotation by 0, which is right
                    theta = (a[:, q, q] - a[:, p, p]) / (2 * np.where(rest, 1.0, off))
                    t = np.where(theta < 0, -1.0, 1.0) / (np.abs(theta) + np.sqrt(theta * theta + 1))
                t = np.where(rest, 0.0, t)
                c = 1 / np.sqrt(t * t + 1)
                c, s = c[:, None], (t * c)[:, None]
                rows = a[:, p, :].copy(), a[:, q, :].copy()
                a[:, p, :], a[:, q, :] = c * rows[0] - s * rows[1], s * rows[0] + c * rows[1]
                for each in (a, vectors):
                    columns = each[:, :, p].copy(), each[:, :, q].copy()
                    each[:, :, p], each[:, :, q] = c * columns[0] - s * columns[1], s * columns[0] + c * columns[1]
                a[:, p, q] = a[:, q, p] = 0.0
    return np.einsum("nii->ni", a).copy(), vectors


def positive_definite(matrices: Array) -> Flags:
    """Return (n,) whether symmetric matrices (n, k, k) are positive definite, by Gaussian elimination."""
    a = np.array(matrices, dtype=np.float64)
    good = np.ones(len(a), np.bool_)
    for p in range(a.shape[-1]):
        pivot = a[:, p, p]
        good &= pivot > 0
        row = a[:, p, p + 1 :] / np.where(good, pivot, 1.0)[:, None]
        a[:, p + 1 :, p + 1 :] -= a[:, p + 1 :, p, None] * row[:, None, :]
    return good
