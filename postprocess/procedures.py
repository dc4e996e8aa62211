"""The study `procedures`: shape change, external and internal oscillation against the findings of Savoie et al.

Savoie, Tuazon, Bhamla and Goldman, "Amorphous Entangled Active Matter", Soft Matter 2023: smarticles poured
into a cylinder go through one of three activities. What is measured of a run is in
`postprocess.procedures_runs`, what the paper found and how it is judged in `postprocess.procedures_findings`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

import pandas as pd

from postprocess import procedures_figures
from postprocess.findings import CRITERION, Finding, findings_table
from postprocess.manifest import RunManifest
from postprocess.origin import Origin, Reference, make_folder
from postprocess.packing import DEFINITIONS
from postprocess.procedures_findings import findings
from postprocess.procedures_runs import (
    ACTIVE,
    AMPLITUDE,
    CROSSINGS,
    ENERGY,
    HEIGHT,
    INTERNAL,
    PHI,
    PHI_ACTIVE,
    PROCEDURE,
    QUANTITIES,
    THETA,
    marked,
    points,
    procedure_row,
    samples,
    static_spread,
)
from postprocess.study_runs import (
    ASPECT,
    DEFINITION,
    SEED,
    SEEDS,
    MissingRun,
    collect_runs,
    refuse_mixture,
    refuse_repeats,
    runs_table,
    told_bars,
    told_seeds,
)

_STUDY = "procedures"

SAVOIE = Reference(
    statement="statements in the text of Savoie et al., Soft Matter 2023, DOI 10.1039/d2sm01573k; no data of theirs",
    facts=MappingProxyType({"doi": "10.1039/d2sm01573k", "what": "statements in the text"}),
)


@dataclass(frozen=True, kw_only=True, eq=False)
class ProceduresReport:
    """Tables, findings and files of the study.

    Attributes:
        runs: One row per finished run.
        points: One row per procedure, aspect ratio and θ: means over seeds with errors; see
            `procedures_runs.QUANTITIES`.
        findings: The paper's findings, judged.
        missing: Runs that were given and are not in the tables.
        footer: What every figure and table says about its origin, one statement each.
        files: Everything that was written, by name.
    """

    runs: pd.DataFrame = field(repr=False)
    points: pd.DataFrame = field(repr=False)
    findings: tuple[Finding, ...]
    missing: tuple[MissingRun, ...]
    footer: tuple[str, ...] = field(repr=False)
    files: Mapping[str, Path] = field(repr=False)


def analyse_procedures(
    run_dirs: Sequence[Path | str], output: Path | str, *, note: str, command: str
) -> ProceduresReport:
    """Measures the runs of the study and writes its tables and figures.

    Runs that are not done, or cannot be read, are listed as missing; a finding that needs them has no data.
    Files of an earlier analysis in the same folder are replaced.

    Args:
        run_dirs: Run directories; any subset of the study.
        output: Folder for the results; made if needed.
        note: How these runs differ from the full study; stands in every footer.
        command: Command line to state as the origin.

    Returns:
        The report.

    Raises:
        InputError: No run is done, a run is given twice, the runs differ in fidelity, number of smarticles or
            duration of an activity, or the output is no folder.
    """
    output = make_folder(output)
    manifests, rows, missing = collect_runs(_STUDY, run_dirs, procedure_row)
    _refuse_unlike(manifests, rows)
    runs = runs_table(rows).sort_values([PROCEDURE, THETA, ASPECT, SEED], ignore_index=True)
    table = samples(runs)
    means, found = points(table), findings(table)
    origin = Origin(study=_STUDY, manifests=manifests, missing=missing, note=note, command=command, reference=SAVOIE)
    footer = _footer(origin, runs, means)
    # How verdicts come about is no matter of figures.
    below = [line for line in footer if not line.startswith(CRITERION)]
    files = origin.write(
        output,
        footer,
        tables={"runs": runs, "points": means, "findings": findings_table(found)},
        text=("findings.md", _markdown(found, means)),
        draw=lambda: procedures_figures.draw(output, points=means, runs=runs, manifests=manifests, footer=below),
    )
    return ProceduresReport(runs=runs, points=means, findings=found, missing=missing, footer=footer, files=files)


def _refuse_unlike(manifests: Sequence[RunManifest], rows: Sequence[Mapping[str, object]]) -> None:
    """Refuses runs that must not be averaged or compared with each other."""
    refuse_mixture(_STUDY, manifests, "count", lambda run: f"{run.count} smarticles")
    row_of = dict(zip((run.directory for run in manifests), rows, strict=True))

    def lasting(run: RunManifest) -> str:
        row = row_of[run.directory]
        return f"{row[PROCEDURE]} for {row[ACTIVE]:.3g} s"

    def name(run: RunManifest) -> str:
        row = row_of[run.directory]
        theta = f" θ {row[THETA]:g}°" if row[PROCEDURE] == INTERNAL else ""
        return f"{row[PROCEDURE]}{theta} l/w {row[ASPECT]:g}"

    for procedure in sorted({str(row[PROCEDURE]) for row in rows}):
        alike = [run for run in manifests if row_of[run.directory][PROCEDURE] == procedure]
        refuse_mixture(_STUDY, alike, "duration", lasting)
    refuse_repeats(_STUDY, manifests, "point", name)


def _footer(origin: Origin, runs: pd.DataFrame, means: pd.DataFrame) -> tuple[str, ...]:
    counts = means.set_index([PROCEDURE, ASPECT, THETA])[SEEDS]
    ratios = " ".join(f"{ratio:g}" for ratio in sorted(runs[ASPECT].unique()))
    times = ", ".join(f"{name} {time:.3g} s" for name, time in runs.groupby(PROCEDURE)[ACTIVE].first().items())
    return origin.footer(
        f"l/w {ratios}, {origin.manifests[0].count} smarticles, {told_seeds(runs, counts, 'point')}; "
        f"active for: {times}.",
        f"φ by {DEFINITION} ({DEFINITIONS[DEFINITION]}), ⟨N⟩ the links of others through a smarticle's plane: φ_f is "
        "the mean over the last 20 frames of the activity, as in the paper, ⟨N⟩ that over the frames of the relaxation "
        "after it; static ones are means over the frames of the relaxation before it (runs of one l/w and seed agree "
        f"there within {static_spread(runs):.2g} in φ). h0 is the mean height of the centre of mass there. "
        "Energy: work of the motors, or of the shaken container without its own weight. Procedures are compared at "
        f"θ = {AMPLITUDE:g}°. "
        f"{told_bars(counts, 'point')}.",
        f"{CRITERION}.",
    )


def _markdown(found: Sequence[Finding], means: pd.DataFrame) -> list[str]:
    lines = ["# Procedures of smarticles against the findings of Savoie et al.", ""]
    lines += ["| finding in the paper | ours (± standard error) | verdict | found if |", "| --- " * 4 + "|"]
    lines += [f"| {one.paper} | {one.ours} | **{one.verdict}** | {one.criterion} |" for one in found]
    lines += ["", "## Points", "", "Means over seeds ± standard error. Of θ only what the hinge reaches is run: a barb"]
    lines += ["swings to 90° + θ/2 · 0.7/(l/w), 105° at most, so θ is at most 30° (l/w)/0.7.", ""]
    header, rows = told_points(means)
    lines += [f"| {' | '.join(header)} |", "| --- " * len(header) + "|"]
    lines += [f"| {' | '.join(row)} |" for row in rows]
    lines += ["", "What the columns of `points.csv` are:", ""]
    return lines + [f"- `{name}`: {meaning}" for name, meaning in QUANTITIES.items()]


def told_points(means: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the table of points for a person to read."""
    columns = {
        PHI_ACTIVE: ("φ_f", ".4f"),
        PHI: ("φ at rest again", ".4f"),
        CROSSINGS: ("⟨N⟩", ".2f"),
        ENERGY: ("energy [J]", ".2e"),
        HEIGHT: ("h/h0", ".3f"),
    }
    rows = []
    for _, point in means.iterrows():
        theta = "" if math.isnan(point[THETA]) else f"{point[THETA]:g}°"
        row = [str(point[PROCEDURE]), theta, f"{point[ASPECT]:g}", str(point[SEEDS])]
        for quantity, (_, form) in columns.items():
            value, error = point[quantity], point[marked(quantity, "SE")]
            cell = "-" if math.isnan(value) else f"{value:{form}}"
            row.append(f"{cell} ± {error:{form}}" if math.isfinite(error) else cell)
        rows.append(row)
    return ["procedure", "θ", "l/w", "seeds", *(name for name, _ in columns.values())], rows
