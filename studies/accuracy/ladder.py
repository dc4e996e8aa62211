"""The ladder of accuracy: variants of one scene, each with one knob turned, as a sweep.

A knob has rungs from coarse to fine; the scene itself, the setting `base`, is a rung of every knob, and is run once.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType

import yaml

from dem.errors import InputError, nearest
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene
from dem.setting.fidelity import Fidelity, fidelities
from studies.accuracy.rung import ACTIVITIES, ACTUATED, BASE, Rung
from templates.sweep.render import Value, render_yaml
from templates.sweep.sweep_file import SEED, Sweep, SweepFile

KNOBS: Mapping[str, str] = MappingProxyType(
    {
        "time-step": "time step over the stable one",
        "stiffness": "stiffness of contacts; the time step follows",
        "section": "spheres that stand for the section: pitch, and two rows",
        "restitution": "a property of the material, so a sensitivity and no accuracy",
        "control": "time between two looks of the motor control; where the scene actuates",
        "hinge": "stiffness of the hinges' pins; where the scene actuates",
        "fidelity": "the named fidelities, all knobs together",
        "engine": "the named fidelities of all engines, against the converged one of links; only where it is asked for",
    }
)

_OF_MOTORS = frozenset({"control", "hinge"})
_ENGINES = ("yade", "links")
"""From coarse to fine: links have neither beads nor facets, so that all are compared with their converged answer."""
# Left as the scene has them: facets, since no knob turns them; a step by hand is refused.
_FIXED = frozenset({"wall_facets", "time_step_s"})
_FACTORS = (1, 2, 4)
_STIFFNESSES = (125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0)
_STRANDS = (1, 2, 3)
_CONVERGED = {"rows": 3, "stiffness_N_per_m": 2000.0}
"""Finer than the finest name on links, in what was found to matter: what the names are compared with."""
_STEPS = (0.9, 0.45, 0.225)
_PITCHES = (1.3, 1.0, 0.5)
_RESTITUTIONS = (0.2, 0.5, 0.7, 0.9)
_CONTROL_INTERVALS = (4e-4, 2e-4, 1e-4)
_ROWS = {2: "two", 3: "three", 4: "four"}
_MOST_ROWS = max(_ROWS)
_MOST_SEEDS = 1000
_SWEEP, _TEMPLATE = Path("accuracy.yaml"), Path("accuracy.yaml.j2")


@dataclass(frozen=True, kw_only=True)
class Ladder:
    """Rungs of all knobs, each knob's from coarse to fine.

    Args:
        rungs: the rungs, knob by knob.
        settings: variables of the scene's template by setting; `BASE` first.
        left_out: why a rung is not there, one line each.
        scenes: one scene of each setting.
    """

    rungs: tuple[Rung, ...]
    settings: Mapping[str, Mapping[str, Value]] = field(repr=False)
    left_out: tuple[str, ...] = ()
    scenes: Mapping[str, Scene] = field(repr=False)

    @property
    def knobs(self) -> tuple[str, ...]:
        """The knobs that have rungs, in order."""
        return tuple(dict.fromkeys(rung.knob for rung in self.rungs))

    def references(self) -> dict[str, Rung]:
        """What each knob's rungs are compared with: its finest rung, or the scene itself for a sensitivity."""
        found = {rung.knob: rung for rung in self.rungs if not rung.sensitivity or rung.setting == BASE}
        return {knob: found[knob] for knob in self.knobs}


def default_seeds(scene: Scene) -> tuple[int, ...]:
    """The seeds that a ladder has unless it is told: twenty where they are cheap, three on YADE."""
    return tuple(range(1, 21 if scene.smooth else 4))


