"""What each effect costs, and what a scene pays for those that it does not use: `python -m benchmarks.effects`.

Pairs of runs, without an effect and with it, one after the other and turn about, so that a busy machine weighs on both.
Compared is the processor time of one phase (`cpu_s` in `done.json`), which leaves out loading, pouring and waiting; the
share is that of the pair, and the table gives the median over pairs with the spread of the middle half. How much of
that is noise tells the first row: the same scene against itself.

What unused effects cost is too little for pairs. It is a few branches of Python in every step, timed by themselves.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pandas as pd

from benchmarks.child import run_child
from dem.plan.steps import time_step
from dem.scene.reading import parse_scene

DEPOSIT: Mapping[str, Any] = {"type": "deposit"}
HOLD: Mapping[str, Any] = {"type": "actuate", "barbs": {"type": "hold"}}
FAR_ABOVE: Mapping[str, Any] = {"lower_height_m": 0.16, "upper_height_m": 0.18}
MEASURED = 1  # index of the phase that is compared; phase 0 pours


@dataclass(frozen=True, kw_only=True)
class Pair:
    """A scene without an effect and with it.

    Args:
        effect: as `smarticles plan` names it.
        pays: what for.
        without: changes to the plain scene, a pile at rest: its phases after the pour, and other keys.
        with_: the same with the effect.
    """

    effect: str
    pays: str
    without: Mapping[str, Any]
    with_: Mapping[str, Any]


def pairs(seconds: float, hinged_step: float) -> Sequence[Pair]:
    """All pairs.

    Args:
        seconds: length of the phase that is compared [s].
        hinged_step: time step [s] of the same scene with hinges.
    """
    rest = {"type": "relax", "duration_s": seconds}
    still = {"type": "shake", "duration_s": seconds, "peak_acceleration_g": 0}
    hold = {**HOLD, "duration_s": seconds}
    swing = {"type": "internal-oscillation", "theta_deg": 10, "duration_s": seconds}
    plain: Mapping[str, Any] = {"phases": [rest]}
    fine: Mapping[str, Any] = {"fidelity": {"base": "draft", "time_step_s": hinged_step}}

    def recorded(phases: Sequence[Any] = (rest,), **keys: Any) -> Mapping[str, Any]:
        return {"phases": list(phases), "recording": keys}

    return (
        Pair(effect="none", pays="the same scene twice: the noise of this table", without=plain, with_=plain),
        Pair(
            effect="container motion",
            pays="one engine over 129 bodies of the container; Γ = 0",
            without=plain,
            with_={"phases": [still]},
        ),
        Pair(
            effect="container motion",
            pays="a pile that is shaken at Γ = 2: contacts that begin and end, a collider that looks again",
            without=plain,
            with_={"phases": [{"type": "shake", "duration_s": seconds}]},
        ),
        Pair(
            effect="hooks",
            pays="forces on four bars summed in every step; far above the pile",
            without=plain,
            with_={"phases": [rest], "hooks": FAR_ABOVE},
        ),
        Pair(
            effect="energies",
            pays="forces on the container summed in every step while it moves; Γ = 0",
            without={"phases": [still]},
            with_=recorded([still], energy=True),
        ),
        Pair(
            effect="energy account",
            pays="all contacts read twice per sample, every 2e-4 s",
            without=plain,
            with_=recorded(dissipation_interval_s=2e-4),
        ),
        Pair(
            effect="series",
            pays="the state read every 4 ms, the default, against every 40 ms",
            without={"phases": [rest], "recording": {"series_interval_s": 0.04}, **fine},
            with_={"phases": [rest], **fine},
        ),
        Pair(
            effect="frames",
            pays="a file every 40 ms, the default, against every 0.4 s",
            without=recorded(frame_interval_s=0.4),
            with_=plain,
        ),
        Pair(
            effect="contact forces",
            pays="forces at all contacts read and written every 40 ms",
            without=plain,
            with_=recorded(contact_forces=True),
        ),
        Pair(
            effect="sphere glyphs",
            pays="a file every 40 ms, a point per sphere",
            without=plain,
            with_=recorded(sphere_interval_s=0.04),
        ),
        Pair(
            effect="checkpoints",
            pays="saving and loading every 0.1 s; a quarter of it at the default of 0.4 s",
            without=plain,
            with_=recorded(checkpoint_interval_s=0.1),
        ),
        Pair(
            effect="articulation",
            pays=f"a time step of {hinged_step:.3g} s throughout, also while welded",
            without=plain,
            with_={"phases": [rest], **fine},
        ),
        Pair(
            effect="articulation and motors",
            pays="three bodies, four bonds and two motors per smarticle, which hold; at the same time step",
            without={"phases": [rest], **fine},
            with_={"phases": [hold], **fine},
        ),
        Pair(
            effect="motors",
            pays="barbs that move (θ = 10°) against barbs that are held",
            without={"phases": [hold], **fine},
            with_={"phases": [swing], **fine},
        ),
        Pair(
            effect="torque cap",
            pays="law slip, a cap on every shaft, against law halt",
            without={"phases": [hold], **fine},
            with_={"phases": [hold], "motor": {"law": "slip"}, **fine},
        ),
        Pair(
            effect="container motion, in another phase",
            pays="an engine that is there and idle",
            without=plain,
            with_={"phases": [rest, {"type": "shake", "duration_s": 0.01}]},
        ),
        Pair(
            effect="articulation, in another phase",
            pays="functors and motors that are there and idle, at the same time step",
            without={"phases": [rest], **fine},
            with_={"phases": [rest, {**HOLD, "duration_s": 0.01}], **fine},
        ),
    )


def scene_data(changes: Mapping[str, Any], *, count: int, seed: int) -> dict[str, Any]:
    """A pile of the paper's smarticles, l/w = 0.7, draft, and what a pair changes."""
    phases = [DEPOSIT, *changes["phases"]]
    recording = {"checkpoint_interval_s": None, **changes.get("recording", {})}
    return {
        "schema_version": 1,
        "name": "effects",
        "seed": seed,
        "count": count,
        "fidelity": "draft",
        "container": {"height_m": 0.2},
        **changes,
        "phases": phases,
        "recording": recording,
    }


