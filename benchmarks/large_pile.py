"""A pile for more than one machine, on one: poured on links, shaken on LAMMPS: `python -m benchmarks.large_pile`.

The pile is as high as the paper's of 270 and as wide as its number asks for. It is poured and rests on links, in layers
thicker than the paper's so that there are ten, and is handed over to LAMMPS (phase `take-over`), where it rests for a
moment and is shaken at Γ = 2 and 30 Hz; all at the coarsest fidelity. The table says of each phase what it cost, and of
its end φ and ⟨N⟩, as they are measured from the files of the run; memory is the most that all its processes held at one
time. A pour that is there is not made again.
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd

from benchmarks import scaling
from dem.plan.outlook import plan
from dem.scene.reading import dump_scene, parse_scene
from postprocess import link_crossings, read_frames, read_run, read_series

COUNT, FIDELITY, REST, SHAKE = 20_000, "draft", 0.02, 0.2  # the last two in s
LAYERS = 10
SETTLE = {"hold_s": 0.01, "speed_m_per_s": 0.05}
MEMORY = "peak memory [MiB]"


def pour_of(count: int) -> dict[str, Any]:
    """Pour and rest on links."""
    scene = scaling.scene_of(count)
    usual, size = scene["phases"][0]["per_layer"], math.ceil(count / LAYERS)
    # As loosely as the paper's; the whole pile need not be stiller than what shaking soon makes of it.
    layers = {"per_layer": size, "layer_height_w": max(1.0, size / usual), "settle": SETTLE}
    return {
        **scene,
        "fidelity": FIDELITY,
        "recording": {**scene["recording"], "frame_interval_s": 0.05},
        "phases": [{"type": "deposit", **layers}, {"type": "relax", "duration_s": 0.1}],
    }


def shake_of(count: int, pour: Path, shake: float) -> dict[str, Any]:
    """Take over, rest for a moment, shake [s], on LAMMPS."""
    return {
        **pour_of(count),
        "name": f"{count} smarticles, poured on links, shaken on LAMMPS",
        "engine": "lammps",
        "recording": {"frame_interval_s": 0.02, "series_interval_s": 0.01, "checkpoint_interval_s": None},
        "phases": [
            {"type": "take-over", "run": str(pour.absolute()), "settle": SETTLE},
            {"type": "relax", "duration_s": REST},
            {"type": "shake", "duration_s": shake},
        ],
    }


def run(folder: Path, name: str, data: dict[str, Any], ranks: int) -> float:
    """Run a scene into `folder/name`; gives the most memory that it and its children held at one time [MiB]."""
    scene = parse_scene(data, source="benchmarks")
    (folder / f"{name}.yaml").write_text(dump_scene(scene), encoding="utf-8")
    print(f"{name}: planned {plan(scene).wall_s / 60:.0f} min on one core", flush=True)
    command = [sys.executable, "-m", "smarticles", "run", str(folder / f"{name}.yaml"), "--out", str(folder / name)]
    child = subprocess.Popen([*command, *(["--ranks", str(ranks)] if data["engine"] == "lammps" else [])])
    most, ended = [0.0], threading.Event()
    watch = threading.Thread(target=_watch, args=(child.pid, most, ended))
    watch.start()
    status = child.wait()
    ended.set()
    watch.join()
    if status:
        sys.exit(f"run {name} ended with status {status}")
    return most[0]


def _watch(parent: int, most: list[float], ended: threading.Event) -> None:
    while not ended.wait(2.0):
        most[0] = max(most[0], sum(map(_held, _family(parent))))


def _family(parent: int) -> Iterator[int]:
    """A process and all that it started, near and far."""
    yield parent
    for task in Path(f"/proc/{parent}/task").glob("*/children"):
        for child in _text(task).split():
            yield from _family(int(child))


def _held(process: int) -> float:
    """Memory of its own in use [MiB]; pages that are shared count where they are held in part."""
    for line in _text(Path(f"/proc/{process}/smaps_rollup")).splitlines():
        if line.startswith("Pss:"):
            return int(line.split()[1]) / 1024
    return 0.0


def _text(path: Path) -> str:
    try:
        return path.read_text()
    except OSError:
        return ""


def told(run: Path, memory: float) -> list[dict[str, Any]]:
    """A row for each phase."""
    manifest, series = read_run(run), read_series(run)
    # ⟨N⟩ takes seconds of a large pile: of the last frame of each phase alone.
    last = {frame.phase: frame for frame in read_frames(run)}
    rows = []
    for phase in manifest.phases:
        assert phase.start is not None
        assert phase.end is not None
        simulated, step = phase.end - phase.start, phase.time_step or manifest.time_step
        each = (phase.cpu_time or 0.0) / (simulated / step) / manifest.count
        own = series["phase"] == phase.index
        rows.append(
            {
                "engine": manifest.engine,
                "ranks or threads [-]": manifest.threads,
                "phase": phase.type,
                "N [-]": manifest.count,
                "simulated time [s]": simulated,
                "dt [us]": 1e6 * step,
                "wall time [s]": phase.wall_time,
                "processor time [s]": phase.cpu_time,
                "per step and smarticle [us]": 1e6 * each,
                "phi at the end [-]": float(series["packing_fraction"][own][-1]),
                "<N> in its last frame [-]": _crossings(last.get(phase.index)),
                MEMORY: memory,
            }
        )
    return rows


def _crossings(frame: Any) -> float:
    return float("nan") if frame is None else float(link_crossings(frame.vertices).mean())


def main() -> None:
    """Pour, hand over, shake, measure."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.large_pile", description=__doc__)
    parser.add_argument("--count", type=int, default=COUNT, help="smarticles (default: %(default)s)")
    parser.add_argument("--ranks", type=int, default=1, help="of LAMMPS (default: %(default)s)")
    parser.add_argument("--shake", type=float, default=SHAKE, help="length of the shaking [s] (default: %(default)s)")
    parser.add_argument("--out", type=Path, default=Path("out/large_pile"), help="folder for both runs and the table")
    arguments = parser.parse_args()
    folder: Path = arguments.out
    folder.mkdir(parents=True, exist_ok=True)
    rows, begun = [], time.monotonic()
    pour, shaken = folder / "pour", f"shake-{arguments.ranks}"
    held = float("nan")
    if not (pour / "done.json").exists():
        held = run(folder, "pour", pour_of(arguments.count), 1)
    rows += told(pour, held)
    held = run(folder, shaken, shake_of(arguments.count, pour, arguments.shake), arguments.ranks)
    rows += told(folder / shaken, held)
    table = pd.DataFrame(rows)
    table.to_csv(folder / "large_pile.csv", index=False, float_format="%.5g")
    print(table.to_string(index=False, float_format=lambda x: f"{x:.4g}"))
    load = f"load of the machine at the end {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    print(f"{(time.monotonic() - begun) / 60:.1f} min, {load}; table: {folder / 'large_pile.csv'}")


if __name__ == "__main__":
    main()
