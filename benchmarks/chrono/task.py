"""A scene in the words that `driver.cpp` reads: everything of it that is not the engine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from benchmarks.chrono.cases import SERIES
from benchmarks.rivals.given import Given
from dem.body.particle import Boxes
from dem.errors import InputError
from dem.scene.scene import Scene

Array = NDArray[np.float64]
Words = Mapping[str, Sequence[float]]

LAWS = ("halt", "stall", "ease")
# Of τ_max: what a barb that turns round may take of the motor by the text's rules. By those a barb that jumps to its
# speed exceeds τ_max by its own inertia, halts, and never moves. The code's rule jumps, as the paper's code does.
SHARE_OF_INERTIA = 0.5


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Of the engine; defaults are the paper's code's, 78f1da2 of `wsavoie/SmarticleSim`, where it says something.

    Args:
        time_step: dt [s].
        iterations: of the solver, at each step; None: 50 + 1.2 N.
        envelope: by how much shapes are wider for the search of contacts [m].
        margin: by how much smaller they are inside, rounded up again [m].
        recovery: greatest speed at which overlap is taken back [m/s]; what the engine ships, since the code is silent.
        settle: time in which poses of another engine come to rest, before anything is measured [s].
        slow: first part of it, in which what overlaps is not to fly apart [s].
        slow_recovery: the greatest speed at which it is taken back meanwhile [m/s].
        breaking: distance at which a point of contact is forgotten [m].
        facets: flat walls in place of the cylinder; they touch it from outside.
        wall_height: [m]; 0: neither wall nor floor.
        warm_start: whether the solver begins with the step before.
    """

    time_step: float = 2e-4
    iterations: int | None = None
    envelope: float = 5e-6
    margin: float = 2.5e-6
    recovery: float = 0.6
    settle: float = 0.3
    slow: float = 0.1
    slow_recovery: float = 0.02
    breaking: float = 1e-4
    facets: int = 25
    wall_height: float = 0.15
    warm_start: bool = False


PAPER = Settings()
SETTINGS: Mapping[str, Settings] = MappingProxyType({"chrono": PAPER, "chrono-warm": Settings(warm_start=True)})
"""By what `benchmarks.chrono.cases` calls an engine: the paper's, and the same with a solver that comes further."""


def steps_of(seconds: float, settings: Settings) -> int:
    """Steps of a time that is a whole number of them.

    Raises:
        InputError: It is not.
    """
    steps = round(seconds / settings.time_step)
    if not np.isclose(steps * settings.time_step, seconds, rtol=1e-9):
        msg = f"time step {settings.time_step:g} s: {seconds:g} s are not a whole number of it; use 2e-4 or 5e-4 s"
        raise InputError(msg)
    return steps


def words(scene: Scene, settings: Settings = PAPER) -> dict[str, Sequence[float]]:
    """What the driver is told.

    Args:
        scene: take-over, rest, activity, rest; see `benchmarks.chrono.cases`.
        settings: of the engine.

    Raises:
        InputError: The motors' law is one that the driver does not know, or times are not whole numbers of steps.
    """
    given = Given(scene, Path(), SERIES)
    settle, rest = steps_of(settings.settle, settings), steps_of(given.rest_s, settings)
    active = steps_of(given.activity_s, settings)
    after = steps_of(float(scene.phases[-1].known_duration or 0.0), settings)
    told = of_engine(settings, scene.count)
    told |= of_smarticle(scene, settings)
    told |= {
        "radius_m": [scene.container.radius_m],
        "slow_steps": [steps_of(settings.slow, settings)],
        "settle_steps": [settle],
        "rest_steps": [rest],
        "steps": [settle + rest + active + after],
        "look_steps": [steps_of(SERIES, settings)],
        "targets_rad": schedule(given, active, settings.time_step),
        "poses": poses(given.state.link_positions, given.state.link_rotations),
    }
    return told


def of_engine(settings: Settings, count: int) -> dict[str, Sequence[float]]:
    """What the engine is set to."""
    iterations = settings.iterations if settings.iterations is not None else round(50 + 1.2 * count)
    return {
        "time_step_s": [settings.time_step],
        "iterations": [iterations],
        "tolerance": [0.0],
        "warm_start": [int(settings.warm_start)],
        "envelope_m": [settings.envelope],
        "margin_m": [settings.margin],
        "breaking_threshold_m": [settings.breaking],
        "recovery_m_per_s": [settings.recovery],
        "settle_recovery_m_per_s": [settings.slow_recovery],
        "facets": [settings.facets],
        "wall_height_m": [settings.wall_height],
        "held": [0],
    }


def of_smarticle(scene: Scene, settings: Settings) -> dict[str, Sequence[float]]:
    """Links, motors and friction.

    Raises:
        InputError: The motors' law is one that the driver does not know.
    """
    law, boxes = scene.motor.law, scene.particle.boxes
    if law not in LAWS:
        msg = f"motor.law: {law} is not a rule of the paper; use one of: {', '.join(LAWS)}"
        raise InputError(msg)
    given = Given(scene, Path(), SERIES)
    jumps = law == "ease"
    acceleration = 0.0 if jumps else SHARE_OF_INERTIA * given.torque_limit / barb_inertia(boxes)
    return {
        "friction": [scene.contact.friction_smarticle],
        "gravity_m_per_s2": [scene.gravity_m_per_s2],
        "law": [LAWS.index(law)],
        "torque_limit_N_m": [given.torque_limit],
        "speed_limit_rad_per_s": [scene.motor.speed_limit_rad_per_s],
        "acceleration_limit_rad_per_s2": [acceleration],
        "angle_rad": [boxes.angles[0]],
        "link_sizes_m": sizes(boxes).ravel().tolist(),
        "link_masses_kg": boxes.link_masses.tolist(),
        "link_inertias_kg_m2": boxes.link_inertias.ravel().tolist(),
    }


def sizes(boxes: Boxes) -> Array:
    """(3, 3) of each link along its length, in the plane, along the normal [m]."""
    thick = np.column_stack([boxes.thicknesses_in_plane, np.full(3, boxes.thickness_normal)])
    return np.column_stack([boxes.lengths, thick])


def barb_inertia(boxes: Boxes) -> float:
    """Of a barb about its hinge [kg m²]."""
    return float(boxes.link_inertias[0, 2] + boxes.link_masses[0] * (boxes.barb_length / 2) ** 2)


def schedule(given: Given, steps: int, time_step: float) -> list[float]:
    """Angle of all barbs at the end of each step of the activity [rad].

    Raises:
        InputError: They do not all have the same.
    """
    targets = np.array([given.gait.targets((k + 1) * time_step) for k in range(steps)])
    if np.ptp(targets, axis=(1, 2)).max() > 0:
        msg = "the driver knows one schedule for all barbs; use a phase in which all barbs move alike"
        raise InputError(msg)
    first: list[float] = targets[:, 0, 0].tolist()
    return first


def poses(positions: Array, frames: Array) -> list[float]:
    """Place and quaternion, scalar first, of each link.

    Args:
        positions: (N, 3, 3) centres of the links [m].
        frames: (N, 3, 3, 3) their axes as columns.
    """
    turns = Rotation.from_matrix(frames.reshape(-1, 3, 3)).as_quat()[:, [3, 0, 1, 2]]
    rows: list[float] = np.column_stack([positions.reshape(-1, 3), turns]).ravel().tolist()
    return rows


def written(told: Words) -> str:
    """As the driver reads it: a name, how many values, the values; numbers to the last bit."""
    return "".join(
        f"{name} {len(values)} {' '.join(repr(float(value)) for value in values)}\n" for name, values in told.items()
    )
