"""Where the numbers of a study come from: footers, provenance, and tables that carry both."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pandas as pd

from dem.errors import InputError
from dem.record.run import Run
from postprocess.measures.packing import DEFINITIONS
from postprocess.measures.table import LAST_FRAMES
from postprocess.report import figures
from postprocess.report.tables import table_lines
from studies.framework.runs import DEFINITION, MissingRun

CITATION = "Gravish et al., PRL 108, 208001 (2012), digitised"

DIGITISING_ERROR = 0.003
"""Taken as the error of each of Gravish's points [-]."""

SHAKE_TIME = 20.0
"""How long Gravish et al. shook [s]."""

REFERENCE = files("postprocess") / "reference" / "gravish2012_phi.csv"
"""Gravish's digitised points."""

COLUMNS: Mapping[str, str] = MappingProxyType(
    {"phi_0": "phi_initial", "phi_f": "phi_final", "phi_f relaxed": "phi_final"}
)
"""The column that each stage is compared with, see `shaken.STAGES`."""


@dataclass(frozen=True, kw_only=True)
class Reference:
    """What a study is compared with.

    Attributes:
        statement: Names it, for footers; without a full stop.
        facts: The same for `provenance.json`.
    """

    statement: str
    facts: Mapping[str, object]


GRAVISH = Reference(
    statement=f"{CITATION}; error of reading taken as ±{DIGITISING_ERROR:g}",
    facts=MappingProxyType(
        {
            "file": REFERENCE.name,
            "sha256": hashlib.sha256(REFERENCE.read_bytes()).hexdigest(),
            "digitising_error": DIGITISING_ERROR,
        }
    ),
)

SAVOIE = Reference(
    statement="statements in the text of Savoie et al., Soft Matter 2023, DOI 10.1039/d2sm01573k; no data of theirs",
    facts=MappingProxyType({"doi": "10.1039/d2sm01573k", "what": "statements in the text"}),
)


NOTHING = Reference(
    statement="none; nobody has published these numbers", facts=MappingProxyType({"what": "our own runs alone"})
)
"""Of a study that there is nothing to compare with."""

_SYMBOLS: Mapping[str, str] = MappingProxyType({"phi_0": "φ_0", "phi_f": "φ_f"})


def read_reference() -> pd.DataFrame:
    """Gravish's digitised points: columns `l_over_w`, `phi_initial`, `phi_final`.

    Returns:
        The table; NaN where there is no point.
    """
    with REFERENCE.open(encoding="utf-8") as file:
        return pd.read_csv(file)


def reference_at(reference: pd.DataFrame, aspect: float, stage: str) -> float:
    """Gravish's value at exactly this aspect ratio, or NaN.

    Args:
        reference: See `read_reference`.
        aspect: l/w [-].
        stage: Key of `COLUMNS`.
    """
    same = np.isclose(reference["l_over_w"], aspect, rtol=0, atol=1e-6)
    return float(reference.loc[same, COLUMNS[stage]].iloc[0]) if same.any() else math.nan


def told_reference(aspects: Sequence[float], stages: Iterable[str]) -> str:
    """What Gravish's points are, and which there are none of, for figures that show them.

    Args:
        aspects: The l/w of a figure [-].
        stages: Keys of `COLUMNS`.
    """
    reference = read_reference()
    lacking = {
        stage: [aspect for aspect in aspects if math.isnan(reference_at(reference, aspect, stage))] for stage in stages
    }
    gaps = told_gaps({_SYMBOLS[stage]: without for stage, without in lacking.items()})
    return f"{CITATION}, read to ±{DIGITISING_ERROR:g}; {gaps}."


def told_gaps(lacking: Mapping[str, Sequence[float]]) -> str:
    """`no φ_0 at l/w = 0.5, 0.8; no φ_f at l/w = 0.85`: which points were never digitised.

    Args:
        lacking: The l/w [-] of each quantity that has no point there.
    """
    known = {name: ", ".join(f"{aspect:g}" for aspect in without) for name, without in lacking.items()}
    return "; ".join(f"no {name} at l/w = {told}" for name, told in known.items() if told) or "at every l/w shown"


def make_folder(path: Path | str) -> Path:
    """A folder for results.

    Raises:
        InputError: It is a file, or cannot be made.
    """
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        msg = f"cannot write to {path}: {error.strerror}; choose another folder as output"
        raise InputError(msg) from None
    return path


