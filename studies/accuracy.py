"""What accuracy costs in time: variants of one scene, each with one knob turned, against the knob's finest rung.

Errors are relative to the knob's reference: its finest rung with finished runs, or the scene itself for what is no
accuracy but a sensitivity. An error within the scatter between seeds is not resolved, which is not the same as none.
`ladder.py` makes the variants.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from dem.errors import InputError
from dem.record.run import Run
from postprocess.measures.packing import DEFINITIONS
from postprocess.measures.pull import PULL, has_pull, peak, read_pull, weight_of_one
from postprocess.measures.table import LAST_FRAMES, summarise_run
from postprocess.report import figures as style
from postprocess.statistics.points import ASPECT, SEED, SEEDS, marked, seeds_of, told_number
from postprocess.statistics.seeds import Scatter, mean_over_seeds, pooled_scatter, relative_difference
from studies.framework.figures import Analysis, Drawing
from studies.framework.findings import Finding, Outcome, Verdict
from studies.framework.plots import draw_means, finished, marker
from studies.framework.provenance import Reference
from studies.framework.quantities import Key, Quantity
from studies.framework.runs import DEFINITION, ENGINE, Row, duration
from studies.framework.study import Study
from studies.ladder import ACTIVITIES, BASE, Rung

VARIANT, KNOB, VALUE, UNIT, REFERENCE, VERDICT = "variant", "knob", "value", "unit", "reference", "verdict"
ACTIVITY, COUNT = "activity", "smarticles [-]"
COST, WALL = "processor time per simulated time of the last activity [s/s]", "wall time [s]"
"""A run is one thread, and waits for nothing; unlike its wall time, its processor time is not what others leave."""

EXPECTED = "processor time over expected wall time [-]"
RESIDUAL, GAP = "energy residual over dissipated [-]", "largest joint gap [m]"
TIME_STEP, SPHERES = "time step [s]", "spheres per smarticle [-]"

COMPARED = {
    "phi_0": f"phi_0 {DEFINITION} [-]",
    "phi_f": f"phi_f {DEFINITION} [-]",
    "height": "com height [m]",
    "crossings": "crossings [-]",
    "hook_force": "peak hook force over n W_s [-]",
}
"""What is compared where runs have it: its name, and its column in the table of runs.

