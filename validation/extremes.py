"""Run random extreme scenes and check them: `python -m validation.extremes --count 300 --out DIR`.

Each scene is planned, run and checked. DIR gets the table `extremes.csv`, a scene file per scene, and the run
directories of scenes that fail the check. Scenes with a row in the table are not run again. The checker uses NumPy
alone and shares no code with the engines.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import yaml
from numpy.typing import NDArray

from postprocess import read_frames
from validation.checks import Solid, axes_in_solids, floor_error, linked_pairs, unrest

Array = NDArray[np.float64]

# -- scenes ------------------------------------------------------------------------------------------------------------

SECONDS = 0.3  # duration of the phase after the pour


def draw_scene(number: int) -> dict[str, Any]:
    """Return a random scene as a dictionary; `number` is the seed of the draw and of the scene."""
    rng = np.random.default_rng([28, number])

    def span(low: float, high: float) -> float:
        return round(float(rng.uniform(low, high)), 4)

    def decades(low: float, high: float) -> float:
        return float(f"{10 ** rng.uniform(np.log10(low), np.log10(high)):.4g}")

    w = decades(4e-3, 0.04)
    aspect = float(rng.choice([0.0, 2.0, span(0.05, 0.4), span(0.4, 1.0), span(1.0, 2.0)]))
    thickness = float(f"{w * span(0.03, 0.12):.4g}")
    reach = w * (0.5 + aspect)
    stiffness = {"base": "draft", "stiffness_N_per_m": decades(100, 2e4)}
    kind = int(rng.integers(4))
    scene: dict[str, Any] = {
        "schema_version": 1,
        "engine": "links",
        "name": f"extreme {number}",
        "seed": number,
        "count": int(rng.integers(2, 41)),
        "smarticle": {
            "middle_length_m": w,
            "aspect_ratio": aspect,
            "thickness_normal_m": thickness * (2 if kind == 3 else 1),
            "thickness_in_plane_m": thickness,
            "density_kg_per_m3": decades(1000, 20000),
        },
        "container": {
            "radius_m": float(f"{reach * span(1.2, 3.0):.4g}"),
            "height_m": float(f"{min(60 * reach, 0.9):.4g}"),
        },
        "contact": {
            "friction_smarticle": float(rng.choice([0.0, 10.0, span(0, 1)])),
            "friction_wall": float(rng.choice([0.0, 10.0, span(0, 1)])),
            "restitution": float(rng.choice([0.01, 1.0, span(0.05, 0.95)])),
        },
        "gravity_m_per_s2": float(rng.choice([9.81, decades(0.5, 200)])),
        "motor": {"law": str(rng.choice(["halt", "stall", "ease", "slip", "servo"])), "speed_limit_rad_per_s": 60.0},
        "fidelity": [stiffness, "draft", "standard", {"base": "standard", "rows": 2}][kind],
        "recording": {
            "frame_interval_s": 1e-3,
            "series_interval_s": 1e-3,
            "energy": True,
            "dissipation_interval_s": 2e-4,
            "checkpoint_interval_s": None,
        },
    }
    phases: list[dict[str, Any]] = [
        {
            "type": "deposit",
            "per_layer": int(rng.integers(1, 21)),
            "layer_height_w": span(0.5, 4),
            "thrown_at_m_per_s": float(rng.choice([0.0, span(0, 10)])),
        }
    ]
    shake = {
        "type": "shake",
        "duration_s": SECONDS,
        "frequency_hz": decades(5, 200),
        "peak_acceleration_g": span(0, 10),
    }
    change = {"type": "shape-change", "opening_s": span(0.02, 0.15), "closing_s": span(0.02, 0.15)}
    swing = {"type": "internal-oscillation", "theta_deg": span(1, 60), "duration_s": SECONDS}
    sine = {
        "type": "actuate",
        "barbs": {"type": "sine", "centre_deg": 90, "amplitude_deg": span(1, 60), "frequency_hz": decades(1, 40)},
        "duration_s": SECONDS,
    }
    pull = {"type": "pull-hook", "distance_m": float(f"{SECONDS * w * 4:.4g}"), "speed_m_per_s": float(f"{4 * w:.4g}")}
    chosen = int(rng.choice([0, 1, 1, 5] if aspect == 0 else 6))
    if chosen == 5:
        scene["hooks"] = {} if rng.random() < 0.5 else {"length_m": float(f"{w * span(0.5, 3):.4g}")}
        phases += [{"type": "relax", "duration_s": 0.05}, pull]
    else:
        phases.append([{"type": "relax", "duration_s": SECONDS}, shake, change, swing, sine][chosen])
    return {**scene, "phases": phases}


BODIES = ("closed", "flat", "thin", "mixed", "driven", "plate")
"""Families of scenes of bodies that are no smarticles; a scene's number modulo their number is its family."""


