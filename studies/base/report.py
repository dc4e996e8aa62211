"""What the analysis of a study gives to whoever asked for it: a table to read, sentences, tables, and the files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Generic, TypeVar

import pandas as pd

from studies.framework.runs import MissingRun

Judgement = TypeVar("Judgement")
"""What a study says in the end: a finding of a paper with its verdict, an answer, an advice."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Report(Generic[Judgement]):
    """Results of a study.

    Attributes:
        header: Names of the columns of the table for a person to read, with units.
        rows: Of that table.
        told: Sentences below it, the judgements among them.
        tables: Everything that was tabulated, by name; `runs` has one row per finished run, or several.
        judged: What is judged by them; empty where a study judges nothing.
        missing: Runs that were given and are not in the tables.
        footer: What every figure and table says about its origin, one statement each.
        files: Everything that was written, by name.
        output: The folder that it was written to.
    """

    header: Sequence[str]
    rows: Sequence[Sequence[object]] = field(repr=False)
    told: tuple[str, ...]
    tables: Mapping[str, pd.DataFrame] = field(repr=False)
    judged: tuple[Judgement, ...]
    missing: tuple[MissingRun, ...]
    footer: tuple[str, ...] = field(repr=False)
    files: Mapping[str, Path] = field(repr=False)
    output: Path
