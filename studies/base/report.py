"""What the analysis of a study gives to whoever asked for it: a table to read, sentences, and the files written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from postprocess.statistics.findings import Finding


@dataclass(frozen=True, kw_only=True, eq=False)
class StudyReport:
    """Results of a study for a person to read.

    Attributes:
        header: Names of the columns, with units.
        rows: Of the table.
        findings: The paper's findings, judged.
        told: Further sentences, such as what the numbers are.
        files: Everything that was written, by name.
    """

    header: Sequence[str]
    rows: Sequence[Sequence[object]] = field(repr=False)
    findings: tuple[Finding, ...] = ()
    told: tuple[str, ...] = ()
    files: Mapping[str, Path] = field(repr=False)
