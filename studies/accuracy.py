"""Accuracy and cost of one scene, by variants that each change one numerical parameter (`knob` in tables).

A parameter has several values, its "rungs", from coarse to fine. The scene itself is the variant `base`; it is a rung
of every parameter, and is run once. Errors are relative to the reference of a parameter: its finest rung with finished
runs. Parameters of the model, such as restitution, have no accuracy but a sensitivity; their reference is the scene
itself. An error within the scatter between seeds is not resolved, which does not prove that it is 0.
"""

import argparse
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pandas as pd
import yaml
from matplotlib.ticker import LogLocator, NullLocator

from dem.errors import InputError, nearest
from dem.record.run import Run
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene
from dem.setting.fidelity import Fidelity, fidelities
from postprocess.measures.packing import DEFINITIONS
from postprocess.measures.pull import PULL, has_pull, peak, read_pull, weight_of_one
from postprocess.measures.table import LAST_FRAMES, summarise_run
from postprocess.report.figures import BLUE, GREY, ORANGE, style
from postprocess.statistics.points import ASPECT, SEED, SEEDS, format_with_error, marked, seeds_of
from postprocess.statistics.seeds import Scatter, mean_over_seeds, pooled_scatter, relative_difference
from studies.framework.figures import POOLED, Analysis, Means, finish, marker, one_by_one, panels
from studies.framework.findings import Finding, Outcome, Verdict, decide
from studies.framework.provenance import Reference
from studies.framework.runs import DEFINITION, ENGINE, Key, Quantity, Row, duration, last_columns, require_frames
from studies.framework.study import Study
from templates.sweep.render import Value, render_yaml
from templates.sweep.sweep_file import Sweep, SweepFile

BASE = "base"  #: Name of the variant that is the scene itself

KNOBS = ("time-step", "stiffness", "section", "restitution", "control", "hinge", "fidelity", "engine")
"""Parameters in the order of tables; `smarticles accuracy --help` explains them."""

ACTUATED = frozenset({"actuate", "shape-change", "internal-oscillation"})  #: Types of phases in which barbs move

ACTIVITIES = ACTUATED | {"shake"}
"""Types of phases that are activities; packing is compared before the first and after the last of them."""

_OF_MOTORS = frozenset({"control", "hinge"})
_ENGINES = ("yade", "links")
"""Engines from coarse to fine; links have smooth bodies and walls, so their converged results are the reference."""
# Fields of the fidelity that no parameter changes; a scene with its own time step is rejected.
_FIXED = frozenset({"wall_facets", "time_step_s"})
_STIFFNESSES = (125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0)
_CONVERGED = {"stiffness_N_per_m": 4000.0}
"""Changes to the finest named fidelity on links that make the reference of the parameters `fidelity` and `engine`."""
AIMS = {"draft": 8.0, "standard": 3.0, "reference": 1.5}
"""Largest error [%] that each named fidelity should have on links; results/accuracy-links says which are kept."""
_ROWS = {2: "two", 3: "three", 4: "four"}
_MOST_SEEDS = 1000
_TEMPLATE = Path("accuracy.yaml.j2")


@dataclass(frozen=True, kw_only=True)
class Rung:
    """One value of a parameter."""

    knob: str
    value: str  #: Value of the parameter, as text
    unit: str  #: Unit of the value; empty for a pure number or a name
    setting: str  #: Name of the variant of the scene; its runs are named SETTING_seedN

    @property
    def label(self) -> str:
        """Value with unit, as text."""
        return f"{self.value} {self.unit}".rstrip()

    @property
    def sensitivity(self) -> bool:
        """Whether the parameter is a physical one of the model, whose values have effects instead of errors."""
        return self.knob == "restitution"


@dataclass(frozen=True, kw_only=True)
class Ladder:
    """Rungs (values) of all parameters, and the variants of the scene that they need."""

    rungs: tuple[Rung, ...]  #: Rungs by parameter, from coarse to fine
    settings: Mapping[str, Mapping[str, Value]] = field(repr=False)  #: Variables of the template by variant
    left_out: tuple[str, ...] = ()  #: Rungs that the scene cannot have, with the reason, as text
    scenes: Mapping[str, Scene] = field(repr=False)  #: Scenes by variant

    @property
    def knobs(self) -> tuple[str, ...]:
        """Parameters that have rungs, in the order of tables."""
        return tuple(dict.fromkeys(rung.knob for rung in self.rungs))

    def references(self) -> dict[str, Rung]:
        """Return the reference of each parameter by its name: its finest rung.

        The reference of a physical parameter of the model (see `Rung.sensitivity`) is the scene's own value instead.
        """
        return {rung.knob: rung for rung in self.rungs if not rung.sensitivity or rung.setting == BASE}


