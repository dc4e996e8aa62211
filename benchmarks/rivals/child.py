"""One simulation in a process of its own: `python -m benchmarks.rivals.child TASK.json`; poses go to a file beside it.

Kept apart from what measures: YADE and PyVista never meet in one process, and peak memory is that of one engine.
"""

from __future__ import annotations

import importlib
import json
import resource
import sys
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.rivals.given import Given, Outcome
from benchmarks.rivals.settings import ENGINES
from dem.scene.reading import parse_scene


def perform(task: dict[str, Any], folder: Path) -> Outcome:
    """What a task asks for.

    Args:
        task: engine, knobs, scene and look_s, see `benchmarks.rivals.running`.
        folder: for files of the engine.
    """
    given = Given(parse_scene(task["scene"], source=str(folder)), folder, task["look_s"])
    outcome: Outcome = importlib.import_module(f"benchmarks.rivals.{ENGINES[task['engine']].module}").simulate(
        given, task["knobs"]
    )
    return outcome


def main() -> None:
    """Do it, and tell on stdout."""
    path = Path(sys.argv[1])
    outcome = perform(json.loads(path.read_text(encoding="utf-8")), path.parent)
    np.savez(path.with_suffix(".npz"), positions=outcome.positions, frames=outcome.frames)
    used = [resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    told = {
        "time_step_s": outcome.time_step,
        "processor_s": outcome.processor_s,
        "version": outcome.version,
        # A program that was started has the engine; this process, what feeds it.
        "memory_MiB": (used[1] or used[0]) / 1024,
        "more": dict(outcome.more),
    }
    path.with_suffix(".told.json").write_text(json.dumps(told), encoding="utf-8")


if __name__ == "__main__":
    main()