def draw_bodies(number: int) -> dict[str, Any]:
    """Return a random scene of bodies as a dictionary; `number` is the seed of the draw and of the scene."""
    rng = np.random.default_rng([45, number])
    family = BODIES[number % len(BODIES)]

    def span(low: float, high: float) -> float:
        return float(f"{rng.uniform(low, high):.4g}")

    length, density = span(6e-3, 16e-3), span(1000, 8000)
    flat = {"thickness_normal_m": span(1e-3, 3e-3), "thickness_in_plane_m": span(0.3e-3, 0.6e-3)}
    staple = {"shape": "staple", "crown_m": length, "leg_m": span(0.3, 1) * length}
    rod = {"shape": "rod", "length_m": length, "density_kg_per_m3": density}
    particle: Any = {**[staple, rod, {"shape": "z", "middle_m": length, "arm_m": length / 2}][rng.integers(3)], **flat}
    fidelity, radius = "draft", 1.6 * length
    last: dict[str, Any] = {"type": "shake", "duration_s": SECONDS, "frequency_hz": span(15, 60)}
    last["peak_acceleration_g"] = span(1, 4)
    if family == "closed":
        particle = {"shape": "ring", "radius_m": length / 2, "diameter_m": span(0.05, 0.12) * length}
        if rng.random() < 0.5:
            around = 2 * np.pi * np.arange(5) / 5
            points = [[float(f"{length / 2 * f(a):.6g}") for f in (np.cos, np.sin)] + [0.0] for a in around]
            bars = [[i, (i + 1) % 5] for i in range(5)]
            particle = {"shape": "segments", "points_m": points, "pairs": bars, "diameter_m": particle["diameter_m"]}
    elif family in ("flat", "plate"):
        fidelity = str(rng.choice(["standard", "reference"]))
    elif family == "thin":
        section = {"thickness_normal_m": 1.27e-3, "thickness_in_plane_m": 0.5e-3}
        particle = [{**staple, **section}, {**rod, "diameter_m": span(0.15e-3, 0.5e-3)}]
        fidelity = "standard"
    elif family == "mixed":
        thick = span(1e-3, 3e-3)
        crossed = {"shape": "cross", "arm_m": length / 2, "diameter_m": thick, "density_kg_per_m3": density}
        particle = [{**rod, "diameter_m": float(f"{thick / span(2, 8):.3g}"), "share": 3}, {**crossed, "share": 1}]
        last = {"type": "relax", "duration_s": 1.0}
    elif family == "driven":
        particle, last = (
            {**rod, "diameter_m": 1e-3},
            {**last, "frequency_hz": float(f"{10 ** rng.uniform(1.5, 3.3):.4g}")},
        )
        if rng.random() < 0.5:
            last |= {"taps": int(rng.integers(2, 6)), "rest_s": 0.05}
            del last["duration_s"]
    if family == "plate":
        last = {"type": "compress", "speed_m_per_s": span(0.005, 0.05), "strain": 0.1}
    phases = [{"type": "deposit", "per_layer": int(rng.integers(4, 12))}, {"type": "relax", "duration_s": 0.1}, last]
    return {
        "schema_version": 2,
        "engine": "links",
        "name": f"{family} {number}",
        "seed": number,
        "count": int(rng.integers(20, 41)),
        "particle": particle,
        "container": {"radius_m": radius},
        "fidelity": fidelity,
        "phases": phases,
        "recording": {
            "frame_interval_s": 2e-3, "series_interval_s": 1e-3, "energy": True,
            "dissipation_interval_s": 2e-4, "checkpoint_interval_s": None
        },
    }  # fmt: skip


# -- the checker -------------------------------------------------------------------------------------------------------