VARIANT, KNOB, VALUE, UNIT, REFERENCE, VERDICT = "variant", "knob", "value", "unit", "reference", "verdict"
ACTIVITY, COUNT = "activity", "smarticles [-]"
COST, WALL = "processor time per simulated time of the last activity [s/s]", "wall time [s]"
"""The cost is a processor time, which other processes change less than the wall time; a run has one thread."""

EXPECTED = "processor time over expected wall time [-]"
RESIDUAL, GAP = "energy residual over dissipated [-]", "largest joint gap [m]"
TIME_STEP, SPHERES = "time step [s]", "spheres per smarticle [-]"

COMPARED = {
    "phi_0": f"phi_0 {DEFINITION} [-]",
    "phi_f": f"phi_f {DEFINITION} [-]",
    "height": "com height [m]",
    "crossings": "crossings [-]",
    "energy": "energy put in [J]",
    "hook_force": "peak hook force over n W_s [-]",
}
"""Compared quantities: column of the table of runs by short name.

The height is that of the centre of mass before the first activity. It is a mean over all smarticles and scatters half
as much as φ_0, which depends on a single smarticle near the top. The energy put in is the work of container and motors
in all activities; it needs `recording.energy`.
"""

SYMBOLS = {"phi_0": "φ_0", "phi_f": "φ_f", "height": "h_0", "crossings": "⟨N⟩", "energy": "E", "hook_force": "F_peak"}

RESOLVED, NOT_RESOLVED, IS_REFERENCE, UNKNOWN = "resolved", "not resolved", "reference", "unknown"
"""Verdicts on a rung: an error beyond its 95 % band; no such error; the reference itself; no band or no runs."""

_AVERAGED = (COST, WALL, EXPECTED, *COMPARED.values(), RESIDUAL, GAP)
_OF_SETTING = (ENGINE, TIME_STEP, SPHERES, ASPECT, COUNT, ACTIVITY)
_NAMED = re.compile(r"(?P<variant>.+)_seed(?P<seed>\d+)")


def default_seeds(scene: Scene) -> tuple[int, ...]:
    """Return the default seeds: 1 to 20 on the engine `links`, where runs are cheap, otherwise 1 to 3."""
    return tuple(range(1, 21 if scene.smooth else 4))


def parse_seeds(text: str) -> tuple[int, ...]:
    """Parse seeds from a text such as `1,2,3` or `1-20`.

    InputError if there is no seed, a seed is not a whole number from 0, or a seed is given twice.
    """
    words = [word.strip() for word in text.split(",") if word.strip()]
    if not words or not all(re.fullmatch(r"[0-9]{1,9}(-[0-9]{1,9})?", word) for word in words):
        raise InputError(f"--seeds {text!r}: must be whole numbers from 0, such as 1,2,3 or 1-20")
    seeds: list[int] = []
    for word in words:
        first, _, last = word.partition("-")
        if last and not 0 <= int(last) - int(first) < _MOST_SEEDS:
            raise InputError(f"--seeds {text}: {word} must be an ascending range of at most {_MOST_SEEDS} seeds")
        seeds += range(int(first), int(last or first) + 1)
    twice = next((seed for seed in seeds if seeds.count(seed) > 1), None)
    if twice is not None:
        raise InputError(f"--seeds {text}: {twice} is given twice, and would count twice; leave one out")
    return tuple(seeds)


def parse_knobs(text: str) -> tuple[str, ...]:
    """Parse known parameters from a text such as `time-step,section`, and return them in the order of `KNOBS`."""
    words = [word.strip() for word in text.split(",") if word.strip()]
    for word in words:
        if word not in KNOBS:
            raise InputError(f"--parameters: {word!r} does not exist; {nearest(word, KNOBS)}")
    if not words:
        raise InputError(f"--parameters {text!r}: names none; known: {', '.join(KNOBS)}")
    return tuple(knob for knob in KNOBS if knob in words)


