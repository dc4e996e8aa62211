"""Runs as processes of their own, and what they leave."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np

TIMEOUT_S = 300.0  # for one process; it needs 3 s on a free core


def gate(file: str, count: int, send: str, *, after: str = "", once: str = "") -> dict[str, str]:
    """Variables of a process that sends itself a signal at a moment that files mark; see `gate/sitecustomize.py`."""
    paths = [str(Path(__file__).parent / "gate"), *filter(None, [os.environ.get("PYTHONPATH")])]
    moment = {"file": file, "count": count, "send": send, "after": after, "once": once}
    return {"PYTHONPATH": os.pathsep.join(paths), "GATE": json.dumps(moment)}


def start(scene: Path, out: Path, variables: Mapping[str, str] | None = None, *options: str) -> subprocess.Popen[str]:
    """Run a scene, or go on with it."""
    command = [sys.executable, "-m", "smarticles", "run", str(scene), "--out", str(out), *options]
    if (out / "run.json").exists():
        command.append("--resume")
    # A batch system may set it; a run has one thread all the same, and the same bits.
    environment = {**os.environ, "OMP_NUM_THREADS": "2", **(variables or {})}
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def finish(process: subprocess.Popen[str], timeout_s: float = TIMEOUT_S) -> tuple[int, str]:
    _, said = process.communicate(timeout=timeout_s)
    return process.returncode, said


def complete(scene: Path, out: Path) -> str:
    """Run to the end; what was printed on the way."""
    status, said = finish(start(scene, out))
    assert status == 0, said
    assert (out / "done.json").exists()
    return said


def results(out: Path) -> dict[str, bytes]:
    folders = [out / name for name in ("frames", "spheres") if (out / name).exists()]
    files = [out / "series.h5", *sorted(out.glob("*.pvd")), *(path for each in folders for path in each.iterdir())]
    return {str(path.relative_to(out)): path.read_bytes() for path in files}


def differing(one: dict[str, bytes], other: dict[str, bytes]) -> list[str]:
    return sorted(name for name in {*one, *other} if one.get(name) != other.get(name))


def series(out: Path) -> dict[str, np.ndarray]:
    """The columns of a run's series."""
    with h5py.File(out / "series.h5") as file:
        return {name: dataset[()] for name, dataset in file.items()}


def frame_files(out: Path) -> list[Path]:
    """A run's frames in the order of time."""
    return sorted((out / "frames").glob("*.vtu"))
