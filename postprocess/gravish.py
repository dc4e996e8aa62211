"""The study `gravish`: packing fraction before and after shaking, against Gravish et al. 2012.

Gravish, Franklin, Hu and Goldman, "Entangled granular media", Phys. Rev. Lett. 108, 208001 (2012):
steel staples shaken vertically at 30 Hz and a peak acceleration of 2 g for 20 s. Their points are
digitised (`reference/README.md`); they are compared at equal l/w only and never interpolated.

All error bars are half-widths of 95 % confidence intervals of a mean over seeds, by Student's t. A
mean over one seed has none, and what would need one is left undetermined.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Literal

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from dem.errors import InputError
from postprocess import figures, gravish_figures
from postprocess.manifest import RunManifest, read_run
from postprocess.measure import LAST_FRAMES, summarise_run
from postprocess.packing import DEFINITIONS

DEFINITION = "second-highest-com"
"""Definition of the packing fraction that is compared with Gravish's."""

DIGITISING_ERROR = 0.003
"""Taken as the error of each of Gravish's points [-]."""

REFERENCE_SHAKE_TIME = 20.0
"""How long Gravish et al. shook [s]."""

ACCEPTED_DEVIATION = 10.0
"""Mean absolute deviation from Gravish's points that the study accepts [%]."""

CONFIDENCE = 0.95

ASPECT, SEED, SEEDS, SHAKEN = "aspect ratio [-]", "seed", "seeds [-]", "time shaken [s]"

STAGES: Mapping[str, str] = MappingProxyType(
    {
        "phi_0": "before shaking",
        "phi_f": "at the end of shaking",
        "phi_f relaxed": "after the relaxation that follows shaking",
    }
)
"""When a packing fraction is taken; each is a mean over the last frames of its phase."""

_SHAKE = "shake"
_REFERENCE = "gravish2012_phi.csv"
_REFERENCE_COLUMN = {"phi_0": "phi_initial", "phi_f": "phi_final", "phi_f relaxed": "phi_final"}

Answer = Literal["yes", "no", "undetermined"]


@dataclass(frozen=True, kw_only=True)
class MissingRun:
    """A run directory that could not be used.

    Attributes:
        directory: As given.
        status: "unfinished", "failed", "interrupted", or "unusable" for a finished one.
        cause: Why, as far as it is known.
    """

    directory: str
    status: str
    cause: str


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """An answer to one of the study's questions.

    Attributes:
        question: Ends in a question mark.
        answer: "undetermined" where the data cannot tell.
        evidence: The numbers behind it.
    """

    question: str
    answer: Answer
    evidence: str


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


def analyse_gravish(run_dirs: Sequence[Path | str], output: Path | str, *, note: str, command: str) -> GravishReport:
    """Measures the runs of the study and writes its tables and figures.

    Runs that are not done, or cannot be read, are listed as missing. Files of an earlier analysis
    in the same folder are replaced.

    Args:
        run_dirs: Run directories; any subset of the study.
        output: Folder for the results; made if needed.
        note: How these runs differ from the full study; stands in every footer.
        command: Command line to state as the origin.

    Returns:
        The report.

    Raises:
        InputError: No run is done, a run is given twice, the runs differ in fidelity, or the
            output is no folder.
    """
    output = Path(output)
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        msg = f"cannot write to {output}: {error.strerror}; choose another folder as output"
        raise InputError(msg) from None
    manifests, rows, missing = _collect(run_dirs)
    runs = _runs_table(rows)
    summary = summarise_runs(runs, read_reference())
    deviations = _deviations(summary)
    steps = _steps(summary)
    verdicts = (
        *(_monotone(stage, steps, summary) for stage in ("phi_0", "phi_f")),
        _compacted(runs),
        *(_close_enough(stage, deviations) for stage in ("phi_0", "phi_f")),
    )
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


def read_reference() -> pd.DataFrame:
    """Gravish's digitised points: columns `l_over_w`, `phi_initial`, `phi_final`.

    Returns:
        The table; NaN where there is no point.
    """
    with (files("postprocess") / "reference" / _REFERENCE).open(encoding="utf-8") as file:
        return pd.read_csv(file)


@dataclass(frozen=True, kw_only=True)
class SeedMean:
    """A mean over seeds.

    Attributes:
        value: NaN without seeds.
        standard_error: s/√n; NaN for fewer than two seeds.
        half_width: Of the 95 % confidence interval by Student's t with n − 1 degrees of freedom;
            NaN for fewer than two seeds.
        count: n.
    """

    value: float
    standard_error: float
    half_width: float
    count: int


