"""Measure the cost of each physical effect of a scene: `python -m benchmarks.effects`.

Each effect is measured by pairs of runs, without and with the effect, in alternating order, so that other load on the
machine affects both. The processor times of one phase are compared, without loading, pouring and waiting. The table
has the median over pairs of the relative cost, and its quartiles. The first row compares a scene with itself and shows
the noise.
"""

import argparse
import statistics
from pathlib import Path
from typing import Any

import pandas as pd

from benchmarks.runs import folder_of, phase_cost, run_child
from dem.plan.steps import time_step
from dem.scene.reading import parse_scene

Changes = dict[str, Any]
HOLD: Changes = {"type": "actuate", "barbs": {"type": "hold"}}
MEASURED = 1  # index of the compared phase; phase 0 is the pour


def pairs(seconds: float, hinged_step: float) -> list[tuple[str, str, Changes, Changes]]:
    """Return name, cause of cost, and scene keys without and with it, of each effect.

    The compared phase lasts `seconds` [s]; scenes with hinges have the time step `hinged_step` [s]. `scene_data` makes
    a scene of a dictionary of keys.
    """
    rest = {"type": "relax", "duration_s": seconds}
    still = {"type": "shake", "duration_s": seconds, "peak_acceleration_g": 0}
    shake, hold = {"type": "shake", "duration_s": seconds}, {**HOLD, "duration_s": seconds}
    swing = {"type": "internal-oscillation", "theta_deg": 10, "duration_s": seconds}
    fine: Changes = {"fidelity": {"base": "draft", "time_step_s": hinged_step}}
    plain: Changes = {"phases": [rest]}
    hooks = {"lower_height_m": 0.16, "upper_height_m": 0.18}

    def recorded(phase: Changes = rest, **keys: Any) -> Changes:
        return {"phases": [phase], "recording": keys}

    def hinged(*phases: Changes, **keys: Any) -> Changes:
        return {"phases": list(phases), **fine, **keys}

    return [
        ("none", "the same scene twice: the noise of this table", plain, plain),
        ("container motion", "one engine over 129 bodies of the container; Γ = 0", plain, {"phases": [still]}),
        ("container motion", "a pile shaken at Γ = 2: contacts that begin and end", plain, {"phases": [shake]}),
        ("hooks", "forces on four bars far above the pile, in every step", plain, {**plain, "hooks": hooks}),
        ("energies", "forces on the moving container in every step", recorded(still), recorded(still, energy=True)),
        ("energy account", "all contacts read twice per 2e-4 s", plain, recorded(dissipation_interval_s=2e-4)),
        (
            "series",
            "the state read every 4 ms against 40 ms",
            hinged(rest, recording={"series_interval_s": 0.04}),
            hinged(rest),
        ),
        ("frames", "a file every 40 ms against every 0.4 s", recorded(frame_interval_s=0.4), plain),
        ("contact forces", "forces at all contacts, every 40 ms", plain, recorded(contact_forces=True)),
        ("sphere glyphs", "a file every 40 ms, a point per sphere", plain, recorded(sphere_interval_s=0.04)),
        ("checkpoints", "saving and loading every 0.1 s", plain, recorded(checkpoint_interval_s=0.1)),
        ("articulation", f"a time step of {hinged_step:.3g} s, also while welded", plain, hinged(rest)),
        (
            "articulation and motors",
            "three bodies, four bonds, two motors each, which hold",
            hinged(rest),
            hinged(hold),
        ),
        ("motors", "barbs that move (θ = 10°) against barbs that are held", hinged(hold), hinged(swing)),
        ("torque cap", "law slip against law halt", hinged(hold), hinged(hold, motor={"law": "slip"})),
        ("container motion later", "an engine that is idle", plain, {"phases": [rest, {**shake, "duration_s": 0.01}]}),
        ("articulation later", "motors that are idle", hinged(rest), hinged(rest, {**HOLD, "duration_s": 0.01})),
    ]


def scene_data(changes: Changes, *, count: int, seed: int) -> Changes:
    """Return a scene: a pour of `count` of the paper's smarticles, then phases and other keys of `changes`."""
    data: Changes = {"schema_version": 1, "seed": seed, "count": count, "fidelity": "draft", **changes}
    recording = {"checkpoint_interval_s": None, **changes.get("recording", {})}
    phases = [{"type": "deposit"}, *changes["phases"]]
    return {**data, "container": {"height_m": 0.2}, "phases": phases, "recording": recording}


def row(effect: str, cause: str, costs: list[tuple[float, float]]) -> dict[str, Any]:
    """Return a row of the table: the relative cost of an effect [%], as median and quartiles.

    `costs` has the processor time per simulated time without and with the effect [s/s], for each pair of runs.
    """
    shares = [100 * (after / before - 1) for before, after in costs]
    low, _, high = statistics.quantiles(shares, n=4, method="inclusive") if len(shares) > 1 else [shares[0]] * 3
    return {
        "effect": effect,
        "share of the cost without it [%]": round(statistics.median(shares), 2),
        "lower quartile [%]": round(low, 2),
        "upper quartile [%]": round(high, 2),
        "pairs [-]": len(shares),
        "cost without it [s/s]": round(statistics.median(before for before, _ in costs), 3),
        "what for": cause,
    }


def main() -> None:
    """Run all pairs of scenes, write and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.effects", description=__doc__)
    parser.add_argument("--count", type=int, default=60, help="number of smarticles")
    parser.add_argument("--seconds", type=float, default=0.4, help="duration of the compared phase [s]")
    parser.add_argument("--pairs", type=int, default=5, help="number of pairs per effect, each with another seed")
    parser.add_argument("--only", nargs="+", help="effects to measure (default: all)")
    parser.add_argument("--out", type=Path, help="folder for runs and table (default: a new one)")
    given = parser.parse_args()
    folder = folder_of("effects", given.out)
    hinged = parse_scene(scene_data({"phases": [{**HOLD, "duration_s": 0.1}]}, count=1, seed=1), source="benchmarks")
    chosen = [pair for pair in pairs(given.seconds, time_step(hinged)) if not given.only or pair[0] in given.only]
    measured: list[list[tuple[float, float]]] = [[] for _ in chosen]
    # Repeats are the outer loop, so that a temporary load of the machine does not affect one effect alone.
    for repeat in range(given.pairs):
        for k, (effect, _, *variants) in enumerate(chosen):
            costs = [0.0, 0.0]
            # In alternating order, since the second run of a pair profits from warm caches.
            for which in (0, 1) if repeat % 2 else (1, 0):
                name = f"{k:02d}-{repeat}-{('without', 'with')[which]}"
                run_child(folder, name, scene_data(variants[which], count=given.count, seed=1 + repeat))
                costs[which] = phase_cost(folder / name, MEASURED)
            measured[k].append((costs[0], costs[1]))
            print(f"{effect}: {costs[0]:.2f} s/s without, {costs[1]:.2f} s/s with", flush=True)
        table = pd.DataFrame([row(pair[0], pair[1], costs) for pair, costs in zip(chosen, measured, strict=True)])
        table.to_csv(folder / "effects.csv", index=False)
    print(f"\n{table.to_string(index=False)}")


if __name__ == "__main__":
    main()