A packing fraction hangs on one smarticle near the top; the height of the centre of mass, before the first activity, is
a mean over all of them and scatters half as much.
"""

SYMBOLS = {"phi_0": "φ_0", "phi_f": "φ_f", "height": "h_0", "crossings": "⟨N⟩", "hook_force": "F_peak"}

RESOLVED, NOT_RESOLVED, IS_REFERENCE, UNKNOWN = "resolved", "not resolved", "reference", "unknown"
"""Verdicts: an error beyond its seed-to-seed band; none that is; the reference itself; no band, or no runs."""

_AVERAGED = (COST, WALL, EXPECTED, *COMPARED.values(), RESIDUAL, GAP)
_OF_SETTING = (ENGINE, TIME_STEP, SPHERES, ASPECT, COUNT, ACTIVITY)
_NAMED = re.compile(r"(?P<variant>.+)_seed(?P<seed>\d+)")


def measure(run: Run, expected_s: Mapping[str, float]) -> Row:
    """Measure what a run cost, and what is compared.

    Args:
        run: A finished run, named SETTING_seedN.
        expected_s: Expected wall time by name of the run directory, where it is known [s].
    """
    active = [phase for phase in run.phases if phase.type in ACTIVITIES]
    if not active or active[0].index == 0:
        types = ", ".join(phase.type for phase in run.phases)
        msg = f"{run.path}: no activity after another phase: its phases are {types}"
        raise InputError(msg)
    named = _NAMED.fullmatch(run.path.name)
    if named is None or int(named["seed"]) != run.manifest.seed:
        msg = f"{run.path}: not named SETTING_seed{run.manifest.seed}, as runs of a ladder are; do not rename runs"
        raise InputError(msg)
    last = active[-1]
    wanted = [active[0].index - 1, last.index]
    table = summarise_run(run, definitions=[DEFINITION], phases=set(wanted)).set_index("phase")
    if len(table) != len(wanted):
        msg = f"{run.path}: no frame of the phase before its activity, or of its last one; run it again"
        raise InputError(msg)
    before, after = (table.loc[phase] for phase in wanted)
    time, expected = duration(last), expected_s.get(run.path.name, math.nan)
    cpu = math.fsum(_or_nan(phase.cpu_s) for phase in run.phases)
    phi = f"phi {DEFINITION}"
    return {
        VARIANT: named["variant"],
        SEED: run.manifest.seed,
        ASPECT: round(run.manifest.aspect_ratio, 6),
        COUNT: run.manifest.count,
        ACTIVITY: " ".join(dict.fromkeys(phase.type for phase in active)),
        ENGINE: run.manifest.engine,
        "fidelity": run.manifest.fidelity,
        TIME_STEP: run.manifest.time_step_s,
        # Links that are no chains have spheres in pictures alone.
        SPHERES: run.manifest.spheres_per_smarticle if run.manifest.engine == "yade" else math.nan,
        COST: _or_nan(last.cpu_s) / time if time > 0 else math.nan,
        WALL: _or_nan(run.status.wall_s),
        EXPECTED: cpu / expected if expected > 0 else math.nan,
        COMPARED["phi_0"]: before[f"{phi} [-]"],
        COMPARED["phi_f"]: after[f"{phi} [-]"],
        f"phi_f {DEFINITION} SE in run [-]": after[f"{phi} SE [-]"],
        COMPARED["height"]: before["com height [m]"],
        COMPARED["crossings"]: after["crossings mean [-]"],
        **_of_series(run),
        "escaped at the end [-]": after["escaped [-]"],
        "frames averaged [-]": int(table["frames averaged"].min()),
        "scene_sha256": run.manifest.scene_sha256,
        "run": run.path.name,
    }


def _or_nan(number: float | None) -> float:
    return math.nan if number is None else number


def _of_series(run: Run) -> dict[str, float]:
    """Read the peak force of the first hook, energy residual and joint gap; NaN where the scene has none."""
    found = {COMPARED["hook_force"]: math.nan, RESIDUAL: math.nan, GAP: math.nan}
    if not (run.path / "series.h5").exists():
        return found
    series = run.series
    pulled = [phase.index for phase in run.phases if phase.type == PULL]
    if pulled and has_pull(series, pulled[0]):
        highest = peak(read_pull(run, series, pulled[0])).force
        found[COMPARED["hook_force"]] = highest / (run.manifest.count * weight_of_one(run))
    data = series.data
    if "energy_residual_J" in data and "dissipated_energy_J" in data:
        residual, dissipated = data["energy_residual_J"], data["dissipated_energy_J"]
        known = np.isfinite(residual) & np.isfinite(dissipated)
        if known.any() and dissipated[known][-1] > 0:
            found[RESIDUAL] = float(abs(residual[known][-1]) / dissipated[known][-1])
    if "joint_gap_m" in data and np.isfinite(data["joint_gap_m"]).any():
        found[GAP] = float(np.nanmax(data["joint_gap_m"]))
    return found


def work_precision(runs: pd.DataFrame, rungs: Sequence[Rung]) -> pd.DataFrame:
    """Compare each rung with its knob's reference: cost, means over seeds, errors.

    Args:
        runs: Table of runs.
        rungs: Each knob's from coarse to fine; one without runs has NaN.

    Returns:
        One row per rung. `… SE` is a standard error over seeds. `… error [%]` is relative to the reference's mean, `…
        error 95 % [%]` its seed-to-seed band: the half-width of the interval of confidence by Student's t, with the
        scatter pooled over all settings. The error of the reference itself is 0 by definition, its band that of its
        own mean. `… resolved` says whether the error is beyond the band, `verdict` whether any is.
    """
    groups = {rung.setting: runs[runs[VARIANT] == rung.setting] for rung in rungs}
    scatters = {name: pooled_scatter(group[column] for group in groups.values()) for name, column in COMPARED.items()}
    rows = []
    for knob in dict.fromkeys(rung.knob for rung in rungs):
        own = [rung for rung in rungs if rung.knob == knob]
        able = [rung for rung in reversed(own) if not rung.sensitivity or rung.setting == BASE]
        # The finest rung with two finished runs, else with one.
        reference = next((one.setting for n in (2, 1) for one in able if len(groups[one.setting]) >= n), "")
        rows += [_rung_row(rung, groups, reference, scatters) for rung in own]
    return pd.DataFrame(rows)


def _rung_row(
    rung: Rung, groups: Mapping[str, pd.DataFrame], reference: str, scatters: Mapping[str, Scatter]
) -> dict[str, object]:
    group, own = groups[rung.setting], reference == rung.setting
    row: dict[str, object] = {
        KNOB: rung.knob,
        VALUE: rung.value,
        UNIT: rung.unit,
        VARIANT: rung.setting,
        REFERENCE: reference,
        "sensitivity": rung.sensitivity,
        **seeds_of(group),
    }
    row |= {name: group[name].iloc[0] if len(group) else math.nan for name in _OF_SETTING}
    for name in _AVERAGED:
        mean = mean_over_seeds(group[name])
        row |= {name: mean.value, marked(name, "SE"): mean.standard_error}
        if name == COST:
            row[marked(name, "95 %")] = mean.half_width
    clear, known = [], []
    for name, column in COMPARED.items():
        base = mean_over_seeds(groups[reference][column] if reference else [])
        error = relative_difference(mean_over_seeds(group[column]), base, scatter=scatters[name])
        # The reference's own band is that of its mean alone: a difference of two such means has √2 of it.
        value, band = (0.0, error.half_width / math.sqrt(2)) if own else (error.value, error.half_width)
        clear.append(not own and abs(value) > band)
        known.append(math.isfinite(band))
        row |= {f"{name} error [%]": value, f"{name} error 95 % [%]": band, f"{name} resolved": clear[-1]}
    row[VERDICT] = IS_REFERENCE if own else RESOLVED if any(clear) else NOT_RESOLVED if any(known) else UNKNOWN
    return row


def _label(row: pd.Series) -> str:
    return f"{row[VALUE]} {row[UNIT]}".rstrip()


def _errors(row: pd.Series) -> str:
    """All errors of a rung with their bands."""
    errors = {name: told_number(row[f"{name} error [%]"], "+.1f", row[f"{name} error 95 % [%]"]) for name in SYMBOLS}
    return ", ".join(f"{SYMBOLS[name]} {error} %" for name, error in errors.items() if error != "-")


def advise(table: pd.DataFrame, knob: str) -> Outcome:
    """Name the cheapest rung of a knob whose errors are not resolved, or of a sensitivity what is resolved.

    Its largest error that the seeds do not exclude says how far to trust that.
    """
    rows = table[table[KNOB] == knob]
    own, judged = rows[rows[VERDICT] == IS_REFERENCE], rows[rows[VERDICT].isin([RESOLVED, NOT_RESOLVED])]
    if own.empty or judged.empty:
        return Outcome(
            note="nothing can be resolved: an error needs two finished seeds of two rungs", verdict=Verdict.NO_DATA
        )
    reference = own.iloc[0]
    if reference["sensitivity"]:
        clear = [f"{_label(row)} ({_errors(row)})" for _, row in judged[judged[VERDICT] == RESOLVED].iterrows()]
        note = f"a matter of what is modelled; against {_label(reference)} resolved: {', '.join(clear) or 'none'}"
        return Outcome(note=note, verdict=Verdict.FOUND if clear else Verdict.NOT_RESOLVED)
    cheap = judged[judged[COST] < reference[COST]].sort_values(COST)
    enough = cheap[cheap[VERDICT] == NOT_RESOLVED]
    if enough.empty:
        errors = "; ".join(f"{_label(row)}: {_errors(row)}" for _, row in cheap.iterrows())
        return Outcome(note=f"use {_label(reference)}. Cheaper: {errors or 'none'}", verdict=Verdict.NOT_FOUND)
    row = enough.iloc[0]
    bound = max(abs(row[f"{name} error [%]"]) + row[f"{name} error 95 % [%]"] for name in ("phi_0", "phi_f"))
    finer = judged.loc[row.name :]
    though = ", ".join(_label(one) for _, one in finer[finer[VERDICT] == RESOLVED].iterrows())
    note = (
        f"use {_label(row)}, {reference[COST] / row[COST]:.2g} times as fast as {_label(reference)}: {_errors(row)} "
        f"are not resolved with {row[SEEDS]} seeds, and {bound:.1f} % in φ cannot be excluded"
    )
    return Outcome(
        note=note + (f"; but errors of a finer rung are resolved: {though}" if though else ""), verdict=Verdict.FOUND
    )


def _finding(knob: str, *, sensitivity: bool) -> Finding:
    return Finding(
        id=knob,
        says=f"(ours) {knob} changes results" if sensitivity else f"(ours) a cheaper {knob} than the finest will do",
        found_if="an error beyond the seed-to-seed band" if sensitivity else "no error beyond the seed-to-seed band",
        outcome=partial(advise, knob=knob),
        tables=["work_precision"],
    )


def _draw(path: Path, analysis: Analysis) -> list[Path]:
    """Draw errors against costs, a panel for each quantity, a series for each knob."""
    table = analysis.tables["work_precision"]
    names = [name for name, column in COMPARED.items() if name != "hook_force" or table[column].notna().any()]
    figure = style.blank_figure(2 * style.COLUMN_WIDTH, 4.6)
    panels = list(figure.subplots(-(-len(names) // 2), 2, sharex=True).flat)
    for axes in panels[len(names) :]:
        axes.remove()
    for axes, name in zip(panels, names, strict=False):
        _draw_panel(axes, name, table)
    handles, labels = panels[0].get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside upper center", ncols=4)
    told = "Hollow: references. Band: median of the error bars."
    return finished(figure, path, [told], analysis.footer, pooled=True)


def _draw_panel(axes: Any, name: str, table: pd.DataFrame) -> None:
    errors, bands = f"{name} error [%]", f"{name} error 95 % [%]"
    typical = table.loc[table[VERDICT] != IS_REFERENCE, bands].median()
    if math.isfinite(typical):
        axes.axhspan(-typical, typical, color=style.SKY, alpha=0.25, linewidth=0, label="seed-to-seed band, 95 %")
    axes.axhline(0.0, color=style.GREY, linewidth=0.6)
    knobs = list(dict.fromkeys(table[KNOB]))
    colours = style.sequence(len(knobs), last=0.85)
    for place, (knob, colour, shape) in enumerate(zip(knobs, colours, "os^vPDX<", strict=False)):
        rows = table[(table[KNOB] == knob) & table[COST].notna() & table[errors].notna()]
        # The scene itself is a rung of every knob: knobs stand side by side, by a factor in the cost.
        cost = rows[COST] * 1.05 ** (place - (len(knobs) - 1) / 2)
        axes.plot(cost, rows[errors], color=colour, linewidth=0.5, alpha=0.6)
        own = rows[VERDICT] == IS_REFERENCE
        for part, face, label in ((~own, colour, knob), (own, "white", "_nolegend_")):
            if part.any():
                look = marker(shape, colour, face) | {"linestyle": "none"}
                # A reference has no error of its own: its scatter is in the bands of the others.
                high = rows.loc[part, bands].where(~own[part]).to_numpy()
                wide = rows.loc[part, marked(COST, "95 %")].to_numpy()
                draw_means(axes, cost[part], rows.loc[part, errors], high, across=wide, look=look, label=label)
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda cost, _: f"{cost:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("processor time per simulated time [s/s]")
    axes.set_ylabel(f"error of {SYMBOLS[name]} [%]")


def study(rungs: Sequence[Rung], expected_s: Mapping[str, float] = MappingProxyType({})) -> Study:
    """Make the study of a ladder.

    Args:
        rungs: Each knob's rungs from coarse to fine.
        expected_s: Expected wall time of a run by its name, for the ratio of measured to expected [s].
    """
    knobs = {rung.knob: rung.sensitivity for rung in rungs}

    def tables(runs: pd.DataFrame) -> dict[str, pd.DataFrame]:
        table = work_precision(runs, rungs)
        return {"points": table, "work_precision": table}

    return Study(
        name="accuracy",
        title="What accuracy costs in time",
        measure=partial(measure, expected_s=expected_s),
        keys=(
            Key(column=KNOB, label="knob"),
            Key(column=VALUE, label="value"),
            Key(column=UNIT, label="unit"),
            Key(column=VARIANT, label="setting"),
        ),
        quantities=(
            Quantity(column=COST, label="cpu s per s", meaning="processor time of the last activity, one thread"),
            *(
                Quantity(
                    column=f"{name} error [%]",
                    label=f"{symbol} error % (95 %)",
                    form="+.1f",
                    bar="95 %",
                    meaning=f"of {symbol} against the knob's reference",
                )
                for name, symbol in SYMBOLS.items()
            ),
        ),
        findings=[_finding(knob, sensitivity=sensitivity) for knob, sensitivity in knobs.items()],
        figures=(Drawing(name="accuracy", of=_draw),),
        extra=tables,
        order=(),
        same_count=(),
        same_fidelity=(VARIANT,),
        constant={ASPECT: (), ACTIVITY: ()},
        remarks=(
            f"φ by {DEFINITION} ({DEFINITIONS[DEFINITION]}); φ_0 and h_0, the height of the centre of mass, before the "
            f"first activity, φ_f and ⟨N⟩ at the end of the last one, means over {LAST_FRAMES} frames or fewer.",
            "Errors are relative to the knob's reference (its finest rung with finished runs, or the scene itself for "
            "a sensitivity), their bands 95 % by Student's t, with the scatter from seed to seed pooled over all "
            "settings. Where a knob changes nothing at all, one error in twenty is still beyond its band.",
        ),
        reference=Reference(statement="the finest rung of each knob", facts={"knobs": " ".join(knobs)}),
    )
