"""What is measured of each run of a ladder of accuracy, and the table of work and precision over seeds.

A ladder varies one scene, one knob at a time; its base scene is a rung of every knob. Errors are relative to the
knob's reference: its finest rung with finished runs, or the base scene for what is no accuracy but a sensitivity.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
import pandas as pd

from dem.errors import InputError
from dem.record.manifest import RunManifest
from dem.record.series import read_series
from postprocess.measures.pull import PULL, has_pull, peak, read_pull, weight_of_one
from postprocess.measures.table import summarise_run
from postprocess.statistics.columns import ASPECT, SEED
from postprocess.statistics.points import marked, seeds_of
from postprocess.statistics.seeds import Scatter, SeedMean, mean_over_seeds, pooled_scatter, relative_difference
from studies.accuracy.rung import ACTIVITIES, BASE, Rung
from studies.base.variants import VARIANT, variant_of
from studies.framework.runs import DEFINITION, ENGINE, duration

KNOB, VALUE, UNIT, REFERENCE, VERDICT = "knob", "value", "unit", "reference", "verdict"
ACTIVITY, COUNT = "activity", "smarticles [-]"
COST, WALL = "processor time per simulated time of the last activity [s/s]", "wall time [s]"
"""A run is one thread, and waits for nothing; unlike its wall time, its processor time is not what others leave."""

EXPECTED = "processor time over expected wall time [-]"
RESIDUAL, GAP = "energy residual over dissipated [-]", "largest joint gap [m]"
TIME_STEP, SPHERES = "time step [s]", "spheres per smarticle [-]"

COMPARED: Mapping[str, str] = MappingProxyType(
    {
        "phi_0": f"phi_0 {DEFINITION} [-]",
        "phi_f": f"phi_f {DEFINITION} [-]",
        "height": "com height [m]",
        "crossings": "crossings [-]",
        "hook_force": "peak hook force over n W_s [-]",
    }
)
"""What errors are told of where runs have it: its name, and its column in the table of runs.

