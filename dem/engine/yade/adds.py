"""What each effect adds on YADE: its classes by name, and what Python does beside them."""

from __future__ import annotations

from collections.abc import Mapping

from dem.engine.effect import Adds, EffectName
from dem.engine.yade.assembly import SMARTICLE_MATERIAL
from dem.engine.yade.container import WALL_MATERIAL
from dem.engine.yade.hinges import HINGE_MATERIAL

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
