"""What the studies of shaken piles measure of a run: packing fraction and crossings before and after shaking."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from dem.errors import InputError
from dem.record.run import Run, SceneData
from postprocess.measures.packing import COSTLY_DEFINITIONS, DEFINITIONS
from postprocess.measures.table import LAST_FRAMES, packing_change, summarise_run
from postprocess.statistics.points import ASPECT, SEED
from studies.framework.plots import History
from studies.framework.runs import DEFINITION, duration

SHAKEN = "time shaken [s]"


STAGES: Mapping[str, str] = MappingProxyType(
    {
        "phi_0": "before shaking",
        "phi_f": "at the end of shaking",
        "phi_f relaxed": "after the relaxation that follows shaking",
    }
)
"""When a packing fraction is taken; each is a mean over the last frames of its phase."""

WHEN = f"before shaking and at the end of shaking, means over the last {LAST_FRAMES} frames or fewer"
"""How the stages are averaged, for footers."""

FRICTION = "friction [-]"

TIMES = (5.0, 10.0, 20.0)
"""When φ is taken in the course of shaking [s]."""

WINDOW = 1.0
"""Over how long before those times it is averaged [s]: 30 periods of shaking."""

_SHAKE, _SERIES = "shake", "packing_fraction"


def phi(stage: str, definition: str = DEFINITION) -> str:
    """Name the column of φ at a stage."""
    return f"{stage} {definition} [-]"


def at_time(time: float) -> str:
    """Name φ after some time of shaking [s]."""
    return f"phi {time:g} s"


def contact_of(run: Run) -> SceneData:
    """Read what the scene of a run says of its contacts.

    Raises:
        InputError: It says nothing.
    """
    contact: SceneData | None = run.scene.get("contact")
    if contact is None:
        msg = f"{run.path}: scene.yaml has no contact; give runs of a study of friction"
        raise InputError(msg)
    return contact


def common_friction(run: Run) -> float:
    """Read the one coefficient of friction of a run [-].

    Raises:
        InputError: Its walls have another one than its smarticles.
    """
    contact = contact_of(run)
    between, wall = contact["friction_smarticle"], contact["friction_wall"]
    if between != wall:
        msg = f"{run.path}: friction is {between:g} between smarticles, {wall:g} at walls; this study has one"
        raise InputError(msg)
    return float(between)


def timed_row(run: Run, known: Mapping[str, object]) -> dict[str, object]:
    """Measure φ by stage and in the course of shaking; columns known already come behind the aspect ratio."""
    history = packing_history(run)
    row = {**known, **measured_row(run, [DEFINITION])}
    for time in TIMES:
        if time <= history.active + 1e-6:
            shown = (history.times > time - WINDOW) & (history.times <= time + 1e-6)
            row[phi(at_time(time))] = float(np.mean(history.values[shown])) if shown.any() else float("nan")
    return {ASPECT: row.pop(ASPECT), **row}


def while_shaken(run: Run) -> History:
    """Read φ against the time since shaking began, as long as it went on."""
    history = packing_history(run)
    shaken = (history.times > 0) & (history.times <= history.active)
    return History(times=history.times[shaken], values=history.values[shaken], active=0.0)


def measured_row(run: Run, definitions: Sequence[str]) -> dict[str, object]:
    """One run's row: φ by each definition and the crossings before and after shaking, and what the run was.

    Args:
        run: A finished run.
        definitions: Of the packing fraction; `DEFINITION` is always among them. The costly ones
            are taken of the last frame alone, before and at the end of shaking.

    Raises:
        InputError: It was not shaken after another phase, or cannot be read.
    """
    shakes = [phase for phase in run.phases if phase.type == _SHAKE]
    if not shakes or shakes[0].index == 0:
        types = ", ".join(phase.type for phase in run.phases)
        msg = f"{run.path}: no shaking after another phase: its phases are {types}"
        raise InputError(msg)
    wanted = {"phi_0": shakes[0].index - 1, "phi_f": shakes[-1].index}
    if shakes[-1].index < run.phases[-1].index:
        wanted["phi_f relaxed"] = run.phases[-1].index
    cheap = [DEFINITION, *(set(definitions) - {DEFINITION} - COSTLY_DEFINITIONS)]
    summary = summarise_run(run, definitions=cheap, phases=set(wanted.values()))
    if summary.empty:
        msg = f"{run.path}: no frame of the phases around shaking; run it again"
        raise InputError(msg)
    table = summary.set_index("phase")
    for phase in wanted.values():
        if phase not in table.index:
            kind = run.phases[phase].type
            msg = f"{run.path}: no frame of phase {phase} ({kind}); run it again"
            raise InputError(msg)
    row: dict[str, object] = {
        ASPECT: round(run.manifest.aspect_ratio, 6),
        SEED: run.manifest.seed,
        "smarticles [-]": run.manifest.count,
        "fidelity": run.manifest.fidelity,
        SHAKEN: sum(map(duration, shakes)),
    }
    for definition in DEFINITIONS:
        if definition in cheap:
            for stage, phase in wanted.items():
                row[f"{stage} {definition} [-]"] = table.loc[phase, f"phi {definition} [-]"]
        elif definition in definitions:
            change = packing_change(run, definition=definition, last=1, activity={_SHAKE})
            row[f"phi_0 {definition} [-]"] = change.before.value
            row[f"phi_f {definition} [-]"] = change.after.value
    for stage, phase in wanted.items():
        row[f"{stage} {DEFINITION} SE in run [-]"] = table.loc[phase, f"phi {DEFINITION} SE [-]"]
    for name, stage in zip(("before", "after", "relaxed"), STAGES, strict=True):
        if stage in wanted:
            row[f"crossings {name} [-]"] = table.loc[wanted[stage], "crossings mean [-]"]
    row["escaped at the end [-]"] = table["escaped [-]"].iloc[-1]
    row["frames averaged [-]"] = int(table.loc[list(wanted.values()), "frames averaged"].min())
    row["scene_sha256"] = run.manifest.scene_sha256
    row["run"] = run.path.name
    return row


def packing_history(run: Run) -> History:
    """φ of a shaken run against the time since shaking began [-].

    Args:
        run: A finished run.

    Raises:
        InputError: It was not shaken, or recorded no φ.
    """
    shakes = [phase for phase in run.phases if phase.type == _SHAKE]
    start, end = (shakes[0].start_s, shakes[-1].end_s) if shakes else (None, None)
    series = run.series
    values = np.asarray(series[_SERIES], dtype=np.float64)
    if start is not None and end is not None:
        shown = (series["phase"] >= shakes[0].index - 1) & np.isfinite(values)
        if shown.any():
            return History(times=series.time[shown] - start, values=values[shown], active=end - start)
    msg = f"{run.path}: no packing fraction was recorded while shaking"
    raise InputError(msg)
