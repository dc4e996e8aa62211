"""Origin of the numbers of a study: footers of tables and figures, and the file `provenance.json`."""

import importlib.metadata
import json
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from types import MappingProxyType

import pandas as pd

from dem.errors import InputError
from dem.record.names import SCENE
from dem.record.run import Run
from dem.setting.fidelity import fidelities as named_fidelities
from postprocess.measures.packing import DEFINITIONS
from postprocess.measures.table import LAST_FRAMES
from postprocess.report.tables import table_lines, whole_file
from studies.framework.runs import DEFINITION, Collected

TEXT = "findings.md"  #: Name of the text with findings, points and the full footer


@dataclass(frozen=True, kw_only=True)
class Reference:
    """Published numbers or statements that a study is compared with."""

    statement: str  #: Statement for footers, without a full stop
    facts: Mapping[str, object]  #: Entries for `provenance.json`


SAVOIE = Reference(
    statement="statements in the text of Savoie et al., Soft Matter 2023, DOI 10.1039/d2sm01573k; no data of theirs",
    facts=MappingProxyType({"doi": "10.1039/d2sm01573k", "what": "statements in the text"}),
)

NOTHING = Reference(statement="none; no published numbers", facts=MappingProxyType({"what": "our own runs alone"}))


@dataclass(frozen=True, kw_only=True, eq=False)
class Origin:
    """Origin of the results of a study: runs, command and reference."""

    found: Collected  #: Runs that were measured, and runs that are missing
    note: str  #: How the planned runs differ from the full study
    full: str = ""  #: What the full study found; empty if these runs are the full study
    command: str  #: Command line
    reference: Reference

    @property
    def whole_note(self) -> str:
        """Text on how the measured runs differ from the full study; it has the number of missing runs, if any."""
        used, missing = len(self.found.runs), len(self.found.missing)
        return f"only {used} of {used + missing} runs of what is planned: {self.note}" if missing else self.note

    def _versions(self, name: str, engine: str = "") -> list[str]:
        manifests = [run.run.manifest for run in self.found.runs if engine in ("", run.run.manifest.engine)]
        return sorted({manifest.made_by.get(name, "unknown") for manifest in manifests})

    @property
    def _start(self) -> str:
        words = [word for word in shlex.split(self.command) if word != "--analyse"]
        return shlex.join(words)

    @property
    def _engines(self) -> list[str]:
        return list(dict.fromkeys(run.run.manifest.engine for run in self.found.runs))

    @property
    def _which(self) -> str:
        used, missing = len(self.found.runs), len(self.found.missing)
        several = list(dict.fromkeys(_fidelity(run.run) for run in self.found.runs))
        more = [f"{len(several) - 4} more"] if len(several) > 4 else []
        fidelities = ", ".join(several[:4] + more)
        engines = "" if self._engines == ["yade"] else f", engine {' and '.join(self._engines)}"
        lacking = f", {missing} missing" if missing else ""
        return f"Study {self.found.study}, fidelity {fidelities}{engines}: {used} of {used + missing} runs{lacking}"

    def figure_footer(self, points: str) -> list[str]:
        """Return the two lines of the footer of a figure: runs and points; note, commits and other files.

        `points` is a statement on the points, such as the number of seeds at each.
        """
        first, *more = (f"planned: {self.note}" if self.found.missing else self.note).split("; ")
        differs = f"{first[0].upper()}{first[1:]}{' and more' if more else ''}."
        if self.full:
            differs = f"Not the full study, which found: {self.full}"
        commits = self._versions("git")
        made = f"{len(commits)} commits" if len(commits) > 2 else f"Commit {', '.join(commits)}"
        return [
            f"{self._which}; {points}",
            f"{differs} {made}. More: {TEXT}, provenance.json.",
        ]

    def footer(self, points: str, *statements: str) -> list[str]:
        """Return the lines of the footer of tables and texts.

        The first line has the runs and `points`, a statement on the measured points; then follow `statements`,
        reference, note, versions and command.
        """
        named = [("smarticles", ""), ("git", ""), *((engine, engine) for engine in self._engines)]
        versions = "; ".join(f"{name} {', '.join(self._versions(name, engine))}" for name, engine in named)
        return [
            f"{self._which}; {points}",
            *statements,
            f"Reference: {self.reference.statement}.",
            f"Note: {self.whole_note}",
            *([f"The full study found: {self.full}"] if self.full else []),
            f"Versions: {versions}. Command: {self.command}",
        ]

    def write(
        self,
        output: Path,
        footer: Sequence[str],
        *,
        tables: Mapping[str, pd.DataFrame],
        text: tuple[str, Sequence[str]],
    ) -> dict[str, Path]:
        """Write tables, text and provenance into a folder; return the paths of the files by their names.

        The footer is written below the text, and below CSV tables as comments, so that readers need `comment="#"`.
        Tables are by the name of their file without `.csv`; `text` is the name of a Markdown file and its lines, below
        which missing runs are listed.
        """
        missing = pd.DataFrame([asdict(run) for run in self.found.missing], columns=["directory", "status", "cause"])
        below = "".join(f"# {line}\n" for line in footer)
        texts = {
            f"{name}.csv": table.to_csv(index=False, float_format="%.6g") + below
            for name, table in {**tables, "missing": missing}.items()
        }
        name, lines = text
        texts[name] = "\n".join([*lines, *self._missing_lines(), "", "---", "", *(f"{line}  " for line in footer), ""])
        columns = [str(column) for table in tables.values() for column in table.columns]
        texts["provenance.json"] = self._provenance(footer, columns)
        for file, content in texts.items():
            with whole_file(output / file) as temporary:
                temporary.write_text(content, encoding="utf-8")
        return {file: output / file for file in texts}

    def _missing_lines(self) -> list[str]:
        """Return the lines of the Markdown table of missing runs, one row for each cause."""
        rows: dict[tuple[str, str], list[str]] = {}
        for run in self.found.missing:
            rows.setdefault((run.status, run.common_cause), []).append(run.directory)
        cells = [
            (str(len(runs)), f"{runs[0]}{', …' if len(runs) > 1 else ''}", status, cause)
            for (status, cause), runs in rows.items()
        ]
        head = ["", "## Missing runs", "", "One by one in `missing.csv`.", ""]
        return [*head, *table_lines(["runs", "which", "status", "cause"], cells)] if cells else []

    def _provenance(self, footer: Sequence[str], columns: Sequence[str]) -> str:
        try:
            version = importlib.metadata.version("smarticles")
        except importlib.metadata.PackageNotFoundError:
            version = "unknown"
        packing: dict[str, object] = {
            "definition": DEFINITION,
            "definition_meaning": DEFINITIONS[DEFINITION],
            "frames_averaged_at_most": LAST_FRAMES,
        }
        of_run = ("name", "scene_sha256", "aspect_ratio", "seed", "fidelity", "engine", "started", "command")
        content = {
            "format": 1,
            "study": self.found.study,
            "note": self.whole_note,
            "command": self.command,
            # Commands of runs name scene files in the directory of the study.
            "scenes": f"written into DIR/scenes by the command that starts the study: {self._start}",
            "footer": list(footer),
            "analysed_with": {"smarticles": version},
            **(packing if any(DEFINITION in column for column in columns) else {}),
            "reference": dict(self.reference.facts),
            "runs": [
                {
                    "directory": str(one.run.path),
                    **{name: getattr(one.run.manifest, name) for name in of_run},
                    "versions": dict(one.run.manifest.versions),
                    **one.run.manifest.model_dump(mode="json", include={"machine", "resumed"}, exclude_defaults=True),
                }
                for one in self.found.runs
            ],
            "missing": [asdict(run) for run in self.found.missing],
        }
        return json.dumps(content, indent=2, ensure_ascii=False) + "\n"


def make_folder(path: Path | str) -> Path:
    """Make a folder for results unless it exists, and return its path; InputError if that is impossible."""
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot write to {path}: {error.strerror}; choose another folder as output") from None
    return path


def _fidelity(run: Run) -> str:
    """Return the fidelity of a run, with its rows and stiffness where they are not those of the named fidelity.

    Runs whose directories are gone, known from the tables of an earlier analysis, have the name alone.
    """
    base = run.manifest.fidelity
    knobs = run.scene.get("fidelity", {}) if (run.path / SCENE).exists() else {}
    named = named_fidelities(run.manifest.engine)[base]
    shown = {"rows": "rows {:g}", "stiffness_N_per_m": "{:g} N/m"}
    changed = [text.format(knobs[key]) for key, text in shown.items() if knobs.get(key, named[key]) != named[key]]
    return f"{base} ({', '.join(changed)})" if changed else base
