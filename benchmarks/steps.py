"""What steps of a shaken pile cost on YADE or LAMMPS, in a process of its own: the child of `benchmarks.growth`.

The smarticles are those of the last frame of a run; what overlaps as chains of spheres is let apart without speed, then
the pile is shaken and advanced in stretches as long as those between two samples of a series, which are timed one by
one. What they took and the memory go to stdout as JSON.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from pathlib import Path
from typing import Any

import yaml

from benchmarks.stretches import AMPLITUDE, FREQUENCY
from dem.engine.interface import Engine
from dem.engine.kinds import engine_kind
from dem.engine.lammps.engine import LammpsEngine
from dem.phases.take_over import STRIDE, TakeOver, poses_of
from dem.plan.steps import time_step
from dem.scene.reading import dump_scene, load_scene, parse_scene
from dem.scene.scene import Scene

STOPS, BEFORE, LENGTH = 10, 40, 40  # times that smarticles are stopped; steps shaken before; steps of a stretch


def scene_on(engine: str, run: Path, fidelity: str) -> Scene:
    """The scene of a run, taken over and shaken by an engine."""
    content: dict[str, Any] = yaml.safe_load(dump_scene(load_scene(run / "scene.yaml")))
    content |= {"engine": engine, "fidelity": fidelity}
    content["phases"] = [
        {"type": "take-over", "run": str(run.absolute())},
        {"type": "shake", "duration_s": 1.0, "frequency_hz": FREQUENCY},
    ]
    return parse_scene(content, source=str(run))


def shaken(scene: Scene) -> Engine:
    """The pile while it is shaken."""
    step = time_step(scene)
    engine = engine_kind(scene.engine).build(scene, step)
    first = scene.phases[0]
    assert isinstance(first, TakeOver)
    engine.add(poses_of(scene, first.taken))
    for _ in range(STOPS):
        engine.advance(STRIDE)
        engine.still()
    engine.fixtures.shake(amplitude=AMPLITUDE, frequency=FREQUENCY)
    engine.advance(BEFORE)
    return engine


def memory(engine: Engine) -> float:
    """The most that this process and the ranks of LAMMPS held [MiB]."""
    found = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    if isinstance(engine, LammpsEngine):
        for rank in engine.child.local_ranks():
            lines = Path(f"/proc/{rank}/status").read_text().splitlines()
            found += sum(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM:"))
    return found


def main() -> None:
    """Time stretches: `python -m benchmarks.steps ENGINE RUN FIDELITY NUMBER`."""
    name, run, fidelity, number = sys.argv[1], Path(sys.argv[2]), sys.argv[3], int(sys.argv[4])
    scene = scene_on(name, run, fidelity)
    engine = shaken(scene)
    wall, processor = [], []
    for _ in range(number):
        begun, spent = time.perf_counter(), time.process_time() + engine.cpu_elsewhere
        engine.advance(LENGTH)
        wall.append(time.perf_counter() - begun)
        processor.append(time.process_time() + engine.cpu_elsewhere - spent)
    told = {
        "wall": wall,
        "processor": processor,
        "memory": memory(engine),
        "step": engine.time_step,
        "spheres": len(scene.particle.centres),
    }
    print(json.dumps({"count": engine.count, "touches": float(engine.touches().mean()), **told}))


if __name__ == "__main__":
    main()
