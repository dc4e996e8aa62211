"""The study `fracture`: a hook is pulled out of piles prepared by the procedures of Savoie et al.

Savoie, Tuazon, Bhamla and Goldman, "Amorphous Entangled Active Matter", Soft Matter 2023, section "Tensile loading
and fracture". What is measured of a pull is in `postprocess.measures.pull`, of a run in `studies.fracture.measure`, what the
paper found and how it is judged in `studies.fracture.findings`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from postprocess.measures.pull import END, FREE, WINDOW
from postprocess.report.markdown import findings_lines, meaning_lines, table_lines
from postprocess.statistics.findings import CRITERION, Finding, findings_table, without_criterion
from postprocess.statistics.points import ToldTable, marked, told_means
from studies.base.origin import SAVOIE, Origin, make_folder
from studies.base.report import StudyReport
from studies.base.runs import (
    ASPECT,
    SEED,
    SEEDS,
    collect_runs,
    refuse_mixed_counts,
    runs_table,
    told_bars,
    told_range,
    told_seeds,
)
from studies.fracture import figures as fracture_figures
from studies.fracture.findings import findings
from studies.fracture.measure import (
    ABOVE,
    ACCOUNT,
    CAME_FREE,
    HELD,
    HELD_FAST,
    LEFT,
    LIMIT,
    NET,
    PEAK,
    PEAK_RAISED,
    QUANTITIES,
    WINDOWS,
    WORK,
    fracture_row,
)
from studies.procedures.measure import ACTIVE, CROSSINGS, NAMED, PROCEDURE, STATIC, THETA, points, refuse_unlike

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
    refuse_mixed_counts(_STUDY, manifests)
    refuse_unlike(_STUDY, manifests, rows)
    runs = runs_table(rows).sort_values([PROCEDURE, ASPECT, THETA, SEED], ignore_index=True)
    means, found = points(runs, QUANTITIES), findings(runs)
    origin = Origin(study=_STUDY, manifests=manifests, missing=missing, note=note, command=command, reference=SAVOIE)
    footer = _footer(origin, runs, means)
    below = without_criterion(footer)
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
        *_told_held(runs),
        f"{CRITERION}.",
    )


def _told_held(runs: pd.DataFrame) -> tuple[str, ...]:
    """What peaks of piles that held fast are; nothing where none did."""
    held = int(runs[HELD_FAST].sum())
    limits = told_range(runs[LIMIT].round(3))
    told = f"Held fast: {held} of {len(runs)} runs, whose hook stopped at {limits} n W_s; their peaks are lower bounds."
    return (told,) if held else ()


def _markdown(found: Sequence[Finding], header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    lines = ["# A hook pulled out of a pile, against the findings of Savoie et al.", "", *findings_lines(found)]
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
    lines += [*table_lines(header, rows), *meaning_lines("points.csv", QUANTITIES)]
    return [
        *lines,
        "",
        f"`{ACCOUNT}` of `runs.csv`: ∫ F dz from the series over the work that the engine added up, less 1.",
    ]


def _told_points(means: pd.DataFrame) -> ToldTable:
    """The table of points for a person to read."""
    narrow, wide = WINDOWS[WINDOW / 2], WINDOWS[2 * WINDOW]
    columns = {
        PEAK: ("peak", ".3f"),
        narrow: (f"over {WINDOW / 2:g} s", ".3f"),
        wide: (f"over {2 * WINDOW:g} s", ".3f"),
        HELD: ("lower hook at it", ".3f"),
        NET: ("peak less lower hook", ".3f"),
        PEAK_RAISED: ("raised at it [mm]", ".1f"),
        WORK: ("work / n W_s w", ".3f"),
        LEFT: ("load at the end", ".3f"),
        HELD_FAST: ("held fast", ".2f"),
        CAME_FREE: ("came free", ".2f"),
        ABOVE: ("above the hook", ".2f"),
        CROSSINGS: ("⟨N⟩", ".2f"),
    }
    # Told in millimetres.
    raised = [PEAK_RAISED, marked(PEAK_RAISED, "SE")]
    return told_means(means.assign(**(1e3 * means[raised])), NAMED, columns)
