"""What a run would do: phases, effects and why each is on or off, engines, time step, cost. Simulates nothing."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any, Self

from dem.engine.doing import Doing
from dem.engine.effect import Adds, EffectName
from dem.engine.kinds import engine_kind
from dem.plan.advice import expected_overlaps, warnings_of
from dem.plan.effects import Decision, decide
from dem.plan.protocol import protocol_lines
from dem.plan.steps import stable_step, time_steps
from dem.scene.scene import Scene
from dem.setting.fidelity import fidelities


@dataclass(frozen=True)
class PlannedPhase:
    """One phase: its duration (None where a criterion ends it, then `estimate_s` is a guess), cost and time step."""

    index: int
    type: str
    duration_s: float | None
    estimate_s: float
    wall_s: float
    time_step_s: float


@dataclass(frozen=True)
class Plan:
    """Everything `smarticles plan` says.

    `strands` are those of a link where the engine takes links as they are, 0 where it fills them with spheres;
    `correction` is the factor that wall times have been corrected by; `protocol` are lines of what the scene has by its
    protocol.
    """

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
    wall_s: float
    warnings: tuple[str, ...]
    planar: bool = False
    engine: str = "yade"
    fidelity: str = "standard"
    stiffness_N_per_m: float = 0.0
    strands: int = 0
    correction: float = 1.0
    protocol: tuple[str, ...] = ()
    overlap_impact: float = 0.0
    """Of the hardest impact, estimated, in diameters [1]."""
    overlap_weight: float = 0.0
    """Under the pile's weight, estimated, in diameters [1]."""

    def corrected(self, factor: float) -> Self:
        """The same plan with wall times `factor` times as long [1], as measured on a scene of the same fidelity."""
        phases = tuple(replace(phase, wall_s=factor * phase.wall_s) for phase in self.phases)
        return replace(self, phases=phases, wall_s=factor * self.wall_s, correction=factor * self.correction)

    def to_dict(self) -> dict[str, Any]:
        """Plain data for `--json`."""
        return asdict(self)

    def to_text(self) -> str:
        """A table for the terminal."""
        corrected = "" if self.correction == 1 else f", corrected by {self.correction:.3g} as measured at this fidelity"
        wall = "in a plane" if self.planar else f"wall {1e3 * self.container_height_m:.0f} mm high"
        lines = [
            f"{self.name}: {self.count} smarticles of {self._section_to_text()}, "
            f"d = {1e3 * self.sphere_diameter_m:.3g} mm, {wall}",
            *self._engine_to_text(),
            *self.protocol,
            self._steps_to_text(),
            f"contacts give way by about {self.overlap_impact:.2g} d in the hardest impact, "
            f"{self.overlap_weight:.2g} d under the pile's weight",
            "",
            f"{'phase':<24}{'simulated':>12}{'expected wall time':>22}",
        ]
        for phase in self.phases:
            guess = "" if phase.duration_s is not None else "≈ "
            label = f"{phase.index} {phase.type}"
            lines.append(f"{label:<24}{f'{guess}{phase.estimate_s:.2f} s':>12}{_told(phase.wall_s):>22}")
        lines += [
            f"{'total':<24}{f'{sum(p.estimate_s for p in self.phases):.2f} s':>12}{_told(self.wall_s):>22}",
            f"(one core{corrected}; machines differ by a factor of two)",
            "",
            f"{'effect':<20}{'':<5}why, and what it adds",
        ]
        for effect in self.effects:
            lines.append(f"{effect.name:<20}{'on' if effect.on else 'off':<5}{effect.why}")
            lines += [f"{'':<25}+ {added}"] if (added := effect.adds.to_text()) else []
        lines += ["", "engines: " + ", ".join(self.engines), f"frames: about {self.frames}"]
        lines += [f"warning: {warning}" for warning in self.warnings]
        return "\n".join(lines)

    def _section_to_text(self) -> str:
        if not self.strands:
            return f"{self.spheres_per_smarticle} spheres"
        return f"smooth links of {self.strands} strand{'' if self.strands == 1 else 's'}"

    def _engine_to_text(self) -> list[str]:
        """What is different on an engine that is not the usual one."""
        idle = engine_kind(self.engine).idle_knobs
        if not self.strands:
            told = f"engine {self.engine}: {', '.join(idle)} have no meaning here"
            return [told] if idle else []
        return [
            f"engine {self.engine}: fidelity.rows are strands; {', '.join(idle)} have no meaning here",
            f"fidelity {self._fidelity_to_text()}",
        ]

    def _fidelity_to_text(self) -> str:
        """The knobs of a fidelity, and by what they differ from its name."""
        named = fidelities(self.engine)[self.fidelity]
        shares = f"time step {self.time_step_s / self.stable_time_step_s:.2g} of the stable one"
        told = f"{self.strands} strand{'' if self.strands == 1 else 's'}, {self.stiffness_N_per_m:g} N/m, {shares}"
        same = (self.strands, self.stiffness_N_per_m) == (named["rows"], named["stiffness_N_per_m"])
        usual = f" (by name {named['rows']}, {named['stiffness_N_per_m']:g} N/m)"
        return f"{self.fidelity}: {told}{'' if same else usual}"

    def _steps_to_text(self) -> str:
        first = next(k for k, phase in enumerate(self.phases) if phase.time_step_s == self.time_step_s)
        told = f"time step {self.time_step_s:.3g} s (stable up to {self.stable_time_step_s:.3g} s)"
        return f"{told} from phase {first} on, {self.phases[0].time_step_s:.3g} s before" if first else told


