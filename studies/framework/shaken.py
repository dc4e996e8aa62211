"""Packing fraction φ and crossings ⟨N⟩ of piles before and after shaking, and Gravish's values of φ."""

import hashlib
import math
from collections.abc import Mapping, Sequence
from importlib.resources import files
from types import MappingProxyType

import numpy as np
import pandas as pd

from dem.errors import InputError
from dem.record.run import Run, SceneData
from postprocess.measures.packing import COSTLY_DEFINITIONS, DEFINITIONS, packing_of
from postprocess.measures.table import LAST_FRAMES, summarise_run
from postprocess.statistics.points import ASPECT
from studies.framework.figures import Histories, History, one_by_one
from studies.framework.provenance import Reference
from studies.framework.runs import DEFINITION, duration, last_columns, require_frames, run_columns

SHAKEN = "time shaken [s]"
SHAKE_TIME = 20.0  #: Time for which Gravish et al. shook [s]

DIGITISING_ERROR = 0.003  #: Assumed error of reading φ from Gravish's figure [-]

AT_REST = "phi_f at rest"
"""Stage at which φ_f is compared with Gravish: the last frame of the relaxation that follows shaking.

Gravish et al. vibrated staples in a container for 20 s and then removed the container (Physics World, 23 May 2012:
"Shaken staples stick together"), so that their φ_f is that of a pile at rest. Savoie et al. average φ_f of their
simulation while the pile is shaken (`changeInPhiAmp.m` of wsavoie/SmarticleSim).
"""

GRAVISH_COLUMNS: Mapping[str, str] = MappingProxyType(
    {"phi_0": "phi_initial", "phi_f": "phi_final", "phi_f relaxed": "phi_final", AT_REST: "phi_final"}
)  #: Column of `read_gravish` that each stage is compared with

_FILE = files("postprocess") / "reference" / "gravish2012_phi.csv"
_CITATION = "Gravish et al., PRL 108, 208001 (2012), digitised"
GRAVISH = Reference(
    statement=f"{_CITATION}; error of reading taken as ±{DIGITISING_ERROR:g}",
    facts={
        "file": _FILE.name,
        "sha256": hashlib.sha256(_FILE.read_bytes()).hexdigest(),
        "digitising_error": DIGITISING_ERROR,
    },
)

STAGES: Mapping[str, str] = MappingProxyType(
    {
        "phi_0": "before shaking",
        "phi_f": "at the end of shaking",
        "phi_f relaxed": "while the pile settles after shaking",
        AT_REST: "at rest after shaking",
    }
)  #: Stages at which a packing fraction is measured: means over the last frames of a phase, at rest the last frame

WHEN = f"before shaking and at the end of shaking, means over the last {LAST_FRAMES} frames or fewer"
"""Statement for footers on how φ_0 and φ_f are averaged."""

FRICTION = "friction [-]"

TIMES = (5.0, 10.0, 20.0)  #: Times since shaking began at which φ is measured [s]
WINDOW = 1.0  #: Time before each of `TIMES` over which φ is averaged [s]: 30 periods of shaking

_SHAKE, _SERIES = "shake", "packing_fraction"


def read_gravish() -> pd.DataFrame:
    """Read Gravish's digitised points: columns `l_over_w`, `phi_initial`, `phi_final` [-].

    A value is NaN if Gravish's figure has no point.
    """
    with _FILE.open(encoding="utf-8") as file:
        return pd.read_csv(file)


def gravish_at(aspect: float, stage: str) -> float:
    """Return Gravish's φ [-] at an aspect ratio and a stage (key of `GRAVISH_COLUMNS`); NaN if unknown."""
    points = read_gravish()
    same = np.isclose(points["l_over_w"], aspect, rtol=0, atol=1e-6)
    return float(points.loc[same, GRAVISH_COLUMNS[stage]].iloc[0]) if same.any() else math.nan


def gravish_note(aspects: Sequence[float]) -> str:
    """Return a statement for figures: source of Gravish's points, and aspect ratios without a point."""
    lacking = {
        stage: [f"{one:g}" for one in aspects if math.isnan(gravish_at(one, stage))] for stage in ("phi_0", "phi_f")
    }
    gaps = [f"no {stage.replace('phi', 'φ')} at l/w = {', '.join(some)}" for stage, some in lacking.items() if some]
    return f"{_CITATION}, read to ±{DIGITISING_ERROR:g}; {'; '.join(gaps) or 'at every l/w shown'}."


def phi(stage: str, definition: str = DEFINITION) -> str:
    """Return the name of the column of φ at a stage, by one of the definitions of φ (`DEFINITIONS`).

    A stage is a key of `STAGES`, such as `phi_0` before shaking, or a result of `at_time`.
    """
    return f"{stage} {definition} [-]"


def at_time(time: float) -> str:
    """Return the name of the stage at a time since shaking began [s], such as `phi 5 s`; see `phi`."""
    return f"phi {time:g} s"


def contact_of(run: Run) -> SceneData:
    """Return the entry `contact` of a run's scene; InputError if the scene has none."""
    contact: SceneData | None = run.scene.get("contact")
    if contact is None:
        raise InputError(f"{run.path}: scene.yaml has no contact; give runs of a study of friction")
    return contact