def mean_over_seeds(values: Sequence[float]) -> SeedMean:
    """Mean of independent values with its error.

    Args:
        values: One per seed; NaN are left out.

    Returns:
        The mean, in the values' unit.

    Example:
        >>> mean = mean_over_seeds([1.0, 2.0, 3.0])
        >>> mean.value, round(mean.half_width, 3)
        (2.0, 2.484)
    """
    known = np.asarray(values, dtype=np.float64)
    known = known[~np.isnan(known)]
    count = len(known)
    if count < 2:
        value = float(known[0]) if count else math.nan
        return SeedMean(value=value, standard_error=math.nan, half_width=math.nan, count=count)
    error = float(known.std(ddof=1)) / math.sqrt(count)
    quantile = float(stdtrit(count - 1, (1 + CONFIDENCE) / 2))
    return SeedMean(
        value=float(known.mean()),
        standard_error=error,
        half_width=quantile * error,
        count=count,
    )


def summarise_runs(runs: pd.DataFrame, reference: pd.DataFrame) -> pd.DataFrame:
    """One row per aspect ratio: means over seeds, their errors, and Gravish's values.

    Args:
        runs: Table of runs, see `GravishReport.runs`.
        reference: See `read_reference`.

    Returns:
        The table, by ascending aspect ratio. `… 95 % [-]` are half-widths, `… deviation [%]` is
        relative to Gravish's value; empty where there is none.
    """
    rows = []
    for aspect, group in runs.groupby(ASPECT, sort=True):
        row: dict[str, object] = {
            ASPECT: aspect,
            SEEDS: len(group),
            "seeds": " ".join(map(str, sorted(group[SEED]))),
            SHAKEN: group[SHAKEN].mean(),
        }
        for quantity in _quantities(runs):
            mean = mean_over_seeds(group[f"{quantity} [-]"])
            row[f"{quantity} [-]"] = mean.value
            row[f"{quantity} SE [-]"] = mean.standard_error
            row[f"{quantity} 95 % [-]"] = mean.half_width
            if quantity in _COMPARED:
                value = _reference_at(reference, aspect, _COMPARED[quantity])
                row[f"{quantity} Gravish [-]"] = value
                row[f"{quantity} deviation [%]"] = 100 * (mean.value / value - 1)
        rows.append(row)
    return pd.DataFrame(rows)


_COMPARED = {f"{stage} {DEFINITION}": column for stage, column in _REFERENCE_COLUMN.items()}


def _quantities(runs: pd.DataFrame) -> list[str]:
    """What is averaged over seeds: names of columns without their unit."""
    columns = [f"{stage} {definition}" for definition in DEFINITIONS for stage in STAGES]
    columns += ["crossings before", "crossings after", "crossings relaxed"]
    return [name for name in columns if f"{name} [-]" in runs.columns]


def _reference_at(reference: pd.DataFrame, aspect: float, column: str) -> float:
    """Gravish's value at exactly this aspect ratio, or NaN."""
    same = np.isclose(reference["l_over_w"], aspect, rtol=0, atol=1e-6)
    return float(reference.loc[same, column].iloc[0]) if same.any() else math.nan


def _collect(
    run_dirs: Sequence[Path | str],
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
            rows.append(_row(run))
            manifests.append(run)
        except InputError as error:
            if not Path(directory, "run.json").exists():
                status = "unfinished"
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


def _row(run: RunManifest) -> dict[str, object]:
    """One run's row of the table.

    Raises:
        InputError: It was not shaken after another phase, or cannot be read.
    """
    shakes = [phase for phase in run.phases if phase.type == _SHAKE]
    if not shakes or shakes[0].index == 0:
        types = ", ".join(phase.type for phase in run.phases)
        msg = f"{run.directory}: no shaking after another phase: its phases are {types}"
        raise InputError(msg)
    table = summarise_run(run.directory).set_index("phase")
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
        SHAKEN: sum(phase.end - phase.start for phase in shakes if phase.end and phase.start),
    }
    for definition in DEFINITIONS:
        for stage, phase in wanted.items():
            quantity = f"phi {definition}"
            row[f"{stage} {definition} [-]"] = table.loc[phase, f"{quantity} [-]"]
            if definition == DEFINITION:
                row[f"{stage} {definition} SE in run [-]"] = table.loc[phase, f"{quantity} SE [-]"]
    for name, stage in zip(("before", "after", "relaxed"), STAGES, strict=True):
        if stage in wanted:
            row[f"crossings {name} [-]"] = table.loc[wanted[stage], "crossings mean [-]"]
    row["escaped at the end [-]"] = table["escaped [-]"].iloc[-1]
    row["frames averaged [-]"] = int(table.loc[list(wanted.values()), "frames averaged"].min())
    row["scene_sha256"] = run.scene_sha256
    row["run"] = run.directory.name
    return row


