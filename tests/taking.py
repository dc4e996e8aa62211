"""A pile poured on one engine and taken over on another, step by step; where both run, or links alone."""

from pathlib import Path
from typing import Any

import numpy as np

from dem.phases.take_over import LAST, take
from dem.plan.steps import time_step
from dem.run.build import build_engine
from dem.run.run import run_scene
from dem.scene.reading import parse_scene

ROUND: dict[str, Any] = {"base": "standard", "rows": 1, "stiffness_N_per_m": 500.0}  # round links on both engines
POUR: dict[str, Any] = {
    "fidelity": ROUND,
    "schema_version": 1,
    "name": "pour",
    "seed": 3,
    "count": 20,
    "phases": [{"type": "deposit", "per_layer": 5}, {"type": "relax", "duration_s": 0.2}],
    "recording": {"frame_interval_s": 0.04, "checkpoint_interval_s": None},
}


def pour(engine: str, out: str, fidelity: Any = ROUND) -> None:
    """A pile at rest, as a run."""
    scene = parse_scene({**POUR, "engine": engine, "fidelity": fidelity}, source="pour")
    run_scene(scene, Path(out), command="test")


def taken_over(engine: str, source: str, fidelity: Any = ROUND) -> dict[str, Any]:
    """Take a pile over, and let it settle and rest for 0.1 s."""
    phases = [{"type": "take-over", "run": source}, {"type": "relax", "duration_s": 0.1}]
    scene = parse_scene({**POUR, "engine": engine, "fidelity": fidelity, "phases": phases}, source="on")
    running = build_engine(scene, time_step(scene))
    there = take(Path(source), LAST).vertices
    put, memory = None, {}
    for index, phase in enumerate(scene.phases):
        stage = phase.begin(scene, index)
        while wait := stage.proceed(running):
            put = running.state() if put is None else put
            running.advance(max(1, round(wait / running.time_step)))
        memory |= stage.memory
    assert put is not None
    state, stored = running.state(), running.ledger.elastic()[0]
    moved = np.linalg.norm(state.positions - put.positions, axis=1)
    gravity = running.gravity
    return {
        "off": float(np.abs(put.vertices - there).max()),
        "speeds": float(np.abs(put.link_velocities).max()),
        "stops": memory["stops"],
        "moved": moved,
        "rise": float((state.positions - put.positions)[:, 2].mean()),
        "diameter": scene.sphere_diameter,
        "vertices": state.vertices,
        # What came from nowhere, in heights that it could lift all by [m].
        "gained": (state.kinetic_energy + state.potential_energy(gravity, 0.0) + stored - running.ledger.added)
        / (scene.count * running.particle.boxes.mass * gravity),
        "lost": running.ledger.dissipated,
    }
