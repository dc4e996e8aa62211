"""What stands on the page of a run."""

from __future__ import annotations

import io
import re
import shlex
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from dem.errors import InputError, RunError
from dem.plan.outlook import plan
from dem.record.columns import EVERY
from dem.record.names import FRAME, LOG, SCENE, SERIES, collection
from dem.record.run import Run, open_run
from dem.record.series import Series
from dem.scene.reading import load_scene
from smarticles.measuring import measured
from smarticles.reporting.accuracy import accuracy_blocks
from smarticles.reporting.charts import Curve, address, against_time, embedded
from smarticles.reporting.page import Block, Figure, Listing, Page, Section, Table, Turntable, Words
from smarticles.reporting.tables import short_table, whole_table, word

if TYPE_CHECKING:
    from dem.scene.scene import Scene

# What is drawn against time, if a run has it: column, factor and unit that it is shown in, and part of a vector.
_CURVES = (
    ("packing_fraction", 1.0, "", None),
    ("com_height_m", 1e3, "mm", None),
    ("kinetic_energy_J", 1e6, "µJ", None),
    ("hook_upper_force_N", 1.0, "N", 2),
    ("string_pulled_force_N", 1.0, "N", 0),
    ("motor_work_J", 1e6, "µJ", None),
    ("outside_count", 1.0, "", None),
)
_AXES = ("x", "y", "z")
_MOST_WARNINGS = 30


def run_page(directory: Path, table: Path | None, made: str) -> Page:
    """The page of a run, done or not.

    Args:
        directory: a run directory.
        table: measured errors, see `accuracy_blocks`.
        made: by what the page was made, for its footer.

    Raises:
        InputError: it is no run directory, or a file of it is damaged.
    """
    directory = directory.resolve()
    run = open_run(directory)
    scene, why_not = _scene(directory)
    return Page(
        title=run.manifest.name,
        about="run",
        lead=_lead(run),
        sections=(
            Section(title="Result", blocks=[*_ending(run), *_measures(directory)]),
            Section(title="Final state", blocks=[*still_blocks(directory), *turntable_blocks(directory)]),
            Section(title="Against time", blocks=_curves(run)),
            Section(title="Scene", blocks=scene_blocks(directory, scene, why_not)),
            Section(title="Effects", blocks=effect_blocks(scene)),
            Section(title="Settings and their accuracy", blocks=accuracy_blocks(scene, table)),
            Section(title="Warnings", blocks=warning_blocks({"": directory})),
            Section(title="How to repeat it", blocks=_repeat(run, directory)),
        ),
        footer=f"Made by {made} from {directory.name}.",
    )


def _scene(directory: Path) -> tuple[Scene | None, str]:
    """The scene of a run as this version reads it; None, and why not."""
    try:
        return load_scene(directory / SCENE), ""
    except InputError as error:
        return None, f"This version cannot read the scene of this run: {error}"


def _lead(run: Run) -> list[tuple[str, str]]:
    lead = [
        ("status", run.status.state),
        ("smarticles", str(run.manifest.count)),
        ("l/w", f"{run.manifest.aspect_ratio:g}"),
        ("engine", run.manifest.engine),
        ("fidelity", run.manifest.fidelity),
        ("seed", str(run.manifest.seed)),
    ]
    if run.status.time_s is not None:
        lead.append(("simulated", f"{run.status.time_s:.3g} s"))
    if run.status.wall_s is not None:
        lead.append(("computed in", f"{run.status.wall_s:.3g} s"))
    return lead


def _ending(run: Run) -> list[Block]:
    if run.status.state == "done":
        return []
    told = {"failed": "This run failed", "interrupted": "This run was interrupted"}
    cause = f": {run.status.cause}" if run.status.cause else ""
    return [Words(lines=[f"{told.get(run.status.state, 'This run has not finished')}{cause}."], tone="warning")]


def _measures(directory: Path) -> list[Block]:
    if not (directory / collection(FRAME)).is_file():
        return [Words(lines=["No frame has been recorded, so nothing is measured."], tone="note")]
    table = measured([directory])
    caption = "Means over the last 20 frames of each phase ± their standard error; voxel and voronoi at its last frame"
    return [
        short_table(table, ["phase type"], caption),
        whole_table(table.drop(columns=["run", "scene_sha256"]), "All measures of each phase"),
    ]


def still_blocks(directory: Path, *, caption: str = "") -> list[Block]:
    """A picture of the last frame of a run, or why there is none."""
    from postprocess.pictures.render import render_run  # noqa: PLC0415  (imports PyVista)

    if not (directory / collection(FRAME)).is_file():
        return []
    run = open_run(directory)
    with tempfile.TemporaryDirectory(prefix="smarticles-") as scratch:
        try:
            picture = embedded(render_run(directory, output=Path(scratch, "still.png"), size=(900, 900)))
        except (InputError, RunError) as error:
            return [Words(lines=[f"No picture: {error}"], tone="note")]
    kind = run.phases[-1].type if run.status.state == "done" else "its last frame"
    alt = f"The {run.manifest.count} smarticles of {run.manifest.name} at the end of {kind}, drawn as their true boxes"
    return [Figure(caption=caption or f"{alt}. Another view or time: smarticles render.", alt=alt, light=picture)]