def build_ladder(scene: Scene, *, source: str, knobs: Sequence[str] | None = None) -> Ladder:
    """Make the ladder of a scene: the rungs of some parameters, and the variants of the scene that they need.

    Rungs that the scene cannot have, such as two rows of spheres in a square section, are left out of the ladder; it
    lists them with the reason.

    `source` is the scene file, for messages. Parameters are by default all that change anything in this scene, except
    `engine`. InputError if the scene has no activity or sets the time step in seconds, or a given parameter changes
    nothing in it.
    """
    types = [phase.type for phase in scene.phases]
    driven = bool(ACTUATED & set(types))
    idle = next((knob for knob in knobs or () if knob in _OF_MOTORS and not driven), None)
    msg = ""
    if not ACTIVITIES & set(types):
        msg = (
            f"{source}: phases: {', '.join(types)}: no activity, so there is nothing to compare; "
            f"add a phase of type {', '.join(sorted(ACTIVITIES))}"
        )
    elif scene.fidelity.time_step_s is not None:
        msg = (
            f"{source}: fidelity.time_step_s: a fixed step of {scene.fidelity.time_step_s:g} s does not follow the "
            "parameters; give fidelity.time_step_fraction instead"
        )
    elif idle is not None:
        msg = (
            f"--parameters: {idle} changes nothing: no phase of {source} moves barbs ({', '.join(types)}); leave it out"
        )
    elif scene.smooth and "hinge" in (knobs or ()):
        msg = f"--parameters: hinge changes nothing: the engine {scene.engine} has no pins; leave it out"
    if msg:
        raise InputError(msg)
    useless = {"engine", *(() if driven else _OF_MOTORS), *(["hinge"] if scene.smooth else [])}
    turned = {key: getattr(scene.fidelity, key) for key in Fidelity.model_fields if key not in _FIXED}
    base = {"engine": scene.engine, **turned, "restitution": scene.contact.restitution}
    template = _template(scene)
    settings: dict[str, Mapping[str, Value]] = {BASE: base}
    scenes: dict[str, Scene] = {BASE: scene}
    rungs: list[Rung] = []
    left_out: list[str] = []
    for knob in knobs or [knob for knob in KNOBS if knob not in useless]:
        for value, unit, name, changes in _rungs(knob, base, smooth=scene.smooth):
            values = {**base, **changes}
            # Variants that differ only in the name of their fidelity are equal.
            decisive = {key: one for key, one in values.items() if key != "base"}
            setting = next((known for known, there in settings.items() if _same(decisive, there)), name)
            if setting not in settings:
                data = {**values, "title": scene.name, SEED: scene.seed}
                try:
                    scenes[setting] = parse_scene(render_yaml(template, data, source), source=source)
                except InputError as error:
                    left_out.append(f"{knob} {value}: {error}")
                    continue
                settings[setting] = values
            rungs.append(Rung(knob=knob, value=value, unit=unit, setting=setting))
    return Ladder(rungs=tuple(rungs), settings=settings, left_out=tuple(left_out), scenes=scenes)


def affordable(ladder: Ladder, expected_s: Mapping[str, float], most_s: float) -> Ladder:
    """Return a ladder without the variants that are expected to run longer than `most_s` [s].

    The scene itself is always kept.
    """
    dear = {setting for setting, wall in expected_s.items() if wall > most_s and setting != BASE}
    lines = [
        f"{rung.knob} {rung.label}: a run is expected to take {expected_s[rung.setting] / 3600:.2g} h, "
        f"more than {most_s / 3600:.2g} h"
        for rung in ladder.rungs
        if rung.setting in dear
    ]
    return replace(
        ladder,
        rungs=tuple(rung for rung in ladder.rungs if rung.setting not in dear),
        settings={name: values for name, values in ladder.settings.items() if name not in dear},
        left_out=(*ladder.left_out, *lines),
        scenes={name: scene for name, scene in ladder.scenes.items() if name not in dear},
    )


def ladder_sweep(scene: Scene, ladder: Ladder, seeds: Sequence[int]) -> Sweep:
    """Make the sweep of a ladder: every variant at every seed, seed by seed."""
    data = {
        "schema_version": 1,
        "name": "accuracy",
        "template": str(_TEMPLATE),
        "run_name": "{{ setting }}_seed{{ seed }}",
        "constants": {"title": scene.name},
        "points": {"list": [{"setting": name, **values} for name, values in ladder.settings.items()]},
        "repeats": {"seeds": list(seeds), "seed_by_seed": True},
    }
    return Sweep(
        path=Path("accuracy.yaml"),
        text=yaml.safe_dump(data, sort_keys=False, allow_unicode=True),
        content=SweepFile.model_validate(data),
        template=_TEMPLATE,
        template_text=_template(scene),
    )


def _template(scene: Scene) -> str:
    """Return the text of the scene as a template, with a variable for each value that a parameter changes."""
    data = scene.model_dump(mode="json")
    data |= {"name": "{{ title }}", SEED: "{{ seed }}", "engine": "{{ engine }}"}
    data["contact"]["restitution"] = "{{ restitution }}"
    data["fidelity"] |= {key: f"{{{{ {key} }}}}" for key in data["fidelity"] if key not in _FIXED}
    text = str(yaml.safe_dump(data, sort_keys=False, allow_unicode=True))
    # Without quotes the value of a variable keeps its type in YAML.
    return re.sub(r"'(\{\{ \w+ \}\})'", r"\1", text)


def _same(one: Mapping[str, Value], other: Mapping[str, Value]) -> bool:
    return all(_equal(value, other[name]) for name, value in one.items())


def _equal(one: Value, other: Value) -> bool:
    if isinstance(one, float | int) and isinstance(other, float | int):
        return math.isclose(one, other, rel_tol=1e-9)
    return bool(one == other)