def common_friction(run: Run) -> float:
    """Return the coefficient of friction of a run [-]; InputError if it differs at walls."""
    contact = contact_of(run)
    between, wall = contact["friction_smarticle"], contact["friction_wall"]
    if between != wall:
        msg = (
            f"{run.path}: friction is {between:g} between smarticles, {wall:g} at walls; this study asks for equal ones"
        )
        raise InputError(msg)
    return float(between)


def timed_row(run: Run, known: Mapping[str, object]) -> dict[str, object]:
    """Measure φ and crossings before and after shaking, and φ at `TIMES` during it; return the run's row.

    `known` are columns of the row that the caller knows, such as friction. φ at a time is the mean over the `WINDOW`
    before it; times after the end of shaking have no column.
    """
    history = packing_history(run)
    row = {**known, **measured_row(run, [DEFINITION])}
    for time in TIMES:
        if time <= history.active + 1e-6:
            shown = (history.times > time - WINDOW) & (history.times <= time + 1e-6)
            row[phi(at_time(time))] = float(np.mean(history.values[shown])) if shown.any() else float("nan")
    return {ASPECT: row.pop(ASPECT), **row}


def while_shaken(run: Run) -> History:
    """Read φ [-] against time while the pile is shaken; InputError if φ was not recorded."""
    history = packing_history(run)
    shaken = (history.times > 0) & (history.times <= history.active)
    return History(times=history.times[shaken], values=history.values[shaken], active=0.0)


def measured_row(run: Run, definitions: Sequence[str]) -> dict[str, object]:
    """Measure φ and crossings ⟨N⟩ before and after shaking; return the run's row of the table of runs.

    φ is measured by `DEFINITION` and by all `definitions`. It is the mean over the last frames of a phase; by a
    definition of `COSTLY_DEFINITIONS` it is that of the last frame. InputError if no phase of shaking follows another
    phase, or a phase to be measured has no frame.
    """
    shakes = [phase for phase in run.phases if phase.type == _SHAKE]
    if not shakes or shakes[0].index == 0:
        types = ", ".join(phase.type for phase in run.phases)
        raise InputError(
            f"{run.path}: no phase of type shake after another phase: its phases are {types}; leave it out"
        )
    wanted = {"phi_0": shakes[0].index - 1, "phi_f": shakes[-1].index}
    if shakes[-1].index < run.phases[-1].index:
        wanted["phi_f relaxed"] = run.phases[-1].index
    cheap = [DEFINITION, *(set(definitions) - {DEFINITION} - COSTLY_DEFINITIONS)]
    require_frames(run, wanted.values())
    table = summarise_run(run, definitions=cheap, phases=set(wanted.values())).set_index("phase")
    row: dict[str, object] = {**run_columns(run), SHAKEN: sum(map(duration, shakes))}
    for definition in DEFINITIONS:
        if definition in cheap:
            for stage, phase in wanted.items():
                row[f"{stage} {definition} [-]"] = table.loc[phase, f"phi {definition} [-]"]
        elif definition in definitions:
            for stage in ("phi_0", "phi_f"):
                last = run.frames.in_phase(wanted[stage])[-1]
                row[f"{stage} {definition} [-]"] = packing_of(last, run, definition=definition)
    for stage, phase in wanted.items():
        row[f"{stage} {DEFINITION} SE in run [-]"] = table.loc[phase, f"phi {DEFINITION} SE [-]"]
    if "phi_f relaxed" in wanted:
        row[phi(AT_REST)] = packing_of(run.frames[-1], run, definition=DEFINITION)
    for name, stage in zip(("before", "after", "relaxed"), STAGES, strict=False):
        if stage in wanted:
            row[f"crossings {name} [-]"] = table.loc[wanted[stage], "crossings mean [-]"]
    row["escaped at the end [-]"] = table["escaped [-]"].iloc[-1]
    row["frames averaged [-]"] = int(table.loc[list(wanted.values()), "frames averaged"].min())
    return row | last_columns(run)


def packing_history(run: Run) -> History:
    """Read φ [-] of a run from the phase before shaking to the end; InputError if φ was not recorded."""
    shakes = [phase for phase in run.phases if phase.type == _SHAKE]
    start, end = (shakes[0].start_s, shakes[-1].end_s) if shakes else (None, None)
    series = run.series
    values = np.asarray(series[_SERIES], dtype=np.float64)
    if start is not None and end is not None:
        shown = (series["phase"] >= shakes[0].index - 1) & np.isfinite(values)
        if shown.any():
            return History(times=series.time[shown] - start, values=values[shown], active=end - start)
    raise InputError(f"{run.path}: no packing fraction was recorded while shaking; run it again")


PHI_TIME = Histories(
    name="phi_time",
    history=while_shaken,
    split=one_by_one(FRICTION, r"$\mu$ = {:g}".format),
    log=True,
    x_label="time since shaking began [s]",
    quantities={"": r"packing fraction $\phi$ [-]"},
)
