"""What `plan` says of scenes that no cost was fitted to, and what they took: `python -m benchmarks.planned`.

Each scene runs once, in a process of its own, on one core. A phase is compared by the second that it simulated, so that
a pour's duration, which is a guess, does not count; of whole runs both are told, with the phases as long as they were
and as they were planned. Contention for memory raises processor time: the load of the machine is told.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from benchmarks.child import run_child
from dem.plan.outlook import plan
from dem.scene.reading import parse_scene

WHOLE = "whole run"
PLANNED, TOOK, RATIO = "planned [s]", "processor time [s]", "planned over measured [1]"
AHEAD = "planned ahead over measured [1]"
WITHIN = 0.25


def _scene(
    engine: str, count: int, aspect: float, activity: Mapping[str, Any], *, seconds: float, radius: float = 0.0234,
    fidelity: str = "standard", per_layer: int = 12, rest: float = 0.1, seed: int = 7,
) -> dict[str, Any]:  # fmt: skip
    doing = {"duration_s": seconds, **activity}
    return {
        "schema_version": 1,
        "name": f"{engine} {fidelity}, {count} of l/w = {aspect:g}, {activity['type']}",
        "engine": engine,
        "seed": seed,
        "count": count,
        "smarticle": {"aspect_ratio": aspect},
        "container": {"radius_m": radius},
        "fidelity": fidelity,
        "phases": [{"type": "deposit", "per_layer": per_layer}, {"type": "relax", "duration_s": rest}, doing],
        "recording": {"checkpoint_interval_s": None},
    }


SHAKE, OSCILLATE = {"type": "shake", "frequency_hz": 50.0, "peak_acceleration_g": 3.0}, {"type": "internal-oscillation"}
FLOOR = {"type": "shake", "frequency_hz": 20.0, "peak_acceleration_g": 1.5}
SCENES: tuple[dict[str, Any], ...] = (
    _scene("links", 120, 0.5, SHAKE, seconds=1.0),
    _scene("links", 700, 0.9, FLOOR, seconds=0.6, radius=0.04, fidelity="draft", per_layer=30),
    _scene("links", 350, 0.6, {**OSCILLATE, "theta_deg": 5.0}, seconds=0.6, radius=0.03, per_layer=15),
    _scene("links", 150, 0.0, SHAKE, seconds=1.0),
    _scene("links", 1500, 0.3, SHAKE, seconds=0.4, radius=0.05, per_layer=60),
    _scene("links", 200, 1.0, {**OSCILLATE, "theta_deg": 15.0}, seconds=0.5, fidelity="reference"),
    _scene("yade", 80, 0.4, FLOOR, seconds=0.4, fidelity="draft", radius=0.018),
    _scene("yade", 130, 0.9, {**OSCILLATE, "theta_deg": 10.0}, seconds=0.1, fidelity="draft"),
    _scene("lammps", 100, 0.5, SHAKE, seconds=0.4, fidelity="draft", radius=0.018),
    _scene("lammps", 250, 1.0, FLOOR, seconds=0.2, fidelity="draft", per_layer=25, radius=0.03),
    # The rates of LAMMPS were set on the two before, when they had been told to be wrong; on these none was.
    _scene("lammps", 160, 0.7, {**SHAKE, "peak_acceleration_g": 2.0}, seconds=0.3, radius=0.022, per_layer=16),
    _scene("lammps", 400, 0.3, FLOOR, seconds=0.2, fidelity="draft", per_layer=50, radius=0.03),
)
"""Counts, lengths, containers and activities that no rate was set on at first."""


def rows_of(folder: Path, number: int, data: dict[str, Any]) -> list[dict[str, Any]]:
    """Run a scene; a row for each phase and one for the whole."""
    name = f"{number:02d}"
    if not (folder / name / "done.json").exists():
        run_child(folder, name, data)
    made, done = plan(parse_scene(data, source="benchmarks")), json.loads((folder / name / "done.json").read_text())
    rows = []
    for phase, took in zip(made.phases, done["phases"], strict=True):
        simulated = took["end_s"] - took["start_s"]
        expected = phase.wall_s / phase.estimate_s * simulated
        rows.append(
            {"scene": data["name"], "phase": phase.type, PLANNED: expected, TOOK: took["cpu_s"],
             RATIO: expected / took["cpu_s"], AHEAD: phase.wall_s / took["cpu_s"]}
        )  # fmt: skip
    planned, took = sum(row[PLANNED] for row in rows), sum(row[TOOK] for row in rows)
    whole = {"scene": data["name"], "phase": WHOLE, PLANNED: planned, TOOK: took}
    return [*rows, {**whole, RATIO: planned / took, AHEAD: made.wall_s / took}]


def main() -> None:
    """Run what is missing, and tell the ratios."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.planned", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/planned"), help="folder for runs and table")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    rows = []
    for number, data in enumerate(SCENES, 1):
        found = rows_of(arguments.out, number, data)
        rows += found
        told = ", ".join(f"{row['phase']} {row[RATIO]:.2f}" for row in found)
        print(f"{data['name']}: {told}; load {os.getloadavg()[0]:.1f}", flush=True)
    table = pd.DataFrame(rows)
    table.to_csv(arguments.out / "planned.csv", index=False, float_format="%.4g")
    for what in (table[table["phase"] != WHOLE], table[table["phase"] == WHOLE]):
        good = ((what[RATIO] - 1).abs() <= WITHIN).sum()
        print(f"{good} of {len(what)} within {WITHIN:.0%}")


if __name__ == "__main__":
    main()
