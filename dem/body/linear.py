"""Linear algebra of small matrices, with identical bits on every processor.

BLAS and LAPACK choose their kernels by the processor and differ in the last digit. A pile is chaotic, so that this
changes all poses within a second. Here everything consists of NumPy's elementwise operations and sums in a fixed order.
"""

import numpy as np

from dem.arrays import Array, Flags

SWEEPS = 12  # of Jacobi's method, which converges quadratically: five are enough for 4 × 4 matrices


def matrix_product(a: Array, b: Array) -> Array:
    """Return the products (…, i, k) of matrices (…, i, j) and (…, j, k)."""
    total: Array = a[..., :, :1] * b[..., :1, :]
    for j in range(1, b.shape[-2]):
        total = total + a[..., :, j : j + 1] * b[..., j : j + 1, :]
    return total


def applied(matrix: Array, points: Array) -> Array:
    """Return matrices (…, i, j) times points (…, n, j), or times common points (n, j), as (…, n, i)."""
    return matrix_product(points, np.swapaxes(matrix, -1, -2))


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
