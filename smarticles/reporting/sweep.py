"""What stands on the page of a sweep or a study."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dem.errors import InputError
from dem.plan.effects import decide
from dem.record.names import FRAME, collection
from dem.record.run import Run
from dem.scene.reading import load_scene
from postprocess.measures.registry import shown_quantities
from postprocess.statistics.points import marked
from smarticles.measuring import grouped, measured, values_in
from smarticles.reporting.accuracy import accuracy_blocks
from smarticles.reporting.charts import Points, against_variable
from smarticles.reporting.page import Block, Figure, Listing, Page, Section, Table, Words
from smarticles.reporting.results import PROVENANCE, read_results
from smarticles.reporting.run import scene_blocks, still_blocks, turntable_blocks, warning_blocks
from smarticles.reporting.tables import short_table, whole_table, word
from studies.registry import STUDIES
from templates.sweep.folder import Entry, Folder, RunStatus, count_states
from templates.sweep.sweep_file import SEED

if TYPE_CHECKING:
    import pandas as pd

    from dem.scene.scene import Scene

_MOST_STILLS = 4
_MOST_CURVES = 5
_DRAWN = 4  # quantities that are drawn against each variable


def sweep_page(folder: Folder, table: Path | None, made: str, *, jobs: int) -> Page:
    """The page of a sweep, or of a study with what its analysis found.

    Args:
        folder: its directory.
        table: measured errors, see `accuracy_blocks`.
        made: by what the page was made, for its footer.
        jobs: runs that are measured at once.

    Raises:
        InputError: a file of it is damaged.
    """
    states = folder.status()
    study = folder.name.removesuffix("-quick")
    results = folder.path / "results"
    analysed = (results / PROVENANCE).is_file()
    varied = values_in(folder)
    sections = read_results(results).sections() if analysed else _measured(folder, varied, jobs=jobs)
    scenes = _scenes(folder)
    first = next(iter(scenes), None)
    scene = scenes[first] if first else None
    runs = {entry.name: folder.run(entry) for entry in folder.entries}
    why_not = "This version cannot read the scenes of this sweep."
    return Page(
        title=folder.name,
        about="study" if study in STUDIES else "sweep",
        lead=_lead(states, varied),
        sections=(
            Section(title="State", blocks=_missing(states) + _not_analysed(study, folder, analysed=analysed)),
            *sections,
            Section(title="Final states", blocks=_stills(folder)),
            Section(title="What varies", blocks=_variables(varied)),
            Section(
                title="Scene",
                blocks=[
                    *([Words(lines=[f"Of run {first}; the others differ in what varies."])] if first else []),
                    *scene_blocks(folder.scene(folder.entries[0]).parent, scene, why_not),
                    *_files(folder),
                ],
            ),
            Section(title="Effects", blocks=_effects(scenes)),
            Section(title="Settings and their accuracy", blocks=accuracy_blocks(scene, table)),
            Section(title="Warnings", blocks=warning_blocks(runs)),
            Section(title="How to repeat it", blocks=_repeat(folder, results if analysed else None)),
        ),
        footer=f"Made by {made} from {folder.path.name}.",
    )


def _lead(states: Sequence[RunStatus], varied: Mapping[str, Sequence[Any]]) -> list[tuple[str, str]]:
    counts = count_states(list(states))
    names = [name for name, values in varied.items() if len(values) > 1]
    return [
        ("runs", str(len(states))),
        *((state, str(number)) for state, number in counts.items()),
        ("varies", ", ".join(names) or "nothing"),
    ]


def _independent(folder: Folder, varied: Mapping[str, Sequence[Any]]) -> list[str]:
    """Variables that vary and do not follow from one before, as a count does from l/w; without the seed."""
    kept: list[str] = []
    for name in (name for name, values in varied.items() if name != SEED and len(values) > 1):
        if not any(_follows(folder, name, other) for other in kept):
            kept.append(name)
    return kept


def _follows(folder: Folder, name: str, other: str) -> bool:
    """Whether runs that are alike in one variable are alike in another."""
    seen: dict[str, str] = {}
    pairs = ((str(entry.values.get(other)), str(entry.values.get(name))) for entry in folder.entries)
    return all(seen.setdefault(there, here) == here for there, here in pairs)


def _missing(states: Sequence[RunStatus]) -> list[Block]:
    rows = [
        [one.name, one.state, word(one.phase), word(one.time_s), word(one.cause)]
        for one in states
        if one.state != "done"
    ]
    if not rows:
        return []
    header = ["run", "state", "phase", "simulated [s]", "cause"]
    return [Table(caption=f"Runs that are not done: {len(rows)}", header=header, rows=rows)]


def _not_analysed(study: str, folder: Folder, *, analysed: bool) -> list[Block]:
    if analysed or study not in STUDIES:
        return []
    quick = " --quick" if folder.name.endswith("-quick") else ""
    command = f"smarticles study {study}{quick} --out {shlex.quote(folder.path.resolve().name)} --analyse"
    return [Words(lines=[f"The study has not been analysed; its findings come with: {command}"], tone="note")]


def _measured(folder: Folder, varied: Mapping[str, Sequence[Any]], *, jobs: int) -> list[Section]:
    """Means by what varies, and figures of them."""
    if not any((folder.run(entry) / collection(FRAME)).is_file() for entry in folder.entries):
        return [Section(title="Result", blocks=[Words(lines=["No run has frames yet."], tone="note")])]
    table = measured([folder.path], costly="never", jobs=jobs)
    by = [name for name in _independent(folder, varied) if name in table.columns]
    means = grouped(table, by)
    final = means[means["phase"] == means["phase"].max()]
    kind = final["phase type"].iloc[0]
    told = f"Means over runs ± standard error from run to run, phase {final['phase'].iloc[0]} ({kind})"
    return [
        Section(
            title="Result",
            blocks=[
                short_table(final, [*by, "runs [-]"], told),
                whole_table(means, "All phases and measures, means over runs"),
                whole_table(table.drop(columns=["scene_sha256"]), "All runs one by one"),
            ],
        ),
        Section(title="Figures", blocks=_figures(final, by, varied, str(kind))),
    ]


def _figures(final: pd.DataFrame, by: Sequence[str], varied: Mapping[str, Sequence[Any]], kind: str) -> list[Block]:
    """Each quantity against the variable with the most values, a curve for each value of another one."""
    if not by:
        return []
    across, *others = sorted(by, key=lambda name: -len(varied[name]))
    parted = next((name for name in others if len(varied[name]) <= _MOST_CURVES), None)
    if len(others) > (parted is not None):
        # Points of several other variables would lie on one line.
        return []
    blocks: list[Block] = []
    for quantity, shown in shown_quantities():
        if len(blocks) == _DRAWN:
            break
        if quantity.header not in final or final[quantity.header].nunique() < 2:
            continue
        groups = {}
        for value, group in [("all", final)] if parted is None else final.groupby(parted, sort=False):
            rows = group.sort_values(across)
            error = shown.factor * rows[marked(quantity.header, "SE")]
            name = "all" if parted is None else f"{parted} = {value}"
            groups[name] = (rows[across].tolist(), (shown.factor * rows[quantity.header]).tolist(), error.tolist())
        heading = shown.heading if "[" in shown.heading else f"{shown.heading} [-]"
        light, dark = against_variable(Points(variable=across, label=heading, groups=groups))
        alt = f"{quantity.label} against {across}, from {_range(final[quantity.header] * shown.factor)}"
        caption = f"{heading}: {quantity.label} against {across}, means over runs ± standard error, phase {kind}."
        blocks.append(Figure(caption=caption, alt=alt, light=light, dark=dark))
    return blocks


def _range(values: pd.Series) -> str:
    return f"{values.min():.3g} to {values.max():.3g}"


def _stills(folder: Folder) -> list[Block]:
    """Pictures of a few finished runs of one seed, spread over the sweep, and the last of them from all around."""
    done = [entry for entry in folder.entries if folder.is_done(entry)]
    if not done:
        return []
    seed = done[0].values.get(SEED)
    alike = [entry for entry in done if entry.values.get(SEED) == seed]
    count = min(_MOST_STILLS, len(alike))
    chosen = [alike[round(k * (len(alike) - 1) / max(count - 1, 1))] for k in range(count)]
    stills = [block for entry in chosen for block in still_blocks(folder.run(entry), caption=f"Run {entry.name}")]
    last = chosen[-1]
    return [*stills, *turntable_blocks(folder.run(last), caption=f"Run {last.name} from all around")]


def _variables(varied: Mapping[str, Sequence[Any]]) -> list[Block]:
    rows = [[name, ", ".join(map(word, values)), str(len(values))] for name, values in varied.items()]
    return [Table(caption="Variables and constants", header=["name", "values", "how many"], rows=rows)]


def _scenes(folder: Folder) -> dict[str, Scene]:
    """Scenes by the runs' names, of those that this version reads."""
    found = {}
    for entry in folder.entries:
        try:
            found[entry.name] = load_scene(folder.scene(entry))
        except InputError:
            continue
    return found


