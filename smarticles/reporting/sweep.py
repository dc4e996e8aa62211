"""Pages of sweeps, studies, and results of studies."""

import csv
import json
import shlex
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import pandas as pd
from markupsafe import Markup

from dem.display import Steps, silent
from dem.errors import InputError, nearest
from dem.record.run import Run
from dem.scene.reading import load_scene
from dem.scene.scene import Scene
from postprocess.measures.entanglement import link_crossings
from postprocess.measures.registry import in_space, shown_quantities
from postprocess.statistics.points import RUNS, marked
from smarticles.command_line import format_cell
from smarticles.measuring import PHASE, follows, group_columns, grouped, has_frames, measured, states, values_in
from smarticles.reporting.charts import against_variable
from smarticles.reporting.page import Section, embedded, figure, listing, page, table, words
from smarticles.reporting.run import (
    accuracy_blocks,
    effect_blocks,
    frame_table,
    picture_blocks,
    provenance_table,
    scene_blocks,
    short_table,
    warning_blocks,
)
from studies.registry import Script, study_of
from templates.sweep.folder import Folder
from templates.sweep.sweep_file import SEED, load_sweep

PROVENANCE = "provenance.json"  #: File in every folder of results

# Captions of the tables that are shown unfolded.
_JUDGED = {"findings": "The paper's findings, one by one", "verdicts": "Questions and verdicts"}
_COMPARED = {"deviations": "Deviations from Gravish's points"}
_MAX_STILLS, _MAX_CURVES, _MAX_CHARTS, _MAX_PARTS = 4, 5, 4, 4
_LEAST_RUNS = 3  # for an interval that is worth its name


def sweep_page(
    folder: Folder, accuracy: Path | None, *, jobs: int, phase: str | None = None, progress: Steps = silent
) -> str:
    """Return the HTML page of a sweep or a study; `jobs` processes measure its runs.

    `accuracy` is the path of a table of measured errors; None: the table that ships. `phase` is the type of the phase
    whose means come first, or "last"; None: the last phase of rest. `progress` is called after each run that is
    measured or drawn.
    """
    runs = folder.status()
    known = study_of(folder.manifest.files)
    results = folder.path / "results"
    analysed = (results / PROVENANCE).is_file()
    varied = values_in(folder)
    scenes = _scenes(folder)
    first = next(iter(scenes), None)
    scene = scenes[first] if first else None
    scene_error = "This version cannot read the scenes of this sweep."
    rows = [[run.name, run.state, run.phase, run.time_s, run.cause] for run in runs if run.state != "done"]
    header = ["run", "state", "phase", "simulated [s]", "cause"]
    state = [table(f"Runs that are not done: {len(rows)}", header, rows)] if rows else []
    variables = [[name, ", ".join(map(format_cell, values)), str(len(values))] for name, values in varied.items()]
    if known is not None and not analysed:
        command = f"smarticles study {_options(folder, *known)} --analyse"
        state.append(words(f"The study has not been analysed yet; analyse it with: {command}", tone="note"))
    sections = (
        ("State", state),
        *(
            _result_sections(results)
            if analysed
            else _measured(folder, varied, jobs=jobs, phase=phase, progress=progress)
        ),
        ("Final states", _pictures(folder, progress)),
        ("Variables", [table("Variables and constants", ["name", "values", "number of values"], variables)]),
        (
            "Scene",
            [
                *([words(f"The scene of run {first}; other runs differ in the variables.")] if first else []),
                *scene_blocks(folder.scene(folder.entries[0]).parent, scene, scene_error),
                *(listing(name, text, folded=True) for name, text in folder.manifest.files.items()),
            ],
        ),
        ("Effects", effect_blocks(list(scenes.values()))),
        ("Settings and their accuracy", accuracy_blocks(scene, accuracy)),
        ("Warnings", warning_blocks({entry.name: folder.run(entry) for entry in folder.entries})),
        ("How to repeat it", _repeat(folder) + (_origin(results) if analysed else [])),
    )
    lead = [
        ("runs", str(len(runs))),
        *((state, str(number)) for state, number in Counter(run.state for run in runs).items()),
        ("variables", ", ".join(name for name, values in varied.items() if len(values) > 1) or "none"),
    ]
    return page(folder.name, "sweep" if known is None else "study", lead, sections, folder.path)


