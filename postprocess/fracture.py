"""The study `fracture`: a hook is pulled out of piles prepared by the procedures of Savoie et al.

Savoie, Tuazon, Bhamla and Goldman, "Amorphous Entangled Active Matter", Soft Matter 2023, section "Tensile loading
and fracture". What is measured of a pull is in `postprocess.pull`, of a run in `postprocess.fracture_runs`, what the
paper found and how it is judged in `postprocess.fracture_findings`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from postprocess import fracture_figures
from postprocess.findings import CRITERION, Finding, findings_table
from postprocess.fracture_findings import findings
from postprocess.fracture_runs import (
    ABOVE,
    ACCOUNT,
    CAME_FREE,
    HELD,
    HELD_FAST,
    LEFT,
    NET,
    PEAK,
    PEAK_RAISED,
    QUANTITIES,
    WINDOWS,
    WORK,
    fracture_row,
)
from postprocess.manifest import RunManifest
from postprocess.origin import Origin, make_folder
from postprocess.procedures import SAVOIE
from postprocess.procedures_runs import ACTIVE, CROSSINGS, INTERNAL, PROCEDURE, STATIC, THETA, marked, points
from postprocess.pull import END, FREE, WINDOW
from postprocess.study_report import StudyReport
from postprocess.study_runs import (
    ASPECT,
    SEED,
    SEEDS,
    collect_runs,
    refuse_mixture,
    refuse_repeats,
    runs_table,
    told_bars,
    told_seeds,
)

_STUDY = "fracture"


def analyse(run_dirs: Sequence[Path | str], output: Path | str, *, note: str, command: str) -> StudyReport:
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
        InputError: No run is done, a run is given twice, the runs differ in fidelity, those of one l/w in number of
            smarticles, those of one procedure in duration, or the output is no folder.
    """
    output = make_folder(output)
    manifests, rows, missing = collect_runs(_STUDY, run_dirs, fracture_row)
    _refuse_unlike(manifests, rows)
    runs = runs_table(rows).sort_values([PROCEDURE, ASPECT, THETA, SEED], ignore_index=True)
    means, found = points(runs, QUANTITIES), findings(runs)
    origin = Origin(study=_STUDY, manifests=manifests, missing=missing, note=note, command=command, reference=SAVOIE)
    footer = _footer(origin, runs, means)
    # How verdicts come about is no matter of figures.
    below = [line for line in footer if not line.startswith(CRITERION)]
    header, told_rows = _told_points(means)
    files = origin.write(
        output,
        footer,
        tables={"runs": runs, "points": means, "findings": findings_table(found)},
        text=("findings.md", _markdown(found, header, told_rows)),
        draw=lambda: fracture_figures.draw(output, points=means, runs=runs, manifests=manifests, footer=below),
    )
    told = ("Means over seeds ± standard error; forces over n W_s.",)
    return StudyReport(header=header, rows=told_rows, findings=found, told=told, files=files)


def _refuse_unlike(manifests: Sequence[RunManifest], rows: Sequence[Mapping[str, object]]) -> None:
    """Refuses runs that must not be averaged or compared with each other."""
    row_of = dict(zip((run.directory for run in manifests), rows, strict=True))
    for aspect in sorted({float(str(row[ASPECT])) for row in rows}):
        alike = [run for run in manifests if row_of[run.directory][ASPECT] == aspect]
        refuse_mixture(_STUDY, alike, "count", lambda run: f"{run.count} smarticles at l/w {run.aspect_ratio:g}")
    for procedure in sorted({str(row[PROCEDURE]) for row in rows}):
        alike = [run for run in manifests if row_of[run.directory][PROCEDURE] == procedure]
        refuse_mixture(
            _STUDY,
            alike,
            "duration",
            lambda run: f"{row_of[run.directory][PROCEDURE]} for {row_of[run.directory][ACTIVE]:.3g} s",
        )

    def name(run: RunManifest) -> str:
        row = row_of[run.directory]
        theta = f" θ {row[THETA]:g}°" if row[PROCEDURE] == INTERNAL else ""
        return f"{row[PROCEDURE]}{theta} l/w {row[ASPECT]:g}"

    refuse_repeats(_STUDY, manifests, "point", name)


