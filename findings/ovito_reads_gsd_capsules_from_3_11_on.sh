#!/usr/bin/env bash
# OVITO 3.10.6 refuses a GSD file with a capsule, a rounded polyhedron of two vertices; OVITO 3.11.3 reads it.
#
# GSD's schema for HOOMD-blue describes a capsule as ConvexPolyhedron with two vertices and a rounding_radius, and
# HOOMD-blue simulates it (hpmc.integrate.ConvexSpheropolyhedron). OVITO up to 3.10 stops at the whole file, not at this
# type: no position is read either. The reason is not in the data but in the number of vertices. From 3.11 on the same
# file is read, with the shape Spherocylinder.
#
# Seen on 2026-11-28:
#   OVITO 3.10.6: Invalid 'ConvexPolyhedron' particle shape definition in GSD file: Number of vertices must be at least 4.
#   OVITO 3.11.3: 1 particle, shape Spherocylinder
set -euo pipefail
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cd "$scratch"
cat >write.py <<'PYTHON'
import gsd.hoomd

frame = gsd.hoomd.Frame()
frame.configuration.box = [10, 10, 10, 0, 0, 0]
frame.particles.N = 1
frame.particles.position = [[0, 0, 0]]
frame.particles.types = ["capsule"]
capsule = {"type": "ConvexPolyhedron", "rounding_radius": 0.5, "vertices": [[0, 0, -1], [0, 0, 1]]}
frame.particles.type_shapes = [capsule]
with gsd.hoomd.open("capsule.gsd", "w") as file:
    file.append(frame)
PYTHON
cat >read.py <<'PYTHON'
import ovito
from ovito.io import import_file

try:
    data = import_file("capsule.gsd").compute()
    kind = data.particles.particle_types.types[0]
    print(f"OVITO {ovito.version_string}: {data.particles.count} particle, shape {str(kind.shape).rpartition('.')[2]}")
except RuntimeError as error:
    print(f"OVITO {ovito.version_string}: {' '.join(str(error).split())}")
PYTHON
for version in 3.10.6 3.11.3; do
    python3 -m venv "venv-$version"
    # Files of gsd 4 and later are of a schema that OVITO 3.10 does not know; the capsule is not what it would stop at.
    "venv-$version/bin/python" -m pip -qq --disable-pip-version-check install "ovito==$version" gsd==3.4.2 "numpy<2.5"
    [ -e capsule.gsd ] || "venv-$version/bin/python" write.py
    QT_QPA_PLATFORM=minimal "venv-$version/bin/python" read.py 2>&1 | tee -a said
done
grep -q "OVITO 3.10.6: .*Number of vertices must be at least 4" said
grep -q "OVITO 3.11.3: 1 particle, shape Spherocylinder" said
echo "as described"
