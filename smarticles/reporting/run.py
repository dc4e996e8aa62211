"""Page of a run, and blocks that pages of runs and sweeps share."""

import io
import re
import shlex
import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from dem.errors import InputError, RunError
from dem.plan.choice import QUANTITIES, Error, activity_of, read_table
from dem.plan.effects import decide
from dem.plan.outlook import plan
from dem.record.columns import EVERY
from dem.record.document import Kind, Manifest
from dem.record.names import LOG, SCENE
from dem.record.run import Run, open_run
from dem.scene.reading import load_scene
from dem.scene.scene import Scene
from postprocess.measures.packing import COSTLY_DEFINITIONS, DEFINITIONS, HEADINGS
from postprocess.measures.pile import POUR
from postprocess.measures.registry import Shown, shown_quantities
from postprocess.measures.table import LAST_FRAMES
from postprocess.report.series import spans_of
from postprocess.statistics.points import RUNS, counted, format_with_error, marked
from smarticles.measuring import has_frames, measured
from smarticles.reporting.charts import against_time
from smarticles.reporting.page import data_url, embedded, figure, listing, page, table, turntable, words

# Series drawn against time if recorded: column, unit conversion factor, unit, component of a vector.
_CURVES = (
    ("packing_fraction", 1.0, "-", None),
    ("com_height_m", 1e3, "mm", None),
    ("kinetic_energy_J", 1e6, "µJ", None),
    ("hook_upper_force_N", 1.0, "N", 2),
    ("string_pulled_force_N", 1.0, "N", 0),
    ("motor_work_J", 1e6, "µJ", None),
    ("outside_count", 1.0, "-", None),
)
_MAX_WARNINGS = 30
_MAX_REASONS = 5
_ENERGIES = (
    ("motor work [J]", Shown(heading="work of the motors since the start [mJ]", place=90, form=".3g", factor=1e3)),
    (
        "container work [J]",
        Shown(heading="work of the container since the start [mJ]", place=91, form=".3g", factor=1e3),
    ),
)


def run_page(directory: Path, accuracy: Path | None) -> str:
    """Return the HTML page of a finished or unfinished run.

    `accuracy` is the path of a table of measured errors; None: the table that ships.
    """
    directory = directory.resolve()
    run, scene = open_run(directory), None
    scene_error = ""
    try:
        scene = load_scene(directory / SCENE)
    except InputError as error:
        scene_error = f"This version cannot read the scene of this run: {error}"
    manifest, status = run.manifest, run.status
    lead = [
        ("status", status.state),
        *(
            [("smarticles", str(manifest.count)), ("l/w", f"{manifest.aspect_ratio:g}")]
            if manifest.kinds is None
            else [("bodies", f"{manifest.count} ({', '.join(dict.fromkeys(kind.shape for kind in manifest.kinds))})")]
        ),
        ("engine", manifest.engine),
        ("fidelity", manifest.fidelity),
        ("seed", str(manifest.seed)),
        *([("simulated", f"{status.time_s:.3g} s")] if status.time_s is not None else []),
        *([("computed in", f"{status.wall_s:.3g} s")] if status.wall_s is not None else []),
    ]
    sections = (
        ("Result", [*_ending(run), *_measures(directory)]),
        ("Final state", picture_blocks(directory)),
        ("Against time", _curves(run)),
        ("Scene", scene_blocks(directory, scene, scene_error)),
        ("Effects", effect_blocks([] if scene is None else [scene])),
        ("Settings and their accuracy", accuracy_blocks(scene, accuracy)),
        ("Warnings", warning_blocks({"": directory})),
        ("How to repeat it", _repeat(run)),
    )
    return page(manifest.name, "run", lead, sections, directory)


def _ending(run: Run) -> list[Markup]:
    if run.status.state == "done":
        return []
    ending = {"failed": "failed", "interrupted": "was interrupted"}.get(run.status.state, "has not finished")
    cause = f": {run.status.cause}" if run.status.cause else ""
    return [words(f"This run {ending}{cause}.", tone="warning")]