_Point = tuple[str, str, str, dict[str, Value]]
"""Value and unit of a rung as text, name of its variant, and the variables that differ from the scene."""


def _rungs(knob: str, base: Mapping[str, Value], *, smooth: bool) -> list[_Point]:
    """Return all rungs (values) of a parameter, from coarse to fine.

    `base` has the scene's own values; `smooth`: links are swept by spheres, and are not chains of spheres.
    """
    if knob == "section":
        return _strands(base) if smooth else _sections(base)
    if knob == "fidelity":
        engine = str(base["engine"])
        return [(name, "", f"{engine}-{name}" if smooth else name, all_) for name, all_ in _names(engine).items()]
    if knob == "engine":
        return [(f"{one} {name}", "", f"{one}-{name}", all_) for one in _ENGINES for name, all_ in _names(one).items()]
    key, unit, values, fine = {
        "time-step": ("time_step_fraction", "", (0.9, 0.45, 0.225), "small"),
        "restitution": ("restitution", "", (0.2, 0.5, 0.7, 0.9), "large"),
        "control": ("control_interval_s", "s", (4e-4, 2e-4, 1e-4), "small"),
        "stiffness": ("stiffness_N_per_m", "N/m", _STIFFNESSES if smooth else (), "large"),
        "hinge": ("hinge_stiffness_N_per_m", "N/m", (), "large"),
    }[knob]
    own = base[key]
    if not values:
        return [(f"{own * n:g}", unit, f"{knob}-x{n}", {key: own * n}) for n in (1, 2, 4)]
    every = sorted([*(value for value in values if not _equal(value, own)), own], reverse=fine == "small")
    return [(f"{value:g}", unit, f"{knob}-{value:g}", {key: value}) for value in every]


def _names(engine: str) -> dict[str, dict[str, Value]]:
    """Return the variables of each named fidelity of an engine, from coarse to fine."""
    shared: dict[str, Value] = {"engine": engine, "diameter_m": None}
    found = {name: {**shared, "base": name, **knobs} for name, knobs in fidelities(engine).items()}
    if engine == _ENGINES[-1]:
        found["converged"] = {**list(found.values())[-1], **_CONVERGED}
    return found


def _sections(base: Mapping[str, Value]) -> list[_Point]:
    """Return the rungs of the parameter "section" for chains of spheres; a rung sets rows and pitch.

    Rows of spheres lie side by side in a bar. The pitch is the distance of neighbouring spheres over their diameter,
    and the diameter has its default for these rows. The scene's own rows and pitch, from `base`, are a rung as well. If
    it has several rows, there are two finer rungs: half of its pitch, and twice its rows.
    """
    shapes: list[dict[str, Value]] = [{"rows": 1, "pitch": pitch, "diameter_m": None} for pitch in (1.3, 1.0, 0.5)]
    shapes.append({"rows": 2, "pitch": 1.0, "diameter_m": None})
    own = {key: base[key] for key in shapes[0]}
    if own["rows"] > 1:
        finer = [{**own, "pitch": own["pitch"] / 2}, {**own, "rows": min(2 * own["rows"], max(_ROWS))}]
        shapes += [shape for shape in finer if not _same(shape, own)]
    if not any(_same(own, shape) for shape in shapes):
        shapes.append(own)
    points = []
    for shape in sorted(shapes, key=lambda shape: (shape["rows"], -shape["pitch"])):
        name = f"pitch {shape['pitch']:g}"
        if shape["rows"] > 1:
            name = f"{_ROWS[shape['rows']]} rows" + (f" of {name}" if shape["pitch"] != 1 else "")
        points.append(_shaped(name, shape))
    return points


def _strands(base: Mapping[str, Value]) -> list[_Point]:
    """Return the rungs of the parameter "section" for smooth bodies; a rung sets the number of strands.

    Strands are swept spheres that lie side by side and represent a bar. The rungs are 1, 2 and 3 strands, and the
    scene's own number and diameter, from `base`, if they differ from these.
    """
    shapes: list[dict[str, Value]] = [{"rows": rows, "diameter_m": None} for rows in (1, 2, 3)]
    own = {key: base[key] for key in shapes[0]}
    if not any(_same(own, shape) for shape in shapes):
        shapes.append(own)
    shapes.sort(key=lambda shape: shape["rows"] or 0)
    return [_shaped(f"{shape['rows']} strand{'' if shape['rows'] == 1 else 's'}", shape) for shape in shapes]


def _shaped(name: str, shape: dict[str, Value]) -> _Point:
    """Return a rung of the parameter "section"; its name states the diameter if `shape` sets it."""
    name += "" if shape["diameter_m"] is None else f" d {1e3 * shape['diameter_m']:g} mm"
    return name, "", re.sub(r"[^A-Za-z0-9.]+", "-", name), shape