def parse_seeds(text: str) -> tuple[int, ...]:
    """Seeds from `1,2,3` or `1-20`.

    Raises:
        InputError: there is none, one is no whole number from 0, or one is given twice.
    """
    words = [word.strip() for word in text.split(",") if word.strip()]
    if not words or not all(re.fullmatch(r"[0-9]{1,9}(-[0-9]{1,9})?", word) for word in words):
        msg = f"--seeds {text!r}: must be whole numbers from 0, such as 1,2,3 or 1-20"
        raise InputError(msg)
    seeds: list[int] = []
    for word in words:
        first, _, last = word.partition("-")
        if last and not 0 <= int(last) - int(first) < _MOST_SEEDS:
            msg = f"--seeds {text}: {word} must go up, by fewer than {_MOST_SEEDS}"
            raise InputError(msg)
        seeds += range(int(first), int(last or first) + 1)
    for seed in seeds:
        if seeds.count(seed) > 1:
            msg = f"--seeds {text}: {seed} is given twice, and would count twice; leave one out"
            raise InputError(msg)
    return tuple(seeds)


def parse_knobs(text: str) -> tuple[str, ...]:
    """Knobs from `time-step,section`, in the order of `KNOBS`.

    Raises:
        InputError: there is none, or one is unknown.
    """
    words = [word.strip() for word in text.split(",") if word.strip()]
    for word in words:
        if word not in KNOBS:
            msg = f"--knobs: {word!r} is no knob; {nearest(word, KNOBS)}"
            raise InputError(msg)
    if not words:
        msg = f"--knobs {text!r}: names none; known: {', '.join(KNOBS)}"
        raise InputError(msg)
    return tuple(knob for knob in KNOBS if knob in words)


def build_ladder(scene: Scene, *, source: str, knobs: Sequence[str] | None = None) -> Ladder:
    """The ladder of a scene.

    Args:
        scene: the base scene.
        source: its file, for messages.
        knobs: keys of `KNOBS`; None: all that the scene calls for.

    Returns:
        The ladder. A rung that the scene cannot have, such as two rows in a section that is square, is left out.

    Raises:
        InputError: the scene has no activity, a time step by hand, or nothing that a knob asked for could turn.
    """
    types = [phase.type for phase in scene.phases]
    if not ACTIVITIES & set(types):
        msg = (
            f"{source}: phases: {', '.join(types)}: no activity whose result accuracy could be told by; "
            f"add a phase of type {', '.join(sorted(ACTIVITIES))}"
        )
        raise InputError(msg)
    if scene.fidelity.time_step_s is not None:
        msg = (
            f"{source}: fidelity.time_step_s: a step of {scene.fidelity.time_step_s:g} s by hand does not follow the "
            "knobs; leave it out and give time_step_fraction"
        )
        raise InputError(msg)
    driven = bool(ACTUATED & set(types))
    for knob in knobs or ():
        if knob in _OF_MOTORS and not driven:
            msg = f"--knobs: {knob} turns nothing: no phase of {source} actuates ({', '.join(types)}); leave it out"
            raise InputError(msg)
    if scene.smooth and "hinge" in (knobs or ()):
        msg = f"--knobs: hinge turns nothing: the engine {scene.engine} has no pins; leave it out"
        raise InputError(msg)
    chosen = knobs or [
        knob
        for knob in KNOBS
        if (driven or knob not in _OF_MOTORS) and not (scene.smooth and knob == "hinge") and knob != "engine"
    ]
    base = _variables(scene)
    template = _template(scene)
    settings: dict[str, Mapping[str, Value]] = {BASE: base}
    scenes: dict[str, Scene] = {BASE: scene}
    rungs: list[Rung] = []
    left_out: list[str] = []
    for knob in chosen:
        for value, unit, name, changes in _rungs(knob, base, smooth=scene.smooth):
            values = {**base, **changes}
            # The name of a fidelity decides nothing by itself.
            knobs_only = {key: value for key, value in values.items() if key != "base"}
            setting = next((known for known, there in settings.items() if _same(knobs_only, there)), name)
            if setting not in settings:
                try:
                    scenes[setting] = _scene(template, scene, values, source)
                except InputError as error:
                    left_out.append(f"{knob} {value}: {error}")
                    continue
                settings[setting] = values
            rungs.append(Rung(knob=knob, value=value, unit=unit, setting=setting))
    return Ladder(
        rungs=tuple(rungs),
        settings=MappingProxyType(settings),
        left_out=tuple(left_out),
        scenes=MappingProxyType(scenes),
    )


