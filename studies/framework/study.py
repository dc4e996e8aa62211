"""A study and its analysis: runs are measured and averaged, findings judged, and figures drawn."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

from dem.display import Steps, silent
from dem.errors import InputError
from dem.record.run import Run
from postprocess.report import figures as style
from postprocess.report.tables import meaning_lines, table_lines
from postprocess.statistics.points import ASPECT, SEED, SEEDS, averaged, seeds_of
from studies.framework.figures import BARS, Analysis, Figure
from studies.framework.findings import CRITERION, Finding, Judged, findings_table
from studies.framework.provenance import SAVOIE, TEXT, Origin, Reference, make_folder
from studies.framework.runs import (
    ENGINE,
    ENGINE_NAMES,
    Collected,
    Key,
    MeasuredRun,
    MissingRun,
    Quantity,
    Row,
    by_engine,
    collect_runs,
    compared_engines,
    engines_of,
    judging,
    sort_rows,
)

COUNT = "smarticles [-]"
_MEANS = "Means over seeds ± standard error."


@dataclass(frozen=True, kw_only=True)
class Report:
    """Results of an analysis: tables, findings with their verdicts, and the files that were written."""

    header: Sequence[str]  #: Header of the short table of points
    rows: Sequence[Sequence[str]] = field(repr=False)  #: Rows of the short table of points
    lines: Sequence[str]  #: Text for the terminal after the short table: every finding with its verdict
    tables: Mapping[str, pd.DataFrame] = field(repr=False)  #: All tables by name, such as `runs` and `points`
    judged: Sequence[Judged]  #: Findings with their verdicts
    missing: Sequence[MissingRun]  #: Runs that are not in the tables
    footer: Sequence[str] = field(repr=False)  #: Statements about the origin of the results
    files: Mapping[str, Path] = field(repr=False)  #: Paths of all files written, by file name
    output: Path  #: Folder with the files


@dataclass(frozen=True, kw_only=True)
class Study:
    """A study: how to measure a run, which columns to average, and its findings and figures."""

    name: str  #: Name of the study on the command line and in the provenance
    title: str  #: Heading of the text
    #: Measures one finished run and returns its row or rows of the table of runs, or a `MeasuredRun` with a history.
    #: If it raises InputError, the run is listed as missing
    measure: Callable[[Run], Row | Sequence[Row] | MeasuredRun]
    keys: Sequence[Key]  #: Columns that name a point: one combination of the sweep's variables
    quantities: Sequence[Quantity]  #: Columns that are averaged over seeds
    findings: Sequence[Finding]  #: Findings, in the order of the paper
    figures: Sequence[Figure] = ()
    #: Makes the samples, the table that is averaged and judged, from the table of runs of one engine
    samples: Callable[[pd.DataFrame], pd.DataFrame] = lambda runs: runs
    #: Makes further tables by name from the table of runs; one called `points` replaces the means over seeds
    extra: Callable[[pd.DataFrame], Mapping[str, pd.DataFrame]] = lambda _: {}
    shown: Callable[[pd.DataFrame], pd.DataFrame] = lambda points: points  #: Selects the points of the short table
    same_count: Sequence[str] = (ASPECT,)  #: Runs that agree in these columns must have equal numbers of smarticles
    same_fidelity: Sequence[str] = ()  #: Runs that agree in these columns must have one fidelity
    order: Sequence[str]  #: Columns that the table of runs is sorted by; empty: in the order of the runs given
    #: Columns (keys) that must be equal in all runs that agree in the columns of the value
    constant: Mapping[str, Sequence[str]] = field(default_factory=dict)
    #: Column that is above 0 for a run whose quantities are lower bounds, and the word for such runs in texts
    bounds: tuple[str, str] | None = None
    count_values: bool = False  #: Whether points have, for each quantity, the number of seeds that gave a value
    one_engine: bool = False  #: Whether runs of several engines are rejected
    #: Whether everything but histories follows from the table of runs, so that `--earlier` can replace runs by their
    #: rows of a published table
    from_tables: bool = False
    remarks: Sequence[str] = ()  #: Definitions and warnings, for the text and the footers
    reference: Reference = SAVOIE  #: Published numbers or statements that the runs are compared with
    #: Values of variables of the sweep; a picture is drawn of the first run that has them
    pictured: Mapping[str, object] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Raise InputError if a figure has a series or a panel per value of a column that is no key."""
        keys = [key.column for key in self.keys]
        for figure in self.figures:
            if getattr(figure, "table", "points") == "points":
                split = getattr(getattr(figure, "split", None), "column", "")
                for column in filter(None, (split, getattr(figure, "panels", ""))):
                    if column not in keys:
                        raise InputError(
                            f"study {self.name}: figure {figure.name} is split by the column {column!r}, which is no "
                            f"key; keys: {', '.join(keys)}; split by one of these, or add Key(column={column!r}, …)"
                        )

    def analyse(
        self,
        run_dirs: Sequence[Path | str],
        output: Path | str,
        *,
        note: str,
        full: str = "",
        command: str,
        earlier: Mapping[str, MeasuredRun] | None = None,
        progress: Steps = silent,
    ) -> Report:
        """Measure runs, and write tables, text, provenance and figures into a folder.

        Existing files are replaced. A footer is the text below a table or figure on the origin of its results.
        InputError if no run is done, `reject_unlike` rejects the runs, or the folder cannot be made.

        Args:
            note: how the runs differ from the full study, for footers.
            full: what the full study found, for footers; empty if these runs are the full study.
            earlier: runs of an earlier analysis by name, which replace directories that do not exist.
            progress: function that is called before each run is measured.
        """
        output = make_folder(output)
        found = collect_runs(self.name, run_dirs, self.measured, earlier=earlier, progress=progress)
        self.reject_unlike(found)
        tables = self.tabulate(found.table(), found.times())
        judged = self.judge(tables)
        tables["findings"] = findings_table(judged)
        origin = Origin(found=found, note=note, full=full, command=command, reference=self.reference)
        footer = origin.footer(*self.statements(tables))
        header, rows = self.table(tables)
        lines = self.text(judged, table_lines(header, rows))
        files = origin.write(output, footer, tables=tables, text=(TEXT, lines))
        measured = {run.run.path.name: run.run for run in found.runs}
        short = origin.figure_footer(f"{self._seeds(tables)}.")
        analysis = Analysis(tables=tables, runs=measured, footer=short)
        files |= {path.name: path for path in self.draw(output, analysis)}
        verdicts = [f"{one.verdict.upper()}: {one.finding.says}\n    {one.ours}" for one in judged]
        return Report(
            header=header,
            rows=rows,
            lines=[_MEANS, "", *verdicts],
            tables=tables,
            judged=judged,
            missing=found.missing,
            footer=footer,
            files=files,
            output=output,
        )

    def measured(self, run: Run) -> MeasuredRun:
        """Measure one finished run, and return it with its rows of the table of runs."""
        measured = self.measure(run)
        if isinstance(measured, MeasuredRun):
            return measured
        return MeasuredRun(run=run, rows=[measured] if isinstance(measured, Mapping) else measured)

    def reject_unlike(self, found: Collected) -> None:
        """Raise InputError if runs that would be averaged or compared are unlike, or a point has a seed twice.

        Runs are unlike if they differ in fidelity but agree in the columns `same_fidelity`, if they differ in the
        number of smarticles but agree in `same_count`, or if they differ in a column that is a key of `constant` but
        agree in the columns of its value. With `one_engine` they are unlike, too, if they differ in the engine.
        """

        def cells(columns: Sequence[str]) -> Callable[[MeasuredRun], tuple[object, ...]]:
            return lambda run: tuple(run.row[name] for name in columns)

        def text(column: str) -> Callable[[MeasuredRun], str]:
            return lambda run: value if isinstance(value := run.row[column], str) else f"{value:.3g}"

        found.reject_mixture("fidelity", lambda run: run.run.manifest.fidelity, within=cells(self.same_fidelity))
        if self.one_engine:
            found.reject_mixture("engine", lambda run: run.run.manifest.engine)
        counts = cells(self.same_count)
        found.reject_mixture("count", lambda run: f"{run.run.manifest.count} smarticles", within=counts)
        for column, within in self.constant.items():
            found.reject_mixture(column, text(column), within=cells(within))
        found.reject_repeats(self.point_of)

    def point_of(self, run: MeasuredRun) -> str:
        """Return the name of a run's point, such as `procedure internal, θ 10°, l/w 0.7`."""
        cells = ((key.label, key.text(run.row[key.column])) for key in self.keys if key.column in run.row)
        return ", ".join(f"{label} {cell}" for label, cell in cells if cell)

    def tabulate(self, runs: pd.DataFrame, times: pd.DataFrame | None = None) -> dict[str, pd.DataFrame]:
        """Return all tables by name, made from the table of runs and the table `times` of histories, if any.

        The tables are `runs`, `points` (means over seeds), `times` if given, and those of `extra`, which may replace
        `points`. If it does not, and runs are of several engines, the table `engines` compares these.
        """
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
        """Average samples over seeds, one row per point.

        For each quantity there are the mean, its standard error `… SE`, and `… 95 %`, half of its confidence interval.
        """
        columns = [key.column for key in self.keys]
        rows = []
        for values, group in samples.groupby(columns, sort=True, dropna=False):
            row: dict[str, object] = {**dict(zip(columns, values, strict=True)), **seeds_of(group)}
            for name in (quantity.column for quantity in self.quantities):
                row |= averaged(group, [name])
                if self.count_values:
                    row[f"{name.rpartition(' [')[0]} seeds [-]"] = int(group[name].count())
            rows.append(row)
        return sort_rows(pd.DataFrame(rows), columns, self.keys)

    def judge(self, tables: Mapping[str, pd.DataFrame]) -> tuple[Judged, ...]:
        """Judge all findings, and return them with their verdicts.

        A finding is judged by the samples, or by the `tables` that it names. If runs are of several engines, the
        samples are those of one engine, see `judging`.
        """
        samples = self.samples(judging(tables["runs"]))
        return tuple(finding.judge(samples, tables) for finding in self.findings)

    def table(self, tables: Mapping[str, pd.DataFrame]) -> tuple[list[str], list[list[str]]]:
        """Return header and rows of the short table of points as text: keys, seeds, labelled quantities.

        `tables` are those of `tabulate`; the function `shown` selects the points.
        """
        points = self.shown(tables["points"])
        keys = [Key(column=ENGINE, label="engine")] if engines_of(points) else []
        keys += [key for key in self.keys if key.column in points]
        shown = [quantity for quantity in self.quantities if quantity.label]
        rows = [
            [*(key.text(row[key.column]) for key in keys), str(row[SEEDS]), *(one.cell(row) for one in shown)]
            for _, row in points.iterrows()
        ]
        return [*(key.label for key in keys), "seeds", *(one.label for one in shown)], rows

    def draw(self, output: Path, analysis: Analysis) -> list[Path]:
        """Draw all figures into a folder and return the paths of the files."""
        with style.style():
            return [path for figure in self.figures for path in figure.draw(output / figure.name, analysis)]

    def text(self, judged: Sequence[Judged], table: Sequence[str]) -> list[str]:
        """Return the lines of the Markdown file: findings, remarks, and the short table of points.

        The argument `table` has the lines of the short table in Markdown.
        """
        findings = [
            [one.finding.says, one.ours, f"**{one.verdict}**{one.needed and f'; {one.needed}'}", one.criterion]
            for one in judged
        ]
        return [
            f"# {self.title}",
            "",
            *table_lines(["finding", "ours (± standard error)", "verdict", "found if"], findings),
            *(line for remark in self.remarks for line in ("", remark)),
            *("", "## Points", "", _MEANS, "", *table),
            *meaning_lines("points.csv", {quantity.column: quantity.meaning for quantity in self.quantities}),
        ]

    def statements(self, tables: Mapping[str, pd.DataFrame]) -> list[str]:
        """Return sentences on the origin of the results, which are printed below tables.

        They state points, seeds, engines, remarks, what error bars are, and the criterion of the verdicts.
        """
        every = tables["runs"]
        runs = judging(every)
        parts = []
        for key in (key for key in self.keys if key.column in runs):
            values = [key.text(value) for value in runs[key.column].drop_duplicates().sort_values()]
            parts.append(f"{key.label} {' '.join(filter(None, values))}")
        counts = runs.groupby(ASPECT)[COUNT].first() if ASPECT in runs else runs[COUNT]
        statement = ", ".join([*parts, f"{format_range(counts)} smarticles", self._seeds(tables)])
        statements = [f"{statement}."]
        if "engines" in tables:
            several = engines_of(every)
            each = ", ".join(f"{ENGINE_NAMES.get(name, name)} {(every[ENGINE] == name).sum()} runs" for name in several)
            judges = ENGINE_NAMES.get(several[0], several[0])
            statements.append(f"Engines: {each}, from the same poses where point and seed are equal; {judges} judges.")
        bars = BARS if judging(tables["points"])[SEEDS].max() > 1 else "One seed per point: no error bars"
        return [*statements, *self.remarks, f"{bars}.", f"{CRITERION}."]

    def _seeds(self, tables: Mapping[str, pd.DataFrame]) -> str:
        runs, counts = judging(tables["runs"]), judging(tables["points"])[SEEDS]
        seeds = f"seeds {format_numbers(runs[SEED])} ({format_range(counts)} per point)"
        if self.bounds is None:
            return seeds
        column, word = self.bounds
        return f"{seeds}; {word}: {(runs[column] > 0).sum()} of {len(runs)} runs, whose numbers are lower bounds"


def format_numbers(numbers: Iterable[int]) -> str:
    """Format numbers in ascending order; five or more consecutive numbers as `1 to 5`.

    Example:
        >>> format_numbers([1, 2, 3, 4, 5, 9])
        '1 to 5 9'
    """
    rows: list[list[int]] = []
    for number in sorted(set(numbers)):
        if rows and number == rows[-1][-1] + 1:
            rows[-1].append(number)
        else:
            rows.append([number])
    return " ".join(f"{row[0]} to {row[-1]}" if len(row) > 4 else " ".join(map(str, row)) for row in rows)


def format_range(counts: pd.Series) -> str:
    """Format the least and the greatest of some counts: `1 to 3`, or `3` if all are equal."""
    return str(counts.min()) if counts.nunique() == 1 else f"{counts.min()} to {counts.max()}"