def measure(run: Run, expected_s: Mapping[str, float]) -> Row:
    """Measure the cost and the compared quantities of a run; return its row in the table of runs.

    The name of the run directory must be VARIANT_seedN. `expected_s` has the known expected wall times [s] by name of
    the run directory.
    """
    active = [phase for phase in run.phases if phase.type in ACTIVITIES]
    if not active or active[0].index == 0:
        types = ", ".join(phase.type for phase in run.phases)
        raise InputError(f"{run.path}: no activity after another phase: its phases are {types}; leave it out")
    named = _NAMED.fullmatch(run.path.name)
    if named is None or int(named["seed"]) != run.manifest.seed:
        msg = f"{run.path}: not named SETTING_seed{run.manifest.seed}, as runs of a ladder are; do not rename runs"
        raise InputError(msg)
    last = active[-1]
    # The pile is measured at rest if the scene lets it come to rest after its last activity.
    rested = next((phase.index for phase in run.phases[last.index + 1 :] if phase.at_rest), last.index)
    wanted = [active[0].index - 1, rested]
    require_frames(run, wanted)
    table = summarise_run(run, definitions=[DEFINITION], phases=set(wanted)).set_index("phase")
    before, after = (table.loc[phase] for phase in wanted)
    time, expected = duration(last), expected_s.get(run.path.name, math.nan)
    cpu = math.fsum(_or_nan(phase.cpu_s) for phase in run.phases)
    phi = f"phi {DEFINITION}"
    return {
        VARIANT: named["variant"],
        SEED: run.manifest.seed,
        ASPECT: round(run.manifest.aspect_ratio, 6),
        COUNT: run.manifest.count,
        ACTIVITY: " ".join(dict.fromkeys(phase.type for phase in active)),
        ENGINE: run.manifest.engine,
        "fidelity": run.manifest.fidelity,
        TIME_STEP: run.manifest.time_step_s,
        # Smooth links have spheres only in pictures.
        SPHERES: run.manifest.spheres_per_smarticle if run.manifest.engine == "yade" else math.nan,
        COST: _or_nan(last.cpu_s) / time if time > 0 else math.nan,
        WALL: _or_nan(run.status.wall_s),
        EXPECTED: cpu / expected if expected > 0 else math.nan,
        COMPARED["phi_0"]: before[f"{phi} [-]"],
        COMPARED["phi_f"]: after[f"{phi} [-]"],
        f"phi_f {DEFINITION} SE in run [-]": after[f"{phi} SE [-]"],
        COMPARED["height"]: before["com height [m]"],
        COMPARED["crossings"]: after["crossings mean [-]"],
        **_of_series(run, [phase.index for phase in active]),
        "escaped at the end [-]": after["escaped [-]"],
        "frames averaged [-]": int(table["frames averaged"].min()),
        **last_columns(run),
    }


def _or_nan(number: float | None) -> float:
    return math.nan if number is None else number


def _of_series(run: Run, active: Sequence[int]) -> dict[str, float]:
    """Return peak hook force, energies and largest hinge gap of a run, by column; NaN if not recorded.

    The energy put in is added up over the phases whose indices are `active`.
    """
    names = (COMPARED["hook_force"], COMPARED["energy"], RESIDUAL, GAP)
    found = dict.fromkeys(names, math.nan)
    if not (run.path / "series.h5").exists():
        return found
    series = run.series
    pulled = [phase.index for phase in run.phases if phase.type == PULL]
    if pulled and has_pull(series, pulled[0]):
        highest = peak(read_pull(run, series, pulled[0])).force
        found[COMPARED["hook_force"]] = highest / (run.manifest.count * weight_of_one(run))
    data = series.data
    if "container_work_J" in data:
        work, phases = data["container_work_J"] + data.get("motor_work_J", 0.0), data["phase"]
        found[COMPARED["energy"]] = math.fsum(work[phases == one][-1] - work[phases < one][-1] for one in active)
    if "energy_residual_J" in data and "dissipated_energy_J" in data:
        residual, dissipated = data["energy_residual_J"], data["dissipated_energy_J"]
        known = np.isfinite(residual) & np.isfinite(dissipated)
        if known.any() and dissipated[known][-1] > 0:
            found[RESIDUAL] = float(abs(residual[known][-1]) / dissipated[known][-1])
    if "joint_gap_m" in data and np.isfinite(data["joint_gap_m"]).any():
        found[GAP] = float(np.nanmax(data["joint_gap_m"]))
    return found