def affordable(ladder: Ladder, expected_s: Mapping[str, float], most_s: float) -> Ladder:
    """The ladder without settings whose run is expected to take longer; the scene itself always stays.

    Args:
        ladder: the ladder.
        expected_s: expected wall time of a run by setting [s].
        most_s: what a run may take [s].
    """
    dear = {setting for setting, wall in expected_s.items() if wall > most_s and setting != BASE}
    told = [
        f"{rung.knob} {rung.label}: a run is expected to take {expected_s[rung.setting] / 3600:.2g} h, "
        f"more than {most_s / 3600:.2g} h"
        for rung in ladder.rungs
        if rung.setting in dear
    ]
    return replace(
        ladder,
        rungs=tuple(rung for rung in ladder.rungs if rung.setting not in dear),
        settings=MappingProxyType({name: values for name, values in ladder.settings.items() if name not in dear}),
        left_out=(*ladder.left_out, *told),
        scenes=MappingProxyType({name: scene for name, scene in ladder.scenes.items() if name not in dear}),
    )


def ladder_sweep(scene: Scene, ladder: Ladder, seeds: Sequence[int]) -> Sweep:
    """The sweep of a ladder: every setting once per seed, all settings with the first seed first.

    Args:
        scene: the base scene; its own seed does not matter.
        ladder: its ladder.
        seeds: the seeds.
    """
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
        path=_SWEEP,
        text=yaml.safe_dump(data, sort_keys=False, allow_unicode=True),
        content=SweepFile.model_validate(data),
        template=_TEMPLATE,
        template_text=_template(scene),
    )


def _variables(scene: Scene) -> dict[str, Value]:
    """What the knobs turn, as the scene has it."""
    turned = [key for key in Fidelity.model_fields if key not in _FIXED]
    return {
        "engine": scene.engine,
        **{key: getattr(scene.fidelity, key) for key in turned},
        "restitution": scene.contact.restitution,
    }


def _template(scene: Scene) -> str:
    """The scene as a template: all that the knobs turn is a variable."""
    data = scene.model_dump(mode="json")
    data |= {"name": "{{ title }}", SEED: "{{ seed }}", "engine": "{{ engine }}"}
    data["contact"]["restitution"] = "{{ restitution }}"
    data["fidelity"] |= {key: f"{{{{ {key} }}}}" for key in data["fidelity"] if key not in _FIXED}
    text = str(yaml.safe_dump(data, sort_keys=False, allow_unicode=True))
    # A variable that stands alone keeps its type.
    return re.sub(r"'(\{\{ \w+ \}\})'", r"\1", text)


def _scene(template: str, scene: Scene, values: Mapping[str, Value], source: str) -> Scene:
    return parse_scene(render_yaml(template, {**values, "title": scene.name, SEED: scene.seed}, source), source=source)


def _same(one: Mapping[str, Value], other: Mapping[str, Value]) -> bool:
    return all(_equal(value, other[name]) for name, value in one.items())


def _equal(one: Value, other: Value) -> bool:
    if isinstance(one, float | int) and isinstance(other, float | int):
        return math.isclose(one, other, rel_tol=1e-9)
    return bool(one == other)


_Point = tuple[str, str, str, dict[str, Value]]
"""Value and unit as text, name of the setting, and the variables that differ from the base."""


def _rungs(knob: str, base: Mapping[str, Value], *, smooth: bool) -> list[_Point]:
    """All rungs of a knob, coarse to fine; `smooth`: of links that are no chains of spheres."""
    if knob == "section":
        return _strands(base) if smooth else _sections(base)
    if knob in ("fidelity", "engine"):
        return _fidelities(knob, str(base["engine"]), smooth=smooth)
    return _values(knob, base, smooth=smooth)


