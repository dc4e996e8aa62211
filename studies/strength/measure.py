"""What the study `strength` takes from a run: the pile before it is torn, what the hook felt, and what came off.

Forces are over n W_s, the weight of all smarticles; what a peak is, is in `postprocess.measures.pull`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.frames import read_frames
from dem.record.manifest import RunManifest
from dem.record.series import read_series
from postprocess.geometry.links import centres_of_mass
from postprocess.measures.heights import heights
from postprocess.measures.pull import PULL, WINDOW, HookPull, held_at, held_fast, peak, read_pull, weight_of_one
from postprocess.measures.table import summarise_run
from postprocess.scene_file import read_phases, read_scene
from postprocess.statistics.columns import ASPECT, SEED
from studies.base.procedures import ACTIVE, CROSSINGS, INTERNAL, PROCEDURE, STATIC, THETA, prepared_by
from studies.base.runs import DEFINITION, duration

REMOVAL = "remove-container"

UPPER = "hook above the floor [m]"
PEAK, PEAK_RAISED, WORK = "peak force over n W_s [-]", "hook raised at the peak [m]", "work over n W_s w [-]"
THROUGH = "force through to the grid at the peak over n W_s [-]"
BEFORE = "load before the pull over n W_s [-]"
HELD_FAST, LIMIT = "held fast [-]", "force limit over n W_s [-]"
CARRIED, BREAK = "carried off [-]", "lowest points of what is carried off, before [m]"
ABOVE, TOP, KEPT = "smarticles above the hook [-]", "height of 95 % [m]", "com height without over with the wall [-]"
QUANTITIES: Mapping[str, str] = MappingProxyType(
    {
        PEAK: f"largest mean over {WINDOW:g} s of the force that raises the hook, over n W_s; at least, where it held",
        PEAK_RAISED: "how far the hook had been raised then",
        WORK: "∫ F dz over the whole pull, over n W_s w: work to fracture, and to carry off what comes along",
        THROUGH: "upwards on the grid at the peak less that before the pull, over n W_s: what goes through the pile, "
        "where the rest is weight that was lifted",
        BEFORE: "force on the hook before the pull, over n W_s: of what rests on it, and of a pile that is braced "
        "between hook and grid",
        HELD_FAST: "1 where the hook was stopped by its force limit on the way, 0 where it arrived",
        CARRIED: "smarticles whose centre of mass rose by more than half of the hook's way, over n; empty where held",
        BREAK: "height above the floor of those smarticles' lowest points before the pull, mean over them: where the "
        "pile broke; empty where nothing was carried off, or the hook was held",
        ABOVE: "smarticles whose centre of mass is above the hook before the pull, over n",
        TOP: "height below which 95 % of the material lies before the pull",
        KEPT: "height of the centre of mass before the pull over that before the wall went",
        CROSSINGS: "⟨N⟩ at rest before the wall went: links of others through a smarticle's plane",
    }
)
"""What is averaged over seeds: columns of the table of runs."""


def strength_row(run: RunManifest) -> dict[str, object]:
    """One run's row of the table of runs.

    Args:
        run: A finished run.

    Raises:
        InputError: It is not a pull without a wall after one activity or none, or cannot be read.
    """
    procedure = prepared_by(run, REMOVAL, PULL)
    pulled = run.phases[-1]
    rest, free = pulled.index - 2, pulled.index - 1
    settings = read_phases(run.directory)
    hooks = read_scene(run.directory).part("hooks")
    table = summarise_run(run.directory, definitions=[DEFINITION], phases={rest}).set_index("phase")
    frames = read_frames(run.directory)
    walled, before, torn = (frames.in_phase(index) for index in (rest, free, pulled.index))
    if hooks is None or rest not in table.index or not (walled and before and torn):
        msg = f"{run.directory}: no hooks, or no frame of the rest, of {REMOVAL} or of {PULL}; run it again"
        raise InputError(msg)
    upper = hooks.number("upper_height_m")
    pull = read_pull(run, read_series(run.directory), pulled.index)
    held = held_fast(pull, settings[pulled.index])
    row: dict[str, object] = {
        PROCEDURE: procedure,
        THETA: settings[2].number("theta_deg") if procedure == INTERNAL else math.nan,
        ASPECT: round(run.aspect_ratio, 6),
        UPPER: upper,
        SEED: run.seed,
        "smarticles [-]": run.count,
        "fidelity": run.fidelity,
        ACTIVE: duration(run.phases[2]) if procedure != STATIC else 0.0,
        CROSSINGS: table.loc[rest]["crossings mean [-]"],
        **_of_piles(walled[-1], before[-1], upper),
        **_of_pull(run, pull),
        HELD_FAST: float(held),
        LIMIT: _limit(settings[pulled.index].values.get("force_limit_N")) / run.count / weight_of_one(run),
    }
    row |= {CARRIED: math.nan, BREAK: math.nan} if held else _of_fracture(before[-1], torn[-1], float(pull.raised[-1]))
    return row | {
        "time without the wall [s]": duration(run.phases[free]),
        "scene_sha256": run.scene_sha256,
        "run": run.directory.name,
    }


def _limit(value: object) -> float:
    return float(value) if isinstance(value, int | float) else math.inf


def _of_pull(run: RunManifest, pull: HookPull) -> dict[str, float]:
    total, highest = run.count * weight_of_one(run), peak(pull)
    return {
        PEAK: highest.force / total,
        PEAK_RAISED: highest.raised,
        WORK: pull.work / total / run.middle_length,
        BEFORE: pull.before / total,
        THROUGH: (held_at(pull, highest.time) - pull.held[0]) / total,
    }


def _of_piles(walled: Frame, before: Frame, upper: float) -> dict[str, float]:
    """The pile at the end of its rest, and without its wall."""
    centres = centres_of_mass(before.vertices)[:, 2] - before.floor_z
    level = heights(before.vertices, floor_z=before.floor_z)
    return {
        ABOVE: float((centres > upper).mean()),
        TOP: level.top,
        KEPT: level.mean_com / heights(walled.vertices, floor_z=walled.floor_z).mean_com,
    }


def _of_fracture(before: Frame, torn: Frame, way: float) -> dict[str, float]:
    """What rose with a hook that was raised by a way [m]."""
    rose = centres_of_mass(torn.vertices)[:, 2] - centres_of_mass(before.vertices)[:, 2] > way / 2
    lowest = float(before.vertices[rose, :, 2].min(axis=1).mean()) - before.floor_z if rose.any() else math.nan
    return {CARRIED: float(rose.mean()), BREAK: lowest}