def work_precision(runs: pd.DataFrame, rungs: Sequence[Rung]) -> pd.DataFrame:
    """Compare each rung with the reference of its parameter.

    The table has one row per rung, from coarse to fine within a parameter; NaN for a rung without runs. Columns: cost
    and means over seeds with their standard errors `… SE`; `… error [%]`, relative to the mean of the reference; `…
    error 95 % [%]`, the band of the error; `… resolved`, whether the error is beyond its band; `verdict`, whether any
    error of the rung is resolved. The band is half of the 95 % interval by Student's t, with the scatter pooled over
    all variants. The reference has the error 0 and the band of its own mean.
    """
    groups = {rung.setting: runs[runs[VARIANT] == rung.setting] for rung in rungs}
    scatters = {name: pooled_scatter(group[column] for group in groups.values()) for name, column in COMPARED.items()}
    rows = []
    for knob in dict.fromkeys(rung.knob for rung in rungs):
        own = [rung for rung in rungs if rung.knob == knob]
        able = [rung for rung in reversed(own) if not rung.sensitivity or rung.setting == BASE]
        # The finest rung with two finished runs; if there is none, the finest with one.
        reference = next((one.setting for n in (2, 1) for one in able if len(groups[one.setting]) >= n), "")
        rows += [_rung_row(rung, groups, reference, scatters) for rung in own]
    return pd.DataFrame(rows)


def _rung_row(
    rung: Rung, groups: Mapping[str, pd.DataFrame], reference: str, scatters: Mapping[str, Scatter]
) -> dict[str, object]:
    group, own = groups[rung.setting], reference == rung.setting
    row: dict[str, object] = {
        KNOB: rung.knob,
        VALUE: rung.value,
        UNIT: rung.unit,
        VARIANT: rung.setting,
        REFERENCE: reference,
        "sensitivity": rung.sensitivity,
        **seeds_of(group),
    }
    row |= {name: group[name].iloc[0] if len(group) else math.nan for name in _OF_SETTING}
    for name in _AVERAGED:
        mean = mean_over_seeds(group[name])
        row |= {name: mean.value, marked(name, "SE"): mean.standard_error}
        if name == COST:
            row[marked(name, "95 %")] = mean.half_width
    clear, known = [], []
    for name, column in COMPARED.items():
        base = mean_over_seeds(groups[reference][column] if reference else [])
        error = relative_difference(mean_over_seeds(group[column]), base, scatter=scatters[name])
        # The difference of the reference's mean to itself would have √2 times the band of that mean.
        value, band = (0.0, error.half_width / math.sqrt(2)) if own else (error.value, error.half_width)
        clear.append(not own and abs(value) > band)
        known.append(math.isfinite(band))
        row |= {f"{name} error [%]": value, f"{name} error 95 % [%]": band, f"{name} resolved": clear[-1]}
    row[VERDICT] = IS_REFERENCE if own else RESOLVED if any(clear) else NOT_RESOLVED if any(known) else UNKNOWN
    return row


def _label(row: pd.Series) -> str:
    return f"{row[VALUE]} {row[UNIT]}".rstrip()


def _errors(row: pd.Series) -> str:
    """Format the errors of a rung with their 95 % bands [%], from its row of `work_precision`."""
    errors = {
        name: format_with_error(row[f"{name} error [%]"], "+.1f", row[f"{name} error 95 % [%]"]) for name in SYMBOLS
    }
    return ", ".join(f"{SYMBOLS[name]} {error} %" for name, error in errors.items() if error != "-")


def advise(table: pd.DataFrame, knob: str) -> Outcome:
    """Judge which rung of a parameter to use: the cheapest one whose errors are not resolved.

    `table` is that of `work_precision`. The text of the outcome gives the errors of this rung and the largest error in
    φ that is possible at 95 %. For a sensitivity the text lists the rungs whose results differ from those of the scene.
    """
    rows = table[table[KNOB] == knob]
    own, judged = rows[rows[VERDICT] == IS_REFERENCE], rows[rows[VERDICT].isin([RESOLVED, NOT_RESOLVED])]
    if own.empty or judged.empty:
        return Outcome(
            note="nothing can be resolved: an error needs two finished seeds of two rungs", verdict=Verdict.NO_DATA
        )
    reference = own.iloc[0]
    if reference["sensitivity"]:
        clear = [f"{_label(row)} ({_errors(row)})" for _, row in judged[judged[VERDICT] == RESOLVED].iterrows()]
        note = f"a matter of what is modelled; against {_label(reference)} resolved: {', '.join(clear) or 'none'}"
        return Outcome(note=note, verdict=decide(bool(clear)))
    cheap = judged[judged[COST] < reference[COST]].sort_values(COST)
    enough = cheap[cheap[VERDICT] == NOT_RESOLVED]
    if enough.empty:
        errors = "; ".join(f"{_label(row)}: {_errors(row)}" for _, row in cheap.iterrows())
        return Outcome(note=f"use {_label(reference)}. Cheaper: {errors or 'none'}", verdict=Verdict.NOT_FOUND)
    row = enough.iloc[0]
    bound = max(abs(row[f"{name} error [%]"]) + row[f"{name} error 95 % [%]"] for name in ("phi_0", "phi_f"))
    finer = judged.loc[row.name :]
    though = ", ".join(_label(one) for _, one in finer[finer[VERDICT] == RESOLVED].iterrows())
    note = (
        f"use {_label(row)}, {reference[COST] / row[COST]:.2g} times as fast as {_label(reference)}: {_errors(row)} "
        f"are not resolved with {row[SEEDS]} seeds, and {bound:.1f} % in φ cannot be excluded"
    )
    return Outcome(
        note=note + (f"; but errors of a finer rung are resolved: {though}" if though else ""), verdict=Verdict.FOUND
    )