def _footer(origin: Origin, runs: pd.DataFrame, means: pd.DataFrame) -> tuple[str, ...]:
    counts = means.set_index([PROCEDURE, ASPECT, THETA])[SEEDS]
    ratios = ", ".join(
        f"{ratio:g} ({count})" for ratio, count in runs.groupby(ASPECT)["smarticles [-]"].first().items()
    )
    active = runs[runs[PROCEDURE] != STATIC].groupby(PROCEDURE)[ACTIVE].first()
    times = ", ".join(f"{name} {time:.3g} s" for name, time in active.items()) or "none"
    return origin.footer(
        f"l/w (smarticles) {ratios}, {told_seeds(runs, counts, 'point')}; active for: {times}.",
        f"Peak: largest mean over {WINDOW:g} s of the force that raises the hook, over the weight n W_s of all "
        f"smarticles; free: below {FREE:g} of it for good; load at the end: mean over the last {END:g} s. ⟨N⟩: links "
        f"of others through a smarticle's plane at rest before the pull. {told_bars(counts, 'point')}.",
        f"{CRITERION}.",
    )


def _markdown(found: Sequence[Finding], header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    lines = ["# A hook pulled out of a pile, against the findings of Savoie et al.", ""]
    lines += ["| finding in the paper | ours (± standard error) | verdict | found if |", "| --- " * 4 + "|"]
    lines += [f"| {one.paper} | {one.ours} | **{one.verdict}** | {one.criterion} |" for one in found]
    lines += [
        "",
        "Of how the force depends on θ or on l/w by itself the paper's text says nothing; it has figures.",
        "",
    ]
    lines += [
        "What goes from hook to hook shows on the lower one, where a smarticle may be hooked into both; the peak less "
    ]
    lines[-1] += "that is what pile and container take."
    lines += ["", "## Points", "", "Means over seeds ± standard error; forces over n W_s.", ""]
    lines += [f"| {' | '.join(header)} |", "| --- " * len(header) + "|"]
    lines += [f"| {' | '.join(row)} |" for row in rows]
    lines += ["", "What the columns of `points.csv` are:", ""]
    lines += [f"- `{name}`: {meaning}" for name, meaning in QUANTITIES.items()]
    return [
        *lines,
        "",
        f"`{ACCOUNT}` of `runs.csv`: ∫ F dz from the series over the work that the engine added up, less 1.",
    ]


def _told_points(means: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the table of points for a person to read."""
    narrow, wide = WINDOWS[WINDOW / 2], WINDOWS[2 * WINDOW]
    columns = {
        PEAK: ("peak", ".3f", 1.0),
        narrow: (f"over {WINDOW / 2:g} s", ".3f", 1.0),
        wide: (f"over {2 * WINDOW:g} s", ".3f", 1.0),
        HELD: ("lower hook at it", ".3f", 1.0),
        NET: ("peak less lower hook", ".3f", 1.0),
        PEAK_RAISED: ("raised at it [mm]", ".1f", 1e3),
        WORK: ("work / n W_s w", ".3f", 1.0),
        LEFT: ("load at the end", ".3f", 1.0),
        HELD_FAST: ("held fast", ".2f", 1.0),
        CAME_FREE: ("came free", ".2f", 1.0),
        ABOVE: ("above the hook", ".2f", 1.0),
        CROSSINGS: ("⟨N⟩", ".2f", 1.0),
    }
    rows = []
    for _, point in means.iterrows():
        theta = "" if math.isnan(point[THETA]) else f"{point[THETA]:g}°"
        row = [str(point[PROCEDURE]), theta, f"{point[ASPECT]:g}", str(point[SEEDS])]
        for quantity, (_, form, factor) in columns.items():
            value, error = factor * point[quantity], factor * point[marked(quantity, "SE")]
            cell = "-" if math.isnan(value) else f"{value:{form}}"
            row.append(f"{cell} ± {error:{form}}" if math.isfinite(error) else cell)
        rows.append(row)
    return ["procedure", "θ", "l/w", "seeds", *(name for name, _, _ in columns.values())], rows
