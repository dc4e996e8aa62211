"""The study `procedures`: shape change, external and internal oscillation against the findings of Savoie et al.

Savoie, Tuazon, Bhamla and Goldman, "Amorphous Entangled Active Matter", Soft Matter 2023: smarticles poured
into a cylinder go through one of three activities. What is measured of a run is in
`studies.procedures.measure`, what the paper found and how it is judged in `studies.procedures.findings`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

from postprocess.measures.packing import DEFINITIONS
from postprocess.report.markdown import findings_lines, meaning_lines, table_lines
from postprocess.statistics.findings import CRITERION, Finding, findings_table, without_criterion
from postprocess.statistics.points import ToldTable, told_means
from studies.base.origin import SAVOIE, Origin, make_folder
from studies.base.runs import (
    ASPECT,
    DEFINITION,
    SEED,
    SEEDS,
    MissingRun,
    collect_runs,
    refuse_mixture,
    runs_table,
    told_bars,
    told_seeds,
)
from studies.procedures import figures as procedures_figures
from studies.procedures.findings import findings
from studies.procedures.measure import (
    ACTIVE,
    AMPLITUDE,
    CROSSINGS,
    ENERGY,
    HEIGHT,
    NAMED,
    PHI,
    PHI_ACTIVE,
    PROCEDURE,
    QUANTITIES,
    THETA,
    points,
    procedure_row,
    refuse_unlike,
    samples,
    static_spread,
)

_STUDY = "procedures"
_SHOWN = {
    PHI_ACTIVE: ("φ_f", ".4f"),
    PHI: ("φ at rest again", ".4f"),
    CROSSINGS: ("⟨N⟩", ".2f"),
    ENERGY: ("energy [J]", ".2e"),
    HEIGHT: ("h/h0", ".3f"),
}


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
    refuse_mixture(_STUDY, manifests, "count", lambda run: f"{run.count} smarticles")
    refuse_unlike(_STUDY, manifests, rows)
    runs = runs_table(rows).sort_values([PROCEDURE, THETA, ASPECT, SEED], ignore_index=True)
    table = samples(runs)
    means, found = points(table), findings(table)
    origin = Origin(study=_STUDY, manifests=manifests, missing=missing, note=note, command=command, reference=SAVOIE)
    footer = _footer(origin, runs, means)
    below = without_criterion(footer)
    files = origin.write(
        output,
        footer,
        tables={"runs": runs, "points": means, "findings": findings_table(found)},
        text=("findings.md", _markdown(found, means)),
        draw=lambda: procedures_figures.draw(output, points=means, runs=runs, manifests=manifests, footer=below),
    )
    return ProceduresReport(runs=runs, points=means, findings=found, missing=missing, footer=footer, files=files)


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
    return [
        "# Procedures of smarticles against the findings of Savoie et al.",
        "",
        *findings_lines(found),
        "",
        "## Points",
        "",
        "Means over seeds ± standard error. Of θ only what the hinge reaches is run: a barb",
        "swings to 90° + θ/2 · 0.7/(l/w), 105° at most, so θ is at most 30° (l/w)/0.7.",
        "",
        *table_lines(*told_points(means)),
        *meaning_lines("points.csv", QUANTITIES),
    ]


def told_points(means: pd.DataFrame) -> ToldTable:
    """The table of points for a person to read."""
    return told_means(means, NAMED, _SHOWN)
