#!/usr/bin/env bash
# SciPy 1.17.1, NumPy 2.4.6: Rotation.apply turns the same vectors into other bits on another processor.
#
# Turning points by a rotation is nine products and six sums, which one expects to be the same everywhere; libraries that
# draw random poses (pours of granular particles, molecules in a box) rely on it for "the same seed, the same start".
# Rotation.apply hands the product to BLAS, and OpenBLAS chooses its kernel by the processor that it meets: kernels with
# fused multiply-add round once where others round twice. The last bits of the start differ, and a chaotic simulation is
# another one within a second. as_matrix and the product of two rotations do not go through BLAS and keep their bits.
#
# Seen on 2026-11-28, 2000 points, one processor; OPENBLAS_CORETYPE chooses what OpenBLAS would choose on others:
#   Haswell and Prescott: as_matrix and product of rotations equal; apply differs in 2256 of 6000 numbers, by at most 3.3e-16
set -euo pipefail
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
python3 -m venv "$scratch/venv"
"$scratch/venv/bin/python" -m pip -qq --disable-pip-version-check install scipy==1.17.1 numpy==2.4.6
cd "$scratch"
cat > turn.py <<'PYTHON'
import sys
import numpy as np
from scipy.spatial.transform import Rotation

random = np.random.default_rng(1)
points = random.uniform(-1, 1, (2000, 3))
quaternions = random.normal(size=(2, 4))
one, other = (Rotation.from_quat(each) for each in quaternions)
np.savez(sys.argv[1], matrix=one.as_matrix(), product=(one * other).as_quat(), apply=one.apply(points))
PYTHON
for core in Haswell Prescott; do OPENBLAS_CORETYPE=$core venv/bin/python turn.py "$core.npz"; done
venv/bin/python - <<'PYTHON' | tee said
import numpy as np

haswell, prescott = np.load("Haswell.npz"), np.load("Prescott.npz")
for name in haswell:
    differ = int((haswell[name] != prescott[name]).sum())
    print(f"{name}: {differ} of {haswell[name].size} numbers differ, by at most {np.abs(haswell[name] - prescott[name]).max():.1e}")
PYTHON
grep -qx 'matrix: 0 of 9 .*' said
grep -qx 'product: 0 of 4 .*' said
grep -Eqx 'apply: [1-9][0-9]* of 6000 numbers differ, by at most [1-3].[0-9]e-16' said
echo "as described"
