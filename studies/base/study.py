"""What every study is: a class with a few answers, and one recipe from run directories to tables and figures."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Generic

import pandas as pd

from dem.record.manifest import RunManifest
from studies.base.report import Judgement, Report
from studies.framework.provenance import Origin, Reference, make_folder
from studies.framework.runs import Collected, MeasuredRun, collect_runs

Tables = Mapping[str, pd.DataFrame]
"""Tables by name, which is that of their file without suffix; `runs` is always among them."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Analysis(Generic[Judgement]):
    """What a study makes of its runs, before anything of it is told, drawn or written.

    Attributes:
        found: The runs.
        tables: See `Study.tabulate`.
        judged: See `Study.judge`.
    """

    found: Collected
    tables: Tables
    judged: tuple[Judgement, ...]


class Study(ABC, Generic[Judgement]):
    """A study: what is measured of each of its runs, and what is made of all of them together.

    `analyse` is the recipe, the same for all. What a study answers for itself are the methods that it calls, in this
    order: `measure`, `refuse`, `tabulate`, `judge`, `reference_of`, `statements`, `text`, `about_points`, `draw`,
    `table`, `told`.

    Attributes:
        name: Of the study.
        text_name: Name of the Markdown file that tells everything.
        one_fidelity: Whether all runs must have the same.
        one_engine: Whether all runs must be of the same engine; where not, the table of runs tells which.
        told_by_tables: Whether what it says of a run is all in its table of runs, so that those of an earlier
            analysis will do.
    """

    name: str
    text_name: str
    one_fidelity: bool = True
    one_engine: bool = True
    told_by_tables: bool = False

    def analyse(
        self,
        run_dirs: Sequence[Path | str],
        output: Path | str,
        *,
        note: str,
        command: str,
        earlier: Mapping[str, MeasuredRun] | None = None,
    ) -> Report[Judgement]:
        """Measures the runs of the study and writes its tables, text, provenance and figures.

        Runs that are not done, or cannot be read, are listed as missing. Files of an earlier analysis in the same
        folder are replaced.

        Args:
            run_dirs: Run directories; any subset of the study.
            output: Folder for the results; made if needed.
            note: How these runs differ from the full study, if all of them were there; stands in every footer.
            command: Command line to state as the origin.
            earlier: Runs measured by an earlier analysis, see `base.earlier`, that stand for directories which are
                not there.

        Returns:
            The report.

        Raises:
            InputError: No run is done, the runs must not be averaged or compared, see `refuse`, or the output is no
                folder.
            RunError: This machine lacks the libraries to draw without a display.
        """
        output = make_folder(output)
        found = collect_runs(self.name, run_dirs, self.measure, earlier=earlier)
        if self.one_fidelity:
            found.refuse_mixture("fidelity", lambda run: run.manifest.fidelity)
        if self.one_engine:
            found.refuse_mixture("engine", lambda run: run.manifest.engine)
        self.refuse(found)
        tables = self.tabulate(found)
        judged = self.judge(tables)
        analysis = Analysis(found=found, tables=tables, judged=judged)
        origin = Origin(
            study=self.name,
            manifests=found.manifests,
            missing=found.missing,
            note=note,
            command=command,
            reference=self.reference_of(tables),
        )
        footer = origin.footer(*self.statements(analysis))
        files = origin.write(
            output,
            footer,
            tables={**tables, **self.judged_tables(judged)},
            text=(self.text_name, self.text(analysis)),
        )
        drawn = self.draw(output, analysis, origin.below_figures(self.about_points(analysis), self.text_name))
        header, rows = self.table(analysis)
        return Report(
            header=header,
            rows=rows,
            told=tuple(self.told(analysis)),
            tables=tables,
            judged=judged,
            missing=found.missing,
            footer=footer,
            files=MappingProxyType({**files, **{path.name: path for path in drawn}}),
            output=output,
        )

    @abstractmethod
    def measure(self, run: RunManifest) -> MeasuredRun:
        """What is measured of one finished run.

        Raises:
            InputError: It is no run of this study, or cannot be read; it is listed as missing.
        """

    @abstractmethod
    def refuse(self, found: Collected) -> None:
        """Refuses runs that must not be averaged or compared with each other.

        Raises:
            InputError: There are such.
        """

    @abstractmethod
    def tabulate(self, found: Collected) -> Tables:
        """All tables: that of the runs, means over seeds, and whatever follows from them."""

    def judge(self, tables: Tables) -> tuple[Judgement, ...]:
        """What is judged by the tables; nothing unless a study says so."""
        return ()

    def judged_tables(self, judged: tuple[Judgement, ...]) -> Tables:
        """The judgements as tables to write, if any."""
        return {}

    @abstractmethod
    def reference_of(self, tables: Tables) -> Reference:
        """What the runs are compared with."""

    @abstractmethod
    def statements(self, analysis: Analysis[Judgement]) -> tuple[str, ...]:
        """Statements for footers: which runs there are, see `Origin.footer`, then what else is to be known."""

    @abstractmethod
    def text(self, analysis: Analysis[Judgement]) -> Sequence[str]:
        """Lines of the Markdown file; missing runs and footer are put below."""

    @abstractmethod
    def about_points(self, analysis: Analysis[Judgement]) -> str:
        """Seeds of the points of figures and how else they come about: a sentence, see `Origin.below_figures`."""

    @abstractmethod
    def draw(self, output: Path, analysis: Analysis[Judgement], footer: Sequence[str]) -> Sequence[Path]:
        """Draws all figures into a folder; gives the files."""

    @abstractmethod
    def table(self, analysis: Analysis[Judgement]) -> tuple[Sequence[str], Sequence[Sequence[object]]]:
        """Header and rows of the table for the terminal."""

    @abstractmethod
    def told(self, analysis: Analysis[Judgement]) -> Sequence[str]:
        """Lines below that table."""
