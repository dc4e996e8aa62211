"""The study `melting`: the container's wall is taken from a pile, at once or lifted, after each procedure.

Savoie, Tuazon, Bhamla and Goldman, "Amorphous Entangled Active Matter", Soft Matter 2023, section "Melting behavior".
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import pandas as pd

from dem.record.manifest import RunManifest
from postprocess.measures.spread import OUTSIDE, TOUCHING
from postprocess.statistics.findings import CRITERION, findings_table, without_criterion
from postprocess.statistics.points import told_means
from studies.base.origin import SAVOIE, Origin, make_folder
from studies.base.release import in_order, markdown, means
from studies.base.report import StudyReport
from studies.base.runs import (
    ASPECT,
    SEED,
    SEEDS,
    collect_runs,
    refuse_mixed_counts,
    refuse_repeats,
    told_bars,
    told_seeds,
)
from studies.melting import figures as melting_figures
from studies.melting.findings import findings
from studies.melting.runs import (
    BASE,
    CONTACT,
    ENTANGLED,
    HEIGHT,
    LIFT,
    QUANTITIES,
    SLOUGHED,
    SPREAD,
    TILT,
    TOP,
    TOPPLED,
    Melting,
    measure_melting,
)
from studies.procedures.runs import PROCEDURE

_STUDY = "melting"
_NAMED: Mapping[str, Callable[[pd.Series], str]] = MappingProxyType(
    {
        "procedure": lambda point: str(point[PROCEDURE]),
        "l/w": lambda point: f"{point[ASPECT]:g}",
        "lift [m/s]": lambda point: f"{point[LIFT]:g}",
        "seeds": lambda point: str(point[SEEDS]),
    }
)
_SHOWN = {
    BASE: ("radius before [m]", ".4f"),
    TOP: ("height before [m]", ".4f"),
    CONTACT: ("cluster by contact", ".3f"),
    ENTANGLED: ("by crossings", ".3f"),
    HEIGHT: ("h/h0", ".3f"),
    SPREAD: ("radius / before", ".2f"),
    SLOUGHED: ("sloughed", ".3f"),
    TILT: ("tilt [deg]", ".1f"),
    TOPPLED: ("toppled", ".2f"),
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
        InputError: No run is done, a run is given twice, runs of one aspect ratio differ in their number of
            smarticles, or the output is no folder.
        RunError: This machine lacks the libraries to draw without a display.
    """
    output = make_folder(output)
    melted: dict[str, Melting] = {}

    def row(run: RunManifest) -> dict[str, object]:
        melted[run.directory.name] = measure_melting(run)
        return melted[run.directory.name].row

    manifests, rows, missing = collect_runs(_STUDY, run_dirs, row)
    names = [f"{row[PROCEDURE]} l/w {row[ASPECT]:g} lifted at {row[LIFT]:g} m/s" for row in rows]
    point = dict(zip((run.directory for run in manifests), names, strict=True))
    refuse_repeats(_STUDY, manifests, "point", lambda run: point[run.directory])
    refuse_mixed_counts(_STUDY, manifests)
    keys = [LIFT, ASPECT, PROCEDURE]
    runs = in_order(pd.DataFrame(rows), [LIFT, ASPECT, SEED])
    points = means(runs, keys, list(QUANTITIES))
    found = findings(runs)
    origin = Origin(study=_STUDY, manifests=manifests, missing=missing, note=note, command=command, reference=SAVOIE)
    counts = points.set_index(keys)[SEEDS]
    sizes = ", ".join(
        f"{count} smarticles in r = {radius:g} m at l/w {aspect:g}"
        for aspect, count, radius in sorted({(run.aspect_ratio, run.count, run.container_radius) for run in manifests})
    )
    footer = origin.footer(
        f"{sizes}; {told_seeds(runs, counts, 'point')}.",
        f"Clusters: centrelines within {TOUCHING:g} sphere diameters, or links through planes. Sloughed: centre of "
        f"mass farther from the pile's middle (median) than the wall was, by {OUTSIDE:g} w. Tilt: of the line to the "
        "centre of mass from the floor below where it was before. Toppled: centre of mass beyond the radius that held "
        "95 % before.",
        f"{told_bars(counts, 'point')}.",
        f"{CRITERION}.",
    )
    below = [line for line in without_criterion(footer) if not line.startswith("Error bars")]
    table = told_means(points, _NAMED, _SHOWN)
    files = origin.write(
        output,
        footer,
        tables={"runs": runs, "points": points, "findings": findings_table(found), "times": times(melted)},
        text=("findings.md", markdown("Piles whose wall is taken away", found, table, QUANTITIES)),
        draw=lambda: melting_figures.draw(output, runs=runs, melted=melted, manifests=manifests, footer=below),
    )
    return StudyReport(
        header=table[0],
        rows=table[1],
        findings=found,
        told=("Means over seeds ± standard error, at the end of the run.",),
        files=files,
    )


def times(melted: dict[str, Melting]) -> pd.DataFrame:
    """Every measure of every run against time."""
    tables = [
        pd.DataFrame({"run": name, "time since the wall began to go [s]": one.times, **one.values})
        for name, one in melted.items()
    ]
    return pd.concat(tables, ignore_index=True)
