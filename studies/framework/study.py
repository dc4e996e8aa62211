"""A study: what is measured of a run, what the columns are, what is judged, and the recipe from runs to results."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import pandas as pd

from dem.errors import InputError
from dem.record.run import Run
from postprocess.report import figures as style
from postprocess.report.tables import meaning_lines, table_lines
from postprocess.statistics.points import ASPECT, SEED, SEEDS, marked, seeds_of
from postprocess.statistics.seeds import mean_over_seeds
from studies.framework.engines import (
    by_engine,
    compared_engines,
    engine_lines,
    engines_of,
    judging,
    told_by_engine,
    told_engines,
)
from studies.framework.figures import Analysis, Figure
from studies.framework.findings import CRITERION, Finding, Judged, findings_table
from studies.framework.procedures import ACTIVE, PROCEDURE, STATIC
from studies.framework.provenance import SAVOIE, Origin, Reference, make_folder
from studies.framework.quantities import Key, Quantity, cells_of, short_table, sort_rows
from studies.framework.runs import (
    Collected,
    MeasuredRun,
    MissingRun,
    Row,
    collect_runs,
    runs_table,
    told_bars,
    told_range,
    told_seeds,
)

COUNT = "smarticles [-]"
TEXT = "findings.md"


@dataclass(frozen=True, kw_only=True)
class Report:
    """Results of a study.

    Attributes:
        header: Columns of the table for a person to read.
        rows: Of that table.
        told: Lines below it: what the numbers are, and every finding with its verdict.
        tables: All tables by name, `runs`, `points` and `findings` among them.
        judged: The findings.
        missing: Runs that were given and are not in the tables.
        footer: Origin of the results, one statement each.
        files: Everything that was written, by name.
        output: Folder of the files.
    """

    header: Sequence[str]
    rows: Sequence[Sequence[str]] = field(repr=False)
    told: Sequence[str]
    tables: Mapping[str, pd.DataFrame] = field(repr=False)
    judged: Sequence[Judged]
    missing: Sequence[MissingRun]
    footer: Sequence[str] = field(repr=False)
    files: Mapping[str, Path] = field(repr=False)
    output: Path


@dataclass(frozen=True, kw_only=True)
class Study:
    """A study.

    Attributes:
        name: For the command line, and in provenance.
        title: Of its text.
        measure: Measures one finished run: its row of the table of runs, several rows, or a `MeasuredRun` with a
            history. An InputError lists the run as missing.
        keys: Columns that name a point: one combination of the sweep's variables.
        quantities: Columns that are averaged over seeds.
        findings: What is judged, in the paper's order.
        figures: What is drawn.
        samples: Makes the table that is averaged and judged from the table of runs of one engine.
        extra: Makes further tables by name from the table of runs; one called `points` replaces the means over seeds.
        shown: Selects the points of the short table.
        same_count: Columns within which all runs must have the same number of smarticles.
        same_fidelity: Columns within which all runs must have the same fidelity.
        order: Columns that the table of runs is sorted by; none: as given.
        constant: Columns that must be equal within groups, with the columns that make the groups.
        bounds: Column that is above 0 where a run's quantities are lower bounds, with the word for such runs.
        count_values: Whether the points say how many seeds have a value of each quantity.
        one_engine: Whether runs of several engines are rejected.
        from_tables: Whether the table of runs is enough for everything but figures of histories, so that runs of an
            earlier analysis need not be there.
        remarks: Paragraphs for the text and statements of footers: definitions, and what to beware of.
        reference: What the runs are compared with.
        pictured: Values of the run that a picture is drawn of.
    """

    name: str
    title: str
    measure: Callable[[Run], Row | Sequence[Row] | MeasuredRun]
    keys: Sequence[Key]
    quantities: Sequence[Quantity]
    findings: Sequence[Finding]
    figures: Sequence[Figure] = ()
    samples: Callable[[pd.DataFrame], pd.DataFrame] = lambda runs: runs
    extra: Callable[[pd.DataFrame], Mapping[str, pd.DataFrame]] = lambda _: {}
    shown: Callable[[pd.DataFrame], pd.DataFrame] = lambda points: points
    same_count: Sequence[str] = (ASPECT,)
    same_fidelity: Sequence[str] = ()
    order: Sequence[str]
    constant: Mapping[str, Sequence[str]] = field(default_factory=dict)
    bounds: tuple[str, str] | None = None
    count_values: bool = False
    one_engine: bool = False
    from_tables: bool = False
    remarks: Sequence[str] = ()
    reference: Reference = SAVOIE
    pictured: Mapping[str, object] = field(default_factory=dict)

    def analyse(
        self,
        run_dirs: Sequence[Path | str],
        output: Path | str,
        *,
        note: str,
        command: str,
        earlier: Mapping[str, MeasuredRun] | None = None,
    ) -> Report:
        """Measure runs, and write tables, text, provenance and figures; earlier files are replaced.

        Args:
            run_dirs: Run directories; runs that are not done, or cannot be read, are listed as missing.
            output: Folder for the results; made if needed.
            note: How these runs differ from the full study.
            command: Command line.
            earlier: Runs of an earlier analysis by name, for directories that are not there.

        Raises:
            InputError: No run is done, runs must not be averaged or compared, or the output is no folder.
        """
        output = make_folder(output)
        found = collect_runs(self.name, run_dirs, self.measured, earlier=earlier)
        self.reject_unlike(found)
        tables = self.tabulate(runs_table(found), found.times())
        judged = self.judge(tables)
        tables["findings"] = findings_table(judged)
        manifests, missing = found.manifests, found.missing
        origin = Origin(
            study=self.name, manifests=manifests, missing=missing, note=note, command=command, reference=self.reference
        )
        footer = origin.footer(*self.statements(tables))
        header, rows = self.table(tables)
        lines = self.text(tables, judged, table_lines(header, rows))
        files = dict(origin.write(output, footer, tables=tables, text=(TEXT, lines)))
        below = origin.below_figures(f"{self._seeds(tables)}.", TEXT)
        analysis = Analysis(tables=tables, manifests={run.path.name: run for run in manifests}, footer=below)
        files |= {path.name: path for path in self.draw(output, analysis)}
        return Report(
            header=header,
            rows=rows,
            told=[
                "Means over seeds ± standard error.",
                "",
                *(f"{one.verdict.upper()}: {one.finding.says}\n    {one.ours}" for one in judged),
            ],
            tables=tables,
            judged=judged,
            missing=missing,
            footer=footer,
            files=files,
            output=output,
        )

    def measured(self, run: Run) -> MeasuredRun:
        """Measure one finished run."""
        measured = self.measure(run)
        if isinstance(measured, MeasuredRun):
            return measured
        return MeasuredRun(run=run, rows=[measured] if isinstance(measured, Mapping) else measured)

    def reject_unlike(self, found: Collected) -> None:
        """Reject runs that must not be averaged or compared.

        Raises:
            InputError: Fidelities, counts or constants differ, or a point has the same seed twice.
        """
        found.refuse_mixture(
            "fidelity", lambda run: run.run.manifest.fidelity, within=partial(_values, columns=self.same_fidelity)
        )
        if self.one_engine:
            found.refuse_mixture("engine", lambda run: run.run.manifest.engine)
        found.refuse_mixture(
            "count",
            lambda run: f"{run.run.manifest.count} smarticles",
            within=partial(_values, columns=self.same_count),
        )
        for column, within in self.constant.items():
            found.refuse_mixture(column, partial(_value, column=column), within=partial(_values, columns=within))
        found.refuse_repeats("point", self.point_of)

    def point_of(self, run: MeasuredRun) -> str:
        """Name the point of a run, such as `procedure internal, θ 10°, l/w 0.7`."""
        cells = ((key.label, key.text(run.row[key.column])) for key in self.keys if key.column in run.row)
        return ", ".join(f"{label} {cell}" for label, cell in cells if cell)

    def tabulate(self, runs: pd.DataFrame, times: pd.DataFrame | None = None) -> dict[str, pd.DataFrame]:
        """Make all tables of the table of runs: `runs`, `points`, `engines` if there are several, and extra ones."""
        runs = sort_rows(runs, self.order, self.keys) if self.order else runs
        extra = self.extra(runs)
        tables = {"runs": runs}
        if "points" not in extra:
            tables["points"] = by_engine(runs, lambda part: self.points(self.samples(part)))
            if engines_of(runs):
                columns = [quantity.column for quantity in self.quantities]
                samples = by_engine(runs, self.samples)
                tables["engines"] = compared_engines(samples, [key.column for key in self.keys], columns)
        if times is not None:
            tables["times"] = times
        return tables | dict(extra)

    def points(self, samples: pd.DataFrame) -> pd.DataFrame:
        """Average over seeds: `… SE` is the standard error, `… 95 %` the half-width of the confidence interval."""
        columns = [key.column for key in self.keys]
        rows = []
        for values, group in samples.groupby(columns, sort=True, dropna=False):
            row: dict[str, object] = {**dict(zip(columns, values, strict=True)), **seeds_of(group)}
            for name in (quantity.column for quantity in self.quantities):
                mean = mean_over_seeds(group[name])
                row |= {
                    name: mean.value,
                    marked(name, "SE"): mean.standard_error,
                    marked(name, "95 %"): mean.half_width,
                }
                if self.count_values:
                    row[f"{name.rpartition(' [')[0]} seeds [-]"] = mean.count
            rows.append(row)
        return sort_rows(pd.DataFrame(rows), columns, self.keys)

    def judge(self, tables: Mapping[str, pd.DataFrame]) -> tuple[Judged, ...]:
        """Judge all findings, by the samples of the engine that judges or by the tables."""
        samples = self.samples(judging(tables["runs"]))
        return tuple(finding.judge(samples, tables) for finding in self.findings)

    def table(self, tables: Mapping[str, pd.DataFrame]) -> tuple[list[str], list[list[str]]]:
        """Header and rows of the short table of points."""
        points = self.shown(tables["points"])
        named = {
            **cells_of([key for key in self.keys if key.column in points]),
            "seeds": lambda point: str(point[SEEDS]),
        }
        return short_table(points, told_by_engine(points, named), self.quantities)

    def draw(self, output: Path, analysis: Analysis) -> list[Path]:
        """Draw all figures into a folder."""
        with style.style():
            return [path for figure in self.figures for path in figure.draw(output / figure.name, analysis)]

    def text(self, tables: Mapping[str, pd.DataFrame], judged: Sequence[Judged], table: Sequence[str]) -> list[str]:
        """Lines of the Markdown file."""
        findings = [
            [
                one.finding.says,
                one.ours,
                "; ".join(filter(None, [f"**{one.verdict}**", one.needed])),
                one.finding.found_if,
            ]
            for one in judged
        ]
        return [
            f"# {self.title}",
            "",
            *table_lines(["finding", "ours (± standard error)", "verdict", "found if"], findings),
            *(line for remark in self.remarks for line in ("", remark)),
            "",
            "## Points",
            "",
            "Means over seeds ± standard error.",
            "",
            *table,
            *engine_lines(tables.get("engines"), cells_of(self.keys)),
            *meaning_lines("points.csv", {quantity.column: quantity.meaning for quantity in self.quantities}),
        ]

    def statements(self, tables: Mapping[str, pd.DataFrame]) -> list[str]:
        """State which runs there are, and what numbers and verdicts are, for footers."""
        every = tables["runs"]
        runs, counts = judging(every), judging(tables["points"])[SEEDS]
        parts = []
        for key in (key for key in self.keys if key.column in runs):
            values = [key.text(value) for value in runs[key.column].drop_duplicates().sort_values()]
            parts.append(f"{key.label} {' '.join(filter(None, values))}")
        counts_by = runs.groupby(ASPECT)[COUNT].first() if ASPECT in runs else runs[COUNT]
        parts += [f"{told_range(counts_by)} smarticles", self._seeds(tables)]
        statement = ", ".join(parts)
        if {PROCEDURE, ACTIVE} <= set(runs):
            times = runs[runs[PROCEDURE] != STATIC].groupby(PROCEDURE)[ACTIVE].first()
            statement += "; active for: " + ", ".join(f"{name} {time:.3g} s" for name, time in times.items())
        bars = told_bars(counts, "point")
        compared = [told_engines(every)] if "engines" in tables else []
        return [f"{statement}.", *filter(None, compared), *self.remarks, f"{bars}.", f"{CRITERION}."]

    def _seeds(self, tables: Mapping[str, pd.DataFrame]) -> str:
        runs, counts = judging(tables["runs"]), judging(tables["points"])[SEEDS]
        bounded = ""
        if self.bounds is not None:
            column, word = self.bounds
            bounded = f"; {word}: {int((runs[column] > 0).sum())} of {len(runs)} runs, whose numbers are lower bounds"
        return f"{told_seeds(runs, counts, 'point')}{bounded}"


def _value(run: MeasuredRun, *, column: str) -> str:
    value = run.row[column]
    return value if isinstance(value, str) else f"{value:.3g}"


def _values(run: MeasuredRun, *, columns: Sequence[str]) -> tuple[object, ...]:
    return tuple(run.row[name] for name in columns)


def read_runs(results: Path, name: str = "runs.csv") -> pd.DataFrame:
    """Read a table of runs as a study wrote it.

    Raises:
        InputError: There is none.
    """
    try:
        return pd.read_csv(results / name, comment="#", dtype={"run": str, "scene_sha256": str, SEED: int})
    except (OSError, ValueError) as error:
        msg = f"cannot read {results / name}: {error}; give the results folder of a study"
        raise InputError(msg) from None
