"""The study `collapse`: free-standing columns on a vibrating base against Gravish et al.

Gravish, Franklin, Hu and Goldman, "Entangled granular media", Phys. Rev. Lett. 108, 208001 (2012): columns of
u-particles collapse in τ = (1/f) exp(Δ/Γ), with Δ greatest at an intermediate l/w. A run pours, shakes with the wall,
rests, takes the wall away, and shakes the floor. What is measured of a run is in `studies.collapse.runs`, by which
height in `studies.collapse.column`, Δ in `studies.collapse.law`, what is judged in `studies.collapse.findings`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from dem.record.manifest import RunManifest
from postprocess.report.markdown import findings_lines, meaning_lines, table_lines
from postprocess.statistics.findings import CRITERION, Finding, findings_table, without_criterion
from postprocess.statistics.points import ToldTable, told_number
from studies.base.origin import Origin, make_folder
from studies.base.report import StudyReport
from studies.base.runs import (
    ASPECT,
    SEED,
    SEEDS,
    collect_runs,
    refuse_mixed_counts,
    refuse_mixture,
    refuse_repeats,
    told_bars,
    told_seeds,
)
from studies.collapse import figures as collapse_figures
from studies.collapse.column import DEFINITIONS, REMAINING, REST, vibration
from studies.collapse.findings import findings, told_delta
from studies.collapse.law import ACTIVATION, CENSORED, DEVIATION, HALF_WIDTH, REFERENCE, USED, activations, levels
from studies.collapse.reference import COLLAPSE
from studies.collapse.runs import COLUMNS, DEFINITION, FREQUENCY, GAMMA, HEIGHT_BEFORE, WATCHED, collapse_rows
from studies.collapse.time import LEAST_FALL, WORST_ERROR

_STUDY = "collapse"


def analyse(run_dirs: Sequence[Path | str], output: Path | str, *, note: str, command: str) -> StudyReport:
    """Measures the runs of the study and writes its tables and figures.

    Runs that are not done, or cannot be read, are listed as missing; a finding that needs them has no data. Runs that
    have not collapsed by their end are not missing: they give bounds. Files of an earlier analysis in the same folder
    are replaced.

    Args:
        run_dirs: Run directories; any subset of the study.
        output: Folder for the results; made if needed.
        note: How these runs differ from the full study; stands in every footer.
        command: Command line to state as the origin.

    Returns:
        The report.

    Raises:
        InputError: No run is done, a run is given twice, the runs differ in fidelity, frequency or container, or those
            of an aspect ratio in the number of smarticles, or the output is no folder.
    """
    output = make_folder(output)
    measured: dict[Path, list[dict[str, object]]] = {}

    def measure(run: RunManifest) -> dict[str, object]:
        measured[run.directory] = collapse_rows(run)
        return {}

    manifests, _, missing = collect_runs(_STUDY, run_dirs, measure)
    _refuse_unlike(manifests)
    rows = pd.DataFrame([row for run in manifests for row in measured[run.directory]])
    rows = rows.sort_values([ASPECT, GAMMA, SEED], ignore_index=True, kind="stable")
    by_level, deltas, judged = levels(rows), activations(rows), findings(rows)
    origin = Origin(study=_STUDY, manifests=manifests, missing=missing, note=note, command=command, reference=COLLAPSE)
    footer = _footer(origin, rows, by_level)
    below = without_criterion(footer)
    files = origin.write(
        output,
        footer,
        tables={"runs": rows, "times": by_level, "points": deltas, "findings": findings_table(judged)},
        text=("findings.md", _markdown(judged, deltas)),
        draw=lambda: collapse_figures.draw(
            output, rows=rows, levels=by_level, activations=deltas, manifests=manifests, footer=below
        ),
    )
    header, lines = _told_deltas(deltas)
    return StudyReport(
        header=header,
        rows=lines,
        findings=judged,
        told=(f"By {REMAINING}: {DEFINITIONS[REMAINING]}. Others are in points.csv.",),
        files=files,
    )


def _refuse_unlike(manifests: Sequence[RunManifest]) -> None:
    """Refuses runs that must not be averaged or compared with each other."""
    shaken = {run.directory: vibration(run) for run in manifests}
    refuse_mixture(_STUDY, manifests, "frequency", lambda run: f"{shaken[run.directory].frequency:g} Hz")
    refuse_mixture(_STUDY, manifests, "container", lambda run: f"{run.container_radius:g} m wide")
    refuse_mixed_counts(_STUDY, manifests)
    refuse_repeats(
        _STUDY,
        manifests,
        "point",
        lambda run: f"l/w {run.aspect_ratio:g} Γ {shaken[run.directory].acceleration:g}",
    )


def _footer(origin: Origin, rows: pd.DataFrame, by_level: pd.DataFrame) -> tuple[str, ...]:
    counts = by_level.set_index([DEFINITION, ASPECT, GAMMA])[SEEDS]
    shortest, before = rows.groupby(GAMMA)[WATCHED].min(), rows.groupby(ASPECT)[HEIGHT_BEFORE].mean()
    watched = ", ".join(f"{time:.3g} s at Γ = {gamma:g}" for gamma, time in shortest.items())
    heights = ", ".join(f"{2e3 * height:.0f} mm at l/w = {aspect:g}" for aspect, height in before.items())
    run = origin.manifests[0]
    return origin.footer(
        f"columns of {1e3 * run.container_radius:.3g} mm radius, twice their centre of mass {heights}; f = "
        f"{rows[FREQUENCY].iloc[0]:g} Hz, watched for {watched}; {told_seeds(rows, counts, 'point')}.",
        f"h by `{REMAINING}`: {DEFINITIONS[REMAINING]}; h0: mean over the last {REST:g} s before the vibration. τ: fit "
        "of h0 exp(-(t/τ)^β) to means over periods; seen where it is shorter than the time watched, the fall is at "
        f"least {LEAST_FALL:.0%} and the error of the fit below {WORST_ERROR:.0%}, else a bound. Δ: slope of ln(fτ) "
        "against 1/Γ through the origin, seed by seed, over the Γ at which every run collapsed. The floor has no end: "
        f"smarticles that leave the column go on hopping on it. {told_bars(counts, 'point')}.",
        f"{CRITERION}.",
    )


def _markdown(judged: Sequence[Finding], deltas: pd.DataFrame) -> list[str]:
    rows = [
        [
            row[DEFINITION],
            f"{row[ASPECT]:g}",
            told_delta(row),
            told_number(row[REFERENCE], "g"),
            row[USED] or "none",
            str(row[CENSORED]),
        ]
        for _, row in deltas.iterrows()
    ]
    return [
        "# Collapse of columns against the findings of Gravish et al.",
        "",
        *findings_lines(judged),
        "",
        "## Δ by each definition of the height",
        "",
        "Means over seeds ± standard error.",
        "",
        *table_lines(["definition", "l/w", "Δ", "Gravish", "Γ used", "runs with a bound"], rows),
        "",
        *(f"- `{name}`: {meaning}" for name, meaning in DEFINITIONS.items()),
        *meaning_lines("runs.csv", COLUMNS),
    ]


def _told_deltas(deltas: pd.DataFrame) -> ToldTable:
    """Header and rows of the table for the terminal: Δ by the first definition."""
    rows = []
    for _, row in deltas[deltas[DEFINITION] == REMAINING].iterrows():
        value = told_delta(row).partition(" ± ")[0] if math.isnan(row[ACTIVATION]) else f"{row[ACTIVATION]:.2f}"
        cells = [f"{row[ASPECT]:g}", str(row[SEEDS]), row[USED] or "none", value, told_number(row[HALF_WIDTH], ".2f")]
        cells += [told_number(row[REFERENCE], "g"), told_number(row[DEVIATION], "+.0f")]
        rows.append([*cells, str(row[CENSORED])])
    return ["l/w", "seeds", "Γ used", "Δ", "± 95 %", "Gravish", "deviation %", "runs with a bound"], rows
