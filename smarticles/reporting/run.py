"""Page of a run, and the parts that it shares with the page of a sweep."""

from __future__ import annotations

import io
import re
import shlex
import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from dem.errors import InputError, RunError
from dem.plan.choice import QUANTITIES, Error, read_table
from dem.plan.effects import decide
from dem.plan.outlook import plan
from dem.record.columns import EVERY
from dem.record.names import LOG, SCENE
from dem.record.run import Run, open_run
from dem.scene.reading import load_scene
from dem.setting.fidelity import fidelities
from postprocess.measures.registry import shown_quantities
from postprocess.statistics.points import marked, told_number
from smarticles.measuring import has_frames, measured
from smarticles.reporting.charts import against_time
from smarticles.reporting.page import address, embedded, figure, listing, page, table, turntable, word, words

if TYPE_CHECKING:
    import pandas as pd

    from dem.scene.scene import Scene

# Drawn against time, where a run has it: column, factor and unit that it is shown in, and component of a vector.
_CURVES = (
    ("packing_fraction", 1.0, "-", None),
    ("com_height_m", 1e3, "mm", None),
    ("kinetic_energy_J", 1e6, "µJ", None),
    ("hook_upper_force_N", 1.0, "N", 2),
    ("string_pulled_force_N", 1.0, "N", 0),
    ("motor_work_J", 1e6, "µJ", None),
    ("outside_count", 1.0, "-", None),
)
_MOST_WARNINGS = 30


def run_page(directory: Path, accuracy: Path | None) -> str:
    """Return the page of a run, done or not."""
    directory = directory.resolve()
    run, scene = open_run(directory), None
    why_not = ""
    try:
        scene = load_scene(directory / SCENE)
    except InputError as error:
        why_not = f"This version cannot read the scene of this run: {error}"
    made, status = run.manifest, run.status
    lead = [
        ("status", status.state),
        ("smarticles", str(made.count)),
        ("l/w", f"{made.aspect_ratio:g}"),
        ("engine", made.engine),
        ("fidelity", made.fidelity),
        ("seed", str(made.seed)),
        *([("simulated", f"{status.time_s:.3g} s")] if status.time_s is not None else []),
        *([("computed in", f"{status.wall_s:.3g} s")] if status.wall_s is not None else []),
    ]
    sections = (
        ("Result", [*_ending(run), *_measures(directory)]),
        ("Final state", picture_blocks(directory)),
        ("Against time", _curves(run)),
        ("Scene", scene_blocks(directory, scene, why_not)),
        ("Effects", effect_blocks([] if scene is None else [scene])),
        ("Settings and their accuracy", accuracy_blocks(scene, accuracy)),
        ("Warnings", warning_blocks({"": directory})),
        ("How to repeat it", _repeat(run)),
    )
    return page(made.name, "run", lead, sections, directory)


def _ending(run: Run) -> list[Markup]:
    if run.status.state == "done":
        return []
    ending = {"failed": "failed", "interrupted": "was interrupted"}.get(run.status.state, "has not finished")
    cause = f": {run.status.cause}" if run.status.cause else ""
    return [words(f"This run {ending}{cause}.", tone="warning")]


def _measures(directory: Path) -> list[Markup]:
    if not has_frames(directory):
        return [words("No frame has been recorded, so nothing is measured.", tone="note")]
    found = measured([directory])
    caption = "Means over the last 20 frames of each phase ± their standard error; voxel and voronoi at its last frame"
    whole = found.drop(columns=["run", "scene_sha256"])
    return [short_table(found, ["phase type"], caption), frame_table(whole, "All measures of each phase")]


def short_table(found: pd.DataFrame, named: Sequence[str], caption: str) -> Markup:
    """Return the quantities of short tables, as `mean ± SE`, from `measured` or `grouped`."""
    present = found.columns[found.notna().any()]
    wanted = [(quantity.header, shown) for quantity, shown in shown_quantities() if quantity.header in present]
    rows = [
        [
            *(row[name] for name in named),
            *(
                told_number(s.factor * row[name], s.form, s.factor * row.get(marked(name, "SE"), float("nan")))
                for name, s in wanted
            ),
        ]
        for row in found.to_dict("records")
    ]
    return table(caption, [*named, *(shown.heading for _, shown in wanted)], rows)


