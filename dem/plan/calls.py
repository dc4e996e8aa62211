"""Whether a scene calls for an effect, and why: one rule for each effect of `dem.plan.effects`."""

from __future__ import annotations

from dem.engine.effect import EffectName
from dem.phases.actuated import overshoot
from dem.phases.arrange import chain_of
from dem.scene.scene import Scene

Call = tuple[bool, str]


def container(scene: Scene) -> Call:
    """Floor and wall, unless smarticles lie in a plane."""
    if scene.plane is not None:
        return False, "key plane: a table, and walls if it says so"
    return True, f"a wall {1e3 * scene.cylinder.height:.0f} mm high"


def plane(scene: Scene) -> Call:
    """Motion in a plane, by the key plane."""
    if scene.plane is None:
        return False, "no key plane"
    width, walls = scene.plane.width_m, "no walls"
    if width is not None:
        walls = f"two walls {1e3 * width:.3g} mm apart, h/H = {chain_of(scene).width / width:.3g}"
    return True, f"smarticles move along x and y and turn about z; {walls}; the table carries them and does not rub"


def strings(scene: Scene) -> Call:
    """Strings that pull a chain apart, by phases of type strain."""
    return _by_phases(scene, EffectName.STRINGS, "no phase of type strain")


def gravity(scene: Scene) -> Call:
    """Weight."""
    if scene.plane is not None:
        return scene.gravity_m_per_s2 > 0, "the table carries it, and nothing moves along it"
    return scene.gravity_m_per_s2 > 0, f"g = {scene.gravity_m_per_s2:g} m/s²"


def friction(scene: Scene) -> Call:
    """Coulomb friction at any contact."""
    contact = scene.contact
    return (
        contact.friction_smarticle > 0 or contact.friction_wall > 0,
        f"μ = {contact.friction_smarticle:g} between smarticles, {contact.friction_wall:g} at the container",
    )


def restitution(scene: Scene) -> Call:
    """Dashpots at contacts."""
    return scene.contact.restitution < 1, f"restitution {scene.contact.restitution:g} at a typical lever"


def container_motion(scene: Scene) -> Call:
    """What shakes, by phases of type shake."""
    return _by_phases(scene, EffectName.CONTAINER_MOTION, "no phase of type shake")


def articulation(scene: Scene) -> Call:
    """Links and hinges, by phases that actuate."""
    if not scene.actuates:
        return False, "no phase actuates; each smarticle is one welded clump"
    numbers = _told(scene, EffectName.ARTICULATION)
    return (
        True,
        f"phase{'s' if len(numbers) > 1 else ''} {', '.join(numbers)}: three links and two hinges per smarticle, pins "
        f"of {scene.fidelity.hinge_stiffness_N_per_m:g} N/m; welded in the others",
    )


def motors(scene: Scene) -> Call:
    """Motors and their series, by phases that actuate."""
    if not scene.actuates:
        return False, "no phase actuates"
    return (
        True,
        f"ω = {scene.motor.speed_limit_rad_per_s:g} rad/s, a look every {scene.fidelity.control_interval_s:g} s",
    )


def torque_cap(scene: Scene) -> Call:
    """The limit of the motors' torque."""
    if not scene.actuates:
        return False, "no phase actuates"
    beyond = f", by one look gone beyond by up to {share:.2g} τ_max" if (share := overshoot(scene)) else ""
    return True, f"τ_max = {scene.torque_limit:.3g} N m, law {scene.motor.law}{beyond}"


def hooks(scene: Scene) -> Call:
    """Hooks, by the key hooks."""
    hooks = scene.hooks
    if hooks is None:
        return False, "no key hooks"
    pulls = _told(scene, EffectName.HOOKS)
    grid = f", the lower one of {hooks.lower_bars} each way over {1e3 * hooks.lower_length_m:.3g} mm"
    below = grid if hooks.lower_bars > 1 else ""
    return (
        True,
        f"crosses at {1e3 * hooks.lower_height_m:.3g} and {1e3 * hooks.upper_height_m:.3g} mm, bars of "
        f"{1e3 * hooks.side_m:.3g} mm{below}; {', '.join(pulls) or 'no phase pulls one'}",
    )


def wall_removal(scene: Scene) -> Call:
    """Phases of type remove-container."""
    return _by_phases(scene, EffectName.WALL_REMOVAL, "no phase of type remove-container")


def energies(scene: Scene) -> Call:
    """Energies in the series, where asked for or needed by the energy ledger."""
    recording = scene.recording
    if recording.energies and not recording.energy:
        return True, "recording.dissipation_interval_s is given, and the energy ledger needs them"
    return recording.energies, f"recording.energy is {str(recording.energy).lower()}"


def energy_account(scene: Scene) -> Call:
    """The ledger of what is dissipated."""
    return _every(scene.recording.dissipation_interval_s, "dissipation_interval_s", "dissipation is sampled")


def series(scene: Scene) -> Call:
    """Time series."""
    return _every(scene.recording.series_interval_s, "series_interval_s", "a sample")


def frames(scene: Scene) -> Call:
    """VTK frames."""
    return _every(scene.recording.frame_interval_s, "frame_interval_s", "a frame")


def contact_forces(scene: Scene) -> Call:
    """Forces at contacts, where asked for."""
    asked = scene.recording.contact_forces
    return asked, "with each frame" if asked else "recording.contact_forces is false"


def sphere_glyphs(scene: Scene) -> Call:
    """Frames of spheres."""
    return _every(scene.recording.sphere_interval_s, "sphere_interval_s", "all spheres")


def checkpoints(scene: Scene) -> Call:
    """Checkpoints."""
    on, why = _every(scene.recording.checkpoint_interval_s, "checkpoint_interval_s", "one")
    return on, f"{why}; a killed run goes on from the last one" if on else why


def _every(interval: float | None, key: str, what: str) -> Call:
    return interval is not None, f"recording.{key} is null" if interval is None else f"{what} every {interval:g} s"


def _told(scene: Scene, effect: EffectName) -> list[str]:
    """What phases call for an effect for, in words."""
    told = (phase.calls(scene, index) for index, phase in enumerate(scene.phases))
    return [each[effect] for each in told if effect in each]


def _by_phases(scene: Scene, effect: EffectName, otherwise: str) -> Call:
    told = _told(scene, effect)
    return bool(told), ", ".join(told) or otherwise