def turntable_blocks(directory: Path, *, caption: str = "") -> list[Block]:
    """The last frame of a run from all around; nothing where there is no picture, see `still_blocks`."""
    from postprocess.pictures.render import turntable  # noqa: PLC0415  (imports PyVista)

    if not (directory / collection(FRAME)).is_file():
        return []
    try:
        views = []
        for image in turntable(directory):
            content = io.BytesIO()
            image.save(content, "WEBP", quality=80, method=4)
            views.append(address(content.getvalue(), "image/webp"))
    except (InputError, RunError):
        return []  # the still says why
    run = open_run(directory)
    alt = f"The last frame of {run.manifest.name} from all around"
    told = "Move the pointer across it, tap on it, or use the arrow keys: it turns."
    return [Turntable(caption=f"{caption or alt}. {told}", alt=alt, views=views, name="turntable")]


def _curves(run: Run) -> list[Block]:
    if not (run.path / SERIES).is_file():
        return []
    series = run.series
    spans = list(_spans(run, series))
    blocks: list[Block] = []
    for name, factor, unit, part in _CURVES:
        if name not in series.data:
            continue
        values = series[name] if part is None else series[name][:, part]
        label = EVERY[name].label if name in EVERY else name
        label += "" if part is None else f" {_AXES[part]}"
        curve = Curve(
            label=f"{label} [{unit or '-'}]", times=series.time, values=factor * values.astype(float), phases=spans
        )
        if not (abs(curve.values) > 0).any():
            continue
        light, dark = against_time(curve)
        last = curve.values[-1]
        alt = f"{label} against time, from {curve.values[0]:.3g} to {last:.3g} {unit}".rstrip()
        caption = f"{series.descriptions.get(name, label)}. Bands are phases."
        blocks.append(Figure(caption=caption[0].upper() + caption[1:], alt=alt, light=light, dark=dark))
    return blocks


def _spans(run: Run, series: Series) -> Iterator[tuple[float, float, str]]:
    """Start, end [s] and type of the phases that the series reaches."""
    for phase in run.phases:
        inside = series.time[series["phase"] == phase.index]
        if len(inside):
            start = float(inside[0]) if phase.start_s is None else phase.start_s
            yield start, float(inside[-1]) if phase.end_s is None else phase.end_s, phase.type


def scene_blocks(directory: Path, scene: Scene | None, why_not: str) -> list[Block]:
    """Phases as they are planned, and the scene as it stands in the directory."""
    blocks: list[Block] = []
    if scene is None:
        blocks.append(Words(lines=[why_not], tone="warning"))
    else:
        planned = plan(scene)
        rows = [
            [
                str(phase.index), phase.type,
                f"{phase.duration_s:.4g}" if phase.duration_s is not None else f"≈ {phase.estimate_s:.3g}",
                f"{phase.time_step_s:.3g}",
            ]
            for phase in planned.phases
        ]  # fmt: skip
        blocks.append(
            Table(caption="What happens", header=["phase", "type", "duration [s]", "time step [s]"], rows=rows)
        )
        blocks += [Words(lines=[f"Warning of the plan: {one}" for one in planned.warnings], tone="warning")]
    file = directory / SCENE
    if file.is_file():
        text = file.read_text(encoding="utf-8", errors="replace")
        blocks.append(Listing(caption="The scene, every default written out", text=text, folded=True))
    return blocks


def effect_blocks(scene: Scene | None) -> list[Block]:
    """Which effects a scene calls for, why, and what each adds."""
    if scene is None:
        return []
    rows = [
        [str(effect.name), "on" if effect.on else "off", effect.why, effect.adds.to_text()]
        for effect in plan(scene).effects
    ]
    caption = "What acts in this scene and why; what is off is not constructed"
    return [Table(caption=caption, header=["effect", "", "why", "what it adds"], rows=rows)]


def warning_blocks(directories: dict[str, Path]) -> list[Block]:
    """Warnings and errors of logs, those that repeat told once; by the runs' names, empty for one run alone."""
    found: Counter[tuple[str, str]] = Counter()
    for name, directory in directories.items():
        if (directory / LOG).is_file():
            for line in (directory / LOG).read_text(encoding="utf-8", errors="replace").splitlines():
                said = re.match(r"\S+ \S+ (WARNING|ERROR|CRITICAL) (.*)", line)
                if said:
                    found[(name, f"{said[1].lower()}: {said[2]}")] += 1
    if not found:
        return [Words(lines=["None in the logs."], tone="note")]
    by_text: dict[str, list[str]] = {}
    for (name, text), count in found.items():
        by_text.setdefault(text, []).append(f"{name} {count} ×".strip() if count > 1 else name)
    rows = [[text, ", ".join(filter(None, names))] for text, names in list(by_text.items())[:_MOST_WARNINGS]]
    more = len(by_text) - len(rows)
    caption = "Warnings of the logs" + (f", the first {_MOST_WARNINGS}; {more} more" if more > 0 else "")
    return [Table(caption=caption, header=["warning", "where"], rows=rows)]


def _repeat(run: Run, directory: Path) -> list[Block]:
    rows = [
        ["scene hash (SHA-256)", run.manifest.scene_sha256],
        ["seed", str(run.manifest.seed)],
        ["started", run.manifest.started],
        ["threads", word(run.manifest.threads)],
        *([f"version of {name}", version] for name, version in run.manifest.versions.items()),
    ]
    # From the folder that the directory is in: where that lies on this machine is nobody else's.
    here, there = shlex.quote(directory.name), shlex.quote(f"{directory.name}-again")
    again = f"smarticles run {here}/{SCENE} --out {there}\nsmarticles compare {here} {there}"
    told = "One thread gives the same bits with the same versions; smarticles compare tells whether it did."
    return [
        Listing(caption="The command of this run", text=run.manifest.command),
        Listing(caption="The same once more", text=again),
        Words(lines=[told if run.manifest.threads == 1 else "Several threads: the same numbers only within rounding."]),
        Table(caption="What made it", header=["what", "value"], rows=rows),
    ]  # fmt: skip