A packing fraction hangs on one smarticle near the top; the height of the centre of mass, before the first activity, is
a mean over all of them and scatters half as much.
"""

SYMBOLS: Mapping[str, str] = MappingProxyType(
    {"phi_0": "φ_0", "phi_f": "φ_f", "height": "h_0", "crossings": "⟨N⟩", "hook_force": "F_peak"}
)

RESOLVED, NOT_RESOLVED, IS_REFERENCE, UNKNOWN = "resolved", "not resolved", "reference", "unknown"
"""Verdicts: an error beyond its seed-to-seed band; none that is; the reference itself; no band, or no runs."""

_AVERAGED = (COST, WALL, EXPECTED, *COMPARED.values(), RESIDUAL, GAP)
_OF_SETTING = (ENGINE, TIME_STEP, SPHERES, ASPECT, COUNT, ACTIVITY)


def accuracy_row(run: RunManifest, expected_s: Mapping[str, float]) -> dict[str, object]:
    """One run's row of the table of runs.

    Args:
        run: A finished run.
        expected_s: Expected wall time by name of the run directory, where it is known [s].

    Raises:
        InputError: It has no activity after another phase, or cannot be read.
    """
    active = [phase for phase in run.phases if phase.type in ACTIVITIES]
    if not active or active[0].index == 0:
        types = ", ".join(phase.type for phase in run.phases)
        msg = f"{run.directory}: no activity after another phase: its phases are {types}"
        raise InputError(msg)
    last = active[-1]
    wanted = {"before": active[0].index - 1, "after": last.index}
    table = summarise_run(run.directory, definitions=[DEFINITION], phases=set(wanted.values()))
    if len(table) != len(wanted):
        msg = f"{run.directory}: no frame of the phase before its activity, or of its last one; run it again"
        raise InputError(msg)
    before, after = (table.set_index("phase").loc[phase] for phase in wanted.values())
    time, expected = duration(last), expected_s.get(run.directory.name, math.nan)
    cpu = math.fsum(_or_nan(phase.cpu_time) for phase in run.phases)
    phi = f"phi {DEFINITION}"
    return {
        VARIANT: variant_of(run),
        SEED: run.seed,
        ASPECT: round(run.aspect_ratio, 6),
        COUNT: run.count,
        ACTIVITY: " ".join(dict.fromkeys(phase.type for phase in active)),
        ENGINE: run.engine,
        "fidelity": run.fidelity,
        TIME_STEP: run.time_step,
        # Links that are no chains have spheres in pictures alone.
        SPHERES: run.spheres_per_smarticle if run.engine == "yade" else math.nan,
        COST: _or_nan(last.cpu_time) / time if time > 0 else math.nan,
        WALL: _or_nan(run.wall_time),
        EXPECTED: cpu / expected if expected > 0 else math.nan,
        COMPARED["phi_0"]: before[f"{phi} [-]"],
        COMPARED["phi_f"]: after[f"{phi} [-]"],
        f"phi_f {DEFINITION} SE in run [-]": after[f"{phi} SE [-]"],
        COMPARED["height"]: before["com height [m]"],
        COMPARED["crossings"]: after["crossings mean [-]"],
        COMPARED["hook_force"]: _peak_force(run),
        **_of_series(run),
        "escaped at the end [-]": after["escaped [-]"],
        "frames averaged [-]": int(table["frames averaged"].min()),
        "scene_sha256": run.scene_sha256,
        "run": run.directory.name,
    }


def _or_nan(number: float | None) -> float:
    return math.nan if number is None else number


def _peak_force(run: RunManifest) -> float:
    """Of the first hook that is pulled, over the weight of all smarticles [-]; NaN where none is."""
    pulled = [phase.index for phase in run.phases if phase.type == PULL]
    if not pulled or not (run.directory / "series.h5").exists():
        return math.nan
    series = read_series(run.directory)
    if not has_pull(series, pulled[0]):
        return math.nan
    return peak(read_pull(run, series, pulled[0])).force / (run.count * weight_of_one(run))


def measured(table: pd.DataFrame) -> tuple[str, ...]:
    """Keys of `COMPARED` that any run of a table of work and precision has, a pile always."""
    return tuple(name for name, column in COMPARED.items() if name != "hook_force" or table[column].notna().any())


def _of_series(run: RunManifest) -> dict[str, float]:
    """Energy residual and joint gap; NaN where the scene did not ask for them."""
    found = {RESIDUAL: math.nan, GAP: math.nan}
    if not (run.directory / "series.h5").exists():
        return found
    data = read_series(run.directory).data
    if "energy_residual_J" in data and "dissipated_energy_J" in data:
        residual, dissipated = data["energy_residual_J"], data["dissipated_energy_J"]
        known = np.isfinite(residual) & np.isfinite(dissipated)
        if known.any() and dissipated[known][-1] > 0:
            found[RESIDUAL] = float(abs(residual[known][-1]) / dissipated[known][-1])
    if "joint_gap_m" in data and np.isfinite(data["joint_gap_m"]).any():
        found[GAP] = float(np.nanmax(data["joint_gap_m"]))
    return found


def work_precision(runs: pd.DataFrame, rungs: Sequence[Rung]) -> pd.DataFrame:
    """One row per rung: cost, means over seeds, and errors against the knob's reference.

    Args:
        runs: Table of runs, see `accuracy_row`.
        rungs: Each knob's from coarse to fine; one without runs has NaN.

    Returns:
        The table; `… SE` is a standard error over seeds. `… error [%]` is relative to the reference's mean, `… error
        95 % [%]` its seed-to-seed band: the half-width of the interval of confidence by Student's t, with the scatter
        pooled over all settings. The error of the reference itself is 0 by definition, its band that of its own mean.
        `… resolved` says whether the error is beyond the band, `verdict` whether any is.
    """
    groups = {rung.setting: runs[runs[VARIANT] == rung.setting] for rung in rungs}
    scatters = {name: pooled_scatter(group[column] for group in groups.values()) for name, column in COMPARED.items()}
    rows = []
    for knob in dict.fromkeys(rung.knob for rung in rungs):
        own = [rung for rung in rungs if rung.knob == knob]
        reference = _reference(own, {name: len(group) for name, group in groups.items()})
        rows += [_rung_row(rung, groups, reference, scatters) for rung in own]
    return pd.DataFrame(rows)


def _reference(rungs: Sequence[Rung], seeds: Mapping[str, int]) -> Rung | None:
    """The finest rung with two finished runs, else with one; of a sensitivity the base scene."""
    able = [rung for rung in rungs if not rung.sensitivity or rung.setting == BASE]
    for least in (2, 1):
        for rung in reversed(able):
            if seeds[rung.setting] >= least:
                return rung
    return None


def _rung_row(
    rung: Rung, groups: Mapping[str, pd.DataFrame], reference: Rung | None, scatters: Mapping[str, Scatter]
) -> dict[str, object]:
    group = groups[rung.setting]
    row: dict[str, object] = {
        KNOB: rung.knob,
        VALUE: rung.value,
        UNIT: rung.unit,
        VARIANT: rung.setting,
        REFERENCE: "" if reference is None else reference.setting,
        "sensitivity": rung.sensitivity,
        **seeds_of(group),
    }
    row |= {name: group[name].iloc[0] if len(group) else math.nan for name in _OF_SETTING}
    for name in _AVERAGED:
        mean = mean_over_seeds(group[name])
        row[name], row[marked(name, "SE")] = mean.value, mean.standard_error
        if name == COST:
            row[marked(name, "95 %")] = mean.half_width
    own = reference is not None and reference.setting == rung.setting
    clear, known = [], []
    for name, column in COMPARED.items():
        mean = mean_over_seeds(group[column])
        base = mean_over_seeds([] if reference is None else groups[reference.setting][column])
        error, band = _error(mean, base, scatters[name], own=own)
        row[f"{name} error [%]"], row[f"{name} error 95 % [%]"] = error, band
        row[f"{name} resolved"] = not own and abs(error) > band
        clear.append(row[f"{name} resolved"])
        known.append(math.isfinite(band))
    row[VERDICT] = IS_REFERENCE if own else RESOLVED if any(clear) else NOT_RESOLVED if any(known) else UNKNOWN
    return row


def _error(mean: SeedMean, reference: SeedMean, scatter: Scatter, *, own: bool) -> tuple[float, float]:
    """Error and its band [%]."""
    found = relative_difference(mean, reference, scatter=scatter)
    # The reference's own band is that of its mean alone: a difference of two such means has √2 of it.
    return (0.0, found.half_width / math.sqrt(2)) if own else (found.value, found.half_width)