def _values(knob: str, base: Mapping[str, Value], *, smooth: bool) -> list[_Point]:
    """Rungs of a knob that is one number."""
    key, unit, values = {
        "time-step": ("time_step_fraction", "", _STEPS),
        "restitution": ("restitution", "", _RESTITUTIONS),
        "control": ("control_interval_s", "s", _CONTROL_INTERVALS),
        "stiffness": ("stiffness_N_per_m", "N/m", _STIFFNESSES if smooth else ()),
        "hinge": ("hinge_stiffness_N_per_m", "N/m", ()),
    }[knob]
    if not values:
        return [(f"{base[key] * n:g}", unit, f"{knob}-x{n}", {key: base[key] * n}) for n in _FACTORS]
    every = _with(values, base[key])
    return _numbers(knob, key, unit, every[::-1] if knob in ("restitution", "stiffness") else every)


def _fidelities(knob: str, engine: str, *, smooth: bool) -> list[_Point]:
    """Named fidelities: those of an engine, or of all."""
    if knob == "fidelity":
        return [(name, "", f"{engine}-{name}" if smooth else name, all_) for name, all_ in _names(engine).items()]
    return [(f"{one} {name}", "", f"{one}-{name}", all_) for one in _ENGINES for name, all_ in _names(one).items()]


def _names(engine: str) -> dict[str, dict[str, Value]]:
    """What each named fidelity of an engine sets, coarse to fine; on links what is finer yet comes last."""
    shared: dict[str, Value] = {"engine": engine, "diameter_m": None}
    found = {name: {**shared, "base": name, **knobs} for name, knobs in fidelities(engine).items()}
    if engine == _ENGINES[-1]:
        found["converged"] = {**list(found.values())[-1], **_CONVERGED}
    return found


def _numbers(knob: str, key: str, unit: str, values: Sequence[float]) -> list[_Point]:
    return [(f"{value:g}", unit, f"{knob}-{value:g}", {key: value}) for value in values]


def _with(values: Sequence[float], own: float) -> list[float]:
    """Values and the scene's own among them, the largest first."""
    others = [value for value in values if not _equal(value, own)]
    return sorted([*others, own], reverse=True)


def _sections(base: Mapping[str, Value]) -> list[_Point]:
    """Rows of spheres by the scene's own rule of their diameter, the true section last.

    A scene of several rows is compared with what is finer yet: its pitch halved, its rows doubled.
    """
    shapes: list[dict[str, Value]] = [{"rows": 1, "pitch": pitch, "diameter_m": None} for pitch in _PITCHES]
    shapes.append({"rows": 2, "pitch": 1.0, "diameter_m": None})
    own = {key: base[key] for key in shapes[0]}
    if own["rows"] > 1:
        finer = [{**own, "pitch": own["pitch"] / 2}, {**own, "rows": min(2 * own["rows"], _MOST_ROWS)}]
        shapes += [shape for shape in finer if not _same(shape, own)]
    if not any(_same(own, shape) for shape in shapes):
        shapes.append(own)
    shapes.sort(key=lambda shape: (shape["rows"], -shape["pitch"]))
    return [(name := _told_section(**shape), "", re.sub(r"[^A-Za-z0-9.]+", "-", name), shape) for shape in shapes]


def _strands(base: Mapping[str, Value]) -> list[_Point]:
    """Strands of a smooth link, by the scene's own rule of their diameter."""
    shapes = [{"rows": rows, "diameter_m": None} for rows in _STRANDS]
    own = {key: base[key] for key in shapes[0]}
    if not any(_same(own, shape) for shape in shapes):
        shapes.append(own)
    shapes.sort(key=lambda shape: shape["rows"] or 0)
    names = [
        f"{shape['rows']} strand{'' if shape['rows'] == 1 else 's'}"
        + ("" if shape["diameter_m"] is None else f" d {1e3 * shape['diameter_m']:g} mm")
        for shape in shapes
    ]
    return [
        (name, "", re.sub(r"[^A-Za-z0-9.]+", "-", name), dict(shape)) for name, shape in zip(names, shapes, strict=True)
    ]


def _told_section(*, rows: int, pitch: float, diameter_m: float | None) -> str:
    if rows == 1:
        told = f"pitch {pitch:g}"
    else:
        told = f"{_ROWS[rows]} rows" + (f" of pitch {pitch:g}" if pitch != 1 else "")
    return told if diameter_m is None else f"{told} d {1e3 * diameter_m:g} mm"