def frame_table(found: pd.DataFrame, caption: str) -> Markup:
    """Return all columns, folded."""
    return table(caption, list(found.columns), found.itertuples(index=False, name=None), folded=True)


def picture_blocks(directory: Path, *, name: str = "", turn: bool = True) -> list[Markup]:
    """Return a picture of a run's last frame, and one to turn, with its name; or why not."""
    from postprocess.pictures.render import render_run  # noqa: PLC0415  (imports PyVista)
    from postprocess.pictures.render import turntable as from_all_around  # noqa: PLC0415

    if not has_frames(directory):
        return []
    run = open_run(directory)
    views = []
    with tempfile.TemporaryDirectory(prefix="smarticles-") as scratch:
        try:
            still = embedded(render_run(directory, output=Path(scratch, "still.png"), size=(900, 900)))
            for image in from_all_around(directory) if turn else ():
                content = io.BytesIO()
                image.save(content, "WEBP", quality=80, method=4)
                views.append(address(content.getvalue(), "image/webp"))
        except (InputError, RunError) as error:
            return [words(f"No picture: {error}", tone="note")]
    moment = run.phases[-1].type if run.status.state == "done" else "its last frame"
    made = run.manifest
    shows = f"The {made.count} smarticles of {made.name} at the end of {moment}, drawn as their true boxes"
    caption = f"Run {name}" if name else f"{shows}. Another view or time: smarticles render."
    blocks = [figure(caption, shows, still, "card")]
    if views:
        around = f"The last frame of {made.name} from all around"
        how = "Move the pointer across it, tap on it, or use the arrow keys: it turns."
        blocks.append(turntable(f"{f'Run {name} from all around' if name else around}. {how}", around, views))
    return blocks


def _curves(run: Run) -> list[Markup]:
    if not run.has_series:
        return []
    series = run.series
    spans = []
    for phase in run.phases:
        inside = series.time[series["phase"] == phase.index]
        if len(inside):
            start = float(inside[0]) if phase.start_s is None else phase.start_s
            spans.append((start, float(inside[-1]) if phase.end_s is None else phase.end_s, phase.type))
    blocks = []
    for name, factor, unit, component in _CURVES:
        if name not in series.data:
            continue
        values = factor * (series[name] if component is None else series[name][:, component]).astype(float)
        if not (abs(values) > 0).any():
            continue
        label = EVERY[name].label + ("" if component is None else f" {'xyz'[component]}")
        alt = f"{label} against time, from {values[0]:.3g} to {values[-1]:.3g} {unit}".removesuffix(" -")
        caption = f"{series.descriptions.get(name, label)}. Bands are phases."
        picture = against_time(series.time, values, f"{label} [{unit}]", spans)
        blocks.append(figure(caption[0].upper() + caption[1:], alt, picture, "chart"))
    return blocks


def scene_blocks(directory: Path, scene: Scene | None, why_not: str) -> list[Markup]:
    """Return the phases as they are planned, and the scene file in a directory."""
    blocks = [words(why_not, tone="warning")] if scene is None else []
    if scene is not None:
        planned = plan(scene)
        rows = [
            [
                str(phase.index), phase.type,
                f"{phase.duration_s:.4g}" if phase.duration_s is not None else f"≈ {phase.estimate_s:.3g}",
                f"{phase.time_step_s:.3g}",
            ]
            for phase in planned.phases
        ]  # fmt: skip
        blocks.append(table("What happens", ["phase", "type", "duration [s]", "time step [s]"], rows))
        blocks += [words(f"Warning of the plan: {warning}", tone="warning") for warning in planned.warnings]
    file = directory / SCENE
    if file.is_file():
        text = file.read_text(encoding="utf-8", errors="replace")
        blocks.append(listing("The scene, every default written out", text, folded=True))
    return blocks


def effect_blocks(scenes: Sequence[Scene]) -> list[Markup]:
    """Return the effects that scenes call for: in how many each is on, and why in the first where it is."""
    rows = []
    for same in zip(*map(decide, scenes), strict=True):
        on = [effect for effect in same if effect.on]
        effect = (on or same)[0]
        state = f"{len(on)} of {len(same)}" if len(same) > 1 else "on" if on else "off"
        rows.append([effect.name, state, effect.why, effect.adds.to_text()])
    caption = "What acts and why; an effect that is off costs nothing"
    return [table(caption, ["effect", "on in scenes", "why", "what it adds"], rows)] if rows else []


