"""The bits of a run do not depend on the processor: BLAS kernels and SIMD paths of NumPy and Numba are varied."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from dem.body.linear import eigen_symmetric, matrix_product, positive_definite

# A pour of a few layers and one change of shape, printed as a hash of every array that a step goes on from.
RUN = """
import hashlib, math, sys
sys.path.insert(0, sys.argv[1])
import builds, numpy as np
from dem.engine.links.stable_step import links_stable_time_step
made = builds.engine(gravity=9.81, radius=0.0234, dt=5e-5, motor_law=builds.motor_law("halt"))
builds.pile(made, 12, settle=0.02, per_layer=4)
made.motors.articulate()
for look in range(100):
    made.motors.actuate(np.full((1, made.count, 2), math.pi / 2 * (1 - look / 100)), 2e-4)
    made.advance(4)
digest = hashlib.sha256(repr(links_stable_time_step(made.particle, builds.LAW)).encode())
for name, array in sorted({**made._world.arrays, **made.motors.arrays}.items()):
    digest.update(name.encode() + np.ascontiguousarray(array).tobytes())
print(digest.hexdigest())
"""
PROCESSORS = {
    "Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
    "Sandybridge": {"OPENBLAS_CORETYPE": "Sandybridge"},
    "Prescott": {"OPENBLAS_CORETYPE": "Prescott"},  # without fused multiply-add: differed on every machine
    "NumPy without AVX": {"NPY_DISABLE_CPU_FEATURES": "AVX2 FMA3 X86_V3 AVX512F AVX512CD AVX512_SKX X86_V4"},
}


def digest(more: dict[str, str]) -> str:
    environment = {**os.environ, "OMP_NUM_THREADS": "1", **more}
    words = [sys.executable, "-W", "ignore", "-c", RUN, str(Path(__file__).parent)]
    return subprocess.run(words, env=environment, capture_output=True, text=True, check=True, timeout=900).stdout


@pytest.mark.engine
def test_a_pour_and_a_change_of_shape_have_the_same_bits_on_every_processor() -> None:
    here = digest({})
    assert len(here.strip()) == 64
    assert {name: digest(more) for name, more in PROCESSORS.items()} == dict.fromkeys(PROCESSORS, here)


def test_small_linear_algebra_against_lapack() -> None:
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(40, 4, 4)), rng.normal(size=(40, 4, 4))
    assert np.allclose(matrix_product(a, b), a @ b, atol=1e-14)
    symmetric = a + a.transpose(0, 2, 1)
    symmetric[0] = np.diag([1.0, 1.0, 0.0, -2.0])
    values, vectors = eigen_symmetric(symmetric)
    assert np.allclose(np.sort(values), np.linalg.eigvalsh(symmetric), atol=1e-13)
    assert np.allclose(symmetric @ vectors, vectors * values[:, None, :], atol=1e-13)
    shifted = symmetric + rng.uniform(0, 6, size=40)[:, None, None] * np.eye(4)
    assert (positive_definite(shifted) == (np.linalg.eigvalsh(shifted).min(axis=1) > 0)).all()
