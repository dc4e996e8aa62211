"""The bits of a run do not depend on the processor: BLAS kernels and SIMD paths of NumPy are varied."""

import json
import os
import subprocess
import sys
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from every_body_and_phase import CASES, OTHER_ENGINES
from numpy._core._multiarray_umath import __cpu_features__
from scipy.spatial.transform import Rotation

from dem.body.linear import eigen_symmetric, fused, matrix_product, positive_definite, solved, turned
from dem.phases.kinds import KINDS
from dem.setting.shapes import SHAPES, listed

WITHOUT_AVX = "AVX2 FMA3 X86_V3 AVX512F AVX512CD AVX512_SKX X86_V4 AVX512_ICL AVX512_SPR"
WITHOUT_AVX512 = "AVX512F AVX512CD AVX512_SKX X86_V4 AVX512_ICL AVX512_SPR"
# Kernels of BLAS, with SIMD paths of NumPy that such processors have; on older ones than Haswell multiplications and
# additions are not fused, which differed on every machine.
PROCESSORS = {
    "SkylakeX": {"OPENBLAS_CORETYPE": "SkylakeX"},
    "Haswell": {"OPENBLAS_CORETYPE": "Haswell", "NPY_DISABLE_CPU_FEATURES": WITHOUT_AVX512},
    "Nehalem": {"OPENBLAS_CORETYPE": "Nehalem", "NPY_DISABLE_CPU_FEATURES": WITHOUT_AVX},
    "Prescott": {"OPENBLAS_CORETYPE": "Prescott"},
}
NEEDS = {"SkylakeX": "AVX512_SKX", "Haswell": "AVX2"}  # without it OpenBLAS's kernels crash


def varied() -> dict[str, dict[str, str]]:
    """Processors that this one can take the place of."""
    has = __cpu_features__
    return {name: more for name, more in PROCESSORS.items() if has.get(NEEDS.get(name, "SSE3"), True)}


def printed(more: dict[str, str], *words: str) -> str:
    environment = {**os.environ, "OMP_NUM_THREADS": "1", **more}
    command = [sys.executable, "-W", "ignore", *words]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=900).stdout


def assert_same_everywhere(cases: Iterable[str]) -> None:
    """Run cases of `every_body_and_phase` as on every processor, and compare the digests of what they write."""
    program = Path(__file__).with_name("every_body_and_phase.py")
    here = json.loads(printed({}, str(program), *cases))
    assert set(here) == set(cases)
    for name, more in varied().items():
        assert (name, json.loads(printed(more, str(program), *cases))) == (name, here)


def test_every_body_and_every_phase_have_the_same_bits_on_every_processor() -> None:
    assert_same_everywhere(CASES)


@pytest.mark.engine
def test_other_engines_have_the_same_bits_on_every_processor() -> None:
    assert_same_everywhere(OTHER_ENGINES)


def test_the_cases_have_every_body_and_every_phase() -> None:
    bodies = [each for case in CASES.values() for each in listed(case.get("particle")) or []]
    assert {each["shape"] for each in bodies} == {shape.tag() for shape in SHAPES}
    phases = {phase["type"] for case in CASES.values() for phase in case["phases"]}
    assert phases == {kind.tag() for kind in KINDS}


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
    vectors = rng.normal(size=(40, 3))
    assert np.allclose(solved(a[:, :3, :3], vectors), np.linalg.solve(a[:, :3, :3], vectors[..., None])[..., 0])


def test_a_product_and_sum_are_rounded_once() -> None:
    rng = np.random.default_rng(1)
    scales = 10.0 ** rng.integers(-6, 6, size=(3, 200, 1))
    a, b, c = rng.normal(size=(3, 200, 3)) * scales
    c[::2] = -a[::2] * b[::2]  # what is left are the digits that a product loses
    found = fused(a, b, c).ravel().tolist()
    numbers = zip(a.ravel().tolist(), b.ravel().tolist(), c.ravel().tolist(), strict=True)
    assert found == [float(Fraction(x) * Fraction(y) + Fraction(z)) for x, y, z in numbers]
    assert (np.array(found) != (a * b + c).ravel()).sum() > 300


def test_points_are_turned_as_by_a_rotation() -> None:
    rng = np.random.default_rng(2)
    points, turn = rng.normal(size=(30, 3)), Rotation.random(random_state=3)
    # Not exactly, since the product of matrices depends on the processor: sums of three terms, each rounded once more.
    assert np.allclose(
        turned(turn.as_matrix(), points), turn.apply(points), rtol=0, atol=4e-16 * np.abs(points).max() * 3
    )