def worst_errors(table: pd.DataFrame) -> pd.DataFrame:
    """Return the largest error of each named fidelity, from the table of `work_precision`.

    A fidelity has two rows: one for the worst of packing, height and ⟨N⟩, and one for energy. The worst quantity is the
    one with the largest bound, which is the absolute value of its error plus the 95 % band. Columns: engine, name of
    the fidelity, cost (`COST`), number of seeds, symbol of the quantity, absolute value of the error [%], bound [%].

    The reference, fidelities with a single seed, and quantities whose error or band is unknown are left out.
    """
    knob = "engine" if (table[KNOB] == "engine").any() else "fidelity"
    rows = []
    for _, row in table[(table[KNOB] == knob) & (table[SEEDS] > 1) & (table[VERDICT] != IS_REFERENCE)].iterrows():
        labels = {ENGINE: row[ENGINE], "fidelity": row[VALUE].split()[-1], COST: row[COST], SEEDS: row[SEEDS]}
        for names in (("phi_0", "phi_f", "height", "crossings"), ("energy",)):
            errors = {
                SYMBOLS[name]: (abs(row[f"{name} error [%]"]), row[f"{name} error 95 % [%]"])
                for name in names
                if math.isfinite(row[f"{name} error [%]"] + row[f"{name} error 95 % [%]"])
            }
            if errors:
                symbol, (error, band) = max(errors.items(), key=lambda item: sum(item[1]))
                rows.append({**labels, "quantity": symbol, "error [%]": error, "bound [%]": error + band})
    return pd.DataFrame(rows)


@dataclass(frozen=True, kw_only=True)
class Fidelities:
    """Largest error of each named fidelity against its cost, one panel for each scene."""

    name: str = "fidelities"

    def draw(self, path: Path, analysis: Analysis) -> list[Path]:
        """Draw the largest error of each named fidelity against its cost; return the files."""
        table = analysis.tables["work_precision"]
        return self.compare(path, {next(iter(table[ACTIVITY].dropna()), ""): table}, analysis.footer)

    def compare(self, path: Path, tables: Mapping[str, pd.DataFrame], footer: Sequence[str]) -> list[Path]:
        """Draw tables of work and precision by the name of their scene; return the files.

        A fidelity whose cost is unknown or 0 has no place on the logarithmic axis and is left out. The path has no
        suffix; the lines of the footer are below the figure.
        """
        figure, axes = panels(len(tables), columns=3, height=3.0, sharey=True)
        for panel, (title, table) in zip(axes, tables.items(), strict=True):
            for name, aim in AIMS.items():
                panel.axhline(aim, color=GREY, linewidth=0.6, linestyle=":")
                if panel is axes[0]:
                    panel.annotate(f"aim of {name}: {aim:g} %", (0.01, aim), (0, 1), xycoords=("axes fraction", "data"),
                                   textcoords="offset points", color=GREY, fontsize=5.5)  # fmt: skip
            known = table[table[COST] > 0]
            worst = worst_errors(known)
            for _, row in worst.iterrows():
                colour = {"links": BLUE, "yade": ORANGE}[row[ENGINE]]
                bar = [[0.0], [row["bound [%]"] - row["error [%]"]]]
                of_energy = row["quantity"] == SYMBOLS["energy"]
                panel.errorbar(row[COST], row["error [%]"], yerr=bar, label=row[ENGINE],
                               **marker("o", colour, "white" if of_energy else colour))  # fmt: skip
                if of_energy:
                    panel.annotate("E", (row[COST], row["error [%]"]), (-5, 0), textcoords="offset points", ha="right",
                                   va="center", color=colour)  # fmt: skip
                else:
                    top = worst.loc[worst[COST] == row[COST], "bound [%]"].max()
                    panel.annotate(f"{row['fidelity']}\n{row['quantity']}", (row[COST], top), (0, 2), color=colour,
                                   textcoords="offset points", ha="center", va="bottom", fontsize=7)  # fmt: skip
            low, high = (known[COST].min() / 2, known[COST].max() * 2) if len(known) else (1, 10)
            panel.set(title=title, xlabel="processor time per simulated s [s/s]", ylim=(1, 100))
            panel.set(xscale="log", yscale="log", xlim=(low, high))
            for axis in (panel.xaxis, panel.yaxis):
                axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
                axis.set_major_formatter("{x:g}")
                axis.set_minor_locator(NullLocator())
        axes[0].set_ylabel("error against the converged fidelity [%]")
        notes = ["Largest error of φ_0, φ_f, height and ⟨N⟩ (filled), and error of the energy put in (open, E)."]
        if any(panel.containers for panel in axes):
            notes.append("Error bars: 95 % confidence; their ends are the errors that the seeds do not exclude.")
        return finish(figure, path, notes, footer)


