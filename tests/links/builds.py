"""Small simulations on the links engine, built by hand. SI throughout."""

import math
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from dem.body.particle import Boxes, Particle, SphereChain, mean_width
from dem.body.placement import Poses, place_layer
from dem.engine.links import compiler
from dem.engine.links.engine import LinksEngine
from dem.physics.contact import ContactLaw
from dem.physics.motor import MotorLaw
from dem.setting.container import Cylinder

W, T1, T2, DENSITY = 11.7e-3, 1.27e-3, 0.5e-3, 7850.0
DIAMETER = mean_width(T1, T2)
TORQUE = 1.607e-5
LAW = ContactLaw(
    normal_stiffness=500.0,
    tangential_stiffness=410.0,
    normal_damping=0.03,
    wall_damping=0.04,
    tangential_damping=0.9,
    friction=0.4,
    wall_friction=0.4,
)
ELASTIC = ContactLaw(
    normal_stiffness=500.0,
    tangential_stiffness=410.0,
    normal_damping=0.0,
    wall_damping=0.0,
    tangential_damping=0.0,
    friction=0.0,
    wall_friction=0.0,
)


def callable_from_python(part: Any) -> Any:
    """A part of the kernels that tests can call."""
    return compiler.callable_from_python(part.py_func)


def boxes(aspect: float = 0.7, angles: tuple[float, float] = (math.pi / 2, math.pi / 2)) -> Boxes:
    return Boxes(
        middle_length=W,
        barb_length=aspect * W,
        thickness_normal=T1,
        thickness_in_plane=T2,
        density=DENSITY,
        angles=angles,
    )


def particle(aspect: float = 0.7, angles: tuple[float, float] = (math.pi / 2, math.pi / 2), rows: int = 1) -> Particle:
    diameter = DIAMETER if rows == 1 else T2
    return Particle(boxes(aspect, angles), SphereChain(rows=rows, diameter=diameter, pitch=0.35 * diameter))


def motor_law(law: str = "halt", **more: float) -> MotorLaw:
    return MotorLaw(**{"torque_limit": TORQUE, "speed_limit": 6.0, "stiffness": 3e-3, "law": law} | more)


def engine(
    *,
    law: ContactLaw = LAW,
    gravity: float = 0.0,
    dt: float = 5e-5,
    radius: float = 1.0,
    height: float = 10.0,
    made_of: Particle | None = None,
    upper: tuple[tuple[float, float], ...] = (),
    **more: object,
) -> LinksEngine:
    return LinksEngine(
        particle=made_of or particle(),
        cylinder=Cylinder(radius=radius, height=height, facets=64, upper=upper),
        law=law,
        gravity=gravity,
        time_step=dt,
        **{"shaken": True, **more},
    )


def at(positions: object, rotations: list[Rotation] | None = None) -> Poses:
    places = np.atleast_2d(np.array(positions, dtype=float))
    return Poses(places, tuple(rotations or [Rotation.identity()] * len(places)))


def pile(made: LinksEngine, count: int, *, seed: int = 1, settle: float = 0.3, per_layer: int = 10) -> LinksEngine:
    """Pour layer on layer into the cylinder, and wait."""
    rng = np.random.default_rng(seed)
    p, radius = made.particle, made.cylinder.radius
    while made.count < count:
        state = made.state()
        tops = state.vertices[..., 2].max(axis=1)
        top = tops.max(initial=made.boundaries.floor)
        near = tops > top - 2 * p.radius
        made.add(
            place_layer(
                p,
                count=min(per_layer, count - made.count),
                radius=radius,
                bottom=top + p.radius,
                height=W,
                obstacles=state.spheres(p)[near].reshape(-1, 3),
                rng=rng,
            )
        )
        made.advance(round(0.06 / made.time_step))
    made.advance(round(settle / made.time_step))
    return made
