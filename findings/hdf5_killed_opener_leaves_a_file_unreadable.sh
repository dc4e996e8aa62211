#!/usr/bin/env bash
# h5py 3.16.0 (HDF5 2.0.0): a process that only opened a file "r+" and was killed makes the file unreadable.
#
# Opening a file "r+" sets a mark in its superblock, not only writing; closing clears it. If the process is killed in
# between, as batch systems do, the mark stays. Readers obey it in files of superblock version 3, which libver="v110"
# or later writes: every later reader fails, also without locks, although only the superblock has changed. The message
# speaks of a file that "is already open", which it is not. `h5clear -s` removes the mark; h5py reads the data at once
# through a Python file object, whose driver does not look at the mark.
#
# Seen on 2026-11-28:
#   superblock 2: [1, 2, 3]; changed bytes: [11, 44, 45, 46, 47]
#   superblock 3: Unable to synchronously open file (file is already open for write (may use <h5clear file> to clear file consistency flags)); changed bytes: [11, 44, 45, 46, 47]
#   superblock 3, locking=False: (the same message)
#   superblock 3, through a Python file: [1, 2, 3]
set -euo pipefail
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
python3 -m venv "$scratch/venv"
"$scratch/venv/bin/python" -m pip -qq --disable-pip-version-check install h5py==3.16.0 numpy==2.4.6
cd "$scratch"
venv/bin/python - <<'PYTHON' | tee said
import os
import signal
import subprocess
import sys

import h5py

HOLD = "import h5py, os, signal, sys; f = h5py.File(sys.argv[1], 'r+'); os.kill(os.getpid(), signal.SIGKILL)"


def read(name: str, **how: object) -> str:
    try:
        with h5py.File(name, "r", **how) as file:
            return str(file["x"][:].tolist())
    except OSError as error:
        return str(error)


for version, library in ((2, "v108"), (3, "v110")):
    name = f"{version}.h5"
    with h5py.File(name, "w", libver=library) as file:
        file["x"] = [1, 2, 3]
    before = open(name, "rb").read()
    done = subprocess.run([sys.executable, "-c", HOLD, name])
    assert done.returncode == -signal.SIGKILL
    after = open(name, "rb").read()
    changed = [k for k, (one, other) in enumerate(zip(before, after)) if one != other]
    assert before[8] == version
    print(f"superblock {version}: {read(name)}; changed bytes: {changed}")
print("superblock 3, locking=False:", read("3.h5", locking=False))
with open("3.h5", "rb") as raw, h5py.File(raw, "r") as file:
    print("superblock 3, through a Python file:", file["x"][:].tolist())
PYTHON
grep -q "superblock 2: \[1, 2, 3\]" said
[ "$(grep -c "^superblock 3.*already open for write" said)" -eq 2 ]
grep -q "through a Python file: \[1, 2, 3\]" said
echo "as described"