def phase_cost(folder: Path, name: str, data: dict[str, Any]) -> float:
    """Processor seconds per simulated second of the phase that is compared."""
    run_child(folder, name, data)
    phase = json.loads((folder / name / "done.json").read_text())["phases"][MEASURED]
    cost: float = phase["cpu_s"] / (phase["end_s"] - phase["start_s"])
    return cost


def unused_cost() -> Mapping[str, float]:
    """What unused effects cost, see `benchmarks.unused`; a process of its own, since YADE runs in it."""
    answer = subprocess.run([sys.executable, "-m", "benchmarks.unused"], capture_output=True, text=True, check=True)
    costs: Mapping[str, float] = json.loads(answer.stdout)
    return costs


def main() -> None:
    """Run all pairs and print two tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.effects", description=__doc__)
    parser.add_argument("--count", type=int, default=60, help="number of smarticles")
    parser.add_argument("--seconds", type=float, default=0.4, help="simulated time that is compared [s]")
    parser.add_argument("--pairs", type=int, default=5, help="how often each pair is run, each time with another seed")
    parser.add_argument("--only", nargs="+", default=None, help="effects to measure (default: all)")
    parser.add_argument("--out", type=Path, default=None, help="folder for runs and tables (default: a new one)")
    arguments = parser.parse_args()
    folder = arguments.out or Path("out") / f"effects-{datetime.now(UTC).strftime('%Y%m%d-%H%M%S')}"
    folder.mkdir(parents=True)
    hinged = scene_data({"phases": [{**HOLD, "duration_s": 0.1}]}, count=1, seed=1)
    chosen = [
        pair
        for pair in pairs(arguments.seconds, time_step(parse_scene(hinged, source="benchmarks")))
        if arguments.only is None or pair.effect in arguments.only
    ]
    measured: dict[int, list[tuple[float, float]]] = {k: [] for k in range(len(chosen))}
    # Every pair once, then every pair again: what the machine does meanwhile does not fall on one effect.
    for repeat in range(arguments.pairs):
        for k, pair in enumerate(chosen):
            variants = {"without": pair.without, "with": pair.with_}
            # Turn about: what comes second finds the caches warm.
            names = list(variants) if repeat % 2 else list(variants)[::-1]
            costs = {
                name: phase_cost(
                    folder,
                    f"{k:02d}-{repeat}-{name}",
                    scene_data(variants[name], count=arguments.count, seed=1 + repeat),
                )
                for name in names
            }
            measured[k].append((costs["without"], costs["with"]))
            print(f"{pair.effect}: {costs['without']:.2f} s/s without, {costs['with']:.2f} s/s with", flush=True)
        table = pd.DataFrame([row(pair, measured[k]) for k, pair in enumerate(chosen)])
        table.to_csv(folder / "effects.csv", index=False)
    unused = pd.DataFrame([unused_cost()])
    unused.to_csv(folder / "unused.csv", index=False)
    print(f"\n{table.to_string(index=False)}\n\n{unused.to_string(index=False)}")
    print("an effect that is not used is to cost less than 1 % of a step")


def row(pair: Pair, costs: Sequence[tuple[float, float]]) -> dict[str, Any]:
    """One row of the table: median over pairs, and the middle half of them."""
    shares = [100 * (with_ / without - 1) for without, with_ in costs]
    low, _, high = statistics.quantiles(shares, n=4, method="inclusive") if len(shares) > 1 else [shares[0]] * 3
    return {
        "effect": pair.effect,
        "share of the cost without it [%]": round(statistics.median(shares), 2),
        "lower quartile [%]": round(low, 2),
        "upper quartile [%]": round(high, 2),
        "pairs [-]": len(shares),
        "cost without it [s/s]": round(statistics.median(without for without, _ in costs), 3),
        "cost with it [s/s]": round(statistics.median(with_ for _, with_ in costs), 3),
        "what for": pair.pays,
    }


if __name__ == "__main__":
    main()