def accuracy_blocks(scene: Scene | None, path: Path | None) -> list[Markup]:
    """Return the knobs of a scene's fidelity, and the measured errors of the named fidelities.

    Args:
        scene: None where it cannot be read.
        path: table of `smarticles accuracy`; None: the one that ships.
    """
    if scene is None:
        return []
    base = scene.fidelity.base
    named = fidelities(scene.engine)[base]
    knobs = scene.fidelity.model_dump(exclude={"base"})
    caption = f"Fidelity {base} on {scene.engine}, knob by knob"
    rows = [[knob, value, named.get(knob)] for knob, value in knobs.items()]
    blocks = [table(caption, ["knob", "here", f"{base} by name"], rows)]
    try:
        known = read_table(path, of=tuple(QUANTITIES))
    except InputError as error:
        return [*blocks, words(f"How large its errors are is not known here: {error}", tone="note")]
    here = [one for one in known.fidelities if (one.engine, one.fidelity) == (scene.engine, base)]
    caption = (
        f"Relative errors of named fidelities, measured with {known.count} smarticles of l/w = {known.aspect_ratio:g}, "
        f"{known.activity}, against {known.reference}; ± is the half-width of the 95 % interval over seeds"
    )
    rows = [
        [one.engine, one.fidelity, str(one.seeds), *map(_percent, one.errors), "this one" if one in here else ""]
        for one in known.fidelities
    ]
    notes = [] if here else [f"Fidelity {base} on {scene.engine} is not among those measured."]
    changed = [knob for knob, value in knobs.items() if knob in named and value != named[knob]]
    if changed:
        notes.append(f"This scene changes {', '.join(changed)}, which the table does not cover.")
    notes.append("These errors were measured on that pile; another pile, activity or quantity may err by more.")
    header = ["engine", "fidelity", "seeds", *QUANTITIES.values(), ""]
    return [*blocks, table(caption, header, rows), words(*notes, tone="note")]


def _percent(error: Error) -> str:
    return told_number(100 * error.value, "+.1f", 100 * error.band) + ("" if error.value != error.value else " %")


def warning_blocks(directories: Mapping[str, Path]) -> list[Markup]:
    """Return warnings and errors of logs, each once; by the runs' names, empty for one run alone."""
    found: dict[str, Counter[str]] = {}
    for name, directory in directories.items():
        log = directory / LOG
        for line in log.read_text(encoding="utf-8", errors="replace").splitlines() if log.is_file() else ():
            match = re.match(r"\S+ \S+ (WARNING|ERROR|CRITICAL) (.*)", line)
            if match:
                found.setdefault(f"{match[1].lower()}: {match[2]}", Counter())[name] += 1
    if not found:
        return [words("None in the logs.", tone="note")]
    rows = [
        [text, ", ".join(filter(None, (f"{name} {n} ×".strip() if n > 1 else name for name, n in counts.items())))]
        for text, counts in list(found.items())[:_MOST_WARNINGS]
    ]
    more = f", the first {_MOST_WARNINGS}; {len(found) - len(rows)} more" if len(found) > len(rows) else ""
    return [table(f"Warnings of the logs{more}", ["warning", "where"], rows)]


def provenance_table(facts: Sequence[Sequence[Any]], versions: Mapping[str, str]) -> Markup:
    """Return what made a run or sweep, facts first, then versions."""
    rows = [*facts, *([f"version of {name}", version] for name, version in versions.items())]
    return table("What made it", ["what", "value"], rows)


def _repeat(run: Run) -> list[Markup]:
    made = run.manifest
    # From the folder that the directory is in: its place on this machine is private.
    here, there = shlex.quote(run.path.name), shlex.quote(f"{run.path.name}-again")
    again = f"smarticles run {here}/{SCENE} --out {there}\nsmarticles compare {here} {there}"
    same = "One thread gives the same bits with the same versions; smarticles compare shows whether it did."
    facts = [
        ["scene hash (SHA-256)", made.scene_sha256],
        ["seed", str(made.seed)],
        ["started", made.started],
        ["threads", word(made.threads)],
    ]
    return [
        listing("The command of this run", made.command),
        listing("The same once more", again),
        words(same if made.threads == 1 else "Several threads: the same numbers only within rounding."),
        provenance_table(facts, made.versions),
    ]