def _runs_table(rows: Sequence[Mapping[str, object]]) -> pd.DataFrame:
    table = pd.DataFrame(rows).sort_values([ASPECT, SEED], ignore_index=True)
    # Runs without a relaxation at the end lack columns, and would put them behind the hashes.
    tail = ["escaped at the end [-]", "frames averaged [-]", "scene_sha256", "run"]
    return table[[*table.columns.difference(tail, sort=False), *tail]]


def _deviations(summary: pd.DataFrame) -> pd.DataFrame:
    rows = []
    for quantity in _COMPARED:
        if f"{quantity} [-]" not in summary.columns:
            continue
        for _, row in summary.iterrows():
            value, reference = row[f"{quantity} [-]"], row[f"{quantity} Gravish [-]"]
            if math.isnan(value) or math.isnan(reference):
                continue
            half_width = row[f"{quantity} 95 % [-]"]
            rows.append(
                {
                    "stage": quantity.removesuffix(f" {DEFINITION}"),
                    "definition": DEFINITION,
                    ASPECT: row[ASPECT],
                    SEEDS: row[SEEDS],
                    "phi [-]": value,
                    "phi 95 % [-]": half_width,
                    "phi Gravish [-]": reference,
                    "digitising error [-]": DIGITISING_ERROR,
                    "deviation [-]": value - reference,
                    "deviation [%]": row[f"{quantity} deviation [%]"],
                    "deviation 95 % [%]": 100 * half_width / reference,
                }
            )
    columns = ["stage", "definition", ASPECT, SEEDS, "phi [-]", "phi 95 % [-]"]
    columns += ["phi Gravish [-]", "digitising error [-]", "deviation [-]", "deviation [%]"]
    return pd.DataFrame(rows, columns=[*columns, "deviation 95 % [%]"])


def _steps(summary: pd.DataFrame) -> pd.DataFrame:
    """Differences of φ between neighbouring aspect ratios against their errors."""
    rows = []
    for stage in STAGES:
        quantity = f"{stage} {DEFINITION}"
        if f"{quantity} [-]" not in summary.columns:
            continue
        known = summary[summary[f"{quantity} [-]"].notna()]
        pairs = zip(known.iloc[:-1].iterrows(), known.iloc[1:].iterrows(), strict=True)
        for (_, low), (_, high) in pairs:
            difference, half_width = _difference(low, high, quantity)
            rows.append(
                {
                    "stage": stage,
                    "definition": DEFINITION,
                    "from aspect ratio [-]": low[ASPECT],
                    "to aspect ratio [-]": high[ASPECT],
                    "difference [-]": difference,
                    "combined 95 % [-]": half_width,
                    "phi": _direction(difference, half_width),
                }
            )
    columns = ["stage", "definition", "from aspect ratio [-]", "to aspect ratio [-]"]
    return pd.DataFrame(rows, columns=[*columns, "difference [-]", "combined 95 % [-]", "phi"])


def _difference(low: pd.Series, high: pd.Series, quantity: str) -> tuple[float, float]:
    """Difference of two means and the root of the sum of squares of their half-widths."""
    half_widths = float(low[f"{quantity} 95 % [-]"]), float(high[f"{quantity} 95 % [-]"])
    return float(high[f"{quantity} [-]"] - low[f"{quantity} [-]"]), math.hypot(*half_widths)


def _direction(difference: float, half_width: float) -> str:
    if math.isnan(half_width):
        return "no error bar"
    if abs(difference) <= half_width:
        return "within error bars"
    return "falls" if difference < 0 else "rises"


