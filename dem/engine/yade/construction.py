"""Construct the materials, engines and functors of YADE that a scene needs.

A scene needs some of the effects in `dem.engine.effect.EffectName`, such as contacts or motors. `ADDS` lists what each
effect needs.
"""

import math
from collections.abc import Mapping
from typing import Any

from dem.engine.effect import Adds, EffectName
from dem.engine.yade.hinges import HINGE_MATERIAL, HingeLaw
from dem.engine.yade.library import Yade
from dem.physics.contact import ContactLaw

SMARTICLE_MATERIAL, WALL_MATERIAL, SEGMENT_MATERIAL = "smarticle", "wall", "segment"
# Masks, of which two bodies need a common bit to touch: nodes of filaments touch floor and wall, and segments touch
# segments. Nodes have the one bit within which YADE lets bodies of equal masks not touch.
OF_SEGMENTS, OF_NODES, OF_BOUNDARIES = 1, 2, 6

ORDER = ("ForceResetter", "InsertionSortCollider", "InteractionLoop", "HarmonicMotionEngine", "NewtonIntegrator")
"""Order of YADE's engines in a step: forces of contacts, velocity of the container, motion of all bodies."""

# Gravity, friction and restitution add nothing: they are parameters of the integrator and of YADE's contact law for
# springs with dashpots, and may be zero. The torque cap is a comparison in each control update; under the laws slip and
# servo it is a parameter of a shaft's bond.
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
    EffectName.FILAMENTS: Adds(
        functors=(
            "Bo1_GridConnection_Aabb",
            "Ig2_GridNode_GridNode_GridNodeGeom6D",
            "Ig2_GridConnection_GridConnection_GridCoGridCoGeom",
            "Ip2_CohFrictMat_CohFrictMat_CohFrictPhys",
            "Ip2_FrictMat_FrictMat_FrictPhys",
            "Law2_ScGeom6D_CohFrictPhys_CohesionMoment",
            "Law2_GridCoGridCoGeom_FrictPhys_CundallStrack",
        ),
        materials=(HINGE_MATERIAL, SEGMENT_MATERIAL),
        shapes=("GridNode", "GridConnection"),
        python="internal damping and drag of all nodes in every step",
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

# Distance in radii that a sphere may move before neighbours are searched again. A larger distance means more pairs in
# every step, a smaller one more searches. Measured on a shaken pile (N = 494, l/w = 0.4, draft): 0.1 and 0.2 cost 17 %
# less than 0.4.
VERLET_DISTANCE = 0.15


def add_materials(yade: Yade, adds: Adds, law: ContactLaw) -> None:
    """Add the materials `adds.materials` to YADE's simulation, in that order.

    Args:
        adds: what all effects of the scene add.
        law: law of the contacts, from which stiffness and damping follow.
    """
    # YADE puts two materials in series, so that each has twice the contact's value. The wall's dashpot is chosen such
    # that in series with a smarticle's dashpot it gives `law.wall_damping`. `dem.engine.yade.assembly.clump` sets
    # masses, so that densities are zero.
    between = 2 * law.normal_damping
    wall = 1 / (1 / law.wall_damping - 1 / between) if law.wall_damping else 0.0
    dampings = {SMARTICLE_MATERIAL: between, WALL_MATERIAL: wall}
    for label in adds.materials:
        if label == SEGMENT_MATERIAL:
            # `add_engines` sets the stiffness of contacts of segments.
            material = yade.classes.FrictMat(density=0, frictionAngle=math.atan(law.friction), label=label)
        elif label == HINGE_MATERIAL:
            # Each bond gets a stiffness of its own; the material only selects YADE's law for bonds.
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
    """Make the engines and functors of `adds`, and add them to YADE's simulation.

    Args:
        yade: YADE, with the materials already added.
        adds: what all effects of the scene add.
        law: law of the contacts.
        hinges: law of the hinges; None where smarticles stay welded.
        gravity: g, downwards [m/s²].
        radius: radius of the spheres [m].
    """
    classes = yade.classes
    # 0 and 1 are the numbers of the materials of smarticles and wall.
    friction = classes.MatchMaker(matches=((0, 0, math.atan(law.friction)), (0, 1, math.atan(law.wall_friction))))
    settings: Mapping[str, Mapping[str, Any]] = {
        "Ip2_ViscElMat_ViscElMat_ViscElPhys": {"frictAngle": friction},
        # YADE's correction for sliding spheres would be wrong for nodes, which do not touch.
        "Ig2_GridNode_GridNode_GridNodeGeom6D": {"avoidGranularRatcheting": False},
        # Moments of filaments follow from the orientations of their nodes, without drift.
        "Law2_ScGeom6D_CohFrictPhys_CohesionMoment": {"useIncrementalForm": False}
        if hinges is None
        else {"useIncrementalForm": True, "shear_creep": True, "creep_viscosity": hinges.damper_viscosity},
        "Ip2_FrictMat_FrictMat_FrictPhys": {
            "kn": classes.MatchMaker(algo="val", val=law.normal_stiffness),
            "ks": classes.MatchMaker(algo="val", val=law.tangential_stiffness),
        },
        "InsertionSortCollider": {"verletDist": VERLET_DISTANCE * radius}
        | ({"avoidSelfInteractionMask": OF_NODES, "targetInterv": -1} if SEGMENT_MATERIAL in adds.materials else {}),
        "HarmonicMotionEngine": {"dead": True},
        "NewtonIntegrator": {"damping": 0, "gravity": yade.vector(0, 0, -gravity), "exactAsphericalRot": True},
    }

    def functors(prefix: str) -> list[Any]:
        # A functor's prefix tells its dispatcher.
        return [getattr(classes, name)(**settings.get(name, {})) for name in adds.functors if name.startswith(prefix)]

    dispatched = {
        "InsertionSortCollider": (functors("Bo1_"),),
        "InteractionLoop": (functors("Ig2_"), functors("Ip2_"), functors("Law2_")),
    }
    yade.omega.engines = [
        getattr(classes, name)(*dispatched.get(name, ()), **settings.get(name, {}))
        for name in sorted(adds.engines, key=ORDER.index)
    ]
