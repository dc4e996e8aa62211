#!/usr/bin/env bash
# scikit-learn 1.9.1 and SALib 1.6.0: Sobol indices of an emulator of pure noise are large, with small error bars.
#
# Sensitivity analysis of costly simulations usually goes by an emulator: a Gaussian process is fitted to a few dozen runs,
# and SALib samples it thousands of times. Where a parameter does nothing and the runs scatter by their seeds alone, one
# expects indices near zero or wide error bars. Indices are shares of the emulator's own variance, however tiny: the mean
# of a process whose fit has found almost nothing but noise still bends a little, along some parameter, and this bend is
# then "100 % of the variance". SALib's confidence interval is that of its own sampling of the emulator, which is smooth
# and cheap, and says nothing of the fit. The share of the runs that the emulator explains, each left out once, does.
#
# Seen on 2026-11-28, 30 runs of 3 parameters, results are independent random numbers; 20 such sets:
#   in 14 of 20 the largest total index is above 0.9, median half width of its interval 0.15
#   explained share of the runs, each left out once: median -0.01
set -euo pipefail
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
python3 -m venv "$scratch/venv"
"$scratch/venv/bin/python" -m pip -qq --disable-pip-version-check install SALib==1.6.0 scikit-learn==1.9.1 numpy==2.4.6 scipy==1.17.1
cd "$scratch"
OMP_NUM_THREADS=1 venv/bin/python -W ignore - <<'PYTHON' | tee said
import numpy as np
from SALib.analyze import sobol
from SALib.sample import sobol as sample
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from sklearn.model_selection import LeaveOneOut, cross_val_predict

problem = {"num_vars": 3, "names": ["a", "b", "c"], "bounds": [[0, 1]] * 3}
points = sample.sample(problem, 256, seed=1)
certain, widths, shares = 0, [], []
for number in range(20):
    random = np.random.default_rng(number)
    inputs, noise = random.uniform(size=(30, 3)), random.normal(size=30)
    kernel = ConstantKernel() * RBF([0.5] * 3, (0.05, 20)) + WhiteKernel()
    process = GaussianProcessRegressor(kernel, normalize_y=True, random_state=0)
    emulated = process.fit(inputs, noise).predict(points)
    if np.ptp(emulated) < 1e-6:
        continue  # a constant: no index is defined
    found = sobol.analyze(problem, emulated, seed=1)
    largest = int(np.argmax(found["ST"]))
    certain += found["ST"][largest] > 0.9
    widths.append(found["ST_conf"][largest])
    fixed = GaussianProcessRegressor(process.kernel_, optimizer=None, normalize_y=True)
    left_out = cross_val_predict(fixed, inputs, noise, cv=LeaveOneOut())
    shares.append(1 - ((noise - left_out) ** 2).sum() / ((noise - noise.mean()) ** 2).sum())
print(f"{certain} of 20: largest total index above 0.9; median half width {np.median(widths):.2f}")
print(f"explained share, left out once: median {np.median(shares):.2f}")
assert certain >= 5
assert np.median(widths) < 0.2
assert np.median(shares) < 0.05
PYTHON
echo "as described"