def _options(folder: Folder, study: Script, quick: bool) -> str:
    """Return the arguments of `smarticles study` that make this folder: name, variant, changed constants, directory."""
    shipped, made = load_sweep(study.sweep_file(quick=quick)).content.constants, folder.entries[0].values
    changed = [
        f"--{name} {shlex.quote(str(made[name]))}"
        for name in ("engine", "fidelity")
        if isinstance(made.get(name), str) and made[name] != shipped.get(name)
    ]
    variant = ["--quick"] if quick else []
    return " ".join([study.name, *variant, *changed, "--out", shlex.quote(folder.path.resolve().name)])


def results_page(folder: Path) -> str:
    """Return the HTML page of a folder of results of a study, without the runs."""
    origin = _provenance(folder)
    study = str(origin.get("study", folder.name))
    used, missing = (str(len(origin.get(key, []))) for key in ("runs", "missing"))
    lead = [("study", study), ("runs used", used), ("missing", missing)]
    sections = (*_result_sections(folder), ("How to repeat it", _origin(folder)))
    return page(f"{study}: results", "results of a study", lead, sections, folder)


def _scenes(folder: Folder) -> dict[str, Scene]:
    """Return the scenes that this version can read, by the names of the runs."""
    found = {}
    for entry in folder.entries:
        try:
            found[entry.name] = load_scene(folder.scene(entry))
        except InputError:
            continue
    return found


# -- measures ----------------------------------------------------------------------------------------------------------


def _measured(
    folder: Folder, varied: Mapping[str, Sequence[Any]], *, jobs: int, phase: str | None, progress: Steps
) -> list[Section]:
    """Measure a sweep with `jobs` processes; return sections of tables and charts of means over runs.

    Means are over finished runs with equal variables. `varied` has all values of each variable and constant. `phase` is
    that of `sweep_page`: its means come first and are drawn, those of other phases are folded.
    """
    if not any(has_frames(folder.run(entry)) for entry in folder.entries):
        return [("Result", [words("No run has frames yet.", tone="note")])]
    leading = _leading_phases(folder, phase)
    runs = measured([folder.path], costly="never", jobs=jobs, progress=progress)
    # Variables that are a function of another one, as the count may be of l/w, do not define groups.
    by: list[str] = []
    for name, values in varied.items():
        rows = [entry.values for entry in folder.entries]
        if name != SEED and len(values) > 1 and not any(follows(name, other, rows) for other in by):
            by.append(name)
    by = [name for name in by if name in runs.columns]
    means = grouped(runs, by, runs=states([folder.path]), intervals=True)
    first = max(leading & set(means["phase"]) or means["phase"])
    tables = []
    phases = means[list(PHASE)].drop_duplicates().itertuples(index=False, name=None)
    # The sort is stable, so that the other phases keep their order.
    for number, kind in sorted(phases, key=lambda one: one[0] != first):
        part = means[(means["phase"] == number) & (means["phase type"] == kind)]
        caption = f"Means over finished runs ± standard error, phase {number} ({kind}).{_few(part)}"
        tables.append(short_table(part, group_columns(means, by), caption, folded=number != first))
    final = means[means["phase"] == first]
    tables += [
        frame_table(
            means[[name for name in means.columns if " 95 % [" not in name]],
            "All phases and measures, means over finished runs",
        ),
        frame_table(runs.drop(columns=["scene_sha256"]), "All runs"),
    ]
    return [("Result", tables), ("Figures", _figures(final, by, varied, str(final["phase type"].iloc[0])))]


def _leading_phases(folder: Folder, wanted: str | None) -> set[int]:
    """Return the numbers of the phases of which the last one comes first, see `sweep_page`.

    InputError if no run has a phase of the type `wanted`.
    """
    plans = [Run(path).manifest.phases for entry in folder.entries if has_frames(path := folder.run(entry))]
    phases = [phase for plan in plans for phase in plan]
    if wanted is None:
        return {phase.index for phase in phases if phase.at_rest}
    types = dict.fromkeys(phase.type for phase in phases)
    if wanted not in (*types, "last"):
        raise InputError(f"--phase {wanted}: no run has a phase {wanted!r}; {nearest(wanted, [*types, 'last'])}")
    return {phase.index for phase in phases if wanted in (phase.type, "last")}


