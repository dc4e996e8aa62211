"""What checkpoints cost: the same run with and without them, in turn; `python -m benchmarks.checkpoints`.

Pairs are run one after the other, so that a busy machine weighs on both. Processor time is compared, since wall time
on a shared machine tells of the neighbours; waiting for the disk (3.5 MB per checkpoint, flushed) is not in it.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.child import run_child

INTERVAL_S = 0.4  # the default of `recording.checkpoint_interval_s`


def scene_data(*, interval_s: float | None, count: int, shake_s: float) -> dict[str, Any]:
    """The paper's pile at l/w = 0.7, draft; shaken long enough for several checkpoints of the full pile."""
    return {
        "schema_version": 1,
        "name": "checkpoints",
        "seed": 1,
        "smarticle": {"aspect_ratio": 0.7},
        "count": count,
        "fidelity": "draft",
        "recording": {"checkpoint_interval_s": interval_s},
        "phases": [{"type": "deposit"}, {"type": "shake", "duration_s": shake_s}],
    }


def processor_s(folder: Path, name: str, data: dict[str, Any]) -> float:
    """Processor time of one run [s], loading of YADE included."""
    usage = run_child(folder, name, data)
    return usage.ru_utime + usage.ru_stime


def main() -> None:
    """Print the cost of each pair, and the median."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.checkpoints", description=__doc__)
    parser.add_argument("--count", type=int, default=270, help="number of smarticles")
    parser.add_argument("--shake", type=float, default=0.8, help="length of the shaking [s]")
    parser.add_argument("--pairs", type=int, default=3, help="how often both are run")
    arguments = parser.parse_args()
    costs = []
    with tempfile.TemporaryDirectory() as scratch:
        for pair in range(arguments.pairs):
            spent = {
                interval_s: processor_s(
                    Path(scratch),
                    f"{pair}-{interval_s}",
                    scene_data(interval_s=interval_s, count=arguments.count, shake_s=arguments.shake),
                )
                # Turn about: what comes second finds the caches warm.
                for interval_s in ((INTERVAL_S, None) if pair % 2 else (None, INTERVAL_S))
            }
            with_, without = spent[INTERVAL_S], spent[None]
            costs.append(100 * (with_ / without - 1))
            print(f"pair {pair}: {with_:.1f} s with, {without:.1f} s without: {costs[-1]:+.2f} %", flush=True)
    print(f"median: {statistics.median(costs):+.2f} % of processor time (to be below 3 % of wall time)")


if __name__ == "__main__":
    main()