def _measures(directory: Path) -> list[Markup]:
    if not has_frames(directory):
        return [words("No frame has been recorded, so that there are no measures.", tone="note")]
    found = measured([directory])
    caption = f"Means over the last {LAST_FRAMES} frames of each phase ± standard error"
    if (found["phase type"] == POUR).any():
        caption += "; of a pour, frames of the settled pile alone"
    present = found.columns[found.notna().any()]
    costly = [name for name in DEFINITIONS if name in COSTLY_DEFINITIONS and f"phi {name} [-]" in present]
    if costly:
        caption += f"; {' and '.join(HEADINGS[name] for name in costly)}: last frame only"
    whole = found.drop(columns=["run", "scene_sha256"])
    return [short_table(found, ["phase type"], caption), frame_table(whole, "All measures of each phase")]


def short_table(found: pd.DataFrame, named: Sequence[str], caption: str, *, folded: bool = False) -> Markup:
    """Return a table of the main quantities of `measured` or `grouped` as `mean ± SE`.

    The columns `named` identify a row. A mean over fewer runs than the row's has their number, `(n = 2)`.
    """
    present = found.columns[found.notna().any()]
    wanted = [(quantity.header, shown) for quantity, shown in shown_quantities() if quantity.header in present]
    wanted += [(header, shown) for header, shown in _ENERGIES if header in present]
    rows = [
        [
            *(row[name] for name in named),
            *(
                format_with_error(s.factor * row[name], s.form, s.factor * row.get(marked(name, "SE"), float("nan")))
                + (f" (n = {number})" if 0 < (number := row.get(counted(name), 0)) < row[RUNS] else "")
                for name, s in wanted
            ),
        ]
        for row in found.to_dict("records")
    ]
    return table(caption, [*named, *(shown.heading for _, shown in wanted)], rows, folded=folded)


def frame_table(found: pd.DataFrame, caption: str) -> Markup:
    """Return a data frame as a folded table with all columns."""
    return table(caption, list(found.columns), found.itertuples(index=False, name=None), folded=True)


def picture_blocks(
    directory: Path, *, name: str = "", turn: bool = True, limits: tuple[float, float] | None = None
) -> list[Markup]:
    """Return HTML blocks with pictures of the last frame of a run.

    There is a note with the reason if pictures cannot be drawn, and no block if the run has no frames.

    Captions have the `name` of the run, except on its own page. `turn` adds views from all sides. `limits` are the ends
    of the colour scale of the picture; None: the extremes in it.
    """
    from postprocess.pictures.render import render_run  # noqa: PLC0415  (imports PyVista)
    from postprocess.pictures.render import turntable as draw_views  # noqa: PLC0415

    if not has_frames(directory):
        return []
    run = open_run(directory)
    views = []
    with tempfile.TemporaryDirectory(prefix="smarticles-") as scratch:
        try:
            still = embedded(render_run(directory, output=Path(scratch, "still.png"), size=(900, 900), limits=limits))
            for image in draw_views(directory) if turn else ():
                content = io.BytesIO()
                image.save(content, "WEBP", quality=80, method=4)
                views.append(data_url(content.getvalue(), "image/webp"))
        except (InputError, RunError) as error:
            return [words(f"No picture: {error}", tone="note")]
    manifest = run.manifest
    shows = f"The {_bodies(manifest)} of {manifest.name} {_moment(run)}, drawn as {drawn_as(manifest.kinds)}"
    caption = f"Run {name}" if name else f"{shows}. For other views or times use smarticles render."
    blocks = [figure(caption, shows, still, "card")]
    if views:
        around = f"The last frame of {manifest.name} from all sides"
        how = "Move the pointer across the picture, tap, or use the arrow keys to turn it."
        blocks.append(turntable(f"{f'Run {name} from all sides' if name else around}. {how}", around, views))
    return blocks


def _moment(run: Run) -> str:
    """Return in words when the last frame of a run was recorded."""
    frame = run.frames[-1]
    phase = run.phases[frame.phase]
    # Times of phases are exact, those in lists of frames have nine digits.
    if phase.end_s is not None and frame.time >= phase.end_s * (1 - 1e-8):
        return f"at the end of {phase.type}"
    return f"at {frame.time:.4g} s, in {phase.type}"


def _bodies(manifest: Manifest) -> str:
    return f"{manifest.count} {'smarticles' if manifest.kinds is None else 'bodies'}"