@dataclass(frozen=True, kw_only=True, eq=False)
class Origin:
    """What the results of a study come from.

    Attributes:
        study: Its name.
        manifests: The runs used, one or more.
        missing: The runs that could not be used.
        note: How these runs differ from the full study.
        command: Command line.
        reference: What they are compared with.
    """

    study: str
    manifests: Sequence[Run]
    missing: tuple[MissingRun, ...]
    note: str
    command: str
    reference: Reference

    @property
    def told_note(self) -> str:
        """How the runs used differ from the full study, those that are missing among it."""
        if not self.missing:
            return self.note
        used, total = len(self.manifests), len(self.manifests) + len(self.missing)
        return f"only {used} of {total} runs of what is planned: {self.note}"

    @property
    def _told_runs(self) -> str:
        lacking = f", {len(self.missing)} missing" if self.missing else ""
        used, total = len(self.manifests), len(self.manifests) + len(self.missing)
        fidelities = ", ".join(dict.fromkeys(run.manifest.fidelity for run in self.manifests))
        engines = _told_engines(list(dict.fromkeys(run.manifest.engine for run in self.manifests)))
        return f"Study {self.study}, fidelity {fidelities}{engines}: {used} of {total} runs{lacking}"

    def below_figures(self, points: str, text_name: str) -> tuple[str, ...]:
        """What every figure says about its origin; it is short, for a figure is to be looked at.

        Args:
            points: Which runs there are; goes on from "… of … runs; ".
            text_name: Name of the Markdown file that tells the rest.
        """
        # Of a variant the first words say that it is one; how it differs in everything is told elsewhere.
        first, *more = (f"planned: {self.note}" if self.missing else self.note).split("; ")
        commits = sorted({run.manifest.versions.get("git", "unknown") for run in self.manifests})
        made = f"{len(commits)} commits" if len(commits) > 2 else f"Commit {', '.join(commits)}"
        return (
            f"{self._told_runs}; {points}",
            f"{first[0].upper()}{first[1:]}{' and more' if more else ''}. {made}. More: {text_name}, provenance.json.",
        )

    def footer(self, points: str, *statements: str) -> tuple[str, ...]:
        """What every table and text says about its origin, one statement each.

        Args:
            points: Which runs there are; goes on from "… of … runs; ".
            statements: What else is to be known, such as definitions.
        """
        versions = []
        engines = list(dict.fromkeys(run.manifest.engine for run in self.manifests))
        for name in ("smarticles", "git", *engines):
            by_it = [run for run in self.manifests if name not in engines or run.manifest.engine == name]
            found = sorted({run.manifest.versions.get(name, "unknown") for run in by_it})
            versions.append(f"{name} {', '.join(found)}")
        return (
            f"{self._told_runs}; {points}",
            *statements,
            f"Reference: {self.reference.statement}.",
            f"Note: {self.told_note}",
            f"Versions: {'; '.join(versions)}. Command: {self.command}",
        )

    def write(
        self,
        output: Path,
        footer: Sequence[str],
        *,
        tables: Mapping[str, pd.DataFrame],
        text: tuple[str, Sequence[str]],
    ) -> Mapping[str, Path]:
        """Writes what a study tells: its tables and that of the missing runs, its text, and the provenance.

        Args:
            output: Folder, see `make_folder`.
            footer: See `footer`.
            tables: By name, without suffix.
            text: Name of the Markdown file, and its lines; missing runs and footer are put below.

        Returns:
            The files, by name.
        """
        written = write_tables(output, {**tables, "missing": missing_table(self.missing)}, footer)
        name, lines = text
        written[name] = write_text("\n".join([*lines, *markdown_ending(self.missing, footer)]), output / name)
        provenance = output / "provenance.json"
        told = {column for table in tables.values() for column in table.columns}
        written[provenance.name] = write_text(_provenance(self, footer, told), provenance)
        return MappingProxyType(written)


def _told_engines(engines: Sequence[str]) -> str:
    """Which engines, unless it is the usual one alone."""
    return "" if list(engines) == ["yade"] else f", engine {' and '.join(engines)}"


def _provenance(origin: Origin, footer: Sequence[str], columns: Collection[str]) -> str:
    """Everything about the origin of a study's results as JSON; of φ where its tables have such columns."""
    try:
        version = importlib.metadata.version("smarticles")
    except importlib.metadata.PackageNotFoundError:
        version = "unknown"
    packing: dict[str, object] = {
        "definition": DEFINITION,
        "definition_meaning": DEFINITIONS[DEFINITION],
        "frames_averaged_at_most": LAST_FRAMES,
    }
    content = {
        "format": 1,
        "study": origin.study,
        "note": origin.told_note,
        "command": origin.command,
        "footer": list(footer),
        "analysed_with": {"smarticles": version},
        **(packing if any(DEFINITION in column for column in columns) else {}),
        "reference": dict(origin.reference.facts),
        "runs": [
            {
                "directory": str(run.path),
                "name": run.manifest.name,
                "scene_sha256": run.manifest.scene_sha256,
                "aspect_ratio": run.manifest.aspect_ratio,
                "seed": run.manifest.seed,
                "fidelity": run.manifest.fidelity,
                "engine": run.manifest.engine,
                "started": run.manifest.started,
                "command": run.manifest.command,
                "versions": dict(run.manifest.versions),
            }
            for run in origin.manifests
        ],
        "missing": [asdict(run) for run in origin.missing],
    }
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"


def write_tables(folder: Path, tables: Mapping[str, pd.DataFrame], footer: Sequence[str]) -> dict[str, Path]:
    """Writes tables as CSV with their footer as comments below; read them with `comment="#"`.

    Args:
        folder: Where to.
        tables: By name, without suffix.
        footer: One statement each.

    Returns:
        The files written, by name.
    """
    below = "".join(f"# {line}\n" for line in footer)
    written = {}
    for name, table in tables.items():
        path = folder / f"{name}.csv"
        written[path.name] = write_text(table.to_csv(index=False, float_format="%.6g") + below, path)
    return written


def missing_table(missing: Sequence[MissingRun]) -> pd.DataFrame:
    """One row per run that could not be used."""
    return pd.DataFrame([asdict(run) for run in missing], columns=["directory", "status", "cause"])


def markdown_ending(missing: Sequence[MissingRun], footer: Sequence[str]) -> list[str]:
    """The lines that end a report: missing runs, a line per cause, and footer."""
    lines = []
    if missing:
        rows: dict[tuple[str, str], list[str]] = {}
        for run in missing:
            rows.setdefault((run.status, run.common_cause), []).append(run.directory)
        cells = [
            (str(len(runs)), f"{runs[0]}{', …' if len(runs) > 1 else ''}", status, cause)
            for (status, cause), runs in rows.items()
        ]
        lines += ["", "## Missing runs", "", "One by one in `missing.csv`.", ""]
        lines += table_lines(["runs", "which", "status", "cause"], cells)
    return [*lines, "", "---", "", *(f"{line}  " for line in footer), ""]


def write_text(text: str, path: Path) -> Path:
    """Writes a text whole."""
    with figures.whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path