def _files(folder: Folder) -> list[Block]:
    """The files that the sweep was made of."""
    files = folder.manifest.files
    return [Listing(caption=name, text=text, folded=True) for name, text in files.items()]


def _effects(scenes: Mapping[str, Scene]) -> list[Block]:
    """In how many scenes each effect is on, and why in the first where it is."""
    decided = [decide(scene) for scene in scenes.values()]
    if not decided:
        return []
    on = Counter(str(effect.name) for effects in decided for effect in effects if effect.on)
    rows = []
    for number, effect in enumerate(decided[0]):
        told = next((effects[number] for effects in decided if effects[number].on), effect)
        rows.append([str(effect.name), f"{on[str(effect.name)]} of {len(decided)}", told.why, told.adds.to_text()])
    caption = "What acts, in how many of the scenes, and why; what is off is not constructed"
    return [Table(caption=caption, header=["effect", "on in", "why", "what it adds"], rows=rows)]


def _repeat(folder: Folder, results: Path | None) -> list[Block]:
    manifest = folder.manifest
    rows = [["made", manifest.created], *([f"version of {name}", one] for name, one in manifest.versions.items())]
    used = Counter(_made_by(folder, entry) for entry in folder.entries)
    rows += [[f"made {count} of {len(folder.entries)} runs", told] for told, count in used.items() if told]
    header = ["run", *folder.entries[0].values, "scene hash (SHA-256)"]
    points = [[one.name, *map(word, one.values.values()), one.scene_sha256] for one in folder.entries]
    again = f"smarticles resume {shlex.quote(folder.path.resolve().name)}"
    return [
        Listing(caption="The command that made it", text=manifest.command),
        Listing(caption="What computes the runs that are missing", text=again),
        Table(caption="What made it", header=["what", "value"], rows=rows),
        Table(caption="All runs, what varies, and the hashes of their scenes", header=header, rows=points, folded=True),
        *(read_results(results).origin_blocks() if results is not None else ()),
    ]


def _made_by(folder: Folder, entry: Entry) -> str:
    """Engine and versions of a run, in one line."""
    try:
        versions = Run(folder.run(entry)).manifest.versions
    except InputError:
        return ""
    return ", ".join(f"{name} {one}" for name, one in versions.items())
