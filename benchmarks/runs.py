"""Run scenes in separate processes for benchmarks, and read their costs."""

import json
import os
import resource
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from dem.scene.reading import dump_scene, parse_scene

# The paper's pile of l/w = 0.7; piles with other N have the height of this pile.
PAPER_COUNT, PAPER_RADIUS, PAPER_PER_LAYER = 270, 0.0234, 10


def pile(
    count: int, *phases: dict[str, Any], seed: int = 1, per_layer: int | None = None, **keys: Any
) -> dict[str, Any]:
    """Return a scene as a dictionary: a pour of `count` smarticles, then the given phases.

    The container's radius is such that the pile is as high as the paper's pile of 270 smarticles.
    `per_layer` smarticles are dropped at a time; None: in proportion to the floor's area, but 10 or more.
    """
    widening = (count / PAPER_COUNT) ** 0.5
    per_layer = per_layer or max(PAPER_PER_LAYER, round(PAPER_PER_LAYER * widening**2))
    return {
        "schema_version": 1,
        "seed": seed,
        "count": count,
        "container": {"radius_m": PAPER_RADIUS * widening},
        "phases": [{"type": "deposit", "per_layer": per_layer}, *phases],
        **keys,
    }


def run_child(folder: Path, name: str, data: dict[str, Any]) -> resource.struct_rusage:
    """Run the scene `data` on one thread; return processor time and memory of the process.

    The run directory is `folder/name`. If the run fails, the benchmark exits.
    """
    path = folder / f"{name}.yaml"
    path.write_text(dump_scene(parse_scene(data, source="benchmarks")), encoding="utf-8")
    command = [sys.executable, "-m", "smarticles", "run", str(path), "--out", str(folder / name), "--threads", "1"]
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    if status:
        sys.exit(f"benchmark run {name} failed with status {os.waitstatus_to_exitcode(status)}")
    return usage


def phase_cost(run: Path, phase: int = -1) -> float:
    """Return the processor time per simulated time of a phase of a finished run [s/s].

    `phase` is the index of the phase; -1 is the last phase.
    """
    timed = json.loads((run / "done.json").read_text())["phases"][phase]
    cost: float = timed["cpu_s"] / (timed["end_s"] - timed["start_s"])
    return cost


def folder_of(name: str, out: Path | None) -> Path:
    """Create and return the folder of a benchmark: `out`, or `out/NAME-DATE` if `out` is None."""
    folder = out or Path("out") / f"{name}-{datetime.now(UTC).strftime('%Y%m%d-%H%M%S')}"
    folder.mkdir(parents=True, exist_ok=True)
    return folder
