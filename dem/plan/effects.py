"""The effects that a scene may call for: for each one whether a scene does, why, and what it adds to a run.

This is the one place that knows: the engine is built from it (`dem.engine.yade.construction`), `dem.run.run` asks it what to construct,
`dem.plan.outlook` prints it, and tests hold YADE's own lists and the files of runs against it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from itertools import chain

from dem.engine.yade.assembly import SMARTICLE_MATERIAL
from dem.engine.yade.hinges import HINGE_MATERIAL
from dem.plan import calls
from dem.record.columns import (
    COLUMNS,
    ENERGY_COLUMNS,
    HOOK_COLUMNS,
    LEDGER_COLUMNS,
    MOTOR_COLUMNS,
    RELEASE_COLUMNS,
    STRAIN_COLUMNS,
)
from dem.scene.scene import Scene
from dem.setting.container import WALL_MATERIAL

Rule = Callable[[Scene], tuple[bool, str]]
"""Whether a scene calls for an effect, and why."""


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
    rule=calls.container,
    adds=Adds(functors=("Bo1_Facet_Aabb", "Ig2_Facet_Sphere_ScGeom"), shapes=("Facet",)),
)
PLANE = Effect(
    name="plane",
    rule=calls.plane,
    adds=Adds(python="three degrees of freedom blocked for each body; sums the forces on two walls in every step"),
)
STRINGS = Effect(
    name="strings",
    rule=calls.strings,
    adds=Adds(series=tuple(STRAIN_COLUMNS), python="two forces in every step"),
)
# Numbers of the integrator and of the one contact law that YADE has for springs with dashpots: there is none without
# friction or without dashpots, so that a scene that sets them to zero has the same sums with a zero in them.
GRAVITY = Effect(name="gravity", rule=calls.gravity)
FRICTION = Effect(name="friction", rule=calls.friction)
RESTITUTION = Effect(name="restitution", rule=calls.restitution)
CONTAINER_MOTION = Effect(
    name="container motion", rule=calls.container_motion, adds=Adds(engines=("HarmonicMotionEngine",))
)
ARTICULATION = Effect(
    name="articulation",
    rule=calls.articulation,
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
    rule=calls.motors,
    adds=Adds(
        series=tuple(MOTOR_COLUMNS),
        arrays=("angle_rad", "motor_torque_N_m", "motor_work_J", "halted"),
        python="two readings per smarticle and look",
    ),
)
# A comparison in each look; the law slip gives each bond of a shaft a cap of its own.
TORQUE_CAP = Effect(name="torque cap", rule=calls.torque_cap)
HOOKS = Effect(
    name="hooks",
    rule=calls.hooks,
    adds=Adds(
        functors=("Bo1_Box_Aabb", "Ig2_Box_Sphere_ScGeom"),
        shapes=("Box",),
        series=tuple(HOOK_COLUMNS),
        python="sums the forces on four bars in every step",
    ),
)
WALL_REMOVAL = Effect(
    name="wall removal",
    rule=calls.wall_removal,
    adds=Adds(series=tuple(RELEASE_COLUMNS), python="looks at the pile's top every 10 ms while the wall is lifted"),
)
ENERGIES = Effect(
    name="energies",
    rule=calls.energies,
    adds=Adds(series=tuple(ENERGY_COLUMNS), python="sums the forces on what moves in every step, while anything does"),
)
ENERGY_ACCOUNT = Effect(
    name="energy account",
    rule=calls.energy_account,
    adds=Adds(series=tuple(LEDGER_COLUMNS), python="reads every contact twice per sample"),
)
SERIES = Effect(
    name="series",
    rule=calls.series,
    adds=Adds(series=tuple(COLUMNS), files=("series.h5",), python="reads the state of all smarticles once per sample"),
)
FRAMES = Effect(
    name="frames",
    rule=calls.frames,
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
    rule=calls.sphere_glyphs,
    adds=Adds(files=("spheres.pvd", "spheres"), python="writes one file per interval, a point per sphere"),
)
CHECKPOINTS = Effect(
    name="checkpoints",
    rule=calls.checkpoints,
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