def drawn_as(kinds: Sequence[Kind] | None) -> str:
    """Return what pictures draw bodies of some kinds as: boxes, cylinders, or both; None: smarticles."""
    if kinds is None:
        return "boxes"
    return " and ".join(sorted({"cylinders" if kind.round else "boxes" for kind in kinds}))


def _curves(run: Run) -> list[Markup]:
    """Return charts of the recorded series against time; series that are always 0 are left out."""
    if not run.has_series:
        return []
    series, spans = run.series, spans_of(run)
    blocks = []
    for name, factor, unit, component in _CURVES:
        if name not in series.data:
            continue
        values = factor * (series[name] if component is None else series[name][:, component]).astype(float)
        caption = f"{series.descriptions.get(name, EVERY[name].label)}. Bands are phases."
        lifted = _lifted(run) if name == "packing_fraction" else []
        if lifted:
            values[np.isin(series["phase"], lifted)] = np.nan
            caption += " It is left out where grips or a raised hook hold bodies, or have dropped them."
        if not (abs(values) > 0).any():
            continue
        known = values[np.isfinite(values)]
        label = EVERY[name].label + ("" if component is None else f" {'xyz'[component]}")
        alt = f"{label} against time, from {known[0]:.3g} to {known[-1]:.3g} {unit}".removesuffix(" -")
        picture = against_time(series.time, values, f"{label} [{unit}]", spans)
        blocks.append(figure(caption[0].upper() + caption[1:], alt, picture, "chart"))
    return blocks


def _lifted(run: Run) -> list[int]:
    """Return the numbers of the phases in which bodies hang or fall, so that they are not one pile."""
    made = run.manifest
    return [phase.index for phase in made.phases if made.held(phase.index) or made.dropped(phase.index)]


def _plan_blocks(scene: Scene) -> list[Markup]:
    try:
        planned = plan(scene)
    except InputError as error:
        return [words(f"This version does not run the scene of this run: {error}", tone="warning")]
    rows = [
        [
            str(phase.index), phase.type,
            f"{phase.duration_s:.4g}" if phase.duration_s is not None else f"≈ {phase.estimate_s:.3g}",
            f"{phase.time_step_s:.3g}",
        ]
        for phase in planned.phases
    ]  # fmt: skip
    phases = table("Phases", ["phase", "type", "duration [s]", "time step [s]"], rows)
    return [phases, *(words(f"Warning of the plan: {warning}", tone="warning") for warning in planned.warnings)]


def scene_blocks(directory: Path, scene: Scene | None, scene_error: str) -> list[Markup]:
    """Return HTML blocks about a scene: table of phases, warnings of the plan, and text of the scene file.

    The folder has the scene file. `scene_error` replaces phases and warnings if this version cannot read the scene
    (None).
    """
    blocks = [words(scene_error, tone="warning")] if scene is None else _plan_blocks(scene)
    file = directory / SCENE
    if file.is_file():
        text = file.read_text(encoding="utf-8", errors="replace")
        blocks.append(listing("The scene with all defaults", text, folded=True))
    return blocks


def effect_blocks(scenes: Sequence[Scene]) -> list[Markup]:
    """Return a table of physical effects: whether each is computed, and why; no block without scenes.

    For several scenes, the table has the number of scenes in which an effect is computed.
    """
    rows = []
    for decisions in zip(*map(decide, scenes), strict=True):
        on = [effect for effect in decisions if effect.on]
        effect = (on or decisions)[0]
        reasons = list(dict.fromkeys(one.why for one in on or decisions))
        more = [f"and {len(reasons) - _MAX_REASONS} more reasons"] if len(reasons) > _MAX_REASONS else []
        state = f"{len(on)} of {len(decisions)}" if len(decisions) > 1 else "on" if on else "off"
        rows.append(
            [effect.name, state, "; ".join([*reasons[:_MAX_REASONS], *more]), effect.adds.to_text(internals=False)]
        )
    caption = "Effects and the reasons for each; an effect that is off is not computed"
    return (
        [table(caption, ["effect", "on in scenes", "reason", "what it records, and work besides the steps"], rows)]
        if rows
        else []
    )


