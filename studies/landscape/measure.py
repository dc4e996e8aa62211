"""What the study `landscape` takes from a run: the pile at rest before the pull, the energy spent on it, its strength.

A hook that was poured over is raised out of the pile, within its wall, and nothing but weight and wall holds the pile
down. What the hook takes at its peak, over the weight n W_s of all smarticles, is so the largest share of its own
weight that the pile bears hanging: the weight that comes along at once, and what friction at the wall adds. A heap
without any cohesion makes the hook lift about what lies above it; a pile that holds together altogether comes whole,
and the strength cannot be much above one. Strength less the share above the hook is tabulated beside it, as what
cohesion adds.

Between the two hooks of the paper's own test a smarticle that holds both like a bracket is all that is measured in a
third of the piles, see the study `fracture`; here the lower hook lies on the floor, where none gets hold of it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import pandas as pd

from dem.errors import InputError
from dem.record.frames import read_frames
from dem.record.manifest import RunManifest
from dem.record.series import Series, read_series
from postprocess.geometry.links import centres_of_mass
from postprocess.measures.pull import PULL, WINDOW, held_fast, peak, read_pull, weight_of_one
from postprocess.measures.table import summarise_run
from postprocess.scene_file import read_phases, read_scene
from postprocess.statistics.columns import ASPECT, SEED
from studies.framework.procedures import (
    ACTIVE,
    CROSSINGS,
    EXTERNAL,
    INTERNAL,
    PHI,
    PROCEDURE,
    SHAPE,
    STATIC,
    THETA,
    prepared_by,
)
from studies.framework.runs import DEFINITION, duration

PLANNED = "time planned [s]"
LINKING, CONTACTS = "linking number per smarticle [-]", "contacts per smarticle [-]"
TOUCHING, ENTANGLED = "largest cluster in contact [-]", "largest entangled cluster [-]"
HEIGHT, ABOVE = "com height [m]", "smarticles above the hook [-]"
ENERGY, LIFTS = "energy per smarticle [J]", "energy per smarticle over W_s w [-]"
PEAK, BEYOND = "strength over n W_s [-]", "strength beyond the weight above over n W_s [-]"
RAISED, WORK, HELD_FAST = "hook raised at the peak [m]", "work over n W_s w [-]", "held fast [-]"

STRENGTHS: Mapping[str, str] = MappingProxyType(
    {
        PEAK: f"largest mean over {WINDOW:g} s of the force that raises the hook, over n W_s; at least, where the pile "
        "held fast",
        BEYOND: "the same less the share of the smarticles that lie above the hook, which is their weight over n W_s",
    }
)
"""What a pile bears, two ways."""

PREDICTORS: Mapping[str, str] = MappingProxyType(
    {
        PHI: "packing fraction",
        CROSSINGS: "⟨N⟩: links of others through a smarticle's plane",
        LINKING: "Gauss's linking integral with all others, closed barb tip to barb tip, absolute values added up",
        CONTACTS: "other smarticles that a smarticle touches",
        TOUCHING: "share of the smarticles in the largest cluster of touching ones",
        ENTANGLED: "share of the smarticles in the largest cluster of entangled ones",
        HEIGHT: "of the centre of mass above the floor",
        ABOVE: "share of the smarticles whose centre of mass is above the hook",
        ENERGY: "work of the motors, or of the shaken floor, up to the pull; static: none",
    }
)
"""What may tell strength, all at rest before the pull."""

CALLED: Mapping[str, str] = MappingProxyType(
    {
        PHI: "φ",
        CROSSINGS: "⟨N⟩",
        LINKING: "linking number",
        CONTACTS: "contacts",
        TOUCHING: "largest cluster in contact",
        ENTANGLED: "largest entangled cluster",
        HEIGHT: "height of the centre of mass",
        ABOVE: "share above the hook",
        ENERGY: "energy spent",
    }
)
"""What they are called in words."""

OTHERS: Mapping[str, str] = MappingProxyType(
    {
        LIFTS: "the energy over the work that lifts a smarticle by w",
        RAISED: "how far the hook had been raised at the peak",
        WORK: "∫ F dz over the whole pull, over n W_s w",
        HELD_FAST: "1 where the hook was stopped by its force limit on the way, 0 where it arrived",
    }
)
"""What is told beside."""

_MEASURED: Mapping[str, str] = MappingProxyType(
    {
        PHI: PHI,
        CROSSINGS: "crossings mean [-]",
        LINKING: "linking mean [-]",
        CONTACTS: "contacts mean [-]",
        TOUCHING: "contact graph largest share [-]",
        ENTANGLED: "crossing graph largest share [-]",
        HEIGHT: "com height [m]",
    }
)
_WORK_OF = {EXTERNAL: "container_work_J", SHAPE: "motor_work_J", INTERNAL: "motor_work_J"}
_NAMED = re.compile(r"[^_]+_(?P<time>\d+(?:\.\d+)?)s_.+")


def landscape_row(run: RunManifest) -> dict[str, object]:
    """One run's row of the table of runs.

    Args:
        run: A finished run.

    Raises:
        InputError: It is not a pull after one activity or none, or cannot be read.
    """
    procedure = prepared_by(run, PULL)
    pulled = run.phases[-1]
    rest = pulled.index - 1
    settings = read_phases(run.directory)
    series = read_series(run.directory)
    table = summarise_run(run.directory, definitions=[DEFINITION], phases={rest}).set_index("phase")
    if rest not in table.index or settings[pulled.index].type != PULL:
        msg = f"{run.directory}: no frame of the rest before the pull, or no pull in scene.yaml; run it again"
        raise InputError(msg)
    before = table.loc[rest]
    energy = _spent(run, series, procedure, rest) / run.count
    weight, above = weight_of_one(run), _above(run, rest)
    row: dict[str, object] = {
        PROCEDURE: procedure,
        THETA: settings[2].number("theta_deg") if procedure == INTERNAL else math.nan,
        ASPECT: round(run.aspect_ratio, 6),
        SEED: run.seed,
        "smarticles [-]": run.count,
        "fidelity": run.fidelity,
        PLANNED: _planned(run),
        ACTIVE: duration(run.phases[2]) if procedure != STATIC else 0.0,
        **{column: before[measured] for column, measured in _MEASURED.items()},
        ABOVE: above,
        ENERGY: energy,
        LIFTS: energy / weight / run.middle_length,
    }
    pull = read_pull(run, series, pulled.index)
    total, highest = run.count * weight, peak(pull)
    strength = highest.force / total
    return row | {
        PEAK: strength,
        BEYOND: strength - above,
        RAISED: highest.raised,
        WORK: pull.work / total / run.middle_length,
        HELD_FAST: float(held_fast(pull, settings[pulled.index])),
        "escaped at the end [-]": before["escaped [-]"],
        "frames averaged [-]": int(before["frames averaged"]),
        "scene_sha256": run.scene_sha256,
        "run": run.directory.name,
    }


def _planned(run: RunManifest) -> float:
    """Time of the activity by the run's name [s]; the run's own is rounded to whole swings."""
    found = _NAMED.fullmatch(run.directory.name)
    if found is None:
        msg = f"{run.directory}: not named like a run of this study, such as internal10_2s_lw0.70_seed1"
        raise InputError(msg)
    return float(found["time"])


def _spent(run: RunManifest, series: Series, procedure: str, rest: int) -> float:
    """Work that an activity spent on the smarticles, to the end of the rest after it [J]."""
    if procedure == STATIC:
        return 0.0
    work = series.data.get(_WORK_OF[procedure])
    if work is None:
        msg = f"{series.path}: no {_WORK_OF[procedure]} of {run.directory}; run it with recording.energy"
        raise InputError(msg)
    known = np.isfinite(work)
    start, end = (work[known & (series["phase"] <= phase)] for phase in (1, rest))
    return float(end[-1] - (start[-1] if len(start) else 0.0)) if len(end) else math.nan


def _above(run: RunManifest, rest: int) -> float:
    """Share of the smarticles whose centre of mass is above the upper hook at the end of a rest [-]."""
    hooks = read_scene(run.directory).part("hooks")
    frames = read_frames(run.directory).in_phase(rest)
    if hooks is None or not frames:
        msg = f"{run.directory}: no hooks, or no frame of the rest before the pull; run it again"
        raise InputError(msg)
    heights = centres_of_mass(frames[-1].vertices)[:, 2] - frames[-1].floor_z
    return float((heights > hooks.number("upper_height_m")).mean())


def trajectories(runs: pd.DataFrame) -> pd.Series:
    """The trajectory of each run: runs of one l/w, seed, procedure and θ are the same up to the shortest of them."""
    keys = [ASPECT, SEED, PROCEDURE, THETA]
    return runs.groupby(keys, dropna=False, sort=False).ngroup()
