"""What runs are made of, read from YADE's own lists and from the files that runs leave; see `cases.py`."""

from __future__ import annotations

import sys
from collections import Counter, defaultdict
from pathlib import Path
from types import FrameType
from typing import Any
from unittest.mock import patch

import cases
import h5py
import meshio
import numpy as np

from dem.engine.effect import Adds
from dem.engine.yade.engine import YadeEngine
from dem.plan.effects import decide
from dem.plan.outlook import plan
from dem.plan.steps import time_step
from dem.run.build import build_engine
from dem.run.recorder import Recorder

# What every run directory holds, whatever the scene calls for.
OWN_FILES = {"scene.yaml", "run.json", "log.txt", "done.json", ".lock"}


def inventory(data: dict[str, Any], out: str) -> dict[str, Any]:
    """Run a scene; what it was declared to be made of, and what was found at every sample and on the disk."""
    scene = cases.scene_of(data)
    declared = Adds.together(decision.adds for decision in decide(scene))
    found: dict[str, set[Any]] = defaultdict(set)
    record = Recorder.record

    def look(recorder: Recorder, engine: YadeEngine, phase: int) -> None:
        record(recorder, engine, phase)
        _look(engine, found)

    with patch.object(Recorder, "record", look):
        answer = cases.run(data, out)
    assert answer["error"] is None, answer
    folder = Path(out)
    found["files"] = {path.name for path in folder.iterdir()} - OWN_FILES
    with h5py.File(folder / "series.h5") as file:
        found["series"] = set(file)
    for path in (folder / "frames").iterdir():
        found["arrays"] |= set(meshio.read(path).cell_data)
    kinds = ("engines", "functors", "materials", "shapes", "series", "arrays", "files")
    return {
        "declared": {kind: set(getattr(declared, kind)) for kind in kinds if kind != "engines"},
        "found": {kind: found[kind] for kind in kinds if kind != "engines"},
        "planned": set(plan(scene).engines),
        "engines": found["engines"],
        "contacts": found["contacts"],
        "caps": found["caps"],
        "coefficients": found["coefficients"],
        "most_shear": max(found["shear"], default=0.0),
    }


def _look(engine: YadeEngine, found: dict[str, set[Any]]) -> None:
    omega = engine._omega
    found["engines"].add(tuple(type(one).__name__ for one in omega.engines))
    _, collider, loop, *_ = omega.engines
    for functors in (
        collider.boundDispatcher.functors,
        loop.geomDispatcher.functors,
        loop.physDispatcher.functors,
        loop.lawDispatcher.functors,
    ):
        found["functors"] |= {type(functor).__name__ for functor in functors}
    found["materials"] |= {material.label for material in omega.materials}
    found["shapes"] |= {type(body.shape).__name__ for body in omega.bodies}
    for contact in omega.interactions:
        if contact.isReal:
            phys = contact.phys
            found["contacts"].add((type(contact.geom).__name__, type(phys).__name__))
            if type(phys).__name__ == "CohFrictPhys":
                found["caps"].add(phys.maxTwistPl)
            else:
                found["coefficients"].add((phys.tangensOfFrictionAngle, phys.cn))
                found["shear"].add(phys.shearForce.norm())


def calls_per_step(data: dict[str, Any], *, steps: int, moving: bool = False) -> dict[str, float]:
    """Functions of Python that are entered while time advances, by name, per step; with smarticles present."""
    scene = cases.scene_of(data)
    engine = build_engine(scene, time_step(scene))
    cases.add(engine, (0, 0, 0.05))
    if moving:
        engine.fixtures.shake(amplitude=1e-4, frequency=30)
    engine.advance(3)
    counted: Counter[str] = Counter()

    def enter(frame: FrameType, event: str, _: Any) -> None:
        if event == "call":
            counted[frame.f_code.co_qualname] += 1

    sys.setprofile(enter)
    try:
        engine.advance(steps)
    finally:
        sys.setprofile(None)
    # What is called once, or now and then, is not called per step.
    return {name: number / steps for name, number in counted.items() if number >= steps / 2}


def removal(data: dict[str, Any], *, steps: int, lift: float | None) -> dict[str, Any]:
    """Smarticles that roll about on the floor, clear of the wall, with the wall and without it."""
    states = []
    for remove in (False, True):
        scene = cases.scene_of(data)
        engine = build_engine(scene, time_step(scene))
        cases.pour(engine, scene, scene.count, radius=0.7 * scene.container.radius_m)
        engine.advance(200)
        if remove and lift is None:
            engine.fixtures.remove_wall()
        elif remove:
            engine.fixtures.lift_wall(lift)
        engine.advance(steps)
        state = engine.state()
        states.append(np.concatenate([state.link_positions, state.link_velocities, state.link_spins]))
        walls = set(engine.fixtures.container[:-1])
        contacts = sum(1 for i in engine._omega.interactions if {i.id1, i.id2} & walls and i.isReal)
    speeds = np.linalg.norm(state.velocities, axis=1)
    return {
        "same": states[0].tobytes() == states[1].tobytes(),
        "fastest": float(speeds.max()),
        "contacts": contacts,
        "touching": int(engine.touches().sum()),
        "walled": engine.fixtures.walled,
    }


def account_after_reload(data: dict[str, Any], out: str) -> dict[str, Any]:
    """The energy account of a pile right before and right after the simulation is saved and loaded."""
    scene = cases.scene_of(data)
    engine = build_engine(scene, time_step(scene))
    cases.pour(engine, scene, scene.count)
    engine.advance(2500)
    before, folder = engine.account.elastic(), Path(out)
    engine.load(engine.save(folder), folder)
    after = engine.account.elastic()
    engine.fixtures.remove_wall()
    return {"before": before, "after": after, "dissipated": engine.account.dissipated}
