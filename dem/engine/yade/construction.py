"""What each effect adds on YADE, by name, and materials and engines made of it: of what exists, nothing else."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from dem.engine.effect import Adds, EffectName
from dem.engine.yade.assembly import SMARTICLE_MATERIAL
from dem.engine.yade.container import WALL_MATERIAL
from dem.engine.yade.hinges import HINGE_MATERIAL, HingeLaw
from dem.engine.yade.library import Yade
from dem.physics.contact import ContactLaw

# In every step: contacts give forces, what is driven gets its velocity, then everything moves.
ORDER = ("ForceResetter", "InsertionSortCollider", "InteractionLoop", "HarmonicMotionEngine", "NewtonIntegrator")

# Gravity, friction and restitution are numbers of the integrator and of the one contact law that YADE has for springs
# with dashpots: there is none without friction or without dashpots, so that a scene that sets them to zero has the same
# sums with a zero in them. The torque cap is a comparison in each look; the law slip gives each bond of a shaft a cap.
ADDS: Mapping[EffectName, Adds] = {
    EffectName.CONTACT: Adds(
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
    EffectName.CONTAINER: Adds(functors=("Bo1_Facet_Aabb", "Ig2_Facet_Sphere_ScGeom"), shapes=("Facet",)),
    EffectName.PLANE: Adds(
        python="three degrees of freedom blocked for each body; sums the forces on two walls in every step"
    ),
    EffectName.STRINGS: Adds(python="two forces in every step"),
    EffectName.CONTAINER_MOTION: Adds(engines=("HarmonicMotionEngine",)),
    EffectName.ARTICULATION: Adds(
        functors=(
            "Ig2_GridNode_GridNode_GridNodeGeom6D",
            "Ip2_CohFrictMat_CohFrictMat_CohFrictPhys",
            "Law2_ScGeom6D_CohFrictPhys_CohesionMoment",
        ),
        materials=(HINGE_MATERIAL,),
        shapes=("GridNode",),
        python="while articulated three bodies and four bonds per smarticle; a shorter time step throughout",
    ),
    EffectName.MOTORS: Adds(python="two readings per smarticle and look"),
    EffectName.HOOKS: Adds(
        functors=("Bo1_Box_Aabb", "Ig2_Box_Sphere_ScGeom"),
        shapes=("Box",),
        python="sums the forces on four bars in every step",
    ),
    EffectName.ENERGIES: Adds(python="sums the forces on what moves in every step, while anything does"),
    EffectName.ENERGY_ACCOUNT: Adds(python="reads every contact twice per sample"),
    EffectName.CHECKPOINTS: Adds(python="saves and reloads the simulation once per checkpoint"),
}

# How far a sphere may move before neighbours are looked for again, in radii: a larger distance means more pairs to look
# at in every step, a smaller one more searches. Measured on a shaken pile (N = 494, l/w = 0.4, draft): 0.2 costs
# 17 % less than 0.4, 0.1 as much as 0.2.
VERLET_DISTANCE = 0.15


def in_order(engines: Sequence[str]) -> tuple[str, ...]:
    """Engines in the order in which a step runs them."""
    return tuple(sorted(engines, key=ORDER.index))


def add_materials(yade: Yade, adds: Adds, law: ContactLaw) -> None:
    """Add the materials of smarticles, container and, where there are any, hinges."""
    # YADE joins two materials in series, so each carries twice the contact's value. The wall's dashpot is chosen
    # such that the series with a smarticle's gives the wall's. Density zero: the spheres weigh nothing, the
    # mass comes from a ballast that is taken away again (see `dem.engine.yade.clump`).
    between = 2 * law.normal_damping
    wall = 1 / (1 / law.wall_damping - 1 / between) if law.wall_damping else 0.0
    dampings = {SMARTICLE_MATERIAL: between, WALL_MATERIAL: wall}
    for label in adds.materials:
        if label == HINGE_MATERIAL:
            # Every bond is given its stiffness by hand; this only tells YADE which law it belongs to.
            material = yade.classes.CohFrictMat(density=0, young=1, poisson=0, isCohesive=False, label=label)
        else:
            material = yade.classes.ViscElMat(
                density=0,
                kn=2 * law.normal_stiffness,
                ks=2 * law.tangential_stiffness,
                cn=dampings[label],
                cs=dampings[label] * law.tangential_damping,
                label=label,
            )
        yade.omega.materials.append(material)


def add_engines(
    yade: Yade,
    adds: Adds,
    law: ContactLaw,
    *,
    hinges: HingeLaw | None,
    gravity: float,
    radius: float,
) -> None:
    """Make the engines and give them to the simulation.

    Args:
        yade: the simulation.
        adds: what is to be made, see `ADDS`.
        law: contact law.
        hinges: stiffness of the hinges, where there are any.
        gravity: g, downwards [m/s²].
        radius: of the spheres [m].
    """
    classes = yade.classes
    # The materials of smarticles and wall are the first two.
    friction = classes.MatchMaker(matches=((0, 0, math.atan(law.friction)), (0, 1, math.atan(law.wall_friction))))
    settings: Mapping[str, Mapping[str, Any]] = {
        "Ip2_ViscElMat_ViscElMat_ViscElPhys": {"frictAngle": friction},
        # The correction for sliding spheres would falsify the motion of nodes that do not touch.
        "Ig2_GridNode_GridNode_GridNodeGeom6D": {"avoidGranularRatcheting": False},
        "Law2_ScGeom6D_CohFrictPhys_CohesionMoment": {
            "useIncrementalForm": True,
            "shear_creep": True,
            "creep_viscosity": 0.0 if hinges is None else hinges.damper_viscosity,
        },
        "InsertionSortCollider": {"verletDist": VERLET_DISTANCE * radius},
        "HarmonicMotionEngine": {"dead": True},
        "NewtonIntegrator": {
            "damping": 0,
            "gravity": yade.vector(0, 0, -gravity),
            "exactAsphericalRot": True,
        },
    }

    def functors(prefix: str) -> list[Any]:
        # YADE's names tell which dispatcher a functor is for.
        return [getattr(classes, name)(**settings.get(name, {})) for name in adds.functors if name.startswith(prefix)]

    dispatched = {
        "InsertionSortCollider": (functors("Bo1_"),),
        "InteractionLoop": (functors("Ig2_"), functors("Ip2_"), functors("Law2_")),
    }
    yade.omega.engines = [
        getattr(classes, name)(*dispatched.get(name, ()), **settings.get(name, {})) for name in in_order(adds.engines)
    ]
