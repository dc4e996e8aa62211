"""What a step pays for effects that its scene does not use: `python -m benchmarks.unused`.

The loop over steps asks of every effect that works in each step whether it is on. Timed is that loop around a step that
does nothing, against a bare loop around the same; and, for comparison, whole steps of the smallest scene there is, one
smarticle that lies on the floor, and of a small pile. The quickest of many repetitions counts: noise only adds.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from dem.body.placement import place_layer
from dem.engine.yade.engine import YadeEngine
from dem.engine.yade.kind import YadeKind
from dem.plan.steps import time_step
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene

REPEATS = 50
STEPS = 2000
PILE = 60


class Idle:
    """Stands in for YADE's simulation: a step that counts and does nothing else."""

    def __init__(self) -> None:
        self.iter = 0

    def step(self) -> None:
        """Make a step."""
        self.iter += 1


def plain_scene(count: int) -> Scene:
    """A scene that calls for nothing but the plain effects."""
    data: dict[str, Any] = {
        "schema_version": 1,
        "seed": 1,
        "count": count,
        "fidelity": "draft",
        "recording": {"checkpoint_interval_s": None},
        "phases": [{"type": "deposit"}],
    }
    return parse_scene(data, source="benchmarks")


def engine_with(count: int) -> YadeEngine:
    """Smarticles that have come to rest on the floor."""
    scene = plain_scene(count)
    engine = YadeKind().build(scene, time_step(scene))
    engine.add(
        place_layer(
            scene.particle,
            count=count,
            radius=scene.container.radius_m,
            bottom=1e-4,
            height=0.05,
            obstacles=np.empty((0, 3)),
            rng=np.random.default_rng(1),
        )
    )
    engine.advance(round(0.3 / engine.time_step))
    return engine


def quickest(run: Callable[[], object], steps: int, repeats: int) -> float:
    """Nanoseconds of processor time per step."""
    times = []
    for _ in range(repeats):
        begun = time.process_time_ns()
        run()
        times.append(time.process_time_ns() - begun)
    return min(times) / steps


def main() -> None:
    """Print the costs as JSON."""
    # One after the other: YADE has one simulation per process.
    pile = engine_with(PILE)
    costs = {f"step of {PILE} smarticles [ns]": quickest(lambda: pile.advance(200), 200, 20)}
    single = engine_with(1)
    costs["step of one smarticle [ns]"] = quickest(lambda: single.advance(STEPS), STEPS, REPEATS)
    idle = Idle()
    single._omega = idle

    def bare() -> None:
        step = idle.step
        for _ in range(STEPS):
            step()

    loop = quickest(lambda: single.advance(STEPS), STEPS, REPEATS)
    nothing = quickest(bare, STEPS, REPEATS)
    unused = loop - nothing
    costs["unused effects [ns]"] = unused
    for name in list(costs)[:2]:
        costs[f"unused effects over {name.removesuffix(' [ns]')} [%]"] = 100 * unused / costs[name]
    print(json.dumps({name: float(f"{value:.4g}") for name, value in costs.items()}))


if __name__ == "__main__":
    main()
