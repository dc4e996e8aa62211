"""The effects that a scene may call for: for each one whether a scene does, why, and what it adds to a run.

This is the one place that knows, together with the engine, which is asked what an effect adds to it. `dem.plan.outlook`
prints it, `dem.run` makes a run from it, and tests hold an engine's own lists and the files of runs against it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from dem.engine.effect import Adds, EffectName
from dem.engine.kinds import EngineKind, engine_kind
from dem.plan import calls
from dem.record.columns import (
    COLUMNS,
    ENERGY_COLUMNS,
    FORCE_FIELDS,
    HOOK_COLUMNS,
    LEDGER_COLUMNS,
    MOTOR_COLUMNS,
    RELEASE_COLUMNS,
    STRAIN_COLUMNS,
)
from dem.scene.scene import Scene

Rule = Callable[[Scene], tuple[bool, str]]
"""Whether a scene calls for an effect, and why."""


_NOTHING = Adds()


@dataclass(frozen=True, kw_only=True)
class Effect:
    """One effect, for all scenes.

    Args:
        name: which one.
        rule: whether a scene calls for it, and why.
        adds: what it adds where a scene does, whatever the engine.
    """

    name: EffectName
    rule: Rule
    adds: Adds = _NOTHING

    def decided(self, scene: Scene, kind: EngineKind) -> Decision:
        """What it comes to in a scene on an engine."""
        on, why = self.rule(scene)
        adds = Adds.together((kind.adds(self.name), self.adds)) if on else _NOTHING
        return Decision(self.name, on, why, adds)


@dataclass(frozen=True)
class Decision:
    """One effect in one scene: whether it is on, why, and what it adds: nothing where it is off."""

    name: EffectName
    on: bool
    why: str
    adds: Adds


def decide(scene: Scene) -> tuple[Decision, ...]:
    """All effects of a scene on its engine, on or off."""
    kind = engine_kind(scene.engine)
    return tuple(effect.decided(scene, kind) for effect in EFFECTS)


def called_for(scene: Scene, name: EffectName) -> bool:
    """Whether a scene calls for an effect."""
    return next(effect for effect in EFFECTS if effect.name is name).rule(scene)[0]


EFFECTS = (
    Effect(
        name=EffectName.CONTACT,
        rule=lambda _: (True, "every scene has smarticles that touch each other and a floor"),
    ),
    Effect(name=EffectName.CONTAINER, rule=calls.container),
    Effect(name=EffectName.PLANE, rule=calls.plane),
    Effect(name=EffectName.STRINGS, rule=calls.strings, adds=Adds(series=tuple(STRAIN_COLUMNS))),
    Effect(name=EffectName.GRAVITY, rule=calls.gravity),
    Effect(name=EffectName.FRICTION, rule=calls.friction),
    Effect(name=EffectName.RESTITUTION, rule=calls.restitution),
    Effect(name=EffectName.CONTAINER_MOTION, rule=calls.container_motion),
    Effect(name=EffectName.ARTICULATION, rule=calls.articulation),
    Effect(
        name=EffectName.MOTORS,
        rule=calls.motors,
        adds=Adds(
            series=tuple(MOTOR_COLUMNS),
            arrays=("angle_rad", "motor_torque_N_m", "motor_work_J", "halted"),
        ),
    ),
    Effect(name=EffectName.TORQUE_CAP, rule=calls.torque_cap),
    Effect(name=EffectName.HOOKS, rule=calls.hooks, adds=Adds(series=tuple(HOOK_COLUMNS))),
    Effect(
        name=EffectName.WALL_REMOVAL,
        rule=calls.wall_removal,
        adds=Adds(series=tuple(RELEASE_COLUMNS), python="looks at the pile's top every 10 ms while the wall is lifted"),
    ),
    Effect(name=EffectName.ENERGIES, rule=calls.energies, adds=Adds(series=tuple(ENERGY_COLUMNS))),
    Effect(name=EffectName.ENERGY_ACCOUNT, rule=calls.energy_account, adds=Adds(series=tuple(LEDGER_COLUMNS))),
    Effect(
        name=EffectName.SERIES,
        rule=calls.series,
        adds=Adds(
            series=tuple(COLUMNS), files=("series.h5",), python="reads the state of all smarticles once per sample"
        ),
    ),
    Effect(
        name=EffectName.FRAMES,
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
    ),
    Effect(
        name=EffectName.CONTACT_FORCES,
        rule=calls.contact_forces,
        adds=Adds(
            arrays=tuple(FORCE_FIELDS),
            files=("forces.pvd", "forces"),
            python="reads the forces of all contacts and writes one file per frame",
        ),
    ),
    Effect(
        name=EffectName.SPHERE_GLYPHS,
        rule=calls.sphere_glyphs,
        adds=Adds(files=("spheres.pvd", "spheres"), python="writes one file per interval, a point per sphere"),
    ),
    Effect(
        name=EffectName.CHECKPOINTS,
        rule=calls.checkpoints,
        adds=Adds(files=("checkpoint.zip", "checkpoint.previous.zip")),
    ),
)
