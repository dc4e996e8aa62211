"""What runs consist of, read from YADE's own lists and from the files of runs; see `cases.py`."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import Any

import cases
import h5py
import meshio

from dem.engine.effect import Adds
from dem.engine.yade.engine import YadeEngine
from dem.plan.effects import decide
from dem.plan.outlook import plan
from dem.plan.steps import time_step
from dem.run.build import build_engine

# What every run directory holds, whatever the scene calls for.
OWN_FILES = {"scene.yaml", "run.json", "log.txt", "done.json", ".lock"}


def inventory(data: dict[str, Any], out: str) -> dict[str, Any]:
    """Run a scene; what it was declared to be made of, and what was found at every sample and on the disk."""
    scene = cases.scene_of(data)
    declared = Adds.together(decision.adds for decision in decide(scene))
    found: dict[str, set[Any]] = defaultdict(set)
    cases.watched(data, out, lambda engine, _: _look(engine, found))
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


def ledger_after_reload(data: dict[str, Any], out: str) -> dict[str, Any]:
    """Energies of a pile right before and right after the simulation is saved and loaded."""
    scene = cases.scene_of(data)
    engine = build_engine(scene, time_step(scene))
    cases.pour(engine, scene, scene.count)
    engine.advance(2500)
    before, folder = engine.ledger.elastic(), Path(out)
    engine.load(engine.save(folder), folder)
    after = engine.ledger.elastic()
    engine.boundaries.remove_wall()
    return {"before": before, "after": after, "dissipated": engine.ledger.dissipated}