DEPTH = {"draft": 0.24, "standard": 0.17, "reference": 0.12}
"""Largest penetration of floor or wall by fidelity, over the mean width of a link's section, 2 (t1 + t2)/π: what each
name promises."""
SOFTEST = 0.5  # the same for scenes that give a stiffness of their own
ENERGY = 0.01  # largest excess of energy, over the supplied energy
STORED = (
    "kinetic_energy", "gravitational_energy", "contact_elastic_energy", "hinge_elastic_energy", "stretching_energy",
    "bending_energy", "twisting_energy", "joint_energy", "pin_energy",
)  # fmt: skip
INSIDE = 1e-3  # least distance of a crossing from the ends of a segment, over the length of the segment


def segments(vertices: Array) -> Array:
    """Return the ends (3N, 2, 3) [m] of the axes of all links of smarticles, from vertices (N, 4, 3) [m]."""
    found: Array = np.stack([vertices[:, :-1], vertices[:, 1:]], axis=2).reshape(-1, 2, 3)
    return found


def surface(ends: Array, thickness: float) -> tuple[Array, Array]:
    """Return points (M, 3) [m] on the axes of all links, and radii (M,) [m] of spheres that links contain.

    Points are the ends of each axis, with radius 0, and the points thickness/2 from the ends, with radius thickness/2.
    The spheres lie inside the link, whether its ends are square or round. Ends (M, 2, 3) and thickness are in [m].
    """
    along = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(along, axis=-1)
    wide = length > thickness
    step = along[wide] / length[wide, None] * thickness / 2
    inner = np.concatenate([ends[wide, 0] + step, ends[wide, 1] - step])
    points = np.concatenate([ends.reshape(-1, 3), inner])
    return points, np.repeat([0.0, thickness / 2], [2 * len(ends), len(inner)])


