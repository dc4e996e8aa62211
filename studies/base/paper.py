"""Studies that judge the findings of a paper, one by one, by their own runs."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence

import pandas as pd

from postprocess.report.markdown import findings_lines, meaning_lines, table_lines
from postprocess.statistics.findings import CRITERION, Finding, findings_table
from postprocess.statistics.points import ToldTable, told_means
from studies.base.study import Analysis, Study, Tables
from studies.framework.engines import engine_lines, told_by_engine
from studies.framework.provenance import SAVOIE, Reference


class PaperStudy(Study[Finding]):
    """A study of a paper's findings: it writes `findings.csv`, and `findings.md` with the means over seeds.

    Attributes:
        title: Of the text.
        paper: What the findings are of.
        remarks: Paragraphs of the text below the findings.
        heading: Of the part of the text that has the table.
        means: What the numbers of the table are, for text and terminal.
        about_table: Lines of the text above the table.
        described: File whose columns the text describes.
        quantities: Those columns, and what they are.
        named: What tells a row of the table from others, see `points.told_means`.
        shown: Header and format of each quantity of the table.
    """

    text_name = "findings.md"
    title: str
    paper: Reference = SAVOIE
    remarks: Sequence[str] = ()
    heading = "Points"
    means = "Means over seeds ± standard error."
    described = "points.csv"
    quantities: Mapping[str, str]
    named: Mapping[str, Callable[[pd.Series], str]]
    shown: Mapping[str, tuple[str, str]]

    def reference_of(self, tables: Tables) -> Reference:
        """The paper."""
        return self.paper

    @abstractmethod
    def judge(self, tables: Tables) -> tuple[Finding, ...]:
        """The paper's findings; one that needs runs which are missing has no data."""

    def judged_tables(self, judged: tuple[Finding, ...]) -> Tables:
        """`findings.csv`."""
        return {"findings": findings_table(judged)}

    def statements(self, analysis: Analysis[Finding]) -> tuple[str, ...]:
        """What a study states of its runs, and how verdicts come about."""
        return (*self.about_runs(analysis), f"{CRITERION}.")

    @abstractmethod
    def about_runs(self, analysis: Analysis[Finding]) -> tuple[str, ...]:
        """Statements for footers, see `Study.statements`, but for how verdicts come about."""

    def table(self, analysis: Analysis[Finding]) -> ToldTable:
        """Means over seeds with their standard errors, engine by engine where there are several."""
        points = analysis.tables["points"]
        return told_means(points, told_by_engine(points, self.named), self.shown)

    def told(self, analysis: Analysis[Finding]) -> Sequence[str]:
        """What the numbers are, and every finding with its verdict."""
        found = (f"{one.verdict.upper()}: {one.paper}\n    {one.ours}" for one in analysis.judged)
        return [self.about_numbers, "", *found]

    @property
    def about_numbers(self) -> str:
        """What the numbers of the table for the terminal are."""
        return self.means

    def text(self, analysis: Analysis[Finding]) -> Sequence[str]:
        """Findings, the table, and what columns mean."""
        return [
            f"# {self.title}",
            "",
            *findings_lines(analysis.judged),
            *(line for remark in self.remarks for line in ("", remark)),
            "",
            f"## {self.heading}",
            "",
            *self.about_table,
            "",
            *table_lines(*self.text_table(analysis)),
            *self.below_table(analysis),
            *meaning_lines(self.described, self.quantities),
        ]

    @property
    def about_table(self) -> Sequence[str]:
        """Lines of the text above the table."""
        return [self.means]

    def text_table(self, analysis: Analysis[Finding]) -> ToldTable:
        """The table of the text; that of the terminal unless a study says otherwise."""
        return self.table(analysis)

    def below_table(self, analysis: Analysis[Finding]) -> Sequence[str]:
        """Further lines of the text, below the table: the engines compared, if there are several."""
        return engine_lines(
            analysis.tables.get("engines"), {name: told for name, told in self.named.items() if name != "seeds"}
        )