def accuracy_blocks(scene: Scene | None, path: Path | None) -> list[Markup]:
    """Return tables of a scene's numerical parameters, and of the measured errors of the named fidelities.

    `path` is a table of measured errors by `smarticles accuracy`; None: the table that ships.
    """
    if scene is None:
        return []
    base, named = scene.fidelity.base, scene.named_knobs
    parameters = scene.fidelity.model_dump(exclude={"base"})
    caption = f"Numerical parameters of fidelity {base} on {scene.engine}"
    rows = [[name, value, named.get(name)] for name, value in parameters.items()]
    blocks = [table(caption, ["parameter", "this scene", base], rows)]
    try:
        known = read_table(path, of=tuple(QUANTITIES), activity=activity_of(scene))
    except InputError as error:
        return [*blocks, words(f"The errors of this fidelity are unknown: {error}", tone="note")]
    here = [entry for entry in known.fidelities if (entry.engine, entry.fidelity) == (scene.engine, base)]
    caption = (
        f"Relative errors of named fidelities, measured with {known.count} smarticles of l/w = {known.aspect_ratio:g}, "
        f"{known.activity}, against {known.reference}; ± is the half-width of the 95 % interval over seeds"
    )
    rows = [
        [
            entry.engine,
            entry.fidelity,
            str(entry.seeds),
            *map(_percent, entry.errors),
            "this run" if entry in here else "",
        ]
        for entry in known.fidelities
    ]
    notes = [] if here else [f"Fidelity {base} on {scene.engine} is not among those measured."]
    changed = [name for name, value in parameters.items() if name in named and value != named[name]]
    if changed:
        notes.append(f"This scene changes {', '.join(changed)}, which the table does not cover.")
    notes.append("The errors were measured on one pile; other piles, activities and quantities may have larger errors.")
    header = ["engine", "fidelity", "seeds", *QUANTITIES.values(), ""]
    return [*blocks, table(caption, header, rows), words(*notes, tone="note")]


def _percent(error: Error) -> str:
    return format_with_error(100 * error.value, "+.1f", 100 * error.band) + ("" if error.value != error.value else " %")


def warning_blocks(directories: Mapping[str, Path]) -> list[Markup]:
    """Return a table of the warnings and errors in the logs of runs; a single run has the name ""."""
    found: dict[str, Counter[str]] = {}
    for name, directory in directories.items():
        log = directory / LOG
        for line in log.read_text(encoding="utf-8", errors="replace").splitlines() if log.is_file() else ():
            match = re.match(r"\S+ \S+ (WARNING|ERROR|CRITICAL) (.*)", line)
            if match:
                found.setdefault(f"{match[1].lower()}: {match[2]}", Counter())[name] += 1
    if not found:
        return [words("The logs contain no warnings.", tone="note")]
    rows = [
        [text, ", ".join(filter(None, (f"{name} {n} ×".strip() if n > 1 else name for name, n in counts.items())))]
        for text, counts in list(found.items())[:_MAX_WARNINGS]
    ]
    more = f", the first {_MAX_WARNINGS}; {len(found) - len(rows)} more" if len(found) > len(rows) else ""
    return [table(f"Warnings of the logs{more}", ["warning", "runs"], rows)]


def provenance_table(facts: Sequence[Sequence[Any]], versions: Mapping[str, str]) -> Markup:
    """Return a table on the origin of a run or sweep: rows of fact and value, then versions of packages."""
    rows = [*facts, *([f"version of {name}", version] for name, version in versions.items())]
    return table("Origin", ["fact", "value"], rows)


def _repeat(run: Run) -> list[Markup]:
    manifest = run.manifest
    # Paths are relative to the parent folder, since a report may be sent to others.
    here, there = shlex.quote(run.path.name), shlex.quote(f"{run.path.name}-again")
    again = f"smarticles run {here}/{SCENE} --out {there}\nsmarticles compare {here} {there}"
    reproducible = "On one thread, equal versions give equal bits; smarticles compare checks it."
    facts = [
        ["scene hash (SHA-256)", manifest.scene_sha256],
        ["seed", str(manifest.seed)],
        ["started", manifest.started],
        *(list(fact) for fact in manifest.made_on.items()),
        *([f"resumed at {start.time_s:.4g} s", start.started] for start in manifest.makers[1:]),
    ]
    return [
        listing("The command of this run", manifest.command),
        listing("Commands that repeat and compare the run", again),
        words(reproducible if manifest.threads == 1 else "Results on several threads differ in the last bits."),
        provenance_table(facts, manifest.made_by),
    ]
