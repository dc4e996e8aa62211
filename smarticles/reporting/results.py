"""What stands on a page of the results of a study: its findings, figures, tables, and where they come from."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dem.errors import InputError
from smarticles.reporting.charts import embedded
from smarticles.reporting.page import Block, Figure, Page, Section, Table, Words
from smarticles.reporting.tables import word

PROVENANCE = "provenance.json"
"""The file by which results of a study are known."""

# What is judged, and what is compared with somebody's data; other tables are folded.
_JUDGED = {"findings": "The paper's findings, one by one", "verdicts": "What was asked, and the answers"}
_COMPARED = {"deviations": "Ours beside Gravish's points"}
_PICTURES = (".svg", ".png")


@dataclass(frozen=True, kw_only=True, eq=False)
class Results:
    """A folder of results.

    Attributes:
        folder: the folder.
        origin: content of its provenance.
        tables: header and rows by name, without the lines below that tell their origin.
    """

    folder: Path
    origin: Mapping[str, Any]
    tables: Mapping[str, tuple[Sequence[str], Sequence[Sequence[str]]]]

    def sections(self) -> list[Section]:
        """All that it tells, in order."""
        return [
            Section(title="Findings", blocks=self._named(_JUDGED)),
            Section(title="Comparison", blocks=[*self._named(_COMPARED), *self._reference()]),
            Section(title="Figures", blocks=self._figures()),
            Section(title="Tables", blocks=self._others()),
        ]

    def origin_blocks(self) -> list[Block]:
        """Where its numbers come from."""
        lines = [str(line) for line in self.origin.get("footer", [])]
        runs = self.origin.get("runs", [])
        header = ["name", "seed", "engine", "fidelity", "scene_sha256", "command"]
        rows = [[word(run.get(name)) for name in header] for run in runs if isinstance(run, dict)]
        blocks: list[Block] = [Words(lines=lines)]
        if rows:
            blocks.append(Table(caption=f"The {len(rows)} runs used", header=header, rows=rows, folded=True))
        return blocks

    def _named(self, captions: Mapping[str, str]) -> list[Block]:
        return [
            Table(caption=caption, header=self.tables[name][0], rows=self.tables[name][1])
            for name, caption in captions.items()
            if name in self.tables
        ]

    def _reference(self) -> list[Block]:
        told = [str(line) for line in self.origin.get("footer", []) if str(line).startswith(("Reference:", "Note:"))]
        return [Words(lines=told)] if told else []

    def _figures(self) -> list[Block]:
        stems = {path.stem for path in self.folder.iterdir() if path.suffix in _PICTURES}
        files = [next(f for s in _PICTURES if (f := self.folder / f"{stem}{s}").is_file()) for stem in sorted(stems)]
        study = self.origin.get("study", "?")
        return [
            Figure(
                caption=f"{file.name}",
                alt=f"Figure “{file.stem.replace('_', ' ')}” of the study {study}; its numbers are in the tables below",
                light=embedded(file),
                wide=True,
            )
            for file in files
        ]

    def _others(self) -> list[Block]:
        return [
            Table(caption=f"{name}.csv, {len(rows)} rows", header=header, rows=rows, folded=True)
            for name, (header, rows) in self.tables.items()
            if name not in (*_JUDGED, *_COMPARED) and rows
        ]


def read_results(folder: Path) -> Results:
    """The results of a study.

    Raises:
        InputError: the folder holds none, or they are damaged.
    """
    try:
        origin = json.loads((folder / PROVENANCE).read_text(encoding="utf-8"))
        if not isinstance(origin, dict):
            raise TypeError(type(origin).__name__)
    except (OSError, ValueError, TypeError) as error:
        msg = f"{folder / PROVENANCE}: cannot be read ({error}); analyse the study again, smarticles study … --analyse"
        raise InputError(msg) from None
    tables = {file.stem: _table(file) for file in sorted(folder.glob("*.csv"))}
    return Results(folder=folder, origin=origin, tables={name: table for name, table in tables.items() if table[0]})


def results_page(folder: Path, made: str) -> Page:
    """The page of a folder of results alone, without its runs."""
    found = read_results(folder)
    study = str(found.origin.get("study", folder.name))
    runs, missing = (found.origin.get(name, []) for name in ("runs", "missing"))
    return Page(
        title=f"{study}: results",
        about="results of a study",
        lead=[("study", study), ("runs used", str(len(runs))), ("missing", str(len(missing)))],
        sections=(*found.sections(), Section(title="How to repeat it", blocks=found.origin_blocks())),
        footer=f"Made by {made} from {folder.name}.",
    )


def _table(file: Path) -> tuple[list[str], list[list[str]]]:
    """Header and rows of a table; the lines with # at its end tell its origin."""
    lines = file.read_text(encoding="utf-8", errors="replace").splitlines(keepends=True)
    while lines and lines[-1].startswith("#"):
        lines.pop()
    rows = list(csv.reader(lines))
    if not rows:
        return [], []
    header = rows[0]
    return header, [[cell or "-" for cell in row] + ["-"] * (len(header) - len(row)) for row in rows[1:] if row]
