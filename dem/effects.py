"""The effects that a scene may call for: for each one whether a scene does, why, and what it adds to a run.

This is the one place that knows: the engine is built from it (`dem.construction`), `dem.run` asks it what to construct,
`dem.plan` prints it, and tests hold YADE's own lists and the files of runs against it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from itertools import chain

from dem.actuation import actuated
from dem.actuation_checks import overshoot
from dem.assembly import SMARTICLE_MATERIAL
from dem.chain import Strain, chain_of
from dem.columns import (
    COLUMNS,
    ENERGY_COLUMNS,
    HOOK_COLUMNS,
    LEDGER_COLUMNS,
    MOTOR_COLUMNS,
    RELEASE_COLUMNS,
    STRAIN_COLUMNS,
)
from dem.container import WALL_MATERIAL
from dem.hinges import HINGE_MATERIAL
from dem.hooks import PullHook
from dem.parts import Shake, shake_amplitude
from dem.release import RemoveContainer
from dem.scene import Scene

# Whether a scene calls for an effect, and why.
Rule = Callable[[Scene], tuple[bool, str]]


@dataclass(frozen=True, kw_only=True)
class Adds:
    """What an effect adds to a run; nothing of it exists in a run without the effect.

    Args:
        engines: YADE's engines, by class.
        functors: what the collider and the loop over contacts are given to work with, by class.
        materials: labels of YADE's materials.
        shapes: classes of the shapes of bodies.
        series: datasets of `series.h5`.
        arrays: cell data of every frame.
        files: of the run directory.
        python: what Python does for it, and how often, and what else it takes.
    """

    engines: tuple[str, ...] = ()
    functors: tuple[str, ...] = ()
    materials: tuple[str, ...] = ()
    shapes: tuple[str, ...] = ()
    series: tuple[str, ...] = ()
    arrays: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    python: str = ""

    @staticmethod
    def together(parts: Iterable[Adds]) -> Adds:
        """The union, in order of mention."""
        each = list(parts)
        names = [field.name for field in fields(Adds) if field.name != "python"]
        lists = {
            name: tuple(dict.fromkeys(chain.from_iterable(getattr(part, name) for part in each))) for name in names
        }
        return Adds(**lists, python="; ".join(part.python for part in each if part.python))

    def to_text(self) -> str:
        """One line, lists that are long by their length; empty for nothing."""
        counted = ((self.functors, "functors"), (self.series, "datasets"), (self.arrays, "arrays per frame"))
        named = (
            ("engines", self.engines),
            ("materials", self.materials),
            ("bodies", self.shapes),
            ("files", self.files),
        )
        told = [f"{what} {', '.join(names)}" for what, names in named if names]
        told += [f"{len(names)} {what}" for names, what in counted if names]
        return "; ".join(filter(None, [*told, self.python]))


@dataclass(frozen=True, kw_only=True)
class Effect:
    """One effect, for all scenes.

    Args:
        name: as `smarticles plan` prints it.
        rule: whether a scene calls for it, and why.
        adds: what it adds where a scene does.
    """

    name: str
    rule: Rule
    adds: Adds = Adds()

    def called_for(self, scene: Scene) -> bool:
        """Whether a scene calls for it."""
        return self.rule(scene)[0]

    def decided(self, scene: Scene) -> Decision:
        """What it comes to in a scene."""
        on, why = self.rule(scene)
        return Decision(self.name, on, why, self.adds if on else Adds())


@dataclass(frozen=True)
class Decision:
    """One effect in one scene: whether it is on, why, and what it adds: nothing where it is off."""

    name: str
    on: bool
    why: str
    adds: Adds


def decide(scene: Scene) -> tuple[Decision, ...]:
    """All effects of a scene, on or off."""
    return tuple(effect.decided(scene) for effect in EFFECTS)


# -- whether a scene calls for it, and why -------------------------------------------------------------------------


def _container(scene: Scene) -> tuple[bool, str]:
    if scene.plane is not None:
        return False, "key plane: a table, and walls if it says so"
    return True, f"a wall {1e3 * scene.cylinder.height:.0f} mm high"


def _plane(scene: Scene) -> tuple[bool, str]:
    if scene.plane is None:
        return False, "no key plane"
    width, walls = scene.plane.width_m, "no walls"
    if width is not None:
        walls = f"two walls {1e3 * width:.3g} mm apart, h/H = {chain_of(scene).width / width:.3g}"
    return True, f"smarticles move along x and y and turn about z; {walls}; the table carries them and does not rub"


def _strings(scene: Scene) -> tuple[bool, str]:
    pulls = [
        f"phase {k} pulls at {1e3 * phase.speed_m_per_s:.3g} mm/s, tied at the {phase.tied_at}, "
        f"{phase.string_stiffness_N_per_m:g} N/m each"
        for k, phase in enumerate(scene.phases)
        if isinstance(phase, Strain)
    ]
    return bool(pulls), ", ".join(pulls) or "no phase of type strain"


def _gravity(scene: Scene) -> tuple[bool, str]:
    return scene.gravity_m_per_s2 > 0, f"g = {scene.gravity_m_per_s2:g} m/s²"


def _friction(scene: Scene) -> tuple[bool, str]:
    contact = scene.contact
    return (
        contact.friction_smarticle > 0 or contact.friction_wall > 0,
        f"μ = {contact.friction_smarticle:g} between smarticles, {contact.friction_wall:g} at the container",
    )


def _restitution(scene: Scene) -> tuple[bool, str]:
    return scene.contact.restitution < 1, f"restitution {scene.contact.restitution:g} at a typical lever"


def _container_motion(scene: Scene) -> tuple[bool, str]:
    removed = next((k for k, phase in enumerate(scene.phases) if isinstance(phase, RemoveContainer)), len(scene.phases))
    shakes = [
        f"phase {k}: Γ = {phase.peak_acceleration_g:g}, f = {phase.frequency_hz:g} Hz, "
        f"A = {1e3 * shake_amplitude(phase, scene.gravity_m_per_s2):.3g} mm{', the floor alone' if k > removed else ''}"
        for k, phase in enumerate(scene.phases)
        if isinstance(phase, Shake)
    ]
    return bool(shakes), ", ".join(shakes) or "no phase of type shake"


def _articulation(scene: Scene) -> tuple[bool, str]:
    if not scene.actuates:
        return False, "no phase actuates; each smarticle is one welded clump"
    numbers = [str(k) for k, phase in enumerate(scene.phases) if actuated(phase)]
    return (
        True,
        f"phase{'s' if len(numbers) > 1 else ''} {', '.join(numbers)}: three links and two hinges per smarticle, pins "
        f"of {scene.fidelity.hinge_stiffness_N_per_m:g} N/m; welded in the others",
    )


def _motors(scene: Scene) -> tuple[bool, str]:
    if not scene.actuates:
        return False, "no phase actuates"
    return (
        True,
        f"ω = {scene.motor.speed_limit_rad_per_s:g} rad/s, a look every {scene.fidelity.control_interval_s:g} s",
    )


def _torque_cap(scene: Scene) -> tuple[bool, str]:
    if not scene.actuates:
        return False, "no phase actuates"
    beyond = f", by one look gone beyond by up to {share:.2g} τ_max" if (share := overshoot(scene)) else ""
    return True, f"τ_max = {scene.torque_limit:.3g} N m, law {scene.motor.law}{beyond}"


def _hooks(scene: Scene) -> tuple[bool, str]:
    hooks = scene.hooks
    if hooks is None:
        return False, "no key hooks"
    pulls = [
        f"phase {k} raises the upper one by {1e3 * phase.distance_m:.3g} mm at {1e3 * phase.speed_m_per_s:.3g} mm/s"
        for k, phase in enumerate(scene.phases)
        if isinstance(phase, PullHook)
    ]
    return (
        True,
        f"crosses at {1e3 * hooks.lower_height_m:.3g} and {1e3 * hooks.upper_height_m:.3g} mm, bars of "
        f"{1e3 * hooks.side_m:.3g} mm; {', '.join(pulls) or 'no phase pulls one'}",
    )


def _wall_removal(scene: Scene) -> tuple[bool, str]:
    removals = [
        f"phase {k}: "
        + ("at once" if phase.speed_m_per_s is None else f"lifted at {1e3 * phase.speed_m_per_s:.3g} mm/s")
        for k, phase in enumerate(scene.phases)
        if isinstance(phase, RemoveContainer)
    ]
    return bool(removals), ", ".join(removals) or "no phase of type remove-container"


def _energies(scene: Scene) -> tuple[bool, str]:
    recording = scene.recording
    if recording.energies and not recording.energy:
        return True, "recording.dissipation_interval_s is given, and the account needs them"
    return recording.energies, f"recording.energy is {str(recording.energy).lower()}"


def _energy_account(scene: Scene) -> tuple[bool, str]:
    return _every(scene.recording.dissipation_interval_s, "dissipation_interval_s", "dissipation is sampled")


def _series(scene: Scene) -> tuple[bool, str]:
    return _every(scene.recording.series_interval_s, "series_interval_s", "a sample")


def _frames(scene: Scene) -> tuple[bool, str]:
    return _every(scene.recording.frame_interval_s, "frame_interval_s", "a frame")


def _sphere_glyphs(scene: Scene) -> tuple[bool, str]:
    return _every(scene.recording.sphere_interval_s, "sphere_interval_s", "all spheres")


def _checkpoints(scene: Scene) -> tuple[bool, str]:
    on, why = _every(scene.recording.checkpoint_interval_s, "checkpoint_interval_s", "one")
    return on, f"{why}; a killed run goes on from the last one" if on else why


def _every(interval: float | None, key: str, what: str) -> tuple[bool, str]:
    return interval is not None, f"recording.{key} is null" if interval is None else f"{what} every {interval:g} s"


# -- what it adds --------------------------------------------------------------------------------------------------

CONTACT = Effect(
    name="contact",
    rule=lambda _: (True, "every scene has smarticles that touch each other and a floor"),
    adds=Adds(
        engines=("ForceResetter", "InsertionSortCollider", "InteractionLoop", "NewtonIntegrator"),
        functors=(
            "Bo1_Sphere_Aabb",
            "Bo1_Wall_Aabb",
            "Ig2_Sphere_Sphere_ScGeom",
            "Ig2_Wall_Sphere_ScGeom",
            "Ip2_ViscElMat_ViscElMat_ViscElPhys",
            "Law2_ScGeom_ViscElPhys_Basic",
        ),
        materials=(SMARTICLE_MATERIAL, WALL_MATERIAL),
        shapes=("Wall", "Sphere", "Clump"),
    ),
)
CONTAINER = Effect(
    name="container",
    rule=_container,
    adds=Adds(functors=("Bo1_Facet_Aabb", "Ig2_Facet_Sphere_ScGeom"), shapes=("Facet",)),
)
PLANE = Effect(
    name="plane",
    rule=_plane,
    adds=Adds(python="three degrees of freedom blocked for each body; sums the forces on two walls in every step"),
)
STRINGS = Effect(
    name="strings",
    rule=_strings,
    adds=Adds(series=tuple(STRAIN_COLUMNS), python="two forces in every step"),
)
# Numbers of the integrator and of the one contact law that YADE has for springs with dashpots: there is none without
# friction or without dashpots, so that a scene that sets them to zero has the same sums with a zero in them.
GRAVITY = Effect(name="gravity", rule=_gravity)
FRICTION = Effect(name="friction", rule=_friction)
RESTITUTION = Effect(name="restitution", rule=_restitution)
CONTAINER_MOTION = Effect(name="container motion", rule=_container_motion, adds=Adds(engines=("HarmonicMotionEngine",)))
ARTICULATION = Effect(
    name="articulation",
    rule=_articulation,
    adds=Adds(
        functors=(
            "Ig2_GridNode_GridNode_GridNodeGeom6D",
            "Ip2_CohFrictMat_CohFrictMat_CohFrictPhys",
            "Law2_ScGeom6D_CohFrictPhys_CohesionMoment",
        ),
        materials=(HINGE_MATERIAL,),
        shapes=("GridNode",),
        python="while articulated three bodies and four bonds per smarticle; a shorter time step throughout",
    ),
)
MOTORS = Effect(
    name="motors",
    rule=_motors,
    adds=Adds(
        series=tuple(MOTOR_COLUMNS),
        arrays=("angle_rad", "motor_torque_N_m", "motor_work_J", "halted"),
        python="two readings per smarticle and look",
    ),
)
# A comparison in each look; the law slip gives each bond of a shaft a cap of its own.
TORQUE_CAP = Effect(name="torque cap", rule=_torque_cap)
HOOKS = Effect(
    name="hooks",
    rule=_hooks,
    adds=Adds(
        functors=("Bo1_Box_Aabb", "Ig2_Box_Sphere_ScGeom"),
        shapes=("Box",),
        series=tuple(HOOK_COLUMNS),
        python="sums the forces on four bars in every step",
    ),
)
WALL_REMOVAL = Effect(
    name="wall removal",
    rule=_wall_removal,
    adds=Adds(series=tuple(RELEASE_COLUMNS), python="looks at the pile's top every 10 ms while the wall is lifted"),
)
ENERGIES = Effect(
    name="energies",
    rule=_energies,
    adds=Adds(series=tuple(ENERGY_COLUMNS), python="sums the forces on what moves in every step, while anything does"),
)
ENERGY_ACCOUNT = Effect(
    name="energy account",
    rule=_energy_account,
    adds=Adds(series=tuple(LEDGER_COLUMNS), python="reads every contact twice per sample"),
)
SERIES = Effect(
    name="series",
    rule=_series,
    adds=Adds(series=tuple(COLUMNS), files=("series.h5",), python="reads the state of all smarticles once per sample"),
)
FRAMES = Effect(
    name="frames",
    rule=_frames,
    adds=Adds(
        arrays=(
            "smarticle_id",
            "link",
            "velocity_m_per_s",
            "angular_velocity_rad_per_s",
            "contacts",
            "time_s",
            "floor_z_m",
            "phase",
        ),
        files=("frames.pvd", "frames"),
        python="reads all contacts and writes one file per frame",
    ),
)
SPHERE_GLYPHS = Effect(
    name="sphere glyphs",
    rule=_sphere_glyphs,
    adds=Adds(files=("spheres.pvd", "spheres"), python="writes one file per interval, a point per sphere"),
)
CHECKPOINTS = Effect(
    name="checkpoints",
    rule=_checkpoints,
    adds=Adds(
        files=("checkpoint.zip", "checkpoint.previous.zip"),
        python="saves and reloads the simulation once per checkpoint",
    ),
)

EFFECTS = (
    CONTACT,
    CONTAINER,
    PLANE,
    STRINGS,
    GRAVITY,
    FRICTION,
    RESTITUTION,
    CONTAINER_MOTION,
    ARTICULATION,
    MOTORS,
    TORQUE_CAP,
    HOOKS,
    WALL_REMOVAL,
    ENERGIES,
    ENERGY_ACCOUNT,
    SERIES,
    FRAMES,
    SPHERE_GLYPHS,
    CHECKPOINTS,
)