def _finding(knob: str, *, sensitivity: bool) -> Finding:
    return Finding(
        id=knob,
        says=f"(ours) {knob} changes results" if sensitivity else f"(ours) a cheaper {knob} than the finest will do",
        found_if="an error beyond the seed-to-seed band" if sensitivity else "no error beyond the seed-to-seed band",
        outcome=partial(advise, knob=knob),
        tables=["work_precision"],
    )


def study(rungs: Sequence[Rung], expected_s: Mapping[str, float] = MappingProxyType({})) -> Study:
    """Make the study of a ladder, whose rungs are ordered by parameter, from coarse to fine.

    `expected_s` has expected wall times of runs [s] by name of the run directory.
    """
    knobs = {rung.knob: rung.sensitivity for rung in rungs}

    def tables(runs: pd.DataFrame) -> dict[str, pd.DataFrame]:
        table = work_precision(runs, rungs)
        return {"points": table, "work_precision": table}

    errors = [
        Quantity(
            column=f"{name} error [%]",
            label=f"{symbol} error % (95 %)",
            form="+.1f",
            bar="95 %",
            axis=f"error of {symbol} [%]",
            meaning=f"of {symbol} against the parameter's reference",
        )
        for name, symbol in SYMBOLS.items()
    ]
    return Study(
        name="accuracy",
        title="What accuracy costs in time",
        measure=partial(measure, expected_s=expected_s),
        keys=(
            Key(column=KNOB, label="parameter"),
            Key(column=VALUE, label="value"),
            Key(column=UNIT, label="unit"),
            Key(column=VARIANT, label="setting"),
        ),
        quantities=(
            Quantity(column=COST, label="cpu s per s", meaning="processor time of the last activity, one thread"),
            *errors,
        ),
        findings=[_finding(knob, sensitivity=sensitivity) for knob, sensitivity in knobs.items()],
        figures=(
            *([Fidelities()] if {"fidelity", "engine"} & set(knobs) else []),
            Means(
                name="accuracy",
                table="work_precision",
                quantities=errors,
                x=COST,
                x_label="processor time per simulated time [s/s]",
                log_x=True,
                split=one_by_one(KNOB, str),
                levels=lambda _: {"reference": 0.0},
                bars=POOLED,
            ),
        ),
        extra=tables,
        order=(),
        same_count=(),
        same_fidelity=(VARIANT,),
        constant={ASPECT: (), ACTIVITY: ()},
        remarks=(
            f"φ by {DEFINITION} ({DEFINITIONS[DEFINITION]}); φ_0 and h_0, the height of the centre of mass, before the "
            f"first activity, φ_f and ⟨N⟩ at the end of the last one, means over {LAST_FRAMES} frames or fewer.",
            "Errors are relative to the parameter's reference (its finest rung with finished runs, or the scene itself "
            "for a sensitivity), their bands 95 % by Student's t, with the scatter from seed to seed pooled over all "
            "settings. Where a parameter changes nothing at all, one error in twenty is still beyond its band.",
        ),
        reference=Reference(statement="the finest rung of each parameter", facts={"parameters": " ".join(knobs)}),
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw the named fidelities of several ladders side by side, from their published tables."""
    parser = argparse.ArgumentParser(
        prog="python -m studies.accuracy",
        description="Draw fidelities.png of a folder that has the results of one ladder in each of its subfolders.",
    )
    parser.add_argument("folder", type=Path, help="such as results/accuracy-links")
    parser.add_argument("ladders", nargs="+", help="subfolders with a work_precision.csv, one panel each")
    parser.add_argument("--footer", default="", help="statement on scene, seeds and versions")
    given = parser.parse_args(arguments)
    files = {name: given.folder / name / "work_precision.csv" for name in given.ladders}
    try:
        tables = {name: pd.read_csv(file, comment="#") for name, file in files.items()}
    except (OSError, ValueError) as error:
        parser.error(f"cannot read the tables: {error}")
    command = f"python -m studies.accuracy {given.folder} {' '.join(given.ladders)}"
    with style():
        Fidelities().compare(given.folder / "fidelities", tables, [*filter(None, [given.footer]), f"{command}."])


if __name__ == "__main__":
    main()
