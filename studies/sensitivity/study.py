"""The studies of sensitivity: what φ before and after shaking owes to each choice of the contact model.

Each variant differs from the first one, the baseline, in one choice. Runs are named
`VARIANT_seedN`. A change is clear where it is beyond its own 95 % half-width, by Welch.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

import pandas as pd

from dem.record.manifest import RunManifest
from postprocess.report.markdown import table_lines
from postprocess.statistics.points import marked, seeds_of, told_number
from postprocess.statistics.seeds import mean_over_seeds, relative_difference
from studies.base.origin import Origin, make_folder
from studies.base.runs import (
    ASPECT,
    DEFINITION,
    SEEDS,
    VARIANT,
    WHEN,
    MissingRun,
    collect_runs,
    measured_row,
    named_variant,
    refuse_mixture,
    refuse_repeats,
    runs_table,
    told_bars,
    told_seeds,
    told_shaken,
    variant_of,
    variants_of,
)
from studies.gravish.reference import read_reference, reference_at
from studies.sensitivity import figure as sensitivity_figure

COMPARED: Mapping[str, str] = MappingProxyType(
    {
        "phi_0": f"phi_0 {DEFINITION}",
        "phi_f": f"phi_f {DEFINITION}",
        "crossings after": "crossings after",
    }
)
"""What is compared with the baseline: its name here, and its column in the table of runs less the unit."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SensitivityReport:
    """Tables and files of the study.

    Attributes:
        baseline: Variant that the others are compared with.
        runs: One row per finished run.
        summary: One row per variant, in the order given: means over seeds with errors, and changes
            against the baseline; NaN without a finished run.
        missing: Runs that were given and are not in the tables.
        footer: What figure and tables say about their origin, one statement each.
        files: Everything that was written, by name.
    """

    baseline: str
    runs: pd.DataFrame = field(repr=False)
    summary: pd.DataFrame = field(repr=False)
    missing: tuple[MissingRun, ...]
    footer: tuple[str, ...] = field(repr=False)
    files: Mapping[str, Path] = field(repr=False)


def analyse_sensitivity(
    run_dirs: Sequence[Path | str], output: Path | str, *, study: str = "sensitivity", note: str, command: str
) -> SensitivityReport:
    """Measures the runs of the study and writes its tables and its figure.

    Runs that are not done, or cannot be read, are listed as missing. Files of an earlier analysis
    in the same folder are replaced.

    Args:
        run_dirs: Run directories named `VARIANT_seedN`; the first one's variant is the baseline.
        output: Folder for the results; made if needed.
        study: Name of the study.
        note: How these runs differ from the full study; stands in the footer.
        command: Command line to state as the origin.

    Returns:
        The report.

    Raises:
        InputError: No run is done, a run is given twice, the runs differ in fidelity, aspect ratio
            or number of smarticles, or the output is no folder.
    """
    output = make_folder(output)
    manifests, rows, missing = collect_runs(study, run_dirs, _row)
    refuse_mixture(study, manifests, "l/w", lambda run: f"{run.aspect_ratio:g}")
    refuse_mixture(study, manifests, "count", lambda run: f"{run.count} smarticles")
    refuse_repeats(study, manifests, VARIANT, lambda run: named_variant(run.directory)[0])
    runs = runs_table(rows)
    variants = variants_of(run_dirs)
    summary = summarise_variants(runs, variants)
    aspect = manifests[0].aspect_ratio
    reference = {stage: reference_at(read_reference(), aspect, stage) for stage in ("phi_0", "phi_f")}
    origin = Origin(study=study, manifests=manifests, missing=missing, note=note, command=command)
    footer = _footer(origin, runs, baseline=variants[0])
    title = f"Study {study}: packing at l/w = {aspect:g}"
    files = origin.write(
        output,
        footer,
        tables={"runs": runs, "summary": summary},
        text=("summary.md", _markdown(title, summary, reference)),
        draw=lambda: sensitivity_figure.draw(
            output / "sensitivity", runs=runs, summary=summary, reference=reference, footer=footer
        ),
    )
    return SensitivityReport(
        baseline=variants[0],
        runs=runs,
        summary=summary,
        missing=missing,
        footer=footer,
        files=files,
    )


