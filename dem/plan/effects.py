"""Decide which effects a scene needs and why, and list what each effect adds to a run."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from dem.engine.effect import Adds, EffectName
from dem.engine.kinds import engine_kind
from dem.phases.actuated import overshoot
from dem.phases.arrange import chain_of
from dem.phases.deposit import Deposit
from dem.phases.take_over import TakeOver
from dem.record import columns
from dem.record.names import VTKHDF
from dem.scene.scene import Scene

_NOTHING = Adds()
_ONE_FILE = "reads all contacts and adds a step to one file"

ADDS: Mapping[EffectName, Adds] = {
    EffectName.STRINGS: Adds(series=tuple(columns.STRAIN_COLUMNS)),
    EffectName.MOTORS: Adds(series=tuple(columns.MOTOR_COLUMNS), arrays=tuple(columns.MOTOR_FIELDS)),
    EffectName.HOOKS: Adds(series=tuple(columns.HOOK_COLUMNS)),
    EffectName.PLATE: Adds(series=tuple(columns.PLATE_COLUMNS), python="reads its force every 10 ms or more often"),
    EffectName.GRIPS: Adds(series=tuple(columns.GRIP_COLUMNS)),
    EffectName.WALL_REMOVAL: Adds(
        series=tuple(columns.RELEASE_COLUMNS), python="checks the pile's top every 10 ms while the wall is lifted"
    ),
    EffectName.FILAMENTS: Adds(series=tuple(columns.FILAMENT_COLUMNS)),
    EffectName.JOINTS: Adds(series=tuple(columns.JOINT_COLUMNS)),
    EffectName.ENERGIES: Adds(series=tuple(columns.ENERGY_COLUMNS)),
    EffectName.ENERGY_ACCOUNT: Adds(series=tuple(columns.LEDGER_COLUMNS)),
    EffectName.SERIES: Adds(
        series=tuple(columns.COLUMNS), files=("series.h5",), python="reads the state of all bodies once per sample"
    ),
    EffectName.FRAMES: Adds(
        arrays=tuple(columns.FIELDS),
        files=("frames.pvd", "frames"),
        python="reads all contacts and writes one file per frame",
    ),
    EffectName.CONTACT_FORCES: Adds(
        arrays=tuple(columns.FORCE_FIELDS),
        files=("forces.pvd", "forces"),
        python="reads the forces of all contacts and writes one file per frame",
    ),
    EffectName.SPHERE_GLYPHS: Adds(
        files=("spheres.pvd", "spheres"), python="writes one file per interval, a point per sphere"
    ),
    EffectName.CHECKPOINTS: Adds(files=("checkpoint.zip", "checkpoint.previous.zip")),
}
"""Additions of effects on every engine; `EngineKind.adds` has those on one engine."""


@dataclass(frozen=True)
class Decision:
    """Decision whether a scene needs an effect."""

    name: EffectName
    on: bool  #: Whether the scene needs the effect
    why: str  #: Reason in words
    adds: Adds  #: Additions to the run; empty for an effect that is off


def decide(scene: Scene) -> tuple[Decision, ...]:
    """Return a decision for each effect: whether the scene needs it, why, and what it adds to a run."""
    own, reasons, common = engine_kind(scene.engine).adds, _reasons(scene), dict(ADDS)
    if scene.recording.frames == "vtkhdf":
        common[EffectName.FRAMES] = replace(common[EffectName.FRAMES], files=(VTKHDF,), python=_ONE_FILE)
    return tuple(
        Decision(
            name, on, why, Adds.together((own.get(name, _NOTHING), common.get(name, _NOTHING))) if on else _NOTHING
        )
        for name, (on, why) in ((name, reasons[name]) for name in EffectName)
    )


def called_for(scene: Scene) -> frozenset[EffectName]:
    """Return the effects that a scene needs."""
    return frozenset(name for name, (on, _) in _reasons(scene).items() if on)


def _reasons(scene: Scene) -> Mapping[EffectName, tuple[bool, str]]:
    contact, plane, gravity = scene.contact, scene.plane, scene.gravity_m_per_s2
    recording = scene.recording
    by_phases: dict[EffectName, list[str]] = {}
    for index, phase in enumerate(scene.phases):
        for name, why in phase.calls(scene, index).items():
            by_phases.setdefault(name, []).append(why)

    def phases(name: EffectName, otherwise: str) -> tuple[bool, str]:
        return name in by_phases, ", ".join(by_phases.get(name, [])) or otherwise

    def every(key: str, what: str) -> tuple[bool, str]:
        interval = getattr(recording, key)
        return interval is not None, f"recording.{key} is null" if interval is None else f"{what} every {interval:g} s"

    checked, each = every("checkpoint_interval_s", "one")
    energies = f"recording.energy is {str(recording.energy).lower()}"
    if recording.energies and not recording.energy:
        energies = "recording.dissipation_interval_s is given, and the energy ledger needs them"
    waits = [
        f"; phase {index} waits until all are slower than {speed:g} m/s, "
        f"{speed / math.sqrt(gravity * scene.model.size):.2g} √(g {'w' if scene.particle is None else 'longest bar'})"
        for index, phase in enumerate(scene.phases)
        if isinstance(phase, Deposit | TakeOver) and (speed := phase.settle.speed_m_per_s)
    ]
    return {
        EffectName.CONTACT: (True, "every scene has bodies that touch each other and a floor"),
        EffectName.CONTAINER: (True, f"a wall {1e3 * scene.cylinder.height:.0f} mm high")
        if plane is None
        else (False, "key plane: a table, and walls if it says so"),
        EffectName.PLANE: _plane(scene),
        EffectName.STRINGS: phases(EffectName.STRINGS, "no phase of type strain"),
        EffectName.GRAVITY: (
            gravity > 0,
            f"g = {gravity:g} m/s²{''.join(waits)}"
            if plane is None
            else "the table carries it, and nothing moves along it",
        ),
        EffectName.FRICTION: (
            contact.friction_smarticle > 0 or contact.friction_wall > 0,
            f"μ = {contact.friction_smarticle:g} between bodies, {contact.friction_wall:g} at the container",
        ),
        EffectName.RESTITUTION: (
            contact.restitution < 1,
            f"coefficient {contact.restitution:g} at the typical effective mass",
        ),
        EffectName.CONTAINER_MOTION: phases(EffectName.CONTAINER_MOTION, "no phase of type shake"),
        **_motors(scene, by_phases.get(EffectName.ARTICULATION, [])),
        EffectName.HOOKS: _hooks(scene, ", ".join(by_phases.get(EffectName.HOOKS, []))),
        EffectName.WALL_REMOVAL: phases(EffectName.WALL_REMOVAL, "no phase of type remove-container"),
        EffectName.PLATE: phases(EffectName.PLATE, "no phase of type compress"),
        EffectName.GRIPS: phases(EffectName.GRIPS, "no phase of type tension or lift"),
        EffectName.FILAMENTS: _filaments(scene),
        EffectName.JOINTS: _joints(scene),
        EffectName.ENERGIES: (recording.energies, energies),
        EffectName.ENERGY_ACCOUNT: every("dissipation_interval_s", "dissipation is sampled"),
        EffectName.SERIES: every("series_interval_s", "a sample"),
        EffectName.FRAMES: every("frame_interval_s", "a frame"),
        EffectName.CONTACT_FORCES: (
            recording.contact_forces,
            "with each frame" if recording.contact_forces else "recording.contact_forces is false",
        ),
        EffectName.SPHERE_GLYPHS: every("sphere_interval_s", "all spheres"),
        EffectName.CHECKPOINTS: (checked, f"{each}; a killed run goes on from the last one" if checked else each),
    }


def _plane(scene: Scene) -> tuple[bool, str]:
    if scene.plane is None:
        return False, "no key plane"
    width, walls = scene.plane.width_m, "no walls"
    if width is not None:
        walls = f"two walls {1e3 * width:.3g} mm apart, h/H = {chain_of(scene).width / width:.3g}"
    return True, f"smarticles move along x and y and turn about z; {walls}; the table carries them and does not rub"


def _motors(scene: Scene, numbers: list[str]) -> dict[EffectName, tuple[bool, str]]:
    if not scene.actuates:
        off = (False, "no phase actuates")
        what = "each smarticle is one rigid body" if scene.particle is None else "only smarticles have barbs"
        welded = (False, f"{off[1]}; {what}")
        return {EffectName.ARTICULATION: welded, EffectName.MOTORS: off, EffectName.TORQUE_CAP: off}
    motor, fidelity, share = scene.motor, scene.fidelity, overshoot(scene)
    beyond = f", exceeded by up to {share:.2g} τ_max between control updates" if share else ""
    return {
        EffectName.ARTICULATION: (
            True,
            f"phase{'s' if len(numbers) > 1 else ''} {', '.join(numbers)}: three links and two hinges per smarticle, "
            f"{'without play' if scene.smooth else f'pins of {fidelity.hinge_stiffness_N_per_m:g} N/m'}; welded in the "
            "others",
        ),
        EffectName.MOTORS: (
            True,
            f"ω = {motor.speed_limit_rad_per_s:g} rad/s, shafts of {motor.stiffness_N_m_per_rad:g} N m/rad, twisted by "
            f"{math.degrees(scene.torque_limit / motor.stiffness_N_m_per_rad):.2g}° at τ_max, a control update every "
            f"{fidelity.control_interval_s:g} s",
        ),
        EffectName.TORQUE_CAP: (True, f"τ_max = {scene.torque_limit:.3g} N m, law {motor.law}{beyond}"),
    }


def _filaments(scene: Scene) -> tuple[bool, str]:
    if scene.mixture is None or not scene.mixture.flexible:
        return False, "particle has no shape filament"
    liquid = scene.liquid
    around = "no liquid"
    if liquid is not None:
        around = f"a liquid of {liquid.density_kg_per_m3:g} kg/m³ and {liquid.viscosity_Pa_s:g} Pa s"
    segments = scene.mixture.mean([len(kind.bars.points) for kind in scene.mixture.kinds])
    return True, f"{segments:g} segments each; {around}"


def _joints(scene: Scene) -> tuple[bool, str]:
    linkages = [] if scene.mixture is None else [kind.linkage for kind in scene.mixture.kinds if kind.linkage]
    if not linkages:
        return False, "particle has no shape chain"
    joints = [joint for linkage in linkages for joint in linkage.joints]
    laws = {law: sum(joint.law == law for joint in joints) for law in ("free", "elastic", "motor")}
    return True, ", ".join(f"{number} {law}" for law, number in laws.items() if number) + " of all kinds of chains"


def _hooks(scene: Scene, pulls: str) -> tuple[bool, str]:
    hooks = scene.hooks
    if hooks is None:
        return False, "no key hooks"
    grid = f", the lower one of {hooks.lower_bars} each way over {1e3 * hooks.lower_length_m:.3g} mm"
    return (
        True,
        f"crosses at {1e3 * hooks.lower_height_m:.3g} and {1e3 * hooks.upper_height_m:.3g} mm, bars of "
        f"{1e3 * hooks.side_m:.3g} mm{grid if hooks.lower_bars > 1 else ''}; {pulls or 'no phase pulls one'}",
    )
