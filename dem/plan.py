"""What a run would do: phases, effects and why each is on or off, engines, time step, cost. Simulates nothing."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

from dem.actuation import actuated
from dem.chain import Arrange, Strain, chain_of
from dem.hooks import PullHook
from dem.parts import Deposit, Shake
from dem.phases import shake_amplitude
from dem.release import RemoveContainer
from dem.scene import Scene
from dem.timestep import stable_step, time_step

# Wall seconds per sphere and step in a dense pile, one core, measured with `make bench` (see README); machines
# differ by a factor of two.
COST_PER_SPHERE_STEP = 3.3e-7
# A step of articulated smarticles over one of welded ones: three bodies and four bonds each, and the motors' looks.
ARTICULATED_SHARE = 1.7
# A pour costs about half of the same time in the full pile, since the pile grows from nothing; 0.1 s per layer.
POUR_SHARE = 0.5
LAYER_SECONDS = 0.1


@dataclass(frozen=True)
class Effect:
    """One effect: whether the scene calls for it, and why."""

    name: str
    on: bool
    why: str
    costs: str


@dataclass(frozen=True)
class PlannedPhase:
    """One phase: its duration (None where a criterion ends it, then `estimate_s` is a guess) and its cost."""

    index: int
    type: str
    duration_s: float | None
    estimate_s: float
    wall_s: float


@dataclass(frozen=True)
class Plan:
    """Everything `smarticles plan` says."""

    name: str
    count: int
    spheres_per_smarticle: int
    sphere_diameter_m: float
    time_step_s: float
    stable_time_step_s: float
    container_height_m: float
    phases: tuple[PlannedPhase, ...]
    effects: tuple[Effect, ...]
    engines: tuple[str, ...]
    frames: int
    wall_s: float
    planar: bool = False

    def to_dict(self) -> dict[str, Any]:
        """Plain data for `--json`."""
        return asdict(self)

    def to_text(self) -> str:
        """A table for the terminal."""
        wall = "in a plane" if self.planar else f"wall {1e3 * self.container_height_m:.0f} mm high"
        lines = [
            f"{self.name}: {self.count} smarticles of {self.spheres_per_smarticle} spheres, "
            f"d = {1e3 * self.sphere_diameter_m:.3g} mm, {wall}",
            f"time step {self.time_step_s:.3g} s (stable up to {self.stable_time_step_s:.3g} s)",
            "",
            f"{'phase':<24}{'simulated':>12}{'expected wall time':>22}",
        ]
        for phase in self.phases:
            guess = "" if phase.duration_s is not None else "≈ "
            label = f"{phase.index} {phase.type}"
            lines.append(f"{label:<24}{f'{guess}{phase.estimate_s:.2f} s':>12}{f'{phase.wall_s:.0f} s':>22}")
        lines += [
            f"{'total':<24}{f'{sum(p.estimate_s for p in self.phases):.2f} s':>12}{f'{self.wall_s:.0f} s':>22}",
            "(one core; machines differ by a factor of two)",
            "",
            f"{'effect':<20}{'':<5}why",
        ]
        lines += [f"{effect.name:<20}{'on' if effect.on else 'off':<5}{effect.why}" for effect in self.effects]
        lines += ["", "engines: " + ", ".join(self.engines), f"frames: about {self.frames}"]
        return "\n".join(lines)


def plan(scene: Scene) -> Plan:
    """Plan a scene.

    Raises:
        InputError: the scene's time step is above the stable one.
    """
    dt = time_step(scene)
    particle = scene.particle
    spheres = len(particle.centres)
    rate = COST_PER_SPHERE_STEP * spheres * scene.count / dt
    phases = []
    for index, phase in enumerate(scene.phases):
        if isinstance(phase, Deposit):
            estimate = LAYER_SECONDS * math.ceil(scene.count / phase.per_layer) + 0.2
            phases.append(PlannedPhase(index, phase.type, None, estimate, POUR_SHARE * rate * estimate))
        elif isinstance(phase, Arrange):
            phases.append(PlannedPhase(index, phase.type, 0.0, 0.0, 0.0))
        else:
            estimate = phase.duration_s
            wall = rate * estimate * (ARTICULATED_SHARE if actuated(phase) else 1.0)
            phases.append(PlannedPhase(index, phase.type, estimate, estimate, wall))
    simulated = sum(phase.estimate_s for phase in phases)
    effects = _effects(scene)
    return Plan(
        name=scene.name,
        count=scene.count,
        spheres_per_smarticle=spheres,
        sphere_diameter_m=particle.chain.diameter,
        time_step_s=dt,
        stable_time_step_s=stable_step(scene),
        container_height_m=scene.cylinder.height,
        phases=tuple(phases),
        effects=effects,
        engines=_engines(effects),
        frames=round(simulated / scene.recording.frame_interval_s),
        wall_s=sum(phase.wall_s for phase in phases),
        planar=scene.plane is not None,
    )


def _effects(scene: Scene) -> tuple[Effect, ...]:
    contact, recording = scene.contact, scene.recording
    shakes = [(k, phase) for k, phase in enumerate(scene.phases) if isinstance(phase, Shake)]
    shaken = bool(shakes)
    amplitudes = ", ".join(
        f"phase {k}: Γ = {phase.peak_acceleration_g:g}, f = {phase.frequency_hz:g} Hz, "
        f"A = {1e3 * shake_amplitude(phase, scene.gravity_m_per_s2):.3g} mm"
        for k, phase in shakes
    )
    return (
        Effect("gravity", True, f"g = {scene.gravity_m_per_s2:g} m/s²", "part of the integrator"),
        Effect(
            "friction",
            contact.friction_smarticle > 0 or contact.friction_wall > 0,
            f"μ = {contact.friction_smarticle:g} between smarticles, {contact.friction_wall:g} at the container",
            "part of the contact law",
        ),
        Effect(
            "dissipation",
            contact.restitution < 1,
            f"restitution {contact.restitution:g} at a typical lever",
            "part of the contact law",
        ),
        Effect(
            "container motion",
            shaken,
            amplitudes if shaken else "no phase of type shake",
            "one engine over the container's bodies",
        ),
        Effect(
            "frames and series",
            True,
            f"a frame every {recording.frame_interval_s:g} s, a sample every {recording.series_interval_s:g} s",
            "reading the state of all smarticles",
        ),
        Effect(
            "checkpoints",
            recording.checkpoint_interval_s is not None,
            "recording.checkpoint_interval_s is null"
            if recording.checkpoint_interval_s is None
            else f"every {recording.checkpoint_interval_s:g} s; a killed run goes on from the last one",
            "saving and reloading the simulation",
        ),
        *_actuation_effects(scene),
        *_test_effects(scene),
        *_chain_effects(scene),
        Effect(
            "energy",
            recording.energy,
            "recording.energy is true" if recording.energy else "recording.energy is false",
            "one sum over the container's bodies per step while it is shaken",
        ),
    )


def _test_effects(scene: Scene) -> tuple[Effect, Effect]:
    hooks, why = scene.hooks, "no key hooks"
    if hooks is not None:
        pulls = [
            f"phase {k} raises the upper one by {1e3 * phase.distance_m:.3g} mm at {1e3 * phase.speed_m_per_s:.3g} mm/s"
            for k, phase in enumerate(scene.phases)
            if isinstance(phase, PullHook)
        ]
        why = (
            f"crosses at {1e3 * hooks.lower_height_m:.3g} and {1e3 * hooks.upper_height_m:.3g} mm, bars of "
            f"{1e3 * hooks.side_m:.3g} mm; {', '.join(pulls) or 'no phase pulls one'}"
        )
    removals = [
        f"phase {k}: "
        + ("at once" if phase.speed_m_per_s is None else f"lifted at {1e3 * phase.speed_m_per_s:.3g} mm/s")
        for k, phase in enumerate(scene.phases)
        if isinstance(phase, RemoveContainer)
    ]
    return (
        Effect(
            "hooks", hooks is not None, why, "four bodies, and their forces summed in every step" if hooks else "none"
        ),
        Effect("wall removal", bool(removals), ", ".join(removals) or "no phase of type remove-container", "none"),
    )


def _chain_effects(scene: Scene) -> tuple[Effect, ...]:
    if scene.plane is None:
        return (Effect("plane", False, "no key plane", "none"),)
    chain, width = chain_of(scene), scene.plane.width_m
    walls = "no walls"
    if width is not None:
        walls = f"two walls {1e3 * width:.3g} mm apart, h/H = {chain.width / width:.3g}"
    pulls = [
        f"phase {k} pulls at {1e3 * phase.speed_m_per_s:.3g} mm/s, tied at the {phase.tied_at}, "
        f"{phase.string_stiffness_N_per_m:g} N/m each"
        for k, phase in enumerate(scene.phases)
        if isinstance(phase, Strain)
    ]
    lies = f"smarticles move along x and y and turn about z; {walls}; the table carries them and does not rub"
    return (
        Effect("plane", True, lies, "three degrees of freedom blocked for each body, none added"),
        Effect("strings", bool(pulls), ", ".join(pulls) or "no phase of type strain", "two forces in every step"),
    )


def _actuation_effects(scene: Scene) -> tuple[Effect, Effect]:
    driven = [k for k, phase in enumerate(scene.phases) if actuated(phase)]
    if not driven:
        none = "no phase actuates; each smarticle is one welded clump"
        return Effect("articulation", False, none, "none"), Effect("motors", False, none, "none")
    numbers = ", ".join(map(str, driven))
    motor, pin = scene.motor, scene.fidelity.hinge_stiffness_N_per_m
    return (
        Effect(
            "articulation",
            True,
            f"phases {numbers}: three links and two hinges per smarticle, pins of {pin:g} N/m; welded in the others",
            "a shorter time step throughout; two bonds per hinge and three bodies per smarticle while articulated",
        ),
        Effect(
            "motors",
            True,
            f"ω = {motor.speed_limit_rad_per_s:g} rad/s, τ_max = {scene.torque_limit:.3g} N m ({motor.law}), "
            f"a look every {scene.fidelity.control_interval_s:g} s",
            "two readings per smarticle and look",
        ),
    )


def _engines(effects: tuple[Effect, ...]) -> tuple[str, ...]:
    on = {effect.name for effect in effects if effect.on}
    engines = ["ForceResetter", "InsertionSortCollider", "InteractionLoop"]
    if "container motion" in on:
        engines.append("HarmonicMotionEngine")
    return (*engines, "NewtonIntegrator")
