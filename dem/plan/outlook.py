"""Plan of a run: phases, effects with reasons, engines, time steps, cost, warnings."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Self

from dem.body.particle import LINKS
from dem.engine.effect import Adds
from dem.engine.kinds import engine_kind
from dem.plan.doubts import doubts_of
from dem.plan.effects import Decision, decide
from dem.plan.steps import limiting_spans, stable_step, time_steps
from dem.record.sizes import MIB, MeasuringCost, measuring_cost
from dem.scene.scene import Scene
from dem.scene.stiffness import expected_overlaps, too_soft
from dem.setting.fidelity import Fidelity, fidelities
from dem.setting.protocol import PARTS, PROTOCOLS, applies

# Processor time to start a run, mostly imports [s]: links 2.4, YADE 3.0, measured while other work used both cores.
START_S = 2.5
SHORT_STEP = 1e-6  # s; filaments and chains that need shorter steps are warned about
_LEFT_OUT = {
    "series_interval_s": "one sample is taken, at the start",
    "frame_interval_s": "each phase has one frame, at its end",
    "sphere_interval_s": "no spheres are written",
}


@dataclass(frozen=True)
class PlannedPhase:
    """One phase of a plan."""

    index: int
    type: str
    duration_s: float | None  #: Simulated time; None where a criterion ends the phase
    estimate_s: float  #: Simulated time, estimated where `duration_s` is None
    wall_s: float  #: Expected wall time
    time_step_s: float
    step_set_by: str = ""  #: Key and value that need this step; "" where stability decides it


@dataclass(frozen=True)
class Plan:
    """Everything that `smarticles plan` prints."""

    name: str
    count: int
    spheres_per_smarticle: int
    sphere_diameter_m: float
    time_step_s: float
    stable_time_step_s: float
    container_height_m: float
    phases: tuple[PlannedPhase, ...]
    effects: tuple[Decision, ...]
    engines: tuple[str, ...]
    frames: int
    measuring: MeasuringCost
    wall_s: float  #: Expected wall time of all phases, without `start_s` and `compile_s`
    warnings: tuple[str, ...]
    planar: bool = False
    engine: str = "yade"
    fidelity: str = "standard"
    stiffness_N_per_m: float = 0.0
    named_rows: int = 1  #: `fidelity.rows` of the named fidelity, before changes by the scene or a rule
    named_stiffness_N_per_m: float = 0.0  #: Stiffness of the named fidelity, before changes
    usual_rows: int = 0  #: `fidelity.rows` of the named fidelity for the paper's smarticle
    bodies: str = "smarticles"  #: Noun for the bodies in texts
    strands: int = 0  #: `fidelity.rows` on the engine links; 0 on engines with spheres
    most_strands: int = 0  #: Largest number of strands of a bar on the engine links; 0 on engines with spheres
    correction: float = 1.0  #: Factor by which all wall times were multiplied, see `corrected`
    protocol: tuple[str, ...] = ()  #: Lines about the keys of the scene's protocol
    start_s: float = START_S  #: Expected processor time before the first phase, without compiling
    compile_s: float = 0.0  #: Expected processor time for code that is not compiled yet
    overlaps: Mapping[str, float] = field(default_factory=dict)  #: Expected overlap over a link's mean width, by cause

    def corrected(self, factor: float) -> Self:
        """Return this plan with all wall times multiplied by a factor [1]."""
        phases = tuple(replace(phase, wall_s=factor * phase.wall_s) for phase in self.phases)
        return replace(self, phases=phases, wall_s=factor * self.wall_s, correction=factor * self.correction)

    def to_text(self) -> str:
        """Return the plan as tables for the terminal."""
        corrected = "" if self.correction == 1 else f", corrected by {self.correction:.3g} as measured at this fidelity"
        smooth = f"smooth links of {_strands(self.most_strands)}"
        section = smooth if self.strands else f"{self.spheres_per_smarticle} spheres"
        wall = "in a plane" if self.planar else f"wall {1e3 * self.container_height_m:.0f} mm high"
        lines = [
            f"{self.name}: {self.count} {self.bodies} of {section}, d = {1e3 * self.sphere_diameter_m:.3g} mm, {wall}",
            *self._engine_to_text(),
            *self.protocol,
            f"time step {self._steady_steps[-1]:.3g} s (stable up to {self.stable_time_step_s:.3g} s)"
            + self._earlier_to_text(),
            *(
                f"phase {phase.index}: {phase.time_step_s:.3g} s, as {phase.step_set_by} needs"
                for phase in self.phases
                if phase.step_set_by
            ),
            "contacts give way by about "
            + ", ".join(f"{overlap:.2g} of a link's thickness in {cause}" for cause, overlap in self.overlaps.items()),
            "",
            f"{'phase':<24}{'simulated':>12}{'expected wall time':>22}",
        ]
        lines.append(f"{'starting':<24}{'':>12}{_wall_time(self.start_s):>22}")
        for phase in self.phases:
            guess = "" if phase.duration_s is not None else "≈ "
            label = f"{phase.index} {phase.type}"
            lines.append(f"{label:<24}{f'{guess}{phase.estimate_s:.2f} s':>12}{_wall_time(phase.wall_s):>22}")
        if self.compile_s:
            lines.append(f"{'compiling, once':<24}{'':>12}{_wall_time(self.compile_s):>22}")
        total = _wall_time(self.start_s + self.wall_s + self.compile_s)
        lines += [
            f"{'total':<24}{f'{sum(p.estimate_s for p in self.phases):.2f} s':>12}{total:>22}",
            f"(one core{corrected}; machines differ by a factor of two)",
            "",
            f"{'effect':<20}{'':<5}why, and what it adds",
        ]
        for effect in self.effects:
            lines.append(f"{effect.name:<20}{'on' if effect.on else 'off':<5}{effect.why}")
            lines += [f"{'':<25}+ {added}"] if (added := effect.adds.to_text()) else []
        lines += ["", "engines: " + ", ".join(self.engines), *self._measuring_to_text()]
        lines += [f"warning: {warning}" for warning in self.warnings]
        return "\n".join(lines)

    @property
    def _steady_steps(self) -> list[float]:
        """Time steps [s] of the phases in which stability decides them, if there are any, else of all phases."""
        return [phase.time_step_s for phase in self.phases if not phase.step_set_by] or [self.time_step_s]

    def _earlier_to_text(self) -> str:
        """Return where motors, which need a shorter time step, begin."""
        steady = {phase.index: phase.time_step_s for phase in self.phases if not phase.step_set_by}
        first = next((k for k, step in steady.items() if step == self._steady_steps[-1]), 0)
        return f" from phase {first} on, {self._steady_steps[0]:.3g} s before" if first else ""

    def _measuring_to_text(self) -> list[str]:
        """Return lines about the frames, and about the memory and time that measures take."""
        cost = self.measuring
        size, whole = (_size(number) for number in (cost.frame_bytes, self.frames * cost.frame_bytes))
        return [
            f"frames: about {self.frames} of {size}, {whole} together",
            f"smarticles measure: about {_size(cost.memory_bytes)} of memory in each process, "
            f"{_wall_time(cost.cpu_s)} of processor time for each run",
        ]

    def _engine_to_text(self) -> list[str]:
        """Return lines about the engine, and about the fidelity if the engine is links; no lines for YADE.

        The lines name the fidelity keys that have no effect on the engine. On links they also give rows, stiffness and
        time step.
        """
        idle = ", ".join(engine_kind(self.engine).idle_knobs)
        if not self.strands:
            return [f"engine {self.engine}: {idle} have no meaning here"] if idle else []
        named = (self.named_rows, self.named_stiffness_N_per_m)
        changed = (self.strands, self.stiffness_N_per_m) != named
        usual = f" (by name {named[0]}, {named[1]:g} N/m)" if changed else ""
        more = ", since fewer leave holes" if self.strands == self.named_rows > self.usual_rows else ""
        return [
            f"engine {self.engine}: fidelity.rows are strands; {idle} have no meaning here",
            f"fidelity {self.fidelity}: {_strands(self.strands)}{more}, {self.stiffness_N_per_m:g} N/m, time step "
            f"{self._steady_steps[-1] / self.stable_time_step_s:.2g} of the stable one{usual}",
        ]


def _wall_time(wall: float) -> str:
    """Return a wall time [s] as text, in seconds, minutes or hours, with two or three digits."""
    for most, unit, name, form in ((10, 1, "s", ".1f"), (600, 1, "s", ".0f"), (7200, 60, "min", ".0f")):
        if wall < most:
            return f"{wall / unit:{form}} {name}"
    return f"{wall / 3600:.1f} h" if wall < 10 * 3600 else f"{wall / 3600:.0f} h"


def _size(number: int) -> str:
    """Return a number of bytes as text, in kiB, MiB or GiB."""
    for unit, name in ((MIB * 1024, "GiB"), (MIB, "MiB")):
        if number >= unit:
            return f"{number / unit:.3g} {name}"
    return f"{number / 1024:.3g} kiB"


def _strands(number: int) -> str:
    return f"{number} strand{'' if number == 1 else 's'}"


def _most_strands(scene: Scene) -> int:
    if not scene.smooth:
        return 0
    return scene.fidelity.rows if scene.mixture is None else max(kind.rows for kind in scene.mixture.kinds)


def _bodies(scene: Scene) -> str:
    if scene.mixture is None:
        return "smarticles"
    names = dict.fromkeys(kind.name for kind in scene.mixture.kinds)
    return f"bodies ({', '.join(names)})"


def planned_phases(scene: Scene, steps: Sequence[float] | None = None) -> tuple[PlannedPhase, ...]:
    """Return the phases of a scene with their time steps and expected wall times.

    `steps` are the time steps of the phases [s]; None: those of the scene.
    """
    kind, phases = engine_kind(scene.engine), []
    limits = limiting_spans(scene)
    for index, (phase, dt) in enumerate(zip(scene.phases, steps or time_steps(scene), strict=True)):
        estimate = phase.expected_duration(scene)
        wall = kind.seconds_per_second(scene, dt, scene.activity(index)) * estimate
        limit = limits[index]
        set_by = "" if limit is None else f"{limit.key} ({limit.value})"
        phases.append(PlannedPhase(index, phase.kind, phase.known_duration, estimate, wall, dt, set_by))
    return tuple(phases)


def plan(scene: Scene) -> Plan:
    """Compute the plan of a scene: phases, effects, time steps and cost."""
    kind, phases = engine_kind(scene.engine), planned_phases(scene)
    effects = decide(scene)
    engines = Adds.together(effect.adds for effect in effects).engines
    return Plan(
        name=scene.name,
        count=scene.count,
        spheres_per_smarticle=max(len(body.centres) for body in scene.bodies),
        sphere_diameter_m=scene.model.diameter,
        time_step_s=min(phase.time_step_s for phase in phases),
        stable_time_step_s=stable_step(scene),
        container_height_m=scene.cylinder.height,
        phases=phases,
        effects=effects,
        engines=tuple(sorted(engines, key=kind.order.index)),
        # Each phase ends with a frame.
        frames=len(phases) + round(sum(phase.estimate_s for phase in phases) / scene.recording.frame_interval_s),
        measuring=_measuring_cost(scene),
        wall_s=sum(phase.wall_s for phase in phases),
        warnings=warnings_of(scene),
        planar=scene.plane is not None,
        engine=scene.engine,
        fidelity=scene.fidelity.base,
        stiffness_N_per_m=scene.fidelity.stiffness_N_per_m,
        named_rows=scene.named_knobs["rows"],
        named_stiffness_N_per_m=scene.named_knobs["stiffness_N_per_m"],
        usual_rows=fidelities(scene.engine)[scene.fidelity.base]["rows"],
        bodies=_bodies(scene),
        strands=scene.fidelity.rows if scene.smooth else 0,
        most_strands=_most_strands(scene),
        protocol=protocol_lines(scene),
        compile_s=kind.seconds_to_compile(scene),
        overlaps={overlap.cause: overlap.widths for overlap in expected_overlaps(scene)},
    )


def _measuring_cost(scene: Scene) -> MeasuringCost:
    mixture = scene.mixture
    bars = LINKS * scene.count if mixture is None else int(mixture.sizes[mixture.of].sum())
    cells = mixture is None and scene.plane is None and not scene.cylinder.upper
    return measuring_cost(scene.count, bars, len(scene.phases), cells=cells)


def warnings_of(scene: Scene) -> tuple[str, ...]:
    """Return all warnings of a scene, one line each with key, value with unit, and what to do."""
    of_phases = (warning for index, phase in enumerate(scene.phases) for warning in phase.warnings(scene, index))
    # Several phases may give equal warnings.
    return (
        *dict.fromkeys(of_phases),
        *doubts_of(scene),
        *recording_warnings(scene),
        *engine_warnings(scene),
        *_step_warnings(scene),
        *filter(None, [too_soft(scene)]),
    )


def _step_warnings(scene: Scene) -> tuple[str, ...]:
    """Return a one-line warning if filaments or joints need very short steps, else ()."""
    if scene.mixture is None or not scene.mixture.bends:
        return ()
    step = min(time_steps(scene))
    if step >= SHORT_STEP:
        return ()
    if scene.mixture.jointed:
        return (
            f"particle.joints: they need time steps of {step:.2g} s, {1 / step:.2g} for a second; use less stiffness "
            "and damping, or thicker links, or axes that do not turn links about themselves",
        )
    return (
        f"particle.young_modulus_Pa: filaments need time steps of {step:.2g} s, {1 / step:.2g} for a second; make them "
        "softer, with less stretching_time_s and bending_time_s, or of fewer segments",
    )


def engine_warnings(scene: Scene) -> tuple[str, ...]:
    """Return a line of warning about fidelity keys that the scene sets and its engine ignores, or ()."""
    fidelity, named = scene.fidelity, scene.named_knobs
    usual = {key: named.get(key, Fidelity.model_fields[key].default) for key in engine_kind(scene.engine).idle_knobs}
    idle = [f"{key} ({getattr(fidelity, key):g})" for key, value in usual.items() if getattr(fidelity, key) != value]
    if not idle:
        return ()
    mean = "has no meaning" if len(idle) == 1 else "have no meaning"
    return (f"fidelity: {', '.join(idle)} {mean} on the engine {scene.engine}; leave out what does nothing",)


def recording_warnings(scene: Scene) -> tuple[str, ...]:
    """Return warnings about intervals of recording that are longer than the run, one line each."""
    known = all(phase.known_duration is not None for phase in scene.phases)
    length = sum(phase.expected_duration(scene) for phase in scene.phases)
    run = f"the whole run, {'' if known else 'about '}{length:.3g} s"
    intervals = {key: getattr(scene.recording, key) for key in _LEFT_OUT}
    return tuple(
        f"recording.{key}: {interval:g} s is longer than {run}, so that {_LEFT_OUT[key]}; shorten it, or lengthen "
        "the run"
        for key, interval in intervals.items()
        if interval is not None and interval > length
    )


def protocol_lines(scene: Scene) -> tuple[str, ...]:
    """Return lines that list which keys have the values of the scene's protocol, and which have others.

    A protocol is a named set of values of scene keys. Without a protocol there are no lines: ().
    """
    if scene.protocol is None:
        return ()
    kept, other = [], []
    for key, value, rule in _protocol_keys(scene, PROTOCOLS[scene.protocol]):
        if value == rule:
            kept.append(f"{key} {_word(value)}")
        else:
            other.append(f"{key} is {_word(value)} here, not {_word(rule)}")
    lines = [f"protocol {scene.protocol}: {', '.join(kept) or 'nothing of it is left'}"]
    return (*lines, f"  the scene says otherwise: {', '.join(other)}") if other else tuple(lines)


def _protocol_keys(scene: Scene, rules: Mapping[str, Mapping[str, Any]]) -> Iterator[tuple[str, Any, Any]]:
    """Yield (key, value in the scene, value in the protocol) for each key of a scene that the protocol sets.

    A key is dotted, such as `phases.0.moves`. `rules` has the protocol's values by key, by part of the scene or type of
    phase.
    """
    for part in PARTS:
        if applies(part, plane=scene.plane is not None, tiers=scene.container.tiers is not None):
            for key, value in rules[part].items():
                yield f"{part}.{key}", getattr(getattr(scene, part), key), value
    for index, phase in enumerate(scene.phases):
        for key, value in rules.get(phase.kind, {}).items():
            yield f"phases.{index}.{key}", getattr(phase, key), value


def _word(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else "null" if value is None else str(value)
