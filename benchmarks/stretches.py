"""What steps of a poured pile cost, in a process of its own: the child of `benchmarks.scaling`.

The pile is taken from the last checkpoint of a run, shaken, and advanced in short stretches that are timed one by one;
what they took, the contacts and the memory go to stdout as JSON.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from pathlib import Path
from typing import Any

import yaml

from dem.engine.interface import Engine, Saved
from dem.engine.kinds import engine_kind
from dem.plan.steps import time_steps
from dem.record.checkpoint import read_checkpoint
from dem.record.manifest import read_run
from dem.scene.reading import dump_scene, load_scene, parse_scene, scene_hash

AMPLITUDE, FREQUENCY = 0.552e-3, 30.0  # m, Hz: Γ = 2, the paper's shaking
STEP, LENGTH = 30, 4  # steps before the first stretch, steps of a stretch


def poured(run: Path) -> tuple[Engine, float]:
    """The pile of a run's last checkpoint on as many threads as OMP_NUM_THREADS says, and its time step [s]."""
    scene, made_by = load_scene(run / "scene.yaml"), read_run(run).versions["links"]
    # An engine has a shaker only where the scene calls for one, and the pour does not.
    content = yaml.safe_load(dump_scene(scene))
    content["phases"].append({"type": "shake", "duration_s": 1.0, "frequency_hz": FREQUENCY})
    shaken = parse_scene(content, source=str(run))
    step = min(time_steps(shaken))
    engine = engine_kind("links").build(shaken, step)
    checkpoint, _ = read_checkpoint(run, scene_sha256=scene_hash(scene), made_by=("links", made_by))
    state: dict[str, Any] = dict(checkpoint.state)
    engine.load(Saved(content=checkpoint.engine, memory=state["engine"]), run)
    return engine, step


def main() -> None:
    """Time stretches: `python -m benchmarks.stretches RUN NUMBER`."""
    run, number = Path(sys.argv[1]), int(sys.argv[2])
    engine, _ = poured(run)
    engine.fixtures.shake(amplitude=AMPLITUDE, frequency=FREQUENCY)
    engine.advance(STEP)
    wall, processor = [], []
    for _ in range(number):
        begun, spent = time.perf_counter(), time.process_time()
        engine.advance(LENGTH)
        wall.append(time.perf_counter() - begun)
        processor.append(time.process_time() - spent)
    touches = float(engine.touches().mean())
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    height = float(engine.state().link_positions[..., 2].mean()) - engine.fixtures.floor
    told = {"wall": wall, "processor": processor, "touches": touches, "memory": memory, "height": height}
    print(json.dumps({"count": engine.count, **told}))


if __name__ == "__main__":
    main()