def _told(wall: float) -> str:
    """A wall time for a person: in the unit in which it is a number of two or three digits."""
    for most, unit, name, form in ((10, 1, "s", ".1f"), (600, 1, "s", ".0f"), (7200, 60, "min", ".0f")):
        if wall < most:
            return f"{wall / unit:{form}} {name}"
    return f"{wall / 3600:.1f} h" if wall < 10 * 3600 else f"{wall / 3600:.0f} h"


def _doing(scene: Scene, index: int) -> Doing:
    """What smarticles do in a phase, as far as its cost goes."""
    phase = scene.phases[index]
    if phase.pours:
        return Doing.POUR
    if phase.actuates:
        return Doing.ACTUATE
    shaken = EffectName.CONTAINER_MOTION in phase.calls(scene, index)
    return Doing.SHAKE if shaken else Doing.REST


def plan(scene: Scene) -> Plan:
    """Plan a scene.

    Raises:
        InputError: the scene's time step is above the stable one.
    """
    kind = engine_kind(scene.engine)
    steps = time_steps(scene)
    particle = scene.particle
    spheres = len(particle.centres)
    phases = []
    for index, (phase, dt) in enumerate(zip(scene.phases, steps, strict=True)):
        estimate = phase.expected_duration(scene.count)
        wall = kind.seconds_per_second(scene, dt, _doing(scene, index)) * estimate
        phases.append(PlannedPhase(index, phase.kind, phase.known_duration, estimate, wall, dt))
    simulated = sum(phase.estimate_s for phase in phases)
    effects = decide(scene)
    impact, weight = expected_overlaps(scene)
    return Plan(
        name=scene.name,
        count=scene.count,
        spheres_per_smarticle=spheres,
        sphere_diameter_m=particle.chain.diameter,
        time_step_s=min(steps),
        stable_time_step_s=stable_step(scene),
        container_height_m=scene.cylinder.height,
        phases=tuple(phases),
        effects=effects,
        engines=kind.in_order(Adds.together(effect.adds for effect in effects).engines),
        frames=round(simulated / scene.recording.frame_interval_s),
        wall_s=sum(phase.wall_s for phase in phases),
        warnings=warnings_of(scene),
        planar=scene.plane is not None,
        engine=scene.engine,
        fidelity=scene.fidelity.base,
        overlap_impact=impact / particle.chain.diameter,
        overlap_weight=weight / particle.chain.diameter,
        stiffness_N_per_m=scene.fidelity.stiffness_N_per_m,
        strands=scene.fidelity.rows if scene.smooth else 0,
        protocol=protocol_lines(scene),
    )
