"""Make the ladder of accuracy: variants of one scene, each with one knob turned, as a sweep.

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
from templates.sweep.render import Value, render_yaml
from templates.sweep.sweep_file import SEED, Sweep, SweepFile

BASE = "base"
"""Setting of the scene as it stands, which the others are variants of."""

KNOBS = ("time-step", "stiffness", "section", "restitution", "control", "hinge", "fidelity", "engine")
"""Knobs in order; `smarticles accuracy --help` says what they are."""

ACTUATED = frozenset({"actuate", "shape-change", "internal-oscillation"})
"""Types of phase in which barbs move."""

ACTIVITIES = ACTUATED | {"shake"}
"""Types of phase that do something to the pile in its container; packing is compared before and after them."""

_OF_MOTORS = frozenset({"control", "hinge"})
_ENGINES = ("yade", "links")
"""From coarse to fine: links have neither beads nor facets, so that all are compared with their converged answer."""
# Left as the scene has them: facets, since no knob turns them; a step by hand is rejected.
_FIXED = frozenset({"wall_facets", "time_step_s"})
_STIFFNESSES = (125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0)
_CONVERGED = {"rows": 3, "stiffness_N_per_m": 2000.0}
"""Finer than the finest name on links, in what was found to matter: what the names are compared with."""
_ROWS = {2: "two", 3: "three", 4: "four"}
_MOST_SEEDS = 1000
_TEMPLATE = Path("accuracy.yaml.j2")


@dataclass(frozen=True, kw_only=True)
class Rung:
    """One value of one knob.

    Attributes:
        knob: One of `KNOBS`.
        value: The value, as text.
        unit: Its unit, or empty.
        setting: Name of the variant of the scene that has it; runs are named SETTING_seedN.
    """

    knob: str
    value: str
    unit: str
    setting: str

    @property
    def label(self) -> str:
        """Value and unit."""
        return f"{self.value} {self.unit}".rstrip()

    @property
    def sensitivity(self) -> bool:
        """Whether the knob belongs to what is modelled: its rungs differ from the scene itself, and do not err."""
        return self.knob == "restitution"


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
        return {rung.knob: rung for rung in self.rungs if not rung.sensitivity or rung.setting == BASE}


def default_seeds(scene: Scene) -> tuple[int, ...]:
    """Give the seeds of a ladder: twenty where they are cheap, three on YADE."""
    return tuple(range(1, 21 if scene.smooth else 4))


def parse_seeds(text: str) -> tuple[int, ...]:
    """Parse seeds from `1,2,3` or `1-20`.

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
    twice = next((seed for seed in seeds if seeds.count(seed) > 1), None)
    if twice is not None:
        msg = f"--seeds {text}: {twice} is given twice, and would count twice; leave one out"
        raise InputError(msg)
    return tuple(seeds)


def parse_knobs(text: str) -> tuple[str, ...]:
    """Parse knobs from `time-step,section`, in the order of `KNOBS`.

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
    """Make the ladder of a scene; a rung that it cannot have, such as two rows in a square section, is left out.

    Args:
        scene: the base scene.
        source: its file, for messages.
        knobs: some of `KNOBS`; None: all that the scene calls for.

    Raises:
        InputError: the scene has no activity, a time step by hand, or nothing that a knob asked for could turn.
    """
    types = [phase.type for phase in scene.phases]
    driven = bool(ACTUATED & set(types))
    idle = next((knob for knob in knobs or () if knob in _OF_MOTORS and not driven), None)
    msg = ""
    if not ACTIVITIES & set(types):
        msg = (
            f"{source}: phases: {', '.join(types)}: no activity whose result accuracy could be told by; "
            f"add a phase of type {', '.join(sorted(ACTIVITIES))}"
        )
    elif scene.fidelity.time_step_s is not None:
        msg = (
            f"{source}: fidelity.time_step_s: a step of {scene.fidelity.time_step_s:g} s by hand does not follow the "
            "knobs; leave it out and give time_step_fraction"
        )
    elif idle is not None:
        msg = f"--knobs: {idle} turns nothing: no phase of {source} actuates ({', '.join(types)}); leave it out"
    elif scene.smooth and "hinge" in (knobs or ()):
        msg = f"--knobs: hinge turns nothing: the engine {scene.engine} has no pins; leave it out"
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
            # The name of a fidelity decides nothing by itself.
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
    return Ladder(
        rungs=tuple(rungs),
        settings=MappingProxyType(settings),
        left_out=tuple(left_out),
        scenes=MappingProxyType(scenes),
    )


def affordable(ladder: Ladder, expected_s: Mapping[str, float], most_s: float) -> Ladder:
    """Leave out settings whose run is expected to take longer than so many seconds; the scene itself always stays.

    Args:
        ladder: the ladder.
        expected_s: expected wall time of a run by setting [s].
        most_s: what a run may take [s].
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
        settings=MappingProxyType({name: values for name, values in ladder.settings.items() if name not in dear}),
        left_out=(*ladder.left_out, *lines),
        scenes=MappingProxyType({name: scene for name, scene in ladder.scenes.items() if name not in dear}),
    )


def ladder_sweep(scene: Scene, ladder: Ladder, seeds: Sequence[int]) -> Sweep:
    """Make the sweep of a ladder: every setting once per seed, all settings with the first seed first."""
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
    """The scene as a template: all that the knobs turn is a variable."""
    data = scene.model_dump(mode="json")
    data |= {"name": "{{ title }}", SEED: "{{ seed }}", "engine": "{{ engine }}"}
    data["contact"]["restitution"] = "{{ restitution }}"
    data["fidelity"] |= {key: f"{{{{ {key} }}}}" for key in data["fidelity"] if key not in _FIXED}
    text = str(yaml.safe_dump(data, sort_keys=False, allow_unicode=True))
    # A variable that stands alone keeps its type.
    return re.sub(r"'(\{\{ \w+ \}\})'", r"\1", text)


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
    """What each named fidelity of an engine sets, coarse to fine; on links what is finer yet comes last."""
    shared: dict[str, Value] = {"engine": engine, "diameter_m": None}
    found = {name: {**shared, "base": name, **knobs} for name, knobs in fidelities(engine).items()}
    if engine == _ENGINES[-1]:
        found["converged"] = {**list(found.values())[-1], **_CONVERGED}
    return found


def _sections(base: Mapping[str, Value]) -> list[_Point]:
    """Rows of spheres by the scene's own rule of their diameter, the true section last.

    A scene of several rows is compared with what is finer yet: its pitch halved, its rows doubled.
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
    """Strands of a smooth link, by the scene's own rule of their diameter."""
    shapes: list[dict[str, Value]] = [{"rows": rows, "diameter_m": None} for rows in (1, 2, 3)]
    own = {key: base[key] for key in shapes[0]}
    if not any(_same(own, shape) for shape in shapes):
        shapes.append(own)
    shapes.sort(key=lambda shape: shape["rows"] or 0)
    return [_shaped(f"{shape['rows']} strand{'' if shape['rows'] == 1 else 's'}", shape) for shape in shapes]


def _shaped(name: str, shape: dict[str, Value]) -> _Point:
    """A rung of the section, with its diameter where that is set by hand."""
    name += "" if shape["diameter_m"] is None else f" d {1e3 * shape['diameter_m']:g} mm"
    return name, "", re.sub(r"[^A-Za-z0-9.]+", "-", name), shape