def summarise_variants(runs: pd.DataFrame, variants: Sequence[str]) -> pd.DataFrame:
    """One row per variant: means over seeds, and changes against the first variant.

    Args:
        runs: Table of runs, see `SensitivityReport.runs`.
        variants: In the order wanted; one without runs has NaN.

    Returns:
        The table; `… 95 % [-]` are half-widths, `… change [%]` and its half-width `… change 95 %
        [%]` are relative to the baseline's mean, `… clear` says whether the change is beyond it.
    """
    groups = {variant: runs[runs[VARIANT] == variant] for variant in variants}
    rows = []
    for variant, group in groups.items():
        row: dict[str, object] = {VARIANT: variant, **seeds_of(group)}
        for name, quantity in COMPARED.items():
            column = f"{quantity} [-]"
            mean, baseline = mean_over_seeds(group[column]), mean_over_seeds(groups[variants[0]][column])
            row[column] = mean.value
            row[marked(column, "95 %")] = mean.half_width
            change = None if variant == variants[0] else relative_difference(mean, baseline)
            row[f"{name} change [%]"] = change.value if change else math.nan
            row[f"{name} change 95 % [%]"] = change.half_width if change else math.nan
            row[f"{name} clear"] = bool(change and change.clear)
        rows.append(row)
    return pd.DataFrame(rows)


def _row(run: RunManifest) -> dict[str, object]:
    return {VARIANT: variant_of(run), **measured_row(run, [DEFINITION])}


def _footer(origin: Origin, runs: pd.DataFrame, *, baseline: str) -> tuple[str, ...]:
    counts = runs.groupby(VARIANT, sort=False).size()
    return origin.footer(
        f"l/w = {runs[ASPECT].iloc[0]:g}, {origin.manifests[0].count} smarticles, "
        f"{told_seeds(runs, counts, VARIANT)}; shaken for {told_shaken(runs)}.",
        f"φ by {DEFINITION}; {WHEN}. {told_bars(counts, VARIANT)}.",
        f"Changes are against the baseline {baseline}, their errors 95 % by Welch: where a choice changes nothing "
        "at all, one change in twenty is still beyond its error.",
    )


def _markdown(title: str, summary: pd.DataFrame, reference: Mapping[str, float]) -> list[str]:
    known = [f"{stage} = {value:.4f}" for stage, value in reference.items() if math.isfinite(value)]
    parts = [f"# {title}", ""]
    parts += [f"Gravish et al. 2012 at this l/w: {', '.join(known)}." if known else "Gravish has no point at this l/w."]
    parts += ["Changes are against the first row; those beyond their error are bold.", ""]
    header = ["variant", "seeds", "φ_0", "change %", "φ_f", "change %", "⟨N⟩ after", "change %"]
    rows = []
    for _, row in summary.iterrows():
        cells = [str(row[VARIANT]), str(row[SEEDS])]
        for name, quantity in COMPARED.items():
            cells.append(told_value(row[f"{quantity} [-]"], row[f"{quantity} 95 % [-]"], name))
            change = told_change(row[f"{name} change [%]"], row[f"{name} change 95 % [%]"])
            cells.append(f"**{change}**" if row[f"{name} clear"] else change)
        rows.append(cells)
    return [*parts, *table_lines(header, rows)]


def told_value(value: float, half_width: float, name: str) -> str:
    """A mean with its half-width, as far as there are any; `name` is a key of `COMPARED`."""
    return told_number(value, ".4f" if name.startswith("phi") else ".2f", half_width)


def told_change(change: float, half_width: float) -> str:
    """A change with its half-width, both in per cent, as far as there are any."""
    return told_number(change, "+.1f", half_width)
