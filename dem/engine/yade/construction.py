"""What each effect adds on YADE, by name, and the materials and engines made of it; nothing else exists."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from dem.engine.effect import Adds, EffectName
from dem.engine.yade.hinges import HINGE_MATERIAL, HingeLaw
from dem.engine.yade.library import Yade
from dem.physics.contact import ContactLaw

SMARTICLE_MATERIAL, WALL_MATERIAL = "smarticle", "wall"

ORDER = ("ForceResetter", "InsertionSortCollider", "InteractionLoop", "HarmonicMotionEngine", "NewtonIntegrator")
"""Order of YADE's engines in a step: contacts give forces, the container gets its velocity, then all moves."""

# Gravity, friction and restitution are numbers of the integrator and of the one contact law that YADE has for springs
# with dashpots, zero where a scene sets them to zero. The torque cap is a comparison in each control update; the law
# slip gives each bond of a shaft a cap.
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
    EffectName.MOTORS: Adds(python="two readings per smarticle and control update"),
    EffectName.HOOKS: Adds(
        functors=("Bo1_Box_Aabb", "Ig2_Box_Sphere_ScGeom"),
        shapes=("Box",),
        python="sums the forces on four bars in every step",
    ),
    EffectName.ENERGIES: Adds(python="sums the forces on what moves in every step, while anything does"),
    EffectName.ENERGY_ACCOUNT: Adds(python="reads every contact twice per sample"),
    EffectName.CHECKPOINTS: Adds(python="saves and reloads the simulation once per checkpoint"),
}

# How far a sphere may move before neighbours are searched again, in radii: a larger distance means more pairs in every
# step, a smaller one more searches. Measured on a shaken pile (N = 494, l/w = 0.4, draft): 0.2 costs 17 % less than
# 0.4, 0.1 as much as 0.2.
VERLET_DISTANCE = 0.15


def add_materials(yade: Yade, adds: Adds, law: ContactLaw) -> None:
    """Add the materials of smarticles, container and, where there are any, hinges."""
    # YADE joins two materials in series, so each carries twice the contact's value. The wall's dashpot is chosen such
    # that the series with a smarticle's gives the wall's. Density zero: see `dem.engine.yade.assembly.clump`.
    between = 2 * law.normal_damping
    wall = 1 / (1 / law.wall_damping - 1 / between) if law.wall_damping else 0.0
    dampings = {SMARTICLE_MATERIAL: between, WALL_MATERIAL: wall}
    for label in adds.materials:
        if label == HINGE_MATERIAL:
            # Bonds get their stiffness one by one; the material only selects YADE's law for them.
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
    yade: Yade, adds: Adds, law: ContactLaw, *, hinges: HingeLaw | None, gravity: float, radius: float
) -> None:
    """Make the engines and give them to the simulation; g is downwards [m/s²], the spheres have a radius [m]."""
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
        "NewtonIntegrator": {"damping": 0, "gravity": yade.vector(0, 0, -gravity), "exactAsphericalRot": True},
    }

    def functors(prefix: str) -> list[Any]:
        # The beginning of a functor's name is that of its dispatcher.
        return [getattr(classes, name)(**settings.get(name, {})) for name in adds.functors if name.startswith(prefix)]

    dispatched = {
        "InsertionSortCollider": (functors("Bo1_"),),
        "InteractionLoop": (functors("Ig2_"), functors("Ip2_"), functors("Law2_")),
    }
    yade.omega.engines = [
        getattr(classes, name)(*dispatched.get(name, ()), **settings.get(name, {}))
        for name in sorted(adds.engines, key=ORDER.index)
    ]
