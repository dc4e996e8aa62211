"""The study `chain`: strain tests of a chain of robots between two walls against the findings of Savoie et al.

Savoie, Tuazon, Bhamla and Goldman, "Amorphous Entangled Active Matter", Soft Matter 2023, "Robophysical experiment".
What is measured of a run is in `studies.chain.runs`, what the paper found and how it is judged in
`studies.chain.findings`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import pandas as pd

from dem.record.manifest import RunManifest
from postprocess.measures.strain import (
    AT_PEAK,
    CARRIES,
    FRACTURE,
    LOSS,
    PEAK,
    QUANTITIES,
    STIFFNESS,
    WALL,
    WIDENING,
    YIELD,
)
from postprocess.report.markdown import findings_lines, meaning_lines, table_lines
from postprocess.statistics.findings import CRITERION, Finding, findings_table, without_criterion
from postprocess.statistics.points import told_means, told_number
from studies.base.origin import SAVOIE, Origin, make_folder
from studies.base.report import StudyReport
from studies.base.runs import SEED, SEEDS, collect_runs, refuse_repeats, told_range
from studies.chain import figures as chain_figures
from studies.chain.findings import findings, sensitivity
from studies.chain.runs import CONFINEMENT, COUNT, SPEED, VARIANT, chain_row, points

_STUDY = "chain"

_NAMED: Mapping[str, Callable[[pd.Series], str]] = MappingProxyType(
    {
        "variant": lambda point: str(point[VARIANT]),
        "n": lambda point: str(point[COUNT]),
        "h/H": lambda point: f"{point[CONFINEMENT]:g}",
        "mm/s": lambda point: f"{1e3 * point[SPEED]:g}",
        "trials": lambda point: str(point[SEEDS]),
    }
)
_SHOWN = {
    PEAK: ("peak force [N]", ".3f"),
    AT_PEAK: ("strain at the peak", ".3f"),
    FRACTURE: ("strain at fracture", ".3f"),
    YIELD: ("strain at the yield drop", ".3f"),
    STIFFNESS: ("stiffness [N]", ".2f"),
    WIDENING: ("widening", ".3f"),
    WALL: ("wall force [N]", ".2f"),
}


def analyse(run_dirs: Sequence[Path | str], output: Path | str, *, note: str, command: str) -> StudyReport:
    """Measures the runs of the study and writes its tables and figures.

    Runs that are not done, or cannot be read, are listed as missing. Files of an earlier analysis in the same folder
    are replaced.

    Args:
        run_dirs: Run directories; any subset of the study.
        output: Folder for the results; made if needed.
        note: How these runs differ from the full study; stands in every footer.
        command: Command line to state as the origin.

    Returns:
        The report.

    Raises:
        InputError: No run is done, a run is given twice, or the output is no folder.
    """
    output = make_folder(output)
    manifests, rows, missing = collect_runs(_STUDY, run_dirs, chain_row)
    place = {run.directory: row for run, row in zip(manifests, rows, strict=True)}

    def named(run: RunManifest) -> str:
        row = place[run.directory]
        return f"{row[VARIANT]} n {row[COUNT]} h/H {row[CONFINEMENT]}"

    refuse_repeats(_STUDY, manifests, "point", named)
    runs = pd.DataFrame(rows).sort_values([VARIANT, COUNT, CONFINEMENT, SEED], ignore_index=True)
    means, found, changes = points(runs), findings(runs), sensitivity(runs)
    origin = Origin(study=_STUDY, manifests=manifests, missing=missing, note=note, command=command, reference=SAVOIE)
    footer = origin.footer(
        _told_trials(means),
        "Force: of the pulled string, means over 1 ms. Strain: of the distance along x between the strings' ties. A "
        f"chain holds while it carries {CARRIES:.0%} of its peak force. A yield drop loses {LOSS:.0%} of the force or "
        "more. Trials differ in the strength of their servos, ±10 %.",
        f"{CRITERION}.",
    )
    files = origin.write(
        output,
        footer,
        tables={"runs": runs, "points": means, "sensitivity": changes, "findings": findings_table(found)},
        text=("findings.md", _markdown(found, means, changes)),
        draw=lambda: chain_figures.draw(
            output, points=means, runs=runs, changes=changes, manifests=manifests, footer=without_criterion(footer)
        ),
    )
    header, told = told_means(means, _NAMED, _SHOWN)
    return StudyReport(
        header=header, rows=told, findings=found, told=("Means over trials ± standard error.",), files=files
    )


def _told_trials(means: pd.DataFrame) -> str:
    groups = means.groupby(SPEED)[[VARIANT, COUNT]]
    told = []
    for speed, group in groups:
        names = dict.fromkeys(f"{variant} n = {count}" for variant, count in group.itertuples(index=False))
        told.append(f"{1e3 * float(str(speed)):g} mm/s: {', '.join(names)}")
    return f"{told_range(means[SEEDS])} trials per point; {'; '.join(told)}."


def _markdown(found: Sequence[Finding], means: pd.DataFrame, changes: pd.DataFrame) -> list[str]:
    return [
        "# The strain test of a chain of robots against the findings of Savoie et al.",
        "",
        *findings_lines(found),
        "",
        "## Points",
        "",
        "Means over trials ± standard error.",
        "",
        *table_lines(*told_means(means, _NAMED, _SHOWN)),
        *(_changes_lines(changes) if len(changes) else ()),
        *meaning_lines("points.csv", QUANTITIES),
    ]


def _changes_lines(changes: pd.DataFrame) -> list[str]:
    names = [PEAK, FRACTURE, STIFFNESS]
    rows = [
        [
            str(variant),
            *(
                told_number(row["change [%]"], "+.1f", row["change 95 % [%]"])
                for _, row in group.set_index("quantity").loc[names].iterrows()
            ),
        ]
        for variant, group in changes.groupby(VARIANT, sort=False)
    ]
    return [
        "",
        "## What the assumptions matter",
        "",
        "Change against the baseline, in per cent ± 95 % half-width over pairs of runs with the same servos.",
        "",
        *table_lines(["variant", *(name.rpartition(" [")[0] for name in names)], rows),
    ]
