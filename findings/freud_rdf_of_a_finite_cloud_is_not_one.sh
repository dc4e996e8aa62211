#!/usr/bin/env bash
# freud 3.4.0: density.RDF in a box that is not periodic divides by the density of the box, not of the points' region.
#
# For points in a container (a cylinder, a drop, a clamped pile) one makes a box that holds them and sets its periodic
# directions to False. RDF then still normalises by N / V of the box and by whole spherical shells: random, independent
# points do not give g(r) = 1 but a curve that falls from a wrong value to 0, and another box gives another curve. No
# warning is printed. Dividing by the density of the region repairs small r alone; what shells lack outside the region
# must be counted (the set covariance of the region), or only points far from its boundary may be centres.
#
# Seen on 2026-11-28, 3000 independent points in a cylinder of radius 1 and height 2:
#   cube of 4: g = 9.49 at r = 0.05, 1.78 at r = 1.45
#   cube of 8: g = 75.92 at r = 0.05, 14.25 at r = 1.45
#   cube of 4, times volume of the cylinder over that of the cube: g = 0.93 at r = 0.05, 0.17 at r = 1.45
set -euo pipefail
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
python3 -m venv "$scratch/venv"
"$scratch/venv/bin/python" -m pip -qq --disable-pip-version-check install freud-analysis==3.4.0 "numpy<2.5"
cd "$scratch"
venv/bin/python - <<'PYTHON' | tee said
import freud
import numpy as np

random = np.random.default_rng(1)
around = random.uniform(0, 2 * np.pi, 3000)
radius, height = np.sqrt(random.uniform(size=3000)), random.uniform(-1, 1, 3000)
points = np.column_stack([radius * np.cos(around), radius * np.sin(around), height])
for size, factor in ((4, 1.0), (8, 1.0), (4, np.pi * 2 / 4**3)):
    box = freud.box.Box.cube(size)
    box.periodic = False
    found = freud.density.RDF(bins=15, r_max=1.5).compute((box, points))
    first, last = factor * found.rdf[0], factor * found.rdf[-1]
    more = ", times volume of the cylinder over that of the cube" if factor < 1 else ""
    print(f"cube of {size}{more}: g = {first:.2f} at r = {found.bin_centers[0]:.2f}, {last:.2f} at r = {found.bin_centers[-1]:.2f}")
    # Independent points have g = 1 at all r.
    assert not 0.5 < last < 1.5
PYTHON
grep -qF 'cube of 4: g = 9.49 at r = 0.05, 1.78 at r = 1.45' said
grep -qF 'cube of 8: g = 75.92 at r = 0.05, 14.25 at r = 1.45' said
echo "as described"
