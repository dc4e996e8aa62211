"""How far a change without strength drives a run from its twin: `python -m benchmarks.twins`.

Pairs of runs that should be the same: with hooks that nothing touches, with checkpoints, with frames or an account that
only look, with a container that is shaken at Γ = 0, with motors that hold. Compared are bits, at every sample of the
series; for those that part, when and by how much at first, and what it does to the packing fraction in the end, against
the scatter between seeds. Nothing here is timed.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from benchmarks.child import run_child

Columns = Mapping[str, NDArray[Any]]

COUNT = 40
FINE: Mapping[str, Any] = {"fidelity": {"base": "draft", "time_step_s": 2e-5}}
FAR_ABOVE: Mapping[str, Any] = {"hooks": {"lower_height_m": 0.16, "upper_height_m": 0.18}}


def scene_data(seed: int, *phases: Mapping[str, Any], **changes: Any) -> dict[str, Any]:
    """A small pile of the paper's smarticles, l/w = 0.7, draft."""
    recording = {"checkpoint_interval_s": None, **changes.pop("recording", {})}
    return {
        "schema_version": 1,
        "name": "twins",
        "seed": seed,
        "count": COUNT,
        "fidelity": "draft",
        "container": {"radius_m": 0.02, "height_m": 0.2},
        "recording": recording,
        "phases": [{"type": "deposit"}, {"type": "relax", "duration_s": 0.1}, *phases],
        **changes,
    }


def twins(seconds: float) -> Mapping[str, tuple[Mapping[str, Any], Mapping[str, Any]]]:
    """Scenes without and with, by the effect that makes the difference."""
    shake = {"type": "shake", "duration_s": seconds}
    rest = {"type": "relax", "duration_s": seconds}
    still = {**shake, "peak_acceleration_g": 0}
    hold = {"type": "actuate", "barbs": {"type": "hold"}, "duration_s": seconds}
    shaken = {"phases": [shake]}
    return {
        "sphere glyphs": (shaken, {**shaken, "recording": {"sphere_interval_s": 0.04}}),
        "energies": (shaken, {**shaken, "recording": {"energy": True}}),
        "energy account": (shaken, {**shaken, "recording": {"dissipation_interval_s": 1e-3}}),
        "container motion, Γ = 0": ({"phases": [rest]}, {"phases": [still]}),
        "hooks far above the pile": (shaken, {**shaken, **FAR_ABOVE}),
        "checkpoints": (shaken, {**shaken, "recording": {"checkpoint_interval_s": 0.4}}),
        "motors that hold": ({"phases": [rest], **FINE}, {"phases": [hold], **FINE}),
    }


def columns(run: Path) -> Columns:
    """The series of a run."""
    with h5py.File(run / "series.h5") as file:
        return {name: dataset[()] for name, dataset in file.items()}


def packing(series: Columns) -> float:
    """Mean φ over the second half of the last phase [1]."""
    phi = series["packing_fraction"][series["phase"] == series["phase"][-1]]
    return float(phi[len(phi) // 2 :].mean())


def parting(one: Columns, other: Columns) -> tuple[float, float] | None:
    """When two runs part and how far.

    Returns:
        Time after the beginning of their last phase [s], and the relative difference of the kinetic energy then [1];
        None where they do not part.
    """
    samples = min(len(one["time_s"]), len(other["time_s"]))
    for k in range(samples):
        if any(one[name][k].tobytes() != other[name][k].tobytes() for name in one):
            begun = one["time_s"][one["phase"] == one["phase"][-1]][0]
            difference = abs(other["kinetic_energy_J"][k] / one["kinetic_energy_J"][k] - 1)
            return float(one["time_s"][k] - begun), float(difference)
    return None


def row(name: str, found: Sequence[tuple[Columns, Columns]]) -> dict[str, Any]:
    """One row of the table, over seeds."""
    parted = [each for one, other in found if (each := parting(one, other)) is not None]
    packed = np.array([[packing(one), packing(other)] for one, other in found])
    apart = np.diff(packed, axis=1)
    return {
        "effect": name,
        "seeds [-]": len(found),
        "runs that part [-]": len(parted),
        "earliest, after the phase began [s]": min((time for time, _ in parted), default=math.nan),
        "kinetic energy apart by then [-]": max((difference for _, difference in parted), default=math.nan),
        "phi with less without, mean [-]": apart.mean(),
        "phi with less without, largest [-]": np.abs(apart).max(),
        "phi, scatter between seeds [-]": packed[:, 0].std(ddof=1),
    }


def main() -> None:
    """Run all pairs and print one table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.twins", description=__doc__)
    parser.add_argument("--seconds", type=float, default=0.5, help="length of the phase that is compared [s]")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3], help="one pair of each kind per seed")
    parser.add_argument("--out", type=Path, default=None, help="folder for runs and twins.csv (default: a new one)")
    arguments = parser.parse_args()
    folder = arguments.out or Path("out") / f"twins-{datetime.now(UTC).strftime('%Y%m%d-%H%M%S')}"
    folder.mkdir(parents=True)
    done: dict[str, Path] = {}

    def series_of(changes: Mapping[str, Any], seed: int) -> Columns:
        more = {key: value for key, value in changes.items() if key != "phases"}
        data = scene_data(seed, *changes["phases"], **more)
        key = repr(data)
        if key not in done:
            name = f"{len(done):02d}"
            run_child(folder, name, data)
            done[key] = folder / name
        return columns(done[key])

    rows = []
    for name, (without, with_) in twins(arguments.seconds).items():
        rows.append(row(name, [(series_of(without, seed), series_of(with_, seed)) for seed in arguments.seeds]))
        table = pd.DataFrame(rows)
        table.to_csv(folder / "twins.csv", index=False, float_format="%.3g")
    print(table.to_string(index=False))


if __name__ == "__main__":
    main()