def _figures(final: pd.DataFrame, by: Sequence[str], varied: Mapping[str, Sequence[Any]], kind: str) -> list[Markup]:
    """Return charts against the variable with most values, with one curve per value of a second variable.

    There are separate charts for each combination of the other variables. The table `final` has means after the last
    phase, whose type is `kind`, such as "relax". Its columns `by` are the variables; `varied` has the values of each.
    """
    if not by:
        return []
    x_name, *others = sorted(by, key=lambda name: -len(varied[name]))
    curve_name = next((name for name in others if len(varied[name]) <= _MAX_CURVES), None)
    further = [name for name in others if name != curve_name]
    parts = list(final.groupby(further, sort=False)) if further else [((), final)]
    blocks: list[Markup] = []
    quantities = [
        (quantity, shown)
        for quantity, shown in shown_quantities()
        if quantity.header in final and final[quantity.header].nunique() > 1
    ]
    for (quantity, shown), (values, part) in product(quantities[:_MAX_CHARTS], parts[:_MAX_PARTS]):
        fixed = "".join(f", {name} = {value}" for name, value in zip(further, values, strict=True))
        groups = {}
        for value, group in [("all", part)] if curve_name is None else part.groupby(curve_name, sort=False):
            rows = group.sort_values(x_name)
            columns = quantity.header, marked(quantity.header, "95 %")
            means, half_widths = (shown.factor * rows[column] for column in columns)
            name = "all" if curve_name is None else f"{curve_name} = {value}"
            groups[name] = (rows[x_name].tolist(), means.tolist(), half_widths.tolist())
        heading = shown.heading if "[" in shown.heading else f"{shown.heading} [{quantity.unit}]"
        drawn = part[quantity.header] * shown.factor
        alt = f"{quantity.label} against {x_name}{fixed}, from {drawn.min():.3g} to {drawn.max():.3g}"
        caption = f"{heading}: {quantity.label} against {x_name}{fixed}, phase {kind}. Means over runs; bars: 95 % "
        caption += "intervals (Student's t)." + _few(part)
        blocks.append(figure(caption, alt, against_variable(x_name, heading, groups), "chart"))
    left_out = len(parts) - _MAX_PARTS
    return [*blocks, words(f"{left_out} more combinations are in the tables.", tone="note")] if left_out > 0 else blocks


def _few(means: pd.DataFrame) -> str:
    """Return a sentence about means of fewer than three runs, whose intervals are unknown or unreliable."""
    few = int((means[RUNS] < _LEAST_RUNS).sum())
    return f" {few} of {len(means)} points have fewer than {_LEAST_RUNS} runs." if few else ""


def _pictures(folder: Folder, progress: Steps) -> list[Markup]:
    """Return pictures of evenly chosen finished runs with one seed, and views all around the last run."""
    done = [entry for entry in folder.entries if folder.is_done(entry)]
    one_seed = [entry for entry in done if entry.values.get(SEED) == done[0].values.get(SEED)]
    count = min(_MAX_STILLS, len(one_seed))
    chosen = [one_seed[round(k * (len(one_seed) - 1) / max(count - 1, 1))] for k in range(count)]
    limits = _common_limits([Run(folder.run(entry)) for entry in chosen])
    blocks = []
    for number, entry in enumerate(chosen, start=1):
        blocks += picture_blocks(folder.run(entry), name=entry.name, turn=entry is chosen[-1], limits=limits)
        progress("runs drawn", number, len(chosen))
    return blocks


def _common_limits(runs: Sequence[Run]) -> tuple[float, float] | None:
    """Return the ends of one colour scale for pictures of several runs; None if there is none.

    The upper end is the largest number of links of other smarticles through one smarticle's plane, in the last frames
    of the runs; the lower end is 0. There is no scale if the number is 0, or if it cannot be counted in one of the
    runs.
    """
    try:
        if not all(has_frames(run.path) and in_space(run) for run in runs):
            return None
        most = max((int(link_crossings(run.frames[-1].vertices).max(initial=0)) for run in runs), default=0)
    except InputError:  # a damaged frame, or bodies of another shape
        return None
    return (0.0, float(most)) if most else None


