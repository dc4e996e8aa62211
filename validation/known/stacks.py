"""Stacks at rest: what each contact carries is the weight above it, as `Engine.contact_forces` tells it."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from dem.body.forces import FLOOR, ContactForces
from dem.engine.interface import Engine
from dem.plan.steps import time_step
from validation.bench import FLAT, Array, G, add, law_of, scene
from validation.check import Answer
from validation.engines import EngineAccess

SETTLED = 0.4  # s
REASON = "what is left of the vibration after 0.4 s"


def _level(found: ContactForces, level: int, each: int) -> Array:
    """(contacts, 3) forces on a level of `each` bodies from below [N]."""
    bodies = found.smarticles // each
    if level:
        below = (bodies == (level - 1, level)).all(axis=1)
        upwards: Array = -found.forces[below]
    else:
        upwards = found.forces[found.fixtures == FLOOR]
    return upwards


def _answers(engine: Engine, levels: int, each: int, *, contacts: int | None) -> list[Answer]:
    """What the contacts below each level carry; of `contacts` alike each its share."""
    found = engine.contact_forces()
    weight = each * engine.particle.boxes.mass * G
    answers = []
    for level in range(levels):
        forces = _level(found, level, each)
        upwards, across = forces[:, 2].tolist(), float(np.linalg.norm(forces[:, :2].sum(axis=0)))
        bears, below = (levels - level) * weight, f"level {level - 1}" if level else "the floor"
        told = [("sum of the forces", sum(upwards), bears)]
        if level and contacts is not None:
            told += [("least force of a contact", min(upwards, default=math.nan), bears / contacts)]
            told += [("largest force of a contact", max(upwards, default=math.nan), bears / contacts)]
        answers += [
            Answer(
                quantity=f"{what}, level {level} on {below}",
                unit="N",
                theory=theory,
                measured=measured,
                tolerance=1e-5,
                reason=REASON,
            )
            for what, measured, theory in told
        ]
        answers.append(
            Answer(
                quantity=f"sum across, level {level} on {below}",
                unit="N",
                theory=0.0,
                measured=across,
                tolerance=1e-5,
                reason=f"nothing pulls sideways; {REASON}",
                scale=bears,
            )
        )
    return answers


def crossed_bars(access: EngineAccess, *, levels: int = 5) -> list[Answer]:
    """Pairs of bars, each pair across the one below: every contact bears a quarter of what is above it."""
    one = scene(access, fidelity="standard", smarticle={"aspect_ratio": 0})
    engine = access.build(one.particle, law_of(one), dt=time_step(one), gravity=G)
    radius = one.particle.radius
    apart = 2 * radius * round(one.particle.boxes.middle_length / 6 / radius)
    for level in range(levels):
        turn = Rotation.from_euler("z", 90 * (level % 2), degrees=True)
        for side in (-1, 1):
            add(engine, (*turn.apply([0.0, side * apart, 0.0])[:2], (2 * level + 1) * radius), turn)
    engine.advance(round(SETTLED / engine.time_step))
    return _answers(engine, levels, 2, contacts=4)


def flat_smarticles(access: EngineAccess, *, levels: int = 4) -> list[Answer]:
    """Smarticles of the paper lie flat on each other, link on link."""
    one = scene(access, fidelity="standard")
    engine = access.build(one.particle, law_of(one), dt=time_step(one), gravity=G)
    high = float(np.ptp(one.particle.centres[:, 2])) + 2 * one.particle.radius
    for level in range(levels):
        add(engine, (0.0, 0.0, (level + 0.5) * high), FLAT)
    engine.advance(round(SETTLED / engine.time_step))
    return _answers(engine, levels, 1, contacts=None)
