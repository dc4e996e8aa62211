#!/usr/bin/env bash
# h5py 3.16.0 (HDF5 2.0.0): `locking=False` is refused while the same process has the file open with the default.
#
# HDF5 files on shared file systems without locks are usually read with h5py.File(name, "r", locking=False). A reader
# that follows this advice fails as soon as any other part of the same process, such as a writer or a second library,
# has the file open with the default settings: both openings must agree, which has nothing to do with locks of other
# processes. The message names neither the other opening nor the way out. Handing HDF5 a Python file object works.
#
# Seen on 2026-11-28:
#   default, then locking=False: Unable to synchronously open file (file locking flag values don't match)
#   locking=False, then default: Unable to synchronously open file (file locking flag values don't match)
#   a Python file beside the default: [1, 2, 3]
set -euo pipefail
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
python3 -m venv "$scratch/venv"
"$scratch/venv/bin/python" -m pip -qq --disable-pip-version-check install h5py==3.16.0 numpy==2.4.6
cd "$scratch"
venv/bin/python - <<'PYTHON' | tee said
import h5py

with h5py.File("a.h5", "w") as file:
    file["x"] = [1, 2, 3]


def opened(first: dict, second: dict) -> str:
    with h5py.File("a.h5", "r", **first):
        try:
            with h5py.File("a.h5", "r", **second) as again:
                return str(again["x"][:].tolist())
        except OSError as error:
            return str(error)


print("default, then locking=False:", opened({}, {"locking": False}))
print("locking=False, then default:", opened({"locking": False}, {}))
with h5py.File("a.h5", "r"), open("a.h5", "rb") as raw, h5py.File(raw, "r") as again:
    print("a Python file beside the default:", again["x"][:].tolist())
PYTHON
[ "$(grep -c "flag values don't match" said)" -eq 2 ]
grep -q "beside the default: \[1, 2, 3\]" said
echo "as described"