def crossings(one: Array, two: Array, body: NDArray[np.int64] | None = None) -> list[tuple[int, int]]:
    """Find links of different bodies whose axes passed through each other between two frames.

    Ends of axes (M, 2, 3) [m] are assumed to move along straight lines; link m belongs to body[m]; None: each three
    links are a smarticle. When two axes pass through each other, the volume of the tetrahedron of their four ends
    changes sign, and the common point lies within both axes. The result has pairs of links.
    """
    body = np.arange(len(one)) // 3 if body is None else body
    # Links without length (l/w = 0) cannot cross.
    long = np.minimum(np.ptp(one, axis=1), np.ptp(two, axis=1)).max(axis=-1) > 0
    low = np.minimum(one, two).min(axis=1)
    high = np.maximum(one, two).max(axis=1)
    i, j = np.triu_indices(len(one), k=1)
    near = (body[i] != body[j]) & long[i] & long[j]
    i, j = i[near], j[near]
    near = ((low[i] <= high[j]) & (low[j] <= high[i])).all(axis=-1)
    i, j = i[near], j[near]
    if not len(i):
        return []

    def ends(time: Array) -> tuple[Array, Array, Array]:
        a = one[i] + time[:, None, None] * (two[i] - one[i])
        b = one[j] + time[:, None, None] * (two[j] - one[j])
        return a[:, 1] - a[:, 0], b[:, 1] - b[:, 0], b[:, 0] - a[:, 0]

    def volume(time: Array) -> Array:
        u, v, apart = ends(time)
        found: Array = (np.cross(u, v) * apart).sum(axis=-1)
        return found

    found = np.zeros(len(i), dtype=bool)
    times = np.linspace(0, 1, 17)
    values = np.array([volume(np.full(len(i), time)) for time in times])
    for k in range(len(times) - 1):
        change = (values[k] > 0) != (values[k + 1] > 0)
        if not change.any():
            continue
        lower, upper = np.full(len(i), times[k]), np.full(len(i), times[k + 1])
        for _ in range(40):
            middle = (lower + upper) / 2
            left = (volume(middle) > 0) == (values[k] > 0)
            lower, upper = np.where(left, middle, lower), np.where(left, upper, middle)
        u, v, apart = ends((lower + upper) / 2)
        normal = np.cross(u, v)
        square = (normal**2).sum(axis=-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            s = (np.cross(apart, v) * normal).sum(axis=-1) / square
            t = (np.cross(apart, u) * normal).sum(axis=-1) / square
        inside = (np.abs(s - 0.5) < 0.5 - INSIDE) & (np.abs(t - 0.5) < 0.5 - INSIDE)
        found |= change & inside
    return list(zip(i[found].tolist(), j[found].tolist(), strict=True))


def accepted_depth(scene: Mapping[str, Any]) -> float:
    """Return the largest accepted penetration of floor or wall [m]."""
    fidelity, smarticle = scene["fidelity"], scene["smarticle"]
    own = isinstance(fidelity, dict) and "stiffness_N_per_m" in fidelity
    most = SOFTEST if own else DEPTH[fidelity["base"] if isinstance(fidelity, dict) else fidelity]
    return float(most * 2 * (smarticle["thickness_normal_m"] + smarticle["thickness_in_plane_m"]) / np.pi)


def check_run(path: Path, scene: Mapping[str, Any]) -> dict[str, Any]:
    """Check the finished run of a scene of `draw_scene`; return measured values by quantity.

    The value "wrong" describes all failed checks; it is empty if all passed.
    """
    thickness = min(scene["smarticle"]["thickness_normal_m"], scene["smarticle"]["thickness_in_plane_m"])
    radius, wall = scene["container"]["radius_m"], scene["container"]["height_m"]
    wrong: list[str] = []
    floor_depth = wall_depth = moved = -np.inf
    crossed: set[tuple[int, int]] = set()
    finite, first, last = True, None, None
    for frame in read_frames(path):
        ends = frame.segments
        finite &= bool(np.isfinite(ends).all())
        if not finite:
            wrong.append(f"no number in the frame at {frame.time:.4f} s")
            break
        points, inset = surface(ends, thickness)
        height = points[:, 2] - frame.floor_z - inset
        out = np.hypot(points[:, 0], points[:, 1]) + inset - radius
        floor_depth = max(floor_depth, float((-height).max()) / thickness)
        wall_depth = max(wall_depth, float(np.where(height < wall, out, -np.inf).max()) / thickness)
        if last is not None:
            count = min(len(last), len(ends))
            moved = max(moved, float(np.linalg.norm(ends[:count] - last[:count], axis=-1).max()) / thickness)
            pairs = crossings(last[:count], ends[:count], frame.body[:count])
            crossed.update(pairs)
            first = first if first is not None or not pairs else frame.time
        last = ends
    most = accepted_depth(scene) / thickness
    if floor_depth > most:
        wrong.append(f"{floor_depth:.2f} thicknesses below the floor")
    if wall_depth > most:
        wrong.append(f"{wall_depth:.2f} thicknesses outside the wall")
    if crossed:
        wrong.append(f"{len(crossed)} pairs of axes crossed, first before {first:.4f} s")
    excess, residual = energy_errors(path)
    if not excess <= ENERGY:
        wrong.append(f"energy {100 * excess:.1f} % above what was put in")
    return {
        "below the floor [t]": floor_depth,
        "outside the wall [t]": wall_depth,
        "pairs of axes crossed [1]": len(crossed),
        "farthest moved between frames [t]": moved,
        "energy above what was put in [1]": excess,
        "largest residual over dissipated until then [1]": residual,
        "wrong": "; ".join(wrong),
    }


EVERY = 5  # frames from one check of linked bodies and of axes in solids to the next
CORE = 0.7  # part of a bar's thickness in which no axis may be: overlaps and grooves between strands let it a bit below
RESTLESS = 0.02  # largest change of speed of a bar between two frames of a pile at rest, over sqrt(g t)
KICK = 0.05  # largest speed of a body that a plate has just reached, above twice its own [m/s]
STEPS_A_PERIOD = 20  # least number of time steps in a period of a drive
FLOOR = 1e-3  # largest deviation of a floor from what the scene asks for, over its amplitude


def check_bodies(path: Path, scene: Mapping[str, Any]) -> dict[str, Any]:
    """Check the finished run of a scene of `draw_bodies`; return measured values by quantity, as `check_run` does."""
    manifest = json.loads((path / "run.json").read_text())
    ended = json.loads((path / "done.json").read_text())["phases"]
    kinds = [Solid(kind["thickness_normal_m"] / 2, kind["thickness_in_plane_m"] / 2) for kind in manifest["kinds"]]
    asked, start = scene["phases"][-1], ended[-1]["start_s"]
    crossed: set[tuple[int, int]] = set()
    inside: set[tuple[int, int]] = set()
    linked: set[tuple[int, int]] = set()
    times, floors, speeds, spins = [], [], [], []
    last = None
    for frame in read_frames(path):
        ends, body = frame.segments, frame.body
        if frame.number % EVERY == 0:
            linked.update(linked_pairs(ends, body))
            solids = [Solid(CORE * kind.normal, CORE * kind.in_plane) for kind in (kinds[k] for k in frame.kind[body])]
            inside.update(axes_in_solids(ends, body, frame.normals, solids))
        if last is not None:
            count = min(len(last), len(ends))
            crossed.update(crossings(last[:count], ends[:count], body[:count]))
        last = ends
        if frame.time >= start and frame.phase == len(ended) - 1:
            times.append(frame.time)
            floors.append(frame.floor_z)
            speeds.append(frame.link_velocity)
            spins.append(frame.link_angular_velocity)
    values: dict[str, float] = {
        "pairs of axes crossed [1]": len(crossed),
        "axes inside solid bars [1]": len(inside),
        "pairs of closed bodies linked [1]": len(linked),
    }
    wrong = [f"{name.removesuffix(' [1]')}: {value}" for name, value in values.items() if value]
    if asked["type"] == "relax":
        thinnest = 2 * min(min(kind) for kind in kinds)
        values["change of speed at rest [sqrt(g t)]"] = found = unrest(
            np.array(speeds[-50:]), np.array(spins[-50:]), thinnest
        )
        if found > RESTLESS:
            wrong.append(f"not at rest: speeds change by {found:.2g} sqrt(g t) from frame to frame")
    if asked["type"] == "shake":
        steps = 1 / asked["frequency_hz"] / manifest["phases"][-1]["time_step_s"]
        error = floor_error(np.array(times), np.array(floors), asked, start)
        values |= {"steps in a period [1]": steps, "floor's deviation [1]": error}
        if steps < STEPS_A_PERIOD - 1e-6:
            wrong.append(f"{steps:.1f} steps in a period of the drive")
        # Rests between taps are rounded to whole steps, half a step each at most.
        if error > FLOOR + asked.get("taps", 0) * np.pi / steps:
            wrong.append(f"the floor is {error:.2g} amplitudes from where it should be")
    if asked["type"] == "compress":
        soon = [speed for time, speed in zip(times, speeds, strict=True) if time < start + 0.01]
        fastest = max((float(np.linalg.norm(speed, axis=-1).max()) for speed in soon), default=0.0)
        values["fastest body at the plate's start [m/s]"] = fastest
        if fastest > 2 * asked["speed_m_per_s"] + KICK:
            wrong.append(f"the plate begins with a kick, {fastest:.3g} m/s")
    excess, _ = energy_errors(path)
    if not excess <= ENERGY:
        wrong.append(f"energy {100 * excess:.1f} % above what was put in")
    return {**values, "energy above what was put in [1]": excess, "wrong": "; ".join(wrong)}


def energy_errors(path: Path) -> tuple[float, float]:
    """Return two relative errors of the energy in a run, from the series in its directory `path`.

    The first is the largest excess of the stored energy, as a fraction of the energy supplied until then [1]: that of
    poured smarticles by their heights and speeds (`added_energy_J`), and the work of motors and container. The second
    is the largest residual of the ledger, as a fraction of the energy dissipated until then [1]. Soon after the start,
    when little has been dissipated, this fraction can be large although the residual is small. Both are NaN if the
    series contains NaN.
    """
    with h5py.File(path / "series.h5") as file:
        series = {name: np.asarray(dataset[()], dtype=float) for name, dataset in file.items()}

    def column(name: str) -> Array:
        return series.get(name, np.zeros(len(series["time_s"])))

    given = column("added_energy_J")
    works = column("motor_work_J") + column("container_work_J")
    stored = sum(column(f"{name}_J") for name in STORED)
    scale = np.maximum.accumulate(np.abs(given) + np.abs(works))
    scale = np.where(scale > 0, scale, np.inf)
    excess = ((stored - given - works) / scale).max()
    dissipated = np.maximum.accumulate(np.abs(column("dissipated_energy_J")))
    residual = (np.abs(column("energy_residual_J")) / np.where(dissipated > 0, dissipated, np.inf)).max()
    return float(excess), float(residual)


# -- the command -------------------------------------------------------------------------------------------------------

RIGHT, REJECTED, STOPPED, WRONG, LATE = "right", "rejected by plan", "stopped with a cause", "WRONG", "out of time"


def run_one(number: int, out: Path, tree: Path, limit: float, bodies: bool = False) -> dict[str, Any]:
    """Plan, run and check the scene with a number; return its row of the table.

    `bodies`: whether it is a scene of `draw_bodies`, rather than one of smarticles.

    `tree` is the source tree whose `smarticles` is used, `limit` the largest wall time of `plan` and of `run` [s].
    """
    scene = draw_bodies(number) if bodies else draw_scene(number)
    path, run = out / f"{number:04d}.yaml", out / f"{number:04d}"
    path.write_text(yaml.safe_dump(scene, sort_keys=False), encoding="utf-8")
    shutil.rmtree(run, ignore_errors=True)
    begun = time.monotonic()
    row = {"scene": number, "name": scene["name"], "count": scene["count"], "last phase": scene["phases"][-1]["type"]}
    environment = {**os.environ, "PYTHONPATH": str(tree), "OMP_NUM_THREADS": "1"}
    end, cause = "", ""
    for what, arguments in (("plan", ["plan", str(path)]), ("run", ["run", str(path), "--out", str(run)])):
        command = [sys.executable, "-m", "smarticles", *arguments]
        try:
            child = subprocess.run(
                command, cwd=tree, env=environment, capture_output=True, text=True, timeout=limit, check=False
            )
        except subprocess.TimeoutExpired:
            end = LATE
            break
        if child.returncode:
            cause = (child.stderr.strip().splitlines() or [f"status {child.returncode}"])[-1]
            known = child.returncode in {1, 2} and not re.search("Traceback|internal error", child.stderr)
            end = WRONG if not known else REJECTED if what == "plan" or child.returncode == 2 else STOPPED
            break
    row |= {"end": end, "cause": cause, "wall time [s]": round(time.monotonic() - begun, 1)}
    if not end:
        found = check_bodies(run, scene) if bodies else check_run(run, scene)
        cause = found.pop("wrong")
        row |= {"end": WRONG if cause else RIGHT, "cause": cause, **found}
    if row["end"] != WRONG:
        shutil.rmtree(run, ignore_errors=True)
    return row


def main() -> int:
    """Run all scenes; return the exit status, 1 if a scene failed."""
    parser = argparse.ArgumentParser(prog="python -m validation.extremes", description=__doc__)
    parser.add_argument("--count", type=int, default=300, help="number of scenes (default: %(default)s)")
    parser.add_argument("--first", type=int, default=0, help="number of the first scene (default: %(default)s)")
    parser.add_argument("--jobs", type=int, default=1, help="simultaneous runs (default: %(default)s)")
    parser.add_argument(
        "--limit", type=float, default=300, help="largest wall time of a run [s] (default: %(default)s)"
    )
    parser.add_argument(
        "--tree", type=Path, default=Path.cwd(), help="source tree to run (default: the working directory)"
    )
    parser.add_argument(
        "--bodies", action="store_true", help="scenes of bodies of any shape, rather than of smarticles"
    )
    parser.add_argument("--out", type=Path, required=True, help="folder for table, scenes and failed runs")
    arguments = parser.parse_args()
    out = arguments.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    path = out / "extremes.csv"
    rows = pd.read_csv(path, keep_default_na=False).to_dict("records") if path.exists() else []
    numbers = range(arguments.first, arguments.first + arguments.count)
    missing = [number for number in numbers if number not in {row["scene"] for row in rows}]
    with ProcessPoolExecutor(arguments.jobs) as pool:
        how = (out, arguments.tree.resolve(), arguments.limit, arguments.bodies)
        runs = [pool.submit(run_one, number, *how) for number in missing]
        for run in runs:
            rows.append(run.result())
            pd.DataFrame(rows).to_csv(path, index=False, float_format="%.4g")
            row = rows[-1]
            print(f"{row['scene']:4d} {row['end']:20s} {row['name']}, {row['last phase']}: {row['cause']}", flush=True)
    table = pd.DataFrame(rows)
    print(table["end"].value_counts().to_string())
    return int((table["end"] == WRONG).any())


if __name__ == "__main__":
    sys.exit(main())
