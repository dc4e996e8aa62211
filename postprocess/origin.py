"""Where the numbers of a study come from: footers, provenance, and tables that carry both."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import pandas as pd

from dem.errors import InputError
from postprocess import figures
from postprocess.gravish_reference import CITATION, DIGITISING_ERROR, REFERENCE
from postprocess.manifest import RunManifest
from postprocess.measure import LAST_FRAMES
from postprocess.packing import DEFINITIONS
from postprocess.study_runs import DEFINITION, MissingRun


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


def closing_lines(manifests: Sequence[RunManifest], *, note: str, command: str) -> tuple[str, ...]:
    """The last statements of every footer: reference, note, versions, command."""
    return (
        f"Reference: {CITATION}; error of reading taken as ±{DIGITISING_ERROR:g}.",
        f"Note: {note}",
        f"Versions: {'; '.join(_versions(manifests))}. Command: {command}",
    )


def told_count(study: str, manifests: Sequence[RunManifest], missing: Sequence[MissingRun]) -> str:
    """The beginning of every footer: study, fidelity, how many runs."""
    lacking = f", {len(missing)} missing" if missing else ""
    total = len(manifests) + len(missing)
    return f"Study {study}, fidelity {manifests[0].fidelity}: {len(manifests)} of {total} runs{lacking}"


def _versions(manifests: Sequence[RunManifest]) -> Iterator[str]:
    """Each program with all its versions among the runs."""
    for name in ("smarticles", "git", "yade"):
        versions = sorted({run.versions.get(name, "unknown") for run in manifests})
        yield f"{name} {', '.join(versions)}"


def write_provenance(
    path: Path,
    *,
    study: str,
    manifests: Sequence[RunManifest],
    missing: Sequence[MissingRun],
    footer: Sequence[str],
    note: str,
    command: str,
) -> Path:
    """Writes everything about the origin of a study's results as JSON.

    Args:
        path: Where to.
        study: Its name.
        manifests: The runs used.
        missing: The runs that could not be used.
        footer: What every table says.
        note: How these runs differ from the full study.
        command: Command line.

    Returns:
        The path written.
    """
    try:
        version = importlib.metadata.version("smarticles")
    except importlib.metadata.PackageNotFoundError:
        version = "unknown"
    origin = {
        "format": 1,
        "study": study,
        "note": note,
        "command": command,
        "footer": list(footer),
        "analysed_with": {"smarticles": version},
        "definition": DEFINITION,
        "definition_meaning": DEFINITIONS[DEFINITION],
        "frames_averaged_at_most": LAST_FRAMES,
        "reference": {
            "file": REFERENCE.name,
            "sha256": hashlib.sha256(REFERENCE.read_bytes()).hexdigest(),
            "digitising_error": DIGITISING_ERROR,
        },
        "runs": [
            {
                "directory": str(run.directory),
                "name": run.name,
                "scene_sha256": run.scene_sha256,
                "aspect_ratio": run.aspect_ratio,
                "seed": run.seed,
                "fidelity": run.fidelity,
                "started": run.started,
                "command": run.command,
                "versions": dict(run.versions),
            }
            for run in manifests
        ],
        "missing": [asdict(run) for run in missing],
    }
    return write_text(json.dumps(origin, indent=2, ensure_ascii=False) + "\n", path)


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
    """The lines that end a report: missing runs and footer."""
    lines = []
    if missing:
        lines += ["", "## Missing runs", "", "| run | status | cause |", "| --- | --- | --- |"]
        lines += [f"| {run.directory} | {run.status} | {run.cause} |" for run in missing]
    return [*lines, "", "---", "", *(f"{line}  " for line in footer), ""]


def write_text(text: str, path: Path) -> Path:
    """Writes a text whole."""
    with figures.whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path