def _monotone(stage: str, steps: pd.DataFrame, summary: pd.DataFrame) -> Verdict:
    question = f"Does {stage} fall monotonically with l/w within error bars?"
    found = steps.loc[steps["stage"] == stage]
    if found.empty:
        evidence = "fewer than two aspect ratios"
        return Verdict(question=question, answer="undetermined", evidence=evidence)
    counts = found["phi"].value_counts()
    falls, rises = int(counts.get("falls", 0)), int(counts.get("rises", 0))
    within, bare = (int(counts.get(name, 0)) for name in ("within error bars", "no error bar"))
    plain = int((found["difference [-]"] < 0).sum())
    parts = [
        f"of {len(found)} steps {falls} fall and {rises} rise by more than the combined 95 % "
        f"half-width, {within} lie within it, {bare} have no error bar",
        f"the means alone fall at {plain} of {len(found)} steps",
    ]
    quantity = f"{stage} {DEFINITION}"
    known = summary[summary[f"{quantity} [-]"].notna()]
    total, half_width = _difference(known.iloc[0], known.iloc[-1], quantity)
    parts.append(
        f"from l/w = {known[ASPECT].iloc[0]:g} to {known[ASPECT].iloc[-1]:g} the change is "
        f"{total:+.4f} ± {half_width:.4f}"
        if math.isfinite(half_width)
        else f"in all the change is {total:+.4f}, without an error bar"
    )
    answer: Answer = "undetermined"
    if rises:
        answer = "no"
    # A flat line with wide error bars is not monotone: the whole change must be beyond them.
    elif not bare and total < -half_width:
        answer = "yes"
    return Verdict(question=question, answer=answer, evidence="; ".join(parts))


def _compacted(runs: pd.DataFrame) -> Verdict:
    question = "Is phi_f above phi_0 at every l/w?"
    gain = runs[f"phi_f {DEFINITION} [-]"] - runs[f"phi_0 {DEFINITION} [-]"]
    means = [mean_over_seeds(part) for _, part in gain.groupby(runs[ASPECT])]
    clear = sum(mean.value > mean.half_width for mean in means)
    least = min((mean.value for mean in means if not math.isnan(mean.value)), default=math.nan)
    evidence = (
        f"gain paired by seed: above 0 by more than its 95 % half-width at {clear} of "
        f"{len(means)} l/w, and in {int((gain > 0).sum())} of {len(gain)} runs; the least mean "
        f"gain is {least:+.4f}"
    )
    answer: Answer = "undetermined"
    if any(mean.value <= 0 for mean in means):
        answer = "no"
    elif clear == len(means):
        answer = "yes"
    elif any(mean.count < 2 for mean in means):
        evidence += "; where there is one seed there is no error bar"
    return Verdict(question=question, answer=answer, evidence=evidence)


def _close_enough(stage: str, deviations: pd.DataFrame) -> Verdict:
    question = f"Is the mean absolute deviation of {stage} from Gravish at most "
    question += f"{ACCEPTED_DEVIATION:g} %?"
    found = deviations.loc[deviations["stage"] == stage]
    if found.empty:
        evidence = "Gravish has no point at these l/w"
        return Verdict(question=question, answer="undetermined", evidence=evidence)
    deviation = float(found["deviation [%]"].abs().mean())
    half_width = float(np.hypot.reduce(found["deviation 95 % [%]"])) / len(found)
    error = f"± {half_width:.1f} %" if math.isfinite(half_width) else "(without an error bar)"
    worst = found.loc[found["deviation [%]"].abs().idxmax()]
    reading = 100 * DIGITISING_ERROR / found["phi Gravish [-]"].mean()
    evidence = (
        f"{deviation:.1f} % {error} over {len(found)} points, {DEFINITION}; the largest is "
        f"{worst['deviation [%]']:+.1f} % at l/w = {worst[ASPECT]:g}; reading Gravish's points "
        f"is uncertain by about {reading:.1f} %"
    )
    answer: Answer = "yes" if deviation <= ACCEPTED_DEVIATION else "no"
    return Verdict(question=question, answer=answer, evidence=evidence)


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
        f"{len(manifests) + len(missing)} runs{lacking}; {len(counts)} aspect ratios, seeds "
        f"{seeds} ({per_ratio} per l/w); shaken for {', '.join(shaken)} s "
        f"(Gravish: {REFERENCE_SHAKE_TIME:g} s).",
        f"φ by {DEFINITION} unless named otherwise; before shaking and at the end of shaking, "
        f"means over the last {LAST_FRAMES} frames or fewer. {bars}.",
        "Reference: Gravish et al., PRL 108, 208001 (2012), digitised, "
        f"± {DIGITISING_ERROR:g} taken as the error of reading.",
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
    reference = (files("postprocess") / "reference" / _REFERENCE).read_bytes()
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
            "file": _REFERENCE,
            "sha256": hashlib.sha256(reference).hexdigest(),
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
