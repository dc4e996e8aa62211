"""Cross-check by GrainLearning 2.0.5, sequential Monte Carlo: weights of the same runs at the fitted data.

`python grainlearning_check.py runs.csv measured.csv` in an environment with `pip install grainlearning pandas`.
"""

import sys

import numpy as np
import pandas as pd
from grainlearning import DynamicSystem, IterativeBayesianFilter

NAMES, LOW, HIGH = ["friction", "wall", "restitution"], [0.2, 0.2, 0.5], [1.0, 1.5, 0.9]
runs, data = pd.read_csv(sys.argv[1], comment="#"), pd.read_csv(sys.argv[2])
fitted = data[data["predict"] == 0]
theta, sims = [], []
for _, part in runs.groupby(["wave", "point"]):
    theta.append(part.iloc[0][NAMES].to_numpy(float))
    sims.append([part.loc[part["l_over_w"] == row.l_over_w, row.measure].iloc[0] for row in fitted.itertuples()])
theta, sims = np.array(theta), np.array(sims)
system = DynamicSystem(
    obs_data=fitted["value"].to_numpy()[:, None], num_samples=len(theta), param_min=LOW, param_max=HIGH,
    param_names=NAMES, obs_names=[f"{row.measure} {row.l_over_w}" for row in fitted.itertuples()],
    param_data=theta, sim_data=sims[:, :, None],
)  # fmt: skip
bayes = IterativeBayesianFilter.from_dict({"Bayes_filter": {"ess_target": 0.25}, "sampling": {"max_num_components": 1}})
bayes.run_inference(system)
weights = np.asarray(bayes.posterior).ravel()
mean = weights @ theta
sd = np.sqrt(weights @ (theta - mean) ** 2)
error = float(np.squeeze(system.sigma_max)) ** 0.5
print(f"{len(theta)} points, effective {1 / (weights**2).sum():.1f}, relative error {error:.3g}")
for name, one, spread in zip(NAMES, mean, sd, strict=True):
    print(f"{name}: {one:.3f} ± {spread:.3f} [1]")
