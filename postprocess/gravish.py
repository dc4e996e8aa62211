"""The study `gravish`: packing fraction before and after shaking, against Gravish et al. 2012.

Gravish, Franklin, Hu and Goldman, "Entangled granular media", Phys. Rev. Lett. 108, 208001 (2012):
steel staples shaken vertically at 30 Hz and a peak acceleration of 2 g for 20 s. Their points are
digitised (`reference/README.md`); they are compared at equal l/w only and never interpolated.
How errors and answers come about is in `postprocess.gravish_answers`.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from types import MappingProxyType

import pandas as pd

from dem.errors import InputError
from postprocess import figures, gravish_figures
from postprocess.gravish_answers import (
    ASPECT,
    DEFINITION,
    DIGITISING_ERROR,
    REFERENCE,
    SEED,
    SEEDS,
    SHAKEN,
    STAGES,
    Verdict,
    answers,
    deviations_from_reference,
    read_reference,
    steps_between_ratios,
    summarise_runs,
)
from postprocess.manifest import PhaseRecord, RunManifest, read_run
from postprocess.measure import LAST_FRAMES, packing_change, summarise_run
from postprocess.packing import COSTLY_DEFINITIONS, DEFINITIONS

REFERENCE_SHAKE_TIME = 20.0
"""How long Gravish et al. shook [s]."""


_SHAKE = "shake"


@dataclass(frozen=True, kw_only=True)
class MissingRun:
    """A run directory that could not be used.

    Attributes:
        directory: As given.
        status: "not started", "unfinished", "failed", "interrupted", or "unusable" for one that
            cannot be read or was not shaken.
        cause: Why, as far as it is known.
    """

    directory: str
    status: str
    cause: str


@dataclass(frozen=True, kw_only=True, eq=False)
class GravishReport:
    """Tables, answers and files of the study.

    Attributes:
        runs: One row per finished run.
        summary: One row per aspect ratio: means over seeds with errors, and Gravish's values.
        deviations: One row per point that Gravish has as well.
        steps: One row per pair of neighbouring aspect ratios and stage: does φ fall?
        verdicts: Answers to the study's questions.
        missing: Runs that were given and are not in the tables.
        footer: What every figure and table says about its origin, one statement each.
        files: Everything that was written, by name.
    """

    runs: pd.DataFrame = field(repr=False)
    summary: pd.DataFrame = field(repr=False)
    deviations: pd.DataFrame = field(repr=False)
    steps: pd.DataFrame = field(repr=False)
    verdicts: tuple[Verdict, ...]
    missing: tuple[MissingRun, ...]
    footer: tuple[str, ...] = field(repr=False)
    files: Mapping[str, Path] = field(repr=False)


def analyse_gravish(
    run_dirs: Sequence[Path | str],
    output: Path | str,
    *,
    note: str,
    command: str,
    definitions: Sequence[str] = tuple(DEFINITIONS),
) -> GravishReport:
    """Measures the runs of the study and writes its tables and figures.

    Runs that are not done, or cannot be read, are listed as missing. Files of an earlier analysis
    in the same folder are replaced.

    Args:
        run_dirs: Run directories; any subset of the study.
        output: Folder for the results; made if needed.
        note: How these runs differ from the full study; stands in every footer.
        command: Command line to state as the origin.
        definitions: Definitions of the packing fraction to tabulate, keys of
            `packing.DEFINITIONS`; the one that is compared is always among them. Those in
            `packing.COSTLY_DEFINITIONS` take seconds per run.

    Returns:
        The report.

    Raises:
        InputError: No run is done, a run is given twice, the runs differ in fidelity, an unknown
            definition, or the output is no folder.
    """
    unknown = set(definitions) - set(DEFINITIONS)
    if unknown:
        msg = f"unknown definition '{min(unknown)}' of φ: choose from {', '.join(DEFINITIONS)}"
        raise InputError(msg)
    output = Path(output)
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        msg = f"cannot write to {output}: {error.strerror}; choose another folder as output"
        raise InputError(msg) from None
    manifests, rows, missing = _collect(run_dirs, definitions)
    runs = _runs_table(rows)
    summary = summarise_runs(runs, read_reference())
    deviations, steps = deviations_from_reference(summary), steps_between_ratios(summary)
    verdicts = answers(runs, summary, deviations, steps)
    footer = _footer(manifests, runs, missing, note=note, command=command)
    written: dict[str, Path] = {}
    tables = {
        "runs": runs,
        "summary": summary,
        "deviations": deviations,
        "steps": steps,
        "verdicts": pd.DataFrame([asdict(verdict) for verdict in verdicts]),
        "missing": pd.DataFrame([asdict(run) for run in missing], columns=["directory", "status", "cause"]),
    }
    for name, table in tables.items():
        written[f"{name}.csv"] = _write_csv(table, output / f"{name}.csv", footer)
    text = _markdown(deviations, verdicts, missing, footer)
    written["deviations.md"] = _write_text(text, output / "deviations.md")
    origin = _provenance(manifests, missing, footer, note=note, command=command)
    written["provenance.json"] = _write_text(
        json.dumps(origin, indent=2, ensure_ascii=False) + "\n", output / "provenance.json"
    )
    drawn = gravish_figures.draw(
        output,
        summary=summary,
        reference=read_reference(),
        manifests=manifests,
        definition=DEFINITION,
        reading_error=DIGITISING_ERROR,
        footer=footer,
    )
    written |= {path.name: path for path in drawn}
    return GravishReport(
        runs=runs,
        summary=summary,
        deviations=deviations,
        steps=steps,
        verdicts=verdicts,
        missing=missing,
        footer=footer,
        files=MappingProxyType(written),
    )


def _collect(
    run_dirs: Sequence[Path | str], definitions: Sequence[str]
) -> tuple[list[RunManifest], list[dict[str, object]], tuple[MissingRun, ...]]:
    """Manifests and rows of the finished runs, and the others."""
    manifests: list[RunManifest] = []
    rows: list[dict[str, object]] = []
    missing: list[MissingRun] = []
    for directory in run_dirs:
        status = "unusable"
        try:
            run = read_run(directory)
            if run.status != "done":
                cause = run.cause or "it has not finished"
                missing.append(MissingRun(directory=str(directory), status=run.status, cause=cause))
                continue
            rows.append(_row(run, definitions))
            manifests.append(run)
        except InputError as error:
            if not Path(directory, "run.json").exists():
                status = "not started"
            missing.append(MissingRun(directory=str(directory), status=status, cause=str(error)))
    if not manifests:
        why = f"; the first: {missing[0].directory}: {missing[0].cause}" if missing else ""
        msg = f"study gravish: none of {len(run_dirs)} runs is done{why}; finish a run first"
        raise InputError(msg)
    _check_comparable(manifests)
    return manifests, rows, tuple(missing)


def _check_comparable(manifests: Sequence[RunManifest]) -> None:
    seen: dict[tuple[float, int], RunManifest] = {}
    for run in manifests:
        if run.fidelity != manifests[0].fidelity:
            msg = (
                f"study gravish: runs of different fidelity must not be averaged: "
                f"{manifests[0].directory} is {manifests[0].fidelity}, "
                f"{run.directory} is {run.fidelity}; analyse them apart"
            )
            raise InputError(msg)
        key = (round(run.aspect_ratio, 6), run.seed)
        if key in seen:
            msg = (
                f"study gravish: l/w = {run.aspect_ratio:g} with seed {run.seed} is given twice, "
                f"{seen[key].directory} and {run.directory}; leave one out"
            )
            raise InputError(msg)
        seen[key] = run


def _row(run: RunManifest, definitions: Sequence[str]) -> dict[str, object]:
    """One run's row of the table.

    Raises:
        InputError: It was not shaken after another phase, or cannot be read.
    """
    shakes = [phase for phase in run.phases if phase.type == _SHAKE]
    if not shakes or shakes[0].index == 0:
        types = ", ".join(phase.type for phase in run.phases)
        msg = f"{run.directory}: no shaking after another phase: its phases are {types}"
        raise InputError(msg)
    cheap = [DEFINITION, *(set(definitions) - {DEFINITION} - COSTLY_DEFINITIONS)]
    table = summarise_run(run.directory, definitions=cheap).set_index("phase")
    wanted = {"phi_0": shakes[0].index - 1, "phi_f": shakes[-1].index}
    if shakes[-1].index < run.phases[-1].index:
        wanted["phi_f relaxed"] = run.phases[-1].index
    for phase in wanted.values():
        if phase not in table.index:
            kind = run.phases[phase].type
            msg = f"{run.directory}: no frame of phase {phase} ({kind}); run it again"
            raise InputError(msg)
    row: dict[str, object] = {
        ASPECT: round(run.aspect_ratio, 6),
        SEED: run.seed,
        "smarticles [-]": run.count,
        "fidelity": run.fidelity,
        SHAKEN: sum(map(_duration, shakes)),
    }
    for definition in DEFINITIONS:
        if definition in cheap:
            for stage, phase in wanted.items():
                row[f"{stage} {definition} [-]"] = table.loc[phase, f"phi {definition} [-]"]
        elif definition in definitions:
            change = packing_change(run.directory, definition=definition, last=1, activity={_SHAKE})
            row[f"phi_0 {definition} [-]"] = change.before.value
            row[f"phi_f {definition} [-]"] = change.after.value
    for stage, phase in wanted.items():
        row[f"{stage} {DEFINITION} SE in run [-]"] = table.loc[phase, f"phi {DEFINITION} SE [-]"]
    for name, stage in zip(("before", "after", "relaxed"), STAGES, strict=True):
        if stage in wanted:
            row[f"crossings {name} [-]"] = table.loc[wanted[stage], "crossings mean [-]"]
    row["escaped at the end [-]"] = table["escaped [-]"].iloc[-1]
    row["frames averaged [-]"] = int(table.loc[list(wanted.values()), "frames averaged"].min())
    row["scene_sha256"] = run.scene_sha256
    row["run"] = run.directory.name
    return row


def _duration(phase: PhaseRecord) -> float:
    """How long a phase of a finished run took [s]."""
    if phase.start is None or phase.end is None:
        return math.nan
    return phase.end - phase.start


def _runs_table(rows: Sequence[Mapping[str, object]]) -> pd.DataFrame:
    table = pd.DataFrame(rows).sort_values([ASPECT, SEED], ignore_index=True)
    # Runs without a relaxation at the end lack columns, and would put them behind the hashes.
    tail = ["escaped at the end [-]", "frames averaged [-]", "scene_sha256", "run"]
    return table[[*table.columns.difference(tail, sort=False), *tail]]


def _footer(
    manifests: Sequence[RunManifest],
    runs: pd.DataFrame,
    missing: Sequence[MissingRun],
    *,
    note: str,
    command: str,
) -> tuple[str, ...]:
    seeds = " ".join(map(str, sorted(set(runs[SEED]))))
    counts = runs.groupby(ASPECT).size()
    ratios = " ".join(f"{ratio:g}" for ratio in counts.index)
    per_ratio = str(counts.min()) if counts.nunique() == 1 else f"{counts.min()} to {counts.max()}"
    shaken = sorted({f"{time:g}" for time in runs[SHAKEN].round(3)}, key=float)
    lacking = f", {len(missing)} missing" if missing else ""
    bars = (
        "Error bars: 95 % confidence of the mean over seeds, Student's t"
        if counts.max() > 1
        else "One seed per l/w: no error bars"
    )
    return (
        f"Study gravish, fidelity {manifests[0].fidelity}: {len(manifests)} of "
        f"{len(manifests) + len(missing)} runs{lacking}; l/w {ratios}, seeds "
        f"{seeds} ({per_ratio} per l/w); shaken for {', '.join(shaken)} s "
        f"(Gravish: {REFERENCE_SHAKE_TIME:g} s).",
        f"φ by {DEFINITION} unless named otherwise; before shaking and at the end of shaking, "
        f"means over the last {LAST_FRAMES} frames or fewer (voxel and voronoi: the last frame). "
        f"{bars}.",
        "Reference: Gravish et al., PRL 108, 208001 (2012), digitised; "
        f"error of reading taken as ±{DIGITISING_ERROR:g}.",
        f"Note: {note}",
        f"Versions: {'; '.join(_versions(manifests))}. Command: {command}",
    )


def _versions(manifests: Sequence[RunManifest]) -> Iterator[str]:
    """Each program with all its versions among the runs."""
    for name in ("smarticles", "git", "yade"):
        versions = sorted({run.versions.get(name, "unknown") for run in manifests})
        yield f"{name} {', '.join(versions)}"


def _provenance(
    manifests: Sequence[RunManifest],
    missing: Sequence[MissingRun],
    footer: Sequence[str],
    *,
    note: str,
    command: str,
) -> dict[str, object]:
    try:
        version = importlib.metadata.version("smarticles")
    except importlib.metadata.PackageNotFoundError:
        version = "unknown"
    return {
        "format": 1,
        "study": "gravish",
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


def _write_csv(table: pd.DataFrame, path: Path, footer: Sequence[str]) -> Path:
    """A table with its footer as comments below; read it with `comment="#"`."""
    text = table.to_csv(index=False, float_format="%.6g")
    return _write_text(text + "".join(f"# {line}\n" for line in footer), path)


def _write_text(text: str, path: Path) -> Path:
    with figures.whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


def _markdown(
    deviations: pd.DataFrame,
    verdicts: Sequence[Verdict],
    missing: Sequence[MissingRun],
    footer: Sequence[str],
) -> str:
    parts = ["# Packing of shaken smarticles against Gravish et al. 2012", "", "## Verdicts", ""]
    parts += ["| question | answer | evidence |", "| --- | --- | --- |"]
    parts += [f"| {v.question} | {v.answer} | {v.evidence} |" for v in verdicts]
    parts += ["", "## Mean absolute deviation", ""]
    parts += ["| stage | meaning | points | mean absolute | mean, signed | largest |"]
    parts += ["| --- | --- | --- | --- | --- | --- |"]
    for stage, part in deviations.groupby("stage", sort=False):
        percent = part["deviation [%]"]
        largest = percent.loc[percent.abs().idxmax()]
        parts.append(
            f"| {stage} | {STAGES[stage]} | {len(part)} | {percent.abs().mean():.1f} % "
            f"| {percent.mean():+.1f} % | {largest:+.1f} % |"
        )
    parts += ["", "## Points", ""]
    parts += ["| stage | l/w | seeds | φ | Gravish | deviation |", "| --- " * 6 + "|"]
    for _, row in deviations.iterrows():
        error = row["phi 95 % [-]"]
        bar = f" ± {error:.4f}" if math.isfinite(error) else ""
        parts.append(
            f"| {row['stage']} | {row[ASPECT]:g} | {row[SEEDS]} | {row['phi [-]']:.4f}{bar} "
            f"| {row['phi Gravish [-]']:.4f} | {row['deviation [%]']:+.1f} % |"
        )
    if missing:
        parts += ["", "## Missing runs", "", "| run | status | cause |", "| --- | --- | --- |"]
        parts += [f"| {run.directory} | {run.status} | {run.cause} |" for run in missing]
    parts += ["", "---", "", *(f"{line}  " for line in footer), ""]
    return "\n".join(parts)
