"""The study `casting`: smarticles poured into a mould of three tiers, activated, and what is left without its walls.

Savoie, Tuazon, Bhamla and Goldman, "Amorphous Entangled Active Matter", Soft Matter 2023, section "Casting".
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import pandas as pd

from postprocess.geometry.outline import BALL
from postprocess.statistics.findings import CRITERION, findings_table, without_criterion
from postprocess.statistics.points import told_means
from studies.base.origin import SAVOIE, Origin, make_folder
from studies.base.release import in_order, markdown, means, procedure
from studies.base.report import StudyReport
from studies.base.runs import SEED, SEEDS, collect_runs, refuse_mixture, refuse_repeats, told_bars, told_seeds
from studies.casting import figures as casting_figures
from studies.casting.findings import findings
from studies.casting.runs import (
    FILLED,
    FILLED_AFTER,
    KEPT,
    LIKENESS,
    LIKENESS_BEFORE,
    NECK,
    OVERLAP,
    QUANTITIES,
    WHOLE,
    WHOLE_AFTER,
    WHOLE_KEPT,
    casting_row,
    mould,
)
from studies.procedures.runs import PROCEDURE

_STUDY = "casting"
_NAMED: Mapping[str, Callable[[pd.Series], str]] = MappingProxyType(
    {"procedure": lambda point: str(point[PROCEDURE]), "seeds": lambda point: str(point[SEEDS])}
)
_SHOWN = {
    **{name: (f"filled {tier}", ".3f") for tier, name in FILLED.items()},
    WHOLE: ("whole", ".3f"),
    NECK: ("in the neck", ".3f"),
    **{name: (f"{tier} after", ".3f") for tier, name in FILLED_AFTER.items()},
    WHOLE_AFTER: ("whole after", ".3f"),
    **{name: (f"kept {tier}", ".3f") for tier, name in KEPT.items()},
    WHOLE_KEPT: ("kept whole", ".3f"),
    OVERLAP: ("overlap", ".3f"),
    LIKENESS_BEFORE: ("likeness", ".3f"),
    LIKENESS: ("likeness after", ".3f"),
}


def analyse(run_dirs: Sequence[Path | str], output: Path | str, *, note: str, command: str) -> StudyReport:
    """Measures the runs of the study and writes its tables, figures and pictures.

    Runs that are not done, or cannot be read, are listed as missing; a finding that needs them has no data.

    Args:
        run_dirs: Run directories; any subset of the study.
        output: Folder for the results; made if needed.
        note: How these runs differ from the full study; stands in every footer.
        command: Command line to state as the origin.

    Returns:
        The report.

    Raises:
        InputError: No run is done, a run is given twice, runs differ in their number of smarticles or their mould, or
            the output is no folder.
        RunError: This machine lacks the libraries to draw without a display.
    """
    output = make_folder(output)
    manifests, rows, missing = collect_runs(_STUDY, run_dirs, casting_row)
    refuse_repeats(_STUDY, manifests, "procedure", procedure)
    refuse_mixture(_STUDY, manifests, "count", lambda run: f"{run.count} smarticles")
    refuse_mixture(_STUDY, manifests, "mould", lambda run: [(tier.radius, tier.top) for tier in mould(run)])
    runs = in_order(pd.DataFrame(rows), [SEED])
    points = means(runs, [PROCEDURE], list(QUANTITIES))
    found = findings(runs)
    origin = Origin(study=_STUDY, manifests=manifests, missing=missing, note=note, command=command, reference=SAVOIE)
    counts = points.set_index(PROCEDURE)[SEEDS]
    one = manifests[0]
    sizes = ", ".join(f"r = {1e3 * tier.radius:.3g} mm" for tier in mould(one))
    footer = origin.footer(
        f"l/w {one.aspect_ratio:g}, {one.count} smarticles in tiers of {sizes} (assumed: the paper gives none), each "
        f"{1e3 * mould(one)[0].top:.3g} mm high, below a neck as wide as the top one; "
        f"{told_seeds(runs, counts, 'procedure')}.",
        f"Inside the pile is what a ball of radius {BALL:g} w that rolls around links and floor cannot reach.",
        f"{told_bars(counts, 'procedure')}.",
        f"{CRITERION}.",
    )
    below = without_criterion(footer)
    table = told_means(points, _NAMED, _SHOWN)
    files = origin.write(
        output,
        footer,
        tables={"runs": runs, "points": points, "findings": findings_table(found)},
        text=("findings.md", markdown("Casts of smarticles", found, table, QUANTITIES)),
        draw=lambda: casting_figures.draw(output, points=points, runs=runs, manifests=manifests, footer=below),
    )
    return StudyReport(
        header=table[0],
        rows=table[1],
        findings=found,
        told=("Means over seeds ± standard error.",),
        files=files,
    )