def _repeat(folder: Folder) -> list[Markup]:
    manifest = folder.manifest
    used: Counter[str] = Counter()
    for entry in folder.entries:
        try:
            versions = Run(folder.run(entry)).manifest.made_by
        except InputError:
            continue
        used[", ".join(f"{name} {number}" for name, number in versions.items())] += 1
    runs = [[f"versions of {count} of {len(folder.entries)} runs", text] for text, count in used.items()]
    header = ["run", *folder.entries[0].values, "scene hash (SHA-256)"]
    points = [[entry.name, *map(str, entry.values.values()), entry.scene_sha256] for entry in folder.entries]
    again = f"smarticles resume {shlex.quote(folder.path.resolve().name)}"
    return [
        listing("The command of this sweep", manifest.command),
        listing("The command that computes the missing runs", again),
        provenance_table([["created", manifest.created], *runs], manifest.versions),
        table("All runs with variables and hashes of the scenes", header, points, folded=True),
    ]


# -- results of a study ------------------------------------------------------------------------------------------------


def _provenance(folder: Path) -> dict[str, Any]:
    try:
        origin = json.loads((folder / PROVENANCE).read_text(encoding="utf-8"))
        if not isinstance(origin, dict):
            raise TypeError(type(origin).__name__)
    except (OSError, ValueError, TypeError) as error:
        msg = f"{folder / PROVENANCE}: cannot be read ({error}); analyse the study again, smarticles study … --analyse"
        raise InputError(msg) from None
    return origin


def _result_sections(folder: Path) -> list[Section]:
    """Return the sections of results: findings, comparison with published data, figures and tables."""
    origin = _provenance(folder)
    tables = {file.stem: rows for file in sorted(folder.glob("*.csv")) if (rows := _csv(file))}

    def named(captions: Mapping[str, str]) -> list[Markup]:
        return [table(captions[name], *tables[name]) for name in captions if name in tables]

    sources = [str(line) for line in origin.get("footer", []) if str(line).startswith(("Reference:", "Note:"))]
    figures = {path.stem: path for suffix in (".png", ".svg") for path in sorted(folder.glob(f"*{suffix}"))}
    others = [
        table(f"{name}.csv, {len(rows)} rows", header, rows, folded=True)
        for name, (header, rows) in tables.items()
        if name not in (*_JUDGED, *_COMPARED) and rows
    ]
    pictures = []
    for stem, file in sorted(figures.items()):
        what = f"Figure “{stem.replace('_', ' ')}” of the study {origin.get('study', '?')}"
        pictures.append(figure(file.name, f"{what}; its numbers are in the tables below", embedded(file), "card wide"))
    compared = named(_COMPARED) + ([words(*sources)] if sources else [])
    return [("Findings", named(_JUDGED)), ("Comparison", compared), ("Figures", pictures), ("Tables", others)]


def _origin(folder: Path) -> list[Markup]:
    origin = _provenance(folder)
    header = ["name", "seed", "engine", "fidelity", "scene_sha256", "command"]
    rows = [[run.get(name) for name in header] for run in origin.get("runs", []) if isinstance(run, dict)]
    used = [table(f"The {len(rows)} analysed runs", header, rows, folded=True)] if rows else []
    return [words(*map(str, origin.get("footer", []))), *used]


def _csv(file: Path) -> tuple[list[str], list[list[str]]] | None:
    """Return header and rows of a CSV file without the comments at its end; None if the file is empty."""
    lines = file.read_text(encoding="utf-8", errors="replace").splitlines(keepends=True)
    while lines and lines[-1].startswith("#"):
        lines.pop()
    header, *rows = list(csv.reader(lines)) or [[]]
    filled = [[cell or "-" for cell in row] + ["-"] * (len(header) - len(row)) for row in rows if row]
    return (header, filled) if header else None
