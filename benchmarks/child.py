"""A run in a process of its own, on one thread unless told: what every benchmark of the simulator times."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
from pathlib import Path
from typing import Any

from dem.scene.reading import dump_scene, parse_scene


def run_child(folder: Path, name: str, data: dict[str, Any], *, threads: int = 1) -> resource.struct_rusage:
    """Run a scene into `folder/name`; ends the benchmark if it fails.

    Args:
        folder: where the scene file and the run directory go.
        name: of both.
        data: the scene, as in a scene file.
        threads: of the engine.

    Returns:
        What the process used, loading of YADE included.
    """
    path = folder / f"{name}.yaml"
    path.write_text(dump_scene(parse_scene(data, source="benchmarks")), encoding="utf-8")
    command = [sys.executable, "-m", "smarticles", "run", str(path), "--out", str(folder / name)]
    command += ["--threads", str(threads)]
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    if status:
        sys.exit(f"benchmark run {name} failed with status {os.waitstatus_to_exitcode(status)}")
    return usage


def last_phase_cost(run: Path) -> float:
    """Wall seconds per simulated second of the last phase of a finished run."""
    phase = json.loads((run / "done.json").read_text())["phases"][-1]
    cost: float = phase["wall_s"] / (phase["end_s"] - phase["start_s"])
    return cost
